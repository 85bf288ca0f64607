//! Closure of closed scenes: the smallest symmetric change that makes every row sum 1 (least-squares smoothing, Vercammen
//! & Froment 1980; Larsen & Howell 1986).
//!
//! Minimise sum (X_ij - S_ij)^2 / w_ij over symmetric X with X 1 = A and w = S^2, so that zeros stay zero and the change is
//! relative: X_ij = S_ij + w_ij (l_i + l_j), where (diag(w 1) + w) l = A - S 1. That system is symmetric positive
//! semidefinite; conjugate gradients with its diagonal solve it in a few steps, each one pass over the blocks on disk.
//!
//! # Limitations
//! Whether a scene is open is told by its row sums alone: where one falls short of 1 by more than its own estimated error.

mod passes;
pub mod raw;
#[cfg(test)]
mod tests;

use crate::store::Store;
use clap::ValueEnum;
use interchange::matrix::Precision;
use interchange::report::Report;
use interchange::tool::{STEPS_OF_FALL, progress, show_fall};
use passes::Passes;

/// Largest defect of a row sum that is closed: a larger one is an error to be looked at, not to be hidden.
const LARGEST_DEFECT: f64 = 0.01;
/// Row sums of f32 entries are closed to the spacing of f32 at 1: a rest of it says nothing.
const F32_TARGET: f64 = f32::EPSILON as f64;
/// Row sums of f64 entries are closed to what summation leaves of some thousand terms in blocks.
const F64_TARGET: f64 = 16.0 * f64::EPSILON;
/// Ridge, relative to the diagonal. Where a component of the visibility graph is bipartite (two plates that face each
/// other), the sum of its two sides is fixed and one combination of multipliers has no effect on X: the ridge picks a small
/// one and costs the other rows this share of their defect.
const RIDGE: f64 = 1e-13;
/// Closure that leaves more than this share of the largest defect is none.
const LARGEST_REST: f64 = 1e-3;
/// Most steps of conjugate gradients: rooms take 3 to 15.
const MOST_STEPS: usize = 200;
/// Most times that entries which would become negative are set to 0 and the rest is closed anew.
const MOST_ROUNDS: usize = 20;

/// What to do about row sums of a closed scene that are not 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Closure {
    /// Leave the factors as computed
    Off,
    /// Leave them, and say how far their row sums are from 1
    Report,
    /// Change them as little as makes every row sum 1; refused where one is off by more than 1 % or the scene is open
    LeastSquares,
}

/// Why a matrix is not closed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClosureError {
    /// A row sum is too far from 1.
    #[error(
        "closure: element {element}: found row sum {sum:.6}, expected 1 within {LARGEST_DEFECT}; such an error is not to be \
         smoothed away: use --closure report, and a smaller --tolerance where the scene is closed"
    )]
    Defect {
        /// The worst element.
        element: usize,
        /// Its row sum.
        sum: f64,
    },
    /// A row sum falls short of 1 by more than its estimated error.
    #[error(
        "closure: element {element}: found row sum {sum:.9}, below 1 by more than its estimated error {error:.1e}: the scene \
         is open; use --closure report"
    )]
    Open {
        /// An element that loses light.
        element: usize,
        /// Its row sum.
        sum: f64,
        /// Its estimated error.
        error: f64,
    },
    /// The two sides of some part of the scene have different areas, or rounding is in the way.
    #[error(
        "closure: no symmetric change of the factors makes the row sums 1: the largest defect would go from {before:.1e} to \
         {after:.1e} only; use --closure report"
    )]
    Unsolvable {
        /// Largest defect of a row sum.
        before: f64,
        /// The same after the best change.
        after: f64,
    },
}

/// What closure found and did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Closed {
    /// Whether factors were changed.
    pub applied: bool,
    /// Largest |row sum - 1| as computed.
    pub defect_before: f64,
    /// Largest |row sum - 1| now.
    pub defect_after: f64,
    /// Largest |l_i| A_i.
    pub largest_multiplier: f64,
    /// Largest relative change of a factor.
    pub largest_change: f64,
    /// Largest sum over j of |change of F_ij|.
    pub largest_row_change: f64,
    /// Steps of conjugate gradients.
    pub steps: usize,
    /// Entries set to 0 because they would have become negative.
    pub clamped: usize,
}

impl Closed {
    /// Writes what was found into a report.
    pub fn note(&self, report: &mut Report) {
        report.estimate("row-sum defect before closure", self.defect_before);
        report.count("closure applied", usize::from(self.applied));
        if self.applied {
            report.estimate("row-sum defect after closure", self.defect_after);
            report.estimate("closure: largest multiplier", self.largest_multiplier);
            report.estimate("closure: largest relative change of a factor", self.largest_change);
            report.estimate("closure: largest change of a row", self.largest_row_change);
            report.count("closure steps", self.steps);
            report.count("closure entries set to zero", self.clamped);
        }
    }
}

/// Does what was asked; where nothing was, closes a scene whose row sums are all within their own estimated errors of 1
/// and only reports on others. `None` with `off`.
///
/// # Errors
/// `least-squares` was asked for and the scene is open or too far from closed; or the file cannot be read or written.
pub fn close(store: &mut Store, asked: Option<Closure>) -> anyhow::Result<Option<Closed>> {
    if asked == Some(Closure::Off) {
        return Ok(None);
    }
    let found = Closed { defect_before: worst(&store.row_sums()), ..Closed::default() };
    let found = Closed { defect_after: found.defect_before, ..found };
    let obstacle = obstacle(&store.row_sums(), &store.row_errors);
    match (asked, obstacle) {
        (Some(Closure::LeastSquares), Err(obstacle)) => Err(obstacle.into()),
        (Some(Closure::LeastSquares), Ok(())) => least_squares(store)?.map(Some).map_err(Into::into),
        // By itself closure changes only what is certainly closed.
        (None, Ok(())) if within_errors(&store.row_sums(), &store.row_errors) => {
            Ok(Some(least_squares(store)?.unwrap_or(found)))
        }
        _ => Ok(Some(found)),
    }
}

fn worst(row_sums: &[f64]) -> f64 {
    row_sums.iter().map(|sum| (sum - 1.0).abs()).fold(0.0, f64::max)
}

fn within_errors(row_sums: &[f64], row_errors: &[f64]) -> bool {
    row_sums.iter().zip(row_errors).all(|(sum, error)| (sum - 1.0).abs() <= *error)
}

/// Why these row sums are not to be closed, if they are not.
fn obstacle(row_sums: &[f64], row_errors: &[f64]) -> Result<(), ClosureError> {
    let defect = |&i: &usize| (row_sums[i] - 1.0).abs();
    let worst = (0..row_sums.len()).max_by(|i, j| defect(i).total_cmp(&defect(j)));
    if let Some(element) = worst.filter(|i| defect(i) > LARGEST_DEFECT) {
        return Err(ClosureError::Defect { element, sum: row_sums[element] });
    }
    match (0..row_sums.len()).find(|&i| 1.0 - row_sums[i] > row_errors[i]) {
        Some(element) => {
            Err(ClosureError::Open { element, sum: row_sums[element], error: row_errors[element] })
        }
        None => Ok(()),
    }
}

/// Closes the matrix. The inner error leaves it as it was.
fn least_squares(store: &mut Store) -> interchange::Result<Result<Closed, ClosureError>> {
    let precision = store.precision;
    let target = match precision {
        Precision::F32 => F32_TARGET,
        Precision::F64 => F64_TARGET,
    };
    let row_sums = store.row_sums();
    let mut closed = Closed { defect_before: worst(&row_sums), ..Closed::default() };
    closed.defect_after = closed.defect_before;
    if closed.defect_before <= target {
        return Ok(Ok(closed));
    }

    let areas = store.areas.clone();
    let mut passes = Passes::new(&mut store.writer, areas.len());
    let mut sums: Vec<f64> = row_sums.iter().zip(&areas).map(|(sum, area)| sum * area).collect();
    let mut multipliers = Vec::new();
    for _ in 0..MOST_ROUNDS {
        let defects: Vec<f64> = areas.iter().zip(&sums).map(|(area, sum)| area - sum).collect();
        let weights = passes.weights()?;
        let solved = conjugate_gradients(&mut passes, &weights, &areas, defects, target)?;
        closed.steps += solved.steps;
        if solved.defect > (LARGEST_REST * closed.defect_before).max(target) {
            let (before, after) = (closed.defect_before, solved.defect);
            return Ok(Err(ClosureError::Unsolvable { before, after }));
        }
        multipliers = solved.multipliers;
        // S_ij is at most sqrt(sum over j of S_ij^2): no entry becomes negative where the multipliers are this small.
        let bound = multipliers.iter().zip(&weights).map(|(l, w)| l.abs() * w.sqrt()).fold(0.0, f64::max);
        if 2.0 * bound < 1.0 || !passes.clamp_negative(&multipliers)? {
            break;
        }
        sums = passes.sums()?;
    }

    let replaced = passes.replace(&multipliers, precision)?;
    closed.clamped = passes.clamped();
    closed.applied = true;
    closed.largest_multiplier = multipliers.iter().zip(&areas).map(|(l, a)| l.abs() * a).fold(0.0, f64::max);
    closed.largest_change = replaced.largest_change;
    for (i, (error, change)) in store.row_errors.iter_mut().zip(&replaced.changes).enumerate() {
        let change = change / areas[i];
        closed.largest_row_change = closed.largest_row_change.max(change);
        // The truth is closed too, so a change within the estimate does not lead away from it; a larger one says that
        // the estimate was too small.
        if change > *error {
            *error += change;
        }
    }
    store.sums = replaced.sums;
    closed.defect_after = worst(&store.row_sums());
    Ok(Ok(closed))
}

struct Solved {
    multipliers: Vec<f64>,
    /// Largest |defect of a row sum| that is left.
    defect: f64,
    steps: usize,
}

/// Solves (diag(w 1) + w + ridge) l = `defects` until no row's defect is above `target` of its area.
fn conjugate_gradients(
    passes: &mut Passes<'_>,
    weights: &[f64],
    areas: &[f64],
    defects: Vec<f64>,
    target: f64,
) -> interchange::Result<Solved> {
    let n = areas.len();
    let scaled = |r: &[f64]| -> Vec<f64> {
        r.iter().zip(weights).map(|(r, w)| if *w > 0.0 { r / w } else { 0.0 }).collect()
    };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    // What is left of the defects without the ridge's help.
    let measure = |r: &[f64], l: &[f64]| -> f64 {
        (0..n).map(|i| ((r[i] + RIDGE * weights[i] * l[i]) / areas[i]).abs()).fold(0.0, f64::max)
    };
    let mut residual = defects;
    let mut current = vec![0.0; n];
    let mut best = current.clone();
    let mut solved = Solved { multipliers: Vec::new(), defect: measure(&residual, &current), steps: 0 };
    let mut preconditioned = scaled(&residual);
    let mut direction = preconditioned.clone();
    let mut descent = dot(&residual, &preconditioned);
    let (bar, first) = (progress("closure", STEPS_OF_FALL), solved.defect);
    while solved.defect > target && solved.steps < MOST_STEPS && descent > 0.0 {
        let mut image = passes.apply(&direction)?;
        for i in 0..n {
            image[i] += RIDGE * weights[i] * direction[i];
        }
        let curvature = dot(&direction, &image);
        if curvature.is_nan() || curvature <= 0.0 {
            break;
        }
        let length = descent / curvature;
        for i in 0..n {
            current[i] += length * direction[i];
            residual[i] -= length * image[i];
        }
        solved.steps += 1;
        let now = measure(&residual, &current);
        if now < solved.defect {
            solved.defect = now;
            best.clone_from(&current);
        }
        show_fall(&bar, first, solved.defect, target);
        preconditioned = scaled(&residual);
        let next = dot(&residual, &preconditioned);
        let turn = next / descent;
        descent = next;
        for i in 0..n {
            direction[i] = preconditioned[i] + turn * direction[i];
        }
    }
    solved.multipliers = best;
    Ok(solved)
}
