//! Exported files in the hands of the programs that they are for: Khronos' glTF validator, meshio, trimesh, scipy. Each test
//! is skipped where its program is not there, and says how to get it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::chain::{Chain, Stage};
use tests::numpy::python_with;
use tests::{Tolerance, assert_close, run, tool};

/// How to get the validator, for the message of a test that is skipped.
const REMEDY: &str = "npm install --prefix target gltf-validator";

/// The Cornell box in triangles, solved, with its mesh and solution exported with these endings: `mesh.*`, `solution.*`.
fn exported(folder: &Path, endings: &[&str]) -> Chain {
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder, 300).with_tolerances("1e-2", "1e-2");
    chain.solve();
    for ending in endings {
        let to = |name: &str| folder.join(format!("{name}.{ending}"));
        run(tool("mesh-tool").arg("export").arg(chain.path("mesh")).arg("-o").arg(to("mesh"))).expect_code(0);
        let mut export = tool("solve-tool");
        export.arg("export").arg(chain.path("sol")).arg("--mesh").arg(chain.path("mesh"));
        run(export.arg("-o").arg(to("solution"))).expect_code(0);
    }
    chain
}

/// The lines of JSON that a command prints.
fn told(command: &mut Command) -> Vec<Value> {
    let said = run(command).expect_code(0).stdout;
    said.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn the_gltf_validator_finds_nothing() {
    let modules = tests::root().join("target/node_modules");
    let node = Command::new("node").arg("--version").output().is_ok_and(|output| output.status.success());
    if !node || !modules.join("gltf-validator").exists() {
        eprintln!("the_gltf_validator_finds_nothing: skipped: get node, and: {REMEDY}");
        return;
    }
    let folder = tests::folder();
    exported(folder.path(), &["glb"]);
    // Faces as given: polygons of four corners.
    let cube = Chain::as_given(tests::scene("goral_cube.obj"), folder.path());
    run(&mut cube.command(Stage::Build)).expect_code(0);
    let squares = folder.path().join("squares.glb");
    run(tool("mesh-tool").arg("export").arg(cube.path("mesh")).arg("-o").arg(&squares)).expect_code(0);
    let files = [folder.path().join("mesh.glb"), folder.path().join("solution.glb"), squares];
    let mut check = Command::new("node");
    check.arg(tests::root().join("tests/readers/gltf_check.cjs")).arg(&modules).args(&files);
    let found = told(&mut check);
    assert_eq!(found.len(), files.len());
    for (file, found) in files.iter().zip(found) {
        assert_eq!((&found["errors"], &found["warnings"]), (&0.into(), &0.into()), "{file:?}: {found}");
    }
}

#[test]
fn meshio_and_trimesh_see_every_element() {
    let modules = ["meshio", "trimesh"];
    let Some(python) = python_with("meshio_and_trimesh_see_every_element", &modules) else { return };
    let folder = tests::folder();
    exported(folder.path(), &["ply", "vtu", "obj", "glb"]);
    let names = ["mesh", "solution"];
    let files = |endings: &[&str]| -> Vec<PathBuf> {
        let all = endings.iter().flat_map(|ending| names.map(|name| format!("{name}.{ending}")));
        all.map(|name| folder.path().join(name)).collect()
    };
    let (meshio, trimesh) = (files(&["ply", "vtu", "obj"]), files(&["ply", "obj", "glb"]));
    let mut read = Command::new(python);
    read.arg(tests::root().join("tests/readers/geometry.py")).args(&meshio).arg("--").args(&trimesh);
    let found = told(&mut read);
    assert_eq!(found.len(), meshio.len() + trimesh.len());
    let (cells, area) = (&found[0]["cells"], found[0]["area"].as_f64().unwrap());
    for (file, found) in meshio.iter().chain(&trimesh).zip(&found) {
        assert_eq!(&found["cells"], cells, "{file:?}");
        // glTF holds f32.
        let name = file.display().to_string();
        assert_close(&name, found["area"].as_f64().unwrap(), area, Tolerance::Rel(1e-6));
    }
    let vtu = &found[3];
    for (kind, name) in
        [("cell_fields", "B"), ("cell_fields", "H"), ("cell_fields", "group"), ("point_fields", "B")]
    {
        assert!(vtu[kind].as_array().unwrap().contains(&name.into()), "{kind} lacks {name}: {vtu}");
    }
}

/// Out to scipy and back in each of its forms: the same factors to the last bit.
#[test]
fn scipy_reads_what_we_write_and_writes_what_we_read() {
    let name = "scipy_reads_what_we_write_and_writes_what_we_read";
    let Some(python) = python_with(name, &["numpy", "scipy"]) else { return };
    let folder = tests::folder();
    let chain = exported(folder.path(), &[]);
    let [factors, table] = ["factors.npz", "areas.csv"].map(|name| folder.path().join(name));
    let mut export = tool("formfactor-tool");
    export.arg("export").arg(chain.path("ff")).arg("--mesh").arg(chain.path("mesh"));
    run(export.args(["--by", "element", "-o"]).arg(&factors)).expect_code(0);
    let mut areas = tool("solve-tool");
    areas.arg("export").arg(chain.path("sol")).arg("--mesh").arg(chain.path("mesh"));
    run(areas.args(["--by", "element", "-o"]).arg(&table)).expect_code(0);
    let mut check = Command::new(python);
    check.arg(tests::root().join("tests/readers/sparse.py")).args([&factors, &table]).arg(folder.path());
    assert_eq!(run(&mut check).expect_code(0).stdout, "passed\n");
    for form in ["csr0.npz", "csr1.npz", "csc0.npz", "csc1.npz", "coo0.npz", "coo1.npz", "scipy.mtx"] {
        let again = folder.path().join("again.ff");
        let mut import = tool("formfactor-tool");
        import.arg("import").arg(folder.path().join(form)).arg("--mesh").arg(chain.path("mesh"));
        run(import.args(["--tolerance", "1e-2", "-o"]).arg(&again)).expect_code(0);
        let mut compare = tool("formfactor-tool");
        compare.arg("compare").arg(chain.path("ff")).arg(&again).args(["--max", "0"]);
        run(&mut compare).expect_code(0);
    }
}
