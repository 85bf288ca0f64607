//! Jacobi's iteration: B becomes E + rho F B, one bounce more in every step. It converges like |K|^k, K = rho F, and
//! is here to compare with; its iterates from the start are the bounce-limited solutions.

use super::{Indefinite, Method};
use crate::work::Work;

pub(super) struct Jacobi;

impl Method for Jacobi {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        loop {
            let active = work.active();
            if active.is_empty() {
                return Ok(());
            }
            // H += r / A leaves the residual S (rho r / A).
            let unshot: Vec<Vec<f64>> = active.iter().map(|&c| work.equations[c].unshot()).collect();
            for (&c, arriving) in active.iter().zip(work.multiply(&unshot)) {
                let equation = &mut work.equations[c];
                let received = equation.residual.iter().zip(equation.areas);
                equation.irradiance.iter_mut().zip(received).for_each(|(h, (r, area))| *h += r / area);
                equation.residual = arriving;
                work.judge(c, false);
            }
            work.end_step();
        }
    }
}
