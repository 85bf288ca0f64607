//! `--method auto`: every pair by the cheapest rule that keeps the tolerance, exact visible parts where something blocks.
//!
//! A row's tolerance is shared out in two halves: one to the pairs that see each other wholly, in proportion to their
//! factors, one to the partly occluded pairs, in proportion to their factors without blockers. How much those add up to
//! in each row is found first, by looking at all pairs without computing any.

use crate::counts::Counts;
use crate::descent::{Findings, descend};
use crate::estimator::{Estimator, TileBuilder};
use crate::scene::{Cluster, Scene};
use crate::skips::Skips;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use geometry::occluded::Wanted;
use geometry::pair::{InFront, Scratch};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Share of a row's error given to unoccluded pairs: their factors add up to at most 1.
const UNOCCLUDED_SHARE: f64 = 0.3;
/// Unoccluded pairs are never asked less: they cost little, and in bright closed rooms what their rows miss of 1 counts
/// 1 / (1 - rho) times.
const UNOCCLUDED_LOOSEST: f64 = 2e-3;
/// Share of a row's error given to partly occluded pairs.
const OCCLUDED_SHARE: f64 = 1.5;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// The exact method on a scene.
#[derive(Debug)]
pub struct Exact<'a> {
    scene: &'a Scene,
    skips: &'a Skips,
    /// Relative error of an unoccluded factor.
    unoccluded: f64,
    /// Per row: error of a partly occluded factor, relative to the factor without blockers.
    occluded: Vec<f64>,
}

impl<'a> Exact<'a> {
    /// For rows within `tolerance`.
    pub fn new(scene: &'a Scene, skips: &'a Skips, pairs: &[LeafPair], tolerance: f64) -> Self {
        let sizes = occluded_sizes(scene, skips, pairs);
        let occluded = sizes.iter().map(|&size| OCCLUDED_SHARE * tolerance / size.max(tolerance)).collect();
        let unoccluded = (UNOCCLUDED_SHARE * tolerance).min(UNOCCLUDED_LOOSEST);
        Self { scene, skips, unoccluded, occluded }
    }
}

impl Estimator for Exact<'_> {
    fn tile(&self, pair: &LeafPair) -> Tile {
        let mut filling = Filling { exact: self, pair, builder: TileBuilder::zeros(pair) };
        let mut counts = Counts::default();
        descend(self.scene, self.skips, pair, &mut filling, &mut counts, &mut Scratch::default());
        *filling.builder.counts() = counts;
        filling.builder.finish()
    }

    fn work(&self, pair: &LeafPair) -> f64 {
        pair.pairs() as f64 * (1.0 + pair.blockers.len() as f64)
    }
}

/// Computes what the descent finds.
struct Filling<'e> {
    exact: &'e Exact<'e>,
    pair: &'e LeafPair,
    builder: TileBuilder,
}

impl Findings for Filling<'_> {
    fn clear(&mut self, rows: Range<usize>, columns: Range<usize>, counts: &mut Counts) {
        let patches = &self.exact.scene.patches;
        for i in rows {
            for j in columns.clone() {
                let Some(pair) = InFront::new(&patches[i], &patches[j]) else {
                    counts.behind += 1;
                    continue;
                };
                let (found, rule) = pair.unoccluded(self.exact.unoccluded);
                counts.add_unoccluded(rule);
                let (row, column) = (i - self.pair.rows.start, j - self.pair.columns.start);
                self.builder.set(row, column, found.value, found.error);
            }
        }
    }

    fn partial(
        &mut self,
        (i, j): (usize, usize),
        pair: &InFront<'_>,
        which: Range<usize>,
        counts: &mut Counts,
        scratch: &mut Scratch<'_>,
    ) {
        let unblocked = pair.unblocked_size();
        let tolerance = self.exact.occluded[i].min(self.exact.occluded[j]) * unblocked;
        let wanted = Wanted { tolerance, unblocked, most_evaluations: MOST_EVALUATIONS };
        let (found, effort) = pair.occluded(which, wanted, scratch);
        counts.add_occluded(effort);
        let (row, column) = (i - self.pair.rows.start, j - self.pair.columns.start);
        self.builder.set(row, column, found.value, found.error);
    }
}

/// Sets of elements of at most this many pairs are taken for partly occluded together when tolerances are shared out:
/// some of their pairs are not, so the others get a little less than they could.
const LOOKED_AT_TOGETHER: usize = 16;

/// Adds up what stands behind blockers in part.
struct Sizes<'e> {
    scene: &'e Scene,
    pair: &'e LeafPair,
    of_rows: Vec<f64>,
    of_columns: Vec<f64>,
}

impl Findings for Sizes<'_> {
    fn clear(&mut self, _: Range<usize>, _: Range<usize>, _: &mut Counts) {}

    fn undecided(&mut self, first: &Cluster, second: &Cluster) -> bool {
        let (Some(p), Some(q)) = (first.plane, second.plane) else { return false };
        if first.len() * second.len() > LOOKED_AT_TOGETHER {
            return false;
        }
        let middle = |c: &Cluster| c.hull.iter().sum::<DVec3>() / c.hull.len() as f64;
        let between = middle(second) - middle(first);
        let distance = between.length();
        // Beside each other the middles say little: single pairs are looked at.
        if distance < first.radius + second.radius {
            return false;
        }
        let tilt = (first.radius + second.radius) / distance;
        let cosine = |height: f64| (height / distance).clamp(0.25 * tilt, 1.0);
        let kernel =
            cosine(p.normal.dot(between)) * cosine(-q.normal.dot(between)) / (PI * distance * distance);
        let area = |c: &Cluster| self.scene.patches[c.range.clone()].iter().map(|p| p.area).sum::<f64>();
        let (area_p, area_q) = (area(first), area(second));
        for i in first.range.clone() {
            self.of_rows[i - self.pair.rows.start] += self.scene.patches[i].area * area_q * kernel;
        }
        for j in second.range.clone() {
            self.of_columns[j - self.pair.columns.start] += self.scene.patches[j].area * area_p * kernel;
        }
        true
    }

    fn partial(
        &mut self,
        (i, j): (usize, usize),
        pair: &InFront<'_>,
        _: Range<usize>,
        _: &mut Counts,
        _: &mut Scratch<'_>,
    ) {
        let size = pair.unblocked_size();
        self.of_rows[i - self.pair.rows.start] += size;
        self.of_columns[j - self.pair.columns.start] += size;
    }
}

/// Per row the sum over its partly occluded pairs of the factors without blockers.
fn occluded_sizes(scene: &Scene, skips: &Skips, pairs: &[LeafPair]) -> Vec<f64> {
    let blocked: Vec<&LeafPair> = pairs.iter().filter(|pair| !pair.blockers.is_empty()).collect();
    let parts: Vec<Sizes<'_>> = blocked
        .par_iter()
        .map_init(Scratch::default, |scratch, pair| {
            let (of_rows, of_columns) = (vec![0.0; pair.rows.len()], vec![0.0; pair.columns.len()]);
            let mut sizes = Sizes { scene, pair, of_rows, of_columns };
            descend(scene, skips, pair, &mut sizes, &mut Counts::default(), scratch);
            sizes
        })
        .collect();
    let mut sums = vec![0.0; scene.len()];
    for part in &parts {
        part.pair.rows.clone().zip(&part.of_rows).for_each(|(i, size)| sums[i] += size);
        part.pair.columns.clone().zip(&part.of_columns).for_each(|(j, size)| sums[j] += size);
    }
    sums.iter().zip(&scene.patches).map(|(sum, patch)| sum / patch.area).collect()
}
