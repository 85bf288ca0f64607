//! `pipeline.mk` with the real tools: what an edit reruns by make's own output, and a run killed at any moment is taken
//! up by the next one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tests::damage::Dice;
use tests::pipeline::{ALL, make_command};
use tests::{Run, TOOLS, bytes, program, run};

const MATERIALS: &str = ALL[0];
const SOLVE: &str = ALL[3];
const RENDER: &str = ALL[4];

/// A copy of the Cornell box in a folder of its own.
struct Scene {
    folder: TempDir,
}

impl Scene {
    fn new() -> Self {
        let folder = tests::folder();
        for ending in ["obj", "mtl", "toml"] {
            let name = format!("cornell_blocks.{ending}");
            std::fs::copy(tests::scene(&name), folder.path().join(name)).unwrap();
        }
        Self { folder }
    }

    fn make(&self, arguments: &[&str]) -> Command {
        let mut make = make_command(self.folder.path());
        make.args(["SCENE=cornell_blocks.obj", "OUT=out", "ERROR=0.5", "SHADE_FLAGS=--size 40x40"]);
        for (variable, tool) in ["MESH_TOOL", "FORMFACTOR_TOOL", "SOLVE_TOOL", "SHADE_TOOL"].iter().zip(TOOLS)
        {
            make.arg(format!("{variable}={}", program(tool).display()));
        }
        make.args(arguments);
        make
    }

    /// Runs make, which must run exactly the `expected` stages; a second make must have nothing to do.
    #[track_caller]
    fn expect(&self, expected: &[&str]) {
        let done = run(&mut self.make(&[])).expect_code(0);
        assert_eq!(stages(&done), expected, "{}{}", done.stdout, done.stderr);
        let again = run(&mut self.make(&[])).expect_code(0);
        assert_eq!(again.stdout, "make: Nothing to be done for 'all'.\n", "{}", again.stderr);
        run(&mut self.make(&["-q"])).expect_code(0);
    }

    /// Replaces a part of a scene file, later than everything made so far.
    fn edit(&self, ending: &str, from: &str, to: &str) {
        std::thread::sleep(Duration::from_millis(15));
        let path = self.folder.path().join(format!("cornell_blocks.{ending}"));
        let text = tests::text(&path);
        assert!(text.contains(from), "{from:?} is not in {text}");
        std::fs::write(path, text.replacen(from, to, 1)).unwrap();
    }

    fn output(&self, ending: &str) -> PathBuf {
        self.folder.path().join(format!("out/cornell_blocks.{ending}"))
    }
}

/// The stages that make says it runs, one line each.
fn stages(done: &Run) -> Vec<String> {
    let command = |line: &str| {
        let mut words = line.split_whitespace();
        let tool = Path::new(words.next()?).file_name()?.to_str()?.to_owned();
        TOOLS.contains(&tool.as_str()).then(|| format!("{tool} {}", words.next().unwrap_or_default()))
    };
    done.stdout.lines().filter_map(command).collect()
}

/// The second matrix takes the factors of elements that did not change from the first, in one piece or in shards; a colour
/// reaches it through the refined mesh only.
#[test]
fn two_passes_reuse_the_factors_of_unchanged_elements() {
    let scene = Scene::new();
    let reused = |ending: &str| {
        let path = interchange::report::Report::path_for(&scene.output(ending));
        interchange::report::Report::read(&path).unwrap().counters["pairs reused"]
    };
    let done = run(&mut scene.make(&["PASSES=2"])).expect_code(0);
    let passes = [&ALL[1..4], &ALL[1..5]].concat();
    assert_eq!(stages(&done)[1..], passes, "{}{}", done.stdout, done.stderr);
    assert!(reused("ff") > 0 && reused("first.ff") == 0);
    let again = run(&mut scene.make(&["PASSES=2"])).expect_code(0);
    assert_eq!(again.stdout, "make: Nothing to be done for 'all'.\n", "{}", again.stderr);
    let whole = bytes(&scene.output("ff"));
    run(&mut scene.make(&["PASSES=2", "SHARDS=2"])).expect_code(0);
    assert!(bytes(&scene.output("ff")) == whole);
    assert!(reused("1of2.ff") + reused("2of2.ff") > 0);
    // Another first matrix means another second one.
    let done = run(&mut scene.make(&["PASSES=2", "FF_FLAGS=--tolerance 0.4"])).expect_code(0);
    assert!(stages(&done).iter().filter(|stage| *stage == ALL[2]).count() == 2, "{}", done.stdout);
    // A method that cannot reuse is not asked to.
    let done = run(&mut scene.make(&["-n", "PASSES=2", "FF_FLAGS=--method area"])).expect_code(0);
    assert!(!done.stdout.contains("--reuse") && !done.stdout.contains("--closure"), "{}", done.stdout);
    run(&mut scene.make(&["PASSES=2", "clean"])).expect_code(0);
    run(&mut scene.make(&["PASSES=2", "SHARDS=2", "clean"])).expect_code(0);
    assert_eq!(std::fs::read_dir(scene.folder.path().join("out")).unwrap().count(), 0);
}

#[test]
fn edits_rerun_exactly_the_stages_they_touch() {
    let scene = Scene::new();
    scene.expect(&ALL);
    let (mesh, matrix) = (bytes(&scene.output("mesh")), bytes(&scene.output("ff")));
    scene.edit("mtl", "Kd 0.725 0.71 0.68", "Kd 0.25 0.5 0.125");
    scene.expect(&[MATERIALS, SOLVE, RENDER]);
    scene.edit("mtl", "Ke 17.0 12.0 4.0", "Ke 1 2 3");
    scene.expect(&[MATERIALS, SOLVE, RENDER]);
    scene.edit("toml", "up = [0, 1, 0]", "up = [0.1, 1, 0]");
    scene.expect(&[MATERIALS, RENDER]);
    assert_eq!(bytes(&scene.output("mesh")), mesh);
    assert_eq!(bytes(&scene.output("ff")), matrix);
    scene.edit("obj", "v 343.0 548.8 227.0", "v 340.0 548.8 227.0");
    scene.expect(&ALL);
    // A deleted matrix comes back with the same bytes, and the unchanged solution spares the picture.
    std::fs::remove_file(scene.output("ff")).unwrap();
    scene.expect(&ALL[2..4]);
}

#[test]
fn a_scene_that_is_not_there_is_explained_with_the_nearest_name() {
    let scene = Scene::new();
    let done = run(&mut scene.make(&["SCENE=cornell_block.obj"])).expect_code(2);
    assert!(
        done.stderr.contains("did you mean") && done.stderr.contains("cornell_blocks.obj"),
        "{}",
        done.stderr
    );
}

#[test]
fn a_run_killed_at_any_moment_is_taken_up_by_the_next() {
    let reference = Scene::new();
    let start = Instant::now();
    run(&mut reference.make(&[])).expect_code(0);
    let whole = start.elapsed();

    let scene = Scene::new();
    let mut dice = Dice::new(2);
    let full = tests::damage::full();
    for kill in 0..if full { 200 } else { 8 } {
        let mut make = scene.make(&[]);
        let mut child = make.process_group(0).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_micros(dice.below(whole.as_micros() as usize) as u64));
        // The whole process group, so that the running stage dies with make and tidies nothing up.
        let group = format!("-{}", child.id());
        let _ = Command::new("kill").args(["-9", "--", &group]).output();
        child.wait().unwrap();
        let _ = std::fs::remove_file(scene.output(["mesh", "ff", "sol", "exr"][dice.below(4)]));
        if full {
            run(&mut scene.make(&[])).expect_code(0);
            for ending in ["mesh", "ff", "sol", "exr", "png"] {
                assert_eq!(
                    bytes(&scene.output(ending)),
                    bytes(&reference.output(ending)),
                    "kill {kill}: {ending}"
                );
            }
            std::fs::remove_file(scene.output("ff")).unwrap();
            std::fs::remove_file(scene.output("sol")).unwrap();
        }
    }
    run(&mut scene.make(&[])).expect_code(0);
    for ending in ["materials", "surfaces", "mesh", "ff", "sol", "exr", "png"] {
        assert_eq!(bytes(&scene.output(ending)), bytes(&reference.output(ending)), "{ending}");
    }
    run(&mut scene.make(&["-q"])).expect_code(0);
}
