//! The samples of a pixel: a regular few, and many more where the border of a surface crosses it, so that what each surface covers
//! of the pixel is known (coverage as in Catmull 1978, by sampling). Light changes slowly within a surface: of the many
//! samples those that see one face within a cell become one again, at their mean place and with their share.

use crate::camera::Camera;
use crate::visible::{Met, Point, Seen, VisibleSurface};
use std::ops::Range;

/// How a pixel is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// Samples along each side of a pixel.
    pub each: usize,
    /// Samples along each side of a cell where borders are seen; a pixel has [`Sampling::each`] squared cells.
    pub in_cell: usize,
    /// The same where a lamp is on one side of the border.
    pub at_lamps: usize,
}

/// Samples along each side of a pixel that keep its coverage good enough for a tolerance of 0.04.
const SIDE: f64 = 12.0;
const SIDE_TOLERANCE: f64 = 0.04;
/// Most samples along each side of a pixel that a tolerance asks for, and most at the border of a lamp.
const MOST: f64 = 32.0;
const MOST_AT_LAMPS: f64 = 64.0;
/// So many times the samples along each side at the borders of lamps: those are some ten times brighter than what they light, and the
/// error falls by 3^(3/2). Few pixels are such.
const TIMES_AT_LAMPS: f64 = 3.0;

impl Sampling {
    /// As many at borders as a tolerance asks for, or the given number.
    ///
    /// A border of random place and direction leaves n x n samples with an error of coverage that falls like n^(-3/2) (Kensler's
    /// samples, as [`place_in_pixel`] has them). The Cornell box at that tolerance is off by 0.99, 0.86, 0.61, 0.58 and 0.55 % (RMS) with 4,
    /// 8, 12, 16 and 24, which take 1.0, 1.03, 1.04, 1.2 and 1.5 times the time.
    pub fn new(each: usize, at_borders: Option<usize>, tolerance: f64) -> Sampling {
        let by_tolerance = (SIDE * (SIDE_TOLERANCE / tolerance).powf(2.0 / 3.0)).min(MOST);
        let side = at_borders.map_or(by_tolerance, |side| side as f64);
        let per_cell = |side: f64| (side / each as f64).round().max(1.0) as usize;
        let in_cell = per_cell(side);
        // Whoever asks for no more samples at borders than elsewhere gets no more.
        let is_off = at_borders.is_some() && in_cell == 1;
        let at_lamps =
            if is_off { 1 } else { per_cell((TIMES_AT_LAMPS * side).min(MOST_AT_LAMPS)).max(in_cell) };
        Sampling { each, in_cell, at_lamps }
    }
}

/// What one or many samples of a pixel see.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// What is seen.
    pub seen: Seen,
    /// Part of the pixel that it stands for.
    pub share: f64,
    /// Place in the picture, in pixels.
    pub at: [f64; 2],
}

/// The samples of a row of pixels.
#[derive(Debug, Default)]
pub struct RowSamples {
    samples: Vec<Sample>,
    /// Where the samples of each pixel end.
    ends: Vec<usize>,
    /// Pixels that borders of surfaces cross.
    pub borders: usize,
    /// Those of them that a lamp is seen in.
    pub lamp_borders: usize,
    /// Rays cast.
    pub rays: usize,
}

impl RowSamples {
    /// The samples of each pixel in order.
    pub fn pixels(&self) -> impl Iterator<Item = &[Sample]> {
        let start = |k: usize| if k == 0 { 0 } else { self.ends[k - 1] };
        (0..self.ends.len()).map(move |k| &self.samples[start(k)..self.ends[k]])
    }
}

/// Samples pixels as a camera sees them.
#[derive(Debug, Clone, Copy)]
pub struct PixelSampler<'a> {
    surface: &'a VisibleSurface,
    camera: &'a Camera,
    sampling: Sampling,
}

/// Samples within a cell that see one face.
#[derive(Debug, Clone, Copy)]
struct Group {
    met: Met,
    count: usize,
    at: [f64; 2],
}

impl Group {
    /// Whether both see one side of one face, or nothing.
    fn goes_with(&self, met: &Met) -> bool {
        match (&self.met, met) {
            (Met::Face(a), Met::Face(b)) => (a.face, a.side) == (b.face, b.side),
            (a, b) => a == b,
        }
    }

    fn add(&mut self, met: &Met, [x, y]: [f64; 2]) {
        self.count += 1;
        self.at = [self.at[0] + x, self.at[1] + y];
        if let (Met::Face(sum), Met::Face(one)) = (&mut self.met, met) {
            (sum.point, sum.depth) = (sum.point + one.point, sum.depth + one.depth);
        }
    }

    /// The mean of its samples. A face that is not convex may not have the mean point: its nearest element has.
    fn mean(&self) -> (Met, [f64; 2]) {
        let count = self.count as f64;
        let met = match self.met {
            Met::Face(sum) => Met::Face(Point { point: sum.point / count, depth: sum.depth / count, ..sum }),
            other => other,
        };
        (met, self.at.map(|x| x / count))
    }
}

impl<'a> PixelSampler<'a> {
    /// Sees the scene through a camera.
    pub fn new(surface: &'a VisibleSurface, camera: &'a Camera, sampling: Sampling) -> PixelSampler<'a> {
        PixelSampler { surface, camera, sampling }
    }

    /// The samples of pixels of a row.
    pub fn row(&self, row: usize, columns: Range<usize>) -> RowSamples {
        let mut samples = RowSamples::default();
        let (mut met, mut groups) = (Vec::new(), Vec::new());
        // A border that cuts off a corner may pass between the samples: what the corners see tells.
        let mut corners = |column: usize| {
            samples.rays += 2;
            [row, row + 1].map(|row| self.surface.met(self.camera, [column as f64, row as f64]))
        };
        let corners: Vec<[Met; 2]> = (columns.start..=columns.end).map(&mut corners).collect();
        for (column, corners) in columns.zip(corners.windows(2)) {
            self.pixel([column as f64, row as f64], corners, (&mut met, &mut groups), &mut samples);
            samples.ends.push(samples.samples.len());
        }
        samples
    }

    fn pixel(
        &self,
        corner: [f64; 2],
        corners: &[[Met; 2]],
        (met, groups): (&mut Vec<(Met, [f64; 2])>, &mut Vec<Group>),
        row: &mut RowSamples,
    ) {
        let Sampling { each, in_cell, at_lamps } = self.sampling;
        let place = |[x, y]: [f64; 2]| [corner[0] + x, corner[1] + y];
        met.clear();
        met.extend((0..each * each).map(|k| {
            let at = place(place_in_pixel(k, each));
            (self.surface.met(self.camera, at), at)
        }));
        row.rays += met.len();
        let all = || met.iter().map(|(met, _)| met).chain(corners.as_flattened());
        let is_border = all().any(|other| !self.surface.is_one_surface(&met[0].0, other));
        let is_lamp = is_border && all().any(|met| self.surface.emits(met));
        let in_cell = if is_lamp { at_lamps } else { in_cell };
        row.lamp_borders += usize::from(is_lamp);
        row.borders += usize::from(is_border);
        let share = 1.0 / (each * each) as f64;
        if !is_border || in_cell == 1 {
            let sample =
                |&(met, at): &(Met, [f64; 2])| Sample { seen: self.surface.element(&met), share, at };
            row.samples.extend(met.iter().map(sample));
            return;
        }
        let in_all = in_cell * in_cell;
        row.rays += each * each * in_all;
        for cell in 0..each * each {
            let cell = [(cell % each) as f64, (cell / each) as f64];
            groups.clear();
            for k in 0..in_all {
                let within = place_in_pixel(k, in_cell);
                let at = place([0, 1].map(|c| (cell[c] + within[c]) / each as f64));
                let met = self.surface.met(self.camera, at);
                match groups.iter_mut().find(|group| group.goes_with(&met)) {
                    Some(group) => group.add(&met, at),
                    None => groups.push(Group { met, count: 1, at }),
                }
            }
            row.samples.extend(groups.iter().map(|group| {
                let (met, at) = group.mean();
                let share = share * group.count as f64 / in_all as f64;
                Sample { seen: self.surface.element(&met), share, at }
            }));
        }
    }
}

/// Place within its pixel of sample `k`: one in each cell of a regular grid, and all in different columns and rows of a grid
/// so many times finer (as Kensler 2013, "Correlated Multi-Jittered Sampling", before jitter). So an edge along rows or
/// columns, as most edges of rooms are, is covered in n^2 steps instead of n. His arrangement has n samples on the
/// pixel's diagonal, where edges of rooms seen straight run; counting one axis backwards leaves it free.
fn place_in_pixel(k: usize, samples: usize) -> [f64; 2] {
    let n = samples as f64;
    let (column, row) = ((k % samples) as f64, (k / samples) as f64);
    [(column + (row + 0.5) / n) / n, (row + (n - column - 0.5) / n) / n]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::Lens;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use glam::DVec3;

    #[test]
    fn samples_fall_into_all_cells_rows_and_columns_once() {
        for n in [1, 2, 3, 4, 8] {
            let places: Vec<[f64; 2]> = (0..n * n).map(|k| place_in_pixel(k, n)).collect();
            let all = |key: &dyn Fn(&[f64; 2]) -> usize| {
                let mut keys: Vec<usize> = places.iter().map(key).collect();
                keys.sort_unstable();
                keys == (0..n * n).collect::<Vec<_>>()
            };
            let (side, fine) = (n as f64, (n * n) as f64);
            assert!(all(&|p| (p[0] * side) as usize + n * (p[1] * side) as usize));
            assert!(all(&|p| (p[0] * fine) as usize) && all(&|p| (p[1] * fine) as usize));
            let on_diagonals = places.iter().filter(|p| p[0] == p[1] || p[0] + p[1] == 1.0).count();
            assert_eq!(on_diagonals, n % 2, "{places:?}");
            let mean = places.iter().fold(0.0, |sum, p| sum + p[0]) / fine;
            assert!((mean - 0.5).abs() < 1e-12, "{mean}");
        }
    }

    #[test]
    fn a_tolerance_asks_for_samples() {
        let in_cell = |tolerance: f64| Sampling::new(4, None, tolerance).in_cell;
        assert_eq!([0.5, 0.1, 0.04, 0.02, 0.01, 1e-9].map(in_cell), [1, 2, 3, 5, 8, 8]);
        assert_eq!(Sampling::new(4, Some(16), 0.5).in_cell, 4);
        assert_eq!(Sampling::new(4, Some(1), 0.01).in_cell, 1);
        assert_eq!(Sampling::new(64, None, 0.01).in_cell, 1);
        let at_lamps = |tolerance: f64| Sampling::new(4, None, tolerance).at_lamps;
        assert_eq!([0.5, 0.1, 0.04, 0.02, 0.01, 1e-9].map(at_lamps), [2, 5, 9, 14, 16, 16]);
        assert_eq!(Sampling::new(4, Some(16), 0.5).at_lamps, 12);
        assert_eq!(Sampling::new(4, Some(4), 0.01).at_lamps, 1);
    }

    /// A half plane seen straight, its border turned by an irrational angle: the covered part of each pixel against its exact value,
    /// the pixel's square clipped.
    #[test]
    fn coverage_is_that_of_the_clipped_pixel() {
        let (sin, cos) = 0.37f64.sin_cos();
        let (along, across) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, -20.0 * along, 40.0 * along, 20.0 * across, 1, 0);
        let scene = lit(mesh);
        let surface = VisibleSurface::new(&scene);
        let eye = DVec3::new(0.0, 0.0, 5.0);
        let camera = Camera::new(eye, DVec3::ZERO, DVec3::Y, Lens::Orthographic(9.0), [9, 9]).unwrap();
        let mut largest = [0.0f64; 2];
        for (in_cell, largest) in [1, 4].into_iter().zip(&mut largest) {
            let sampler =
                PixelSampler::new(&surface, &camera, Sampling { each: 4, in_cell, at_lamps: in_cell });
            for row in 0..9 {
                let samples = sampler.row(row, 0..9);
                for (column, samples) in samples.pixels().enumerate() {
                    let total: f64 = samples.iter().map(|sample| sample.share).sum();
                    assert!((total - 1.0).abs() < 1e-12);
                    let is_seen = |s: &&Sample| matches!(s.seen, Seen::Surface(..));
                    let got: f64 = samples.iter().filter(is_seen).map(|sample| sample.share).sum();
                    let low = DVec3::new(column as f64 - 4.5, 3.5 - row as f64, 0.0);
                    let square = [low, low + DVec3::X, low + DVec3::X + DVec3::Y, low + DVec3::Y];
                    let mut part = Vec::new();
                    geometry::polygon::clip_by(&square, |p| across.dot(p), &mut part);
                    let want = if part.len() < 3 { 0.0 } else { geometry::polygon::area(&part) };
                    *largest = largest.max((got - want).abs());
                    assert!(samples.len() <= 32, "{} samples", samples.len());
                }
                // A pixel's own, two at each end of the columns, those of its cells.
                let in_cells = samples.borders * if in_cell == 1 { 0 } else { 256 };
                assert_eq!(samples.rays, 9 * 16 + 10 * 2 + in_cells);
            }
        }
        // A line leaves n^2 points of low discrepancy with n^(-3/2): 0.125 of 16, 0.016 of 256.
        assert!(largest[0] > 0.03 && largest[0] < 0.125, "{largest:?}");
        assert!(largest[1] < 0.016, "{largest:?}");
    }

    /// Squares of one material in one plane are one surface; the wall beside them is another.
    #[test]
    fn faces_in_one_plane_have_no_border_between_them() {
        let scene = cube(3);
        let surface = VisibleSurface::new(&scene);
        let eye = DVec3::new(0.5, 0.5, 0.1);
        let camera = Camera::new(eye, eye + DVec3::Z, DVec3::Y, Lens::Vertical(50.0), [8, 8]).unwrap();
        let sampler = PixelSampler::new(&surface, &camera, Sampling { each: 2, in_cell: 4, at_lamps: 4 });
        assert_eq!((0..8).map(|row| sampler.row(row, 0..8).borders).sum::<usize>(), 0);
        // The far wall has an angle of 58.1 degrees there, so that a view of 70 sees its border all around.
        let camera =
            Camera { ..Camera::new(eye, eye + DVec3::Z, DVec3::Y, Lens::Vertical(70.0), [8, 8]).unwrap() };
        let sampler = PixelSampler::new(&surface, &camera, Sampling { each: 2, in_cell: 4, at_lamps: 4 });
        let borders: Vec<usize> = (0..8).map(|row| sampler.row(row, 0..8).borders).collect();
        assert!(borders.iter().all(|&count| count >= 2), "{borders:?}");
    }
}
