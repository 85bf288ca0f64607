//! A block as it will lie in the file: entries narrowed to their stored precision, zeros left out where that is shorter.

use super::{Block, BlockKind, BlockView, Precision, Values};
use std::ops::Range;

/// A sparse block must need at most this share of the bytes of the full one: per entry it costs a product more, as its
/// columns are looked up one by one.
const SPARSE_SHARE: f64 = 0.5;

/// A block ready to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct PackedBlock {
    /// Where it lies and how it is stored; its offset is not known yet.
    pub block: Block,
    precision: Precision,
    /// Entries as 64-bit words, the last one padded: their bytes can be used as numbers where they lie.
    words: Vec<u64>,
    /// As in [`BlockView`].
    pub structure: Vec<u32>,
}

impl PackedBlock {
    /// Packs the entries of a rectangle, row after row; `triangle`: of a square on the diagonal, from the diagonal on.
    /// With `sparse`, zeros are left out where that is much shorter.
    pub fn new(
        rows: Range<u32>,
        columns: Range<u32>,
        triangle: bool,
        entries: &[f64],
        precision: Precision,
        sparse: bool,
    ) -> Self {
        let kind = if triangle { BlockKind::Triangle } else { BlockKind::Dense };
        let block = Block::new(kind, rows.clone(), columns.clone(), 0);
        debug_assert_eq!(block.stored(), entries.len() as u64, "{block:?}");
        // Whether an entry is zero is asked of what would be stored.
        let is_zero = |x: f64| match precision {
            Precision::F32 => x as f32 == 0.0,
            Precision::F64 => x == 0.0,
        };
        if sparse {
            let kept = entries.iter().filter(|&&x| !is_zero(x)).count();
            let sparse_bytes = (rows.len() + 1 + kept) * size_of::<u32>() + kept * precision.bytes();
            let share = sparse_bytes as f64 / (entries.len() * precision.bytes()) as f64;
            if share <= SPARSE_SHARE && u32::try_from(kept).is_ok() {
                return Self::sparse(rows, columns, triangle, entries, precision, is_zero);
            }
        }
        Self { block, precision, words: narrowed(entries.iter().copied(), precision), structure: Vec::new() }
    }

    fn sparse(
        rows: Range<u32>,
        columns: Range<u32>,
        triangle: bool,
        entries: &[f64],
        precision: Precision,
        is_zero: impl Fn(f64) -> bool,
    ) -> Self {
        let (mut starts, mut found, mut kept) = (vec![0], Vec::new(), Vec::new());
        let mut at = 0;
        for row in 0..rows.len() {
            for column in if triangle { row } else { 0 }..columns.len() {
                if !is_zero(entries[at]) {
                    found.push(column as u32);
                    kept.push(entries[at]);
                }
                at += 1;
            }
            starts.push(found.len() as u32);
        }
        let block = Block::sparse(rows, columns, kept.len() as u32, 0);
        starts.extend(found);
        Self { block, precision, words: narrowed(kept.into_iter(), precision), structure: starts }
    }

    /// A block whose entries are still to be filled into [`PackedBlock::bytes_mut`].
    pub fn unfilled(block: Block, precision: Precision, structure: Vec<u32>) -> Self {
        let bytes = block.stored() as usize * precision.bytes();
        Self { block, precision, words: vec![0; bytes.div_ceil(size_of::<u64>())], structure }
    }

    /// A copy of a block that is stored already.
    pub fn copy_of(view: &BlockView<'_>) -> Self {
        let precision = view.values.precision();
        let mut packed = Self::unfilled(view.block, precision, view.structure.to_vec());
        packed.bytes_mut().copy_from_slice(view.values.bytes());
        packed
    }

    fn byte_count(&self) -> usize {
        self.block.stored() as usize * self.precision.bytes()
    }

    /// The entries as they lie in the file.
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.byte_count()]
    }

    /// The same, to be filled.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        let count = self.byte_count();
        &mut bytemuck::cast_slice_mut(&mut self.words)[..count]
    }

    /// The block with its entries.
    pub fn view(&self) -> BlockView<'_> {
        let values = Values::of_words(&self.words, self.block.stored() as usize, self.precision);
        BlockView { block: self.block, values, structure: &self.structure }
    }

    /// Bytes it takes in memory, about.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + self.words.len() * size_of::<u64>() + self.structure.len() * size_of::<u32>()
    }
}

/// Numbers in their stored precision, packed into words.
fn narrowed(entries: impl ExactSizeIterator<Item = f64>, precision: Precision) -> Vec<u64> {
    match precision {
        Precision::F64 => entries.map(f64::to_bits).collect(),
        Precision::F32 => {
            let mut words = vec![0u64; entries.len().div_ceil(2)];
            let singles: &mut [f32] = bytemuck::cast_slice_mut(&mut words);
            singles.iter_mut().zip(entries).for_each(|(single, x)| *single = x as f32);
            words
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries_of(packed: &PackedBlock) -> Vec<(usize, usize, f64)> {
        let mut found = Vec::new();
        packed.view().for_each(|i, j, s| found.push((i, j, s)));
        found
    }

    #[test]
    fn sparse_blocks_keep_what_is_not_zero_and_only_where_that_is_shorter() {
        let mut entries = [0.0; 20];
        (entries[3], entries[17]) = (0.25, 0.5);
        for precision in [Precision::F32, Precision::F64] {
            let packed = PackedBlock::new(2..6, 10..15, false, &entries, precision, true);
            assert_eq!(packed.block.kind(), Ok(BlockKind::Sparse));
            assert_eq!(packed.structure, [0, 1, 1, 1, 2, 3, 2]);
            assert_eq!(entries_of(&packed), [(2, 13, 0.25), (5, 12, 0.5)]);
            let full = PackedBlock::new(2..6, 10..15, false, &entries, precision, false);
            assert_eq!(full.block.kind(), Ok(BlockKind::Dense));
            assert_eq!(entries_of(&full).iter().filter(|e| e.2 != 0.0).count(), 2);
        }
        // Half of the entries: the columns would cost more than the zeros.
        let half: Vec<f64> = (0..20).map(|k| f64::from(k % 2)).collect();
        let packed = PackedBlock::new(2..6, 10..15, false, &half, Precision::F64, true);
        assert_eq!(packed.block.kind(), Ok(BlockKind::Dense));
    }

    #[test]
    fn sparse_squares_on_the_diagonal_keep_their_upper_half() {
        let mut entries = [0.0; 36];
        (entries[1], entries[35]) = (0.5, 1.0);
        let packed = PackedBlock::new(4..12, 4..12, true, &entries, Precision::F64, true);
        assert_eq!(packed.block.kind(), Ok(BlockKind::Sparse));
        assert_eq!(entries_of(&packed), [(4, 5, 0.5), (11, 11, 1.0)]);
    }
}
