//! The matrix file: the exchange matrix S = diag(A) F, symmetric, stored once, as blocks over the cluster order.
//! A matrix that is not symmetric (measured or computed elsewhere) has blocks on both sides of the diagonal.
//!
//! Element pairs whose entry is zero by proof are in no block. A file may hold only part of the blocks.

use crate::atomic_write::Outcome;
use crate::container::{File, Kind, Writer};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::provenance::Provenance;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How a block stores its entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockKind {
    /// All entries, row after row.
    Dense,
    /// A square block on the diagonal: the upper triangle with the diagonal, row after row.
    Triangle,
}

/// Codes of the block kinds. 2 (sparse rows) and 3 (low rank U V^T) are reserved: readers refuse them by name.
const CODES: [(u32, BlockKind); 2] = [(0, BlockKind::Dense), (1, BlockKind::Triangle)];

/// A rectangle of S, rows before or equal to columns in cluster order; its mirror image is not stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Block {
    /// First row.
    pub row_start: u32,
    /// Number of rows.
    pub rows: u32,
    /// First column.
    pub column_start: u32,
    /// Number of columns.
    pub columns: u32,
    /// Code of the [`BlockKind`].
    pub code: u32,
    /// Rank of a low-rank block; 0 otherwise.
    pub rank: u32,
    /// First entry in the `values` section.
    pub offset: u64,
}

impl Block {
    /// A dense or triangular block.
    pub fn new(
        kind: BlockKind,
        rows: std::ops::Range<u32>,
        columns: std::ops::Range<u32>,
        offset: u64,
    ) -> Self {
        let code = CODES.iter().find(|(_, k)| *k == kind).map_or(0, |(code, _)| *code);
        Self {
            row_start: rows.start,
            rows: rows.len() as u32,
            column_start: columns.start,
            columns: columns.len() as u32,
            code,
            rank: 0,
            offset,
        }
    }

    /// Kind, or the code that is not known.
    pub fn kind(&self) -> std::result::Result<BlockKind, u32> {
        CODES.iter().find(|(code, _)| *code == self.code).map(|(_, kind)| *kind).ok_or(self.code)
    }

    /// Number of stored entries.
    pub fn stored(&self) -> u64 {
        match self.kind() {
            Ok(BlockKind::Triangle) => u64::from(self.rows) * (u64::from(self.rows) + 1) / 2,
            _ => u64::from(self.rows) * u64::from(self.columns),
        }
    }
}

/// Storage of the entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// 32-bit entries.
    F32,
    /// 64-bit entries.
    F64,
}

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

/// Entries in their stored precision.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// 32-bit.
    F32(&'a [f32]),
    /// 64-bit.
    F64(&'a [f64]),
}

impl Values<'_> {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entry `i`.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Values::F32(v) => f64::from(v[i]),
            Values::F64(v) => v[i],
        }
    }
}

/// Writes a matrix: its blocks, its entries, and per row the area A_i and the estimated sum over j of |error of F_ij|.
pub fn write(
    path: &Path,
    provenance: Provenance,
    record: MatrixRecord,
    blocks: &[Block],
    values: Values<'_>,
    areas: &[f64],
    row_errors: &[f64],
) -> Result<Outcome> {
    let writer = Writer::new(Kind::Matrix)
        .section("blocks", blocks)
        .section("areas", areas)
        .section("row_errors", row_errors);
    match values {
        Values::F32(v) => writer.section("values", v),
        Values::F64(v) => writer.section("values", v),
    }
    .write(path, provenance, record)
}

/// A mapped matrix file.
#[derive(Debug)]
pub struct Matrix {
    file: File<MatrixRecord>,
}

impl Matrix {
    /// Maps and checks a matrix file.
    pub fn open(path: &Path) -> Result<Self> {
        let matrix = Self { file: File::open(path, Kind::Matrix)? };
        matrix.check()?;
        Ok(matrix)
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

    /// The matrix's own part of the header.
    pub fn record(&self) -> &MatrixRecord {
        &self.file.record
    }

    /// Where the file comes from.
    pub fn provenance(&self) -> &Provenance {
        &self.file.provenance
    }

    /// Identity of the file.
    pub fn digest(&self) -> Digest {
        self.file.digest()
    }

    /// Path it was opened by.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Length of the file in bytes.
    pub fn length(&self) -> u64 {
        self.file.length()
    }

    /// Number of rows.
    pub fn element_count(&self) -> usize {
        self.record().elements as usize
    }

    /// Blocks, in the order of their entries.
    pub fn blocks(&self) -> Result<&[Block]> {
        self.file.section("blocks")
    }

    /// All entries.
    pub fn values(&self) -> Result<Values<'_>> {
        Ok(match self.record().precision {
            Precision::F32 => Values::F32(self.file.section("values")?),
            Precision::F64 => Values::F64(self.file.section("values")?),
        })
    }

    /// Areas A_i of the elements.
    pub fn areas(&self) -> Result<&[f64]> {
        self.file.counted_section("areas", self.element_count())
    }

    /// Estimated sum over j of |error of F_ij|, per row i.
    pub fn row_errors(&self) -> Result<&[f64]> {
        self.file.counted_section("row_errors", self.element_count())
    }

    /// Calls `visit(i, j, S_ij)` for every stored entry: each pair once with i <= j where the matrix is symmetric.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, f64)) -> Result<()> {
        let values = self.values()?;
        for block in self.blocks()? {
            let mut at = block.offset as usize;
            for row in 0..block.rows as usize {
                let first = if block.kind() == Ok(BlockKind::Triangle) { row } else { 0 };
                for column in first..block.columns as usize {
                    visit(
                        block.row_start as usize + row,
                        block.column_start as usize + column,
                        values.get(at),
                    );
                    at += 1;
                }
            }
        }
        Ok(())
    }

    /// Row sums of F: 1 in a closed scene, less by the share that escapes in an open one.
    pub fn row_sums(&self) -> Result<Vec<f64>> {
        let areas = self.areas()?;
        let mirrored = self.record().symmetric;
        let mut sums = vec![0.0; self.element_count()];
        self.for_each(|i, j, s| {
            sums[i] += s;
            if mirrored && i != j {
                sums[j] += s;
            }
        })?;
        Ok(sums.iter().zip(areas).map(|(sum, area)| sum / area).collect())
    }

    /// Refuses what this version has no use for: one part taken for the whole would silently lose light.
    fn check_is_whole(&self) -> Result<()> {
        let record = self.record();
        let refuse = |part: &str, found: String, expected: &str, remedy: &str| {
            Err(Error::format(self.path(), part, found, expected, remedy))
        };
        if (record.part, record.parts) != (0, 1) {
            let found = format!("part {} of {}", record.part, record.parts);
            return refuse("header", found, "a whole matrix", "compute the matrix in one file");
        }
        if record.extended {
            let remedy = "this program is older than the file: update it";
            return refuse("header", "extended true".into(), "extended false", remedy);
        }
        Ok(())
    }

    fn check(&self) -> Result<()> {
        self.check_is_whole()?;
        let elements = u64::from(self.record().elements);
        let values = self.values()?;
        let mut stored = 0u64;
        for (i, block) in self.blocks()?.iter().enumerate() {
            let part = format!("block {i}");
            let kind = block.kind().map_err(|code| {
                let remedy = "this program is older than the file: update it";
                Error::format(
                    self.path(),
                    part.as_str(),
                    format!("storage kind {code}"),
                    "0 (dense) or 1 (triangle)",
                    remedy,
                )
            })?;
            let rows_end = u64::from(block.row_start) + u64::from(block.rows);
            let columns_end = u64::from(block.column_start) + u64::from(block.columns);
            let (ordered, place) = match (kind, self.record().symmetric) {
                (BlockKind::Dense, true) => {
                    (rows_end <= u64::from(block.column_start), "a place above the diagonal of")
                }
                (BlockKind::Dense, false) => (true, "a place within"),
                (BlockKind::Triangle, true) => {
                    let square = block.row_start == block.column_start && block.rows == block.columns;
                    (square, "a square on the diagonal of")
                }
                (BlockKind::Triangle, false) => (false, "dense blocks, as the matrix is not symmetric, of"),
            };
            if rows_end > elements || columns_end > elements || !ordered {
                let expected = format!("{place} {elements} rows");
                return Err(self.file.damaged(&part, format!("{block:?}"), expected));
            }
            if block.offset != stored {
                return Err(self.file.damaged(
                    &part,
                    format!("offset {}", block.offset),
                    format!("{stored}"),
                ));
            }
            stored += block.stored();
        }
        if stored != values.len() as u64 {
            let found = format!("{} entries", values.len());
            return Err(self.file.damaged("values", found, format!("{stored}, as the blocks say")));
        }
        let usable = |x: f64| x.is_finite() && x >= 0.0;
        let bad = match values {
            Values::F32(v) => v.iter().position(|&x| !usable(x.into())),
            Values::F64(v) => v.iter().position(|&x| !usable(x)),
        };
        if let Some(at) = bad {
            return Err(self.file.damaged(
                "values",
                format!("{} at {at}", values.get(at)),
                "finite entries of at least 0",
            ));
        }
        if let Some(i) = self.areas()?.iter().position(|&a| !(a.is_finite() && a > 0.0)) {
            return Err(self.file.damaged("areas", format!("{} at {i}", self.areas()?[i]), "areas above 0"));
        }
        if let Some(i) = self.row_errors()?.iter().position(|&e| !usable(e)) {
            return Err(self.file.damaged(
                "row_errors",
                format!("{} at {i}", self.row_errors()?[i]),
                "errors of at least 0",
            ));
        }
        Ok(())
    }
}
