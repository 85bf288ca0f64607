//! The reference scenes of the workspace: what is read, with which numbers, and what is refused, where.
#![allow(clippy::unwrap_used)]

use interchange::materials::Material;
use interchange::scene::Scene;
use std::path::{Path, PathBuf};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes").join(name)
}

fn read(name: &str) -> Scene {
    Scene::read(&path(name), &[]).unwrap()
}

/// Message of a refusal, without the folder.
fn refusal(name: &str) -> String {
    let message = Scene::read(&path(name), &[]).unwrap_err().to_string();
    message.rsplit('/').next().unwrap().to_owned()
}

fn corner_counts(scene: &Scene) -> Vec<usize> {
    scene.faces.iter().map(|face| face.corners.len()).collect()
}

/// Area of a polygon from its corners (half the length of Newell's vector).
fn area(scene: &Scene, face: usize) -> f64 {
    let corners: Vec<[f64; 3]> =
        scene.faces[face].corners.iter().map(|&c| scene.vertices[c as usize]).collect();
    let mut newell = [0.0; 3];
    for (at, a) in corners.iter().enumerate() {
        let b = corners[(at + 1) % corners.len()];
        for (k, sum) in newell.iter_mut().enumerate() {
            let (p, q) = ((k + 1) % 3, (k + 2) % 3);
            *sum += (a[p] - corners[0][p]) * (b[q] - corners[0][q])
                - (a[q] - corners[0][q]) * (b[p] - corners[0][p]);
        }
    }
    0.5 * newell.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[test]
fn cornell_box_with_blocks() {
    let scene = read("cornell_blocks.obj");
    assert_eq!((scene.faces.len(), scene.vertices.len()), (19, 28));
    assert_eq!(corner_counts(&scene), [4; 19]);
    assert_eq!(scene.groups[..3], ["floor", "light", "ceiling"]);
    assert_eq!(scene.materials.names, ["white", "light", "green", "red"]);
    let white = Material { diffuse: [0.725, 0.71, 0.68], ..Material::default() };
    let light = Material { radiance: [17.0, 12.0, 4.0], ..Material::default() };
    assert_eq!(scene.materials.get("white"), Some(&white));
    assert_eq!(scene.materials.get("light"), Some(&light));
    // The lamp is 130 x 105 by its published corners, all of them integers: exact.
    let lamp = scene.faces.iter().position(|face| scene.groups[face.group.index()] == "light").unwrap();
    assert_eq!(area(&scene, lamp), 130.0 * 105.0);
    assert_eq!(scene.vertices[27], [265.0, 0.0, 296.0]);
    assert_eq!(scene.warnings, [""; 0]);
    let camera = &scene.settings.cameras[0];
    assert_eq!((camera.eye, camera.resolution), ([278.0, 273.0, -800.0], [256, 256]));
    assert_eq!((camera.focal_length, camera.film), (Some(0.035), Some([0.025, 0.025])));
    let names: Vec<_> = scene.dependencies().iter().map(|p| p.file_name().unwrap().to_owned()).collect();
    assert_eq!(names, ["cornell_blocks.obj", "cornell_blocks.mtl", "cornell_blocks.toml"]);
}

#[test]
fn other_scenes_have_their_faces_and_materials() {
    for (name, faces, materials) in
        [("cornell_empty.obj", 9, 4), ("goral_cube.obj", 6, 6), ("penumbra.obj", 3, 3), ("room.obj", 566, 14)]
    {
        let scene = read(name);
        let text = std::fs::read_to_string(path(name)).unwrap();
        let written = text.lines().filter(|line| line.starts_with("f ")).count();
        assert_eq!((scene.faces.len(), written), (faces, faces), "{name}");
        assert_eq!(scene.materials.names.len(), materials, "{name}: {:?}", scene.materials.names);
        assert_eq!(scene.settings.cameras.len(), 1, "{name}");
        assert_eq!(scene.warnings, [""; 0], "{name}");
        let lines: Vec<&str> = text.lines().collect();
        assert!(scene.faces.iter().all(|face| lines[face.line - 1].starts_with("f ")), "{name}");
    }
}

#[test]
fn scenes_with_mistakes_are_refused_at_their_line() {
    assert_eq!(
        refusal("stress/stress_nan.obj"),
        "stress_nan.obj:12: vertex 9: y is NaN; coordinates must be finite numbers"
    );
    assert_eq!(
        refusal("stress/stress_rho_gt1.obj"),
        "stress_rho_gt1.mtl:15: material fl: Kd is 1.2 1.2 1.2, but must be within [0, 1]"
    );
}

#[test]
fn other_stress_scenes_are_read() {
    let mut names: Vec<String> = std::fs::read_dir(path("stress"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".obj") && !["stress_nan.obj", "stress_rho_gt1.obj"].contains(&&**name))
        .collect();
    names.sort();
    assert_eq!(names.len(), 13, "{names:?}");
    for name in names {
        let scene = read(&format!("stress/{name}"));
        let text = std::fs::read_to_string(path("stress").join(&name)).unwrap();
        let written = text.lines().filter(|line| line.starts_with("f ")).count();
        assert_eq!(scene.faces.len(), written, "{name}");
        assert_eq!(scene.warnings, [""; 0], "{name}");
    }
}

#[test]
fn scaled_scenes_have_scaled_vertices() {
    let plain = read("stress/stress_ref.obj");
    for (name, scale) in [("stress/stress_tiny_1e-6.obj", 1e-6), ("stress/stress_huge_1e6.obj", 1e6)] {
        let scaled = read(name);
        for (got, want) in scaled.vertices.iter().flatten().zip(plain.vertices.iter().flatten()) {
            // Decimal and binary rounding of one product: 1 ulp.
            assert!((got - want * scale).abs() <= f64::EPSILON * scale, "{name}: {got} for {want}");
        }
        assert_eq!(scaled.faces, plain.faces);
    }
}

#[test]
fn repeated_corners_are_kept_for_the_mesh_to_judge() {
    let scene = read("stress/stress_zeroarea.obj");
    assert_eq!(scene.faces.len(), 9);
    assert_eq!(scene.faces[6].corners, [8, 8, 8]);
    assert_eq!(scene.faces[8].corners, [3; 4]);
    assert_eq!([area(&scene, 6), area(&scene, 8)], [0.0, 0.0]);
}
