//! Runs one case: the commands are those `make -n` says, so what is measured is what the pipeline does.

use super::measure::{Cost, End, measure, report};
use super::plan::{Case, scene_file};
use crate::pipeline::make_command;
use crate::programs::{TOOLS, program, run};
use interchange::digest::Digest;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Commands of the stages, one line each, as the pipeline would run them in a new folder; those of other make variables
/// too, such as `FF_FLAGS=...`.
pub fn commands(scene: &Path, out: &Path, error: f64, variables: &[String]) -> Vec<String> {
    let mut make = make_command(&crate::root());
    make.args(["-n", "-B"]).arg(format!("SCENE={}", scene.display())).arg(format!("OUT={}", out.display()));
    make.arg(format!("ERROR={error}")).args(variables);
    for (variable, tool) in ["MESH_TOOL", "FORMFACTOR_TOOL", "SOLVE_TOOL", "SHADE_TOOL"].iter().zip(TOOLS) {
        make.arg(format!("{variable}={}", program(tool).display()));
    }
    let said = run(&mut make).expect_code(0).stdout;
    let spoken = said.lines().filter_map(|line| line.strip_prefix("printf '%s\\n' '")?.strip_suffix('\''));
    let commands: Vec<String> = spoken.map(str::to_owned).collect();
    assert_eq!(commands.len(), 5, "five stages were expected of make -n: {said}");
    commands
}

/// What a run of a case gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// `done`, `over the budget of N s in STAGE` or `failed in STAGE: ...`.
    pub state: String,
    /// Cost of mesh, matrix, solution and picture.
    pub costs: [Cost; 4],
    /// Elements of the mesh.
    pub elements: u64,
    /// The outputs' common beginning.
    pub prefix: PathBuf,
}

/// The commands of a case with their outputs in this folder of `work`, from the mesh on.
pub fn case_commands(case: &Case, work: &Path, folder: &str) -> (PathBuf, Vec<String>) {
    let scene = scene_file(&case.scene, work);
    let name = scene.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let out = work.join(folder);
    let mut variables = vec![format!("FF_FLAGS={}", case.matrix_flags())];
    if case.mesh == "uniform" {
        let (area, elements) = size_wanted(&scene, work, case.error);
        variables.push(format!("MESH_FLAGS={}", case.mesh_flags(area, elements)));
    } else if !case.matrix_only() {
        variables.push(format!("MESH_FLAGS={}", case.mesh_flags(0.0, 0.0)));
    }
    let mut commands = commands(&scene, &out, case.error, &variables);
    if case.matrix_only() {
        // The quads are the elements, so that all errors share one mesh.
        let words = commands[1].split(" --elements ").next().unwrap_or_default().to_owned();
        commands = vec![words, commands[2].clone()];
    } else {
        commands.remove(0);
    }
    (out.join(name), commands)
}

/// Area of the scene's faces and the number of elements the pipeline asks for, for a uniform mesh of that size.
fn size_wanted(scene: &Path, work: &Path, error: f64) -> (f64, f64) {
    let line = &commands(scene, &work.join("none"), error, &[])[1];
    let mut words = line.split_whitespace().skip_while(|word| *word != "--elements").skip(1);
    let elements = words.next().and_then(|n| n.parse().ok()).expect("make -n says the number of elements");
    let given = work.join("given.mesh");
    let mut build = crate::tool("mesh-tool");
    run(build.arg("build").arg(scene).arg("-o").arg(&given)).expect_code(0);
    (report(&given)["estimates"]["area of faces"].as_f64().expect("an area in the mesh's report"), elements)
}

/// How the state of a case begins that was not run, or not to its end, because it takes longer than `budget_s`.
pub fn over(budget_s: f64) -> String {
    format!("over the budget of {budget_s:.0} s")
}

/// Runs the commands one after another, all of them together for at most `budget`.
pub fn run_commands(prefix: &Path, commands: &[String], budget: Duration) -> Outcome {
    let folder = prefix.parent().expect("outputs lie in a folder");
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let (start, mut costs, mut state) = (Instant::now(), [Cost::default(); 4], "done".to_owned());
    for (stage, (line, cost)) in commands.iter().zip(&mut costs).enumerate() {
        let mut words = line.split_whitespace();
        let mut command = Command::new(words.next().expect("a program"));
        command.args(words).current_dir(crate::root());
        let output = prefix.with_extension(["mesh", "ff", "sol", "exr"][stage]);
        let name = ["mesh", "form factors", "solution", "picture"][stage];
        match measure(&mut command, &output, budget.saturating_sub(start.elapsed())) {
            End::Done(taken) => *cost = taken,
            End::OverBudget => state = format!("{} in {name}", over(budget.as_secs_f64())),
            End::Failed(said) => state = format!("failed in {name}: {}", said.replace([',', '"'], ";")),
        }
        if state != "done" {
            break;
        }
    }
    let mesh = report(&prefix.with_extension("mesh"));
    let elements = mesh["counters"]["elements"].as_u64().unwrap_or(0);
    Outcome { state, costs, elements, prefix: prefix.to_owned() }
}

/// Digest of programs, scene and commands: what a row's numbers follow from.
pub fn key(case: &Case, commands: &[String], work: &Path) -> String {
    let mut text = format!("{case:?}\n");
    let scene = scene_file(&case.scene, work);
    // The programs, 100 MB of them, stay the same as long as this one runs: read once for the hundreds of cases.
    static PROGRAMS: OnceLock<[String; 4]> = OnceLock::new();
    let digest = |file: PathBuf| format!("{}\n", Digest::of(&std::fs::read(file).unwrap_or_default()));
    PROGRAMS.get_or_init(|| TOOLS.map(program).map(digest)).iter().for_each(|line| text += line);
    ["obj", "mtl", "toml"].iter().for_each(|e| text += &digest(scene.with_extension(e)));
    let (work, folder) = (work.display().to_string(), program(TOOLS[0]));
    let folder = folder.parent().map(|f| f.display().to_string()).unwrap_or_default();
    commands.iter().for_each(|line| text += &line.replace(&work, "").replace(&folder, ""));
    Digest::of(text.as_bytes()).to_string()[..16].to_owned()
}
