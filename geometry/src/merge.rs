//! Coplanar neighbours joined into larger convex polygons: a wall given as a thousand squares blocks like one.
//!
//! What blocks light has no need of the faces' borders. Fewer blockers mean shorter lists, and edges inside a wall are
//! no shadow lines. Greedy: two polygons that share a whole edge are joined where their union is convex.

use crate::occluder::Occluder;
use crate::plane::PLANARITY;
use crate::polygon;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Corners where the border turns by less than this (radians) are dropped, and unions may bend inward by as much:
/// over an edge of length L the border moves by less than `STRAIGHTNESS` L, like a face's corners off its plane.
const STRAIGHTNESS: f64 = PLANARITY;

/// What blocks light in a scene of convex `pieces`, given as indices into `positions`: joined, pieces without area left out.
pub fn merged_occluders(pieces: Vec<Vec<u32>>, positions: &[DVec3]) -> Vec<Occluder> {
    let corners = |piece: Vec<u32>| piece.iter().map(|&k| positions[k as usize]).collect();
    merge_coplanar(pieces, positions).into_iter().filter_map(|piece| Occluder::new(corners(piece))).collect()
}

/// Joins convex polygons, given as indices into `positions`, where two share an edge, lie in one plane and have a convex
/// union. Polygons that look opposite ways are not joined. The order of the result follows the first piece of each.
pub fn merge_coplanar(polygons: Vec<Vec<u32>>, positions: &[DVec3]) -> Vec<Vec<u32>> {
    let mut alive: Vec<Option<Vec<u32>>> = polygons.into_iter().map(Some).collect();
    // Which polygon has the directed edge: its neighbour across has the reversed one.
    let mut owner: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (k, polygon) in alive.iter().enumerate() {
        directed_edges(polygon.iter().flatten()).for_each(|edge| {
            owner.entry(edge).or_insert(k);
        });
    }
    let mut pending: BTreeSet<usize> = (0..alive.len()).collect();
    while let Some(k) = pending.pop_first() {
        let Some(polygon) = alive[k].clone() else { continue };
        let joined = directed_edges(polygon.iter()).find_map(|(a, b)| {
            let other = *owner.get(&(b, a))?;
            let neighbour = alive[other].as_ref().filter(|_| other != k)?;
            join(&polygon, neighbour, positions).map(|union| (other, union))
        });
        let Some((other, union)) = joined else { continue };
        for gone in [k, other] {
            for edge in directed_edges(alive[gone].iter().flatten()).collect::<Vec<_>>() {
                if owner.get(&edge) == Some(&gone) {
                    owner.remove(&edge);
                }
            }
            alive[gone] = None;
        }
        let place = k.min(other);
        directed_edges(union.iter()).for_each(|edge| {
            owner.entry(edge).or_insert(place);
        });
        // The union's neighbours may now share a whole edge with it.
        for (a, b) in directed_edges(union.iter()) {
            pending.extend(owner.get(&(b, a)));
        }
        alive[place] = Some(union);
        pending.insert(place);
    }
    alive.into_iter().flatten().collect()
}

fn directed_edges<'a>(corners: impl Iterator<Item = &'a u32> + Clone) -> impl Iterator<Item = (u32, u32)> {
    let next = corners.clone().skip(1).chain(corners.clone().take(1));
    corners.zip(next).map(|(&a, &b)| (a, b)).collect::<Vec<_>>().into_iter()
}

/// The union of two polygons that share at least one edge (run through in opposite directions), if it is convex, planar
/// and without a hole.
fn join(p: &[u32], q: &[u32], positions: &[DVec3]) -> Option<Vec<u32>> {
    let at = |k: u32| positions[k as usize];
    let shared: BTreeSet<(u32, u32)> = directed_edges(q.iter()).map(|(a, b)| (b, a)).collect();
    let is_shared: Vec<bool> = directed_edges(p.iter()).map(|edge| shared.contains(&edge)).collect();
    // The shared edges must be one run: start behind its end.
    let n = p.len();
    let starts: Vec<usize> = (0..n).filter(|&k| !is_shared[k] && is_shared[(k + n - 1) % n]).collect();
    let &[start] = &starts[..] else { return None };
    let kept: Vec<u32> =
        (0..n).map(|k| (start + k) % n).take_while(|&k| !is_shared[k]).map(|k| p[k]).collect();
    let run_start = p[(start + kept.len()) % n];
    let from = q.iter().position(|&corner| corner == run_start)?;
    let others = q.len() - (n - kept.len());
    let union: Vec<u32> = kept.iter().copied().chain((0..others).map(|k| q[(from + k) % q.len()])).collect();

    let union = without_straight_corners(union, positions);
    let corners: Vec<DVec3> = union.iter().map(|&k| at(k)).collect();
    let pieces = [p, q].map(|piece| piece.iter().map(|&k| at(k)).collect::<Vec<_>>());
    let normal = polygon::vector_area(&pieces[0]).normalize_or_zero();
    let tolerance = PLANARITY * polygon::diameter(&corners);
    let flat = pieces[1].iter().chain(&pieces[0]).all(|&c| normal.dot(c - pieces[0][0]).abs() <= tolerance);
    let same_way = polygon::vector_area(&pieces[1]).dot(normal) > 0.0;
    let distinct = union.iter().collect::<BTreeSet<_>>().len() == union.len();
    (union.len() >= 3 && flat && same_way && distinct && polygon::is_convex(&corners, normal, STRAIGHTNESS))
        .then_some(union)
}

/// Drops corners at which the border goes straight on.
fn without_straight_corners(mut corners: Vec<u32>, positions: &[DVec3]) -> Vec<u32> {
    let mut k = 0;
    while corners.len() > 3 && k < corners.len() {
        let n = corners.len();
        let [a, b, c] =
            [corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]].map(|i| positions[i as usize]);
        let (before, after) = (b - a, c - b);
        let straight = before.cross(after).length() <= STRAIGHTNESS * before.length() * after.length()
            && before.dot(after) > 0.0;
        if straight {
            corners.remove(k);
            k = k.saturating_sub(1);
        } else {
            k += 1;
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An n x m grid of unit squares, some left out.
    fn grid(n: u32, m: u32, leave_out: &[(u32, u32)]) -> (Vec<Vec<u32>>, Vec<DVec3>) {
        let positions =
            (0..=m).flat_map(|y| (0..=n).map(move |x| DVec3::new(x.into(), y.into(), 0.0))).collect();
        let id = |x: u32, y: u32| y * (n + 1) + x;
        let squares =
            (0..m).flat_map(|y| (0..n).map(move |x| (x, y))).filter(|cell| !leave_out.contains(cell));
        (
            squares.map(|(x, y)| vec![id(x, y), id(x + 1, y), id(x + 1, y + 1), id(x, y + 1)]).collect(),
            positions,
        )
    }

    fn total_area(polygons: &[Vec<u32>], positions: &[DVec3]) -> f64 {
        polygons
            .iter()
            .map(|p| polygon::area(&p.iter().map(|&k| positions[k as usize]).collect::<Vec<_>>()))
            .sum()
    }

    #[test]
    fn a_grid_becomes_one_rectangle() {
        let (squares, positions) = grid(7, 5, &[]);
        let merged = merge_coplanar(squares, &positions);
        assert_eq!(merged.len(), 1);
        assert_eq!(merged[0].len(), 4);
        assert_eq!(total_area(&merged, &positions), 35.0);
    }

    #[test]
    fn a_hole_and_a_step_keep_their_area() {
        for leave_out in [vec![(2, 2)], vec![(6, 4)], vec![(0, 0), (3, 1), (3, 2)]] {
            let (squares, positions) = grid(7, 5, &leave_out);
            let merged = merge_coplanar(squares, &positions);
            assert!(merged.len() <= 8, "{}", merged.len());
            assert_eq!(total_area(&merged, &positions), 35.0 - leave_out.len() as f64);
        }
    }

    #[test]
    fn folded_and_opposite_neighbours_stay_apart() {
        let positions = [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            (1.0, 1.0, 0.0),
            (0.0, 1.0, 0.0),
            (2.0, 0.0, 0.1),
            (2.0, 1.0, 0.1),
        ]
        .map(|(x, y, z)| DVec3::new(x, y, z));
        let folded = vec![vec![0, 1, 2, 3], vec![1, 4, 5, 2]];
        assert_eq!(merge_coplanar(folded, &positions).len(), 2);
        let back_to_back = vec![vec![0, 1, 2, 3], vec![3, 2, 1, 0]];
        assert_eq!(merge_coplanar(back_to_back, &positions).len(), 2);
    }
}
