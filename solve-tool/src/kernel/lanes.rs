//! Strips of some rows, in the widest registers of the processor: AVX-512, AVX2 or none. All three do the same fused
//! multiply-adds in the same order on every sum, so they have the same bits.
//!
//! A column belongs to lane (column of S mod [`LANES`]), and vectors lie so that a chunk of [`LANES`] columns is a cache
//! line: no load or store of x or y ever touches two. Columns before the first and after the last whole chunk are masked
//! (AVX-512) or taken one by one; that is the same for every sum.
//!
//! The vector forms are written out because the compiler's own vectorisation of the plain form comes and goes with the
//! numbers of rows and of vectors.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256d, __m512d, _MM_HINT_T0, _MM_HINT_T1, _mm_loadu_ps, _mm_prefetch, _mm256_add_pd, _mm256_cvtps_pd,
    _mm256_fmadd_pd, _mm256_hadd_pd, _mm256_loadu_pd, _mm256_loadu_ps, _mm256_permute2f128_pd,
    _mm256_permute4x64_pd, _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd, _mm512_castpd512_pd256,
    _mm512_castps512_ps256, _mm512_cvtps_pd, _mm512_extractf64x4_pd, _mm512_fmadd_pd, _mm512_loadu_pd,
    _mm512_mask3_fmadd_pd, _mm512_maskz_loadu_pd, _mm512_maskz_loadu_ps, _mm512_set1_pd, _mm512_setzero_pd,
    _mm512_storeu_pd,
};
use std::ops::Range;

/// Columns handled side by side; a row sum is this many partial sums until its end. One AVX-512 register, one cache line.
pub(crate) const LANES: usize = 8;

/// Bytes that memory hands out at a time.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

/// Partial sums of R rows for K vectors.
type Partial<const R: usize, const K: usize> = [[[f64; LANES]; K]; R];

/// R rows of entries over the same columns, of which the first `skip` of the first chunk are not among them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip<'a, const R: usize, T> {
    /// The entries of each row, equally many.
    pub entries: [&'a [T]; R],
    /// Columns of the first chunk before the first entry.
    pub skip: usize,
    /// What to ask memory for meanwhile.
    pub ahead: Ahead,
}

/// Entries that are asked for while a strip is worked on, in the order in which they lie in memory: the processor foresees
/// runs of neighbouring lines, but not rows that are read side by side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ahead {
    /// Bytes from an entry to the one that is to be in the first-level cache next.
    pub near: usize,
    /// Bytes from an entry to the one that is to be on its way to the second-level cache.
    pub far: usize,
    /// Whether the rows of the strip follow one another in memory. If not, they are asked for one after another.
    pub joined: bool,
}

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

    /// Those of eight entries whose bit is set, as f64; 0 for the others.
    ///
    /// # Safety
    /// Those entries must be readable, and the processor must have AVX-512F.
    #[cfg(target_arch = "x86_64")]
    unsafe fn load_some(from: *const Self, mask: u8) -> __m512d;
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

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    unsafe fn load_some(from: *const Self, mask: u8) -> __m512d {
        // SAFETY: the caller vouches for the entries under the mask; others are not touched.
        let some = unsafe { _mm512_maskz_loadu_ps(mask.into(), from) };
        _mm512_cvtps_pd(_mm512_castps512_ps256(some))
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

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    unsafe fn load_some(from: *const Self, mask: u8) -> __m512d {
        // SAFETY: the caller vouches for the entries under the mask; others are not touched.
        unsafe { _mm512_maskz_loadu_pd(mask, from) }
    }
}

impl<const R: usize, T: Entry> Strip<'_, R, T> {
    /// Column behind the last, counted from the first chunk's first.
    fn end(&self) -> usize {
        self.skip + self.entries[0].len()
    }

    /// Adds the mirror image to `y` and returns the row sums. `x` and `y` begin with the chunk of the first column and hold
    /// whole chunks; `x_rows` begins with the rows of the strip.
    pub fn add<const K: usize>(
        &self,
        x_rows: [&[f64]; K],
        x: [&[f64]; K],
        y: [&mut [f64]; K],
    ) -> [[f64; R]; K] {
        let padded = self.end().next_multiple_of(LANES);
        let long_enough = self.skip < LANES
            && self.entries.iter().all(|e| e.len() == self.entries[0].len())
            && x_rows.iter().all(|x| x.len() >= R)
            && x.iter().all(|x| x.len() >= padded)
            && y.iter().all(|y| y.len() >= padded);
        debug_assert!(long_enough, "a slice is shorter than {padded} columns or {R} rows");
        #[cfg(target_arch = "x86_64")]
        if long_enough && std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has AVX-512F, and the lengths were checked.
            return unsafe { self.add_avx512(x_rows, x, y) };
        } else if long_enough && has_avx2() {
            // SAFETY: the processor has AVX2 and FMA, and the lengths were checked.
            return unsafe { self.add_avx2(x_rows, x, y) };
        }
        self.add_plain(x_rows, x, y)
    }

    /// [`Strip::add`] as any processor can do it; the definition of the order of its sums.
    fn add_plain<const K: usize>(
        &self,
        x_rows: [&[f64]; K],
        x: [&[f64]; K],
        mut y: [&mut [f64]; K],
    ) -> [[f64; R]; K] {
        let mut partial = [[[0.0; LANES]; K]; R];
        self.columns(self.skip..self.end(), x_rows, x, &mut y, &mut partial);
        sums(&partial)
    }

    /// Some columns, one by one.
    #[inline(always)]
    fn columns<const K: usize>(
        &self,
        columns: Range<usize>,
        x_rows: [&[f64]; K],
        x: [&[f64]; K],
        y: &mut [&mut [f64]; K],
        partial: &mut Partial<R, K>,
    ) {
        for column in columns {
            for r in 0..R {
                let s: f64 = self.entries[r][column - self.skip].into();
                for k in 0..K {
                    let lane = &mut partial[r][k][column % LANES];
                    *lane = s.mul_add(x[k][column], *lane);
                    y[k][column] = s.mul_add(x_rows[k][r], y[k][column]);
                }
            }
        }
    }

    /// [`Strip::add`] in registers of eight.
    ///
    /// # Safety
    /// The processor must have AVX-512F, and all slices must be as long as [`Strip::add`] says.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    unsafe fn add_avx512<const K: usize>(
        &self,
        x_rows: [&[f64]; K],
        x: [&[f64]; K],
        mut y: [&mut [f64]; K],
    ) -> [[f64; R]; K] {
        let (skip, end) = (self.skip, self.end());
        let whole = end / LANES * LANES;
        let mut partial = [[_mm512_setzero_pd(); K]; R];
        let x_row: [[__m512d; K]; R] =
            std::array::from_fn(|r| std::array::from_fn(|k| _mm512_set1_pd(x_rows[k][r])));
        // Where column 0 of the first chunk would be; only columns from `skip` on are touched.
        let entries = self.entries.map(|e| e.as_ptr().wrapping_sub(skip));
        let x = x.map(<[f64]>::as_ptr);
        let y = y.each_mut().map(|y| y.as_mut_ptr());

        // A chunk of which only the lanes under the mask are columns of the strip.
        let edge = |at: usize, mask: u8, partial: &mut [[__m512d; K]; R]| {
            for k in 0..K {
                // SAFETY: x and y hold whole chunks, and the mask covers entries that are there.
                unsafe {
                    let x_now = _mm512_loadu_pd(x[k].add(at));
                    let mut y_now = _mm512_loadu_pd(y[k].add(at));
                    for r in 0..R {
                        let s = T::load_some(entries[r].wrapping_add(at), mask);
                        partial[r][k] = _mm512_mask3_fmadd_pd(s, x_now, partial[r][k], mask);
                        y_now = _mm512_mask3_fmadd_pd(s, x_row[r][k], y_now, mask);
                    }
                    _mm512_storeu_pd(y[k].add(at), y_now);
                }
            }
        };
        let from_skip = u8::MAX << skip;
        let to_end = !(u8::MAX << (end - whole));
        let mut at = 0;
        if skip > 0 {
            edge(0, if whole == 0 { from_skip & to_end } else { from_skip }, &mut partial);
            at = LANES;
        }
        let mut asking = Asking::new(self, at);
        while at < whole {
            asking.step(self);
            let mut x_now = [_mm512_setzero_pd(); K];
            let mut y_now = [_mm512_setzero_pd(); K];
            for k in 0..K {
                // SAFETY: at + 8 <= end, which is within every slice.
                unsafe {
                    x_now[k] = _mm512_loadu_pd(x[k].add(at));
                    y_now[k] = _mm512_loadu_pd(y[k].add(at));
                }
            }
            for r in 0..R {
                // SAFETY: as above, and at >= skip.
                let s = unsafe { T::load_8(entries[r].wrapping_add(at)) };
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
        if end > whole && at == whole {
            edge(whole, to_end, &mut partial);
        }
        // SAFETY: the caller vouches for AVX-512F.
        unsafe { sums_avx512(&partial) }
    }

    /// [`Strip::add`] in pairs of registers of four.
    ///
    /// # Safety
    /// The processor must have AVX2 and FMA, and all slices must be as long as [`Strip::add`] says.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn add_avx2<const K: usize>(
        &self,
        x_rows: [&[f64]; K],
        x: [&[f64]; K],
        mut y: [&mut [f64]; K],
    ) -> [[f64; R]; K] {
        const HALF: usize = LANES / 2;
        let (skip, end) = (self.skip, self.end());
        let first_whole = skip.next_multiple_of(LANES).min(end);
        let whole = (end / LANES * LANES).max(first_whole);
        let mut lanes = [[[0.0; LANES]; K]; R];
        self.columns(skip..first_whole, x_rows, x, &mut y, &mut lanes);
        let mut asking = Asking::new(self, first_whole);
        // Two rows at a time, as there are sixteen registers; y meets the rows in the same order.
        for first in (0..R).step_by(2) {
            let rows = first..R.min(first + 2);
            let mut partial = [[[_mm256_setzero_pd(); 2]; K]; 2];
            for r in rows.clone() {
                for k in 0..K {
                    for (half, sums) in partial[r - first][k].iter_mut().enumerate() {
                        // SAFETY: four values are read from half an array of eight.
                        *sums = unsafe { _mm256_loadu_pd(lanes[r][k].as_ptr().add(half * HALF)) };
                    }
                }
            }
            for at in (first_whole..whole).step_by(HALF) {
                let half = at / HALF % 2;
                if first == 0 && half == 0 {
                    asking.step(self);
                }
                for k in 0..K {
                    // SAFETY: at + 4 <= end, which is within every slice, and at >= skip.
                    unsafe {
                        let x_now = _mm256_loadu_pd(x[k].as_ptr().add(at));
                        let mut y_now = _mm256_loadu_pd(y[k].as_ptr().add(at));
                        for r in rows.clone() {
                            let s = T::load_4(self.entries[r].as_ptr().add(at - skip));
                            let sum = &mut partial[r - first][k][half];
                            *sum = _mm256_fmadd_pd(s, x_now, *sum);
                            y_now = _mm256_fmadd_pd(s, _mm256_set1_pd(x_rows[k][r]), y_now);
                        }
                        _mm256_storeu_pd(y[k].as_mut_ptr().add(at), y_now);
                    }
                }
            }
            for r in rows {
                for k in 0..K {
                    for (half, sums) in partial[r - first][k].iter().enumerate() {
                        // SAFETY: four values are written to half an array of eight.
                        unsafe { _mm256_storeu_pd(lanes[r][k].as_mut_ptr().add(half * HALF), *sums) };
                    }
                }
            }
        }
        self.columns(whole..end, x_rows, x, &mut y, &mut lanes);
        sums(&lanes)
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

/// The lanes of each row and vector added up.
fn sums<const R: usize, const K: usize>(partial: &Partial<R, K>) -> [[f64; R]; K] {
    std::array::from_fn(|k| {
        std::array::from_fn(|r| {
            let [a, b, c, d, e, f, g, h] = partial[r][k];
            ((a + e) + (c + g)) + ((b + f) + (d + h))
        })
    })
}

/// [`sums`] of registers: four rows are added up side by side.
///
/// # Safety
/// The processor must have AVX-512F.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn sums_avx512<const R: usize, const K: usize>(partial: &[[__m512d; K]; R]) -> [[f64; R]; K] {
    let mut sums = [[0.0; R]; K];
    for k in 0..K {
        // Of each row a + e, b + f, c + g, d + h.
        let half = |r: usize| {
            let lanes = partial[r][k];
            _mm256_add_pd(_mm512_castpd512_pd256(lanes), _mm512_extractf64x4_pd::<1>(lanes))
        };
        // Of two rows (a + e) + (c + g), (b + f) + (d + h).
        let pair = |p: __m256d, q: __m256d| {
            _mm256_add_pd(_mm256_permute2f128_pd::<0x20>(p, q), _mm256_permute2f128_pd::<0x31>(p, q))
        };
        // Rows beyond the last stand for it once more.
        let row = |r: usize| half(r.min(R - 1));
        let mut first = 0;
        while first < R {
            let all = _mm256_hadd_pd(pair(row(first), row(first + 1)), pair(row(first + 2), row(first + 3)));
            // The sums of rows 0, 2, 1, 3.
            let in_order = _mm256_permute4x64_pd::<0b11_01_10_00>(all);
            let mut four = [0.0; 4];
            // SAFETY: four values are written to an array of four.
            unsafe { _mm256_storeu_pd(four.as_mut_ptr(), in_order) };
            let count = (R - first).min(4);
            sums[k][first..first + count].copy_from_slice(&four[..count]);
            first += 4;
        }
    }
    sums
}

/// Where the next strips are asked for.
#[cfg(target_arch = "x86_64")]
struct Asking<T> {
    now: *const T,
    /// Row that is asked for, and chunks until the next one.
    row: usize,
    left: usize,
}

#[cfg(target_arch = "x86_64")]
impl<T: Entry> Asking<T> {
    #[inline(always)]
    fn new<const R: usize>(strip: &Strip<'_, R, T>, at: usize) -> Self {
        let now = strip.entries[0].as_ptr().wrapping_add(at - strip.skip);
        Self { now, row: 0, left: Self::share(strip) }
    }

    /// Chunks after which the next row is asked for: each row's line takes its share of the strip.
    #[inline(always)]
    fn share<const R: usize>(strip: &Strip<'_, R, T>) -> usize {
        if strip.ahead.joined { usize::MAX } else { (strip.entries[0].len() / LANES / R).max(1) }
    }

    /// Asks for as many lines as a chunk of the strip has.
    #[inline(always)]
    fn step<const R: usize>(&mut self, strip: &Strip<'_, R, T>) {
        let chunk = R * LANES;
        for line in 0..(chunk * size_of::<T>()).div_ceil(LINE) {
            let from = self.now.cast::<i8>().wrapping_add(line * LINE);
            // SAFETY: asking touches nothing, so it may point anywhere; every x86-64 processor has the instruction.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(from.wrapping_add(strip.ahead.near));
                _mm_prefetch::<_MM_HINT_T1>(from.wrapping_add(strip.ahead.far));
            }
        }
        self.now = self.now.wrapping_add(chunk);
        self.left = self.left.saturating_sub(1);
        if self.left == 0 && self.row + 1 < R {
            self.row += 1;
            self.left = Self::share(strip);
            self.now = strip.entries[self.row].as_ptr();
        }
    }
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

    fn slices(y: &mut Columns) -> [&mut [f64]; K] {
        y.each_mut().map(Vec::as_mut_slice)
    }

    type Sums = [[f64; R]; K];
    type Columns = [Vec<f64>; K];

    /// Row sums and y of the plain form and of every vector form the processor has.
    fn all_forms<T: Entry>(rows: [&[T]; R], columns: Range<usize>) -> Vec<(Sums, Columns)> {
        let skip = columns.start;
        let entries = rows.map(|row| &row[columns.clone()]);
        let strip =
            Strip { entries, skip, ahead: Ahead { near: 64, far: 128, joined: skip.is_multiple_of(2) } };
        let x = [wave(5), wave(6), wave(7)];
        let x = x.each_ref().map(Vec::as_slice);
        let x_rows = [[0.3, -1.7, 2.9, 1.1], [0.7, -0.2, -0.4, 0.6], [1.3, 2.1, -0.8, 0.5]];
        let x_rows = x_rows.each_ref().map(|x| x.as_slice());
        let run = |form: &dyn Fn(&mut Columns) -> Sums| {
            let mut y = [wave(8), wave(9), wave(10)];
            (form(&mut y), y)
        };
        let mut found = vec![run(&|y| strip.add_plain(x_rows, x, slices(y)))];
        if has_avx2() {
            // SAFETY: AVX2 and FMA are there, and all slices hold 40 values.
            found.push(run(&|y| unsafe { strip.add_avx2(x_rows, x, slices(y)) }));
        }
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: AVX-512F is there, and all slices hold 40 values.
            found.push(run(&|y| unsafe { strip.add_avx512(x_rows, x, slices(y)) }));
        }
        found
    }

    /// The vector forms have the bits of the plain one, for f32 and f64 entries, wherever a strip begins and ends.
    #[test]
    fn vector_and_plain_forms_agree_to_the_bit() {
        let wide = [wave(1), wave(2), wave(3), wave(4)];
        let narrow = wide.each_ref().map(|row| row.iter().map(|&s| s as f32).collect::<Vec<f32>>());
        for skip in 0..LANES {
            for end in skip..=N {
                let wide = all_forms(wide.each_ref().map(Vec::as_slice), skip..end);
                let narrow = all_forms(narrow.each_ref().map(Vec::as_slice), skip..end);
                assert!(wide.iter().all(|found| *found == wide[0]), "f64 entries {skip}..{end}: {wide:?}");
                assert!(
                    narrow.iter().all(|found| *found == narrow[0]),
                    "f32 entries {skip}..{end}: {narrow:?}"
                );
            }
        }
    }
}
