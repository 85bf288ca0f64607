//! One row of a mapped matrix: the few blocks that touch it, and of those only what lies in it.

use super::{Block, BlockKind, BlockView, Matrix, check, views};
use crate::error::Result;

/// An entry and the block it stands in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowEntry {
    /// Column.
    pub column: usize,
    /// S_ij.
    pub value: f64,
    /// How its block stores it.
    pub kind: BlockKind,
}

impl Matrix {
    /// Entries of row `i` of S that some block stores (zeros of dense blocks included), columns rising. Of a matrix that was
    /// only glanced at, the blocks that are read are checked, but for their checksum.
    pub fn row(&self, i: usize) -> Result<Vec<RowEntry>> {
        let (mut row, mirrored) = (Vec::new(), self.record().symmetric);
        for file in &self.files {
            for (index, view) in views(file.blocks()?, file.values()?, file.structure()?).enumerate() {
                if !touches(&view.block, i, mirrored) {
                    continue;
                }
                let before = row.len();
                if !self.verified {
                    check::structure(file, index, &view)?;
                }
                view.entries_of(i, mirrored, &mut row);
                let bad = |entry: &&RowEntry| !check::usable(entry.value);
                if let Some(entry) = row[before..].iter().find(bad) {
                    return Err(check::unusable(file, entry.value, view.block.offset));
                }
            }
        }
        row.sort_by_key(|entry| entry.column);
        Ok(row)
    }
}

/// Whether a block says anything of row `i`; with `mirrored`, its columns are rows, too.
fn touches(block: &Block, i: usize, mirrored: bool) -> bool {
    let within = |start: u32, count: u32| (start as usize..start as usize + count as usize).contains(&i);
    within(block.row_start, block.rows) || (mirrored && within(block.column_start, block.columns))
}

impl BlockView<'_> {
    /// Appends what the block says of row `i`; with `mirrored`, its columns are rows, too.
    fn entries_of(&self, i: usize, mirrored: bool, row: &mut Vec<RowEntry>) {
        let block = &self.block;
        let Ok(kind) = block.kind() else { return };
        let (first_row, first_column) = (block.row_start as usize, block.column_start as usize);
        let (rows, columns) = (block.rows as usize, block.columns as usize);
        // Where row r of a triangle begins: before it lie r rows, each one shorter than the last.
        let start_in_triangle = |r: usize| r * (2 * columns - r + 1) / 2;
        if let Some(r) = i.checked_sub(first_row).filter(|&r| r < rows) {
            let mut push = |c: usize, at: usize| {
                row.push(RowEntry { column: first_column + c, value: self.values.get(at), kind });
            };
            match kind {
                BlockKind::Dense => (0..columns).for_each(|c| push(c, r * columns + c)),
                BlockKind::Triangle => (r..columns).for_each(|c| push(c, start_in_triangle(r) + c - r)),
                BlockKind::Sparse => {
                    self.sparse_row(r)
                        .iter()
                        .zip(self.row_entries(r))
                        .for_each(|(&c, at)| push(c as usize, at));
                }
            }
        }
        if let Some(c) = i.checked_sub(first_column).filter(|&c| mirrored && c < columns) {
            let mut push = |r: usize, at: usize| {
                // The diagonal is its own mirror image.
                if first_row + r != i {
                    row.push(RowEntry { column: first_row + r, value: self.values.get(at), kind });
                }
            };
            match kind {
                BlockKind::Dense => (0..rows).for_each(|r| push(r, r * columns + c)),
                BlockKind::Triangle => (0..=c).for_each(|r| push(r, start_in_triangle(r) + c - r)),
                BlockKind::Sparse => {
                    for r in 0..rows {
                        if let Ok(k) = self.sparse_row(r).binary_search(&(c as u32)) {
                            push(r, self.row_entries(r).start + k);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::matrix::{Block, Values};

    /// Rows read one by one are those that a walk over all entries finds.
    #[test]
    fn rows_agree_with_the_walk_over_all_entries() {
        let blocks = [
            Block::new(BlockKind::Triangle, 0..3, 0..3, 0),
            Block::new(BlockKind::Dense, 0..3, 3..5, 6),
            Block::sparse(3..5, 3..5, 2, 12),
        ];
        let values: Vec<f64> = (1..=14).map(f64::from).collect();
        // Row 3 holds columns 3 and 4, row 4 nothing.
        let structure = [0, 2, 2, 0, 1];
        let views: Vec<BlockView<'_>> = views(&blocks, Values::F64(&values), &structure).collect();
        for mirrored in [true, false] {
            let mut wanted = [[0.0; 5]; 5];
            views.iter().for_each(|view| {
                view.for_each(|i, j, s| {
                    wanted[i][j] = s;
                    if mirrored {
                        wanted[j][i] = s;
                    }
                });
            });
            for view in &views {
                view.for_each(|i, j, s| assert_eq!(view.entry(i, j), s, "{i} {j}"));
                assert_eq!((view.entry(9, 4), view.entry(2, 0)), (0.0, 0.0));
            }
            for (i, wanted) in wanted.iter().enumerate() {
                let (mut row, mut found) = (Vec::new(), [0.0; 5]);
                views.iter().for_each(|view| view.entries_of(i, mirrored, &mut row));
                row.iter().for_each(|entry| found[entry.column] += entry.value);
                assert_eq!(&found, wanted, "row {i}, mirrored {mirrored}");
            }
        }
    }
}
