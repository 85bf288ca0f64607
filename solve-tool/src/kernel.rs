//! The inner loop of the matrix product: some rows of S against one run of columns, used both ways in one pass.
//!
//! For entries s_ij of the stored half, y_i += s_ij x_j (a row sum) and y_j += s_ij x_i (its mirror image), for K
//! right-hand sides at once, so that an entry is read from memory once for everything it is good for. Entries are
//! f32 or f64, products and sums f64: with f32 sums the closure of a row of 1e5 entries drifts by 1e-4.
//!
//! The order of every sum is fixed by [`LANES`] and [`ROWS`] alone and every multiply-add of a chunk is fused, in the
//! vector form as in the plain one, so the result has the same bits on every machine. Half of all arithmetic is saved
//! by that; a processor without fused multiply-add (before 2013) gets the same numbers slowly.
#![allow(unsafe_code)]

use interchange::matrix::BlockView;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256d, _mm_loadu_ps, _mm256_cvtps_pd, _mm256_fmadd_pd, _mm256_loadu_pd, _mm256_set1_pd,
    _mm256_setzero_pd, _mm256_storeu_pd,
};
use std::ops::Range;

/// Columns handled side by side; a row sum is this many partial sums until its end. One AVX register.
pub(crate) const LANES: usize = 4;
/// Rows handled together: x_j and y_j are loaded once for all of them.
pub(crate) const ROWS: usize = 2;

/// A stored matrix entry.
pub(crate) trait Entry: Copy + Into<f64> + Send + Sync {
    /// Four entries as f64.
    ///
    /// # Safety
    /// `from` must point to four readable entries, and the processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    unsafe fn load(from: *const Self) -> __m256d;
}

impl Entry for f32 {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn load(from: *const Self) -> __m256d {
        // SAFETY: the caller vouches for four entries; unaligned loads are allowed.
        _mm256_cvtps_pd(unsafe { _mm_loadu_ps(from) })
    }
}

impl Entry for f64 {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn load(from: *const Self) -> __m256d {
        // SAFETY: the caller vouches for four entries; unaligned loads are allowed.
        unsafe { _mm256_loadu_pd(from) }
    }
}

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
            let [a, b, c, d] = partial[r][k];
            sums[r][k] = ((a + c) + (b + d)) + tail;
        }
    }
    sums
}

/// The first `whole` columns, in chunks of [`LANES`]; returns the partial row sums.
fn chunks<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> [[[f64; LANES]; K]; R] {
    debug_assert!(entries.iter().all(|e| e.len() >= whole), "a row is shorter than {whole} columns");
    #[cfg(target_arch = "x86_64")]
    if has_vectors() {
        // SAFETY: the processor has AVX2 and FMA, and every slice holds `whole` values, a multiple of four.
        return unsafe { chunks_avx2(entries, x_rows, x, y, whole) };
    }
    chunks_plain(entries, x_rows, x, y, whole)
}

#[cfg(target_arch = "x86_64")]
fn has_vectors() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

/// [`chunks`] as any processor can do it; the definition of the order of its sums.
fn chunks_plain<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> [[[f64; LANES]; K]; R] {
    let mut partial = [[[0.0; LANES]; K]; R];
    for at in (0..whole).step_by(LANES) {
        for r in 0..R {
            for lane in 0..LANES {
                let s: f64 = entries[r][at + lane].into();
                for k in 0..K {
                    partial[r][k][lane] = s.mul_add(x[k][at + lane], partial[r][k][lane]);
                    y[k][at + lane] = s.mul_add(x_rows[r][k], y[k][at + lane]);
                }
            }
        }
    }
    partial
}

/// [`chunks`] with AVX2 and FMA: the same products and sums lane by lane, so the same bits. Written out because the
/// compiler's own vectorisation of the plain form comes and goes with K and R.
///
/// # Safety
/// The processor must have AVX2 and FMA; `whole` must be a multiple of four, and every slice at least as long.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn chunks_avx2<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> [[[f64; LANES]; K]; R] {
    let mut partial = [[_mm256_setzero_pd(); K]; R];
    let mut x_row = [[_mm256_setzero_pd(); K]; R];
    for r in 0..R {
        for k in 0..K {
            x_row[r][k] = _mm256_set1_pd(x_rows[r][k]);
        }
    }
    let entries = entries.map(<[T]>::as_ptr);
    let x = x.map(<[f64]>::as_ptr);
    let y = y.each_mut().map(|y| y.as_mut_ptr());
    let mut at = 0;
    while at < whole {
        let mut x_now = [_mm256_setzero_pd(); K];
        let mut y_now = [_mm256_setzero_pd(); K];
        for k in 0..K {
            // SAFETY: at + 4 <= whole, which is within every slice.
            unsafe {
                x_now[k] = _mm256_loadu_pd(x[k].add(at));
                y_now[k] = _mm256_loadu_pd(y[k].add(at));
            }
        }
        for r in 0..R {
            // SAFETY: as above, and the caller vouches for AVX2.
            let s = unsafe { T::load(entries[r].add(at)) };
            for k in 0..K {
                partial[r][k] = _mm256_fmadd_pd(s, x_now[k], partial[r][k]);
                y_now[k] = _mm256_fmadd_pd(s, x_row[r][k], y_now[k]);
            }
        }
        for k in 0..K {
            // SAFETY: as above.
            unsafe { _mm256_storeu_pd(y[k].add(at), y_now[k]) };
        }
        at += LANES;
    }
    let mut lanes = [[[0.0; LANES]; K]; R];
    for r in 0..R {
        for k in 0..K {
            // SAFETY: four values are written to an array of four.
            unsafe { _mm256_storeu_pd(lanes[r][k].as_mut_ptr(), partial[r][k]) };
        }
    }
    lanes
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    /// The vector form has the bits of the plain one, for f32 and f64 entries.
    #[test]
    fn vector_and_plain_form_agree_to_the_bit() {
        if !has_vectors() {
            return;
        }
        const N: usize = 36;
        let wave = |k: usize| -> Vec<f64> { (0..N).map(|i| ((i * 7 + k * 13) as f64).sin()).collect() };
        let (a, b) = (wave(1), wave(2));
        let (a32, b32): (Vec<f32>, Vec<f32>) = a.iter().zip(&b).map(|(&a, &b)| (a as f32, b as f32)).unzip();
        let x = [wave(3), wave(4), wave(5)];
        let x = x.each_ref().map(Vec::as_slice);
        let x_rows = [[0.3, -1.7, 2.9], [1.1, 0.7, -0.2]];
        let run = |vector: bool, wide: bool| {
            let mut y = [wave(6), wave(7), wave(8)];
            let mut slices = y.each_mut().map(Vec::as_mut_slice);
            // SAFETY: AVX2 is there, and all slices hold 36 values.
            let partial = match (vector, wide) {
                (true, true) => unsafe { chunks_avx2([&a[..], &b], &x_rows, x, &mut slices, N) },
                (true, false) => unsafe { chunks_avx2([&a32[..], &b32], &x_rows, x, &mut slices, N) },
                (false, true) => chunks_plain([&a[..], &b], &x_rows, x, &mut slices, N),
                (false, false) => chunks_plain([&a32[..], &b32], &x_rows, x, &mut slices, N),
            };
            (partial, y)
        };
        assert_eq!(run(true, true), run(false, true));
        assert_eq!(run(true, false), run(false, false));
    }
}
