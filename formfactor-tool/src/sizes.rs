//! How much of each row stands behind blockers in part, found by looking at all pairs without computing any: the shares of the
//! tolerance follow from it.

use crate::counts::Counts;
use crate::descent::{Findings, descend};
use crate::reuse::Reuse;
use crate::scene::{Cluster, Scene};
use crate::skips::{Skip, Skips};
use crate::traversal::LeafPair;
use geometry::area_rule::Separation;
use geometry::body::Body;
use geometry::pair::{InFront, Scratch};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Sets of elements of at most this many pairs are taken for partly occluded together when tolerances are shared out:
/// some of their pairs are not, so the others get a little less than they could.
const LOOKED_AT_TOGETHER: usize = 16;

/// Adds up what stands behind blockers in part.
struct Sizes<'e> {
    scene: &'e Scene,
    reuse: &'e Reuse<'e>,
    pair: &'e LeafPair,
    of_rows: Vec<f64>,
    of_columns: Vec<f64>,
}

impl Sizes<'_> {
    /// Adds all pairs, each by the kernel between its centroids.
    fn add_all(&mut self) {
        for (i, of_row) in self.pair.rows.clone().zip(&mut self.of_rows) {
            for (j, of_column) in self.pair.columns.clone().zip(&mut self.of_columns) {
                if self.reuse.has(i, j) {
                    continue;
                }
                let (p, q) = (&self.scene.patches[i], &self.scene.patches[j]);
                let most = p.area.min(q.area);
                let size = Separation::new(p, q).value.min(most);
                *of_row += size;
                *of_column += size;
            }
        }
    }
}

impl Findings for Sizes<'_> {
    fn known(&self, first: &Cluster, second: &Cluster) -> usize {
        self.reuse.known(first.number, second.number)
    }

    fn clear(&mut self, _: &Cluster, _: &Cluster, _: &mut Counts) {}

    fn undecided<'a>(
        &mut self,
        (first, second): (&'a Cluster, &'a Cluster),
        _: impl Fn() -> Vec<&'a Body>,
        _: &mut Counts,
        _: &mut Scratch<'a>,
    ) -> bool {
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
        let area = |k: usize| self.scene.patches[k].area;
        // What an element looks at of a cluster: all but what is known.
        let areas = |c: &Cluster, k: usize| {
            c.range.clone().filter(|&other| !self.reuse.has(k, other)).map(area).sum::<f64>()
        };
        for i in first.range.clone() {
            self.of_rows[i - self.pair.rows.start] += area(i) * areas(second, i) * kernel;
        }
        for j in second.range.clone() {
            self.of_columns[j - self.pair.columns.start] += area(j) * areas(first, j) * kernel;
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

/// Per row the sum over its partly occluded pairs, but for those that are known, of the factors without blockers.
/// Where the tolerance is
/// loose it may be too much: all pairs of two clusters count that something may stand between.
pub(crate) fn occluded_sizes(
    scene: &Scene,
    skips: &Skips,
    reuse: &Reuse<'_>,
    pairs: &[LeafPair],
    is_loose: bool,
) -> Vec<f64> {
    // With nothing between them too, where they are not taken for that.
    let looked_at = |pair: &&LeafPair| !pair.blockers.is_empty() || !skips.has(Skip::EmptyShaft);
    let blocked: Vec<&LeafPair> = pairs.iter().filter(looked_at).collect();
    let parts: Vec<Sizes<'_>> = blocked
        .par_iter()
        .map_init(Scratch::default, |scratch, pair| {
            let (of_rows, of_columns) = (vec![0.0; pair.rows.len()], vec![0.0; pair.columns.len()]);
            let mut sizes = Sizes { scene, reuse, pair, of_rows, of_columns };
            if is_loose && !pair.is_diagonal() {
                sizes.add_all();
                return sizes;
            }
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
