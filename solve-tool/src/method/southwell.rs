//! Southwell's relaxation: progressive refinement (Cohen, Chen, Wallace & Greenberg 1988; Gortler, Cohen & Slusallek
//! 1993 show that it is Southwell's). The element with the most unshot power shoots it:
//!
//!   H_j += F_ji dB_i,  dB_j += rho_j F_ji dB_i,  then dB_i = 0,
//!
//! with F_ji = S_ij / A_j: the factor from the receiver to the shooter, not the one on the shooter's row. B = E + rho H.
//! What has been shot is B - dB; each shot lowers the unshot power by at least (1 - rho_max) of what it shoots.
//!
//! The ambient term, the irradiance that the unshot power will still cause if it spreads evenly, is for display and is
//! fed back nowhere.
//!
//! **Overshooting** (Feda & Purgathofer 1992) shoots beforehand what an element will still receive. Here all elements
//! overshoot at once, by rho h with one h that makes the balance of power right: what that does to the others, h F rho,
//! is known from the bound, so it costs no shot. It may leave negative unshot radiosity, and it is guarded: done only
//! where it lowers the total of |unshot power|.

use super::{Indefinite, Method};
use crate::part::Setup;
use crate::product::rows::RowIndex;
use crate::work::{End, Shown, Work};

/// Shots between two looks whether overshooting pays: it costs as much time as choosing the next shooter.
const OVERSHOOT_EVERY: usize = 8;

pub(super) struct Southwell<'a> {
    rows: RowIndex<'a>,
    areas: &'a [f64],
    /// Elements that may shoot, in order.
    members: Vec<usize>,
    /// Whether nothing was shot yet when first called.
    cold: bool,
    overshooting: bool,
}

impl<'a> Southwell<'a> {
    pub fn new(setup: &Setup<'a>) -> Self {
        let members = (0..setup.areas.len()).filter(|&i| setup.members[i]).collect();
        let (cold, overshooting) = (setup.cold, setup.overshooting);
        Self { rows: RowIndex::new(setup.whole), areas: setup.areas, members, cold, overshooting }
    }

    /// Unshot power without sign, W, and the member that has most of it.
    fn unshot_power(&self, unshot: &[f64]) -> (f64, usize) {
        let (mut total, mut most, mut shooter) = (0.0, 0.0, 0);
        for &i in &self.members {
            let power = self.areas[i] * unshot[i].abs();
            total += power;
            if power > most {
                (most, shooter) = (power, i);
            }
        }
        (total, shooter)
    }

    fn shoot(&self, shooter: usize, state: &mut Shown, reflectance: &[f64]) {
        let shot = std::mem::take(&mut state.unshot[shooter]);
        self.rows.for_column(shooter, |j, s| {
            let arriving = s * shot / self.areas[j];
            state.irradiance[j] += arriving;
            state.unshot[j] += reflectance[j] * arriving;
        });
    }

    /// Lets every element overshoot where that lowers the total unshot power, which is `before`.
    fn overshoot(&self, state: &mut Shown, reflectance: &[f64], seen: &[f64], before: f64) {
        // Shooting rho h everywhere takes rho h (1 - F rho) of the unshot radiosity away.
        let lost = |i: usize| reflectance[i] * (self.areas[i] - seen[i]);
        let (mut left, mut loss) = (0.0, 0.0);
        for &i in &self.members {
            left += self.areas[i] * state.unshot[i];
            loss += lost(i);
        }
        let height = left / loss;
        if !(loss > 0.0 && height.is_finite()) {
            return;
        }
        let after: f64 =
            self.members.iter().map(|&i| (self.areas[i] * state.unshot[i] - height * lost(i)).abs()).sum();
        if after < before {
            for &i in &self.members {
                state.irradiance[i] += height * seen[i] / self.areas[i];
                state.unshot[i] -= height * lost(i) / self.areas[i];
            }
        }
    }

    /// Mean unshot radiosity times all its interreflections, if both were even.
    fn ambient(&self, unshot: &[f64], reflectance: &[f64]) -> f64 {
        let (mut left, mut area, mut reflected) = (0.0, 0.0, 0.0);
        for &i in &self.members {
            left += self.areas[i] * unshot[i];
            area += self.areas[i];
            reflected += self.areas[i] * reflectance[i];
        }
        match reflected < area {
            true => left / (area - reflected),
            false => 0.0,
        }
    }
}

impl Method for Southwell<'_> {
    fn improve(&mut self, work: &mut Work<'_>) -> Result<(), Indefinite> {
        let cold = std::mem::replace(&mut self.cold, false);
        let mut states: Vec<Shown> = work
            .equations
            .iter()
            .map(|e| Shown {
                irradiance: e.irradiance.clone(),
                unshot: if cold { e.exitance.to_vec() } else { e.unshot() },
                ambient: 0.0,
            })
            .collect();
        if !cold {
            // All of the iterate's B counts as shot: what arrives of it is H + r / A.
            for (state, e) in states.iter_mut().zip(&work.equations) {
                let received = state.irradiance.iter_mut().zip(&e.residual).zip(e.areas);
                received.for_each(|((h, r), area)| *h += r / area);
            }
        }
        let mut shots = 0;
        loop {
            let active = work.active();
            if active.is_empty() {
                return Ok(());
            }
            for c in active {
                let (state, equation) = (&mut states[c], &work.equations[c]);
                let (mut total, mut shooter) = self.unshot_power(&state.unshot);
                let looks = self.overshooting && shots % OVERSHOOT_EVERY == OVERSHOOT_EVERY - 1;
                if let (true, Some(seen)) = (looks, equation.seen) {
                    self.overshoot(state, equation.reflectance, seen, total);
                    (total, shooter) = self.unshot_power(&state.unshot);
                }
                if total == 0.0 {
                    work.equations[c].irradiance.clone_from(&state.irradiance);
                    work.finish(c, End::Converged);
                    continue;
                }
                self.shoot(shooter, state, equation.reflectance);
                let (left, _) = self.unshot_power(&state.unshot);
                work.equations[c].irradiance.clone_from(&state.irradiance);
                let measure = (work.measure_unshot)(c, left);
                work.judge_measure(c, measure, false);
            }
            shots += 1;
            if shots % self.members.len().max(1) == 0 {
                work.count_step();
                work.note();
            }
            if let Some(observer) = &mut work.observer {
                let equations = &work.equations;
                observer(shots, &|c: usize| {
                    let (mut shown, reflectance) = (states[c].clone(), equations[c].reflectance);
                    shown.ambient = self.ambient(&shown.unshot, reflectance);
                    shown.irradiance.iter_mut().for_each(|h| *h += shown.ambient);
                    shown
                });
            }
        }
    }
}
