//! A killed run is gone on with: the same bytes, less work, and nothing trusted that is damaged or of another run.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{clustered, divided, room_with_box};
use interchange::provenance::Provenance;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A room that takes some seconds, in a folder of its own.
fn scene() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("s.mesh");
    clustered(&divided(&room_with_box(), 3), 4).write(&mesh, Provenance::new("test", "1")).unwrap();
    (folder, mesh)
}

fn command(mesh: &Path, output: &Path, flags: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_formfactor-tool"));
    command.arg("compute").arg(mesh).arg("-o").arg(output).args(["--tolerance", "1e-4"]).args(flags);
    command
}

fn run(mesh: &Path, output: &Path, flags: &[&str]) -> Output {
    command(mesh, output, flags).output().unwrap()
}

fn hidden(output: &Path, word: &str) -> PathBuf {
    let name = output.file_name().unwrap().to_string_lossy();
    output.with_file_name(format!(".{name}.{word}.partial"))
}

fn length(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |data| data.len())
}

/// Starts a run and kills it once some tiles are in its journal.
fn kill_half_way(mesh: &Path, output: &Path) -> Child {
    let mut child = command(mesh, output, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(300);
    while length(&hidden(output, "journal")) < 3000 {
        assert!(child.try_wait().unwrap().is_none(), "the run ended before it could be killed");
        assert!(Instant::now() < deadline, "no tile was finished in time");
        std::thread::sleep(Duration::from_millis(5));
    }
    // While it runs, nobody else may write here.
    let second = run(mesh, output, &["--resume"]);
    assert_eq!(second.status.code(), Some(1));
    assert!(text(&second).contains("wait for it"), "{}", text(&second));
    child.kill().unwrap();
    // Until its parent asks for it, a killed process keeps its number; it must not be taken for one at work.
    std::thread::sleep(Duration::from_millis(200));
    assert!(!output.exists());
    child
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn resumed(output: &Path) -> u64 {
    let report = std::fs::read_to_string(format!("{}.report.json", output.display())).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    report["counters"]["tiles resumed"].as_u64().unwrap()
}

#[test]
fn a_killed_run_is_gone_on_with_and_damage_is_not_trusted() {
    let (folder, mesh) = scene();
    let whole = folder.path().join("whole.ff");
    assert!(run(&mesh, &whole, &[]).status.success());
    let want = std::fs::read(&whole).unwrap();
    let output = folder.path().join("s.ff");
    let mut killed = kill_half_way(&mesh, &output);
    let (work, journal) = (hidden(&output, "work"), hidden(&output, "journal"));
    let left = (std::fs::read(&work).unwrap(), std::fs::read(&journal).unwrap());

    // As left by the kill.
    let done = run(&mesh, &output, &["--resume"]);
    assert!(done.status.success(), "{}", text(&done));
    assert!(std::fs::read(&output).unwrap() == want);
    let tiles = resumed(&output);
    assert!(tiles > 0);
    killed.wait().unwrap();
    assert!(!work.exists() && !journal.exists(), "what is no longer needed is removed");

    // A record, some entries, the first line damaged; the journal cut; another flag; entries of an old matrix; no --resume.
    let old = folder.path().join("old.ff");
    assert!(run(&mesh, &old, &["--closure", "report"]).status.success());
    let (old, old_mesh) = (old.to_str().unwrap(), mesh.to_str().unwrap());
    let title = left.1.iter().position(|&b| b == b'\n').unwrap();
    let mut bad_record = left.1.clone();
    bad_record[title + (left.1.len() - title) / 2] ^= 4;
    let mut bad_entries = left.0.clone();
    let entry = bad_entries.len() / 2;
    bad_entries[entry] ^= 4;
    let mut bad_title = left.1.clone();
    bad_title[3] ^= 4;
    let cut = left.1[..left.1.len() - 5].to_vec();
    for (work_bytes, journal_bytes, flags, most, said) in [
        (&left.0, &bad_record, &["--resume"][..], tiles - 1, "cut short or damaged after"),
        (&bad_entries, &left.1, &["--resume"], tiles - 1, "cut short or damaged after"),
        (&left.0, &cut, &["--resume"], tiles - 1, "cut short or damaged after"),
        (&left.0, &bad_title, &["--resume"], 0, "is damaged: computing everything anew"),
        (&left.0, &left.1, &["--resume", "--precision", "f32"], 0, "is of another run"),
        (&left.0, &left.1, &["--resume", "--reuse", old, "--reuse-mesh", old_mesh], 0, "is of another run"),
        (&left.0, &left.1, &[], 0, "--resume would have gone on"),
    ] {
        std::fs::write(&work, work_bytes).unwrap();
        std::fs::write(&journal, journal_bytes).unwrap();
        std::fs::remove_file(&output).unwrap();
        let done = run(&mesh, &output, flags);
        assert!(done.status.success() && text(&done).contains(said), "{said}: {}", text(&done));
        assert!(resumed(&output) <= most, "{said}: {} of {tiles} tiles", resumed(&output));
        if !flags.contains(&"--precision") && !flags.contains(&"--reuse") {
            assert!(std::fs::read(&output).unwrap() == want, "{said}");
        }
        assert!(!work.exists() && !journal.exists(), "{said}");
    }
}
