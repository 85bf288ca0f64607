//! The mesh as it is drawn. Interpolation may want smaller or simpler pieces than the solution has; nodes are
//! gathered where they are wanted, and the solution keeps its elements.

use interchange::ids::{NodeId, VertexId};
use interchange::mesh::{Cluster, Mesh};
use interchange::ragged::Ragged;

/// Corners of the four facets of a triangle with nodes 0 to 2 at its corners and 3 to 5 in the middle of the edges
/// 0-1, 1-2 and 2-0.
const FACETS: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// The elements that were solved.
    Elements,
    /// Every six-node triangle as four triangles between its corners and mid-edge nodes: linear over half the size.
    Facets,
    /// Every polygon as a fan of triangles: curved interpolation cuts them where it must.
    Triangles,
}

/// The mesh as it is drawn, and the element each of its facets comes from.
pub fn drawn_mesh(mesh: &Mesh, how: Drawn) -> (Mesh, Vec<u32>) {
    let mut drawn = Mesh {
        elements: Ragged::default(),
        element_nodes: Ragged::default(),
        element_faces: Vec::new(),
        element_sides: Vec::new(),
        clusters: Vec::new(),
        ..mesh.clone()
    };
    let mut source_of = Vec::new();
    for (k, (corners, nodes)) in mesh.elements.rows().zip(mesh.element_nodes.rows()).enumerate() {
        let mut push = |corners: Vec<VertexId>, nodes: Vec<NodeId>| {
            drawn.elements.push(corners);
            drawn.element_nodes.push(nodes);
            drawn.element_faces.push(mesh.element_faces[k]);
            drawn.element_sides.push(mesh.element_sides[k]);
            source_of.push(k as u32);
        };
        if how == Drawn::Facets && corners.len() == 3 && nodes.len() == 6 {
            for facet in FACETS {
                let nodes = facet.map(|n| nodes[n]);
                push(nodes.map(|node| mesh.node_vertices[node.index()]).to_vec(), nodes.to_vec());
            }
        } else if how == Drawn::Triangles {
            for c in 2..corners.len() {
                push(vec![corners[0], corners[c - 1], corners[c]], vec![nodes[0], nodes[c - 1], nodes[c]]);
            }
        } else {
            push(corners.to_vec(), nodes[..corners.len()].to_vec());
        }
    }
    let end = drawn.elements.len() as u32;
    drawn.clusters.push(Cluster { start: 0, end, first_child: 0, second_child: 0 });
    (drawn, source_of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::polygon;
    use glam::DVec3;
    use interchange::ids::{ElementId, FaceId};

    #[test]
    fn facets_tile_a_six_node_triangle_and_look_the_same_way() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let middles = [[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        let ids: Vec<u32> = (0..6).collect();
        let mut mesh = Mesh { vertices: corners.into_iter().chain(middles).collect(), ..Mesh::default() };
        mesh.elements.push(ids[..3].iter().map(|&v| VertexId(v)));
        mesh.element_nodes.push(ids.iter().map(|&n| NodeId(n)));
        mesh.node_vertices = ids.iter().map(|&v| VertexId(v)).collect();
        mesh.element_faces.push(FaceId(0));
        mesh.element_sides.push(0);
        let (drawn, source_of) = drawn_mesh(&mesh, Drawn::Facets);
        assert_eq!((drawn.element_count(), source_of), (4, vec![0; 4]));
        for facet in drawn.element_ids() {
            assert_eq!(polygon::vector_area(&drawn.element_corners(facet)), DVec3::new(0.0, 0.0, 1.0));
        }
        assert_eq!(drawn.element_corners(ElementId(3))[1], DVec3::new(1.0, 2.0, 0.0));
    }

    #[test]
    fn polygons_become_fans_and_elements_stay() {
        let mut mesh = Mesh { vertices: vec![[0.0; 3]; 5], ..Mesh::default() };
        mesh.elements.push((0..5).map(VertexId));
        mesh.element_nodes.push((0..5).map(NodeId));
        mesh.element_faces.push(FaceId(0));
        mesh.element_sides.push(0);
        let (fan, source_of) = drawn_mesh(&mesh, Drawn::Triangles);
        let corners: Vec<u32> = fan.elements.values().iter().map(|v| v.0).collect();
        assert_eq!((corners, source_of), (vec![0, 1, 2, 0, 2, 3, 0, 3, 4], vec![0; 3]));
        assert_eq!(drawn_mesh(&mesh, Drawn::Elements).0.elements, mesh.elements);
    }
}
