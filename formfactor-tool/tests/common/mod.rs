//! Meshes built in code.
#![allow(dead_code)]

use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::mesh::{Cluster, Mesh};

/// The six squares of an axis-aligned cube, fronts inward.
pub fn inward_cube(low: f64, high: f64) -> Vec<Vec<[f64; 3]>> {
    let (a, b) = (low, high);
    vec![
        vec![[a, a, a], [b, a, a], [b, b, a], [a, b, a]],
        vec![[a, b, b], [b, b, b], [b, a, b], [a, a, b]],
        vec![[a, a, a], [a, b, a], [a, b, b], [a, a, b]],
        vec![[b, a, b], [b, b, b], [b, b, a], [b, a, a]],
        vec![[a, a, a], [a, a, b], [b, a, b], [b, a, a]],
        vec![[b, b, a], [b, b, b], [a, b, b], [a, b, a]],
    ]
}

/// Every polygon an element, a face and an occluder; one cluster.
pub fn mesh_of(polygons: &[Vec<[f64; 3]>]) -> Mesh {
    let mut mesh = Mesh { groups: vec!["g".into()], materials: vec!["m".into()], ..Mesh::default() };
    for (k, polygon) in polygons.iter().enumerate() {
        let first = mesh.vertices.len();
        mesh.vertices.extend(polygon);
        let corners: Vec<VertexId> = (first..first + polygon.len()).map(VertexId::new).collect();
        mesh.elements.push(corners.iter().copied());
        mesh.element_nodes.push(corners.iter().map(|v| NodeId(v.0)));
        mesh.node_vertices.extend(&corners);
        mesh.faces.push(corners.iter().copied());
        mesh.occluders.push(corners.iter().copied());
        mesh.element_faces.push(FaceId::new(k));
        mesh.occluder_faces.push(FaceId::new(k));
        mesh.element_sides.push(0);
        mesh.face_inputs.push(k as u32);
        mesh.face_groups.push(GroupId(0));
        mesh.face_materials.push(MaterialId(0));
        mesh.face_flags.push(0);
    }
    mesh.input_face_count = polygons.len() as u32;
    mesh.clusters.push(Cluster { start: 0, end: polygons.len() as u32, first_child: 0, second_child: 0 });
    mesh
}

/// A unit room with a box in its middle.
pub fn room_with_box() -> Vec<Vec<[f64; 3]>> {
    let mut polygons = inward_cube(0.0, 1.0);
    polygons.extend(inward_cube(0.25, 0.75).into_iter().map(|mut face| {
        face.reverse();
        face
    }));
    polygons
}

/// Each polygon, a parallelogram, cut into n x n.
pub fn divided(polygons: &[Vec<[f64; 3]>], n: usize) -> Vec<Vec<[f64; 3]>> {
    let mut parts = Vec::new();
    for corners in polygons {
        let place = |u: usize, v: usize| {
            let (u, v) = (u as f64 / n as f64, v as f64 / n as f64);
            let along = |k: usize| {
                let (a, b, d) = (corners[0][k], corners[1][k], corners[3][k]);
                a + u * (b - a) + v * (d - a)
            };
            [along(0), along(1), along(2)]
        };
        for u in 0..n {
            for v in 0..n {
                parts.push(vec![place(u, v), place(u + 1, v), place(u + 1, v + 1), place(u, v + 1)]);
            }
        }
    }
    parts
}

/// A mesh with a leaf cluster for every `leaf` elements, in a chain.
pub fn clustered(polygons: &[Vec<[f64; 3]>], leaf: u32) -> Mesh {
    let mut mesh = mesh_of(polygons);
    mesh.clusters.clear();
    let (mut start, end) = (0, polygons.len() as u32);
    while start + leaf < end {
        let own = mesh.clusters.len() as u32;
        mesh.clusters.push(Cluster { start, end, first_child: own + 1, second_child: own + 2 });
        mesh.clusters.push(Cluster { start, end: start + leaf, first_child: 0, second_child: 0 });
        start += leaf;
    }
    mesh.clusters.push(Cluster { start, end, first_child: 0, second_child: 0 });
    mesh
}

/// A mesh of faces that block, and elements on them with their faces; a leaf cluster for every `leaf` elements, in a chain.
pub fn meshed(faces: &[Vec<[f64; 3]>], elements: &[(usize, Vec<[f64; 3]>)], leaf: u32) -> Mesh {
    let blocking = mesh_of(faces);
    let polygons: Vec<Vec<[f64; 3]>> = elements.iter().map(|(_, polygon)| polygon.clone()).collect();
    let mut mesh = clustered(&polygons, leaf);
    let offset = mesh.vertices.len();
    mesh.vertices.extend(&blocking.vertices);
    let moved = |corners: &[VertexId]| -> Vec<VertexId> {
        corners.iter().map(|v| VertexId::new(offset + v.index())).collect()
    };
    (mesh.faces, mesh.occluders) = Default::default();
    for corners in blocking.faces.rows() {
        mesh.faces.push(moved(corners));
        mesh.occluders.push(moved(corners));
    }
    mesh.occluder_faces = blocking.occluder_faces;
    mesh.face_inputs = blocking.face_inputs;
    mesh.face_groups = blocking.face_groups;
    mesh.face_materials = blocking.face_materials;
    mesh.face_flags = blocking.face_flags;
    mesh.input_face_count = faces.len() as u32;
    mesh.element_faces = elements.iter().map(|(face, _)| FaceId::new(*face)).collect();
    mesh
}
