//! Sums over the entries of one block: of its rows, then, off the diagonal, of its columns. The order of every sum is fixed
//! by the block alone.

use interchange::matrix::{BlockKind, BlockView, Values};

/// Sums of a block's entries.
pub fn sums_of(view: &BlockView<'_>) -> Vec<f64> {
    let zeros = vec![0.0; (view.block.rows.max(view.block.columns)) as usize];
    terms(view, &[], &zeros, &zeros, |s, _, _| s)
}

/// Sums of `term(S_ij, l_i, l_j)`, which must be symmetric and 0 where S_ij is. Entries `without`, by their place in the
/// block, rising, count as 0.
pub fn terms_of(
    view: &BlockView<'_>,
    without: &[usize],
    l: &[f64],
    term: impl Fn(f64, f64, f64) -> f64,
) -> Vec<f64> {
    let block = &view.block;
    let l_rows = &l[block.row_start as usize..][..block.rows as usize];
    let l_columns = &l[block.column_start as usize..][..block.columns as usize];
    terms(view, without, l_rows, l_columns, term)
}

fn terms(
    view: &BlockView<'_>,
    without: &[usize],
    l_rows: &[f64],
    l_columns: &[f64],
    term: impl Fn(f64, f64, f64) -> f64,
) -> Vec<f64> {
    match (view.values, view.block.kind()) {
        (Values::F32(values), Ok(BlockKind::Dense)) if without.is_empty() => {
            dense(view, values, l_rows, l_columns, term)
        }
        (Values::F64(values), Ok(BlockKind::Dense)) if without.is_empty() => {
            dense(view, values, l_rows, l_columns, term)
        }
        _ => {
            let (first_row, first_column) = (view.block.row_start as usize, view.block.column_start as usize);
            let (mut ends, mut at) = (Ends::of(view), 0);
            view.for_each(|i, j, s| {
                if without.binary_search(&at).is_err() {
                    ends.add(i, j, term(s, l_rows[i - first_row], l_columns[j - first_column]));
                }
                at += 1;
            });
            ends.values
        }
    }
}

/// Partial sums of a row side by side.
const LANES: usize = 4;

/// [`terms`] for the many: nothing but arithmetic in the inner loop.
fn dense<T: Copy + Into<f64>>(
    view: &BlockView<'_>,
    values: &[T],
    l_rows: &[f64],
    l_columns: &[f64],
    term: impl Fn(f64, f64, f64) -> f64,
) -> Vec<f64> {
    let (rows, columns) = (view.block.rows as usize, view.block.columns as usize);
    let (l_rows, l_columns) = (&l_rows[..rows], &l_columns[..columns]);
    let mut sums = vec![0.0; rows + columns];
    let (row_sums, column_sums) = sums.split_at_mut(rows);
    let (l_whole, l_rest) = l_columns.as_chunks::<LANES>();
    let (column_whole, column_rest) = column_sums.as_chunks_mut::<LANES>();
    for ((entries, l_i), row_sum) in values.chunks_exact(columns.max(1)).zip(l_rows).zip(row_sums) {
        let (whole, rest) = entries.as_chunks::<LANES>();
        let mut lanes = [0.0; LANES];
        for ((s, l_j), column_sums) in whole.iter().zip(l_whole).zip(column_whole.iter_mut()) {
            for lane in 0..LANES {
                let t = term(s[lane].into(), *l_i, l_j[lane]);
                lanes[lane] += t;
                column_sums[lane] += t;
            }
        }
        for ((s, l_j), column_sum) in rest.iter().zip(l_rest).zip(column_rest.iter_mut()) {
            let t = term((*s).into(), *l_i, *l_j);
            lanes[0] += t;
            *column_sum += t;
        }
        *row_sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    }
    sums
}

/// Sums per row and column of a block being added up entry by entry; one list where it is a square on the diagonal.
#[derive(Debug)]
pub struct Ends {
    first_row: usize,
    first_column: usize,
    /// Where the columns begin among the values.
    columns: usize,
    /// Sums of the rows, then, off the diagonal, of the columns.
    pub values: Vec<f64>,
}

impl Ends {
    /// Zeros for a block.
    pub fn of(view: &BlockView<'_>) -> Self {
        let block = &view.block;
        let columns = if block.is_diagonal() { 0 } else { block.rows as usize };
        let values = vec![0.0; columns + block.columns as usize];
        Self {
            first_row: block.row_start as usize,
            first_column: block.column_start as usize,
            columns,
            values,
        }
    }

    /// Adds to row i and column j of the matrix, once on the diagonal.
    pub fn add(&mut self, i: usize, j: usize, x: f64) {
        self.values[i - self.first_row] += x;
        if i != j {
            self.values[self.columns + j - self.first_column] += x;
        }
    }
}

/// Adds a block's sums to those of all elements.
pub fn add(total: &mut [f64], view: &BlockView<'_>, part: &[f64]) {
    let block = &view.block;
    let (rows, columns) = part.split_at(block.rows as usize);
    total[block.row_start as usize..].iter_mut().zip(rows).for_each(|(sum, x)| *sum += x);
    total[block.column_start as usize..].iter_mut().zip(columns).for_each(|(sum, x)| *sum += x);
}
