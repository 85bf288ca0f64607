//! The four programs one after another on one scene, without make: each stage as a command, and all of them in order.

use crate::programs::{Run, run, tool};
use crate::table::Table;
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
    /// Flags of `formfactor-tool compute`.
    pub matrix_flags: Vec<String>,
    /// Flags of `solve-tool solve`.
    pub solve_flags: Vec<String>,
    /// Flags of every stage.
    pub common: Vec<String>,
}

impl Chain {
    /// A scene, meshed into about `elements` elements, with its files in `folder` named `s.*`.
    pub fn new(scene: PathBuf, folder: &Path, elements: u32) -> Self {
        let mesh_flags = vec!["--elements".into(), elements.to_string()];
        Self { mesh_flags, ..Self::as_given(scene, folder) }
    }

    /// A scene whose faces are its elements, with its files in `folder` named `s.*`.
    pub fn as_given(scene: PathBuf, folder: &Path) -> Self {
        let matrix_flags = vec!["--tolerance".into(), "1e-3".into()];
        let (mesh_flags, solve_flags, common) = (Vec::new(), Vec::new(), Vec::new());
        Self { folder: folder.to_owned(), scene, mesh_flags, matrix_flags, solve_flags, common }
    }

    /// The same chain with these tolerances of matrix and solution.
    pub fn with_tolerances(mut self, matrix: &str, solution: &str) -> Self {
        self.matrix_flags = vec!["--tolerance".into(), matrix.into()];
        self.solve_flags = vec!["--tolerance".into(), solution.into()];
        self
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
            Stage::Compute => command.arg("compute").arg(self.path("mesh")).args(&self.matrix_flags),
            Stage::Solve => {
                command.arg("solve").arg(self.path("ff")).arg("--mesh").arg(self.path("mesh"));
                command.args(&self.solve_flags)
            }
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

/// What the numbers' tests ask of the chain: each stage must end with 0, its tolerance met.
impl Chain {
    /// Mesh and matrix.
    #[track_caller]
    pub fn compute(&self) {
        for stage in [Stage::Build, Stage::Compute] {
            run(&mut self.command(stage)).expect_code(0);
        }
    }

    /// Mesh, matrix and solution.
    #[track_caller]
    pub fn solve(&self) {
        self.compute();
        run(&mut self.command(Stage::Solve)).expect_code(0);
    }

    /// The matrix as a table, `by` face or group.
    #[track_caller]
    pub fn factors(&self, by: &str) -> Table {
        self.export(tool("formfactor-tool"), "ff", by)
    }

    /// The solution as a table, `by` element, face or group.
    #[track_caller]
    pub fn radiosities(&self, by: &str) -> Table {
        self.export(tool("solve-tool"), "sol", by)
    }

    #[track_caller]
    fn export(&self, mut export: Command, ending: &str, by: &str) -> Table {
        let output = self.folder.join(format!("{ending}_{by}.csv"));
        export.arg("export").arg(self.path(ending)).arg("--mesh").arg(self.path("mesh")).args(["--by", by]);
        run(export.arg("-o").arg(&output)).expect_code(0);
        Table::read(&output)
    }

    /// Irradiance at points, each with a normal; the columns are those of `shade-tool probe`.
    #[track_caller]
    pub fn probe(&self, points: &[[f64; 6]]) -> Table {
        let (asked, output) = (self.folder.join("points.csv"), self.folder.join("probed.csv"));
        let line = |point: &[f64; 6]| point.map(|x| format!("{x:?}")).join(",");
        let lines: Vec<String> = points.iter().map(line).collect();
        let text = format!("x,y,z,nx,ny,nz\n{}\n", lines.join("\n"));
        std::fs::write(&asked, text).unwrap_or_else(|e| panic!("{}: {e}", asked.display()));
        let mut probe = tool("shade-tool");
        probe.arg("probe").arg(self.path("sol")).arg("--mesh").arg(self.path("mesh"));
        run(probe.arg("--points").arg(&asked).arg("-o").arg(&output)).expect_code(0);
        let table = Table::read(&output);
        assert_eq!(table.rows.len(), points.len());
        table
    }

    /// A number of the report beside the file with this ending, such as `estimates` / `solver bound`.
    #[track_caller]
    pub fn reported(&self, ending: &str, part: &str, key: &str) -> f64 {
        let path = self.path(&format!("{ending}.report.json"));
        let report: serde_json::Value = serde_json::from_str(&crate::text(&path)).expect("a report in JSON");
        report[part][key].as_f64().unwrap_or_else(|| panic!("{}: no {part} / {key}", path.display()))
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
