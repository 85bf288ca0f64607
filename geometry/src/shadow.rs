//! How a convex body stands between two convex sets of points: not at all, wholly, or with which of its edges.
//!
//! Seen from a point x, a body hides what lies inside the planes through x and its silhouette, behind its front faces. A
//! plane through x and the edge's line has y on its inner side where g(x, y) = det(a - x, b - x, y - x) has one sign; g is
//! affine in x and in y, so its signs at the corners of two convex sets hold for all pairs of their points.

use crate::body::{Body, BodyEdge};
use crate::plane::{PLANARITY, Plane};
use crate::polygon;
use glam::DVec3;
use std::ops::Range;

/// A volume g this small, in units of the edge's length and the pair's size squared, has no sign: what it could hide is
/// a strip of 1e-12 of the pair's size.
const EDGE_ROUNDING: f64 = 1e-12;

/// Where a convex set of points stands relative to a face of a body: 1 at or in front of it, -1 at or behind it, 0 on both
/// sides.
type Standing = i8;

/// Where a set stands relative to one face of `body`. A set on the face's plane counts as in front where it looks away from
/// the body, as behind where it looks into it; a flat body's plane has its front on both sides, unless it is the skin of a
/// solid one: then the set lies outside.
fn stand(set: Set<'_>, face: &Plane, body: &Body) -> Standing {
    let tolerance = PLANARITY * (body.radius + set.radius);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &point in set.corners {
        let height = face.distance(point);
        low = if height < low { height } else { low };
        high = if height > high { height } else { high };
    }
    match (low >= -tolerance, high <= tolerance) {
        (true, true) if body.is_skin => {
            if face.normal.dot(body.faces[0].normal) > 0.0 {
                1
            } else {
                -1
            }
        }
        (true, true) if body.is_flat() => 1,
        (true, true) => set.normal.map_or(0, |n| if n.dot(face.normal) > 0.0 { 1 } else { -1 }),
        // Some of a mixed set may lie on the plane and look either way.
        (true, false) if set.normal.is_none() && low <= tolerance => 0,
        (false, true) if set.normal.is_none() && high >= -tolerance => 0,
        (true, false) => 1,
        (false, true) => -1,
        (false, false) => 0,
    }
}

/// How a body stands between two sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blocking {
    /// No segment between them meets it.
    Nothing,
    /// Every segment does.
    Everything,
    /// Some may.
    Part,
    /// One of the sets is inside or may be: its faces have to be asked one by one.
    Inside,
}

/// Which of the two sets receives: the views of both ways round are kept, for either may be the better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum From {
    /// Points of the first set look at the second one.
    First = 0,
    /// Points of the second set look at the first one.
    Second = 1,
}

/// One body that blocks part of the view between two sets.
#[derive(Debug, Clone)]
struct Shadow<'a> {
    body: &'a Body,
    /// Where each set stands, per face of the body.
    standings: [Range<usize>; 2],
    /// Per way round: edges that can be silhouette and cut the source.
    edges: [Range<usize>; 2],
    /// Per way round: faces that can be in front and that the source reaches through.
    fronts: [Range<usize>; 2],
}

/// What bounds a shadow seen from any point of a receiver.
#[derive(Debug, Clone, Copy)]
pub enum Border {
    /// The plane through the point and an edge; `inward` (from - x) x (to - x) points to the hidden side.
    Edge {
        /// Start of the edge.
        from: DVec3,
        /// End of the edge.
        to: DVec3,
        /// 1 or -1.
        inward: f64,
    },
    /// A front face: what lies behind it is hidden.
    Front(Plane),
}

/// A half-space of the view from a point: the r (from the point) with normal . r + offset >= 0.
#[derive(Debug, Clone, Copy)]
pub struct HalfSpace {
    /// Not of length 1.
    pub normal: DVec3,
    /// 0 where its plane passes through the point.
    pub offset: f64,
}

/// A convex set of points: its corners, its size and the unit normal of the plane it looks from, where it has one.
#[derive(Debug, Clone, Copy)]
pub struct Set<'p> {
    /// Points whose convex hull it is.
    pub corners: &'p [DVec3],
    /// Largest distance from its middle.
    pub radius: f64,
    /// Normal, where all of it looks one way from one plane.
    pub normal: Option<DVec3>,
}

/// The bodies between two sets, as a stack: those between narrower sets are put on top.
#[derive(Debug, Clone, Default)]
pub struct Shadows<'a> {
    standings: Vec<Standing>,
    edges: Vec<u32>,
    fronts: Vec<u32>,
    list: Vec<Shadow<'a>>,
    /// Whether a body that hides everything is put on the stack like any other.
    keeps_covering: bool,
}

/// Lengths of the stack's parts.
#[derive(Debug, Clone, Copy)]
struct Mark {
    standings: usize,
    edges: usize,
    fronts: usize,
}

impl<'a> Shadows<'a> {
    /// Treats a body that hides everything as one that hides a part: the view is then found dark point by point.
    pub fn keep_covering(&mut self, keeps: bool) {
        self.keeps_covering = keeps;
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.standings.clear();
        self.edges.clear();
        self.fronts.clear();
        self.list.clear();
    }

    /// Number of shadows on the stack.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// The body that casts shadow `at`.
    pub fn body(&self, at: usize) -> &'a Body {
        self.list[at].body
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Forgets all but the first `len`.
    pub fn truncate(&mut self, len: usize) {
        let Some(first) = self.list.get(len) else { return };
        let mark = Mark {
            standings: first.standings[0].start,
            edges: first.edges[0].start,
            fronts: first.fronts[0].start,
        };
        self.forget(mark);
        self.list.truncate(len);
    }

    fn mark(&self) -> Mark {
        Mark { standings: self.standings.len(), edges: self.edges.len(), fronts: self.fronts.len() }
    }

    fn forget(&mut self, mark: Mark) {
        self.standings.truncate(mark.standings);
        self.edges.truncate(mark.edges);
        self.fronts.truncate(mark.fronts);
    }

    /// Looks how `body` stands between two convex sets; puts its shadow on the stack where it blocks a part.
    pub fn add(&mut self, body: &'a Body, first: Set<'_>, second: Set<'_>) -> Blocking {
        let mark = self.mark();
        for set in [first, second] {
            self.standings.extend(body.faces.iter().map(|face| stand(set, face, body)));
        }
        let faces = body.faces.len();
        let standings =
            [mark.standings..mark.standings + faces, mark.standings + faces..mark.standings + 2 * faces];
        let blocking = self.finish(body, standings, mark, [first, second], None, None);
        if blocking != Blocking::Part {
            self.forget(mark);
        }
        blocking
    }

    /// Looks again how the body of shadow `at` stands between parts of the two sets; as [`Shadows::add`], with less work,
    /// and less again where only one way round is wanted.
    pub fn narrow(&mut self, at: usize, first: Set<'_>, second: Set<'_>, only: Option<From>) -> Blocking {
        let parent = self.list[at].clone();
        let mark = self.mark();
        let faces = parent.body.faces.len();
        for (known, set) in parent.standings.iter().zip([first, second]) {
            for (k, face) in known.clone().zip(&parent.body.faces) {
                let before = self.standings[k];
                let now = if before == 0 { stand(set, face, parent.body) } else { before };
                self.standings.push(now);
            }
        }
        let standings =
            [mark.standings..mark.standings + faces, mark.standings + faces..mark.standings + 2 * faces];
        let blocking = self.finish(parent.body, standings, mark, [first, second], Some(&parent), only);
        if blocking != Blocking::Part {
            self.forget(mark);
        }
        blocking
    }

    fn finish(
        &mut self,
        body: &'a Body,
        standings: [Range<usize>; 2],
        mark: Mark,
        sets: [Set<'_>; 2],
        parent: Option<&Shadow<'a>>,
        only: Option<From>,
    ) -> Blocking {
        let [of_first, of_second] = [0, 1].map(|k| standings[k].clone());
        let mut common = of_first.clone().zip(of_second.clone());
        if common.any(|(r, s)| self.standings[r] == 1 && self.standings[s] == 1) {
            return Blocking::Nothing;
        }
        let is_outside = |range: Range<usize>| self.standings[range].contains(&1);
        let are_outside = is_outside(of_first) && is_outside(of_second);
        if !body.is_flat() && !are_outside {
            return Blocking::Inside;
        }
        let nothing = [mark.edges..mark.edges, mark.edges..mark.edges];
        let no_fronts = [mark.fronts..mark.fronts, mark.fronts..mark.fronts];
        let mut shadow = Shadow { body, standings, edges: nothing, fronts: no_fronts };
        let size =
            (sets[0].corners[0] - sets[1].corners[0]).length() + 2.0 * (sets[0].radius + sets[1].radius);
        for way in [0, 1] {
            if only.is_some_and(|only| only as usize != way) {
                continue;
            }
            let (edges_start, fronts_start) = (self.edges.len(), self.fronts.len());
            let (receiver, source) = (sets[way].corners, sets[1 - way].corners);
            for k in 0..body.faces.len() {
                let at = |set: usize| self.standings[shadow.standings[set].start + k];
                if at(way) >= 0 && at(1 - way) >= 0 {
                    self.fronts.push(k as u32);
                }
            }
            let base = shadow.standings[way].start;
            let candidates = parent.map_or(0..body.edges.len(), |parent| parent.edges[way].clone());
            for candidate in candidates {
                let k = if parent.is_some() { self.edges[candidate] } else { candidate as u32 };
                match self.cut(&body.edges[k as usize], base, receiver, source, size) {
                    Cut::Outside => return Blocking::Nothing,
                    Cut::Across => self.edges.push(k),
                    Cut::Inside => {}
                }
            }
            shadow.edges[way] = edges_start..self.edges.len();
            shadow.fronts[way] = fronts_start..self.fronts.len();
            // From every point of the receiver the source lies inside the silhouette and behind the front faces.
            if shadow.edges[way].is_empty() && shadow.fronts[way].is_empty() && !self.keeps_covering {
                self.edges.truncate(mark.edges);
                return Blocking::Everything;
            }
        }
        self.list.push(shadow);
        Blocking::Part
    }

    /// Where the source lies relative to the planes through the receiver's points and an edge.
    fn cut(&self, edge: &BodyEdge, base: usize, receiver: &[DVec3], source: &[DVec3], size: f64) -> Cut {
        let (left, right) = (self.standings[base + edge.left], self.standings[base + edge.right]);
        // Both faces in front, or both behind: never a silhouette.
        if left * right == 1 {
            return Cut::Inside;
        }
        let is_known = left != 0 || right != 0;
        let inward = if left == 1 || right == -1 { -1.0 } else { 1.0 };
        match signs(edge.from, edge.to, receiver, source, size) {
            Sign::Both => Cut::Across,
            Sign::None => {
                if is_known {
                    Cut::Inside
                } else {
                    Cut::Across
                }
            }
            Sign::One(sign) if sign * inward > 0.0 => {
                if is_known {
                    Cut::Inside
                } else {
                    Cut::Across
                }
            }
            Sign::One(_) => {
                if left * right == -1 {
                    Cut::Outside
                } else {
                    Cut::Across
                }
            }
        }
    }

    /// The half-spaces that together hold what shadow `at` hides from `point` (all of the source where there are none);
    /// `false` where it hides nothing, for an eye in the plane of a flat body.
    pub fn half_spaces(&self, at: usize, from: From, point: DVec3, out: &mut Vec<HalfSpace>) -> bool {
        out.clear();
        let shadow = &self.list[at];
        let standings = &self.standings[shadow.standings[from as usize].clone()];
        let is_front = |face: usize| match standings[face] {
            0 => shadow.body.faces[face].distance(point) > 0.0,
            known => known > 0,
        };
        if shadow.body.is_flat() && !is_front(0) && !is_front(1) {
            return false;
        }
        for &k in &self.edges[shadow.edges[from as usize].clone()] {
            let edge = &shadow.body.edges[k as usize];
            let left = is_front(edge.left);
            if left != is_front(edge.right) {
                let across = (edge.from - point).cross(edge.to - point);
                out.push(HalfSpace { normal: if left { -across } else { across }, offset: 0.0 });
            }
        }
        for &k in &self.fronts[shadow.fronts[from as usize].clone()] {
            let face = &shadow.body.faces[k as usize];
            let height = face.distance(point);
            if height > 0.0 {
                out.push(HalfSpace { normal: -face.normal, offset: -height });
            }
        }
        true
    }

    /// The borders of what shadow `at` hides, where they are the same for all points of the receiver; `false` where they
    /// are not.
    pub fn borders(&self, at: usize, from: From, out: &mut Vec<Border>) -> bool {
        out.clear();
        let shadow = &self.list[at];
        let standings = &self.standings[shadow.standings[from as usize].clone()];
        if shadow.body.is_flat() && standings[0] == 0 {
            return false;
        }
        for &k in &self.edges[shadow.edges[from as usize].clone()] {
            let edge = &shadow.body.edges[k as usize];
            let (left, right) = (standings[edge.left], standings[edge.right]);
            if left * right != -1 {
                return false;
            }
            let inward = if left == 1 { -1.0 } else { 1.0 };
            out.push(Border::Edge { from: edge.from, to: edge.to, inward });
        }
        for &k in &self.fronts[shadow.fronts[from as usize].clone()] {
            if standings[k as usize] == 0 {
                return false;
            }
            out.push(Border::Front(shadow.body.faces[k as usize]));
        }
        true
    }

    /// How many planes through an edge that cuts the source and a corner of the source cross the receiver.
    pub fn crossings(&self, which: Range<usize>, from: From, receiver: &[DVec3], source: &[DVec3]) -> usize {
        let mut count = 0;
        let size =
            polygon::diameter(receiver) + polygon::diameter(source) + (receiver[0] - source[0]).length();
        for at in which {
            self.for_each_edge(at, from, |edge| {
                volumes(edge.from, edge.to, receiver, source, size, |low, high, rounding| {
                    count += usize::from(low < -rounding && high > rounding);
                });
            });
        }
        count
    }

    /// Visits the edges of shadow `at` that cut the source.
    pub fn for_each_edge(&self, at: usize, from: From, mut visit: impl FnMut(&BodyEdge)) {
        let shadow = &self.list[at];
        for &k in &self.edges[shadow.edges[from as usize].clone()] {
            visit(&shadow.body.edges[k as usize]);
        }
    }

    /// Visits the faces of the body of shadow `at` whose planes the receiver crosses.
    pub fn for_each_crossed_face(&self, at: usize, from: From, mut visit: impl FnMut(&Plane)) {
        let shadow = &self.list[at];
        let standings = &self.standings[shadow.standings[from as usize].clone()];
        let crossed = standings.iter().zip(&shadow.body.faces).filter(|(standing, _)| **standing == 0);
        crossed.for_each(|(_, face)| visit(face));
    }
}

/// Where a source lies relative to the planes through a silhouette edge.
enum Cut {
    /// Always on the inner side: the edge bounds nothing of it.
    Inside,
    /// Always on the outer side.
    Outside,
    /// On both, or the edge is not always silhouette.
    Across,
}

/// Signs of g over the corners of two sets.
enum Sign {
    /// All zero to rounding.
    None,
    /// 1 or -1, or zero.
    One(f64),
    /// Both.
    Both,
}

/// Signs of g(x, y) over the corners of two sets that fit into `size`.
fn signs(from: DVec3, to: DVec3, receiver: &[DVec3], source: &[DVec3], size: f64) -> Sign {
    let (mut is_below, mut is_above) = (false, false);
    volumes(from, to, receiver, source, size, |low, high, rounding| {
        is_below |= low < -rounding;
        is_above |= high > rounding;
    });
    match (is_below, is_above) {
        (false, false) => Sign::None,
        (true, true) => Sign::Both,
        (true, false) => Sign::One(-1.0),
        (false, true) => Sign::One(1.0),
    }
}

/// Calls `visit(low, high, rounding)` for every corner y of the source: the extremes of 0 and of g(x, y) over the receiver's
/// corners x, and what of them is rounding. With x and y taken from the edge's start, g is x . (y x l): one cross product
/// per y, one scalar product per pair.
#[inline(always)]
fn volumes(
    from: DVec3,
    to: DVec3,
    receiver: &[DVec3],
    source: &[DVec3],
    size: f64,
    mut visit: impl FnMut(f64, f64, f64),
) {
    /// Corners of the source looked at together.
    const LANES: usize = 4;
    let along = to - from;
    let reach = size + (from - receiver[0]).length();
    let rounding = EDGE_ROUNDING * reach * reach * along.length();
    for group in source.chunks(LANES) {
        let (mut wx, mut wy, mut wz) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (k, &y) in group.iter().enumerate() {
            let w = (y - from).cross(along);
            (wx[k], wy[k], wz[k]) = (w.x, w.y, w.z);
        }
        let (mut low, mut high) = ([0.0f64; LANES], [0.0f64; LANES]);
        for &x in receiver {
            let x = x - from;
            for k in 0..LANES {
                let volume = x.x * wx[k] + x.y * wy[k] + x.z * wz[k];
                low[k] = if volume < low[k] { volume } else { low[k] };
                high[k] = if volume > high[k] { volume } else { high[k] };
            }
        }
        (0..group.len()).for_each(|k| visit(low[k], high[k], rounding));
    }
}
