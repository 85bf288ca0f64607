//! Gauss-Seidel: the elements gather one after another, each from the newest values of all others (Cohen & Greenberg
//! 1985 solve so). About half of Jacobi's sweeps; a sweep reads every entry once per channel.
//!
//! With d the changes of H in a sweep, row i at its turn has the residual r_i + sum over j < i of S_ij rho_j d_j, and
//! keeps what comes later, sum over j > i of S_ij rho_j d_j.

use super::{Indefinite, Method};
use crate::equation::Equation;
use crate::product::Product;
use crate::product::rows::RowIndex;
use crate::work::Work;

pub(super) struct GaussSeidel<'a> {
    rows: RowIndex<'a>,
    diagonal: Vec<f64>,
}

impl<'a> GaussSeidel<'a> {
    pub fn new(product: &'a Product<'a>) -> Self {
        let rows = RowIndex::new(product);
        let diagonal = (0..product.element_count())
            .map(|i| {
                let mut own = 0.0;
                rows.for_row(i, |j, s| own += if j == i { s } else { 0.0 });
                own
            })
            .collect();
        Self { rows, diagonal }
    }

    /// One sweep over the rows that reflect; the others feed nothing back.
    fn sweep(&self, equation: &mut Equation<'_>) {
        let n = equation.areas.len();
        let rho = equation.reflectance;
        let mut shot = vec![0.0; n];
        let mut left = vec![0.0; n];
        for i in (0..n).filter(|&i| rho[i] > 0.0) {
            let mut residual = equation.residual[i];
            self.rows.for_row(i, |j, s| {
                if j < i {
                    residual += s * shot[j];
                }
            });
            let change = residual / (equation.areas[i] - self.diagonal[i] * rho[i]);
            equation.irradiance[i] += change;
            shot[i] = rho[i] * change;
            self.rows.for_column(i, |j, s| {
                if j < i {
                    left[j] += s * shot[i];
                }
            });
        }
        equation.residual = left;
    }
}

impl Method for GaussSeidel<'_> {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        loop {
            let active = work.active();
            if active.is_empty() {
                return Ok(());
            }
            work.count_step();
            for c in active {
                self.sweep(&mut work.equations[c]);
                work.judge(c, false);
            }
            work.end_step();
        }
    }
}
