//! Writing a matrix block after block: entries go to disk as they come, and nothing larger than a block is held.

use super::{Block, BlockView, MatrixRecord, PackedBlock, Precision, Values, views};
use crate::atomic_write::{Outcome, Partial};
use crate::container::{Kind, Stream};
use crate::error::{Error, Result};
use crate::provenance::Provenance;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::SpooledTempFile;

/// Sections in the order in which they are written: what is known only at the end comes last.
const SECTIONS: [&str; 6] = ["areas", "values", "blocks", "row_errors", "sparse", "row_sums"];
/// Columns of sparse blocks beyond this many bytes wait for the end in a file without a name.
const SPOOL: usize = 1 << 22;
/// Entries are read back in chunks of about this many bytes.
const CHUNK: usize = 1 << 22;

/// A matrix being written.
#[derive(Debug)]
pub struct MatrixWriter {
    stream: Stream<MatrixRecord>,
    target: PathBuf,
    precision: Precision,
    blocks: Vec<Block>,
    stored: u64,
    structure: SpooledTempFile,
}

impl MatrixWriter {
    /// A matrix without blocks so far. Areas A_i are above 0, in the order of the elements.
    pub fn create(
        partial: Partial,
        provenance: Provenance,
        record: MatrixRecord,
        areas: &[f64],
    ) -> Result<Self> {
        let target = partial.target().to_owned();
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let structure = tempfile::spooled_tempfile_in(SPOOL, folder);
        let precision = record.precision;
        let mut stream = Stream::create(partial, Kind::Matrix, provenance, &SECTIONS, record)?;
        stream.begin("areas")?;
        stream.append(bytemuck::cast_slice(areas))?;
        stream.begin("values")?;
        Ok(Self { stream, target, precision, blocks: Vec::new(), stored: 0, structure })
    }

    /// Appends a block. Blocks share no entry.
    pub fn push(&mut self, packed: &PackedBlock) -> Result<()> {
        self.stream.append(packed.bytes())?;
        self.note(packed)
    }

    /// Appends a block whose entries an earlier run has written at this place, and fills them into `packed`. False,
    /// with nothing appended, where they are not there or their CRC-32 is another.
    pub fn adopt(&mut self, packed: &mut PackedBlock, checksum: u32) -> Result<bool> {
        let before = self.stream.hasher();
        if !self.stream.adopt(packed.bytes_mut())? {
            return Ok(false);
        }
        if crc32fast::hash(packed.bytes()) != checksum {
            self.stream.disown(packed.bytes().len(), before)?;
            return Ok(false);
        }
        self.note(packed)?;
        Ok(true)
    }

    fn note(&mut self, packed: &PackedBlock) -> Result<()> {
        self.blocks.push(Block { offset: self.stored, ..packed.block });
        self.stored += packed.block.stored();
        let structure = bytemuck::cast_slice(&packed.structure);
        self.structure.write_all(structure).map_err(|e| Error::io(&self.target, "write beside", e))
    }

    /// Blocks so far.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Number of blocks appended so far.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Hands what was appended to the system, so that it survives this process.
    pub fn flush(&mut self) -> Result<()> {
        self.stream.flush()
    }

    /// Whether the unfinished file stays when an error or a signal ends this process.
    pub fn keep_when_dropped(&mut self, keep: bool) {
        self.stream.keep_when_dropped(keep);
    }

    /// Calls `visit` with some blocks after another, all in order. They are read from disk: one chunk is in memory.
    pub fn for_each_chunk(&mut self, mut visit: impl FnMut(&[BlockView<'_>])) -> Result<()> {
        self.walk(|_, _, views| {
            visit(views);
            Ok(())
        })
    }

    /// Replaces the entries of all blocks: `change` gets some of them after another, all in order, and fills the bytes of
    /// their new entries, in the precision of the file, into the buffer.
    pub fn replace(&mut self, mut change: impl FnMut(&[BlockView<'_>], &mut Vec<u8>)) -> Result<()> {
        let mut changed = Vec::new();
        self.walk(|stream, offset, views| {
            changed.clear();
            change(views, &mut changed);
            stream.replace(offset, &changed)
        })
    }

    fn walk(
        &mut self,
        mut visit: impl FnMut(&mut Stream<MatrixRecord>, u64, &[BlockView<'_>]) -> Result<()>,
    ) -> Result<()> {
        let io = |e| Error::io(&self.target, "read beside", e);
        self.structure.seek(SeekFrom::Start(0)).map_err(io)?;
        let (mut words, mut structure, mut first) = (Vec::<u64>::new(), Vec::<u32>::new(), 0);
        while first < self.blocks.len() {
            // As many blocks as fill a chunk, at least one.
            let (mut end, mut entries, mut items) = (first, 0, 0);
            while end < self.blocks.len() && (end == first || entries * self.precision.bytes() < CHUNK) {
                entries += self.blocks[end].stored() as usize;
                items += self.blocks[end].structure_length() as usize;
                end += 1;
            }
            let bytes = entries * self.precision.bytes();
            let offset = self.blocks[first].offset * self.precision.bytes() as u64;
            words.resize(bytes.div_ceil(size_of::<u64>()), 0);
            self.stream.read_back(offset, &mut bytemuck::cast_slice_mut(&mut words)[..bytes])?;
            structure.resize(items, 0);
            self.structure.read_exact(bytemuck::cast_slice_mut(&mut structure)).map_err(io)?;
            let values = Values::of_words(&words, entries, self.precision);
            let chunk: Vec<BlockView<'_>> = views(&self.blocks[first..end], values, &structure).collect();
            visit(&mut self.stream, offset, &chunk)?;
            first = end;
        }
        self.structure.seek(SeekFrom::End(0)).map(|_| ()).map_err(io)
    }

    /// Writes the rest and puts the file in its place. `row_errors`: estimated sum over j of |error of F_ij| per row;
    /// `row_sums`: sum over j of F_ij per row, of the entries as they are stored.
    pub fn finish(mut self, row_errors: &[f64], row_sums: &[f64]) -> Result<Outcome> {
        self.stream.begin("blocks")?;
        self.stream.append(bytemuck::cast_slice(&self.blocks))?;
        self.stream.begin("row_errors")?;
        self.stream.append(bytemuck::cast_slice(row_errors))?;
        self.stream.begin("sparse")?;
        let io = |e| Error::io(&self.target, "read beside", e);
        self.structure.seek(SeekFrom::Start(0)).map_err(io)?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = self.structure.read(&mut buffer).map_err(io)?;
            if read == 0 {
                self.stream.begin("row_sums")?;
                self.stream.append(bytemuck::cast_slice(row_sums))?;
                return self.stream.finish();
            }
            self.stream.append(&buffer[..read])?;
        }
    }
}

/// Writes a matrix of dense and triangular blocks that is in memory: its blocks, its entries, and per row the area A_i and
/// the estimated sum over j of |error of F_ij|; without row sums.
pub fn write(
    path: &Path,
    provenance: Provenance,
    record: MatrixRecord,
    blocks: &[Block],
    values: Values<'_>,
    areas: &[f64],
    row_errors: &[f64],
) -> Result<Outcome> {
    let [sections @ .., _] = SECTIONS;
    let mut stream = Stream::create(Partial::create(path)?, Kind::Matrix, provenance, &sections, record)?;
    let contents: [&[u8]; SECTIONS.len() - 1] = [
        bytemuck::cast_slice(areas),
        values.bytes(),
        bytemuck::cast_slice(blocks),
        bytemuck::cast_slice(row_errors),
        &[],
    ];
    for (name, content) in sections.iter().zip(contents) {
        stream.begin(name)?;
        stream.append(content)?;
    }
    stream.finish()
}
