//! Meshes built in code, and the program run on them.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use assert_cmd::Command;
use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::matrix::Matrix;
use interchange::mesh::{Cluster, Mesh};
use interchange::provenance::Provenance;
use std::path::{Path, PathBuf};

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

pub fn room_with_box() -> Vec<Vec<[f64; 3]>> {
    let mut polygons = inward_cube(0.0, 1.0);
    polygons.extend(inward_cube(0.25, 0.75).into_iter().map(|mut face| {
        face.reverse();
        face
    }));
    polygons
}

pub fn compute(
    folder: &Path,
    polygons: &[Vec<[f64; 3]>],
    flags: &[&str],
) -> (PathBuf, assert_cmd::assert::Assert) {
    compute_mesh(folder, &mesh_of(polygons), flags)
}

pub fn compute_mesh(folder: &Path, mesh: &Mesh, flags: &[&str]) -> (PathBuf, assert_cmd::assert::Assert) {
    let (path, matrix) = (folder.join("s.mesh"), folder.join("s.ff"));
    mesh.write(&path, Provenance::new("test", "1")).unwrap();
    let mut command = Command::cargo_bin("formfactor-tool").unwrap();
    let run = command.arg("compute").arg(&path).arg("-o").arg(&matrix).args(flags).assert();
    (matrix, run)
}

pub fn entries(path: &Path) -> Vec<Vec<f64>> {
    let matrix = Matrix::open(path).unwrap();
    let n = matrix.element_count();
    let mut s = vec![vec![0.0; n]; n];
    matrix
        .for_each(|i, j, value| {
            s[i][j] = value;
            s[j][i] = value;
        })
        .unwrap();
    s
}

/// Every square cut into n x n, all parts faces of their own.
pub fn subdivided(squares: &[Vec<[f64; 3]>], n: usize) -> Vec<Vec<[f64; 3]>> {
    let mut parts = Vec::new();
    for square in squares {
        let at = |i: usize, j: usize| {
            let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
            [0, 1, 2]
                .map(|k| square[0][k] + s * (square[1][k] - square[0][k]) + t * (square[3][k] - square[0][k]))
        };
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            parts.push(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    parts
}

/// A cluster tree by halving, down to `largest` elements a leaf.
pub fn cluster(mesh: &mut Mesh, largest: u32) {
    let count = mesh.element_count() as u32;
    mesh.clusters = vec![Cluster { start: 0, end: count, first_child: 0, second_child: 0 }];
    let mut next = 0;
    while next < mesh.clusters.len() {
        let Cluster { start, end, .. } = mesh.clusters[next];
        if end - start > largest {
            let (middle, first) = ((start + end) / 2, mesh.clusters.len() as u32);
            mesh.clusters.push(Cluster { start, end: middle, first_child: 0, second_child: 0 });
            mesh.clusters.push(Cluster { start: middle, end, first_child: 0, second_child: 0 });
            mesh.clusters[next] = Cluster { start, end, first_child: first, second_child: first + 1 };
        }
        next += 1;
    }
}
