//! `--method hemicube`: what the centre of each element sees, by item buffers (Cohen & Greenberg 85; the half cube itself is
//! [`geometry::hemicube`]).
//!
//! Blockers come from the input faces (merged), drawn where their backs are seen; their fronts are covered by their elements.
//! Each row's cube is turned about the normal by another part of a quarter turn (multiples of the golden ratio: evenly
//! spread for neighbours), so that cells do not line up with the walls and the errors of neighbours do not add up.
//!
//! # Error
//! Three kinds (Baum, Rushmeier & Winget 89): a finite element is replaced by its centre (proximity), what the centre sees
//! stands for the whole (visibility), cells are counted or not (aliasing). All three show when the eye moves: item
//! buffers of half the resolution at the points of a small Gauss rule are compared with those at the centre, and the
//! differences are the errors, entry by entry. That takes more time than the row itself (half of all cells, and every polygon
//! once more per point); what is cheaper, comparing one row in four or sharing a row's error out by its factors, was tried
//! and left rows with up to 1.6 times the error they stated. What all the points miss alike is not in it:
//! elements smaller than a cell; and the mean of so few points is itself off where elements touch.

use crate::rows::{Row, RowSource};
use crate::scene::Scene;
use geometry::hemicube::{Hemicube, Item};
use geometry::quadrature::{Strength, polygon_rule};
use glam::DVec3;
use interchange::report::Report;
use std::f64::consts::FRAC_PI_2;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Allowance for the mean of few points being itself off: without it rows of measured scenes had up to all of the error
/// they stated.
const FEW_POINTS: f64 = 1.2;
/// The golden ratio less one: its multiples are spread evenly over [0, 1).
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Hemicubes over the elements of a scene.
#[derive(Debug)]
pub struct HemicubeRows<'a> {
    scene: &'a Scene,
    cube: Hemicube,
    coarse: Hemicube,
    drawn: AtomicUsize,
}

impl<'a> HemicubeRows<'a> {
    /// With `resolution` cells along an edge of the top.
    pub fn new(scene: &'a Scene, resolution: usize) -> Self {
        Self {
            scene,
            cube: Hemicube::new(resolution),
            coarse: Hemicube::new(resolution.div_ceil(2)),
            drawn: AtomicUsize::new(0),
        }
    }

    /// Calls `visit(j, F)` for what an eye on element `i` sees; `step` tells eyes of one element apart.
    fn see(&self, cube: &Hemicube, i: usize, eye: DVec3, step: usize, visit: impl FnMut(usize, f64)) {
        let scene = self.scene;
        let blockers = scene.occluders.iter().map(|o| Item {
            number: None,
            corners: &o.corners,
            plane: &o.plane,
            radius: o.radius,
        });
        let elements = scene.patches.iter().enumerate().filter(|(j, _)| scene.faces[*j] != scene.faces[i]);
        let items = elements.map(|(j, p)| Item {
            number: Some(j as u32),
            corners: &p.corners,
            plane: &p.plane,
            radius: p.radius,
        });
        let turn = FRAC_PI_2 * (GOLDEN * (i + 1 + step) as f64).fract();
        let normal = scene.patches[i].plane.normal;
        cube.see(eye, normal, turn, scene.len(), blockers.chain(items), visit);
        self.drawn.fetch_add(1, Ordering::Relaxed);
    }

    /// Mean of what other eyes on element `i` see of each element, less what its centre has `seen`.
    fn differences(&self, i: usize, seen: &[f64]) -> Vec<f64> {
        let patch = &self.scene.patches[i];
        let (mut eyes, mut weights) = (Vec::new(), Vec::new());
        polygon_rule(&patch.corners, Strength::Low, &mut eyes, &mut weights);
        let mut differences: Vec<f64> = seen.iter().map(|factor| -factor).collect();
        for (step, (&eye, weight)) in eyes.iter().zip(&weights).enumerate() {
            let share = weight / patch.area;
            self.see(&self.coarse, i, eye, step + 1, |j, factor| differences[j] += share * factor);
        }
        differences
    }
}

impl RowSource for HemicubeRows<'_> {
    fn row(&self, i: usize) -> Row {
        let mut seen = vec![0.0; self.scene.len()];
        self.see(&self.cube, i, self.scene.patches[i].centroid, 0, |j, factor| seen[j] = factor);
        let mut row = Row::default();
        for (j, (factor, difference)) in seen.iter().zip(self.differences(i, &seen)).enumerate() {
            if *factor > 0.0 || difference != 0.0 {
                row.push(j, *factor, FEW_POINTS * difference.abs());
            }
        }
        row
    }

    fn error_of_mean(&self, a: f64, b: f64) -> f64 {
        // Errors of a centre taken for the whole are alike on both sides.
        0.5 * (a + b)
    }

    fn note(&self, report: &mut Report) {
        report.count("hemicubes drawn", self.drawn.load(Ordering::Relaxed));
        report.estimate("sum of delta factors", self.cube.sums().1);
    }
}
