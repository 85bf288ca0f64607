//! A Python with numpy and other libraries, for what shows that other programs can stand in for ours and read our files.

use std::path::PathBuf;
use std::process::Command;

/// The first of `RADIOSITY_PYTHON`, the virtual environment `target/numpy` (which `.ci/run` makes) and `python3` that
/// imports all of `modules`. Without one the test cannot be done: `None`, and the reason on stderr.
pub fn python_with(test: &str, modules: &[&str]) -> Option<PathBuf> {
    let asked = std::env::var_os("RADIOSITY_PYTHON").map(PathBuf::from);
    let made = crate::root().join("target/numpy/bin/python3");
    let candidates = asked.into_iter().chain([made, "python3".into()]);
    let import = format!("import {}", modules.join(", "));
    let found = candidates.into_iter().find(|python| {
        Command::new(python).args(["-c", &import]).output().is_ok_and(|output| output.status.success())
    });
    if found.is_none() {
        eprintln!(
            "{test}: skipped: no Python with {}; get one with: python3 -m venv target/numpy && target/numpy/bin/pip \
             install {}",
            modules.join(", "),
            modules.join(" ")
        );
    }
    found
}

/// [`python_with`] numpy alone.
pub fn python_with_numpy(test: &str) -> Option<PathBuf> {
    python_with(test, &["numpy"])
}
