//! The four programs: found beside the test that runs, built where missing or older than a source, and run.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::SystemTime;

/// Names of the programs, in the order of the pipeline.
pub const TOOLS: [&str; 4] = ["mesh-tool", "formfactor-tool", "solve-tool", "shade-tool"];

/// Path of a program, built with the profile of the running test.
///
/// Cargo builds a package's programs for its own tests only, so these may be missing or stale.
pub fn program(name: &str) -> PathBuf {
    // A failed build is kept too, so that not every test of a binary tries it again.
    static FOLDER: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = profile_folder();
        let newest = newest_source();
        let stale = |tool: &&str| modified(&folder.join(tool)).is_none_or(|built| built < newest);
        if TOOLS.iter().any(stale) {
            build(&folder)?;
        }
        Ok(folder)
    });
    match folder {
        Ok(folder) => folder.join(name),
        Err(said) => panic!("building the tools failed: {said}"),
    }
}

/// A command that runs a program.
pub fn tool(name: &str) -> Command {
    Command::new(program(name))
}

/// `target/<profile>`, from `target/<profile>/deps/<test>`.
fn profile_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of the running test");
    test.parent().and_then(Path::parent).expect("a test lies in target/<profile>/deps").to_owned()
}

fn build(folder: &Path) -> Result<(), String> {
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(name) => name,
    };
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(crate::root()).args(["build", "--quiet", "--profile", profile]);
    // All of the workspace: by themselves the programs' dependencies have other features, and would be built once more.
    cargo.arg("--workspace").arg("--target-dir").arg(folder.parent().expect("a target folder"));
    let done = run(&mut cargo);
    if done.code == Some(0) { Ok(()) } else { Err(done.stderr) }
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|m| m.modified()).ok()
}

/// Time of the newest source file that the programs are built from.
fn newest_source() -> SystemTime {
    fn newest(folder: &Path) -> SystemTime {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let times = entries.map(|entry| match entry.path() {
            path if path.is_dir() => newest(&path),
            path => modified(&path).unwrap_or(SystemTime::UNIX_EPOCH),
        });
        times.max().unwrap_or(SystemTime::UNIX_EPOCH)
    }
    let rooms = TOOLS.iter().chain(&["interchange", "geometry"]);
    let times = rooms.map(|room| newest(&crate::root().join(room).join("src")));
    times.max().unwrap_or(SystemTime::UNIX_EPOCH)
}

/// How a command ended and what it said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    /// Exit code; none where a signal ended it.
    pub code: Option<i32>,
    /// Data.
    pub stdout: String,
    /// Talk.
    pub stderr: String,
}

impl Run {
    /// Panics unless the command ended with `code`; returns itself for further checks.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Self {
        assert!(
            self.code == Some(code),
            "exit {:?}, expected {code}\nstdout: {}\nstderr: {}",
            self.code,
            self.stdout,
            self.stderr
        );
        self
    }

    /// Panics unless the command said `part` on stderr.
    #[track_caller]
    pub fn expect_said(self, part: &str) -> Self {
        assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        self
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Runs a command to its end.
pub fn run(command: &mut Command) -> Run {
    command.output().unwrap_or_else(|e| panic!("{command:?}: {e}")).into()
}
