//! The four programs one after another on one scene, without make: each stage as a command, and all of them in order.

use crate::programs::{Run, run, tool};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A stage of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// `mesh-tool materials`
    Materials,
    /// `mesh-tool build`
    Build,
    /// `formfactor-tool compute`
    Compute,
    /// `solve-tool solve`
    Solve,
    /// `shade-tool render`
    Render,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Stage; 5] = [Stage::Materials, Stage::Build, Stage::Compute, Stage::Solve, Stage::Render];

    /// Ending of the stage's main output.
    pub fn output(self) -> &'static str {
        match self {
            Stage::Materials => "materials",
            Stage::Build => "mesh",
            Stage::Compute => "ff",
            Stage::Solve => "sol",
            Stage::Render => "exr",
        }
    }

    /// Endings of the files it reads, the scene's own aside.
    pub fn inputs(self) -> &'static [&'static str] {
        match self {
            Stage::Materials | Stage::Build => &[],
            Stage::Compute => &["mesh"],
            Stage::Solve => &["ff", "mesh", "materials"],
            Stage::Render => &["sol", "mesh", "materials"],
        }
    }
}

/// A scene and the folder its files are made in.
#[derive(Debug, Clone)]
pub struct Chain {
    folder: PathBuf,
    scene: PathBuf,
    /// Flags of `mesh-tool build`.
    pub mesh_flags: Vec<String>,
    /// Flags of every stage.
    pub common: Vec<String>,
}

impl Chain {
    /// A scene, meshed into about `elements` elements, with its files in `folder` named `s.*`.
    pub fn new(scene: PathBuf, folder: &Path, elements: u32) -> Self {
        let mesh_flags = vec!["--elements".into(), elements.to_string()];
        Self { folder: folder.to_owned(), scene, mesh_flags, common: Vec::new() }
    }

    /// The file with this ending.
    pub fn path(&self, ending: &str) -> PathBuf {
        self.folder.join(format!("s.{ending}"))
    }

    /// The command of a stage, writing to its usual output.
    pub fn command(&self, stage: Stage) -> Command {
        self.command_to(stage, &self.path(stage.output()))
    }

    /// The command of a stage, writing to `output`.
    pub fn command_to(&self, stage: Stage, output: &Path) -> Command {
        let mut command = match stage {
            Stage::Materials => tool("mesh-tool"),
            Stage::Build => tool("mesh-tool"),
            Stage::Compute => tool("formfactor-tool"),
            Stage::Solve => tool("solve-tool"),
            Stage::Render => tool("shade-tool"),
        };
        match stage {
            Stage::Materials => command.arg("materials").arg(&self.scene),
            Stage::Build => command.arg("build").arg(&self.scene).args(&self.mesh_flags),
            Stage::Compute => command.arg("compute").arg(self.path("mesh")).args(["--tolerance", "1e-3"]),
            Stage::Solve => command.arg("solve").arg(self.path("ff")).arg("--mesh").arg(self.path("mesh")),
            Stage::Render => {
                command.arg("render").arg(self.path("sol")).arg("--mesh").arg(self.path("mesh"));
                command.args(["--size", "40x30", "--png"]).arg(output.with_extension("png"))
            }
        };
        command.arg("-o").arg(output).args(&self.common);
        command
    }

    /// Runs all stages; 3 (written, tolerance missed) is as good as 0 here.
    #[track_caller]
    pub fn run_all(&self) {
        for stage in Stage::ALL {
            let done = run(&mut self.command(stage));
            assert!(matches!(done.code, Some(0 | 3)), "{stage:?}: exit {:?}: {}", done.code, done.stderr);
        }
    }
}

/// Panics unless the run failed as a user mistake should: exit 1, one line on stderr that begins with the tool's name
/// and an error, names `file`, and is no panic.
#[track_caller]
pub fn assert_refused(done: &Run, file: &Path) {
    assert!(!done.stderr.contains("panicked"), "{}", done.stderr);
    assert!(done.code == Some(1), "exit {:?} instead of 1: {}", done.code, done.stderr);
    let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let errors: Vec<&str> = done.stderr.lines().filter(|line| line.contains(": error: ")).collect();
    assert!(errors.len() == 1, "one line with an error was expected: {}", done.stderr);
    assert!(errors[0].contains(&name), "{name} is not named in: {}", done.stderr);
    assert!(errors[0].matches("os error").count() <= 1, "said twice: {}", done.stderr);
}
