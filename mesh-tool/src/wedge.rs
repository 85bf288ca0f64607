//! A wedge and what it leaves on the scene (VE and EV events: Heckbert 1992; Lischinski, Tampieri & Greenberg 1992).
//!
//! A wedge is the flat fan of sightlines between a point and an edge, one on the emitter and the other on an occluder,
//! continued beyond the occluder. It is swept front to back: where something stands between emitter and occluder it
//! is blocked, and beyond the occluder only the first face in the way gets a line.
//!
//! In the plane of the wedge a point is apex + t (B(u) - apex), with B(u) on the base edge from u = 0 to 1. A segment is a
//! straight line in (u, 1/t): the nearest of several is found by comparing straight lines.

use crate::box_tree::BoxTree;
use geometry::plane::Plane;
use glam::{DVec2, DVec3};

/// Parts of the base shorter than this are rounding.
const SHORT: f64 = 1e-11;

/// A convex piece of a face that can block and receive.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Corners.
    pub corners: Vec<DVec3>,
    /// Face it is a piece of.
    pub face: u32,
}

/// The surroundings of all wedges.
#[derive(Debug)]
pub struct Surroundings {
    /// Pieces of all faces.
    pub pieces: Vec<Piece>,
    /// Planes of the faces.
    pub planes: Vec<Plane>,
    tree: BoxTree,
    /// Lengths below this are rounding.
    pub tolerance: f64,
}

impl Surroundings {
    /// Prepares pieces of faces with these planes.
    pub fn new(pieces: Vec<Piece>, planes: Vec<Plane>, tolerance: f64) -> Surroundings {
        let corners: Vec<Vec<DVec3>> = pieces.iter().map(|piece| piece.corners.clone()).collect();
        Surroundings { tree: BoxTree::new(&corners), pieces, planes, tolerance }
    }

    /// Whether nothing but touching stands between two points; faces for which `ignore` holds do not count.
    pub fn sees(&self, from: DVec3, to: DVec3, ignore: impl Fn(u32) -> bool) -> bool {
        let along = to - from;
        let length = along.length();
        if length <= 2.0 * self.tolerance {
            return true;
        }
        let (middle, half) = (0.5 * (from + to), 0.5 * along.abs());
        let mut clear = true;
        self.tree.visit(
            |centre, size| overlap(centre - middle, size + half + self.tolerance),
            |k| {
                let piece = &self.pieces[k as usize];
                if !clear || ignore(piece.face) {
                    return;
                }
                let plane = &self.planes[piece.face as usize];
                let (a, b) = (plane.distance(from), plane.distance(to));
                let apart = (a > self.tolerance && b < -self.tolerance)
                    || (a < -self.tolerance && b > self.tolerance);
                if !apart {
                    return;
                }
                let hit = from + along * (a / (a - b));
                let inside = geometry::polygon::edges(&piece.corners).all(|(p, q)| {
                    let edge = q - p;
                    edge.cross(hit - p).dot(plane.normal) > self.tolerance * edge.length()
                });
                clear &= !inside;
            },
        );
        clear
    }
}

impl Surroundings {
    /// The first face that a ray meets, and where; faces for which `ignore` holds do not count.
    pub fn first_hit(
        &self,
        from: DVec3,
        direction: DVec3,
        ignore: impl Fn(u32) -> bool,
    ) -> Option<(u32, DVec3)> {
        let unit = direction.try_normalize()?;
        // A box lies near the ray's line where its centre is no farther from the line than its radius.
        let reaches = |centre: DVec3, size: DVec3| {
            let offset = centre - from;
            let along = offset.dot(unit);
            let radius = size.length() + self.tolerance;
            along >= -radius && (offset - along * unit).length_squared() <= radius * radius
        };
        let mut nearest: Option<(f64, u32, DVec3)> = None;
        self.tree.visit(reaches, |k| {
            let piece = &self.pieces[k as usize];
            let plane = &self.planes[piece.face as usize];
            let slope = plane.normal.dot(unit);
            let distance = -plane.distance(from) / slope;
            if ignore(piece.face) || !distance.is_finite() || distance <= self.tolerance {
                return;
            }
            let point = from + distance * unit;
            let inside = geometry::polygon::edges(&piece.corners)
                .all(|(p, q)| (q - p).cross(point - p).dot(plane.normal) >= 0.0);
            let nearer = nearest.is_none_or(|(d, face, _)| (distance, piece.face) < (d, face));
            if inside && nearer {
                nearest = Some((distance, piece.face, point));
            }
        });
        nearest.map(|(_, face, point)| (face, point))
    }
}

fn overlap(offset: DVec3, size: DVec3) -> bool {
    offset.abs().cmple(size).all()
}

/// A fan of sightlines.
#[derive(Debug, Clone, Copy)]
pub struct Wedge {
    /// The point.
    pub apex: DVec3,
    /// The edge.
    pub base: [DVec3; 2],
    /// Whether the apex is on the emitter and the base on the occluder, not the other way round.
    pub from_apex: bool,
}

/// A line that a wedge leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trace {
    /// Face it lies on.
    pub face: u32,
    /// Whether on its front.
    pub front: bool,
    /// Ends.
    pub ends: [DVec3; 2],
}

/// A segment in (u, 1/t), from smaller to larger u.
#[derive(Debug, Clone, Copy)]
struct Span {
    from: DVec2,
    to: DVec2,
    face: u32,
}

impl Span {
    fn at(&self, u: f64) -> f64 {
        let t = (u - self.from.x) / (self.to.x - self.from.x);
        self.from.y + t * (self.to.y - self.from.y)
    }
}

impl Wedge {
    /// Normal of its plane; `None` where point and edge lie on one line.
    pub fn normal(&self, tolerance: f64) -> Option<DVec3> {
        let [b0, b1] = self.base.map(|b| b - self.apex);
        let cross = b0.cross(b1);
        let thick = cross.length() > tolerance * (b0.length().max(b1.length()));
        thick.then(|| cross.normalize())
    }

    /// Sweeps the part of the wedge between `range` of its base. Faces in `own` (those that meet in the occluder's edge)
    /// do not stop it.
    pub fn sweep(&self, scene: &Surroundings, range: [f64; 2], own: &[u32]) -> Vec<Trace> {
        let tolerance = scene.tolerance;
        let Some(normal) = self.normal(tolerance) else { return Vec::new() };
        let [b0, b1] = self.base.map(|b| b - self.apex);
        let double = b0.cross(b1).dot(normal);
        let flat = |p: DVec3| {
            let p = p - self.apex;
            DVec2::new(p.cross(b1).dot(normal), b0.cross(p).dot(normal)) / double
        };
        // 1/t differs from 1 by less than this where a face touches the base.
        let touching = 8.0 * tolerance / b0.length().min(b1.length()).max(distance_to_line(b0, b1));

        let (mut before, mut beyond) = (Vec::new(), Vec::new());
        for (face, [p, q]) in self.cuts(scene, normal) {
            if own.contains(&face) || scene.planes[face as usize].distance(self.apex).abs() <= tolerance {
                continue;
            }
            let (p, q) = (flat(p), flat(q));
            if let Some(span) = fan_part(p, q, face) {
                before.extend(above(span, 1.0 + touching));
                if self.from_apex {
                    beyond.extend(below(span, 1.0 + touching));
                }
            }
            if !self.from_apex
                && let Some(span) = fan_part(-p, -q, face)
            {
                beyond.push(span);
            }
        }
        first_hits(&before, &beyond, range)
            .into_iter()
            .filter_map(|(a, b, span)| {
                // What touches the base stops the wedge there; the contact is a line of its own.
                let touches = self.from_apex && span.at(a) >= 1.0 - touching && span.at(b) >= 1.0 - touching;
                let plane = &scene.planes[span.face as usize];
                let height = plane.distance(self.apex);
                let point = |u: f64| {
                    let direction = if u == 0.0 {
                        b0
                    } else if u == 1.0 {
                        b1
                    } else {
                        b0.lerp(b1, u)
                    };
                    self.apex - direction * (height / plane.normal.dot(direction))
                };
                let ends = [point(a), point(b)];
                let long = ends[0].distance(ends[1]) > 2.0 * tolerance;
                (!touches && long).then_some(Trace { face: span.face, front: height > 0.0, ends })
            })
            .collect()
    }

    /// The segments in which faces cut the plane of the wedge.
    fn cuts(&self, scene: &Surroundings, normal: DVec3) -> Vec<(u32, [DVec3; 2])> {
        let tolerance = scene.tolerance;
        let [b0, b1] = self.base.map(|b| b - self.apex);
        // Planes through the sides of the fan, upright on it; both cones of the double fan lie between them.
        let (side0, side1) = (normal.cross(b0).normalize(), b1.cross(normal).normalize());
        let reach = |n: DVec3, size: DVec3| n.abs().dot(size) + tolerance;
        let from_apex = self.from_apex;
        let reaches = |centre: DVec3, size: DVec3| {
            let offset = centre - self.apex;
            if normal.dot(offset).abs() > reach(normal, size) {
                return false;
            }
            let (d0, d1) = (side0.dot(offset), side1.dot(offset));
            let (r0, r1) = (reach(side0, size), reach(side1, size));
            (d0 >= -r0 && d1 >= -r1) || (!from_apex && d0 <= r0 && d1 <= r1)
        };
        let mut cuts: Vec<(u32, [DVec3; 2])> = Vec::new();
        let mut edges: Vec<(u32, [DVec3; 2], bool)> = Vec::new();
        scene.tree.visit(reaches, |k| {
            let piece = &scene.pieces[k as usize];
            let corners = &piece.corners;
            let heights: Vec<f64> = corners
                .iter()
                .map(|&c| normal.dot(c - self.apex))
                .map(|h| if h.abs() <= tolerance { 0.0 } else { h })
                .collect();
            let (front, back) = (heights.iter().any(|&h| h > 0.0), heights.iter().any(|&h| h < 0.0));
            if !front && !back {
                return;
            }
            let mut points: Vec<DVec3> = Vec::new();
            for k in 0..corners.len() {
                let next = (k + 1) % corners.len();
                if heights[k] == 0.0 {
                    points.push(corners[k]);
                } else if heights[k] * heights[next] < 0.0 {
                    let t = heights[k] / (heights[k] - heights[next]);
                    points.push(corners[k].lerp(corners[next], t));
                }
            }
            let Some((p, q)) = farthest(&points) else { return };
            if front && back {
                cuts.push((piece.face, [p, q]));
            } else {
                edges.push((piece.face, [p, q], front));
            }
        });
        // A face whose two pieces meet in the plane is cut there; one that only reaches it with its border is not.
        for (i, &(face, [p, q], front)) in edges.iter().enumerate() {
            for &(other, [r, s], other_front) in &edges[i + 1..] {
                if other == face && other_front != front {
                    let direction = (q - p).normalize();
                    let along = |x: DVec3| (x - p).dot(direction);
                    let (low, high) = (along(r).min(along(s)).max(0.0), along(r).max(along(s)).min(along(q)));
                    if high - low > tolerance {
                        cuts.push((face, [p + low * direction, p + high * direction]));
                    }
                }
            }
        }
        cuts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1[0].x.total_cmp(&b.1[0].x)));
        cuts
    }
}

fn distance_to_line(b0: DVec3, b1: DVec3) -> f64 {
    b0.cross(b1).length() / b0.distance(b1)
}

fn farthest(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let pairs = (0..points.len()).flat_map(|i| (i + 1..points.len()).map(move |j| (i, j)));
    let distance = |&(i, j): &(usize, usize)| points[i].distance_squared(points[j]);
    let (i, j) = pairs.max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (points[i] != points[j]).then_some((points[i], points[j]))
}

/// The part of a segment inside the fan, where both coordinates are positive.
fn fan_part(mut p: DVec2, mut q: DVec2, face: u32) -> Option<Span> {
    for axis in 0..2 {
        if p[axis] < 0.0 && q[axis] < 0.0 {
            return None;
        }
        let cross = p.lerp(q, p[axis] / (p[axis] - q[axis]));
        if p[axis] < 0.0 {
            p = cross;
            p[axis] = 0.0;
        } else if q[axis] < 0.0 {
            q = cross;
            q[axis] = 0.0;
        }
    }
    let place = |s: DVec2| DVec2::new(s.y / (s.x + s.y), 1.0 / (s.x + s.y));
    let (mut from, mut to) = (place(p), place(q));
    if from.x > to.x {
        std::mem::swap(&mut from, &mut to);
    }
    let valid = from.is_finite() && to.is_finite() && to.x - from.x > SHORT;
    valid.then_some(Span { from, to, face })
}

/// The part of a span with 1/t above a limit.
fn above(span: Span, limit: f64) -> Option<Span> {
    let (y0, y1) = (span.from.y - limit, span.to.y - limit);
    match (y0 > 0.0, y1 > 0.0) {
        (false, false) => None,
        (true, true) => Some(span),
        (start, _) => {
            let cross = span.from.lerp(span.to, y0 / (y0 - y1));
            let part = if start { Span { to: cross, ..span } } else { Span { from: cross, ..span } };
            (part.to.x - part.from.x > SHORT).then_some(part)
        }
    }
}

fn below(span: Span, limit: f64) -> Option<Span> {
    let turned =
        |s: Span| Span { from: DVec2::new(s.from.x, -s.from.y), to: DVec2::new(s.to.x, -s.to.y), ..s };
    above(turned(span), -limit).map(turned)
}

/// For each part of the range that nothing blocks before, the span that is hit first: that of the largest 1/t.
fn first_hits(before: &[Span], beyond: &[Span], range: [f64; 2]) -> Vec<(f64, f64, Span)> {
    let mut stops: Vec<f64> = before.iter().chain(beyond).flat_map(|s| [s.from.x, s.to.x]).collect();
    stops.extend(range);
    stops.retain(|&u| u >= range[0] && u <= range[1]);
    stops.sort_by(f64::total_cmp);
    let mut hits: Vec<(f64, f64, Span)> = Vec::new();
    let mut at = range[0];
    for &stop in &stops {
        if stop - at <= SHORT {
            continue;
        }
        let (a, b) = (at, stop);
        at = stop;
        let middle = 0.5 * (a + b);
        let over = |s: &&Span| s.from.x <= middle && middle <= s.to.x;
        if before.iter().any(|s| over(&s)) {
            continue;
        }
        let here: Vec<&Span> = beyond.iter().filter(over).collect();
        nearest(&here, a, b, &mut |a, b, span| match hits.last_mut() {
            Some((_, end, last)) if last.face == span.face && (a - *end).abs() <= SHORT => *end = b,
            _ => hits.push((a, b, span)),
        });
    }
    hits
}

/// The upper envelope of spans that all reach over a to b.
fn nearest(spans: &[&Span], a: f64, b: f64, found: &mut impl FnMut(f64, f64, Span)) {
    let inset = 1e-6 * (b - a);
    let top = |u: f64| spans.iter().max_by(|s, t| s.at(u).total_cmp(&t.at(u)));
    let (Some(first), Some(last)) = (top(a + inset), top(b - inset)) else { return };
    if std::ptr::eq(*first, *last) || first.face == last.face {
        found(a, b, **first);
        return;
    }
    let (d0, d1) = (first.at(a) - last.at(a), first.at(b) - last.at(b));
    let cross = a + (b - a) * (d0 / (d0 - d1));
    if !(cross - a > SHORT && b - cross > SHORT) {
        found(a, b, **first);
        return;
    }
    nearest(spans, a, cross, found);
    nearest(spans, cross, b, found);
}
