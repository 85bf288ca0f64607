//! Direct solution for small systems: Cholesky's factorisation of the symmetric, scaled system, one factor per
//! distinct reflectance vector.
//!
//! With t = sqrt(A rho) H the equation of [`crate::equation`] reads (I - D S D) t = D c, D = diag(sqrt(rho / A)),
//! on the rows with rho > 0: unit diagonal but for S_ii, symmetric, and no division by rho.

use super::{Indefinite, Method};
use crate::equation::Equation;
use crate::part::Setup;
use crate::product::Product;
use crate::work::{End, Work};
use interchange::tool::progress;
use std::ops::ControlFlow;

/// The factors of all channels.
pub(super) struct Direct {
    factors: Vec<Factor>,
    /// Which of them each channel has.
    index: Vec<usize>,
}

impl Direct {
    /// Factors the systems, each distinct reflectance once.
    pub fn new(setup: &Setup<'_>) -> Result<Self, Indefinite> {
        let (mut factors, mut index, mut owners): (Vec<Factor>, Vec<usize>, Vec<usize>) = Default::default();
        for (c, rho) in setup.reflectances.iter().enumerate() {
            let known = owners.iter().position(|&owner| setup.reflectances[owner] == *rho);
            index.push(known.unwrap_or(factors.len()));
            if known.is_none() {
                factors.push(Factor::new(setup.whole, setup.areas, rho).ok_or(Indefinite(c))?);
                owners.push(c);
            }
        }
        Ok(Self { factors, index })
    }
}

impl Method for Direct {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        for c in work.active() {
            self.factors[self.index[c]].improve(&mut work.equations[c]);
            work.finish(c, End::Converged);
        }
        Ok(())
    }
}

/// Lower triangular factor L with L L^T = I - D S D.
#[derive(Debug)]
struct Factor {
    /// Elements with rho > 0.
    rows: Vec<usize>,
    /// D on those rows.
    scale: Vec<f64>,
    /// Rows of L, packed: row i starts at i (i + 1) / 2.
    lower: Vec<f64>,
}

impl Factor {
    /// Factors the system; `None` where it is not positive definite.
    fn new(product: &Product<'_>, areas: &[f64], reflectance: &[f64]) -> Option<Self> {
        let rows: Vec<usize> = (0..areas.len()).filter(|&i| reflectance[i] > 0.0).collect();
        let scale: Vec<f64> = rows.iter().map(|&i| (reflectance[i] / areas[i]).sqrt()).collect();
        let mut place = vec![None; areas.len()];
        rows.iter().enumerate().for_each(|(unknown, &i)| place[i] = Some(unknown));

        let mut lower = vec![0.0; rows.len() * (rows.len() + 1) / 2];
        (0..rows.len()).for_each(|i| lower[row_start(i) + i] = 1.0);
        product.for_each_until(|i, j, s| {
            if let (Some(a), Some(b)) = (place[i], place[j]) {
                lower[row_start(a.max(b)) + a.min(b)] -= scale[a] * s * scale[b];
            }
            ControlFlow::Continue(())
        });
        cholesky(&mut lower, rows.len()).then_some(Self { rows, scale, lower })
    }

    /// Adds to the iterate the correction that its residual asks for.
    fn improve(&self, equation: &mut Equation<'_>) {
        let mut t: Vec<f64> =
            self.rows.iter().zip(&self.scale).map(|(&i, d)| d * equation.residual[i]).collect();
        // L y = D r, row by row.
        for i in 0..t.len() {
            let row = &self.lower[row_start(i)..=row_start(i) + i];
            t[i] = (t[i] - dot(&row[..i], &t[..i])) / row[i];
        }
        // L^T t = y, column by column, so that L is read along its rows.
        for i in (0..t.len()).rev() {
            let row = &self.lower[row_start(i)..=row_start(i) + i];
            t[i] /= row[i];
            let solved = t[i];
            t[..i].iter_mut().zip(row).for_each(|(t, l)| *t -= l * solved);
        }
        for ((&i, d), t) in self.rows.iter().zip(&self.scale).zip(t) {
            // t = sqrt(A rho) H = (rho / D) H
            equation.irradiance[i] += t * d / equation.reflectance[i];
        }
    }
}

fn row_start(row: usize) -> usize {
    row * (row + 1) / 2
}

/// Factors the packed lower triangle in place; false where a pivot is not positive.
fn cholesky(lower: &mut [f64], n: usize) -> bool {
    // The work up to row i grows with its cube.
    let bar = progress("factorisation", n.saturating_pow(3));
    for i in 0..n {
        bar.set_position(i.saturating_pow(3) as u64);
        let (above, row) = lower.split_at_mut(row_start(i));
        for j in 0..i {
            let other = &above[row_start(j)..=row_start(j) + j];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        row[i] = pivot.sqrt();
    }
    true
}

/// Sum of products in eight partial sums, an order the compiler can keep in vector registers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_chunks, a_rest) = a.as_chunks::<8>();
    let (b_chunks, b_rest) = b.as_chunks::<8>();
    let mut partial = [0.0; 8];
    for (a, b) in a_chunks.iter().zip(b_chunks) {
        for lane in 0..8 {
            partial[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    partial.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cholesky_of_a_known_matrix() {
        // [[4, 2, 2], [2, 5, 3], [2, 3, 6]] = L L^T with L = [[2], [1, 2], [1, 1, 2]]
        let mut lower = vec![4.0, 2.0, 5.0, 2.0, 3.0, 6.0];
        assert!(cholesky(&mut lower, 3));
        assert_eq!(lower, [2.0, 1.0, 2.0, 1.0, 1.0, 2.0]);
        assert!(!cholesky(&mut [1.0, 2.0, 1.0], 2), "an indefinite matrix was factored");
    }
}
