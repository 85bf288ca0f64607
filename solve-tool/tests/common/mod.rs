//! Systems with known answers, built in code.
#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::panic)]

use interchange::matrix::{Block, BlockKind, Values};
use solve_tool::channels::Channel;
use solve_tool::error::Result;
use solve_tool::product::Product;
use solve_tool::solve::{Solved, Solver, solve};
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
