//! Solutions for other programs, two solutions set beside each other, and single elements.
#![allow(clippy::unwrap_used)]

#[path = "common/room.rs"]
mod room;

use assert_cmd::Command;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::solution::Solution;
use room::Room;
use serde_json::Value;

fn tool(room: &Room, arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_solve-tool"));
    command.current_dir(room.folder.path()).args(arguments).assert()
}

fn json(room: &Room, arguments: &[&str]) -> Value {
    let output = tool(room, &[arguments, &["--json"]].concat()).success();
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

fn said(failed: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&failed.get_output().stderr).into_owned()
}

fn solved() -> Room {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    tool(&room, &["solve", "room.ff", "--mesh", "room.mesh", "-o", "room.sol", "--tolerance", "1e-12"])
        .success();
    room
}

#[test]
fn elements_carry_the_solution_and_points_the_means_around_them() {
    let room = solved();
    let export = |name: &str, more: &[&str]| {
        let arguments = [&["export", "room.sol", "--mesh", "room.mesh", "-o", name], more].concat();
        tool(&room, &arguments).success().stdout("");
        std::fs::read(room.path(name)).unwrap()
    };
    let ply = String::from_utf8(export("s.ply", &["--white", "0.1"])).unwrap();
    let solution = Solution::read(&room.path("room.sol")).unwrap().0;
    let lines: Vec<&str> = ply.lines().collect();
    let body = lines.iter().position(|line| *line == "end_header").unwrap() + 1;
    // Every face of the room has four points of its own: at the first of them stands the first face's radiosity.
    let point: Vec<f64> = lines[body].split(' ').map(|x| x.parse().unwrap()).collect();
    assert_eq!(point[6..9], solution.radiosity[0]);
    let face: Vec<f64> = lines[body + 24].split(' ').map(|x| x.parse().unwrap()).collect();
    let position = |name: &str| {
        let fields: Vec<&str> = lines.iter().copied().filter(|line| line.starts_with("property")).collect();
        let list = fields.iter().position(|line| line.contains("vertex_indices")).unwrap();
        // The list is five numbers, every other property one.
        fields[list + 1..].iter().position(|line| line.ends_with(&format!(" {name}"))).unwrap() + 5
    };
    assert_eq!(face[position("B_r")], solution.radiosity[0][0]);
    assert_eq!(face[position("H_b")], solution.irradiance[0][2]);
    assert_eq!((face[position("element")], face[position("face")], face[position("group")]), (1.0, 1.0, 1.0));
    assert!(ply.contains("1.000000e-1 W m^-2 sr^-1 and more show as white"));
    // The ceiling emits more than that: white.
    let ceiling: Vec<&str> = lines[body + 20].split(' ').collect();
    assert_eq!(ceiling[3..6], ["255"; 3]);
    for name in ["s.vtu", "s.glb", "s.obj", "s.rad"] {
        assert!(export(name, &[]).len() > 500, "{name}");
    }
}

#[test]
fn flags_of_tables_and_of_elements_are_not_mixed() {
    let room = solved();
    let refused = |more: &[&str], code: i32, part: &str| {
        let failed = tool(&room, &[&["export", "room.sol", "--mesh", "room.mesh"], more].concat()).code(code);
        assert!(said(&failed).contains(part), "{part:?} is not in: {}", said(&failed));
    };
    refused(&["-o", "s.csv"], 2, "a table needs --by");
    refused(&["-o", "s.csv", "--by", "face", "--white", "1"], 2, "--white goes with elements");
    refused(&["-o", "s.ply", "--by", "face"], 2, "go with tables");
    refused(&["-o", "s.vs3"], 1, "View3D's format holds no solution");
    refused(&["-o", "s.xyz", "--by", "face"], 1, "must end in");
}

#[test]
fn solutions_are_compared_in_units_of_the_light() {
    let room = solved();
    let solve = ["solve", "room.ff", "--mesh", "room.mesh", "-o", "rough.sol", "--bounces", "1"];
    tool(&room, &solve).success();
    let found = json(&room, &["compare", "room.sol", "rough.sol", "--mesh", "room.mesh"]);
    assert_eq!((found["by"].as_str(), found["count"].as_u64()), (Some("element"), Some(6)));
    // All areas are 1: the relative difference is the sum of differences over the sum of the first.
    let (a, b) = (
        Solution::read(&room.path("room.sol")).unwrap().0,
        Solution::read(&room.path("rough.sol")).unwrap().0,
    );
    for c in 0..3 {
        let sum = |f: &dyn Fn(usize) -> f64| (0..6).map(f).sum::<f64>();
        let want = sum(&|i| (a.radiosity[i][c] - b.radiosity[i][c]).abs()) / sum(&|i| a.radiosity[i][c]);
        let got = found["radiosity"]["relative"][c].as_f64().unwrap();
        assert!((got - want).abs() < 1e-12, "channel {c}: {got} and {want}");
    }
    let worst = &found["radiosity"]["worst"];
    assert_eq!(worst["channel"], "blue");
    let failed =
        tool(&room, &["compare", "room.sol", "rough.sol", "--mesh", "room.mesh", "--max", "1e-3"]).code(1);
    assert!(said(&failed).contains("above --max 1e-3"), "{}", said(&failed));
    tool(&room, &["compare", "room.sol", "room.sol", "--mesh", "room.mesh", "--max", "0"]).success();
}

/// On two meshes groups are compared; elements of two meshes are not the same things.
#[test]
fn solutions_on_two_meshes_are_compared_by_group() {
    let room = solved();
    let (mut mesh, ..) = Mesh::read(&room.mesh).unwrap();
    mesh.lines.clear();
    mesh.input_face_count += 1;
    mesh.write(&room.path("other.mesh"), Provenance::new("test", "2")).unwrap();
    let digest = Mesh::read(&room.path("other.mesh")).unwrap().2;
    let (solution, origin, mut origins, _) = Solution::read(&room.path("room.sol")).unwrap();
    origins.mesh = digest;
    solution.write(&room.path("other.sol"), origin, origins).unwrap();
    let arguments =
        ["compare", "room.sol", "other.sol", "--mesh", "room.mesh", "--second-mesh", "other.mesh"];
    let found = json(&room, &arguments);
    assert_eq!((found["by"].as_str(), found["radiosity"]["rms"][0].as_f64()), (Some("group"), Some(0.0)));
    let failed = tool(&room, &[&arguments[..], &["--by", "element"]].concat()).code(1);
    assert!(said(&failed).contains("their elements are not the same"), "{}", said(&failed));
    let failed = tool(&room, &arguments[..5]).code(1);
    assert!(said(&failed).contains("do not belong together"), "{}", said(&failed));
}

#[test]
fn an_element_and_a_group_are_told_alone() {
    let room = solved();
    let solution = Solution::read(&room.path("room.sol")).unwrap().0;
    let element = json(&room, &["info", "room.sol", "--element", "2"]);
    assert_eq!(element["B"][1].as_f64().unwrap(), solution.radiosity[1][1]);
    let walls = json(&room, &["info", "room.sol", "--group", "walls", "--mesh", "room.mesh"]);
    let mean = (0..4).map(|i| solution.irradiance[i][0]).sum::<f64>() / 4.0;
    assert!((walls["H"][0].as_f64().unwrap() / mean - 1.0).abs() < 1e-14);
    assert_eq!((walls["elements"].as_u64(), walls["area"].as_f64()), (Some(4), Some(4.0)));
    let failed = tool(&room, &["info", "room.sol", "--group", "wall", "--mesh", "room.mesh"]).code(1);
    assert!(said(&failed).contains("did you mean walls?"));
    tool(&room, &["info", "room.sol", "--group", "walls"]).code(2);
    tool(&room, &["info", "room.sol", "--element", "7"]).code(1);
}
