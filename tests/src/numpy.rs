//! A Python with numpy, for what shows that other programs can stand in for ours.

use std::path::PathBuf;
use std::process::Command;

/// How to get one, for the message of a test that is skipped.
const REMEDY: &str = "python3 -m venv target/numpy && target/numpy/bin/pip install numpy";

/// The first of `RADIOSITY_PYTHON`, the virtual environment `target/numpy` (which `.ci/run` makes) and `python3` that
/// imports numpy. Without one the test cannot be done: `None`, and the reason on stderr.
pub fn python_with_numpy(test: &str) -> Option<PathBuf> {
    let asked = std::env::var_os("RADIOSITY_PYTHON").map(PathBuf::from);
    let made = crate::root().join("target/numpy/bin/python3");
    let candidates = asked.into_iter().chain([made, "python3".into()]);
    let found = candidates.into_iter().find(|python| {
        let mut import = Command::new(python);
        import.args(["-c", "import numpy"]).output().is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        eprintln!("{test}: skipped: no Python with numpy; get one with: {REMEDY}");
    }
    found
}
