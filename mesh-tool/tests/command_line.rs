//! The program: flags, files beside each other, exit codes.
#![allow(clippy::unwrap_used)]

use assert_cmd::Command;
use std::path::{Path, PathBuf};

fn tool(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("mesh-tool").unwrap();
    command.current_dir(folder);
    command
}

fn cube() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    for ending in ["obj", "mtl", "toml"] {
        let from =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes/goral_cube").with_extension(ending);
        std::fs::copy(from, folder.path().join("goral_cube").with_extension(ending)).unwrap();
    }
    let path = folder.path().to_owned();
    (folder, path)
}

fn text_of(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

#[test]
fn build_writes_mesh_table_surfaces_and_report() {
    let (_keep, folder) = cube();
    tool(&folder)
        .args(["build", "goral_cube.obj", "-o", "s.mesh", "--elements", "200"])
        .assert()
        .success()
        .stdout("");
    for name in ["s.mesh", "s.materials", "s.surfaces", "s.mesh.report.json"] {
        assert!(folder.join(name).exists(), "{name}");
    }
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("s.mesh.report.json")).unwrap()).unwrap();
    assert_eq!(report["counters"]["input faces"], 6);
    assert_eq!(report["flags"][0], "--elements 200");
    let names: Vec<&str> =
        report["phases"].as_array().unwrap().iter().filter_map(|p| p["name"].as_str()).collect();
    assert_eq!(names, ["read", "clean", "regions", "lines", "triangulate", "assemble", "write"]);
}

#[test]
fn colour_edit_leaves_mesh_and_surfaces_and_changes_the_table() {
    let (_keep, folder) = cube();
    let run = || {
        tool(&folder)
            .args(["build", "goral_cube.obj", "-o", "s.mesh", "--max-edge", "0.3"])
            .assert()
            .success();
        ["s.mesh", "s.surfaces", "s.materials"].map(|name| std::fs::read(folder.join(name)).unwrap())
    };
    let before = run();
    let mtl = std::fs::read_to_string(folder.join("goral_cube.mtl")).unwrap();
    let edited: String = mtl
        .lines()
        .map(|line| {
            if line.trim_start().starts_with("Kd") {
                "Kd 0.123 0.2 0.3\n".into()
            } else {
                format!("{line}\n")
            }
        })
        .collect();
    std::fs::write(folder.join("goral_cube.mtl"), edited).unwrap();
    let after = run();
    assert!(before[0] == after[0] && before[1] == after[1] && before[2] != after[2]);
}

#[test]
fn materials_writes_what_build_writes_and_a_make_rule() {
    let (_keep, folder) = cube();
    tool(&folder).args(["build", "goral_cube.obj", "-o", "a.mesh"]).assert().success();
    tool(&folder)
        .args(["materials", "goral_cube.obj", "-o", "b.materials", "--depfile", "b.d"])
        .assert()
        .success()
        .stdout("")
        .stderr("");
    for ending in ["materials", "surfaces"] {
        let [a, b] = ["a", "b"].map(|name| std::fs::read(folder.join(name).with_extension(ending)).unwrap());
        assert!(a == b, "{ending}");
    }
    let rule = std::fs::read_to_string(folder.join("b.d")).unwrap();
    let expected = "b.materials: goral_cube.obj goral_cube.mtl goral_cube.toml\n\
                    goral_cube.obj:\ngoral_cube.mtl:\ngoral_cube.toml:\n";
    assert_eq!(rule, expected);
}

#[test]
fn two_sided_on_the_command_line_doubles_the_elements() {
    let (_keep, folder) = cube();
    let obj = std::fs::read_to_string(folder.join("goral_cube.obj")).unwrap();
    let name = obj.lines().find_map(|line| line.strip_prefix("usemtl ")).unwrap().trim().to_owned();
    let count = |flags: &[&str]| {
        tool(&folder).args(["build", "goral_cube.obj", "-o", "s.mesh"]).args(flags).assert().success();
        let output = tool(&folder).args(["info", "s.mesh", "--json"]).output().unwrap();
        let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        value["elements"].as_u64().unwrap()
    };
    let plain = count(&[]);
    assert_eq!(plain, 6);
    assert!(count(&["--two-sided", &name]) > plain);
}

#[test]
fn info_describes_both_kinds_and_refuses_others() {
    let (_keep, folder) = cube();
    tool(&folder).args(["build", "goral_cube.obj", "-o", "s.mesh", "--elements", "100"]).assert().success();
    let mesh = text_of(&tool(&folder).args(["info", "s.mesh"]).output().unwrap());
    assert!(
        mesh.contains("six-node triangles") && mesh.contains("--elements 100") && mesh.lines().count() < 40
    );
    let table = text_of(&tool(&folder).args(["info", "s.materials"]).output().unwrap());
    assert!(table.contains("material table"));
    let output = tool(&folder).args(["info", "s.materials", "--json"]).output().unwrap();
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["kind"], "materials");
    let refused = tool(&folder).args(["info", "goral_cube.obj"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(text_of(&refused).starts_with("mesh-tool: error: goral_cube.obj"));
}

#[test]
fn bad_usage_is_refused_with_exit_code_2() {
    let (_keep, folder) = cube();
    let build = ["build", "goral_cube.obj", "-o", "s.mesh"];
    for flags in [
        &["--max-edge", "0"][..],
        &["--max-edge", "-1"],
        &["--max-edge=nan"],
        &["--max-edge=inf"],
        &["--elements", "0"],
        &["--elements", "1.5"],
        &["--discontinuity", "d3"],
        &["--no-clean", "wash"],
        &["--no-skip", "rope"],
        &["--sources", "2"],
        &["--refine-tolerance", "0.1"],
        &["--tolerance", "0"],
        &["--threads", "0"],
    ] {
        let output = tool(&folder).args(build).args(flags).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{flags:?}");
    }
    assert!(!folder.join("s.mesh").exists());
    let help = text_of(&tool(&folder).args(["build", "--help"]).output().unwrap());
    assert!(
        help.contains("--max-edge") && help.contains("--discontinuity") && help.contains("--refine-with")
    );
    let compare = tool(&folder).args(["compare", "a.mesh"]).output().unwrap();
    assert_eq!(compare.status.code(), Some(2));
}

#[test]
fn scene_is_never_overwritten() {
    let (_keep, folder) = cube();
    let before = std::fs::read(folder.join("goral_cube.obj")).unwrap();
    for command in ["build", "materials"] {
        let output =
            tool(&folder).args([command, "goral_cube.obj", "-o", "goral_cube.obj"]).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(text_of(&output).contains("is an input"));
    }
    assert_eq!(std::fs::read(folder.join("goral_cube.obj")).unwrap(), before);
}

#[test]
fn pictures_are_drawn_and_planes_chosen() {
    let (_keep, folder) = cube();
    tool(&folder).args(["build", "goral_cube.obj", "-o", "s.mesh", "--elements", "100"]).assert().success();
    tool(&folder).args(["picture", "s.mesh", "-o", "s.svg"]).assert().success();
    tool(&folder).args(["picture", "s.mesh", "-o", "one.svg", "--plane", "1"]).assert().success();
    tool(&folder).args(["picture", "s.mesh", "-o", "s.png"]).assert().success();
    let svg = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    assert_eq!((svg("s.svg").matches("<text").count(), svg("one.svg").matches("<text").count()), (6, 1));
    assert!(std::fs::read(folder.join("s.png")).unwrap().starts_with(b"\x89PNG"));
    // A cross three squares wide and four high in a frame of 1600 with a margin of 12; one square that fills another.
    let extent = |name: &str| {
        let svg = svg(name);
        let points = svg.lines().filter_map(|line| line.strip_prefix('M')).flat_map(|line| line.split('L'));
        let at = |point: &str| point.split_once(' ').map(|(x, y)| [x, y].map(|v| v.parse::<f64>().unwrap()));
        points.map(|point| at(point).unwrap()).fold([0.0f64; 2], |[x, y], [u, v]| [x.max(u), y.max(v)])
    };
    assert_eq!(extent("s.svg"), [12.0 + 0.75 * 1576.0, 12.0 + 1576.0]);
    assert_eq!(extent("one.svg"), [12.0 + 1576.0; 2]);
    for flags in [&["-o", "s.gif"][..], &["-o", "t.svg", "--plane", "7"], &["-o", "s.mesh"]] {
        let output = tool(&folder).args(["picture", "s.mesh"]).args(flags).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{flags:?}");
    }
}

#[test]
fn tolerance_that_no_mesh_meets_is_written_with_exit_code_3() {
    let (_keep, folder) = cube();
    let output = tool(&folder)
        .args(["build", "goral_cube.obj", "-o", "s.mesh", "--tolerance", "1e-3", "--elements", "500"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", text_of(&output));
    assert!(folder.join("s.mesh").exists());
}

#[test]
fn too_many_elements_are_refused_before_memory_is() {
    let (_keep, folder) = cube();
    let output = tool(&folder)
        .args(["build", "goral_cube.obj", "-o", "s.mesh", "--max-edge", "1e-7"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text_of(&output).contains("raise --max-edge"), "{}", text_of(&output));
}
