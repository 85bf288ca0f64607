//! The methods that solve the equations, one in each file, and which one is taken where none is asked for.

mod cg;
mod direct;
mod gauss_seidel;
mod gmres;
mod jacobi;
mod southwell;

pub(crate) use cg::ConjugateGradients;

use crate::error::{Result, SolveError};
use crate::part::Setup;
use crate::work::Work;

/// Unknowns up to which `auto` factors: at 256 the factor costs 6e6 multiplications, no more than the ten products
/// that conjugate gradients take.
pub const AUTO_UNKNOWNS: usize = 256;
/// Unknowns up to which a factor is made at all: 1.6 GB and some minutes.
pub const MOST_UNKNOWNS: usize = 20_000;

/// A method that solves the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Solver {
    /// Direct for few unknowns, conjugate gradients for more, GMRES where the matrix is not symmetric
    Auto,
    /// Conjugate gradients, the constant mode deflated
    Cg,
    /// Jacobi: every step one bounce more
    Jacobi,
    /// Gauss-Seidel: every element gathers in turn, with the newest values
    GaussSeidel,
    /// Southwell (progressive refinement): the element with most unshot power shoots
    Southwell,
    /// Cholesky factorisation
    Direct,
    /// Generalised minimal residual, for any matrix
    Gmres,
}

impl Solver {
    /// The name on the command line.
    pub fn name(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self);
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Where the iteration stops for an error of `tolerance` asked of the whole solution. Where a product more costs next to nothing
    /// it takes little and leaves the rest to the matrix: the bound is on all light together, and dark places in
    /// single channels are off by several times as much (0.15 in a gap under a block at a bound of 0.02).
    pub fn stops_at(self, tolerance: f64) -> f64 {
        match self {
            Solver::Auto | Solver::Cg => (OWN_SHARE * tolerance).max(tolerance.min(TIGHTEST)),
            _ => tolerance,
        }
    }
}

/// Share of the asked error that the iteration takes, down to where rounding is near.
const OWN_SHARE: f64 = 0.03;
const TIGHTEST: f64 = 1e-10;

/// Improves iterates step by step, or at once.
pub(crate) trait Method {
    /// Improves the channels that are active until each is at its end. Residuals of the equations are true when called;
    /// afterwards they are what the method believes.
    fn improve(&mut self, work: &mut Work<'_>) -> std::result::Result<(), Indefinite>;
}

/// The channel whose operator is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Indefinite(pub usize);

/// A solver that can take this system, with the reason where it was left to the program.
pub(crate) fn choose(asked: Solver, symmetric: bool, unknowns: usize) -> Result<(Solver, String)> {
    let why = |solver: Solver, reason: String| Ok((solver, format!("{} (auto: {reason})", solver.name())));
    match asked {
        Solver::Auto if !symmetric => why(Solver::Gmres, "the matrix is not symmetric".into()),
        Solver::Auto if unknowns <= AUTO_UNKNOWNS => {
            why(Solver::Direct, format!("{unknowns} unknowns, at most {AUTO_UNKNOWNS}"))
        }
        Solver::Auto => why(Solver::Cg, format!("symmetric, {unknowns} unknowns, more than {AUTO_UNKNOWNS}")),
        Solver::Cg | Solver::Direct if !symmetric => Err(SolveError::NeedsSymmetry { solver: asked.name() }),
        Solver::Direct if unknowns > MOST_UNKNOWNS => {
            Err(SolveError::TooManyUnknowns { unknowns, most: MOST_UNKNOWNS })
        }
        named => Ok((named, named.name())),
    }
}

/// The method itself.
pub(crate) fn method<'a>(
    solver: Solver,
    setup: &Setup<'a>,
) -> std::result::Result<Box<dyn Method + 'a>, Indefinite> {
    Ok(match solver {
        Solver::Jacobi => Box::new(jacobi::Jacobi),
        Solver::GaussSeidel => Box::new(gauss_seidel::GaussSeidel::new(setup.whole)),
        Solver::Southwell => Box::new(southwell::Southwell::new(setup)),
        Solver::Direct => Box::new(direct::Direct::new(setup)?),
        Solver::Gmres => Box::new(gmres::Gmres),
        Solver::Cg | Solver::Auto => Box::new(ConjugateGradients { deflated: setup.deflated }),
    })
}

/// Conjugate gradients, or what a matrix without symmetry needs.
pub(crate) fn of_any(symmetric: bool) -> Box<dyn Method> {
    if symmetric { Box::new(ConjugateGradients { deflated: true }) } else { Box::new(gmres::Gmres) }
}
