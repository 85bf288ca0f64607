//! Each stage replaced by a foreign program with the same command line (`tests/swap`), as `docs/swapping.md` tells: what
//! comes out differs from ours by what the stage's own method leaves, and no more.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::chain::Chain;
use tests::numpy::python_with_numpy;
use tests::{program, run, tool};

/// The Cornell box made by our own tools.
fn ours(folder: &Path) -> Chain {
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder, 300).with_tolerances("1e-3", "1e-3");
    chain.solve();
    chain
}

/// A foreign stage, told where the tools are that it calls itself.
fn stage(python: &Path, name: &str) -> Command {
    let mut command = Command::new(python);
    command.arg(tests::root().join("tests/swap").join(name));
    command.env("RADIOSITY_MESH_TOOL", program("mesh-tool"));
    command.env("RADIOSITY_SOLVE_TOOL", program("solve-tool"));
    command
}

/// Solves as `Chain::solve` does; 3 says that the matrix states larger errors than were asked for.
fn solve(matrix: &Path, mesh: &Path, output: &Path) {
    let mut solve = tool("solve-tool");
    solve.arg("solve").arg(matrix).arg("--mesh").arg(mesh).args(["--tolerance", "1e-3", "-o"]).arg(output);
    let done = run(&mut solve);
    assert!(matches!(done.code, Some(0 | 3)), "{}", done.stderr);
}

/// Runs a comparison, prints it, and hands back its JSON.
fn compared(tool_name: &str, arguments: &[&Path], flags: &[&str]) -> Value {
    let comparison = |json: &[&str]| {
        let mut command = tool(tool_name);
        run(command.arg("compare").args(arguments).args(flags).args(json)).expect_code(0).stdout
    };
    println!("{}", comparison(&[]));
    serde_json::from_str(&comparison(&["--json"])).unwrap()
}

/// The largest relative difference of a quantity over the channels.
fn relative(comparison: &Value, quantity: &str) -> f64 {
    let channels = comparison[quantity]["relative"].as_array().unwrap();
    channels.iter().map(|x| x.as_f64().unwrap()).fold(0.0, f64::max)
}

/// 1024 rays for each element: a factor F has the standard deviation sqrt(F (1 - F) / 1024), so that a row of 200 factors is
/// off by some tenths in all; the radiosity averages it away.
#[test]
fn ray_traced_form_factors() {
    let Some(python) = python_with_numpy("ray_traced_form_factors") else { return };
    let folder = tests::folder();
    let chain = ours(folder.path());
    let [matrix, solution] = ["rays.ff", "rays.sol"].map(|name| folder.path().join(name));
    let mut rays = stage(&python, "form_factors.py");
    run(rays.arg("compute").arg(chain.path("mesh")).arg("-o").arg(&matrix)).expect_code(0);
    let factors = compared("formfactor-tool", &[&chain.path("ff"), &matrix], &[]);
    let mean = factors["row_difference"]["mean"].as_f64().unwrap();
    // Mean of |error| of a normal deviate is 0.8 of its deviation; both sides averaged make 0.56.
    let stated = factors["second"]["row_errors"]["mean"].as_f64().unwrap();
    assert!(mean > 0.3 * stated && mean < 0.8 * stated, "differs by {mean}, stated {stated}");
    solve(&matrix, &chain.path("mesh"), &solution);
    let mesh = chain.path("mesh");
    let light = compared(
        "solve-tool",
        &[&chain.path("sol"), &solution, Path::new("--mesh"), &mesh],
        &["--by", "group"],
    );
    assert!(relative(&light, "radiosity") < 0.02, "{light}");
}

/// The same equations from the same matrix: no more apart than the two bounds, each relative to the emitted power.
#[test]
fn a_numpy_solver() {
    let Some(python) = python_with_numpy("a_numpy_solver") else { return };
    let folder = tests::folder();
    let chain = ours(folder.path());
    let output = folder.path().join("numpy.sol");
    let mut solver = stage(&python, "solver.py");
    solver.arg("solve").arg(chain.path("ff")).arg("--mesh").arg(chain.path("mesh"));
    run(solver.args(["--tolerance", "1e-3", "-o"]).arg(&output)).expect_code(0);
    let mesh = chain.path("mesh");
    let light = compared("solve-tool", &[&chain.path("sol"), &output, Path::new("--mesh"), &mesh], &[]);
    assert!(relative(&light, "radiosity") <= 2e-3, "{light}");
}

/// Even grids that know of no shadow's edge and no contact: the light of the groups is still nearly the same.
#[test]
fn a_mesh_made_elsewhere() {
    let Some(python) = python_with_numpy("a_mesh_made_elsewhere") else { return };
    let folder = tests::folder();
    let chain = ours(folder.path());
    let [mesh, matrix, solution] = ["grid.mesh", "grid.ff", "grid.sol"].map(|name| folder.path().join(name));
    let mut mesher = stage(&python, "mesher.py");
    mesher.arg("build").arg(tests::scene("cornell_blocks.obj")).args(["--elements", "300", "-o"]).arg(&mesh);
    run(&mut mesher).expect_code(0);
    compared("mesh-tool", &[&chain.path("mesh"), &mesh], &[]);
    let mut compute = tool("formfactor-tool");
    run(compute.arg("compute").arg(&mesh).args(["--tolerance", "1e-3", "-o"]).arg(&matrix)).expect_code(0);
    solve(&matrix, &mesh, &solution);
    let places = [
        &chain.path("sol"),
        &solution,
        Path::new("--mesh"),
        &chain.path("mesh"),
        Path::new("--second-mesh"),
        &mesh,
    ];
    let light = compared("solve-tool", &places, &[]);
    assert_eq!(light["by"], "group");
    assert!(relative(&light, "radiosity") < 0.02 && relative(&light, "irradiance") < 0.03, "{light}");
}

/// Points of the .vtu, interpolated linearly: apart from edges (no pixel is averaged over its area) the same picture, as far as
/// means over some hundred elements go. Half of the pixels were 2.4 (blue) to 3.8 % (red) of the mean apart; a picture that is
/// mirrored, or off by a factor of pi, is so by more than 30 %.
#[test]
fn a_renderer_that_reads_vtk() {
    let Some(python) = python_with_numpy("a_renderer_that_reads_vtk") else { return };
    let folder = tests::folder();
    let chain = ours(folder.path());
    let pictures: Vec<PathBuf> =
        ["ours.exr", "vtk.exr"].iter().map(|name| folder.path().join(name)).collect();
    for (mut command, picture) in
        [tool("shade-tool"), stage(&python, "renderer.py")].into_iter().zip(&pictures)
    {
        command
            .arg("render")
            .arg(chain.path("sol"))
            .arg("--mesh")
            .arg(chain.path("mesh"))
            .arg("-o")
            .arg(picture);
        command.arg("--png").arg(picture.with_extension("png")).args(["--size", "64x64", "--camera"]);
        run(command.arg(tests::scene("cornell_blocks.toml"))).expect_code(0);
    }
    let apart = compared("shade-tool", &[&pictures[0], &pictures[1]], &[]);
    for channel in ["R", "G", "B"] {
        let found = apart["channels"].as_array().unwrap().iter().find(|c| c["name"] == channel).unwrap();
        let median = found["relative_median"].as_f64().unwrap();
        assert!(median < 0.05, "{found}");
    }
    compared("shade-tool", &[&pictures[0].with_extension("png"), &pictures[1].with_extension("png")], &[]);
}

/// All four in one pipeline, called by make as our own would be.
#[test]
fn a_pipeline_of_nothing_but_foreign_stages() {
    let Some(python) = python_with_numpy("a_pipeline_of_nothing_but_foreign_stages") else { return };
    let folder = tests::folder();
    let mut make = tests::pipeline::make_command(folder.path());
    make.env("RADIOSITY_MESH_TOOL", program("mesh-tool")).env("RADIOSITY_SOLVE_TOOL", program("solve-tool"));
    let stages = [
        ("MESH_TOOL", "mesher.py"),
        ("FORMFACTOR_TOOL", "form_factors.py"),
        ("SOLVE_TOOL", "solver.py"),
        ("SHADE_TOOL", "renderer.py"),
    ];
    for (variable, name) in stages {
        let path = tests::root().join("tests/swap").join(name);
        make.arg(format!("{variable}={} {}", python.display(), path.display()));
    }
    let scene = tests::scene("cornell_blocks.obj");
    make.arg(format!("SCENE={}", scene.display())).args(["OUT=out", "ERROR=0.5", "SHADE_FLAGS=--size 32x32"]);
    run(&mut make).expect_code(0);
    for (name, magic) in [("exr", [0x76, 0x2f, 0x31, 0x01]), ("png", [0x89, b'P', b'N', b'G'])] {
        let bytes = tests::bytes(&folder.path().join(format!("out/cornell_blocks.{name}")));
        assert_eq!(bytes[..4], magic);
    }
}

/// The reader of `docs/radiosity_files.py`: arrays are those that our own exports hold, a damaged file is refused.
#[test]
fn the_numpy_reader_agrees_with_our_exports() {
    let Some(python) = python_with_numpy("the_numpy_reader_agrees_with_our_exports") else { return };
    let folder = tests::folder();
    let chain = ours(folder.path());
    let [factors, light] = ["f.npy", "b.npy"].map(|name| folder.path().join(name));
    for (name, input, output) in [("formfactor-tool", "ff", &factors), ("solve-tool", "sol", &light)] {
        let mut export = tool(name);
        export.arg("export").arg(chain.path(input)).arg("--mesh").arg(chain.path("mesh"));
        run(export.args(["--by", "element", "-o"]).arg(output)).expect_code(0);
    }
    let check = r#"
import sys; sys.path.insert(0, sys.argv[1])
import numpy as np, radiosity_files as rf
mesh, matrix, solution = (rf.read(path) for path in sys.argv[2:5])
factors, light = np.load(sys.argv[5]), np.load(sys.argv[6])
assert abs(rf.dense(matrix) - factors).max() <= 1e-15
assert abs(rf.row(matrix, 7) - factors[7]).max() <= 1e-15
same = lambda a, b: np.allclose(a, b, rtol=1e-14, atol=0)  # means of one element, multiplied and divided by its area
assert same(solution["radiosity"], light[:, 1:4]) and same(solution["irradiance"], light[:, 4:7])
areas = np.linalg.norm(rf.vector_areas(rf.polygons(mesh)), axis=1)
assert abs(areas / light[:, 0] - 1).max() <= 1e-12
assert matrix.record["mesh"] == mesh.digest and solution.provenance["inputs"]["mesh"] == mesh.digest
assert rf.read(sys.argv[2], verify=False)["vertices"].base is not None
data = bytearray(open(sys.argv[3], "rb").read()); data[-1] ^= 1
open(sys.argv[3], "wb").write(data)
try:
    rf.read(sys.argv[3])
except rf.FormatError as error:
    print(error)
else:
    sys.exit("damage was not found")
"#;
    let mut script = Command::new(&python);
    script.arg("-c").arg(check).arg(tests::root().join("docs"));
    script.args(["mesh", "ff", "sol"].map(|ending| chain.path(ending))).args([&factors, &light]);
    let done = run(&mut script).expect_code(0);
    assert!(done.stdout.contains("is damaged"), "{}", done.stdout);
}
