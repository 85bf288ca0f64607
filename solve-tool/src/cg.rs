//! Conjugate gradients (Hestenes & Stiefel 1952) with the diagonal as preconditioner, all channels in one pass over
//! the matrix per step.
//!
//! In the rho-weighted inner product of [`crate::equation`] the preconditioned residual is r / A: the amount by which
//! F B exceeds H. So the residual that the stopping bound needs costs nothing. A closed room has one eigenvalue near
//! 1 - rho and the others near 1, which is why about ten steps do for any reflectance.

use crate::equation::{Equation, apply};
use crate::product::Product;

/// Steps without progress after which a channel gives up.
const STAGNATION_STEPS: u32 = 3;
/// Relative change of the residual that counts as progress.
const STAGNATION_CHANGE: f64 = 0.01;
/// In exact arithmetic n unknowns take n steps; rounding can delay the end, so twice that many are allowed.
const STEPS_PER_UNKNOWN: usize = 2;
/// Beyond this many steps the time is better spent on looking at the scene.
const MOST_STEPS: usize = 20_000;

/// How one channel's iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// The measure fell below the target.
    Converged,
    /// It stopped falling, or took too many steps.
    GaveUp,
}

/// The channel whose operator is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Indefinite(pub usize);

/// A channel on its way.
struct Search {
    direction: Vec<f64>,
    /// r . r / A, rho-weighted.
    descent: f64,
    measure: f64,
    best: (f64, Vec<f64>),
    /// Sum of the decrements of the error's energy norm, squared: its value at the start, in the end.
    gained: f64,
    /// Whether the last step counted in that sum.
    gaining: bool,
    idle_steps: u32,
    end: Option<End>,
}

impl Search {
    fn new(equation: &Equation<'_>, measure: f64, target: f64) -> Self {
        let descent = descent(equation);
        let end = match measure <= target {
            true => Some(End::Converged),
            // Squares that underflow leave no direction to go.
            false => (descent == 0.0).then_some(End::GaveUp),
        };
        let best = (measure, equation.irradiance.clone());
        let direction = preconditioned(equation);
        Self { direction, descent, measure, best, gained: 0.0, gaining: true, idle_steps: 0, end }
    }

    /// One step, given S (rho p). False where the operator turns out not to be positive definite.
    fn step(&mut self, equation: &mut Equation<'_>, reflected: &[f64]) -> bool {
        let n = reflected.len();
        let image: Vec<f64> = (0..n).map(|i| equation.areas[i] * self.direction[i] - reflected[i]).collect();
        let curvature: f64 = (0..n).map(|i| equation.reflectance[i] * self.direction[i] * image[i]).sum();
        if curvature.is_nan() || curvature <= 0.0 {
            return false;
        }
        let length = self.descent / curvature;
        equation.irradiance.iter_mut().zip(&self.direction).for_each(|(h, p)| *h += length * p);
        equation.residual.iter_mut().zip(&image).for_each(|(r, q)| *r -= length * q);
        let gain = length * self.descent;
        self.gained += gain;
        let next = descent(equation);
        let turn = next / self.descent;
        self.descent = next;
        let steepest = preconditioned(equation);
        for (p, z) in self.direction.iter_mut().zip(steepest) {
            *p = z + turn * *p;
        }
        self.gaining = gain > f64::EPSILON * self.gained;
        true
    }

    /// Takes note of the measure after a step.
    fn judge(&mut self, equation: &Equation<'_>, measure: f64, target: f64) {
        // A residual may stand still for some steps while the error still falls (one step per nearly closed room);
        // only where the step did not count in the energy norm either is it idle.
        let moving = (measure - self.measure).abs() >= STAGNATION_CHANGE * self.measure;
        self.idle_steps = if moving || self.gaining { 0 } else { self.idle_steps + 1 };
        self.measure = measure;
        if measure < self.best.0 {
            self.best.0 = measure;
            self.best.1.clone_from(&equation.irradiance);
        }
        if measure <= target {
            self.end = Some(End::Converged);
        } else if self.idle_steps >= STAGNATION_STEPS || self.descent == 0.0 {
            self.end = Some(End::GaveUp);
        }
    }
}

fn preconditioned(equation: &Equation<'_>) -> Vec<f64> {
    equation.residual.iter().zip(equation.areas).map(|(r, a)| r / a).collect()
}

fn descent(equation: &Equation<'_>) -> f64 {
    let terms = equation.residual.iter().zip(equation.areas).zip(equation.reflectance);
    terms.map(|((r, a), rho)| rho * r * (r / a)).sum()
}

/// Improves the iterates until `measure(channel, equation)` is at most `target` for each channel, it stagnates, or
/// `most_steps` are done. `after_product` sees the measures after each pass over the matrix. Where a channel gives
/// up, its equation is left with the best iterate seen and a residual that has to be computed anew.
pub(crate) fn improve(
    product: &Product<'_>,
    equations: &mut [Equation<'_>],
    measure: impl Fn(usize, &Equation<'_>) -> f64,
    target: f64,
    most_steps: Option<usize>,
    mut after_product: impl FnMut(&[f64]),
) -> Result<Vec<End>, Indefinite> {
    let unknowns = equations.iter().map(Equation::unknowns).max().unwrap_or(0);
    let most_steps = most_steps.unwrap_or((STEPS_PER_UNKNOWN * unknowns + 10).min(MOST_STEPS));
    let mut searches: Vec<Search> =
        equations.iter().enumerate().map(|(c, e)| Search::new(e, measure(c, e), target)).collect();

    for _ in 0..most_steps {
        let active: Vec<usize> = (0..searches.len()).filter(|&c| searches[c].end.is_none()).collect();
        if active.is_empty() {
            break;
        }
        let shot: Vec<Vec<f64>> = active
            .iter()
            .map(|&c| {
                searches[c].direction.iter().zip(equations[c].reflectance).map(|(p, rho)| rho * p).collect()
            })
            .collect();
        for (&c, reflected) in active.iter().zip(apply(product, &shot)) {
            if !searches[c].step(&mut equations[c], &reflected) {
                return Err(Indefinite(c));
            }
            let now = measure(c, &equations[c]);
            searches[c].judge(&equations[c], now, target);
        }
        let measures: Vec<f64> = searches.iter().map(|s| s.measure).collect();
        after_product(&measures);
    }

    let ends = searches.into_iter().zip(equations).map(|(search, equation)| {
        if search.end != Some(End::Converged) {
            equation.irradiance = search.best.1;
        }
        search.end.unwrap_or(End::GaveUp)
    });
    Ok(ends.collect())
}
