//! Blocks: rectangles of S and how they store their entries (`FORMAT.md`, section 5).

use super::Values;
use bytemuck::{Pod, Zeroable};
use std::ops::{ControlFlow, Range};

/// How a block stores its entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockKind {
    /// All entries, row after row.
    Dense,
    /// A square block on the diagonal: the upper triangle with the diagonal, row after row.
    Triangle,
    /// The entries that are not zero, row after row, with their columns; above the diagonal or a square on it.
    Sparse,
}

/// Codes of the block kinds. 3 (low rank U V^T) is reserved: readers refuse it by name.
const CODES: [(u32, BlockKind); 3] =
    [(0, BlockKind::Dense), (1, BlockKind::Triangle), (2, BlockKind::Sparse)];

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
    /// Number of stored entries of a sparse block; rank of a low-rank one; 0 otherwise.
    pub rank: u32,
    /// First entry in the `values` section.
    pub offset: u64,
}

impl Block {
    /// A dense or triangular block.
    pub fn new(kind: BlockKind, rows: Range<u32>, columns: Range<u32>, offset: u64) -> Self {
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

    /// A sparse block with this number of entries.
    pub fn sparse(rows: Range<u32>, columns: Range<u32>, entries: u32, offset: u64) -> Self {
        Self { rank: entries, ..Self::new(BlockKind::Sparse, rows, columns, offset) }
    }

    /// Kind, or the code that is not known.
    pub fn kind(&self) -> Result<BlockKind, u32> {
        CODES.iter().find(|(code, _)| *code == self.code).map(|(_, kind)| *kind).ok_or(self.code)
    }

    /// Number of stored entries.
    pub fn stored(&self) -> u64 {
        match self.kind() {
            Ok(BlockKind::Triangle) => u64::from(self.rows) * (u64::from(self.rows) + 1) / 2,
            Ok(BlockKind::Sparse) => u64::from(self.rank),
            _ => u64::from(self.rows) * u64::from(self.columns),
        }
    }

    /// Items of the `sparse` section that belong to it: where each row starts, the end, then a column per entry.
    pub fn structure_length(&self) -> u64 {
        match self.kind() {
            Ok(BlockKind::Sparse) => u64::from(self.rows) + 1 + u64::from(self.rank),
            _ => 0,
        }
    }

    /// Whether it is a square on the diagonal.
    pub fn is_diagonal(&self) -> bool {
        (self.row_start, self.rows) == (self.column_start, self.columns)
    }
}

/// A block with its entries.
#[derive(Debug, Clone, Copy)]
pub struct BlockView<'a> {
    /// Where it lies and how it is stored.
    pub block: Block,
    /// Its entries alone.
    pub values: Values<'a>,
    /// Of a sparse block: where each row starts among its entries, the end, then the column of each entry, counted from
    /// the block's first. Empty otherwise.
    pub structure: &'a [u32],
}

impl<'a> BlockView<'a> {
    /// Calls `visit(i, j, S_ij)` for every stored entry until it says to stop.
    pub fn try_for_each(
        &self,
        mut visit: impl FnMut(usize, usize, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (first_row, first_column) = (self.block.row_start as usize, self.block.column_start as usize);
        let kind = self.block.kind();
        let mut at = 0;
        for row in 0..self.block.rows as usize {
            if kind == Ok(BlockKind::Sparse) {
                for (&column, k) in self.sparse_row(row).iter().zip(self.row_entries(row)) {
                    visit(first_row + row, first_column + column as usize, self.values.get(k))?;
                }
                continue;
            }
            let first = if kind == Ok(BlockKind::Triangle) { row } else { 0 };
            for column in first..self.block.columns as usize {
                visit(first_row + row, first_column + column, self.values.get(at))?;
                at += 1;
            }
        }
        ControlFlow::Continue(())
    }

    /// Calls `visit(i, j, S_ij)` for every stored entry.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, f64)) {
        let _ = self.try_for_each(|i, j, s| {
            visit(i, j, s);
            ControlFlow::Continue(())
        });
    }

    /// Entry S_ij of the block, 0 where it stores none there.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        let (rows, columns) = (self.block.rows as usize, self.block.columns as usize);
        let row = i.checked_sub(self.block.row_start as usize).filter(|&row| row < rows);
        let column = j.checked_sub(self.block.column_start as usize).filter(|&column| column < columns);
        let Some((row, column)) = row.zip(column) else { return 0.0 };
        match self.block.kind() {
            Ok(BlockKind::Dense) => self.values.get(row * columns + column),
            // Before row r of a triangle lie r rows, each one shorter than the last.
            Ok(BlockKind::Triangle) if row <= column => {
                self.values.get(row * (2 * columns - row + 1) / 2 + column - row)
            }
            Ok(BlockKind::Sparse) => match self.sparse_row(row).binary_search(&(column as u32)) {
                Ok(k) => self.values.get(self.row_entries(row).start + k),
                Err(_) => 0.0,
            },
            _ => 0.0,
        }
    }

    /// Of a sparse block: which of its entries lie in this row, counted from the block's first.
    pub fn row_entries(&self, row: usize) -> Range<usize> {
        self.structure[row] as usize..self.structure[row + 1] as usize
    }

    /// Of a sparse block: the columns of the entries in this row, both counted from the block's first.
    pub fn sparse_row(&self, row: usize) -> &'a [u32] {
        &self.structure[self.block.rows as usize + 1..][self.row_entries(row)]
    }
}

/// The blocks with their entries: `values` and `structure` are those of all of them.
pub fn views<'a>(
    blocks: &'a [Block],
    values: Values<'a>,
    structure: &'a [u32],
) -> impl Iterator<Item = BlockView<'a>> + 'a {
    let (mut at, mut structure_at) = (0usize, 0usize);
    blocks.iter().map(move |&block| {
        let (stored, length) = (block.stored() as usize, block.structure_length() as usize);
        let view = BlockView {
            block,
            values: values.slice(at..at + stored),
            structure: &structure[structure_at..structure_at + length],
        };
        (at, structure_at) = (at + stored, structure_at + length);
        view
    })
}
