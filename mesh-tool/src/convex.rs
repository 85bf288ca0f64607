//! Convex pieces of a region made of triangles: neighbours are joined while the result stays convex
//! (Hertel & Mehlhorn 1983: at most two pieces per reflex corner and one more).

use crate::frame::{Frame, turn};
use crate::places::Places;
use crate::planar::{Border, PlanarGraph};
use crate::triangulation::{RESOLUTION, Triangulation, Trouble};
use glam::DVec2;
use std::collections::HashMap;

/// A corner may turn the wrong way by this many radians and still count as straight: far below what the clipping
/// of light against a piece can tell, far above the rounding of the coordinates.
const STRAIGHT: f64 = 1e-9;

/// Rings of points, counter-clockwise, that cover the triangles `inside`; no two are joined across an edge that
/// is a `seam`. Points where a ring runs straight on are left out unless `keep` wants them.
pub fn convex_pieces(
    frame: &Frame,
    graph: &PlanarGraph,
    triangulation: &Triangulation,
    inside: impl Fn(usize) -> bool,
    seam: impl Fn(u32) -> bool,
    keep: impl Fn(u32) -> bool,
) -> Vec<Vec<u32>> {
    // Not the stepped coordinates of the graph: between close points a step is a bend.
    let position = |point: u32| frame.flatten(graph.points[point as usize].position);
    let mut rings: Vec<Vec<u32>> = Vec::new();
    let mut owner: HashMap<(u32, u32), usize> = HashMap::new();
    let mut diagonals = Vec::new();
    for t in (0..triangulation.triangles.len()).filter(|&t| inside(t)) {
        let triangle = &triangulation.triangles[t];
        for k in 0..3 {
            let (a, b) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
            owner.insert((a, b), rings.len());
            let joinable = triangle.constraints[k].is_none_or(|edge| !seam(edge));
            if joinable && a < b && triangle.neighbours[k].is_some_and(|n| inside(n as usize)) {
                diagonals.push((a, b));
            }
        }
        rings.push(triangle.corners.to_vec());
    }
    // The order decides how many pieces remain: try both, the longest first and the shortest first.
    let length = |&(a, b): &(u32, u32)| position(a).distance(position(b));
    diagonals.sort_by(|a, b| length(b).total_cmp(&length(a)).then(a.cmp(b)));
    let longest_first = join(rings.clone(), owner.clone(), diagonals.iter().copied(), position);
    let shortest_first = join(rings, owner, diagonals.iter().rev().copied(), position);
    let fewer = if shortest_first.len() < longest_first.len() { shortest_first } else { longest_first };
    fewer.into_iter().map(|ring| without_straight_corners(ring, &position, &keep)).collect()
}

/// Joins rings across `diagonals`, in this order, wherever the result is convex. `owner` knows the ring on the left
/// of each directed edge.
fn join(
    mut rings: Vec<Vec<u32>>,
    mut owner: HashMap<(u32, u32), usize>,
    diagonals: impl Iterator<Item = (u32, u32)>,
    position: impl Fn(u32) -> DVec2,
) -> Vec<Vec<u32>> {
    for (a, b) in diagonals {
        let (Some(&left), Some(&right)) = (owner.get(&(a, b)), owner.get(&(b, a))) else { continue };
        if left == right {
            continue;
        }
        let ring = joined(&rings[left], &rings[right], a, b);
        if !is_convex(&ring, &position) {
            continue;
        }
        for (k, &from) in ring.iter().enumerate() {
            owner.insert((from, ring[(k + 1) % ring.len()]), left);
        }
        owner.remove(&(a, b));
        owner.remove(&(b, a));
        rings[left] = ring;
        rings[right].clear();
    }
    rings.retain(|ring| !ring.is_empty());
    rings
}

/// Convex pieces of one polygon, as rings of its places. `corners` runs counter-clockwise in the plane of `frame`.
pub fn pieces_of_polygon(frame: &Frame, corners: &[u32], places: &Places) -> Result<Vec<Vec<u32>>, Trouble> {
    let mut graph = PlanarGraph::default();
    let ring: Vec<u32> =
        corners.iter().map(|&place| graph.corner(frame, place, places.position(place))).collect();
    graph.ring(&ring, Border { sheet: 0, forward: true });
    // As fine as can be: a border that is bent where it passes a corner closely would not keep its area.
    let fine = graph.clone().arrange(RESOLUTION);
    let (graph, triangulation) = fine.or_else(|_| graph.arrange(places.tolerance() / frame.size))?;
    let rings = convex_pieces(
        frame,
        &graph,
        &triangulation,
        |t| triangulation.winding(t, 0) > 0,
        |_| false,
        |_| true,
    );
    let places_of = |ring: Vec<u32>| -> Option<Vec<u32>> {
        ring.into_iter().map(|p| graph.points[p as usize].place).collect()
    };
    rings.into_iter().map(|ring| places_of(ring).ok_or(Trouble::Crowded)).collect()
}

/// The ring around two rings that share the edge from `a` to `b`, which runs forward in `left`.
fn joined(left: &[u32], right: &[u32], a: u32, b: u32) -> Vec<u32> {
    let from = |ring: &[u32], start: (u32, u32)| -> Vec<u32> {
        let n = ring.len();
        let at = (0..n).find(|&k| (ring[k], ring[(k + 1) % n]) == start).unwrap_or(0);
        (0..n).map(|k| ring[(at + 1 + k) % n]).collect()
    };
    // From b around left to a, then from a around right to b.
    let (mut ring, rest) = (from(left, (a, b)), from(right, (b, a)));
    ring.extend(&rest[1..rest.len() - 1]);
    // Rings that shared further edges leave spikes there and back.
    loop {
        let n = ring.len();
        let Some(k) = (0..n).find(|&k| n > 2 && ring[k] == ring[(k + 2) % n]) else { return ring };
        let drop = [(k + 1) % n, (k + 2) % n];
        ring = (0..n).filter(|k| !drop.contains(k)).map(|k| ring[k]).collect();
    }
}

fn is_convex(ring: &[u32], position: impl Fn(u32) -> DVec2) -> bool {
    let n = ring.len();
    n >= 3
        && (0..n).all(|k| {
            let [a, b, c] = [0, 1, 2].map(|step| position(ring[(k + step) % n]));
            turn(a, b, c) >= -STRAIGHT * a.distance(b) * b.distance(c)
                && (b - a).dot(c - b) > -a.distance(b) * b.distance(c) * (1.0 - STRAIGHT)
        })
}

fn without_straight_corners(
    mut ring: Vec<u32>,
    position: &impl Fn(u32) -> DVec2,
    keep: &impl Fn(u32) -> bool,
) -> Vec<u32> {
    let mut k = 0;
    while k < ring.len() && ring.len() > 3 {
        let n = ring.len();
        let [a, b, c] = [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]].map(position);
        if !keep(ring[k]) && turn(a, b, c).abs() <= STRAIGHT * a.distance(b) * b.distance(c) {
            ring.remove(k);
        } else {
            k += 1;
        }
    }
    ring
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use geometry::plane::Plane;
    use geometry::polygon;
    use glam::DVec3;

    fn pieces(corners: &[(f64, f64)]) -> (Vec<Vec<DVec3>>, f64) {
        let corners: Vec<DVec3> = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let mut places = Places::new(DVec3::ZERO, 1e-9);
        let ids: Vec<u32> = corners.iter().map(|&c| places.insert(c)).collect();
        let plane = Plane { normal: DVec3::Z, origin: DVec3::ZERO };
        let frame = Frame::new(&plane, [corners.as_slice()].into_iter());
        let pieces = pieces_of_polygon(&frame, &ids, &places).unwrap();
        (pieces.iter().map(|piece| places.corners(piece)).collect(), polygon::area(&corners))
    }

    #[test]
    fn ell_star_and_keyhole_are_covered_by_convex_pieces() {
        let ell = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
        let star: Vec<(f64, f64)> = (0..10)
            .map(|k| {
                let (angle, radius) =
                    (std::f64::consts::PI * f64::from(k) / 5.0, if k % 2 == 0 { 1.0 } else { 0.4 });
                (radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        let keyhole = [
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (0.0, 3.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
        ];
        for (corners, most) in [(&ell[..], 3), (&star[..], 11), (&keyhole[..], 9)] {
            let (pieces, area) = pieces(corners);
            assert!(pieces.len() <= most, "{} pieces", pieces.len());
            let sum: f64 = pieces.iter().map(|piece| polygon::area(piece)).sum();
            assert!((sum - area).abs() <= 1e-14 * area, "{sum} against {area}");
            assert!(pieces.iter().all(|piece| polygon::is_convex(piece, DVec3::Z, 1e-9)));
        }
    }
}
