//! `--method auto`: every pair by the cheapest rule that keeps the tolerance, exact visible parts where something blocks.
//!
//! A row's tolerance is shared out in two halves: one to the pairs that see each other wholly, in proportion to their
//! factors, one to the partly occluded pairs, in proportion to their factors without blockers. How much those add up to
//! in each row is found first, by looking at all pairs without computing any.

use crate::cluster_rule::ClusterRule;
use crate::counts::Counts;
use crate::descent::descend;
use crate::estimator::{Estimator, TileBuilder};
use crate::filling::Filling;
use crate::point_views::PointViews;
use crate::poses::Poses;
use crate::reuse::Reuse;
use crate::scene::Scene;
use crate::sizes::occluded_sizes;
use crate::skips::{Skip, Skips};
use crate::tile::Tile;
use crate::traversal::LeafPair;
use geometry::area_rule::kernel_sum;
use geometry::contour::{Exchange, contour};
use geometry::far::FarPatches;
use geometry::pair::Scratch;
use geometry::patch::Patch;
use interchange::report::Report;

/// Share of a row's error given to unoccluded pairs: their factors add up to at most 1.
const UNOCCLUDED_SHARE: f64 = 0.3;
/// Unoccluded pairs are never asked less: they cost little, and in bright closed rooms what their rows miss of 1 counts
/// 1 / (1 - rho) times.
const UNOCCLUDED_LOOSEST: f64 = 2e-3;
/// Share of a row's error given to partly occluded pairs.
const OCCLUDED_SHARE: f64 = 0.7;
/// From this tolerance on single points may serve partly occluded pairs.
const POINTS_TOLERANCE: f64 = 3e-3;
/// Work of taking over a known entry, in units of computing one past nothing.
const COPIED: f64 = 0.05;
/// Below this tolerance poses are not rounded: 1e-12 of a factor is to be had.
const POSE_TOLERANCE: f64 = 1e-8;

/// Relative error of an unoccluded factor where rows are asked for `tolerance`.
pub fn unoccluded_error(tolerance: f64) -> f64 {
    (UNOCCLUDED_SHARE * tolerance).min(UNOCCLUDED_LOOSEST)
}

/// The exact method on a scene.
#[derive(Debug)]
pub struct Exact<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) skips: &'a Skips,
    /// Pairs that an older matrix knows.
    pub(crate) reuse: &'a Reuse<'a>,
    /// Error asked of each row.
    pub(crate) tolerance: f64,
    /// Relative error of an unoccluded factor.
    pub(crate) unoccluded: f64,
    /// Per row: error of a partly occluded factor, relative to the factor without blockers.
    pub(crate) occluded: Vec<f64>,
    pub(crate) far: Far,
    pub(crate) clusters: Option<ClusterRule>,
    /// Near pairs by their pose, where the tolerance leaves room for a pose's rounding.
    pub(crate) poses: Option<Poses>,
    /// Looks from single points, where the tolerance is loose enough for them.
    pub(crate) points: Option<PointViews<'a>>,
}

/// The patches as the rules for far pairs see them.
#[derive(Debug)]
pub(crate) struct Far {
    pub low: FarPatches,
    pub middle: FarPatches,
}

impl<'a> Exact<'a> {
    /// For rows within `tolerance`, of which entries of `reuse` have had their part.
    pub fn new(
        scene: &'a Scene,
        skips: &'a Skips,
        reuse: &'a Reuse<'a>,
        pairs: &[LeafPair],
        tolerance: f64,
    ) -> Self {
        let is_loose = tolerance >= POINTS_TOLERANCE && skips.has(Skip::PointViews);
        let points = is_loose.then(|| PointViews::new(scene, reuse));
        let sizes = occluded_sizes(scene, skips, reuse, pairs, is_loose);
        // What entries that are known may be off by is taken off the partly occluded pairs' share, not off the tolerance: they are
        // allowed more than their share, counting on most to take less, and fewer pairs are less of a crowd.
        let left = |i: usize| OCCLUDED_SHARE * tolerance - reuse.error(i);
        let occluded = sizes.iter().enumerate().map(|(i, size)| left(i) / size.max(tolerance)).collect();
        let unoccluded = unoccluded_error(tolerance);
        let far = Far { low: FarPatches::low(&scene.patches), middle: FarPatches::middle(&scene.patches) };
        let clusters = ClusterRule::new(scene, unoccluded);
        let poses =
            (tolerance >= POSE_TOLERANCE).then(|| Poses::new(unoccluded, skips.has(Skip::EqualPoses)));
        Self { scene, skips, reuse, tolerance, unoccluded, occluded, far, clusters, poses, points }
    }

    fn one_way(&self, pair: &LeafPair) -> Tile {
        let mut builder = TileBuilder::zeros(pair);
        let mut counts = Counts { reused: self.reuse.copy(pair, &mut builder), ..Counts::default() };
        let mut filling = Filling::new(self, pair, builder);
        descend(self.scene, self.skips, pair, &mut filling, &mut counts, &mut Scratch::default());
        *filling.builder.counts() = counts;
        filling.builder.finish()
    }

    /// Exchange factor of two patches wholly in front of each other, by the contour whatever their distance.
    pub(crate) fn contour(&self, p: &Patch, q: &Patch) -> Exchange {
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
        let known = self.reuse.known(pair.clusters[0], pair.clusters[1]);
        (pair.pairs() - known) as f64 * (1.0 + pair.blockers.len() as f64) + COPIED * known as f64
    }

    fn allow(&self, bytes: u64) {
        if let Some(clusters) = &self.clusters {
            clusters.allow(bytes as usize);
        }
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
