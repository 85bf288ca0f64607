//! `--method rays`: every element shoots cosine-distributed rays; F_ij is the share of them whose first hit is the front
//! of element j.
//!
//! Origins and directions are stratified: one in each of n cells of equal area, combined in shuffled order. The seed
//! of a row is its number, so a row is the same in whatever order or part of the matrix it is computed.
//!
//! Rays are cast against the elements, which cover the input faces: what is wanted is the element that is hit.
//!
//! # Error
//! Of n rays N hit element j: a binomial number, whose spread stratification only makes smaller. The mean |error| of a
//! binomial count is at most sqrt(2/pi N (1 - N/n)) where N is large; where less than one hit is expected it is twice the expected
//! count, which elements that were hit must carry for those that were missed. 0.8 sqrt(N (1 - N/n)) + 1.2 for N > 0 is at least
//! both. The sum of such errors over a row spreads about its mean; three times that spread is added in proportion, so
//! that rows of few elements are covered too. The two rows of a pair are independent: errors of their mean add in squares.

use crate::rows::{Row, RowSource};
use crate::scene::Scene;
use geometry::patch::Patch;
use geometry::plane::PLANARITY;
use geometry::ray_cast::RayCaster;
use geometry::strata::{AreaMap, Random, cosine_direction, jittered};
use glam::DVec3;
use interchange::report::Report;
use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Mean |error| of a count in units of its standard deviation: sqrt(2 / pi), rounded up.
const MEAN_DEVIATION: f64 = 0.8;
/// Standard deviation of |error| in units of that of the count, sqrt(1 - 2 / pi), three times.
const SPREAD: f64 = 3.0 * 0.603;
/// Added per element hit, so that a single hit counts 2: its own error and that of the elements missed instead.
const RARE_HITS: f64 = 1.2;
/// Tells the two random sequences of a row apart.
const ORIGINS: u64 = 1;

/// Rays from the elements of a scene.
#[derive(Debug)]
pub struct RayRows<'a> {
    scene: &'a Scene,
    caster: RayCaster,
    /// Whether the back of an element is the front of another: then that other is what a ray hits there.
    two_sided: Vec<bool>,
    count: usize,
    cast: AtomicUsize,
    escaped: AtomicUsize,
    absorbed: AtomicUsize,
}

impl<'a> RayRows<'a> {
    /// `count` rays from each element.
    pub fn new(scene: &'a Scene, count: usize) -> Self {
        let pieces: Vec<Vec<DVec3>> = scene.patches.iter().map(|p| p.corners.clone()).collect();
        Self {
            scene,
            caster: RayCaster::new(&pieces),
            two_sided: two_sided(scene),
            count: count.max(1),
            cast: AtomicUsize::new(0),
            escaped: AtomicUsize::new(0),
            absorbed: AtomicUsize::new(0),
        }
    }
}

/// Elements of faces that have elements on both sides.
fn two_sided(scene: &Scene) -> Vec<bool> {
    let first_of_face: std::collections::HashMap<u32, usize> =
        scene.faces.iter().enumerate().rev().map(|(i, &face)| (face, i)).collect();
    let turned = |i: usize| {
        let first = &scene.patches[first_of_face[&scene.faces[i]]];
        scene.patches[i].plane.normal.dot(first.plane.normal) < 0.0
    };
    let faces: HashSet<u32> = (0..scene.len()).filter(|&i| turned(i)).map(|i| scene.faces[i]).collect();
    scene.faces.iter().map(|face| faces.contains(face)).collect()
}

/// Whether some of `piece` lies in front of the plane of `patch`: only that can be hit.
fn reaches_in_front(piece: &Patch, patch: &Patch) -> bool {
    piece.heights_over(&patch.plane).1 > PLANARITY * patch.radius.max(piece.radius)
}

impl RowSource for RayRows<'_> {
    fn row(&self, i: usize) -> Row {
        let scene = self.scene;
        let (patch, count) = (&scene.patches[i], self.count);
        let (u, v) = patch.plane.axes();
        let map = AreaMap::new(&patch.corners);
        let mut random = Random::new(i as u64, ORIGINS);
        let mut origins = jittered(count, &mut random);
        random.shuffle(&mut origins);
        let directions = jittered(count, &mut random);

        // The element's own plane is met at distance 0, on either side by rounding.
        let in_sight: Vec<bool> = scene
            .patches
            .iter()
            .zip(&scene.faces)
            .map(|(piece, &face)| face != scene.faces[i] && reaches_in_front(piece, patch))
            .collect();
        let mut hits = vec![0u32; scene.len()];
        let (mut escaped, mut absorbed) = (0, 0);
        for (&origin, &direction) in origins.iter().zip(&directions) {
            let local = cosine_direction(direction);
            let direction = local.x * u + local.y * v + local.z * patch.plane.normal;
            let seen = |j: usize, front: bool| in_sight[j] && (front || !self.two_sided[j]);
            match self.caster.closest_where(map.place(origin), direction, seen) {
                Some(hit) if hit.front => hits[hit.piece] += 1,
                Some(_) => absorbed += 1,
                None => escaped += 1,
            }
        }
        self.cast.fetch_add(count, Ordering::Relaxed);
        self.escaped.fetch_add(escaped, Ordering::Relaxed);
        self.absorbed.fetch_add(absorbed, Ordering::Relaxed);

        let (mut row, total) = (Row::default(), count as f64);
        let variance = |&hits: &u32| f64::from(hits) * (1.0 - f64::from(hits) / total);
        let deviations: f64 = hits.iter().map(|hits| variance(hits).sqrt()).sum();
        let variances: f64 = hits.iter().map(variance).sum();
        let spread = if deviations > 0.0 { SPREAD * variances.sqrt() / deviations } else { 0.0 };
        for (j, hits) in hits.iter().enumerate().filter(|(_, hits)| **hits > 0) {
            let error = (MEAN_DEVIATION + spread) * variance(hits).sqrt() + RARE_HITS;
            row.push(j, f64::from(*hits) / total, error / total);
        }
        row
    }

    fn error_of_mean(&self, a: f64, b: f64) -> f64 {
        0.5 * a.hypot(b)
    }

    fn note(&self, report: &mut Report) {
        report.count("rays cast", self.cast.load(Ordering::Relaxed));
        report.count("rays that met nothing", self.escaped.load(Ordering::Relaxed));
        report.count("rays that met a back", self.absorbed.load(Ordering::Relaxed));
    }
}
