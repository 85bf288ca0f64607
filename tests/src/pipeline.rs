//! `pipeline.mk` run on a small scene with stand-ins for the tools, so that a log tells which stages ran.

use crate::programs::{Run, TOOLS, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The log of a full run.
pub const ALL: [&str; 5] = [
    "mesh-tool materials",
    "mesh-tool build",
    "formfactor-tool compute",
    "solve-tool solve",
    "shade-tool render",
];

/// Longer than the step of any file system's clock on Linux (4 ms), so that an edit is newer than what came before.
const CLOCK_STEP: Duration = Duration::from_millis(15);

const OBJ: &str = "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\ng floor\nusemtl white\nf 1 2 3\n";
const MTL: &str = "newmtl white\nKd 0.5 0.5 0.5\nKe 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 10 10 10\n";
const TOML: &str = "[camera]\neye = [0, 0, 1]\n";

/// A folder with a scene, stand-ins for the tools and an output folder.
#[derive(Debug)]
pub struct Pipeline {
    folder: tempfile::TempDir,
    /// Folder that make is called in.
    pub working_folder: PathBuf,
    /// Variables given to make, besides the tools.
    pub variables: Vec<String>,
}

impl Pipeline {
    /// The scene `room.obj` with `paint.mtl` and `room.toml`.
    pub fn new() -> Self {
        let folder = crate::folder();
        let working_folder = folder.path().to_owned();
        let variables = vec!["SCENE=room.obj".into(), "OUT=out".into()];
        let pipeline = Self { folder, working_folder, variables };
        pipeline.write("room.obj", OBJ);
        pipeline.write("paint.mtl", MTL);
        pipeline.write("room.toml", TOML);
        std::fs::create_dir(pipeline.path("bin")).expect("a folder for the stand-ins");
        for tool in TOOLS {
            pipeline.write(&format!("bin/{tool}"), include_str!("fake_tool.sh"));
            make_executable(&pipeline.path(&format!("bin/{tool}")));
        }
        pipeline
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file of the folder, later than everything made so far.
    pub fn write(&self, name: &str, text: &str) {
        std::thread::sleep(CLOCK_STEP);
        std::fs::write(self.path(name), text).unwrap_or_else(|e| panic!("{name}: {e}"));
    }

    /// Replaces a part of a file of the folder, which must be there.
    pub fn edit(&self, name: &str, from: &str, to: &str) {
        let text = crate::text(&self.path(name));
        assert!(text.contains(from), "{name} holds no {from:?}");
        self.write(name, &text.replacen(from, to, 1));
    }

    /// Removes a file of the folder.
    pub fn remove(&self, name: &str) {
        std::fs::remove_file(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    }

    /// Sets, or with `None` takes back, the exit code of a stand-in.
    pub fn exit_with(&self, tool: &str, code: Option<i32>) {
        let name = format!("bin/{tool}.exit");
        match code {
            Some(code) => self.write(&name, &code.to_string()),
            None => self.remove(&name),
        }
    }

    /// Runs make with further arguments.
    pub fn make(&self, arguments: &[&str]) -> Run {
        let mut make = make_command(&self.working_folder);
        make.args(&self.variables);
        for (variable, tool) in ["MESH_TOOL", "FORMFACTOR_TOOL", "SOLVE_TOOL", "SHADE_TOOL"].iter().zip(TOOLS)
        {
            make.arg(format!("{variable}={}", self.path("bin").join(tool).display()));
        }
        run(make.args(arguments))
    }

    /// What the stand-ins logged since the last call.
    pub fn log(&self) -> Vec<String> {
        let path = self.path("bin/log");
        let lines = std::fs::read_to_string(&path).unwrap_or_default();
        let _ = std::fs::remove_file(&path);
        lines.lines().map(str::to_owned).collect()
    }

    /// Runs make, which must succeed and run exactly the `expected` stages; a second make must have nothing to do.
    #[track_caller]
    pub fn expect(&self, arguments: &[&str], expected: &[&str]) {
        let done = self.make(arguments).expect_code(0);
        assert_eq!(self.log(), expected, "make said: {}{}", done.stdout, done.stderr);
        self.expect_nothing(arguments);
    }

    /// Make must find nothing to do, in its own words.
    #[track_caller]
    pub fn expect_nothing(&self, arguments: &[&str]) {
        let again = self.make(arguments).expect_code(0);
        assert_eq!(again.stdout, "make: Nothing to be done for 'all'.\n", "{}", again.stderr);
        assert_eq!(again.stderr, "");
        self.make(&[arguments, &["-q"]].concat()).expect_code(0);
        assert_eq!(self.log(), [""; 0]);
    }
}

impl Default for Pipeline {
    fn default() -> Self {
        Self::new()
    }
}

/// `make -f pipeline.mk` in `folder`, without what an outer make passes on to inner ones.
pub fn make_command(folder: &Path) -> Command {
    let mut make = Command::new("make");
    make.current_dir(folder).arg("-f").arg(crate::root().join("pipeline.mk"));
    for variable in ["MAKEFLAGS", "MFLAGS", "MAKEOVERRIDES", "MAKELEVEL", "CARGO_TARGET_DIR"] {
        make.env_remove(variable);
    }
    make.env("LC_ALL", "C");
    make
}

/// Lets a file be run.
pub fn make_executable(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(path, mode).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}
