//! The dual traversal of the cluster tree: pairs of clusters that cannot see each other are dropped whole, the list of
//! possible blockers is handed down and gets shorter with every narrower shaft.

use crate::scene::{Cluster, Scene};
use crate::skips::{Skip, Skips};
use geometry::occluder::separated;
use geometry::plane::{PLANARITY, Plane};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Two leaf clusters that may see each other: one rectangle of the matrix, on the diagonal where both are the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeafPair {
    /// Rows; not after the columns.
    pub rows: Range<usize>,
    /// Columns.
    pub columns: Range<usize>,
    /// Occluders that may stand between some row and some column, in order.
    pub blockers: Vec<u32>,
}

impl LeafPair {
    /// Whether it stands on the diagonal.
    pub fn is_diagonal(&self) -> bool {
        self.rows == self.columns
    }

    /// Number of pairs of elements in it.
    pub fn pairs(&self) -> usize {
        let n = self.rows.len();
        if self.is_diagonal() { n * (n + 1) / 2 } else { n * self.columns.len() }
    }
}

/// Pairs of elements that whole clusters settled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Settled {
    /// In one plane.
    pub same_plane: usize,
    /// One behind the other.
    pub behind: usize,
    /// Behind one convex blocker.
    pub covered: usize,
    /// Tests of an occluder against a shaft.
    pub shaft_tests: usize,
}

impl Settled {
    fn plus(self, other: Settled) -> Settled {
        Settled {
            same_plane: self.same_plane + other.same_plane,
            behind: self.behind + other.behind,
            covered: self.covered + other.covered,
            shaft_tests: self.shaft_tests + other.shaft_tests,
        }
    }
}

/// All leaf pairs that may see each other, by rows, then columns; and what was settled on the way.
pub fn leaf_pairs(scene: &Scene, skips: &Skips) -> (Vec<LeafPair>, Settled) {
    if scene.is_empty() {
        return (Vec::new(), Settled::default());
    }
    let all: Vec<u32> = (0..scene.occluders.len() as u32).collect();
    let walk = Walk { scene, skips };
    let (mut pairs, settled) = walk.visit(0, 0, &all);
    pairs.sort_by_key(|pair| (pair.rows.start, pair.columns.start));
    (pairs, settled)
}

struct Walk<'a> {
    scene: &'a Scene,
    skips: &'a Skips,
}

impl Walk<'_> {
    /// The leaf pairs under clusters `a` and `b` (a not after b), between which only `inherited` can block.
    fn visit(&self, a: usize, b: usize, inherited: &[u32]) -> (Vec<LeafPair>, Settled) {
        let (first, second) = (&self.scene.clusters[a], &self.scene.clusters[b]);
        let pairs = if a == b { first.len() * (first.len() + 1) / 2 } else { first.len() * second.len() };
        let mut settled = Settled::default();
        if self.skips.has(Skip::SamePlane) && in_one_plane(first, second) {
            settled.same_plane = pairs;
            return (Vec::new(), settled);
        }
        if a != b
            && self.skips.has(Skip::BehindClusters)
            && (is_behind(first, second) || is_behind(second, first))
        {
            settled.behind = pairs;
            return (Vec::new(), settled);
        }
        let mut blockers = inherited.to_vec();
        if a != b && !inherited.is_empty() {
            settled.shaft_tests = inherited.len();
            blockers = self.between(first, second, inherited);
            if self.skips.has(Skip::Covered)
                && blockers
                    .iter()
                    .any(|&k| self.scene.occluders[k as usize].covers(&first.hull, &second.hull))
            {
                settled.covered = pairs;
                return (Vec::new(), settled);
            }
        }
        let all: Vec<u32>;
        let handed_down = if self.skips.has(Skip::InheritedBlockers) {
            &blockers
        } else {
            all = (0..self.scene.occluders.len() as u32).collect();
            &all
        };
        let children: Vec<(usize, usize)> = match (first.children, second.children) {
            (None, None) => {
                let pair = LeafPair { rows: first.range.clone(), columns: second.range.clone(), blockers };
                return (vec![pair], settled);
            }
            (Some([c, d]), _) if a == b => vec![(c, c), (c, d), (d, d)],
            // The larger is split.
            (Some([c, d]), other) if other.is_none() || first.radius >= second.radius => vec![(c, b), (d, b)],
            (_, Some([c, d])) => vec![(a, c), (a, d)],
            (Some([c, d]), _) => vec![(c, b), (d, b)],
        };
        let parts: Vec<(Vec<LeafPair>, Settled)> =
            children.par_iter().map(|&(c, d)| self.visit(c, d, handed_down)).collect();
        let mut found = Vec::new();
        for (pairs, part) in parts {
            found.extend(pairs);
            settled = settled.plus(part);
        }
        (found, settled)
    }

    /// Those of `inherited` that may stand between some member of one and some member of the other.
    fn between(&self, first: &Cluster, second: &Cluster, inherited: &[u32]) -> Vec<u32> {
        let shaft: Vec<DVec3> = first.hull.iter().chain(&second.hull).copied().collect();
        let may_block = |&&k: &&u32| {
            first.sides.may_block(&second.sides, k as usize)
                && !separated(&shaft, &self.scene.occluders[k as usize].corners)
        };
        inherited.iter().filter(may_block).copied().collect()
    }
}

/// Whether all members of both lie in one plane and look the same way or away from each other.
fn in_one_plane(a: &Cluster, b: &Cluster) -> bool {
    let (Some(p), Some(q)) = (&a.plane, &b.plane) else { return false };
    let lies_in = |hull: &[DVec3], plane: &Plane, size: f64| {
        hull.iter().all(|&c| plane.distance(c).abs() <= PLANARITY * size)
    };
    let size = a.radius.max(b.radius);
    lies_in(&a.hull, q, size) && lies_in(&b.hull, p, size)
}

/// Whether all of `b` lies at or behind the plane of `a`.
fn is_behind(a: &Cluster, b: &Cluster) -> bool {
    let tolerance = PLANARITY * a.radius.max(b.radius);
    a.plane.is_some_and(|plane| b.hull.iter().all(|&c| plane.distance(c) <= tolerance))
}
