//! What can keep a system from being solved.

use crate::lossless::Lossless;

/// Result of everything in this crate that solves.
pub type Result<T> = std::result::Result<T, SolveError>;

/// A system that has no solution, or none that can be had from these files.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// A file that cannot be used.
    #[error(transparent)]
    File(#[from] interchange::Error),
    /// Light that can neither leave nor be absorbed.
    #[error("{0}")]
    Lossless(Lossless),
    /// A matrix whose rows gain more than the surfaces absorb.
    #[error(
        "the system is not positive definite in the {channel} channel: somewhere the rows of the matrix exceed 1 by \
         more than the surfaces absorb; run formfactor-tool compute with a smaller --tolerance, or make the brightest \
         materials darker"
    )]
    NotPositiveDefinite {
        /// Name of the channel.
        channel: &'static str,
    },
    /// The same, where the matrix is not symmetric and only the answer shows it.
    #[error(
        "no finite solution in the {channel} channel: what is reflected comes out below 0, so the rows of the matrix give \
         back as much light as the surfaces absorb, or more (an element sees a mean reflectance of {norm:.3}); use a \
         matrix whose row sums are at most 1, or make the brightest materials darker"
    )]
    Gaining {
        /// Name of the channel.
        channel: &'static str,
        /// Largest column of K, relative to the areas.
        norm: f64,
    },
    /// A matrix in a form that this solver does not take.
    #[error("{path}: {found}; {remedy}")]
    Unsupported {
        /// The matrix file.
        path: String,
        /// What it holds.
        found: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A method that a matrix without symmetry cannot be given to.
    #[error(
        "--solver {solver} needs a symmetric matrix, and this one is not; use --solver gmres (or auto), which takes any"
    )]
    NeedsSymmetry {
        /// Name of the method.
        solver: String,
    },
    /// A direct solve that would not fit into memory.
    #[error(
        "--solver direct factors a dense matrix of {unknowns} unknowns, at most {most} are taken (its time grows with \
         the third power); use --solver cg, which gives the same answer"
    )]
    TooManyUnknowns {
        /// Rows with a reflectance above 0.
        unknowns: usize,
        /// Limit.
        most: usize,
    },
    /// Heat that is not there.
    #[error(
        "group {group}: its net flux of {flux} W m^-2 draws more heat out than arrives: its temperature would have to be \
         below absolute zero; draw less, or heat another group"
    )]
    BelowZero {
        /// Name of the group.
        group: String,
        /// Its net flux.
        flux: f64,
    },
    /// An emission beyond the range of f64.
    #[error("material {material}: Ke {radiance:?} times pi is not a finite number; use other units")]
    ExitanceTooLarge {
        /// Name of the material.
        material: String,
        /// Its radiance.
        radiance: [f64; 3],
    },
}
