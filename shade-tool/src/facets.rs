//! The mesh as it is drawn: every six-node triangle as four triangles between its corners and mid-edge nodes, so that
//! interpolation is linear over half the element's size at the cost of gathering only; the solution keeps its elements.

use interchange::ids::{NodeId, VertexId};
use interchange::mesh::{Cluster, Mesh};
use interchange::ragged::Ragged;

/// Corners of the four facets of a triangle with nodes 0 to 2 at its corners and 3 to 5 in the middle of the edges
/// 0-1, 1-2 and 2-0.
const FACETS: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// The mesh with its six-node triangles cut into facets; elements without mid-edge nodes stay as they are.
pub fn drawn_mesh(mesh: &Mesh) -> Mesh {
    let mut drawn = Mesh {
        elements: Ragged::default(),
        element_nodes: Ragged::default(),
        element_faces: Vec::new(),
        element_sides: Vec::new(),
        clusters: Vec::new(),
        ..mesh.clone()
    };
    for (k, (corners, nodes)) in mesh.elements.rows().zip(mesh.element_nodes.rows()).enumerate() {
        let six = corners.len() == 3 && nodes.len() == 6;
        let mut push = |corners: Vec<VertexId>, nodes: Vec<NodeId>| {
            drawn.elements.push(corners);
            drawn.element_nodes.push(nodes);
            drawn.element_faces.push(mesh.element_faces[k]);
            drawn.element_sides.push(mesh.element_sides[k]);
        };
        if six {
            for facet in FACETS {
                let nodes = facet.map(|n| nodes[n]);
                push(nodes.map(|node| mesh.node_vertices[node.index()]).to_vec(), nodes.to_vec());
            }
        } else {
            push(corners.to_vec(), nodes[..corners.len()].to_vec());
        }
    }
    let end = drawn.elements.len() as u32;
    drawn.clusters.push(Cluster { start: 0, end, first_child: 0, second_child: 0 });
    drawn
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
        let drawn = drawn_mesh(&mesh);
        assert_eq!(drawn.element_count(), 4);
        for facet in drawn.element_ids() {
            assert_eq!(polygon::vector_area(&drawn.element_corners(facet)), DVec3::new(0.0, 0.0, 1.0));
        }
        assert_eq!(drawn.element_corners(ElementId(3))[1], DVec3::new(1.0, 2.0, 0.0));
    }
}
