//! How `compute` and `merge` store a matrix: precision, sparse blocks, shards, closure.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use assert_cmd::Command;
use common::{clustered, divided, inward_cube, room_with_box};
use interchange::matrix::{BlockKind, Matrix, Precision};
use interchange::provenance::Provenance;
use std::path::{Path, PathBuf};

/// A room with a box in it, 2 x 2 elements a face; the leaves cut across faces, so blocks hold zeros and others.
struct Scene {
    folder: tempfile::TempDir,
    mesh: PathBuf,
}

impl Scene {
    fn room() -> Self {
        Self::of(&divided(&room_with_box(), 2))
    }

    fn of(polygons: &[Vec<[f64; 3]>]) -> Self {
        Self::with_leaves(polygons, 7)
    }

    fn with_leaves(polygons: &[Vec<[f64; 3]>], leaf: u32) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("s.mesh");
        clustered(polygons, leaf).write(&mesh, Provenance::new("test", "1")).unwrap();
        Self { folder, mesh }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, name: &str, flags: &[&str]) -> assert_cmd::assert::Assert {
        let mut command = tool();
        command.arg("compute").arg(&self.mesh).arg("-o").arg(self.path(name)).args(flags);
        if !flags.contains(&"--tolerance") {
            command.args(["--tolerance", "1e-3"]);
        }
        command.assert()
    }

    fn compute(&self, name: &str, flags: &[&str]) -> PathBuf {
        self.run(name, flags).success();
        self.path(name)
    }

    /// What the report beside a file says under this name.
    fn reported(&self, name: &str, key: &str) -> f64 {
        let text = std::fs::read_to_string(self.path(&format!("{name}.report.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let found = report["counters"][key].as_f64().or(report["estimates"][key].as_f64());
        found.unwrap_or_else(|| panic!("{key} is not in {text}"))
    }
}

fn tool() -> Command {
    Command::cargo_bin("formfactor-tool").unwrap()
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

fn entries(path: &Path) -> Vec<Vec<f64>> {
    let matrix = Matrix::open(path).unwrap();
    let n = matrix.element_count();
    let mut s = vec![vec![0.0; n]; n];
    matrix
        .for_each(|i, j, value| {
            s[i][j] = value;
            s[j][i] = value;
        })
        .unwrap();
    s
}

/// The message of a command that must fail with code 1.
fn refusal(command: &mut Command) -> String {
    String::from_utf8(command.assert().code(1).get_output().stderr.clone()).unwrap()
}

#[test]
fn sparse_blocks_and_absent_ones_change_nothing_but_the_length() {
    let scene = Scene::room();
    let flags = ["--closure", "off"];
    let short = scene.compute("short.ff", &flags);
    let long = scene.compute("long.ff", &[&flags[..], &["--no-skip", "zero-blocks"]].concat());
    assert_eq!(entries(&short), entries(&long));
    let kinds = |path: &Path, kind: BlockKind| {
        let matrix = Matrix::open(path).unwrap();
        matrix.views().unwrap().iter().filter(|view| view.block.kind() == Ok(kind)).count()
    };
    assert!(kinds(&short, BlockKind::Sparse) > 0);
    assert_eq!(kinds(&short, BlockKind::Sparse) as f64, scene.reported("short.ff", "blocks sparse"));
    assert_eq!(kinds(&long, BlockKind::Sparse), 0);
    assert!(scene.reported("short.ff", "blocks absent") > 0.0);
    assert_eq!(scene.reported("long.ff", "blocks absent"), 0.0);
    assert!(bytes(&short).len() < bytes(&long).len());
    // The same errors per row, whichever way the entries are stored.
    let errors = |path: &Path| Matrix::open(path).unwrap().row_errors().unwrap().to_vec();
    assert_eq!(errors(&short), errors(&long));
}

#[test]
fn precision_is_as_asked() {
    let scene = Scene::room();
    for (name, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let path = scene.compute("s.ff", &["--precision", name]);
        assert_eq!(Matrix::open(&path).unwrap().record().precision, precision);
        assert!(Matrix::open(&path).unwrap().provenance().flags.contains(&format!("--precision {name}")));
    }
}

#[test]
fn merged_shards_are_the_file_of_one_run() {
    let scene = Scene::room();
    for flags in [
        &[][..],
        &["--closure", "off"],
        &["--tolerance", "1e-2", "--precision", "f64", "--closure", "least-squares"],
    ] {
        let whole = scene.compute("whole.ff", flags);
        for parts in [1, 3] {
            let shards: Vec<PathBuf> = (1..=parts)
                .rev()
                .map(|part| {
                    let shard = format!("{part}/{parts}");
                    scene.compute(&format!("{part}.ff"), &[flags, &["--shard", &shard]].concat())
                })
                .collect();
            let merged = scene.path("merged.ff");
            tool().arg("merge").args(&shards).arg("-o").arg(&merged).assert().success();
            assert!(bytes(&merged) == bytes(&whole), "{flags:?} in {parts} parts");
            // Once more, with other threads: the same bytes.
            let first = format!("1/{parts}");
            let again = [flags, &["--threads", "3", "--shard", &first]].concat();
            let again = scene.compute("again.ff", &again);
            assert!(bytes(&again) == bytes(shards.last().unwrap()), "{flags:?} in {parts} parts");
        }
    }
}

#[test]
fn readers_take_all_parts_and_refuse_some_by_name() {
    let scene = Scene::room();
    let parts: Vec<PathBuf> = (1..=3)
        .map(|part| {
            let shard = format!("{part}/3");
            scene.compute(&format!("{part}.ff"), &["--closure", "off", "--shard", &shard])
        })
        .collect();
    let whole = scene.compute("whole.ff", &["--closure", "off"]);
    let export = |files: &[&PathBuf], output: &str| {
        let mut command = tool();
        command.arg("export").args(files).arg("--mesh").arg(&scene.mesh).args(["--by", "element", "-o"]);
        command.arg(scene.path(output));
        command
    };
    export(&[&whole], "whole.npy").assert().success();
    export(&[&parts[1], &parts[2], &parts[0]], "parts.npy").assert().success();
    assert!(bytes(&scene.path("whole.npy")) == bytes(&scene.path("parts.npy")));
    let info = |files: &[&PathBuf]| -> String {
        let done = tool().arg("info").args(files).assert().success();
        String::from_utf8(done.get_output().stdout.clone()).unwrap()
    };
    assert!(info(&[&parts[1]]).contains("2 of 3"));
    let rows =
        |text: &str| text.lines().filter(|l| l.starts_with("row ")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(rows(&info(&[&parts[0], &parts[1], &parts[2]])), rows(&info(&[&whole])));

    for (files, found) in [
        (vec![&parts[1]], "part 2 of 3; part 1, 3 is missing"),
        (vec![&parts[0], &parts[2]], "part 1, 3 of 3; part 2 is missing"),
        (vec![&parts[0], &parts[0], &parts[1], &parts[2]], "both are part 1 of 3"),
        (vec![&parts[0], &whole], "do not belong together"),
    ] {
        let message = refusal(&mut export(&files, "bad.npy"));
        assert!(message.contains(found) && message.contains(".ff"), "{message}");
        let mut merge = tool();
        let message = refusal(merge.arg("merge").args(&files).arg("-o").arg(scene.path("bad.ff")));
        assert!(message.contains(found), "{message}");
    }
    // A part of the same scene with another tolerance.
    let other = scene.compute("other.ff", &["--closure", "off", "--tolerance", "1e-2", "--shard", "1/3"]);
    let message = refusal(&mut export(&[&other, &parts[1], &parts[2]], "bad.npy"));
    assert!(message.contains("--tolerance 0.01") && message.contains("other.ff"), "{message}");
    assert!(!scene.path("bad.npy").exists() && !scene.path("bad.ff").exists());
}

#[test]
fn closed_rooms_are_closed_by_default_and_open_ones_are_not() {
    let scene = Scene::room();
    let closed = scene.compute("closed.ff", &["--precision", "f64"]);
    let raw = scene.compute("raw.ff", &["--precision", "f64", "--closure", "report"]);
    let defect = |path: &Path| {
        let sums = Matrix::open(path).unwrap().row_sums().unwrap();
        sums.iter().map(|sum| (sum - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(defect(&closed) < 1e-14, "{}", defect(&closed));
    assert!(defect(&raw) > 1e-9, "{}", defect(&raw));
    assert_eq!(scene.reported("closed.ff", "closure applied"), 1.0);
    assert_eq!(scene.reported("raw.ff", "closure applied"), 0.0);
    let before = scene.reported("closed.ff", "row-sum defect before closure");
    assert_eq!(before, scene.reported("raw.ff", "row-sum defect before closure"));
    assert!((before - defect(&raw)).abs() < 1e-12);

    let mut open = inward_cube(0.0, 1.0);
    open.pop();
    let scene = Scene::of(&divided(&open, 3));
    scene.compute("open.ff", &[]);
    assert_eq!(scene.reported("open.ff", "closure applied"), 0.0);
    let mut command = tool();
    command
        .arg("compute")
        .arg(&scene.mesh)
        .args(["--closure", "least-squares", "-o"])
        .arg(scene.path("no.ff"));
    let message = refusal(&mut command);
    assert!(message.contains("found row sum") && message.contains("--closure report"), "{message}");
    assert!(!scene.path("no.ff").exists());
}

#[test]
fn a_dry_run_says_what_a_run_takes_and_writes_nothing() {
    let scene = Scene::room();
    let before = std::fs::read_dir(scene.folder.path()).unwrap().count();
    let done = scene.run("s.ff", &["--dry-run"]).success();
    assert_eq!(std::fs::read_dir(scene.folder.path()).unwrap().count(), before);
    let plan = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    let value = |name: &str| -> String {
        let line = plan.lines().find(|line| line.trim_start().starts_with(name));
        line.unwrap_or_else(|| panic!("{name}: {plan}")).split_whitespace().last().unwrap().to_owned()
    };
    let number = |name: &str| value(name).parse::<usize>().unwrap();
    assert_eq!((number("elements"), number("pairs")), (48, 48 * 49 / 2));
    let classes = ["of one plane", "facing away", "fully blocked", "nothing between", "to be looked at"];
    assert_eq!(classes.map(number).iter().sum::<usize>(), 48 * 49 / 2, "every pair is in one class");
    assert!(number("to be looked at") > 0);
    for name in ["time", "file", "memory"] {
        value(name);
    }
    // What is said of tiles is true of the run.
    scene.compute("s.ff", &[]);
    assert_eq!(number("tiles") as f64, scene.reported("s.ff", "tiles"));
}

#[test]
fn memory_stays_within_what_is_allowed_or_is_refused_with_what_it_takes() {
    // 58 MB of f64 entries, in 64 MiB with everything else.
    let scene = Scene::with_leaves(&divided(&inward_cube(0.0, 1.0), 27), 27);
    let allowed = 64 << 20;
    let flags = ["--precision", "f64", "--memory", "64MiB", "--threads", "2"];
    let done = scene.run("s.ff", &flags).success();
    let said = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(said.contains("memory: at most"), "{said}");
    let file = bytes(&scene.path("s.ff")).len();
    assert!(file > 50 << 20, "the file has {file} bytes");
    let report = std::fs::read_to_string(scene.path("s.ff.report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let peak = report["peak_memory_bytes"].as_u64().unwrap();
    assert!(peak <= allowed, "{peak} bytes of {allowed}");
    let done = scene.run("no.ff", &["--memory", "1MiB"]).code(1);
    let said = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(said.contains("1.0 MiB") && said.contains("at least"), "{said}");
    assert!(!scene.path("no.ff").exists());
    scene.run("no.ff", &["--memory", "much"]).code(2);
}
