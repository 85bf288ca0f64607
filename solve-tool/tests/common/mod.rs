//! Systems with known answers, built in code.
#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::panic)]

use geometry::gather::{Gatherer, Scratch};
use geometry::occluder::Occluder;
use geometry::patch::Patch;
use geometry::quadrature::{Strength, polygon_rule};
use geometry::unoccluded;
use glam::DVec3;
use interchange::matrix::{Block, BlockKind, Values};
use rayon::prelude::*;
use solve_tool::channels::Channel;
use solve_tool::error::Result;
use solve_tool::product::Product;
use solve_tool::solve::{Options, Solved, Solver, solve, solve_with};
use solve_tool::system::System;

/// Factor between opposite faces of a cube.
pub const CUBE_OPPOSITE: f64 = 0.19982489569838738304;
/// Factor between adjacent faces of a cube.
pub const CUBE_ADJACENT: f64 = 0.20004377607540315424;

/// A scene without files: areas and the exchange matrix S, dense.
#[derive(Debug, Clone)]
pub struct Scene {
    pub areas: Vec<f64>,
    /// S, all of it.
    pub exchange: Vec<Vec<f64>>,
    pub row_errors: Vec<f64>,
}

impl Scene {
    pub fn new(areas: Vec<f64>, factor: impl Fn(usize, usize) -> f64) -> Self {
        let n = areas.len();
        let exchange = (0..n).map(|i| (0..n).map(|j| areas[i] * factor(i, j)).collect()).collect();
        Self { row_errors: vec![0.0; n], areas, exchange }
    }

    /// The unit cube, one patch a face: faces 2k and 2k + 1 are opposite.
    pub fn cube() -> Self {
        Self::new(vec![1.0; 6], |i, j| match (i == j, i / 2 == j / 2) {
            (true, _) => 0.0,
            (_, true) => CUBE_OPPOSITE,
            _ => CUBE_ADJACENT,
        })
    }

    /// Box 1 x 1 x 2: patches 0-1 and 2-3 opposite 1 x 2 sides, 4-5 the unit squares.
    pub fn box_1_1_2() -> Self {
        let s = |i: usize, j: usize| match (i.min(j), i.max(j)) {
            (i, j) if i == j => 0.0,
            (0, 1) | (2, 3) => 0.571750769701,
            (4, 5) => 0.068589588819,
            (_, 4 | 5) => 0.232852602795,
            _ => 0.481272012354,
        };
        let areas = [2.0, 2.0, 2.0, 2.0, 1.0, 1.0];
        Self::new(areas.to_vec(), |i, j| s(i, j) / areas[i])
    }

    /// The unit cube with n x n elements a face, exact factors; the faces in the order x=0, x=1, y=0, y=1, z=0, z=1,
    /// element (a, b) of a face at a n + b.
    pub fn cube_grid(n: usize) -> Self {
        Self::of_patches(&cube_patches(n), &[])
    }

    /// Two unit rooms side by side in x, n x n elements a face, and in the wall between them a door in place of `door` x
    /// `door` elements near the middle. Elements of the first room come first.
    pub fn two_rooms(n: usize, door: usize) -> Self {
        let first = n / 2 - door / 2;
        let mut patches = Vec::new();
        let mut wall = Vec::new();
        for room in 0..2 {
            let low = DVec3::new(room as f64, 0.0, 0.0);
            for face in 0..6 {
                let (axis, far) = (face / 2, face % 2 == 1);
                let height = low[axis] + if far { 1.0 } else { 0.0 };
                let mut cells = grid(low, axis, height, !far, n);
                if axis == 0 && far == (room == 0) {
                    for a in first..first + door {
                        cells[a * n + first..][..door].fill_with(|| None);
                    }
                    if room == 0 {
                        wall.extend(cells.iter().flatten().map(|patch| patch.corners.clone()));
                    }
                }
                patches.extend(cells.into_iter().flatten());
            }
        }
        Self::of_patches(&patches, &wall)
    }

    /// Exchange of planar patches: exact where they lie in one room; between rooms, with the plane x = 1 and its `wall`
    /// between them, gathered at points, the mean of both directions.
    pub fn of_patches(patches: &[Patch], wall: &[Vec<DVec3>]) -> Self {
        let n = patches.len();
        let room = |patch: &Patch| patch.centroid.x + 1e-9 * patch.plane.normal.x > 1.0;
        let corners = || patches.iter().map(|patch| patch.corners.clone()).collect();
        let gatherer = Gatherer::new(wall.iter().cloned().filter_map(Occluder::new).collect(), corners());
        let rows: Vec<Vec<f64>> = (0..n)
            .into_par_iter()
            .map(|i| {
                let p = &patches[i];
                let exact = |q: &Patch| {
                    if room(p) == room(q) { unoccluded::exchange(p, q, 1e-12).0.value } else { 0.0 }
                };
                let mut row: Vec<f64> = patches.iter().map(exact).collect();
                let (mut points, mut weights) = (Vec::new(), Vec::new());
                if !wall.is_empty() {
                    polygon_rule(&p.corners, Strength::Product(4), &mut points, &mut weights);
                }
                let mut scratch = Scratch::default();
                for (point, weight) in points.into_iter().zip(weights) {
                    gatherer.factors(point, p.plane.normal, &mut scratch, &mut |j, factor| {
                        if room(&patches[j]) != room(p) {
                            row[j] += weight * factor;
                        }
                    });
                }
                row
            })
            .collect();
        let of = |i: usize, j: usize| 0.5 * (rows[i][j] + rows[j][i]);
        let areas: Vec<f64> = patches.iter().map(|patch| patch.area).collect();
        let exchange =
            (0..n).map(|i| (0..n).map(|j| if i == j { 0.0 } else { of(i, j) }).collect()).collect();
        Self { row_errors: vec![0.0; n], areas, exchange }
    }

    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// The upper triangle, row after row.
    pub fn triangle(&self) -> Vec<f64> {
        (0..self.len()).flat_map(|i| self.exchange[i][i..].to_vec()).collect()
    }

    /// The matrix as blocks: a triangle for each range between `cuts`, dense blocks between them.
    pub fn blocks(&self, cuts: &[usize]) -> (Vec<Block>, Vec<f64>) {
        let mut ends = vec![0];
        ends.extend_from_slice(cuts);
        ends.push(self.len());
        let range = |k: usize| ends[k] as u32..ends[k + 1] as u32;
        let (mut blocks, mut values) = (Vec::new(), Vec::new());
        for a in 0..ends.len() - 1 {
            for b in a..ends.len() - 1 {
                let kind = if a == b { BlockKind::Triangle } else { BlockKind::Dense };
                blocks.push(Block::new(kind, range(a), range(b), values.len() as u64));
                for i in range(a) {
                    for j in range(b).filter(|&j| a != b || j >= i) {
                        values.push(self.exchange[i as usize][j as usize]);
                    }
                }
            }
        }
        (blocks, values)
    }

    pub fn with_system<T>(&self, use_it: impl FnOnce(&System<'_>) -> T) -> T {
        let (blocks, values) = self.blocks(&[]);
        let product = Product::from_parts(self.len(), &blocks, Values::F64(&values));
        use_it(&System::from_parts(product, &self.areas, &self.row_errors, 0.0))
    }

    pub fn solve(&self, channels: &[Channel; 3], solver: Solver, tolerance: f64) -> Result<Solved> {
        self.with_system(|system| solve(system, channels, solver, tolerance))
    }

    pub fn solve_with(&self, channels: &[Channel; 3], options: &Options) -> Result<Solved> {
        self.with_system(|system| solve_with(system, channels, options, None))
    }

    /// Radiosity of one grey channel, solved by both methods, which must agree to 1e-10 of the largest value.
    pub fn radiosity(&self, reflectance: &[f64], exitance: &[f64]) -> Vec<f64> {
        let channels = grey(reflectance, exitance);
        let cg = self.solve(&channels, Solver::Cg, 1e-13).unwrap().channels[0].radiosity.clone();
        let direct = self.solve(&channels, Solver::Direct, 1e-13).unwrap().channels[0].radiosity.clone();
        let largest = cg.iter().copied().fold(0.0, f64::max);
        assert_all_close(&cg, &direct, 1e-10 * largest);
        direct
    }
}

/// The patches of [`Scene::cube_grid`].
pub fn cube_patches(n: usize) -> Vec<Patch> {
    let face = |face: usize| {
        let (axis, far) = (face / 2, face % 2 == 1);
        grid(DVec3::ZERO, axis, if far { 1.0 } else { 0.0 }, !far, n).into_iter().flatten()
    };
    (0..6).flat_map(face).collect()
}

/// The n x n squares of the unit square at `height` along `axis`, from the corner `low`, looking up that axis or down.
fn grid(low: DVec3, axis: usize, height: f64, up: bool, n: usize) -> Vec<Option<Patch>> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let point = |a: usize, b: usize| {
        let mut p = low;
        p[axis] = height;
        p[u] += a as f64 / n as f64;
        p[v] += b as f64 / n as f64;
        p
    };
    let cell = |k: usize| {
        let (a, b) = (k / n, k % n);
        let mut corners = vec![point(a, b), point(a + 1, b), point(a + 1, b + 1), point(a, b + 1)];
        if !up {
            corners.reverse();
        }
        Patch::new(corners)
    };
    (0..n * n).map(cell).collect()
}

/// Three equal channels.
pub fn grey(reflectance: &[f64], exitance: &[f64]) -> [Channel; 3] {
    std::array::from_fn(|_| channel(reflectance, exitance))
}

pub fn channel(reflectance: &[f64], exitance: &[f64]) -> Channel {
    Channel { reflectance: reflectance.to_vec(), exitance: exitance.to_vec() }
}

#[track_caller]
pub fn assert_all_close(got: &[f64], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len());
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!(
            (g - w).abs() <= tolerance,
            "{i}: got {g:.15e}, want {w:.15e}, off by {:.1e}\n{got:?}",
            g - w
        );
    }
}

/// Reproducible numbers in [0, 1): an LCG's upper bits (Knuth's MMIX constants).
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A random closed or open scene: symmetric S >= 0 with row sums of F at most `most`.
pub fn random_scene(n: usize, most: f64, seed: u64) -> Scene {
    let mut next = random(seed);
    let mut s = vec![vec![0.0; n]; n];
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    for (i, j) in pairs {
        let entry = if next() < 0.3 { 0.0 } else { next() };
        s[i][j] = entry;
        s[j][i] = entry;
    }
    let areas: Vec<f64> =
        s.iter().map(|row| (row.iter().sum::<f64>() / most).max(1e-3) * (1.0 + next())).collect();
    Scene { row_errors: vec![0.0; n], areas, exchange: s }
}
