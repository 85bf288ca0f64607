//! The matrix file: the exchange matrix S = diag(A) F, symmetric, stored once, as blocks over the cluster order.
//! A matrix that is not symmetric (measured or computed elsewhere) has blocks on both sides of the diagonal.
//!
//! Element pairs whose entry is zero by proof are in no block. A file may hold only part of the blocks; a [`Matrix`] is
//! made of all its parts.

mod block;
mod check;
mod packed;
mod parts;
mod row;
mod values;
mod writer;

use crate::container::{File, Kind};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::provenance::Provenance;
use crate::tool::progress;
use serde::{Deserialize, Serialize};
use std::path::Path;

pub use block::{Block, BlockKind, BlockView, views};
pub use packed::PackedBlock;
pub use row::RowEntry;
pub use values::{Precision, Values};
pub use writer::{MatrixWriter, write};

/// The part of the header that is the matrix's own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MatrixRecord {
    /// Elements of the mesh: rows of S.
    pub elements: u32,
    /// Identity of that mesh.
    pub mesh: Digest,
    /// Type of the entries.
    pub precision: Precision,
    /// Whether the mirror image of each block is part of the matrix.
    pub symmetric: bool,
    /// Whether specular paths are counted (extended form factors).
    pub extended: bool,
    /// Asked bound on the sum over j of |error of F_ij| in any row.
    pub tolerance: f64,
    /// Which part of the blocks this file holds, from 0.
    pub part: u32,
    /// Into how many parts the blocks were divided.
    pub parts: u32,
}

/// Sections that grow with the number of entries.
const ENTRY_SECTIONS: [&str; 2] = ["values", "sparse"];

/// One mapped file.
type PartFile = File<MatrixRecord>;

impl PartFile {
    fn blocks(&self) -> Result<&[Block]> {
        self.section("blocks")
    }

    fn values(&self) -> Result<Values<'_>> {
        Ok(match self.record.precision {
            Precision::F32 => Values::F32(self.section("values")?),
            Precision::F64 => Values::F64(self.section("values")?),
        })
    }

    /// Rows and columns of the sparse blocks; files of version 1.0 have none.
    fn structure(&self) -> Result<&[u32]> {
        if self.has("sparse") { self.section("sparse") } else { Ok(&[]) }
    }

    fn areas(&self) -> Result<&[f64]> {
        self.counted_section("areas", self.record.elements as usize)
    }

    fn row_errors(&self) -> Result<&[f64]> {
        self.counted_section("row_errors", self.record.elements as usize)
    }

    /// Row sums of F as the writer found them; `None` where it left them out.
    fn row_sums(&self) -> Result<Option<&[f64]>> {
        if !self.has("row_sums") {
            return Ok(None);
        }
        self.counted_section("row_sums", self.record.elements as usize).map(Some)
    }
}

/// A mapped matrix: one file, or all parts of one.
#[derive(Debug)]
pub struct Matrix {
    /// By part; one, unless all parts of a matrix were opened.
    files: Vec<PartFile>,
    /// Sums over the files.
    row_errors: Vec<f64>,
    /// Whether the entries were verified when the files were opened.
    verified: bool,
}

impl Matrix {
    /// Maps and checks a matrix file, which must hold the whole matrix.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_all(&[path])
    }

    /// Maps and checks a matrix file that may be a part of a matrix: to be described or combined, not to be taken for the
    /// whole.
    pub fn open_part(path: &Path) -> Result<Self> {
        let file = File::open(path, Kind::Matrix)?;
        check::all_but_entries(&file)?;
        check::entries(&file)?;
        let row_errors = file.row_errors()?.to_vec();
        Ok(Self { files: vec![file], row_errors, verified: true })
    }

    /// [`Matrix::open_part`] without a look at the entries, however large the file is: header, blocks, areas, row errors
    /// and row sums are checked, the entries and the structure of sparse blocks are only mapped. To be described, never to
    /// be computed with: only [`Matrix::row`] may be asked for entries, which checks what it reads as far as it can be
    /// told from the entries themselves.
    pub fn glance_part(path: &Path) -> Result<Self> {
        let file = File::glance(path, Kind::Matrix, &ENTRY_SECTIONS)?;
        check::all_but_entries(&file)?;
        let row_errors = file.row_errors()?.to_vec();
        Ok(Self { files: vec![file], row_errors, verified: false })
    }

    /// Whether the checksums of the entries were verified.
    pub fn is_verified(&self) -> bool {
        self.verified
    }

    /// Refuses a matrix that was not computed for the mesh with this digest.
    pub fn belongs_to(&self, mesh_path: &Path, mesh: Digest, elements: usize) -> Result<()> {
        let record = self.record();
        if record.mesh == mesh {
            return Ok(());
        }
        let detail = format!(
            "the matrix was computed for mesh {} with {} elements, this one is {} with {elements}",
            record.mesh.short(),
            record.elements,
            mesh.short()
        );
        let remedy = "run formfactor-tool compute on this mesh".into();
        Err(Error::Mismatch { first: self.path().into(), second: mesh_path.into(), detail, remedy })
    }

    /// The matrix's own part of the header; of several files that of the first.
    pub fn record(&self) -> &MatrixRecord {
        &self.files[0].record
    }

    /// Where the file comes from; of several files the first.
    pub fn provenance(&self) -> &Provenance {
        &self.files[0].provenance
    }

    /// Identity of the file; of several files the digest of their digests.
    pub fn digest(&self) -> Digest {
        match &self.files[..] {
            [file] => file.digest(),
            files => Digest::of(&files.iter().flat_map(|f| f.digest().0).collect::<Vec<u8>>()),
        }
    }

    /// Path it was opened by; of several files that of the first part.
    pub fn path(&self) -> &Path {
        self.files[0].path()
    }

    /// Length of the file, or of all files, in bytes.
    pub fn length(&self) -> u64 {
        self.files.iter().map(File::length).sum()
    }

    /// Number of rows.
    pub fn element_count(&self) -> usize {
        self.record().elements as usize
    }

    /// Number of blocks.
    pub fn block_count(&self) -> Result<usize> {
        self.files.iter().map(|f| Ok(f.blocks()?.len())).sum()
    }

    /// Number of stored entries; each pair once.
    pub fn stored_entries(&self) -> Result<usize> {
        self.files.iter().map(|f| Ok(f.values()?.len())).sum()
    }

    /// All blocks with their entries, file after file.
    pub fn views(&self) -> Result<Vec<BlockView<'_>>> {
        let mut all = Vec::with_capacity(self.block_count()?);
        for file in &self.files {
            all.extend(views(file.blocks()?, file.values()?, file.structure()?));
        }
        Ok(all)
    }

    /// Areas A_i of the elements.
    pub fn areas(&self) -> Result<&[f64]> {
        self.files[0].areas()
    }

    /// Estimated sum over j of |error of F_ij|, per row i.
    pub fn row_errors(&self) -> Result<&[f64]> {
        Ok(&self.row_errors)
    }

    /// Row sums of F as the files state them, those of all parts added up; `None` where one leaves them out.
    pub fn stated_row_sums(&self) -> Result<Option<Vec<f64>>> {
        let mut sums = vec![0.0; self.element_count()];
        for file in &self.files {
            let Some(part) = file.row_sums()? else { return Ok(None) };
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        Ok(Some(sums))
    }

    /// Refuses row sums that are not those of the entries, which must have been verified. Returns those of the entries.
    pub fn check_row_sums(&self) -> Result<Vec<f64>> {
        let sums = self.row_sums()?;
        let stated = self.stated_row_sums()?;
        // Sums of n terms of one sign in two orders differ by less than n epsilon of themselves each, parts and the
        // division by the area by some more.
        let tolerance = (2 * self.element_count() + 8) as f64 * f64::EPSILON;
        let wrong = |(found, sum): (&f64, &f64)| (found - sum).abs() > tolerance * sum.abs();
        if let Some(stated) = stated
            && let Some(i) = stated.iter().zip(&sums).position(wrong)
        {
            let found = format!("{:e} at {i}", stated[i]);
            return Err(self.files[0].damaged(
                "row_sums",
                found,
                format!("{:e}, as the entries say", sums[i]),
            ));
        }
        Ok(sums)
    }

    /// Calls `visit(i, j, S_ij)` for every stored entry: each pair once with i <= j where the matrix is symmetric.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, f64)) -> Result<()> {
        for file in &self.files {
            views(file.blocks()?, file.values()?, file.structure()?)
                .for_each(|view| view.for_each(&mut visit));
        }
        Ok(())
    }

    /// Row sums of F: 1 in a closed scene, less by the share that escapes in an open one.
    pub fn row_sums(&self) -> Result<Vec<f64>> {
        let areas = self.areas()?;
        let mirrored = self.record().symmetric;
        let mut sums = vec![0.0; self.element_count()];
        let views = self.views()?;
        for view in progress("row sums", views.len()).wrap_iter(views.iter()) {
            view.for_each(|i, j, s| {
                sums[i] += s;
                if mirrored && i != j {
                    sums[j] += s;
                }
            });
        }
        Ok(sums.iter().zip(areas).map(|(sum, area)| sum / area).collect())
    }
}
