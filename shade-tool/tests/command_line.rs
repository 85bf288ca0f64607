//! The program from files to files: exit codes, messages, the same bytes for any number of threads.
#![allow(clippy::unwrap_used)]

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
fn cube() -> Mesh {
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
fn furnace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let written = |tool: &str| Provenance::new(tool, "test");
    cube().write(&at("s.mesh"), written("mesh-tool")).unwrap();
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

fn run(folder: &Path, line: &str) -> Output {
    Command::cargo_bin("shade-tool")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap()
}

/// Exit code and the one line on stderr.
fn failure(folder: &Path, line: &str) -> (Option<i32>, String) {
    let output = run(folder, line);
    assert!(output.stdout.is_empty(), "{line}: data on stdout");
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

const INSIDE: &str = "--eye 0.5,0.5,0.1 --look-at 0.5,0.5,1 --fov-deg 100 --size 24x16";

#[test]
fn render_writes_picture_preview_and_report() {
    let folder = furnace();
    let line = format!("render s.sol --mesh s.mesh -o s.exr --png s.png --samples 2 --float {INSIDE}");
    let output = run(folder.path(), &line);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");

    let told = run(folder.path(), "info s.exr --json");
    let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(
        (told["layers"][0]["width"].as_u64(), told["layers"][0]["height"].as_u64()),
        (Some(24), Some(16))
    );
    for (k, b) in [(0, 4.0), (1, 2.0), (2, 1.0)] {
        let channel = &told["layers"][0]["channels"][k];
        assert_eq!(channel["precision"], "float");
        for key in ["min", "max", "mean"] {
            let error = channel[key].as_f64().unwrap() * std::f64::consts::PI / b - 1.0;
            // f32 rounds to 6e-8.
            assert!(error.abs() < 1e-7, "{key} of channel {k}: relative error {error}");
        }
    }
    let provenance = told["attributes"]["provenance"].as_str().unwrap();
    let provenance: serde_json::Value = serde_json::from_str(provenance).unwrap();
    assert_eq!(provenance["flags"][0], "--samples 2");
    for role in ["solution", "mesh", "materials"] {
        assert_eq!(provenance["inputs"][role].as_str().unwrap().len(), 64, "{role}");
    }
    assert!(!told["attributes"].to_string().contains("capDate"));

    let report = std::fs::read_to_string(folder.path().join("s.exr.report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["counters"]["samples"], 24 * 16 * 4);
    // The ceiling is black, and the wall behind the eye is not seen.
    assert_eq!(report["counters"]["nodes_black_skipped"], 4);
    assert_eq!(report["counters"]["nodes_unseen_skipped"], 4);
    assert_eq!(report["counters"]["nodes_gathered"], 0);
    assert_eq!(report["counters"]["nodes_split"], 16);
    assert_eq!(report["counters"]["node_edges_gathered"], 32);
    let preview = std::fs::read(folder.path().join("s.png")).unwrap();
    assert_eq!(&preview[..8], b"\x89PNG\r\n\x1a\n");
}

#[test]
fn same_bytes_for_any_number_of_threads_and_from_any_folder() {
    let folder = furnace();
    for (name, threads) in [("one", 1), ("three", 3)] {
        let line = format!(
            "render s.sol --mesh s.mesh -o {name}.exr --png {name}.png --threads {threads} --size 40x30"
        );
        assert!(run(folder.path(), &line).status.success());
    }
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("one.exr"), bytes("three.exr"));
    assert_eq!(bytes("one.png"), bytes("three.png"));
}

#[test]
fn toml_camera_is_used_and_the_command_line_wins() {
    let folder = furnace();
    let toml = "[camera]\neye = [0.5, 0.5, 0.1]\nlook_at = [0.5, 0.5, 1]\nup = [0, 1, 0]\nfocal_length = 0.02\n\
                film = [0.03, 0.03]\nresolution = [12, 10]\n";
    std::fs::write(folder.path().join("c.toml"), toml).unwrap();
    for (flags, size, film) in
        [("", "12x10", "half_width=0.75 half_height=0.625"), ("--size 9x9", "9x9", "half_height=0.75")]
    {
        assert!(
            run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr --camera c.toml {flags}"))
                .status
                .success()
        );
        let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
        assert!(told.contains(&format!("size={size}")) && told.contains(film), "{told}");
        assert!(!told.contains("framing"));
    }
    assert!(run(folder.path(), "render s.sol --mesh s.mesh -o s.exr --size 8x8").status.success());
    let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
    assert!(told.contains("size=8x8 framing"), "{told}");
}

#[test]
fn probe_adds_irradiance_to_the_points() {
    let folder = furnace();
    let points = "x,y,z,nx,ny,nz\n0.5,1e-7,0.50,0,2,0\n0,0,0,0,1,0\n.5,.5,.5,1,1,1\n";
    std::fs::write(folder.path().join("p.csv"), points).unwrap();
    let output = run(folder.path(), "probe s.sol --mesh s.mesh --points p.csv -o out.csv");
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty(), "{output:?}");
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!((lines[0], lines.len()), ("x,y,z,nx,ny,nz,H_r,H_g,H_b", 4));
    assert!(lines[1].starts_with("0.5,1e-7,0.50,0,2,0,"));
    for line in &lines[1..] {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        for (got, want) in fields[6..].iter().zip([1.0, 2.0, 4.0]) {
            assert!((got / want - 1.0).abs() < 1e-10, "{line}");
        }
    }
    assert!(folder.path().join("out.csv.report.json").exists());

    std::fs::write(folder.path().join("p.csv"), "x,y,z,nx,ny,nz\n").unwrap();
    assert!(run(folder.path(), "probe s.sol --mesh s.mesh --points p.csv -o out.csv").status.success());
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert_eq!(table, "x,y,z,nx,ny,nz,H_r,H_g,H_b\n");
}

#[test]
fn bad_points_and_files_fail_with_one_line_that_says_where() {
    let folder = furnace();
    let probe = "probe s.sol --mesh s.mesh --points p.csv -o out.csv";
    for (points, words) in [
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n", "p.csv:2: the normal is zero"),
        ("x,y,z,nx,ny,nz\n0,0,0,0,1,0\n0,NaN,0,0,1,0\n", "p.csv:3: y is NaN"),
        ("x,y,z,nx,ny,nz,id\n", "p.csv:1: header"),
    ] {
        std::fs::write(folder.path().join("p.csv"), points).unwrap();
        let (code, stderr) = failure(folder.path(), probe);
        assert!(code == Some(1) && stderr.contains(words), "{code:?} {stderr}");
        assert!(stderr.starts_with("shade-tool: error: ") && stderr.lines().count() == 1, "{stderr}");
    }
    assert!(!folder.path().join("out.csv").exists());

    let (code, stderr) = failure(folder.path(), "render s.sol --mesh t.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("did you mean") && stderr.contains("s.mesh"), "{stderr}");
    let (code, stderr) = failure(folder.path(), "info s.sol");
    assert!(code == Some(1) && stderr.contains("solve-tool info"), "{stderr}");
    let (code, stderr) = failure(folder.path(), "render s.mesh --mesh s.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("a mesh (.mesh)"), "{stderr}");
}

#[test]
fn files_of_different_scenes_are_refused() {
    let folder = furnace();
    let at = |name: &str| folder.path().join(name);
    let mut other = cube();
    other.vertices[0][0] = -0.25;
    other.write(&at("o.mesh"), Provenance::new("mesh-tool", "test")).unwrap();
    let (code, stderr) = failure(folder.path(), "render s.sol --mesh o.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("do not belong together"), "{stderr}");

    let grey = MaterialTable { names: vec!["white".into()], values: vec![Material::default()] };
    grey.write(&at("o.materials"), Provenance::new("mesh-tool", "test")).unwrap();
    let (code, stderr) =
        failure(folder.path(), "render s.sol --mesh s.mesh -o s.exr --materials o.materials");
    assert!(code == Some(1) && stderr.contains("lamp"), "{stderr}");
    std::fs::remove_file(at("s.materials")).unwrap();
    let (code, stderr) = failure(folder.path(), "render s.sol --mesh s.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("s.materials"), "{stderr}");
    assert!(!at("s.exr").exists());
}

#[test]
fn bad_usage_ends_with_2() {
    let folder = furnace();
    let render = "render s.sol --mesh s.mesh -o s.exr";
    for flags in [
        // Of later work.
        "--interpolation linear",
        "--integrator phong",
        // Values out of range.
        "--size 0x4",
        "--samples 0",
        "--samples 65",
        "--eye 1,2 --look-at 0,0,0",
        "--eye 1,2,nan --look-at 0,0,0",
        "--fov-deg 180",
        "--focal-length -1 --film 1,1",
        "--exposure inf --png s.png",
        "--png s.jpg",
        "--threads 0",
        // Flags that need others, or exclude them.
        "--eye 1,2,3",
        "--camera-name front",
        "--focal-length 1",
        "--exposure 1",
        "--fov-deg 30 --focal-length 1 --film 1,1",
    ] {
        let (code, stderr) = failure(folder.path(), &format!("{render} {flags}"));
        assert_eq!(code, Some(2), "{flags}: {stderr}");
    }
    for line in [
        "",
        "compare a.exr",
        "render s.sol -o s.exr",
        "probe s.sol --mesh s.mesh -o o.csv",
        "render s.sol --mesh s.mesh -o s.png",
    ] {
        assert_eq!(failure(folder.path(), line).0, Some(2), "{line}");
    }
    assert!(!folder.path().join("s.exr").exists());
}

#[test]
fn other_materials_are_used_with_a_warning() {
    let folder = furnace();
    let black =
        MaterialTable { names: vec!["lamp".into(), "white".into()], values: vec![Material::default(); 2] };
    black.write(&folder.path().join("o.materials"), Provenance::new("mesh-tool", "test")).unwrap();
    let output =
        run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr --materials o.materials {INSIDE}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && stderr.contains("not the materials that s.sol was solved with"),
        "{stderr}"
    );
    let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
    assert!(told.contains("R half: 0.000000 to 0.000000"), "{told}");
}
