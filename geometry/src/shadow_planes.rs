//! Planes in which a receiver's view of a source changes its kind: through a source corner and a blocker edge, a blocker
//! corner and a source edge, or a corner and an edge of two blockers (VE and EV events: Heckbert 92; Lischinski, Tampieri &
//! Greenberg 92).
//!
//! Between these planes the visible part of the source depends smoothly on the receiver point, so quadrature on cells
//! that do not cross them converges fast. Events of three skew edges (EEE) of different blockers are left to adaptivity.

use crate::polygon;
use crate::shadow::{From, Shadows};
use glam::DVec3;
use std::ops::Range;

/// A plane that leaves less than this part of a polygon's size on one side is not worth a cut.
pub const WORTHLESS_CUT: f64 = 1e-9;

/// A plane g(x) = normal . (x - apex) = 0 with the triangle that makes it.
#[derive(Debug, Clone, Copy)]
pub struct ShadowPlane {
    apex: DVec3,
    from: DVec3,
    to: DVec3,
    normal: DVec3,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Source corner, blocker edge: the edge must lie between the corner and the receiver.
    SourceCorner,
    /// Blocker corner, source edge: the corner must lie between the edge and the receiver.
    BlockerCorner,
    /// Corner of one blocker, edge of another: they must line up before the source.
    Blockers,
    /// The blocker's own plane, where its two sides change roles.
    Always,
}

/// Among more shadows than these the planes of two blockers are too many to be worth their time.
const MOST_TOGETHER: usize = 4;
/// Two planes through one point are one where their normals differ by at most this.
const SAME_DIRECTION: f64 = 1e-9;
/// Among more planes than these those of two blockers cut into too many cells for what they bend.
const MOST_PLANES: usize = 16;
/// The shadow planes of a source and the shadows `which` that cut `receiver` visibly.
pub fn shadow_planes(
    receiver: &[DVec3],
    source: &[DVec3],
    shadows: &Shadows<'_>,
    which: Range<usize>,
    from: From,
    planes: &mut Vec<ShadowPlane>,
) {
    planes.clear();
    let tolerance = WORTHLESS_CUT * polygon::diameter(receiver);
    let push = |planes: &mut Vec<ShadowPlane>, apex: DVec3, from: DVec3, to: DVec3, kind: Kind| {
        let normal = (from - apex).cross(to - apex);
        // Most planes pass the receiver by: that needs no unit normal.
        let is_above = |p: &DVec3| normal.dot(*p - apex) > 0.0;
        let count = receiver.iter().filter(|p| is_above(p)).count();
        if count == 0 || count == receiver.len() {
            return;
        }
        let plane = ShadowPlane { apex, from, to, normal: normal.normalize_or_zero(), kind };
        if plane.normal == DVec3::ZERO || plane.cut_balance(receiver, tolerance).is_none() {
            return;
        }
        if kind == Kind::Blockers {
            let is_known = |known: &ShadowPlane| {
                let turn = known.normal.cross(plane.normal).length_squared();
                turn < SAME_DIRECTION * SAME_DIRECTION && known.height(apex).abs() <= tolerance
            };
            if plane.lines_up_beside(receiver, source) || planes.iter().any(is_known) {
                return;
            }
        }
        planes.push(plane);
    };
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut ends = Vec::new();
    for at in which.clone() {
        let first = vertices.len();
        shadows.for_each_edge(at, from, |edge| {
            source.iter().for_each(|&corner| push(planes, corner, edge.from, edge.to, Kind::SourceCorner));
            for end in [edge.from, edge.to] {
                if !vertices[first..].contains(&end) {
                    vertices.push(end);
                    polygon::edges(source).for_each(|(a, b)| push(planes, end, a, b, Kind::BlockerCorner));
                }
            }
        });
        ends.push(vertices.len());
        shadows.for_each_crossed_face(at, from, |face| {
            let (x, y) = face.axes();
            push(planes, face.origin, face.origin + x, face.origin + y, Kind::Always);
        });
    }
    let of_source = planes.len();
    if ends.len() > MOST_TOGETHER || of_source > MOST_PLANES {
        return;
    }
    for (k, at) in which.enumerate() {
        let own = if k == 0 { 0 } else { ends[k - 1] }..ends[k];
        shadows.for_each_edge(at, from, |edge| {
            let others = vertices.iter().enumerate().filter(|(place, _)| !own.contains(place));
            others.for_each(|(_, &corner)| push(planes, corner, edge.from, edge.to, Kind::Blockers));
        });
    }
    if planes.len() > MOST_PLANES {
        planes.truncate(of_source);
    }
}

impl ShadowPlane {
    /// Signed distance from the plane.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.apex)
    }

    /// The shares in which the plane cuts the polygon's corners' heights (the smaller one, 0 to 1/2), where it cuts it
    /// by more than `tolerance` (a length) on both sides and the event can be seen from the cut; `None` elsewhere.
    pub fn cut_balance(&self, cell: &[DVec3], tolerance: f64) -> Option<f64> {
        let (low, high) =
            cell.iter().map(|&c| self.height(c)).fold((0.0f64, 0.0f64), |(l, h), x| (l.min(x), h.max(x)));
        if -low <= tolerance || high <= tolerance {
            return None;
        }
        self.is_seen_from_cut(cell).then(|| (-low).min(high) / (high - low))
    }

    /// Where the plane crosses the border of a cell.
    fn cut_ends(&self, cell: &[DVec3]) -> Option<[DVec3; 2]> {
        let (mut ends, mut count) = ([DVec3::ZERO; 2], 0);
        for (a, b) in polygon::edges(cell) {
            let (height_a, height_b) = (self.height(a), self.height(b));
            if (height_a > 0.0) != (height_b > 0.0) && count < 2 {
                ends[count] = a + (b - a) * (height_a / (height_a - height_b));
                count += 1;
            }
        }
        (count == 2).then_some(ends)
    }

    /// Whether the lines of sight from the cell's points in the plane through the apex all pass the source by on one side:
    /// what lines up there hides nothing of it.
    fn lines_up_beside(&self, cell: &[DVec3], source: &[DVec3]) -> bool {
        let Some(ends) = self.cut_ends(cell) else { return false };
        polygon::edges(source)
            .any(|(a, b)| ends.iter().all(|&p| (a - p).cross(b - p).dot(self.apex - p) > 0.0))
    }

    /// Whether some point of the plane within the cell sees the blocker's edge (or corner) in line with the source's
    /// corner (or edge). Errs on the side of yes.
    fn is_seen_from_cut(&self, cell: &[DVec3]) -> bool {
        if self.kind == Kind::Always {
            return true;
        }
        let Some(ends) = self.cut_ends(cell) else { return true };
        let [a, b] = ends.map(|end| self.place(end));
        // A denominator that changes sign passes through infinity in between: anything may happen there.
        if (a.denominator > 0.0) != (b.denominator > 0.0) || a.denominator == 0.0 || b.denominator == 0.0 {
            return true;
        }
        let missed = |value: fn(&Place) -> f64| value(&a) < 0.0 && value(&b) < 0.0;
        !(missed(|p| p.along) || missed(|p| 1.0 - p.along) || missed(|p| p.between))
    }

    /// Where the line from `point` through the apex meets the edge's line.
    fn place(&self, point: DVec3) -> Place {
        let (to_point, to_edge, edge) = (point - self.apex, self.from - self.apex, self.to - self.from);
        let denominator = edge.cross(to_point).dot(self.normal);
        let along = -to_edge.cross(to_point).dot(self.normal) / denominator;
        // The edge's point is apex + share (point - apex).
        let share = (to_edge + along * edge).dot(to_point) / to_point.length_squared();
        let between = match self.kind {
            Kind::SourceCorner => share.min(1.0 - share),
            Kind::Blockers => 1.0 - share,
            _ => -share,
        };
        Place { denominator, along, between }
    }
}

#[derive(Debug, Clone, Copy)]
struct Place {
    denominator: f64,
    /// 0 to 1 on the edge.
    along: f64,
    /// Above 0 where apex, edge and point stand in the order that makes an event.
    between: f64,
}
