//! The dual traversal of the cluster tree: pairs of clusters that cannot see each other are dropped whole, the list of
//! possible blockers is handed down and gets shorter with every narrower shaft.

use crate::scene::{Cluster, Scene};
use crate::skips::{Skip, Skips};
use geometry::occluder::separated;
use geometry::shadow::{Blocking, Shadows};
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
    /// The two clusters.
    pub clusters: [usize; 2],
    /// Bodies that may stand between some row and some column, in order.
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
    /// Tests of a body against a shaft.
    pub shaft_tests: usize,
    /// Tests left out because the body is outside a wider shaft.
    pub shaft_tests_spared: usize,
}

impl Settled {
    fn plus(self, other: Settled) -> Settled {
        Settled {
            same_plane: self.same_plane + other.same_plane,
            behind: self.behind + other.behind,
            covered: self.covered + other.covered,
            shaft_tests: self.shaft_tests + other.shaft_tests,
            shaft_tests_spared: self.shaft_tests_spared + other.shaft_tests_spared,
        }
    }
}

/// All leaf pairs that may see each other, by rows, then columns; and what was settled on the way.
pub fn leaf_pairs(scene: &Scene, skips: &Skips) -> (Vec<LeafPair>, Settled) {
    if scene.is_empty() {
        return (Vec::new(), Settled::default());
    }
    let all: Vec<u32> = (0..scene.bodies.len() as u32).collect();
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
        if self.skips.has(Skip::SamePlane) && first.shares_plane(second) {
            settled.same_plane = pairs;
            return (Vec::new(), settled);
        }
        if a != b
            && self.skips.has(Skip::BehindClusters)
            && (first.turns_away_from(second) || second.turns_away_from(first))
        {
            settled.behind = pairs;
            return (Vec::new(), settled);
        }
        let mut blockers = inherited.to_vec();
        if a != b {
            settled.shaft_tests_spared = self.scene.bodies.len() - inherited.len();
        }
        if a != b && !inherited.is_empty() {
            settled.shaft_tests = inherited.len();
            match self.between(first, second, inherited) {
                Some(between) => blockers = between,
                None => {
                    settled.covered = pairs;
                    return (Vec::new(), settled);
                }
            }
        }
        let all: Vec<u32>;
        let handed_down = if self.skips.has(Skip::InheritedBlockers) {
            &blockers
        } else {
            all = (0..self.scene.bodies.len() as u32).collect();
            &all
        };
        let inner = |cluster: &Cluster| cluster.children.filter(|_| !cluster.is_block);
        let children: Vec<(usize, usize)> = match (inner(first), inner(second)) {
            (None, None) => {
                let pair = LeafPair {
                    rows: first.range.clone(),
                    columns: second.range.clone(),
                    clusters: [a, b],
                    blockers,
                };
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

    /// Those of `inherited` that may stand between some member of one and some member of the other; `None` where one of
    /// them covers all.
    fn between(&self, first: &Cluster, second: &Cluster, inherited: &[u32]) -> Option<Vec<u32>> {
        let shaft: Vec<DVec3> = first.hull.iter().chain(&second.hull).copied().collect();
        let mut shadows = Shadows::default();
        let mut blockers = Vec::new();
        for &k in inherited {
            let body = &self.scene.bodies[k as usize];
            if first.turns_away_from_body(body) || second.turns_away_from_body(body) {
                continue;
            }
            shadows.clear();
            match shadows.add(body, first.set(), second.set()) {
                Blocking::Nothing => {}
                Blocking::Everything if self.skips.has(Skip::Covered) => return None,
                Blocking::Everything => blockers.push(k),
                _ if separated(&shaft, &body.corners) => {}
                _ => blockers.push(k),
            }
        }
        Some(blockers)
    }
}
