//! What blocks light, as convex bodies: a block of six faces casts one shadow, bounded by its silhouette, not six.
//!
//! A closed convex surface blocks exactly the segments that meet its inside. So does one with a single flat opening (a block
//! without a bottom, standing on a floor), for ends outside its hull: what enters through the opening cannot leave through
//! the same plane. And so does one with further openings that lie wholly on a face of something else (a chair's leg without
//! ends, between the floor and the seat): what would enter there is blocked by that face. Any other blocker is a flat body of
//! its own: a polygon with two sides.

use crate::occluder::Occluder;
use crate::plane::{PLANARITY, Plane};
use crate::polygon;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// An edge between two faces of a body; it runs counter-clockwise round the left one.
#[derive(Debug, Clone, Copy)]
pub struct BodyEdge {
    /// Start.
    pub from: DVec3,
    /// End.
    pub to: DVec3,
    /// Face on the left, seen from outside.
    pub left: usize,
    /// Face on the right.
    pub right: usize,
}

/// A convex blocker.
#[derive(Debug, Clone)]
pub struct Body {
    /// Planes of the faces, normals outward; a flat body has its plane both ways.
    pub faces: Vec<Plane>,
    /// Edges.
    pub edges: Vec<BodyEdge>,
    /// Corners.
    pub corners: Vec<DVec3>,
    /// Mean of the corners.
    pub centre: DVec3,
    /// Largest distance of a corner from the centre.
    pub radius: f64,
    /// The faces of a solid body as flat ones, for pairs with an end inside it; none for a flat body.
    pub parts: Vec<Body>,
    /// Whether it is a face of a solid body whose inside nothing looks into: what lies on it lies outside, and where it looks
    /// at the body it touches it and sees nothing.
    pub is_skin: bool,
}

impl Body {
    /// A polygon with two sides.
    pub fn flat(occluder: &Occluder) -> Body {
        let edge = |(from, to)| BodyEdge { from, to, left: 0, right: 1 };
        Body {
            faces: vec![occluder.plane, occluder.plane.flipped()],
            edges: polygon::edges(&occluder.corners).map(edge).collect(),
            corners: occluder.corners.clone(),
            centre: occluder.centre,
            radius: occluder.radius,
            parts: Vec::new(),
            is_skin: false,
        }
    }

    /// Says that nothing looks into its inside: no face of it has a front there. Two bodies that touch then hide each other's
    /// faces there, instead of letting them look through each other's inside.
    pub fn seal(&mut self) {
        self.parts.iter_mut().for_each(|part| part.is_skin = true);
    }

    /// Whether a point lies on its surface.
    pub fn has_on_surface(&self, point: DVec3) -> bool {
        let tolerance = PLANARITY * self.radius;
        let highest = self.faces.iter().map(|face| face.distance(point)).fold(f64::NEG_INFINITY, f64::max);
        highest.abs() <= tolerance
    }

    /// Whether it has no inside.
    pub fn is_flat(&self) -> bool {
        self.parts.is_empty()
    }
}

/// The bodies that a scene's convex blocking polygons make up, in the order of each body's first polygon.
pub fn bodies(occluders: &[Occluder]) -> Vec<Body> {
    let surface = Surface::new(occluders);
    let mut taken = vec![false; occluders.len()];
    let mut found = Vec::new();
    for seed in 0..occluders.len() {
        if taken[seed] {
            continue;
        }
        let members = surface.grow(seed, &taken);
        let solid = surface.solid(&members);
        members.iter().for_each(|&k| taken[k] = true);
        match solid {
            Some(body) => found.push(body),
            None => found.extend(members.iter().map(|&k| Body::flat(&occluders[k]))),
        }
    }
    found
}

/// A corner as its bits: corners of neighbours are copies of one vertex.
type Corner = [u64; 3];

fn key(corner: DVec3) -> Corner {
    // 0 + x turns -0 into 0.
    corner.to_array().map(|x| (0.0 + x).to_bits())
}

struct Surface<'a> {
    occluders: &'a [Occluder],
    /// Polygons that run along a directed edge.
    along: BTreeMap<(Corner, Corner), Vec<usize>>,
}

impl<'a> Surface<'a> {
    fn new(occluders: &'a [Occluder]) -> Self {
        let mut along: BTreeMap<(Corner, Corner), Vec<usize>> = BTreeMap::new();
        for (k, occluder) in occluders.iter().enumerate() {
            for (a, b) in polygon::edges(&occluder.corners) {
                along.entry((key(a), key(b))).or_default().push(k);
            }
        }
        Self { occluders, along }
    }

    /// Whether all corners of `k` lie at or behind the plane of `of`.
    fn is_behind(&self, k: usize, of: usize) -> bool {
        let (body, plane) = (&self.occluders[k], &self.occluders[of].plane);
        let tolerance = PLANARITY * (body.radius + self.occluders[of].radius);
        body.corners.iter().all(|&c| plane.distance(c) <= tolerance)
    }

    /// Whether both can be faces of one convex body: each behind the other, and not the two sides of one plane.
    fn are_convex(&self, k: usize, m: usize) -> bool {
        let [a, b] = [k, m].map(|at| &self.occluders[at]);
        let tolerance = PLANARITY * (a.radius + b.radius);
        let back_to_back = a.plane.normal.dot(b.plane.normal) < 0.0
            && a.corners.iter().all(|&c| b.plane.distance(c).abs() <= tolerance);
        self.is_behind(k, m) && self.is_behind(m, k) && !back_to_back
    }

    /// Polygons joined to the seed edge by edge, as long as all lie behind each other's planes: part of a convex surface.
    fn grow(&self, seed: usize, taken: &[bool]) -> BTreeSet<usize> {
        let mut members = BTreeSet::from([seed]);
        let mut pending = vec![seed];
        while let Some(k) = pending.pop() {
            for (a, b) in polygon::edges(&self.occluders[k].corners) {
                let across = self.along.get(&(key(b), key(a))).map_or(&[][..], Vec::as_slice);
                for &other in across {
                    let fits = !taken[other]
                        && !members.contains(&other)
                        && members.iter().all(|&m| self.are_convex(other, m));
                    if fits {
                        members.insert(other);
                        pending.push(other);
                        break;
                    }
                }
            }
        }
        members
    }

    /// Whether one blocking polygon holds all of a lid.
    fn is_covered(&self, lid: &[DVec3], plane: &Plane) -> bool {
        let size = polygon::diameter(lid);
        self.occluders.iter().any(|o| {
            let tolerance = PLANARITY * (size + o.radius);
            o.plane.normal.cross(plane.normal).length() * size <= tolerance
                && lid.iter().all(|&c| o.plane.distance(c).abs() <= tolerance)
                && polygon::edges(&o.corners).all(|(a, b)| {
                    let inward = o.plane.normal.cross(b - a).normalize_or_zero();
                    lid.iter().all(|&c| inward.dot(c - a) >= -tolerance)
                })
        })
    }

    /// The solid that the members bound, with at most one flat opening that nothing covers; `None` where they bound none.
    fn solid(&self, members: &BTreeSet<usize>) -> Option<Body> {
        if members.len() < 3 {
            return None;
        }
        let place: BTreeMap<usize, usize> = members.iter().enumerate().map(|(at, &k)| (k, at)).collect();
        let mut faces: Vec<Plane> = members.iter().map(|&k| self.occluders[k].plane).collect();
        let (mut edges, mut open) = (Vec::new(), Vec::new());
        for (&k, &left) in &place {
            for (from, to) in polygon::edges(&self.occluders[k].corners) {
                let across = self.along.get(&(key(to), key(from)));
                let across: Vec<usize> =
                    across.into_iter().flatten().filter_map(|other| place.get(other).copied()).collect();
                match across[..] {
                    [] => open.push((from, to, left)),
                    [right] if left < right => edges.push(BodyEdge { from, to, left, right }),
                    [right] if right < left => {}
                    _ => return None,
                }
            }
        }
        let parts: Vec<Body> = members.iter().map(|&k| Body::flat(&self.occluders[k])).collect();
        let mut corners: Vec<DVec3> = Vec::new();
        let mut known = BTreeSet::new();
        for corner in parts.iter().flat_map(|part| &part.corners) {
            if known.insert(key(*corner)) {
                corners.push(*corner);
            }
        }
        let centre = polygon::mean_corner(&corners);
        let radius = corners.iter().map(|&c| (c - centre).length()).fold(0.0, f64::max);
        let tolerance = PLANARITY * radius;
        let lids = lids(&open)?;
        let mut uncovered = 0;
        for lid in &lids {
            let plane = Plane::of_polygon(&lid.corners)?;
            let outside = corners.iter().any(|&c| plane.distance(c) > tolerance);
            if outside || lid.corners.iter().any(|&c| plane.distance(c).abs() > tolerance) {
                return None;
            }
            let right = faces.len();
            faces.push(plane);
            edges.extend(lid.edges.iter().map(|&k| {
                let (from, to, left) = open[k];
                BodyEdge { from, to, left, right }
            }));
            uncovered += usize::from(lids.len() > 1 && !self.is_covered(&lid.corners, &plane));
        }
        if uncovered > 1 {
            return None;
        }
        // A flat patch with a lid of its own encloses nothing.
        let has_inside = faces.iter().all(|face| corners.iter().any(|&c| face.distance(c) < -tolerance));
        has_inside.then_some(Body { faces, edges, corners, centre, radius, parts, is_skin: false })
    }
}

/// A loop of open edges.
struct Lid {
    /// As the missing face would run round it.
    corners: Vec<DVec3>,
    /// Places of its edges among the open ones.
    edges: Vec<usize>,
}

/// The loops that open edges make; `None` where they meet in a corner.
fn lids(open: &[(DVec3, DVec3, usize)]) -> Option<Vec<Lid>> {
    let back: BTreeMap<Corner, usize> =
        open.iter().enumerate().map(|(k, &(_, to, _))| (key(to), k)).collect();
    if back.len() != open.len() {
        return None;
    }
    let mut taken = vec![false; open.len()];
    let mut lids = Vec::new();
    for start in 0..open.len() {
        let mut lid = Lid { corners: Vec::new(), edges: Vec::new() };
        let mut at = start;
        while !taken[at] {
            taken[at] = true;
            lid.corners.push(open[at].0);
            lid.edges.push(at);
            at = *back.get(&key(open[at].0))?;
        }
        if !lid.edges.is_empty() {
            lids.push(lid);
        }
    }
    Some(lids)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Faces of a cuboid, fronts outward: bottom, top, and the four sides.
    fn cuboid(low: DVec3, high: DVec3) -> Vec<Occluder> {
        let at = |k: usize| {
            let pick = |bit: usize| if k >> bit & 1 == 0 { low[bit] } else { high[bit] };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(|face| Occluder::new(face.map(at).to_vec()).unwrap())
            .to_vec()
    }

    #[test]
    fn a_block_is_one_body_with_or_without_its_bottom() {
        let block = cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
        for blockers in [block.clone(), block[1..].to_vec(), block[..5].to_vec()] {
            let found = bodies(&blockers);
            assert_eq!(found.len(), 1);
            assert_eq!((found[0].faces.len(), found[0].edges.len(), found[0].corners.len()), (6, 12, 8));
            assert_eq!(found[0].parts.len(), blockers.len());
        }
    }

    #[test]
    fn a_room_an_open_tube_and_a_plate_stay_flat() {
        let block = cuboid(DVec3::ZERO, DVec3::ONE);
        let room: Vec<Occluder> =
            block.iter().map(|o| Occluder::new(o.corners.iter().rev().copied().collect()).unwrap()).collect();
        assert!(bodies(&room).iter().all(Body::is_flat));
        assert_eq!(bodies(&room).len(), 6);
        assert!(bodies(&block[2..]).iter().all(Body::is_flat));
        assert!(bodies(&block[..1]).iter().all(Body::is_flat));
    }

    /// A leg without ends between a floor and a seat is a body; one between nothing is not.
    #[test]
    fn a_tube_between_two_faces_is_one_body() {
        let leg = cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.1, 1.1, 1.0))[2..].to_vec();
        let floor = cuboid(DVec3::ZERO, DVec3::new(3.0, 3.0, 1.0))[0].clone();
        // One open end that nothing covers is allowed.
        for seat_height in [1.0, 1.001] {
            let seat = cuboid(DVec3::new(0.5, 0.5, seat_height), DVec3::new(2.0, 2.0, 1.1));
            let mut all = vec![floor.clone()];
            all.extend(leg.iter().chain(&seat).cloned());
            let found = bodies(&all);
            let legs = found.iter().filter(|b| !b.is_flat() && b.parts.len() == 4).count();
            assert_eq!((legs, found.len()), (1, 3));
        }
        // Nothing beneath and nothing above.
        assert!(bodies(&leg).iter().all(Body::is_flat));
    }

    #[test]
    fn a_block_on_a_floor_is_told_from_the_floor() {
        let block = cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0));
        let floor = |x0: f64, y0: f64, x1: f64, y1: f64| {
            let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec3::new(x, y, 0.0));
            Occluder::new(corners.to_vec()).unwrap()
        };
        let mut all = vec![floor(1.0, 1.0, 2.0, 2.0), floor(1.0, 0.0, 2.0, 1.0), floor(2.0, 1.0, 3.0, 2.0)];
        all.extend(block[1..].iter().cloned());
        let found = bodies(&all);
        assert_eq!(found.iter().filter(|b| !b.is_flat()).count(), 1);
        assert_eq!(found.len(), 4);
    }
}
