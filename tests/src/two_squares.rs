//! The smallest scene with something to exchange: two unit squares that face each other at distance 1. Its four files
//! are the worked example of `interchange/FORMAT.md`.

use interchange::digest::Digest;
use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::materials::{Material, MaterialTable};
use interchange::matrix::{self, Block, BlockKind, MatrixRecord, Precision, Values};
use interchange::mesh::{Cluster, FACE_EMITS, Mesh};
use interchange::provenance::Provenance;
use interchange::ragged::Ragged;
use interchange::solution::{Details, Origins, Solution, Summary};
use std::path::{Path, PathBuf};

/// Form factor between the squares, by [`opposed_unit_squares`].
pub const FORM_FACTOR: f64 = 0.199_824_895_698_387_32;

/// Form factor between opposed unit squares at distance 1 in closed form (Howell's catalogue, C-11, with X = Y = 1):
/// 2/pi (ln sqrt(4/3) + 2 sqrt(2) atan(1/sqrt(2)) - pi/2).
pub fn opposed_unit_squares() -> f64 {
    let root = 2.0f64.sqrt();
    let logarithm = (4.0f64 / 3.0).sqrt().ln();
    2.0 / std::f64::consts::PI * (logarithm + 2.0 * root * (1.0 / root).atan() - std::f64::consts::FRAC_PI_2)
}

/// The mesh: square 0 is the floor and looks up, square 1 is the lamp and looks down.
pub fn mesh() -> Mesh {
    let squares = || -> Ragged<VertexId> {
        let corners = |first: usize| (first..first + 4).map(VertexId::new).collect::<Vec<_>>();
        [corners(0), corners(4)].into_iter().collect()
    };
    let nodes = |first: usize| (first..first + 4).map(NodeId::new).collect::<Vec<_>>();
    let both = [FaceId(0), FaceId(1)].to_vec();
    Mesh {
        vertices: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [1.0, 1.0, 1.0],
            [1.0, 0.0, 1.0],
        ],
        elements: squares(),
        element_nodes: [nodes(0), nodes(4)].into_iter().collect(),
        element_faces: both.clone(),
        element_sides: vec![0, 0],
        node_vertices: (0..8).map(VertexId::new).collect(),
        faces: squares(),
        face_inputs: vec![0, 1],
        face_groups: vec![GroupId(0), GroupId(1)],
        face_materials: vec![MaterialId(0), MaterialId(1)],
        face_flags: vec![0, FACE_EMITS],
        occluders: squares(),
        occluder_faces: both,
        lines: Vec::new(),
        clusters: vec![
            Cluster { start: 0, end: 2, first_child: 1, second_child: 2 },
            Cluster { start: 0, end: 1, first_child: 0, second_child: 0 },
            Cluster { start: 1, end: 2, first_child: 0, second_child: 0 },
        ],
        groups: vec!["floor".into(), "lamp é".into()],
        materials: vec!["grey".into(), "light".into()],
        input_face_count: 2,
        ..Mesh::default()
    }
}

/// The materials: a grey floor and a black lamp of radiance 10.
pub fn materials() -> MaterialTable {
    let grey = Material { diffuse: [0.5, 0.25, 0.125], ..Material::default() };
    let light = Material { radiance: [10.0; 3], ..Material::default() };
    MaterialTable { names: vec!["grey".into(), "light".into()], values: vec![grey, light] }
}

/// The solution: the lamp's exitance, and what the floor makes of it.
pub fn solution() -> Solution {
    let exitance = 10.0 * std::f64::consts::PI;
    let irradiance = FORM_FACTOR * exitance;
    let floor = [0.5, 0.25, 0.125].map(|rho| rho * irradiance);
    Solution {
        radiosity: vec![floor, [exitance; 3]],
        irradiance: vec![[irradiance; 3], floor.map(|b| FORM_FACTOR * b)],
        history: vec![[0.1, 0.05, 0.025], [0.0; 3]],
        summary: Summary { solver: "cg".into(), tolerance: 1e-6, achieved: 0.0 },
        details: Details::default(),
    }
}

/// Paths of the four files.
#[derive(Debug, Clone)]
pub struct Files {
    /// `.mesh`
    pub mesh: PathBuf,
    /// `.materials`
    pub materials: PathBuf,
    /// `.ff`
    pub matrix: PathBuf,
    /// `.sol`
    pub solution: PathBuf,
}

impl Files {
    /// Where the four files lie in `folder`.
    pub fn in_folder(folder: &Path) -> Self {
        let path = |ending: &str| folder.join(format!("two_squares.{ending}"));
        Self { mesh: path("mesh"), materials: path("materials"), matrix: path("ff"), solution: path("sol") }
    }

    /// All four.
    pub fn all(&self) -> [&Path; 4] {
        [&self.mesh, &self.materials, &self.matrix, &self.solution]
    }
}

/// Writes the four files into `folder`.
pub fn write(folder: &Path) -> Files {
    let files = Files::in_folder(folder);
    let by = |tool: &str| Provenance::new(tool, "1.0.0");
    let scene = Digest::of(b"two squares");
    let (mesh, materials) = (mesh(), materials());
    mesh.write(&files.mesh, by("mesh-tool").flag("--elements 2").input("scene", scene)).unwrap();
    materials.write(&files.materials, by("mesh-tool").input("scene", scene)).unwrap();
    let mesh_digest = Mesh::read(&files.mesh).unwrap().2;
    let materials_digest = MaterialTable::read(&files.materials).unwrap().2;

    let record = MatrixRecord {
        elements: 2,
        mesh: mesh_digest,
        precision: Precision::F64,
        symmetric: true,
        extended: false,
        tolerance: 1e-7,
        part: 0,
        parts: 1,
    };
    let blocks = [Block::new(BlockKind::Dense, 0..1, 1..2, 0)];
    let values = Values::F64(&[FORM_FACTOR]);
    let provenance = by("formfactor-tool").input("mesh", mesh_digest);
    matrix::write(&files.matrix, provenance, record, &blocks, values, &[1.0, 1.0], &[0.0, 0.0]).unwrap();
    let matrix_digest = matrix::Matrix::open(&files.matrix).unwrap().digest();

    let origins = Origins { mesh: mesh_digest, matrix: matrix_digest, materials: materials_digest };
    let provenance = by("solve-tool")
        .input("mesh", mesh_digest)
        .input("matrix", matrix_digest)
        .input("materials", materials_digest);
    solution().write(&files.solution, provenance, origins).unwrap();
    files
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Tolerance, assert_close};

    #[test]
    fn stored_form_factor_is_the_closed_form() {
        // Four terms of order 1, each within 1 ulp.
        assert_close("F", FORM_FACTOR, opposed_unit_squares(), Tolerance::Abs(8.0 * f64::EPSILON));
    }
}
