//! What blocks light, as convex bodies: a block of six faces casts one shadow, bounded by its silhouette, not six.
//!
//! A closed convex surface blocks exactly the segments that meet its inside. So does one with a single flat opening (a block
//! without a bottom, standing on a floor), for ends outside its hull: what enters through the opening cannot leave through
//! the same plane. Any other blocker is a flat body of its own: a polygon with two sides.

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

    /// The solid that the members bound, with at most one flat opening; `None` where they bound none.
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
        if !open.is_empty() {
            let lid = lid(&open)?;
            let plane = Plane::of_polygon(&lid)?;
            let outside = corners.iter().any(|&c| plane.distance(c) > tolerance);
            if outside || lid.iter().any(|&c| plane.distance(c).abs() > tolerance) {
                return None;
            }
            let right = faces.len();
            faces.push(plane);
            edges.extend(open.iter().map(|&(from, to, left)| BodyEdge { from, to, left, right }));
        }
        // A flat patch with a lid of its own encloses nothing.
        let has_inside = faces.iter().all(|face| corners.iter().any(|&c| face.distance(c) < -tolerance));
        has_inside.then_some(Body { faces, edges, corners, centre, radius, parts, is_skin: false })
    }
}

/// The corners of the one loop that open edges make, as the missing face would run round it; `None` for anything else.
fn lid(open: &[(DVec3, DVec3, usize)]) -> Option<Vec<DVec3>> {
    let back: BTreeMap<Corner, DVec3> = open.iter().map(|&(from, to, _)| (key(to), from)).collect();
    if back.len() != open.len() {
        return None;
    }
    let start = open[0].0;
    let mut corners = vec![start];
    let mut at = *back.get(&key(start))?;
    while key(at) != key(start) {
        if corners.len() > open.len() {
            return None;
        }
        corners.push(at);
        at = *back.get(&key(at))?;
    }
    (corners.len() == open.len()).then_some(corners)
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
