//! The descent inside a leaf pair: smaller and smaller sets of elements are looked at together until nothing stands between
//! them, or one body covers all, or single elements are left with the shadows between them.

use crate::counts::Counts;
use crate::scene::{Cluster, Scene};
use crate::skips::{Skip, Skips};
use crate::traversal::LeafPair;
use geometry::body::Body;
use geometry::occluder::separated;
use geometry::pair::{InFront, Scratch, View, look, narrow_all};
use geometry::shadow::Blocking;
use glam::DVec3;
use std::ops::Range;

/// What the descent finds. Pairs it does not mention are zero.
pub trait Findings {
    /// How many of the pairs of two clusters are known already. Where all are, nothing is looked at.
    fn known(&self, _first: &Cluster, _second: &Cluster) -> usize {
        0
    }

    /// Nothing stands between any of the rows and any of the columns; they need not see each other's front.
    fn clear(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts);

    /// Some of the `bodies` stand between two clusters. `true` where nothing more needs to be known of them.
    fn undecided<'a>(
        &mut self,
        _clusters: (&'a Cluster, &'a Cluster),
        _bodies: impl Fn() -> Vec<&'a Body>,
        _counts: &mut Counts,
        _scratch: &mut Scratch<'a>,
    ) -> bool {
        false
    }

    /// Elements i and j see each other past the shadows `which`.
    fn partial(
        &mut self,
        elements: (usize, usize),
        pair: &InFront<'_>,
        which: Range<usize>,
        counts: &mut Counts,
        scratch: &mut Scratch<'_>,
    );
}

/// Looks at all pairs of a leaf pair.
pub fn descend<'a>(
    scene: &'a Scene,
    skips: &Skips,
    pair: &LeafPair,
    findings: &mut impl Findings,
    counts: &mut Counts,
    scratch: &mut Scratch<'a>,
) {
    scratch.shadows.clear();
    scratch.shadows.keep_covering(!skips.has(Skip::Covered));
    let [a, b] = pair.clusters;
    if findings.known(&scene.clusters[a], &scene.clusters[b]) == pair.pairs() {
        return;
    }
    // The traversal has just found what may stand between the two: where the findings need no more, that is not asked again.
    if a != b && !pair.blockers.is_empty() {
        let bodies = || pair.blockers.iter().map(|&k| &scene.bodies[k as usize]).collect();
        if findings.undecided((&scene.clusters[a], &scene.clusters[b]), bodies, counts, scratch) {
            return;
        }
    }
    let mut descent = Descent { scene, skips, findings, counts };
    descent.visit(a, b, 0..0, &pair.blockers, scratch);
}

struct Descent<'a, 'f, F> {
    scene: &'a Scene,
    skips: &'f Skips,
    findings: &'f mut F,
    counts: &'f mut Counts,
}

impl<'a, F: Findings> Descent<'a, '_, F> {
    /// Looks at clusters `a` and `b`, between which stand the shadows `which` and perhaps the bodies `pending`.
    fn visit(&mut self, a: usize, b: usize, which: Range<usize>, pending: &[u32], scratch: &mut Scratch<'a>) {
        let (first, second) = (&self.scene.clusters[a], &self.scene.clusters[b]);
        let all = if a == b { first.len() * (first.len() + 1) / 2 } else { first.len() * second.len() };
        let pairs = all - self.findings.known(first, second);
        if pairs == 0 {
            return;
        }
        if self.skips.has(Skip::SamePlane) && first.shares_plane(second) {
            self.counts.same_plane += pairs;
            return;
        }
        if a == b {
            if let Some([c, d]) = first.children {
                [(c, c), (c, d), (d, d)]
                    .into_iter()
                    .for_each(|(c, d)| self.visit(c, d, which.clone(), pending, scratch));
            }
            return;
        }
        if self.skips.has(Skip::Behind) && (first.turns_away_from(second) || second.turns_away_from(first)) {
            self.counts.behind += pairs;
            return;
        }
        let start = scratch.shadows.len();
        let mut still_pending = Vec::new();
        if self.is_covered(first, second, which, pending, &mut still_pending, scratch) {
            self.counts.covered += pairs;
        } else {
            let now = start..scratch.shadows.len();
            if now.is_empty() && still_pending.is_empty() && self.skips.has(Skip::EmptyShaft) {
                self.counts.empty_shaft += pairs;
                self.findings.clear(first, second, self.counts);
            } else if self.is_settled(first, second, &now, &still_pending, scratch) {
                // Looked at closely enough.
            } else if let Some(children) = children(first, second, a, b) {
                for (c, d) in children {
                    self.visit(c, d, now.clone(), &still_pending, scratch);
                }
            } else {
                self.single(first, second, now, scratch);
            }
        }
        scratch.shadows.truncate(start);
    }

    /// Whether the findings need no closer look at two clusters.
    fn is_settled(
        &mut self,
        first: &'a Cluster,
        second: &'a Cluster,
        which: &Range<usize>,
        pending: &[u32],
        scratch: &mut Scratch<'a>,
    ) -> bool {
        let cast: Vec<&'a Body> = which.clone().map(|at| scratch.shadows.body(at)).collect();
        let bodies = || {
            let inside = pending.iter().map(|&k| &self.scene.bodies[k as usize]);
            cast.iter().copied().chain(inside).collect()
        };
        self.findings.undecided((first, second), bodies, self.counts, scratch)
    }

    /// Puts what stands between two clusters on the stack; `true` where one body covers all. Bodies whose inside reaches
    /// into a cluster stay pending for its parts.
    fn is_covered(
        &self,
        first: &Cluster,
        second: &Cluster,
        which: Range<usize>,
        pending: &[u32],
        still_pending: &mut Vec<u32>,
        scratch: &mut Scratch<'a>,
    ) -> bool {
        if narrow_all(which, first.set(), second.set(), &mut scratch.shadows) == View::Covered {
            return true;
        }
        if pending.is_empty() {
            return false;
        }
        let shaft: Vec<DVec3> = first.hull.iter().chain(&second.hull).copied().collect();
        let single = first.len() == 1 && second.len() == 1;
        for &k in pending {
            let body = &self.scene.bodies[k as usize];
            if first.turns_away_from_body(body) || second.turns_away_from_body(body) {
                continue;
            }
            let before = scratch.shadows.len();
            let blocking = if single {
                look(body, first.set(), second.set(), &mut scratch.shadows)
            } else {
                scratch.shadows.add(body, first.set(), second.set())
            };
            match blocking {
                Blocking::Nothing => {}
                Blocking::Everything => return true,
                _ if separated(&shaft, &body.corners) => scratch.shadows.truncate(before),
                Blocking::Part => {}
                Blocking::Inside => still_pending.push(k),
            }
        }
        false
    }

    fn single(&mut self, first: &Cluster, second: &Cluster, which: Range<usize>, scratch: &mut Scratch<'a>) {
        let (i, j) = (first.range.start, second.range.start);
        let Some(pair) = InFront::new(&self.scene.patches[i], &self.scene.patches[j]) else {
            self.counts.behind += 1;
            return;
        };
        let start = scratch.shadows.len();
        let mut now = which;
        if let InFront::Cut(_) = pair {
            match pair.view(now, &mut scratch.shadows) {
                View::Covered => {
                    self.counts.covered += 1;
                    return;
                }
                View::Clear if self.skips.has(Skip::EmptyShaft) => {
                    self.counts.empty_shaft += 1;
                    return self.findings.clear(first, second, self.counts);
                }
                View::Clear => now = 0..0,
                View::Partial => now = start..scratch.shadows.len(),
            }
        }
        self.findings.partial((i, j), &pair, now, self.counts, scratch);
        scratch.shadows.truncate(start);
    }
}

/// The pairs that a pair of clusters falls into when the larger one is split; none for single elements.
fn children(first: &Cluster, second: &Cluster, a: usize, b: usize) -> Option<[(usize, usize); 2]> {
    match (first.children, second.children) {
        (None, None) => None,
        (Some([c, d]), other) if other.is_none() || first.radius >= second.radius => Some([(c, b), (d, b)]),
        (_, Some([c, d])) => Some([(a, c), (a, d)]),
        (Some([c, d]), None) => Some([(c, b), (d, b)]),
    }
}
