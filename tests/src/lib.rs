//! What the end-to-end tests share: temporary folders, the four programs, tables, damage on purpose, and numbers
//! compared with a stated tolerance. Test code throughout: a helper that cannot do its work panics and says why.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod cases;
pub mod chain;
pub mod close;
pub mod damage;
pub mod fuzz;
pub mod numpy;
pub mod pipeline;
pub mod programs;
pub mod proof;
pub mod stress;
pub mod surfaces;
pub mod table;
pub mod two_squares;

pub use close::{Tolerance, assert_close};
pub use programs::{Run, TOOLS, program, run, tool};

use std::path::{Path, PathBuf};

/// Root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").to_owned()
}

/// A file of `tests/scenes`.
pub fn scene(name: &str) -> PathBuf {
    root().join("tests/scenes").join(name)
}

/// A file of `tests/reference`.
pub fn reference(name: &str) -> PathBuf {
    root().join("tests/reference").join(name)
}

/// A temporary folder, removed with its content when dropped.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Text of a file.
pub fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Bytes of a file.
pub fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
