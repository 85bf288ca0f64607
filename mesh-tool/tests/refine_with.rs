//! Refinement by a solution: what it describes badly is divided, everything else stays bit for bit.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use interchange::digest::Digest;
use interchange::mesh::FACE_EMITS;
use interchange::provenance::Provenance;
use interchange::solution::{Origins, Solution};
use mesh_tool::Options;
use mesh_tool::solved::Solved;
use std::collections::HashSet;

/// A solution without reflection: emitters shine, all others receive nothing. Wrong on purpose.
fn solved(folder: &std::path::Path, options: &Options) -> Solved {
    let scene = read("penumbra.obj");
    let (mesh, _) = made(&scene, options.clone());
    let (mesh_path, path) = (folder.join("s.mesh"), folder.join("s.sol"));
    mesh.write(&mesh_path, mesh_tool::provenance(&scene, options)).unwrap();
    let digest = interchange::mesh::Mesh::read(&mesh_path).unwrap().2;
    let shines = |e| mesh.face_flags[mesh.element_face(e).index()] & FACE_EMITS != 0;
    let solution = Solution {
        radiosity: mesh.element_ids().map(|e| [f64::from(u8::from(shines(e))); 3]).collect(),
        irradiance: vec![[0.01; 3]; mesh.element_count()],
        ..Solution::default()
    };
    let other = Digest::of(b"");
    let origins = Origins { mesh: digest, matrix: other, materials: other };
    solution.write(&path, Provenance::new("t", "t"), origins).unwrap();
    Solved::read(&path).unwrap()
}

#[test]
fn unchanged_elements_keep_their_identity() {
    let folder = tempfile::tempdir().unwrap();
    let base = elements(400);
    let solved = solved(folder.path(), &base);
    let before: HashSet<u64> = solved.mesh.element_identities().into_iter().collect();
    let options = Options { refine_with: Some(solved.clone()), refine_tolerance: Some(0.5), ..base.clone() };
    let (mesh, report) = made(&read("penumbra.obj"), options);
    assert_areas(&mesh, 1e-12);
    assert_conforming(&mesh);
    let kept = mesh.element_identities().iter().filter(|id| before.contains(id)).count();
    assert_eq!(kept as u64, report.counters["elements kept"]);
    assert!(report.counters["elements divided for the solution"] > 0);
    assert!(kept > solved.mesh.element_count() / 4, "{kept} of {}", solved.mesh.element_count());
    assert!(mesh.element_count() > solved.mesh.element_count());
    assert_eq!(mesh.occluder_identity(), solved.mesh.occluder_identity());
    // A solution that misses nothing by more than is allowed leaves the mesh as it is.
    let calm = Options { refine_with: Some(solved.clone()), refine_tolerance: Some(1e6), ..base };
    assert_eq!(made(&read("penumbra.obj"), calm).0, solved.mesh);
}

#[test]
fn solution_on_another_mesh_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let solved = solved(folder.path(), &elements(400));
    let options = Options { refine_with: Some(solved), ..elements(300) };
    let mut report = interchange::report::Report::new("mesh-tool", "test");
    let error = mesh_tool::build(&read("penumbra.obj"), &options, &mut report).unwrap_err().to_string();
    assert!(error.contains("give the flags that the first mesh was built with"), "{error}");
}

#[test]
fn bright_faces_leave_lines_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let base = elements(400);
    let mut solved = solved(folder.path(), &base);
    // The floor shines, too: nothing stands between it and what looks at it but the occluder before the lamp.
    solved.solution.radiosity.iter_mut().for_each(|b| *b = [1.0; 3]);
    assert_eq!(solved.brightest(1).len(), 1);
    let options = Options { refine_with: Some(solved), refine_tolerance: Some(1e6), sources: 1, ..base };
    let (mesh, report) = made(&read("penumbra.obj"), options);
    assert!(report.counters.contains_key("lines of secondary sources"));
    assert_conforming(&mesh);
}
