//! The files of a small scene, written as the other tools would: the unit cube seen from inside, with its exact
//! matrix; every face is cut into two elements where asked.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::materials::{Material, MaterialTable};
use interchange::matrix::{self, Block, BlockKind, MatrixRecord, Precision, Values};
use interchange::mesh::{Cluster, Mesh};
use interchange::provenance::Provenance;
use std::path::{Path, PathBuf};

/// The cube's faces as corner numbers; corner c has the bits of c as coordinates. Faces 2k and 2k + 1 are opposite.
const FACES: [[u32; 4]; 6] =
    [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
pub const OPPOSITE: f64 = 0.19982489569838738304;
pub const ADJACENT: f64 = 0.20004377607540315424;

/// One element a face. Groups: `walls` (four), `floor, polished` and `ceiling`; the ceiling's material is `lamp`.
pub fn mesh() -> Mesh {
    let faces = || FACES.iter().map(|face| face.map(VertexId).to_vec());
    let vertices = (0..8u32).map(|c| [0, 1, 2].map(|axis| f64::from(c >> axis & 1))).collect();
    let ids = |count: u32| (0..count).map(FaceId).collect::<Vec<_>>();
    Mesh {
        vertices,
        elements: faces().collect(),
        element_nodes: (0..6).map(|f| (4 * f..4 * f + 4).map(NodeId).collect()).collect(),
        element_faces: ids(6),
        element_sides: vec![0; 6],
        node_vertices: FACES.iter().flatten().map(|&v| VertexId(v)).collect(),
        faces: faces().collect(),
        // The scene's second face was dropped.
        face_inputs: vec![0, 2, 3, 4, 5, 6],
        face_groups: [0, 0, 0, 0, 1, 2].map(GroupId).to_vec(),
        face_materials: [0, 0, 0, 0, 0, 1].map(MaterialId).to_vec(),
        face_flags: vec![0; 6],
        occluders: faces().collect(),
        occluder_faces: ids(6),
        lines: Vec::new(),
        clusters: vec![Cluster { start: 0, end: 6, first_child: 0, second_child: 0 }],
        groups: ["walls", "floor, polished", "ceiling"].map(str::to_owned).to_vec(),
        materials: ["grey", "lamp"].map(str::to_owned).to_vec(),
        input_face_count: 7,
        ..Mesh::default()
    }
}

pub fn factor(i: usize, j: usize) -> f64 {
    match (i == j, i / 2 == j / 2) {
        (true, _) => 0.0,
        (_, true) => OPPOSITE,
        _ => ADJACENT,
    }
}

pub struct Room {
    pub folder: tempfile::TempDir,
    pub mesh: PathBuf,
    pub matrix: PathBuf,
}

impl Room {
    /// Writes mesh, matrix and materials. The lamp has `Ke` = 1 / pi, so that E = 1, and reflects like the rest.
    pub fn new(reflectance: [f64; 3], row_error: f64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (mesh_path, matrix) = (folder.path().join("room.mesh"), folder.path().join("room.ff"));
        mesh().write(&mesh_path, Provenance::new("test", "1")).unwrap();
        let digest = Mesh::read(&mesh_path).unwrap().2;
        let record = MatrixRecord {
            elements: 6,
            mesh: digest,
            precision: Precision::F64,
            symmetric: true,
            extended: false,
            tolerance: 1e-4,
            part: 0,
            parts: 1,
        };
        // A triangle for the walls, one for floor and ceiling, and what lies between.
        let blocks = [
            Block::new(BlockKind::Triangle, 0..4, 0..4, 0),
            Block::new(BlockKind::Dense, 0..4, 4..6, 10),
            Block::new(BlockKind::Triangle, 4..6, 4..6, 18),
        ];
        let mut values = Vec::new();
        (0..4).for_each(|i| values.extend((i..4).map(|j| factor(i, j))));
        (0..4).for_each(|i| values.extend((4..6).map(|j| factor(i, j))));
        (4..6).for_each(|i| values.extend((i..6).map(|j| factor(i, j))));
        let provenance = Provenance::new("test", "1").input("mesh", digest);
        matrix::write(&matrix, provenance, record, &blocks, Values::F64(&values), &[1.0; 6], &[row_error; 6])
            .unwrap();
        let room = Self { folder, mesh: mesh_path, matrix };
        room.paint(&room.path("room.materials"), reflectance);
        room
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a material table.
    pub fn paint(&self, path: &Path, reflectance: [f64; 3]) {
        let grey = Material { diffuse: reflectance, ..Material::default() };
        let lamp = Material { radiance: [std::f64::consts::FRAC_1_PI; 3], ..grey };
        let names = ["lamp", "grey"].map(str::to_owned).to_vec();
        MaterialTable { names, values: vec![lamp, grey] }.write(path, Provenance::new("test", "1")).unwrap();
    }
}
