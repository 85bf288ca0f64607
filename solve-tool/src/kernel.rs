//! The inner loop of the matrix product: some rows of S against one run of columns, used both ways in one pass.
//!
//! For entries s_ij of the stored half, y_i += s_ij x_j (a row sum) and y_j += s_ij x_i (its mirror image), for K
//! right-hand sides at once, so that an entry is read from memory once for everything it is good for. Entries are
//! f32 or f64, products and sums f64: with f32 sums the closure of a row of 1e5 entries drifts by 1e-4.
//!
//! The order of every sum is fixed by [`LANES`], [`ROWS`] and [`TILE`] alone and every multiply-add of a strip is fused,
//! in the vector forms ([`lanes`]) as in the plain one, so the result has the same bits on every machine. Half of all
//! arithmetic is saved by that; a processor without fused multiply-add (before 2013) gets the same numbers slowly.

mod lanes;

use interchange::matrix::BlockView;
use lanes::{Ahead, Strip};
pub(crate) use lanes::{Entry, LANES};
use std::ops::Range;

/// Rows handled together: x_j and y_j are loaded once for all of them. Four rows of three vectors fill the 32 registers
/// of AVX-512.
pub(crate) const ROWS: usize = 4;

/// Columns of a wider block that are taken for all its rows before the next ones are: x and y of three vectors over so
/// many columns are 12 KB and stay in the first-level cache. A multiple of [`ROWS`].
const TILE: usize = 256;

/// Strips that memory is asked for ahead: 4 rows of 256 columns are 4 KB or 8 KB, and 16 KB are about what a core reads in
/// the time memory takes to answer.
const STRIPS_AHEAD: usize = 4;
/// Least bytes ahead, where strips are short.
const NEAR_BYTES: usize = 2048;
const FAR_BYTES: usize = 4096;

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

/// Adds what `rows` contribute to S x; `y[k][i - base]` stands for row i of result k. `base` is a multiple of [`LANES`],
/// and x and y hold whole chunks.
pub(crate) fn add_rows<const K: usize, T: Entry>(
    rows: &Rows,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    base: usize,
) {
    let end = rows.first + rows.count;
    // A triangle's rows hold nothing to the left of the diagonal.
    let first_tile = if rows.triangle { rows.first / TILE * TILE } else { 0 };
    for start in (first_tile..rows.columns).step_by(TILE) {
        let tile = start..(start + TILE).min(rows.columns);
        let mut row = rows.first;
        while row + ROWS <= end {
            add_strip::<ROWS, K, T>(rows, row, tile.clone(), values, x, y, base);
            row += ROWS;
        }
        while row < end {
            add_strip::<1, K, T>(rows, row, tile.clone(), values, x, y, base);
            row += 1;
        }
    }
}

/// Adds what rows `rows` of a sparse block contribute to S x, entry by entry; `y` as in [`add_rows`].
pub(crate) fn add_sparse_rows<const K: usize, T: Entry>(
    view: &BlockView<'_>,
    rows: Range<usize>,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
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

/// R consecutive rows from row `first` of the block, as far as they lie in the columns of `tile`.
#[inline(always)]
fn add_strip<const R: usize, const K: usize, T: Entry>(
    rows: &Rows,
    first: usize,
    tile: Range<usize>,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    base: usize,
) {
    let i = rows.row_start + first;
    let x_rows = x.map(|x| &x[i..][..R]);

    // Between the R rows of a triangle lies a small triangle, taken entry by entry; to the right of it all rows of
    // the strip have the same columns. It lies in one tile, as strips begin at multiples of their height.
    let mut start = tile.start;
    if rows.triangle {
        if tile.contains(&first) {
            for r in 0..R {
                for (c, &s) in values[rows.start(first + r)..][..R - r].iter().enumerate() {
                    let s: f64 = s.into();
                    for k in 0..K {
                        y[k][i + r - base] += s * x_rows[k][r + c];
                        if c > 0 {
                            y[k][i + r + c - base] += s * x_rows[k][r];
                        }
                    }
                }
            }
        }
        start = start.max(first + R);
    }
    if start >= tile.end {
        return;
    }

    let columns = tile.end - start;
    let entries: [&[T]; R] = std::array::from_fn(|r| {
        let before = if rows.triangle { start - first - r } else { start };
        &values[rows.start(first + r) + before..][..columns]
    });
    let bytes = (rows.start(first + R) - rows.start(first)) * size_of::<T>();
    let joined = rows.columns <= TILE;
    let ahead = Ahead {
        near: if joined { bytes.max(NEAR_BYTES) } else { bytes },
        far: (STRIPS_AHEAD * bytes).max(FAR_BYTES),
        joined,
    };
    let j = rows.column_start + start;
    let (chunk, skip) = (j / LANES * LANES, j % LANES);
    let padded = (skip + columns).next_multiple_of(LANES);
    let x_columns = x.map(|x| &x[chunk..][..padded]);
    let y_columns = y.each_mut().map(|y| &mut y[chunk - base..][..padded]);
    let sums = Strip { entries, skip, ahead }.add(x_rows, x_columns, y_columns);
    for k in 0..K {
        y[k][i - base..][..R].iter_mut().zip(sums[k]).for_each(|(y, sum)| *y += sum);
    }
}
