//! Conjugate gradients (Hestenes & Stiefel 1952) with the diagonal as preconditioner, all channels in one pass over
//! the matrix per step, and the constant mode deflated (Nicolaides 1987).
//!
//! In the rho-weighted inner product of [`crate::equation`] the preconditioned residual is r / A: the amount by which
//! F B exceeds H. So the residual that the stopping bound needs costs nothing. A closed room has one eigenvalue near
//! 1 - rho and the others near 1, which is why about ten steps do for any reflectance. The mode of the one is nearly
//! H = 1: its part of the solution is found at the start from the energy balance of the room, and every direction is
//! kept conjugate to it. Its image A - S rho is known from the bound, so deflation costs no product.

use super::{Indefinite, Method};
use crate::equation::Equation;
use crate::work::{End, Work};

/// Steps after which a channel gives up that neither its residual nor its energy norm moves.
const PATIENCE: usize = 3;
/// A curvature of the operator down to minus this part of the direction's own is rounding, not a negative eigenvalue.
const CURVATURE_ROUNDING: f64 = 64.0 * f64::EPSILON;

pub(crate) struct ConjugateGradients {
    /// Whether the constant mode is taken out where its image is known.
    pub deflated: bool,
}

/// The constant mode w = 1 in the rho-weighted inner product.
struct ConstantMode {
    /// rho (A - S rho): the mode's image, weighted.
    image: Vec<f64>,
    /// Its inner product with the mode: the power that leaves or is absorbed, of H = 1 everywhere.
    loss: f64,
}

impl ConstantMode {
    /// `None` where the image is not known, or where nothing is lost and the mode cannot be told from rounding.
    fn of(equation: &Equation<'_>) -> Option<Self> {
        let seen = equation.seen?;
        let (areas, rho) = (equation.areas, equation.reflectance);
        let image: Vec<f64> = (0..areas.len()).map(|i| rho[i] * (areas[i] - seen[i])).collect();
        let loss: f64 = image.iter().sum();
        let scale: f64 = areas.iter().zip(rho).map(|(area, rho)| rho * area).sum();
        (loss > areas.len() as f64 * f64::EPSILON * scale).then_some(Self { image, loss })
    }

    /// Moves the iterate along the mode until its residual has no part in it.
    fn project(&self, equation: &mut Equation<'_>) {
        let part: f64 = equation.residual.iter().zip(equation.reflectance).map(|(r, rho)| rho * r).sum();
        let height = part / self.loss;
        for i in 0..equation.residual.len() {
            if equation.reflectance[i] > 0.0 {
                equation.irradiance[i] += height;
                equation.residual[i] -= height * self.image[i] / equation.reflectance[i];
            }
        }
    }

    /// Takes the mode's part out of a direction.
    fn remove(&self, direction: &mut [f64]) {
        let part: f64 = direction.iter().zip(&self.image).map(|(z, image)| z * image).sum();
        let height = part / self.loss;
        direction.iter_mut().for_each(|z| *z -= height);
    }
}

/// A channel on its way.
struct Search {
    direction: Vec<f64>,
    mode: Option<ConstantMode>,
    /// r . r / A, rho-weighted.
    descent: f64,
    /// Sum of the decrements of the error's energy norm, squared: its value at the start, in the end.
    gained: f64,
}

/// How a step went.
enum Step {
    /// It lowered the error's energy norm noticeably.
    Gained,
    /// It did not.
    Idle,
    /// The curvature is lost in rounding.
    Flat,
    /// The operator is not positive definite.
    Indefinite,
}

impl Search {
    fn new(equation: &mut Equation<'_>, deflated: bool) -> Self {
        let mode = if deflated { ConstantMode::of(equation) } else { None };
        if let Some(mode) = &mode {
            mode.project(equation);
        }
        let mut direction = preconditioned(equation);
        if let Some(mode) = &mode {
            mode.remove(&mut direction);
        }
        Self { direction, mode, descent: descent(equation), gained: 0.0 }
    }

    /// One step, given S (rho p).
    fn step(&mut self, equation: &mut Equation<'_>, reflected: &[f64]) -> Step {
        let n = reflected.len();
        let image: Vec<f64> = (0..n).map(|i| equation.areas[i] * self.direction[i] - reflected[i]).collect();
        let weighted = |i: usize| equation.reflectance[i] * self.direction[i];
        let curvature: f64 = (0..n).map(|i| weighted(i) * image[i]).sum();
        let own: f64 = (0..n).map(|i| weighted(i) * equation.areas[i] * self.direction[i]).sum();
        if curvature.is_nan() || curvature < -CURVATURE_ROUNDING * own {
            return Step::Indefinite;
        }
        if curvature <= CURVATURE_ROUNDING * own {
            return Step::Flat;
        }
        let length = self.descent / curvature;
        equation.irradiance.iter_mut().zip(&self.direction).for_each(|(h, p)| *h += length * p);
        equation.residual.iter_mut().zip(&image).for_each(|(r, q)| *r -= length * q);
        let gain = length * self.descent;
        self.gained += gain;
        let next = descent(equation);
        let turn = next / self.descent;
        self.descent = next;
        let mut steepest = preconditioned(equation);
        if let Some(mode) = &self.mode {
            mode.remove(&mut steepest);
        }
        for (p, z) in self.direction.iter_mut().zip(steepest) {
            *p = z + turn * *p;
        }
        if gain > f64::EPSILON * self.gained { Step::Gained } else { Step::Idle }
    }
}

fn preconditioned(equation: &Equation<'_>) -> Vec<f64> {
    equation.residual.iter().zip(equation.areas).map(|(r, a)| r / a).collect()
}

fn descent(equation: &Equation<'_>) -> f64 {
    let terms = equation.residual.iter().zip(equation.areas).zip(equation.reflectance);
    terms.map(|((r, a), rho)| rho * r * (r / a)).sum()
}

impl Method for ConjugateGradients {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        work.patience = PATIENCE;
        let mut searches: Vec<Option<Search>> = work.equations.iter().map(|_| None).collect();
        for c in work.active() {
            searches[c] = Some(Search::new(&mut work.equations[c], self.deflated));
            // The mode alone may have done it.
            work.judge(c, true);
        }
        loop {
            for c in work.active() {
                // Squares that underflow leave no direction to go.
                if searches[c].as_ref().is_none_or(|search| search.descent == 0.0) {
                    work.finish(c, End::Stagnated);
                }
            }
            let active = work.active();
            if active.is_empty() {
                return Ok(());
            }
            let shot: Vec<Vec<f64>> = active
                .iter()
                .map(|&c| {
                    let direction = searches[c].iter().flat_map(|search| &search.direction);
                    direction.zip(work.equations[c].reflectance).map(|(p, rho)| rho * p).collect()
                })
                .collect();
            for (&c, reflected) in active.iter().zip(work.multiply(&shot)) {
                let Some(search) = &mut searches[c] else { continue };
                match search.step(&mut work.equations[c], &reflected) {
                    // A residual may stand still for some steps while the error still falls (one step per nearly
                    // closed room); only where the step did not count in the energy norm either is it idle.
                    Step::Gained => work.judge(c, true),
                    Step::Idle => work.judge(c, false),
                    Step::Flat => work.finish(c, End::BrokeDown),
                    Step::Indefinite => return Err(Indefinite(c)),
                }
            }
            work.end_step();
        }
    }
}
