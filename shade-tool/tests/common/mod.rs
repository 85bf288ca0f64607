//! What the tests of the program share.
#![allow(clippy::unwrap_used, dead_code)]

use assert_cmd::Command;
use interchange::digest::Digest;
use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::materials::{Material, MaterialTable};
use interchange::mesh::{Cluster, Mesh};
use interchange::provenance::Provenance;
use interchange::solution::{Origins, Solution};
use std::path::Path;
use std::process::Output;

/// The unit cube with inward fronts, one element to a wall; the ceiling emits.
pub fn cube() -> Mesh {
    let mut mesh = Mesh {
        vertices: (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(f64::from)).collect(),
        groups: vec!["walls".into()],
        materials: vec!["white".into(), "lamp".into()],
        clusters: vec![Cluster { start: 0, end: 6, first_child: 0, second_child: 0 }],
        input_face_count: 6,
        ..Mesh::default()
    };
    let walls = [[0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3], [0, 1, 3, 2], [4, 6, 7, 5]];
    for (face, wall) in walls.into_iter().enumerate() {
        let corners = wall.map(VertexId);
        mesh.elements.push(corners);
        mesh.element_nodes.push((0..4).map(|k| NodeId::new(4 * face + k)));
        mesh.node_vertices.extend(corners);
        mesh.element_faces.push(FaceId::new(face));
        mesh.element_sides.push(0);
        mesh.faces.push(corners);
        mesh.occluders.push(corners);
        mesh.occluder_faces.push(FaceId::new(face));
        mesh.face_inputs.push(face as u32);
        mesh.face_groups.push(GroupId(0));
        mesh.face_materials.push(MaterialId(u32::from(face == 1)));
        mesh.face_flags.push(0);
    }
    mesh
}

/// A folder with `s.mesh`, `s.materials` and `s.sol`: radiosity 1, 2, 4 everywhere, in balance with the materials.
pub fn furnace() -> tempfile::TempDir {
    furnace_of(cube())
}

/// The same with another mesh of six elements and two materials.
pub fn furnace_of(mesh: Mesh) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let written = |tool: &str| Provenance::new(tool, "test");
    mesh.write(&at("s.mesh"), written("mesh-tool")).unwrap();
    let white = Material { diffuse: [1.0; 3], ..Material::default() };
    let radiance = [1.0, 2.0, 4.0].map(|b| b / std::f64::consts::PI);
    let lamp = Material { radiance, ..Material::default() };
    let names = vec!["white".into(), "lamp".into()];
    MaterialTable { names, values: vec![white, lamp] }
        .write(&at("s.materials"), written("mesh-tool"))
        .unwrap();
    let (_, _, mesh) = Mesh::read(&at("s.mesh")).unwrap();
    let (_, _, materials) = MaterialTable::read(&at("s.materials")).unwrap();
    let values = vec![[1.0, 2.0, 4.0]; 6];
    let solution = Solution { radiosity: values.clone(), irradiance: values, ..Solution::default() };
    let origins = Origins { mesh, matrix: Digest::of(b"matrix"), materials };
    solution.write(&at("s.sol"), written("solve-tool"), origins).unwrap();
    folder
}

pub fn run(folder: &Path, line: &str) -> Output {
    Command::cargo_bin("shade-tool")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap()
}
