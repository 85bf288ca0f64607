//! `--method auto`: every pair by the cheapest rule that keeps the tolerance, exact visible parts where something blocks.
//!
//! A row's tolerance is shared out in two halves: one to the pairs that see each other wholly, in proportion to their
//! factors, one to the partly occluded pairs, in proportion to their factors without blockers. How much those add up to
//! in each row is found first, by looking at all pairs without computing any.

use crate::cluster_rule::ClusterRule;
use crate::counts::Counts;
use crate::descent::{Findings, descend};
use crate::estimator::{Estimator, TileBuilder};
use crate::poses::Poses;
use crate::scene::{Cluster, Scene};
use crate::skips::{Skip, Skips};
use crate::tile::Tile;
use crate::traversal::LeafPair;
use geometry::area_rule::{Separation, kernel_sum};
use geometry::contour::{Exchange, contour};
use geometry::far::FarPatches;
use geometry::occluded::Wanted;
use geometry::pair::{InFront, Scratch};
use geometry::patch::Patch;
use geometry::unoccluded::{Facing, Rule, exchange_in_front, facing, mutual_parts};
use glam::DVec3;
use interchange::report::Report;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Share of a row's error given to unoccluded pairs: their factors add up to at most 1.
const UNOCCLUDED_SHARE: f64 = 0.3;
/// Unoccluded pairs are never asked less: they cost little, and in bright closed rooms what their rows miss of 1 counts
/// 1 / (1 - rho) times.
const UNOCCLUDED_LOOSEST: f64 = 2e-3;
/// A single one of them may err by this many times more: the row counts.
const MOST_RELATIVE: f64 = 10.0;
/// Share of a row's error given to partly occluded pairs.
const OCCLUDED_SHARE: f64 = 0.7;
/// A partly occluded pair that may take more than this part of a row's error has to keep its own.
const DOMINANT_SHARE: f64 = 0.02;
/// So has one whose patches are this near (sizes over distance): what they see of each other is not smooth at a common edge.
const NEAR: f64 = 0.7;
/// All others may take this many times their share: most need less than a third of it.
const OF_MANY: f64 = 1.2;
/// Below this tolerance poses are not rounded: 1e-12 of a factor is to be had.
const POSE_TOLERANCE: f64 = 1e-8;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// The exact method on a scene.
#[derive(Debug)]
pub struct Exact<'a> {
    scene: &'a Scene,
    skips: &'a Skips,
    /// Error asked of each row.
    tolerance: f64,
    /// Relative error of an unoccluded factor.
    unoccluded: f64,
    /// Per row: error of a partly occluded factor, relative to the factor without blockers.
    occluded: Vec<f64>,
    far: Far,
    clusters: Option<ClusterRule>,
    /// Near pairs by their pose, where the tolerance leaves room for a pose's rounding.
    poses: Option<Poses>,
}

/// The patches as the rules for far pairs see them.
#[derive(Debug)]
struct Far {
    low: FarPatches,
    middle: FarPatches,
}

impl<'a> Exact<'a> {
    /// For rows within `tolerance`.
    pub fn new(scene: &'a Scene, skips: &'a Skips, pairs: &[LeafPair], tolerance: f64) -> Self {
        let sizes = occluded_sizes(scene, skips, pairs);
        let occluded = sizes.iter().map(|&size| OCCLUDED_SHARE * tolerance / size.max(tolerance)).collect();
        let unoccluded = (UNOCCLUDED_SHARE * tolerance).min(UNOCCLUDED_LOOSEST);
        let far = Far { low: FarPatches::low(&scene.patches), middle: FarPatches::middle(&scene.patches) };
        let clusters = ClusterRule::new(scene, unoccluded);
        let poses =
            (tolerance >= POSE_TOLERANCE).then(|| Poses::new(unoccluded, skips.has(Skip::EqualPoses)));
        Self { scene, skips, tolerance, unoccluded, occluded, far, clusters, poses }
    }

    fn one_way(&self, pair: &LeafPair) -> Tile {
        let builder = TileBuilder::zeros(pair);
        let mut filling = Filling {
            exact: self,
            pair,
            builder,
            pending: Vec::new(),
            too_near: Vec::new(),
            values: Vec::new(),
        };
        let mut counts = Counts::default();
        descend(self.scene, self.skips, pair, &mut filling, &mut counts, &mut Scratch::default());
        *filling.builder.counts() = counts;
        filling.builder.finish()
    }

    /// Exchange factor of two patches wholly in front of each other, by the contour whatever their distance.
    fn contour(&self, p: &Patch, q: &Patch) -> Exchange {
        let about = kernel_sum(&p.low, p.plane.normal, &q.low, q.plane.normal);
        contour(&p.corners, &q.corners, self.unoccluded * about)
    }
}

impl Estimator for Exact<'_> {
    fn tile(&self, pair: &LeafPair) -> Tile {
        let tile = self.one_way(pair);
        if self.skips.has(Skip::Reciprocity) || pair.is_diagonal() {
            return tile;
        }
        // S_ji computed too, and the mean kept: the same matrix, to rounding and the tolerance.
        let [a, b] = pair.clusters;
        let swapped = LeafPair {
            rows: pair.columns.clone(),
            columns: pair.rows.clone(),
            clusters: [b, a],
            blockers: pair.blockers.clone(),
        };
        mean(tile, &self.one_way(&swapped))
    }

    fn work(&self, pair: &LeafPair) -> f64 {
        pair.pairs() as f64 * (1.0 + pair.blockers.len() as f64)
    }

    fn note(&self, report: &mut Report) {
        let distinct = self.poses.as_ref().map_or(0, Poses::distinct);
        let spared = self.poses.as_ref().map_or(0, Poses::spared);
        report.count("different poses of near pairs", distinct);
        report.count("near pairs of a pose met before (skipped)", spared);
    }
}

/// The mean of a tile and its transpose computed apart.
fn mean(mut tile: Tile, transposed: &Tile) -> Tile {
    let (rows, columns) = (tile.row_errors.len(), tile.column_errors.len());
    for i in 0..rows {
        for j in 0..columns {
            let value = &mut tile.values[i * columns + j];
            *value = 0.5 * (*value + transposed.values[j * rows + i]);
        }
    }
    tile.counts.computed_twice += rows * columns;
    tile
}

/// Computes what the descent finds.
struct Filling<'e> {
    exact: &'e Exact<'e>,
    pair: &'e LeafPair,
    builder: TileBuilder,
    pending: Vec<u32>,
    too_near: Vec<u32>,
    values: Vec<f64>,
}

impl Filling<'_> {
    fn set(&mut self, i: usize, j: usize, found: Exchange) {
        let (row, column) = (i - self.pair.rows.start, j - self.pair.columns.start);
        // Far pairs whose points lie on each other's planes sum up to rounding of either sign.
        self.builder.set(row, column, found.value.max(0.0), found.error);
    }

    /// Clusters wholly in front of each other: together where they are far enough apart, else the parts of the larger one,
    /// down to single rows.
    fn in_front(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts) {
        let (rows, columns) = (first.range.clone(), second.range.clone());
        let scene = self.exact.scene;
        if let Some(rule) = &self.exact.clusters {
            let mut values = std::mem::take(&mut self.values);
            let found = rule.block(scene, (first, second), &mut values);
            if let Some(error) = found {
                self.set_block((rows.clone(), columns.clone()), &values, error, counts);
            }
            self.values = values;
            if found.is_some() {
                return;
            }
            let split = |cluster: &Cluster| cluster.children.map(|pair| pair.map(|c| &scene.clusters[c]));
            let larger = if first.radius >= second.radius { first } else { second };
            if let Some(parts) = split(larger).filter(|_| rule.is_worth_splitting(first, second)) {
                for part in parts {
                    let (p, q) = if first.radius >= second.radius { (part, second) } else { (first, part) };
                    self.in_front(p, q, counts);
                }
                return;
            }
        }
        rows.for_each(|i| self.row_in_front(i, columns.clone(), counts));
    }

    /// All pairs of two clusters, with one error per area of both patches; those to which it is too much are computed alone.
    fn set_block(
        &mut self,
        (rows, columns): (Range<usize>, Range<usize>),
        values: &[f64],
        error: f64,
        counts: &mut Counts,
    ) {
        let patches = &self.exact.scene.patches;
        for (i, values) in rows.zip(values.chunks_exact(columns.len())) {
            for (j, &value) in columns.clone().zip(values) {
                let error = error * patches[i].area * patches[j].area;
                if error <= MOST_RELATIVE * self.exact.unoccluded * value {
                    counts.by_clusters += 1;
                    self.set(i, j, Exchange { value, error });
                } else {
                    self.row_in_front(i, j..j + 1, counts);
                }
            }
        }
    }

    /// A row of pairs that see each other wholly: far ones together, those that are too near for a rule by the next one.
    fn row_in_front(&mut self, i: usize, columns: Range<usize>, counts: &mut Counts) {
        let relative = self.exact.unoccluded;
        let mut pending = std::mem::take(&mut self.pending);
        let mut too_near = std::mem::take(&mut self.too_near);
        pending.clear();
        pending.extend(columns.map(|j| j as u32));
        let far = &self.exact.far;
        for (patches, served) in [(&far.low, Rule::Low), (&far.middle, Rule::Middle)] {
            too_near.clear();
            patches.factors(i, &pending, relative, |at, value, error| {
                if error <= relative * value {
                    counts.add_unoccluded(served);
                    self.set(i, pending[at] as usize, Exchange { value, error });
                } else {
                    too_near.push(pending[at]);
                }
            });
            std::mem::swap(&mut pending, &mut too_near);
        }
        for &j in &pending {
            let (p, q) = (&self.exact.scene.patches[i], &self.exact.scene.patches[j as usize]);
            let found = self.exact.poses.as_ref().and_then(|poses| poses.exchange(p, q));
            let (found, rule) = found.unwrap_or_else(|| exchange_in_front(p, q, relative));
            counts.add_unoccluded(rule);
            self.set(i, j as usize, found);
        }
        (self.pending, self.too_near) = (pending, too_near);
    }
}

impl Findings for Filling<'_> {
    fn clear(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts) {
        if first.faces(second) && second.faces(first) && self.exact.skips.has(Skip::FarRules) {
            return self.in_front(first, second, counts);
        }
        let patches = &self.exact.scene.patches;
        for i in first.range.clone() {
            for j in second.range.clone() {
                match facing(&patches[i], &patches[j]) {
                    Facing::Away => counts.behind += 1,
                    Facing::Full if self.exact.skips.has(Skip::FarRules) => {
                        self.row_in_front(i, j..j + 1, counts)
                    }
                    Facing::Full => {
                        let exchange = self.exact.contour(&patches[i], &patches[j]);
                        counts.add_unoccluded(Rule::Contour);
                        self.set(i, j, exchange);
                    }
                    Facing::Cut => match mutual_parts(&patches[i], &patches[j]) {
                        None => counts.behind += 1,
                        Some((p, q)) => {
                            let (found, rule) = exchange_in_front(&p, &q, self.exact.unoccluded);
                            counts.add_unoccluded(rule);
                            self.set(i, j, found);
                        }
                    },
                }
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
        let allowed = &self.exact.occluded;
        let tolerance = allowed[i].min(allowed[j]) * unblocked;
        let (p, q) = pair.patches();
        let share = unblocked / p.area.min(q.area) * allowed[i].max(allowed[j]);
        let near = Separation::new(p, q).theta > NEAR;
        let alone = near || share > DOMINANT_SHARE * self.exact.tolerance;
        let tolerance = if alone { tolerance } else { OF_MANY * tolerance };
        let wanted = Wanted { tolerance, unblocked, alone, most_evaluations: MOST_EVALUATIONS };
        let (found, effort) = pair.occluded(which, wanted, scratch);
        counts.add_occluded(effort);
        self.set(i, j, found);
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
    fn clear(&mut self, _: &Cluster, _: &Cluster, _: &mut Counts) {}

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
    // With nothing between them too, where they are not taken for that.
    let looked_at = |pair: &&LeafPair| !pair.blockers.is_empty() || !skips.has(Skip::EmptyShaft);
    let blocked: Vec<&LeafPair> = pairs.iter().filter(looked_at).collect();
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
