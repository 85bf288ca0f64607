//! Scenes built in code for the tests.
#![allow(clippy::unwrap_used)]

use crate::exr_file::{self, Label, Precision};
use crate::exr_reader::StoredPicture;
use crate::lit_scene::LitScene;
use crate::picture::Picture;
use glam::DVec3;
use interchange::digest::Digest;
use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::materials::Material;
use interchange::mesh::{Cluster, FACE_TWO_SIDED, Mesh};
use interchange::provenance::Provenance;

/// Adds a planar parallelogram as a face with n x n elements, front where `u` x `v` points.
pub fn add_parallelogram(mesh: &mut Mesh, corner: DVec3, u: DVec3, v: DVec3, n: usize, flags: u32) {
    let (face, first) = (FaceId::new(mesh.faces.len()), mesh.vertices.len());
    let vertex = |i: usize, j: usize| VertexId::new(first + j * (n + 1) + i);
    for j in 0..=n {
        for i in 0..=n {
            mesh.vertices.push((corner + u * (i as f64 / n as f64) + v * (j as f64 / n as f64)).to_array());
        }
    }
    let outline = [vertex(0, 0), vertex(n, 0), vertex(n, n), vertex(0, n)];
    mesh.faces.push(outline);
    mesh.occluders.push(outline);
    mesh.occluder_faces.push(face);
    mesh.face_inputs.push(face.0);
    mesh.face_groups.push(GroupId(0));
    mesh.face_materials.push(MaterialId(0));
    mesh.face_flags.push(flags);
    for side in 0..if flags & FACE_TWO_SIDED != 0 { 2 } else { 1 } {
        let first_node = mesh.node_vertices.len();
        mesh.node_vertices.extend((0..(n + 1) * (n + 1)).map(|k| VertexId::new(first + k)));
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let mut corners = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            if side == 1 {
                corners.reverse();
            }
            mesh.elements.push(corners);
            mesh.element_nodes.push(corners.map(|c| NodeId::new(first_node + c.index() - first)));
            mesh.element_faces.push(face);
            mesh.element_sides.push(side);
        }
    }
    mesh.input_face_count += 1;
    mesh.clusters =
        vec![Cluster { start: 0, end: mesh.elements.len() as u32, first_child: 0, second_child: 0 }];
}

/// A mesh with one group and one material, without faces.
pub fn empty_mesh() -> Mesh {
    Mesh { groups: vec!["all".into()], materials: vec!["white".into()], ..Mesh::default() }
}

/// A mesh as a scene: all radiosity 1, the material white and dark.
pub fn lit(mesh: Mesh) -> LitScene {
    let radiosity = vec![[1.0; 3]; mesh.element_count()];
    let inputs = vec![("mesh", Digest::of(b"mesh"))];
    let materials = vec![Material { diffuse: [1.0; 3], ..Material::default() }];
    let sources = mesh.element_ids().map(|element| mesh.element_corners(element)).collect();
    let source_of = (0..mesh.element_count() as u32).collect();
    LitScene {
        mesh,
        sources,
        source_of,
        irradiance: radiosity.clone(),
        radiosity,
        achieved: 0.0,
        materials,
        inputs,
    }
}

/// The unit cube with inward fronts, n x n elements to a wall.
pub fn cube(n: usize) -> LitScene {
    let mut mesh = empty_mesh();
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (corner, u, v) in
        [(DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, x, y), (z, y, x)]
    {
        add_parallelogram(&mut mesh, corner, u, v, n, 0);
    }
    lit(mesh)
}

/// A picture through its file, as views get it.
pub fn stored(picture: &Picture) -> StoredPicture {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    let provenance = Provenance::new("shade-tool", "test");
    let label = Label { provenance: &provenance, camera: None, efficacy: 179.0, remarks: String::new() };
    exr_file::write(&path, picture, Precision::Float, &label).unwrap();
    StoredPicture::read(&path).unwrap()
}
