//! Chunks of [`LANES`] columns of some rows, in the widest registers of the processor: AVX-512, AVX2 or none. All three
//! do the same fused multiply-adds in the same order on every sum, so they have the same bits.
//!
//! The vector forms are written out because the compiler's own vectorisation of the plain form comes and goes with the
//! numbers of rows and of vectors.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256d, __m512d, _MM_HINT_T0, _mm_loadu_ps, _mm_prefetch, _mm256_cvtps_pd, _mm256_fmadd_pd,
    _mm256_loadu_pd, _mm256_loadu_ps, _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd, _mm512_cvtps_pd,
    _mm512_fmadd_pd, _mm512_loadu_pd, _mm512_set1_pd, _mm512_setzero_pd, _mm512_storeu_pd,
};

/// Columns handled side by side; a row sum is this many partial sums until its end. One AVX-512 register.
pub(super) const LANES: usize = 8;

/// Bytes that entries are asked for ahead of their use. The processor does not foresee rows of some hundred bytes that
/// lie behind one another but are read side by side, and 8 KB are about the time memory takes to answer.
#[cfg(target_arch = "x86_64")]
const AHEAD_BYTES: usize = 8192;

/// Partial sums of R rows for K vectors.
type Partial<const R: usize, const K: usize> = [[[f64; LANES]; K]; R];

/// A stored matrix entry.
pub(crate) trait Entry: Copy + Into<f64> + Send + Sync {
    /// Four entries as f64.
    ///
    /// # Safety
    /// `from` must point to four readable entries, and the processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_4(from: *const Self) -> __m256d;

    /// Eight entries as f64.
    ///
    /// # Safety
    /// `from` must point to eight readable entries, and the processor must have AVX-512F.
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_8(from: *const Self) -> __m512d;
}

impl Entry for f32 {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn load_4(from: *const Self) -> __m256d {
        // SAFETY: the caller vouches for four entries; unaligned loads are allowed.
        _mm256_cvtps_pd(unsafe { _mm_loadu_ps(from) })
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    unsafe fn load_8(from: *const Self) -> __m512d {
        // SAFETY: the caller vouches for eight entries; unaligned loads are allowed.
        _mm512_cvtps_pd(unsafe { _mm256_loadu_ps(from) })
    }
}

impl Entry for f64 {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn load_4(from: *const Self) -> __m256d {
        // SAFETY: the caller vouches for four entries; unaligned loads are allowed.
        unsafe { _mm256_loadu_pd(from) }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    unsafe fn load_8(from: *const Self) -> __m512d {
        // SAFETY: the caller vouches for eight entries; unaligned loads are allowed.
        unsafe { _mm512_loadu_pd(from) }
    }
}

/// The first `whole` columns, in chunks of [`LANES`]: adds the mirror image to `y` and returns the partial row sums.
pub(super) fn chunks<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> Partial<R, K> {
    let whole = whole / LANES * LANES;
    let long_enough = entries.iter().all(|e| e.len() >= whole)
        && x.iter().all(|x| x.len() >= whole)
        && y.iter().all(|y| y.len() >= whole);
    debug_assert!(long_enough, "a slice is shorter than {whole} columns");
    #[cfg(target_arch = "x86_64")]
    if long_enough && std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has AVX-512F, and every slice holds `whole` values, a multiple of eight.
        return unsafe { chunks_avx512(entries, x_rows, x, y, whole) };
    } else if long_enough && has_avx2() {
        // SAFETY: the processor has AVX2 and FMA, and every slice holds `whole` values, a multiple of eight.
        return unsafe { chunks_avx2(entries, x_rows, x, y, whole) };
    }
    chunks_plain(entries, x_rows, x, y, whole)
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

/// [`chunks`] as any processor can do it; the definition of the order of its sums.
fn chunks_plain<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> Partial<R, K> {
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

/// [`chunks`] in registers of eight.
///
/// # Safety
/// The processor must have AVX-512F; `whole` must be a multiple of eight, and every slice at least as long.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn chunks_avx512<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> Partial<R, K> {
    let mut partial = [[_mm512_setzero_pd(); K]; R];
    let mut x_row = [[_mm512_setzero_pd(); K]; R];
    for r in 0..R {
        for k in 0..K {
            x_row[r][k] = _mm512_set1_pd(x_rows[r][k]);
        }
    }
    let entries = entries.map(<[T]>::as_ptr);
    let x = x.map(<[f64]>::as_ptr);
    let y = y.each_mut().map(|y| y.as_mut_ptr());
    let mut at = 0;
    while at < whole {
        let mut x_now = [_mm512_setzero_pd(); K];
        let mut y_now = [_mm512_setzero_pd(); K];
        for k in 0..K {
            // SAFETY: at + 8 <= whole, which is within every slice.
            unsafe {
                x_now[k] = _mm512_loadu_pd(x[k].add(at));
                y_now[k] = _mm512_loadu_pd(y[k].add(at));
            }
        }
        for r in 0..R {
            // SAFETY: as above, and the caller vouches for AVX-512F. Asking ahead touches nothing, so it may point
            // anywhere.
            let s = unsafe {
                let from = entries[r].add(at);
                _mm_prefetch::<_MM_HINT_T0>(from.cast::<i8>().wrapping_add(AHEAD_BYTES));
                T::load_8(from)
            };
            for k in 0..K {
                partial[r][k] = _mm512_fmadd_pd(s, x_now[k], partial[r][k]);
                y_now[k] = _mm512_fmadd_pd(s, x_row[r][k], y_now[k]);
            }
        }
        for k in 0..K {
            // SAFETY: as above.
            unsafe { _mm512_storeu_pd(y[k].add(at), y_now[k]) };
        }
        at += LANES;
    }
    let mut lanes = [[[0.0; LANES]; K]; R];
    for r in 0..R {
        for k in 0..K {
            // SAFETY: eight values are written to an array of eight.
            unsafe { _mm512_storeu_pd(lanes[r][k].as_mut_ptr(), partial[r][k]) };
        }
    }
    lanes
}

/// [`chunks`] in pairs of registers of four.
///
/// # Safety
/// The processor must have AVX2 and FMA; `whole` must be a multiple of eight, and every slice at least as long.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn chunks_avx2<const R: usize, const K: usize, T: Entry>(
    entries: [&[T]; R],
    x_rows: &[[f64; K]; R],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
    whole: usize,
) -> Partial<R, K> {
    const HALF: usize = LANES / 2;
    let entries = entries.map(<[T]>::as_ptr);
    let x = x.map(<[f64]>::as_ptr);
    let y = y.each_mut().map(|y| y.as_mut_ptr());
    let mut lanes = [[[0.0; LANES]; K]; R];
    // Two rows at a time, as there are sixteen registers; y meets the rows in the same order.
    for first in (0..R).step_by(2) {
        let rows = first..R.min(first + 2);
        let mut partial = [[[_mm256_setzero_pd(); 2]; K]; 2];
        for at in (0..whole).step_by(HALF) {
            let half = at / HALF % 2;
            for k in 0..K {
                // SAFETY: at + 4 <= whole, which is within every slice.
                let (x_now, mut y_now) =
                    unsafe { (_mm256_loadu_pd(x[k].add(at)), _mm256_loadu_pd(y[k].add(at))) };
                for r in rows.clone() {
                    // SAFETY: as above, and the caller vouches for AVX2. Asking ahead touches nothing.
                    let s = unsafe {
                        let from = entries[r].add(at);
                        _mm_prefetch::<_MM_HINT_T0>(from.cast::<i8>().wrapping_add(AHEAD_BYTES));
                        T::load_4(from)
                    };
                    let sum = &mut partial[r - first][k][half];
                    *sum = _mm256_fmadd_pd(s, x_now, *sum);
                    y_now = _mm256_fmadd_pd(s, _mm256_set1_pd(x_rows[r][k]), y_now);
                }
                // SAFETY: as above.
                unsafe { _mm256_storeu_pd(y[k].add(at), y_now) };
            }
        }
        for r in rows {
            for k in 0..K {
                for (half, sums) in partial[r - first][k].iter().enumerate() {
                    // SAFETY: four values are written to half an array of eight.
                    unsafe {
                        _mm256_storeu_pd(lanes[r][k].as_mut_ptr().add(half * HALF), *sums);
                    }
                }
            }
        }
    }
    lanes
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    const N: usize = 40;
    const R: usize = 4;
    const K: usize = 3;

    fn wave(k: usize) -> Vec<f64> {
        (0..N).map(|i| ((i * 7 + k * 13) as f64).sin()).collect()
    }

    /// Partial sums and y of the plain form and of every vector form the processor has.
    fn all_forms<T: Entry>(rows: [&[T]; R]) -> Vec<(Partial<R, K>, [Vec<f64>; K])> {
        let x = [wave(5), wave(6), wave(7)];
        let x = x.each_ref().map(Vec::as_slice);
        let x_rows = [[0.3, -1.7, 2.9], [1.1, 0.7, -0.2], [-0.4, 0.6, 1.3], [2.1, -0.8, 0.5]];
        let run = |form: &dyn Fn(&mut [&mut [f64]; K]) -> Partial<R, K>| {
            let mut y = [wave(8), wave(9), wave(10)];
            let partial = form(&mut y.each_mut().map(Vec::as_mut_slice));
            (partial, y)
        };
        let mut found = vec![run(&|y| chunks_plain(rows, &x_rows, x, y, N))];
        if has_avx2() {
            // SAFETY: AVX2 and FMA are there, and all slices hold 40 values.
            found.push(run(&|y| unsafe { chunks_avx2(rows, &x_rows, x, y, N) }));
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: AVX-512F is there, and all slices hold 40 values.
            found.push(run(&|y| unsafe { chunks_avx512(rows, &x_rows, x, y, N) }));
        }
        found
    }

    /// The vector forms have the bits of the plain one, for f32 and f64 entries.
    #[test]
    fn vector_and_plain_forms_agree_to_the_bit() {
        let wide = [wave(1), wave(2), wave(3), wave(4)];
        let narrow = wide.each_ref().map(|row| row.iter().map(|&s| s as f32).collect::<Vec<f32>>());
        let wide = all_forms(wide.each_ref().map(Vec::as_slice));
        let narrow = all_forms(narrow.each_ref().map(Vec::as_slice));
        assert!(wide.iter().all(|found| *found == wide[0]), "f64 entries: {wide:?}");
        assert!(narrow.iter().all(|found| *found == narrow[0]), "f32 entries: {narrow:?}");
    }
}
