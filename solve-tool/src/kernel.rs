//! The inner loop of the matrix product: some rows of S against one run of columns, used both ways in one pass.
//!
//! For entries s_ij of the stored half, y_i += s_ij x_j (a row sum) and y_j += s_ij x_i (its mirror image), for K
//! right-hand sides at once, so that an entry is read from memory once for everything it is good for. Entries are
//! f32 or f64, products and sums f64: with f32 sums the closure of a row of 1e5 entries drifts by 1e-4.
//!
//! The order of every sum is fixed by [`LANES`] and [`ROWS`] alone and no multiply-add is fused, so the result has
//! the same bits with every instruction set.
#![allow(unsafe_code)]

/// Columns handled side by side; a row sum is this many partial sums until its end. Two AVX registers.
pub(crate) const LANES: usize = 8;
/// Rows handled together: x_j and y_j are loaded once for all of them.
pub(crate) const ROWS: usize = 2;

/// A stored matrix entry.
pub(crate) trait Entry: Copy + Into<f64> + Send + Sync {}
impl Entry for f32 {}
impl Entry for f64 {}

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
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all the function asks for beyond the baseline.
        return unsafe { add_rows_avx2(rows, values, x, y, base) };
    }
    add_rows_plain(rows, values, x, y, base);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_rows_avx2<const K: usize, T: Entry>(
    rows: &Rows,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [Vec<f64>; K],
    base: usize,
) {
    add_rows_plain(rows, values, x, y, base);
}

#[inline(always)]
fn add_rows_plain<const K: usize, T: Entry>(
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
    let sums = strip(entries, x_rows, x_columns, y_columns);
    for (r, sums) in sums.iter().enumerate() {
        for k in 0..K {
            y[k][i + r - base] += sums[k];
        }
    }
}

/// The rectangle: returns the R row sums and adds the mirror image to `y`.
#[inline(always)]
fn strip<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: [[f64; K]; R],
    x: [&[f64]; K],
    y: [&mut [f64]; K],
) -> [[f64; K]; R] {
    let count = x[0].len() / LANES;
    let entry_chunks = entries.map(|e| &e.as_chunks::<LANES>().0[..count]);
    let x_chunks = x.map(|x| &x.as_chunks::<LANES>().0[..count]);
    let mut y_split = y.map(|y| y.as_chunks_mut::<LANES>());
    let mut partial = [[[0.0; LANES]; K]; R];
    {
        let y_chunks = y_split.each_mut().map(|y| &mut y.0[..count]);
        for chunk in 0..count {
            let x_now: [[f64; LANES]; K] = std::array::from_fn(|k| x_chunks[k][chunk]);
            let mut y_now: [[f64; LANES]; K] = std::array::from_fn(|k| y_chunks[k][chunk]);
            for r in 0..R {
                let s: [f64; LANES] = entry_chunks[r][chunk].map(Into::into);
                for k in 0..K {
                    for lane in 0..LANES {
                        partial[r][k][lane] += s[lane] * x_now[k][lane];
                        y_now[k][lane] += s[lane] * x_rows[r][k];
                    }
                }
            }
            for k in 0..K {
                y_chunks[k][chunk] = y_now[k];
            }
        }
    }

    // The last columns, fewer than a chunk, and the partial sums in pairs.
    let mut sums = [[0.0; K]; R];
    for r in 0..R {
        let rest = &entries[r][count * LANES..];
        for k in 0..K {
            let mut tail = 0.0;
            for (c, &s) in rest.iter().enumerate() {
                let s: f64 = s.into();
                tail += s * x[k][count * LANES + c];
                y_split[k].1[c] += s * x_rows[r][k];
            }
            sums[r][k] = pairwise(&partial[r][k]) + tail;
        }
    }
    sums
}

#[inline(always)]
fn pairwise(lanes: &[f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}
