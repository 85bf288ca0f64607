//! Single rows and columns of the stored matrix, for the methods that take one element at a time.

use super::Product;
use interchange::matrix::{Block, BlockKind, BlockView};

/// Which blocks hold entries of which row and column.
#[derive(Debug)]
pub(crate) struct RowIndex<'a> {
    product: &'a Product<'a>,
    /// Blocks whose rows include an element: those of element i from `starts[i]` to `starts[i + 1]`.
    by_row: Lists,
    /// Blocks whose columns include an element.
    by_column: Lists,
}

#[derive(Debug)]
struct Lists {
    starts: Vec<u32>,
    blocks: Vec<u32>,
}

impl Lists {
    fn new(elements: usize, views: &[BlockView<'_>], range: impl Fn(&Block) -> std::ops::Range<u32>) -> Self {
        let mut starts = vec![0u32; elements + 1];
        views.iter().flat_map(|view| range(&view.block)).for_each(|i| starts[i as usize + 1] += 1);
        (0..elements).for_each(|i| starts[i + 1] += starts[i]);
        let mut next = starts.clone();
        let mut list = vec![0; starts[elements] as usize];
        for (index, view) in views.iter().enumerate() {
            for i in range(&view.block) {
                list[next[i as usize] as usize] = index as u32;
                next[i as usize] += 1;
            }
        }
        Self { starts, blocks: list }
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.blocks[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

impl<'a> RowIndex<'a> {
    /// Indexes the blocks.
    pub fn new(product: &'a Product<'a>) -> Self {
        let lists =
            |range: fn(&Block) -> std::ops::Range<u32>| Lists::new(product.elements, &product.views, range);
        let by_row = lists(|b| b.row_start..b.row_start + b.rows);
        let by_column = lists(|b| b.column_start..b.column_start + b.columns);
        Self { product, by_row, by_column }
    }

    /// Calls `visit(j, S_ij)` for every stored entry of row i, mirror images included.
    pub fn for_row(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        self.stored_row(i, &mut visit);
        if self.product.symmetric {
            self.stored_column(i, |j, s| {
                if j != i {
                    visit(j, s);
                }
            });
        }
    }

    /// Calls `visit(j, S_ji)` for every stored entry of column i, mirror images included.
    pub fn for_column(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        self.stored_column(i, &mut visit);
        if self.product.symmetric {
            self.stored_row(i, |j, s| {
                if j != i {
                    visit(j, s);
                }
            });
        }
    }

    fn stored_row(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        for &index in self.by_row.of(i) {
            let view = &self.product.views[index as usize];
            let (row, start) = (i - view.block.row_start as usize, view.block.column_start as usize);
            if view.block.kind() == Ok(BlockKind::Sparse) {
                for (&column, at) in view.sparse_row(row).iter().zip(view.row_entries(row)) {
                    visit(start + column as usize, view.values.get(at));
                }
                continue;
            }
            let (first, at) = row_place(&view.block, row);
            for column in first..view.block.columns as usize {
                visit(start + column, view.values.get(at + column - first));
            }
        }
    }

    fn stored_column(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        for &index in self.by_column.of(i) {
            let view = &self.product.views[index as usize];
            let block = &view.block;
            let (column, start) = (i - block.column_start as usize, block.row_start as usize);
            let kind = block.kind();
            let rows = if kind == Ok(BlockKind::Triangle) { column + 1 } else { block.rows as usize };
            for row in 0..rows {
                if kind == Ok(BlockKind::Sparse) {
                    // Columns rise within a row.
                    if let Ok(place) = view.sparse_row(row).binary_search(&(column as u32)) {
                        visit(start + row, view.values.get(view.row_entries(row).start + place));
                    }
                    continue;
                }
                let (first, at) = row_place(block, row);
                visit(start + row, view.values.get(at + column - first));
            }
        }
    }
}

/// First stored column of row `row` of a full block, and where its entry lies among the block's.
fn row_place(block: &Block, row: usize) -> (usize, usize) {
    let columns = block.columns as usize;
    match block.kind() {
        // Row k of a triangle holds columns - k entries.
        Ok(BlockKind::Triangle) => (row, row * (2 * columns + 1 - row) / 2),
        _ => (0, row * columns),
    }
}
