//! GMRES (Saad & Schultz 1986), restarted: for matrices that are not symmetric, which conjugate gradients cannot take.
//!
//! Works on (I - F rho) H = F E, the equation divided by the areas, in the inner product weighted with A rho: rows
//! that reflect nothing feed nothing back and weigh nothing. All channels share a pass over the matrix per step.

use super::{Indefinite, Method};
use crate::equation::Equation;
use crate::work::{End, Work};

/// Steps before a restart: the basis of so many vectors is kept. Rooms take about ten.
const RESTART: usize = 50;
/// A new direction smaller than this part of its length before orthogonalisation is rounding: the space is exhausted.
const EXHAUSTED: f64 = 64.0 * f64::EPSILON;

pub(super) struct Gmres;

/// A channel's Krylov space of one cycle.
struct Cycle {
    start: Vec<f64>,
    /// Orthonormal directions.
    basis: Vec<Vec<f64>>,
    /// Columns of the triangular factor.
    triangle: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
    /// The rotated right-hand side.
    rotated: Vec<f64>,
}

impl Cycle {
    /// `None` where nothing is left to be done.
    fn new(equation: &Equation<'_>) -> Option<Self> {
        let direction: Vec<f64> = equation.residual.iter().zip(equation.areas).map(|(r, a)| r / a).collect();
        let length = dot(equation, &direction, &direction).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let basis = vec![direction.iter().map(|x| x / length).collect()];
        let start = equation.irradiance.clone();
        Some(Self { start, basis, triangle: Vec::new(), rotations: Vec::new(), rotated: vec![length] })
    }

    /// What is to be multiplied next.
    fn shot(&self, equation: &Equation<'_>) -> Vec<f64> {
        let newest = self.basis.last().into_iter().flatten();
        newest.zip(equation.reflectance).map(|(v, rho)| rho * v).collect()
    }

    /// Takes S (rho v) of the newest direction; false where the space is exhausted.
    fn extend(&mut self, equation: &Equation<'_>, arriving: &[f64]) -> bool {
        let Some(newest) = self.basis.last() else { return false };
        let mut next: Vec<f64> =
            (0..arriving.len()).map(|i| newest[i] - arriving[i] / equation.areas[i]).collect();
        let before = dot(equation, &next, &next).sqrt();
        // Orthogonalised twice: once loses digits where directions are nearly parallel.
        let mut column = vec![0.0; self.basis.len()];
        for _ in 0..2 {
            for (v, entry) in self.basis.iter().zip(&mut column) {
                let along = dot(equation, &next, v);
                *entry += along;
                next.iter_mut().zip(v).for_each(|(next, v)| *next -= along * v);
            }
        }
        let length = dot(equation, &next, &next).sqrt();
        let exhausted = length <= EXHAUSTED * before;
        for (k, &(cos, sin)) in self.rotations.iter().enumerate() {
            (column[k], column[k + 1]) =
                (cos * column[k] + sin * column[k + 1], cos * column[k + 1] - sin * column[k]);
        }
        let last = self.rotations.len();
        let radius = column[last].hypot(length);
        if !(radius > 0.0 && radius.is_finite()) {
            return false;
        }
        let (cos, sin) = (column[last] / radius, length / radius);
        column[last] = radius;
        let rest = -sin * self.rotated[last];
        self.rotated[last] *= cos;
        self.rotated.push(rest);
        self.rotations.push((cos, sin));
        self.triangle.push(column);
        if !exhausted {
            self.basis.push(next.iter().map(|x| x / length).collect());
        }
        !exhausted
    }

    /// The iterate with the least residual of the space, and that residual.
    fn apply_to(&self, equation: &mut Equation<'_>) {
        let size = self.triangle.len();
        let mut weights = self.rotated[..size].to_vec();
        for k in (0..size).rev() {
            weights[k] /= self.triangle[k][k];
            let solved = weights[k];
            (0..k).for_each(|above| weights[above] -= self.triangle[k][above] * solved);
        }
        equation.irradiance.clone_from(&self.start);
        for (weight, v) in weights.iter().zip(&self.basis) {
            equation.irradiance.iter_mut().zip(v).for_each(|(h, v)| *h += weight * v);
        }
        // The residual lies along the rotated last direction: in the basis it is Q^T (0, .., 0, rest).
        let mut parts = vec![0.0; size + 1];
        parts[size] = self.rotated[size];
        for (k, &(cos, sin)) in self.rotations.iter().enumerate().rev() {
            (parts[k], parts[k + 1]) =
                (cos * parts[k] - sin * parts[k + 1], sin * parts[k] + cos * parts[k + 1]);
        }
        equation.residual.fill(0.0);
        for (part, v) in parts.iter().zip(&self.basis) {
            let terms = equation.residual.iter_mut().zip(v).zip(equation.areas);
            terms.for_each(|((r, v), area)| *r += area * part * v);
        }
    }
}

fn dot(equation: &Equation<'_>, a: &[f64], b: &[f64]) -> f64 {
    let weights = equation.areas.iter().zip(equation.reflectance);
    a.iter().zip(b).zip(weights).map(|((a, b), (area, rho))| area * rho * a * b).sum()
}

impl Method for Gmres {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        work.patience = 2 * RESTART;
        let mut cycles: Vec<Option<Cycle>> = work.equations.iter().map(|_| None).collect();
        loop {
            for c in work.active() {
                if cycles[c].is_none() {
                    cycles[c] = Cycle::new(&work.equations[c]);
                    if cycles[c].is_none() {
                        work.finish(c, End::Stagnated);
                    }
                }
            }
            let active = work.active();
            if active.is_empty() {
                return Ok(());
            }
            let shot: Vec<Vec<f64>> = active
                .iter()
                .map(|&c| cycles[c].as_ref().map_or_else(Vec::new, |cycle| cycle.shot(&work.equations[c])))
                .collect();
            for (&c, arriving) in active.iter().zip(work.multiply(&shot)) {
                let Some(cycle) = &mut cycles[c] else { continue };
                let goes_on = cycle.extend(&work.equations[c], &arriving);
                if !cycle.triangle.is_empty() {
                    cycle.apply_to(&mut work.equations[c]);
                }
                let full = cycle.triangle.len() == RESTART;
                work.judge(c, false);
                if !goes_on || full {
                    cycles[c] = None;
                }
                if !goes_on && work.active().contains(&c) {
                    // The space holds the solution: what is left is rounding, which the caller measures.
                    work.finish(c, End::Stagnated);
                }
            }
            work.end_step();
        }
    }
}
