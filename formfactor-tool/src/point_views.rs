//! Partly occluded pairs at a loose tolerance: which share of one element a few points of the other see, from both sides.
//!
//! S_ij is its value without blockers, from the rules for unoccluded pairs, times the mean of two shares of visibility: what
//! i's points see of j, and what j's points see of i, each by exact visible parts ([`geometry::point_view`]). The two are
//! independent looks at one number, so half their difference is about the error of their mean. Single pairs may be luckier
//! than that; sums over the many pairs of a row are not ([`CAUTION`]). Pairs that carry much of a row, or whose patches are
//! near each other, are not many: they are left to the adaptive rule, and so are the worst ones of a tile while its rows
//! are above their share.

use crate::reuse::Reuse;
use crate::scene::{Cluster, Scene};
use geometry::body::Body;
use geometry::patch::{Patch, RulePoints};
use geometry::point_shadow::Bounds;
use geometry::point_view::{PointView, Sight};
use geometry::polygon;
use glam::DVec3;
use std::ops::Range;

/// Mean |error| of row sums over the sum of half the differences: 0.83 to 1.02 in a furnished room of 7167 elements, by one
/// and by three or four points (9 10^6 pairs); doubled, for rows that are less lucky than the mean.
pub const CAUTION: f64 = 2.0;

/// The two sides of a pair that is its own mirror image agree whatever they miss (rows of equal squares): of a share v, v (1 - v)
/// times this is never ruled out.
const PARTIAL: f64 = 0.25;

/// How many points of each element look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Points {
    /// Its centroid.
    One,
    /// Three on a triangle, four on a parallelogram.
    Few,
}

impl Points {
    fn of(self, patch: &Patch) -> &RulePoints {
        match self {
            Points::One => &patch.centre,
            Points::Few => &patch.low,
        }
    }
}

/// Boxes around the clusters of a scene.
#[derive(Debug)]
pub struct PointViews<'a> {
    scene: &'a Scene,
    reuse: &'a Reuse<'a>,
    boxes: Vec<Bounds>,
}

/// What each receiver sees of each source: sums over its points, weighted by about what the source would give unblocked.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    visible: f64,
    all: f64,
}

/// The shares of visibility of the pairs of two clusters, from the rows' side and from the columns'; row after row.
#[derive(Debug)]
pub struct Shares {
    from_rows: Vec<Seen>,
    from_columns: Vec<Seen>,
    /// Visible parts computed.
    pub looks: usize,
    rows: usize,
    columns: usize,
}

impl Shares {
    /// Mean share of a pair and half the difference of the two sides; `None` where no point of either side looks at the
    /// other element. Where one side alone looks, nothing is known of the difference: it counts as much as it may be.
    pub fn of(&self, row: usize, column: usize) -> Option<(f64, f64)> {
        let share = |seen: Seen| (seen.all > 0.0).then(|| seen.visible / seen.all);
        match (
            share(self.from_rows[row * self.columns + column]),
            share(self.from_columns[column * self.rows + row]),
        ) {
            (Some(a), Some(b)) => {
                let mean = 0.5 * (a + b);
                Some((mean, (0.5 * (a - b).abs()).max(PARTIAL * mean * (1.0 - mean))))
            }
            (Some(a), None) | (None, Some(a)) => Some((a, a.min(1.0 - a))),
            (None, None) => None,
        }
    }
}

impl<'a> PointViews<'a> {
    /// Prepares a scene.
    pub fn new(scene: &'a Scene, reuse: &'a Reuse<'a>) -> Self {
        Self { scene, reuse, boxes: scene.clusters.iter().map(bounds).collect() }
    }

    /// What the points of two clusters' elements see of each other past these bodies; of pairs that are known, maybe nothing.
    pub fn shares(
        &self,
        (first, second): (&Cluster, &Cluster),
        bodies: &[&Body],
        points: Points,
        view: &mut PointView,
    ) -> Shares {
        let mut looks = 0;
        let from_rows = self.seen(&first.range, second, bodies, points, view, &mut looks);
        let from_columns = self.seen(&second.range, first, bodies, points, view, &mut looks);
        Shares { from_rows, from_columns, looks, rows: first.len(), columns: second.len() }
    }

    fn seen(
        &self,
        receivers: &Range<usize>,
        sources: &Cluster,
        bodies: &[&Body],
        points: Points,
        view: &mut PointView,
        looks: &mut usize,
    ) -> Vec<Seen> {
        let count = sources.len();
        let mut seen = vec![Seen::default(); receivers.len() * count];
        for (receiver, seen) in receivers.clone().zip(seen.chunks_exact_mut(count)) {
            let patch = &self.scene.patches[receiver];
            let rule = points.of(patch);
            for k in 0..rule.weight.len() {
                let point = DVec3::new(rule.x[k], rule.y[k], rule.z[k]);
                let list =
                    view.look(point, patch.plane.normal, &self.boxes[sources.number], bodies.iter().copied());
                let mut walk = Walk {
                    scene: self.scene,
                    reuse: self.reuse,
                    receiver,
                    boxes: &self.boxes,
                    first: sources.range.start,
                    point,
                    normal: patch.plane.normal,
                    weight: rule.weight[k],
                    view: &mut *view,
                    seen: &mut *seen,
                    looks: 0,
                };
                walk.visit(sources.number, list);
                *looks += walk.looks;
            }
        }
        seen
    }
}

/// One point on its way through a cluster.
struct Walk<'w> {
    scene: &'w Scene,
    reuse: &'w Reuse<'w>,
    /// Element of the point.
    receiver: usize,
    boxes: &'w [Bounds],
    /// Number of the first source.
    first: usize,
    point: DVec3,
    normal: DVec3,
    weight: f64,
    view: &'w mut PointView,
    seen: &'w mut [Seen],
    looks: usize,
}

impl Walk<'_> {
    fn visit(&mut self, number: usize, list: Range<usize>) {
        let cluster = &self.scene.clusters[number];
        if self.reuse.has_all(self.receiver, cluster) {
            return;
        }
        if cluster.plane.is_some_and(|plane| plane.distance(self.point) <= 0.0) {
            return;
        }
        let space = &self.boxes[number];
        let (_, high) = Bounds { centre: space.centre - self.point, ..*space }.along(self.normal);
        if high <= 0.0 {
            return;
        }
        let across = match self.view.narrow(list, space) {
            Sight::Clear => return self.add_all(cluster, 1.0),
            Sight::Hidden => return self.add_all(cluster, 0.0),
            Sight::Across(across) => across,
        };
        if let Some(children) = cluster.children {
            children.into_iter().for_each(|child| self.visit(child, across.clone()));
        } else {
            self.looks += 1;
            let corners = &self.scene.patches[cluster.range.start].corners;
            if let Some(share) = self.view.share(corners, across.clone()) {
                self.add(cluster.range.start, share);
            }
        }
        self.view.forget(&across);
    }

    fn add_all(&mut self, cluster: &Cluster, share: f64) {
        cluster.range.clone().for_each(|source| self.add(source, share));
    }

    /// Adds what is seen of a source, weighted by its kernel: cosines over the squared distance of its centroid.
    fn add(&mut self, source: usize, share: f64) {
        let patch = &self.scene.patches[source];
        let between = patch.centroid - self.point;
        let (height, depth) = (self.normal.dot(between), -patch.plane.normal.dot(between));
        if height <= 0.0 || depth <= 0.0 {
            return;
        }
        let squared = between.length_squared();
        let all = self.weight * height * depth / (squared * squared);
        let seen = &mut self.seen[source - self.first];
        seen.visible += share * all;
        seen.all += all;
    }
}

/// A box around a cluster, in space.
fn bounds(cluster: &Cluster) -> Bounds {
    let hull = &cluster.hull;
    let is_box = cluster.len() > 1 && cluster.plane.is_none();
    let axes = match (is_box, polygon::parallelogram(hull)) {
        (true, _) => Some([1, 2, 4].map(|k| 0.5 * (hull[k] - hull[0]))),
        (false, Some((_, u, v))) => Some([0.5 * u, 0.5 * v, DVec3::ZERO]),
        (false, None) => None,
    };
    if let Some(axes) = axes {
        let centre = hull.iter().sum::<DVec3>() / hull.len() as f64;
        return Bounds { centre, axes, radius: cluster.radius };
    }
    let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = hull.iter().fold(ends, |(low, high), &c| (low.min(c), high.max(c)));
    let half = 0.5 * (high - low);
    let axes = [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z];
    Bounds { centre: 0.5 * (low + high), axes, radius: half.length() }
}
