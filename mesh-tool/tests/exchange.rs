//! Meshes to and from other programs, two meshes set beside each other, and single elements.
#![allow(clippy::unwrap_used)]

use assert_cmd::Command;
use mesh_tool::compare::Difference;
use serde_json::Value;
use std::path::Path;

fn tool(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mesh-tool"));
    command.current_dir(folder);
    command
}

/// The cube of Goral et al. as a mesh of about so many elements, `s.mesh`; of its faces where none are asked for.
fn cube(elements: Option<&str>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes/goral_cube.obj");
    let mut build = tool(folder.path());
    build.arg("build").arg(scene).args(["-o", "s.mesh"]);
    build.args(elements.iter().flat_map(|n| ["--elements", n])).assert().success();
    folder
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = tool(folder).args(arguments).arg("--json").assert().success();
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

#[test]
fn an_exported_obj_is_the_same_scene_in_pieces() {
    let folder = cube(Some("100"));
    let folder = folder.path();
    tool(folder).args(["export", "s.mesh", "-o", "pieces.obj"]).assert().success();
    tool(folder).args(["build", "pieces.obj", "-o", "again.mesh"]).assert().success();
    let found = Difference::between(&folder.join("s.mesh"), &folder.join("again.mesh")).unwrap();
    // Every element is there again, at the same coordinates to the last bit, in the same group.
    assert_eq!(found.sides[0].elements, found.sides[1].elements);
    assert!((found.sides[0].area / found.sides[1].area - 1.0).abs() < 1e-15);
    let sizes = found
        .groups
        .values()
        .all(|(area, count)| (area[0] / area[1] - 1.0).abs() < 1e-14 && count[0] == count[1]);
    assert!(sizes, "{:?}", found.groups);
    let colours = std::fs::read_to_string(folder.join("pieces.mtl")).unwrap();
    assert!(colours.contains("Kd") && colours.contains("Ke"), "{colours}");
}

/// Corners of every element to the last bit, from the least one on, in whatever order the elements are.
fn squares(path: &Path) -> std::collections::BTreeSet<Vec<[u64; 3]>> {
    let mesh = interchange::mesh::Mesh::read(path).unwrap().0;
    let ring = |row: &[interchange::ids::VertexId]| {
        let mut corners: Vec<[u64; 3]> =
            row.iter().map(|v| mesh.vertices[v.index()].map(f64::to_bits)).collect();
        let least = (0..corners.len()).min_by_key(|&k| corners[k]).unwrap();
        corners.rotate_left(least);
        corners
    };
    mesh.elements.rows().map(ring).collect()
}

/// Through the formats of View3D and of Radiance and back: the same squares, to the last bit.
#[test]
fn scenes_of_other_programs_come_back() {
    let folder = cube(None);
    let folder = folder.path();
    for name in ["cube.vs3", "cube.rad"] {
        tool(folder).args(["export", "s.mesh", "-o", name]).assert().success();
        tool(folder).args(["import", name, "-o", "back.obj"]).assert().success();
        tool(folder).args(["build", "back.obj", "-o", "back.mesh"]).assert().success();
        assert_eq!(squares(&folder.join("back.mesh")), squares(&folder.join("s.mesh")), "{name}");
    }
    // View3D keeps the names of groups as one word; all six are there.
    tool(folder).args(["import", "cube.vs3", "-o", "back.obj"]).assert().success();
    let groups = std::fs::read_to_string(folder.join("back.obj")).unwrap();
    assert_eq!(groups.lines().filter(|line| line.starts_with("g ")).count(), 6, "{groups}");
}

#[test]
fn every_format_is_written_and_others_are_refused() {
    let folder = cube(Some("60"));
    let folder = folder.path();
    for ending in ["ply", "vtu", "glb", "obj", "rad", "vs3"] {
        let name = format!("out.{ending}");
        tool(folder).args(["export", "s.mesh", "-o", &name]).assert().success();
        assert!(std::fs::metadata(folder.join(&name)).unwrap().len() > 1000, "{ending}");
    }
    let fails = |arguments: &[&str], part: &str| {
        let failed = tool(folder).args(arguments).assert().code(1);
        let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(said.contains(part), "{part:?} is not in: {said}");
    };
    fails(&["export", "s.mesh", "-o", "s.stl"], "must end in .ply, .vtu, .glb, .obj, .rad, .vs3");
    fails(&["export", "s.mesh", "-o", "s.vtk"], "did you mean s.vtu?");
    fails(&["import", "out.rad", "-o", "s.obi"], "did you mean s.obj?");
    fails(&["picture", "s.mesh", "-o", "s.pgn"], "did you mean s.png?");
    fails(&["export", "s.mesh", "-o", "s.mesh"], "must end in");
    fails(&["import", "out.ply", "-o", "s.obj"], "must end in .vs3 (View3D) or .rad (Radiance)");
    fails(&["import", "out.rad", "-o", "s.rad"], "expected a name ending in .obj");
    fails(&["export", "missing.mesh", "-o", "s.ply"], "missing.mesh");
}

#[test]
fn material_tables_are_compared_too() {
    let folder = cube(None);
    let folder = folder.path();
    let same = json(folder, &["compare", "s.materials", "s.materials", "--max", "0"]);
    assert_eq!(same["values_that_differ"], serde_json::json!([]));
    tool(folder).args(["compare", "s.materials", "s.mesh"]).assert().code(1);
}

#[test]
fn meshes_are_compared_by_what_they_share() {
    let folder = cube(Some("100"));
    let folder = folder.path();
    std::fs::copy(folder.join("s.mesh"), folder.join("same.mesh")).unwrap();
    let same = json(folder, &["compare", "s.mesh", "same.mesh", "--max", "0"]);
    assert_eq!(
        (same["first"]["own_elements"].as_u64(), same["moved"]["distance"].as_f64()),
        (Some(0), Some(0.0))
    );

    // A vertex of the mesh a thousandth to the side: the elements around it are others.
    let (mut mesh, origin, _) = interchange::mesh::Mesh::read(&folder.join("s.mesh")).unwrap();
    let corner = mesh.elements.row(0)[0].index();
    mesh.vertices[corner][0] += 1e-3;
    mesh.write(&folder.join("moved.mesh"), origin).unwrap();
    let moved = json(folder, &["compare", "s.mesh", "moved.mesh"]);
    assert!((moved["moved"]["distance"].as_f64().unwrap() - 1e-3).abs() < 1e-12);
    assert_eq!(moved["moved"]["vertex"], corner + 1);
    let own = moved["second"]["own_elements"].as_u64().unwrap();
    assert!((1..40).contains(&own), "{own}");
    let failed = tool(folder).args(["compare", "s.mesh", "moved.mesh", "--max", "0"]).assert().code(1);
    assert!(String::from_utf8_lossy(&failed.get_output().stderr).contains("above --max 0e0"));
}

#[test]
fn an_element_and_a_group_are_told_alone() {
    let folder = cube(None);
    let folder = folder.path();
    let element = json(folder, &["info", "s.mesh", "--element", "1"]);
    assert_eq!((element["corners"].as_array().unwrap().len(), element["side"].as_u64()), (4, Some(0)));
    let name = element["group"].as_str().unwrap().to_owned();
    let group = json(folder, &["info", "s.mesh", "--group", &name]);
    assert_eq!(
        (group["area"].as_f64(), &group["elements"][0]),
        (element["area"].as_f64(), &element["element"])
    );
    let failed = tool(folder).args(["info", "s.mesh", "--group", &format!("{name}x")]).assert().code(1);
    assert!(String::from_utf8_lossy(&failed.get_output().stderr).contains(&format!("did you mean {name}?")));
    tool(folder).args(["info", "s.mesh", "--element", "7"]).assert().code(1);
}
