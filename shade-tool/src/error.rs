//! What can go wrong in shading.

use std::path::PathBuf;

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A user's mistake, or an input that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that cannot be read, written or used.
    #[error(transparent)]
    File(#[from] interchange::Error),
    /// A camera that sees nothing.
    #[error("camera: {found}; {remedy}")]
    Camera {
        /// What is wrong with it.
        found: String,
        /// What to do.
        remedy: String,
    },
    /// A grid without points, or with too many.
    #[error("grid: {found}; {remedy}")]
    Grid {
        /// What is wrong with it.
        found: String,
        /// What to do.
        remedy: String,
    },
    /// A solution that cannot serve as the one after so many bounces.
    #[error("{}: {found}; {remedy}", path.display())]
    Bounces {
        /// The solution.
        path: PathBuf,
        /// What it is.
        found: String,
        /// What to do.
        remedy: String,
    },
    /// An EXR file that the decoder refuses.
    #[error("{}: not a readable OpenEXR file: {found}; remake it with shade-tool render", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        found: String,
    },
}

impl Error {
    /// A camera that sees nothing.
    pub fn camera(found: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::Camera { found: found.into(), remedy: remedy.into() }
    }

    /// A grid without points, or with too many.
    pub fn grid(found: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::Grid { found: found.into(), remedy: remedy.into() }
    }
}
