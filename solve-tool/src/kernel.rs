//! The inner loop of the matrix product: some rows of S against one run of columns, used both ways in one pass.
//!
//! For entries s_ij of the stored half, y_i += s_ij x_j (a row sum) and y_j += s_ij x_i (its mirror image), for K
//! right-hand sides at once, so that an entry is read from memory once for everything it is good for. Entries are
//! f32 or f64, products and sums f64: with f32 sums the closure of a row of 1e5 entries drifts by 1e-4.
//!
//! The order of every sum is fixed by [`LANES`] and [`ROWS`] alone and every multiply-add of a chunk is fused, in the
//! vector forms ([`lanes`]) as in the plain one, so the result has the same bits on every machine. Half of all
//! arithmetic is saved by that; a processor without fused multiply-add (before 2013) gets the same numbers slowly.

mod lanes;

use interchange::matrix::BlockView;
pub(crate) use lanes::Entry;
use lanes::{LANES, chunks};
use std::ops::Range;

/// Rows handled together: x_j and y_j are loaded once for all of them. Four rows of three vectors fill the 32 registers
/// of AVX-512.
pub(crate) const ROWS: usize = 4;

/// Rows of one block that are consecutive in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows {
    /// First row, counted within the block.
    pub first: usize,
    /// Number of rows.
    pub count: usize,
    /// Row of S where the block starts.
    pub row_start: usize,
    /// Column of S where the block starts.
    pub column_start: usize,
    /// Columns of the block.
    pub columns: usize,
    /// Whether only the upper triangle with the diagonal is stored.
    pub triangle: bool,
    /// Where the block starts in the values.
    pub offset: usize,
}

impl Rows {
    /// Where the first stored entry of row `row` of the block lies in the values.
    fn start(&self, row: usize) -> usize {
        // A triangle's row k holds columns - k entries: the rows before `row` hold row (2 columns - row + 1) / 2.
        let before = if self.triangle { row * (2 * self.columns + 1 - row) / 2 } else { row * self.columns };
        self.offset + before
    }
}

/// Adds what `rows` contribute to S x; `y[k][i - base]` stands for row i of result k.
pub(crate) fn add_rows<const K: usize, T: Entry>(
    rows: &Rows,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [Vec<f64>; K],
    base: usize,
) {
    let end = rows.first + rows.count;
    let mut row = rows.first;
    while row + ROWS <= end {
        add_strip::<ROWS, K, T>(rows, row, values, x, y, base);
        row += ROWS;
    }
    while row < end {
        add_strip::<1, K, T>(rows, row, values, x, y, base);
        row += 1;
    }
}

/// Adds what rows `rows` of a sparse block contribute to S x, entry by entry; `y` as in [`add_rows`].
pub(crate) fn add_sparse_rows<const K: usize, T: Entry>(
    view: &BlockView<'_>,
    rows: Range<usize>,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [Vec<f64>; K],
    base: usize,
) {
    let column_start = view.block.column_start as usize;
    for row in rows {
        let i = view.block.row_start as usize + row;
        let x_row: [f64; K] = std::array::from_fn(|k| x[k][i]);
        let mut sums = [0.0; K];
        for (&column, &s) in view.sparse_row(row).iter().zip(&values[view.row_entries(row)]) {
            let (j, s): (usize, f64) = (column_start + column as usize, s.into());
            for k in 0..K {
                sums[k] += s * x[k][j];
                if i != j {
                    y[k][j - base] += s * x_row[k];
                }
            }
        }
        for k in 0..K {
            y[k][i - base] += sums[k];
        }
    }
}

/// R consecutive rows from row `first` of the block.
#[inline(always)]
fn add_strip<const R: usize, const K: usize, T: Entry>(
    rows: &Rows,
    first: usize,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [Vec<f64>; K],
    base: usize,
) {
    let i = rows.row_start + first;
    let x_rows: [[f64; K]; R] = std::array::from_fn(|r| std::array::from_fn(|k| x[k][i + r]));

    // Between the R rows of a triangle lies a small triangle, taken entry by entry; to the right of it all rows of
    // the strip have the same columns.
    let mut skipped = 0;
    if rows.triangle {
        skipped = first + R;
        for r in 0..R {
            for (c, &s) in values[rows.start(first + r)..][..R - r].iter().enumerate() {
                let s: f64 = s.into();
                for k in 0..K {
                    y[k][i + r - base] += s * x_rows[r + c][k];
                    if c > 0 {
                        y[k][i + r + c - base] += s * x_rows[r][k];
                    }
                }
            }
        }
    }

    let columns = rows.columns - skipped;
    let entries: [&[T]; R] = std::array::from_fn(|r| {
        let already = if rows.triangle { R - r } else { 0 };
        &values[rows.start(first + r) + already..][..columns]
    });
    let j = rows.column_start + skipped;
    let x_columns = x.map(|x| &x[j..][..columns]);
    let y_columns = y.each_mut().map(|y| &mut y[j - base..][..columns]);
    let sums = rectangle(entries, &x_rows, x_columns, y_columns);
    for (r, sums) in sums.iter().enumerate() {
        for k in 0..K {
            y[k][i + r - base] += sums[k];
        }
    }
}

/// Returns the R row sums of a rectangle and adds its mirror image to `y`. All slices have the same length.
fn rectangle<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    mut y: [&mut [f64]; K],
) -> [[f64; K]; R] {
    let whole = x[0].len() / LANES * LANES;
    let partial = chunks(entries, x_rows, x, &mut y, whole);
    let mut sums = [[0.0; K]; R];
    for r in 0..R {
        for k in 0..K {
            // The last columns, fewer than a chunk.
            let mut tail = 0.0;
            for (column, &s) in entries[r].iter().enumerate().skip(whole) {
                let s: f64 = s.into();
                tail += s * x[k][column];
                y[k][column] += s * x_rows[r][k];
            }
            let [a, b, c, d, e, f, g, h] = partial[r][k];
            sums[r][k] = (((a + e) + (c + g)) + ((b + f) + (d + h))) + tail;
        }
    }
    sums
}
