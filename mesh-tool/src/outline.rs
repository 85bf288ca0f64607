//! Regions of a triangulation and the rings around them.

use crate::planar::PlanarGraph;
use crate::sheets::root;
use crate::triangulation::Triangulation;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Sets of triangles of one class that are connected across edges, in the order of their first triangles. Triangles
/// without a class are in none.
pub fn regions<C: PartialEq>(
    triangulation: &Triangulation,
    class: impl Fn(usize) -> Option<C>,
) -> Vec<Vec<usize>> {
    let classes: Vec<Option<C>> = (0..triangulation.triangles.len()).map(class).collect();
    let mut seen = vec![false; classes.len()];
    let mut regions = Vec::new();
    for start in 0..classes.len() {
        if seen[start] || classes[start].is_none() {
            continue;
        }
        seen[start] = true;
        let (mut region, mut next) = (vec![start], 0);
        while next < region.len() {
            let neighbours = triangulation.triangles[region[next]].neighbours;
            next += 1;
            for neighbour in neighbours.into_iter().flatten().map(|n| n as usize) {
                if !seen[neighbour] && classes[neighbour] == classes[start] {
                    seen[neighbour] = true;
                    region.push(neighbour);
                }
            }
        }
        regions.push(region);
    }
    regions
}

/// The ring around triangles that are connected across edges, counter-clockwise; holes are joined to it by seams that
/// are run along there and back.
pub fn ring(graph: &PlanarGraph, triangulation: &Triangulation, region: &[usize]) -> Vec<u32> {
    let inside: HashSet<usize> = region.iter().copied().collect();
    let (mut rim, mut inner) = (Vec::new(), Vec::new());
    for &t in region {
        let triangle = &triangulation.triangles[t];
        for k in 0..3 {
            let edge = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
            if triangle.neighbours[k].is_some_and(|n| inside.contains(&(n as usize))) {
                if edge.0 < edge.1 {
                    inner.push(edge);
                }
            } else {
                rim.push(edge);
            }
        }
    }
    let mut edges = rim.clone();
    for (a, b) in bridges(graph, &rim, inner) {
        edges.extend([(a, b), (b, a)]);
    }
    tour(graph, &edges, rim.first().copied())
}

/// Edges that join holes to the rim: a shortest spanning tree over the parts of the rim, without its dead ends.
fn bridges(graph: &PlanarGraph, rim: &[(u32, u32)], mut inner: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    let position = |point: u32| graph.points[point as usize].uv;
    let mut parent: Vec<usize> = (0..graph.points.len()).collect();
    let mut join = |a: u32, b: u32| {
        let (a, b) = (root(&mut parent, a as usize), root(&mut parent, b as usize));
        parent[a.max(b)] = a.min(b);
        a != b
    };
    for &(a, b) in rim {
        join(a, b);
    }
    let length = |&(a, b): &(u32, u32)| position(a).distance(position(b));
    inner.sort_by(|a, b| length(a).total_cmp(&length(b)).then(a.cmp(b)));
    let mut bridges: Vec<(u32, u32)> = inner.into_iter().filter(|&(a, b)| join(a, b)).collect();
    let on_rim: HashSet<u32> = rim.iter().map(|edge| edge.0).collect();
    loop {
        let mut degree: HashMap<u32, usize> = HashMap::new();
        for &(a, b) in &bridges {
            *degree.entry(a).or_default() += 1;
            *degree.entry(b).or_default() += 1;
        }
        let dead = |p: &u32| degree[p] == 1 && !on_rim.contains(p);
        let before = bridges.len();
        bridges.retain(|(a, b)| !dead(a) && !dead(b));
        if bridges.len() == before {
            return bridges;
        }
    }
}

/// Runs along directed edges, keeping what they enclose on the left: at each point the next edge clockwise from the one
/// it came by.
fn tour(graph: &PlanarGraph, edges: &[(u32, u32)], start: Option<(u32, u32)>) -> Vec<u32> {
    let angle = |(a, b): (u32, u32)| {
        let direction = graph.points[b as usize].uv - graph.points[a as usize].uv;
        direction.y.atan2(direction.x)
    };
    let mut leaving: BTreeMap<u32, Vec<(f64, u32)>> = BTreeMap::new();
    for &(a, b) in edges {
        leaving.entry(a).or_default().push((angle((a, b)), b));
    }
    for around in leaving.values_mut() {
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let Some(start) = start else { return Vec::new() };
    let (mut at, mut ring) = (start, Vec::new());
    for _ in 0..edges.len() {
        ring.push(at.0);
        let back = angle((at.1, at.0));
        let Some(around) = leaving.get(&at.1) else { break };
        let before = around.iter().rev().find(|(a, to)| *a < back && *to != at.0);
        // The last in the circle where none is before; back the way it came where there is no other.
        let next = before.or_else(|| around.iter().rev().find(|(_, to)| *to != at.0)).or(around.first());
        let Some(&(_, next)) = next else { break };
        at = (at.1, next);
        if at == start {
            break;
        }
    }
    ring
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::planar::{Border, Point};
    use glam::DVec2;

    fn square(graph: &mut PlanarGraph, low: DVec2, high: DVec2, sheet: u32) {
        let corners = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)].map(|(x, y)| {
            let uv = DVec2::new(x, y);
            graph.point(Point { uv, position: uv.extend(0.0), place: None })
        });
        graph.ring(&corners, Border { sheet, forward: true });
    }

    #[test]
    fn square_with_three_holes_has_one_ring_of_its_area() {
        let mut graph = PlanarGraph::default();
        square(&mut graph, DVec2::ZERO, DVec2::splat(8.0), 0);
        for (k, low) in [(1.0, 1.0), (5.0, 1.0), (3.0, 5.0)].into_iter().enumerate() {
            let low = DVec2::new(low.0, low.1);
            square(&mut graph, low, low + DVec2::splat(1.5), 1 + k as u32);
        }
        let (graph, triangulation) = graph.arrange(1e-9).unwrap();
        let only_first = |t: usize| triangulation.sheets(t).eq([(0, 1)]).then_some(());
        let found = regions(&triangulation, only_first);
        assert_eq!(found.len(), 1);
        let ring = ring(&graph, &triangulation, &found[0]);
        let at = |k: usize| graph.points[ring[k % ring.len()] as usize].uv;
        let twice: f64 = (0..ring.len()).map(|k| at(k).perp_dot(at(k + 1))).sum();
        assert!((0.5 * twice - (64.0 - 3.0 * 2.25)).abs() < 1e-12, "{}", 0.5 * twice);
        // Four corners each, and the seams there and back.
        assert_eq!(ring.len(), 16 + 6);
    }
}
