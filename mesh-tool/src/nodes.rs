//! Nodes: the places radiosity is interpolated from. Walking around a vertex from element to element across shared
//! edges that carry no value discontinuity stays at one node; a discontinuity, a border to another material and a
//! bend of the surface each start another.

use crate::sheets::root;
use interchange::ids::{NodeId, VertexId};
use interchange::ragged::Ragged;
use std::collections::HashMap;

/// An element in its final place.
#[derive(Debug, Clone)]
pub struct Element {
    /// Vertices, counter-clockwise from its front.
    pub corners: Vec<u32>,
    /// For each edge (from corner k to k + 1) whether a value discontinuity runs along it.
    pub seams: Vec<bool>,
    /// Face.
    pub face: u32,
    /// 0 front, 1 back of a two-sided face.
    pub side: u32,
    /// Layer and material: radiosity is continuous only within one surface.
    pub surface: (u32, u32),
}

/// Surface and ends of an edge, the smaller one first.
type SurfaceEdge = ((u32, u32), u32, u32);

/// Nodes of some elements.
#[derive(Debug, Default)]
pub struct Nodes {
    /// Per element: one per corner, then, where asked for, one per edge.
    pub of_elements: Ragged<NodeId>,
    /// Vertex of each node.
    pub vertices: Vec<VertexId>,
}

/// Numbers the nodes. Where `middles` are given (vertex of each edge of each element), edges get nodes too.
pub fn number(elements: &[Element], middles: Option<&[Vec<u32>]>) -> Nodes {
    let per_corner = if middles.is_some() { 2 } else { 1 };
    let starts: Vec<usize> = elements
        .iter()
        .scan(0, |at, element| {
            let start = *at;
            *at += per_corner * element.corners.len();
            Some(start)
        })
        .collect();
    let total = elements.iter().map(|element| per_corner * element.corners.len()).sum();
    let mut parent: Vec<usize> = (0..total).collect();
    let mut join = |a: usize, b: usize| {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b)] = a.min(b);
    };

    // Join the corners, and the middles, of elements that share an edge.
    let mut edges: HashMap<SurfaceEdge, (usize, usize)> = HashMap::new();
    for (e, element) in elements.iter().enumerate() {
        let n = element.corners.len();
        for k in (0..n).filter(|&k| !element.seams[k]) {
            let (a, b) = (element.corners[k], element.corners[(k + 1) % n]);
            let Some(&(other, l)) = edges.get(&(element.surface, a.min(b), a.max(b))) else {
                edges.insert((element.surface, a.min(b), a.max(b)), (e, k));
                continue;
            };
            let m = elements[other].corners.len();
            let (own, others) = ([k, (k + 1) % n], [l, (l + 1) % m]);
            for (own, b) in own.into_iter().zip([a, b]) {
                let same = others.into_iter().find(|&l| elements[other].corners[l] == b);
                if let Some(l) = same {
                    join(starts[e] + own, starts[other] + l);
                }
            }
            if middles.is_some() {
                join(starts[e] + n + k, starts[other] + m + l);
            }
        }
    }

    // Number them in the order in which the elements name them.
    let mut nodes = Nodes::default();
    let mut number = vec![None; total];
    for (e, element) in elements.iter().enumerate() {
        let n = element.corners.len();
        let row: Vec<NodeId> = (0..per_corner * n)
            .map(|slot| {
                let vertex = match middles {
                    Some(middles) if slot >= n => middles[e][slot - n],
                    _ => element.corners[slot],
                };
                *number[root(&mut parent, starts[e] + slot)].get_or_insert_with(|| {
                    nodes.vertices.push(VertexId(vertex));
                    NodeId::new(nodes.vertices.len() - 1)
                })
            })
            .collect();
        nodes.of_elements.push(row);
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element(corners: [u32; 3], seams: [bool; 3], material: u32) -> Element {
        Element { corners: corners.to_vec(), seams: seams.to_vec(), face: 0, side: 0, surface: (0, material) }
    }

    #[test]
    fn seams_and_materials_part_nodes_and_walking_around_their_end_joins_them() {
        // Two triangles across the edge 1-2.
        let pair = |seam: bool, material: u32| {
            let elements = [
                element([0, 1, 2], [false, seam, false], 0),
                element([3, 2, 1], [false, seam, false], material),
            ];
            number(&elements, None).vertices.len()
        };
        assert_eq!(pair(false, 0), 4);
        assert_eq!(pair(true, 0), 6);
        assert_eq!(pair(false, 1), 6);
        // A fan of four around vertex 0 with a seam on the edge 0-1 only: one node at 0, two at 1.
        let fan = [
            element([0, 1, 2], [true, false, false], 0),
            element([0, 2, 3], [false; 3], 0),
            element([0, 3, 4], [false; 3], 0),
            element([0, 4, 1], [false, false, true], 0),
        ];
        let nodes = number(&fan, None);
        assert_eq!(nodes.vertices.len(), 6);
        assert_eq!(nodes.vertices.iter().filter(|v| v.0 == 0).count(), 1);
        assert_eq!(nodes.vertices.iter().filter(|v| v.0 == 1).count(), 2);
    }

    #[test]
    fn middles_are_shared_across_an_edge() {
        let elements = [element([0, 1, 2], [false; 3], 0), element([2, 1, 3], [false; 3], 0)];
        let middles = [vec![4, 5, 6], vec![5, 7, 8]];
        let nodes = number(&elements, Some(&middles));
        assert_eq!(nodes.vertices.len(), 9);
        assert_eq!(nodes.of_elements.row(0)[4], nodes.of_elements.row(1)[3]);
    }
}
