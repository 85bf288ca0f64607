//! How far a residual can be from the solution: rigorous bounds on the inverse of I - K, K = diag(rho) F, in the
//! power norm sum of A |.| (Arvo, Torrance & Smits 1994: |B - B~| <= |r| / (1 - |K|)).
//!
//! In the power norm |K| is its largest column, max over j of (sum over i of A_i rho_i F_ij) / A_j. S is symmetric,
//! so that is max over j of (F rho)_j: the mean reflectance that element j sees, at most rho_max, and exact where
//! rho is uniform. One product gives it.
//!
//! Where that reaches 1 (an element that sees nothing but reflectance 1) or comes so near that the bound would be
//! useless, importance helps: A_j z_j bounds what a residual at j can do in all, if z >= 1 + F (rho z). Any z > 0
//! with z - F (rho z) >= c > 0 proves |(I - K)^-1| <= max z / c, so conjugate gradients may find it and one product
//! proves it. This replaces an estimate of the spectral radius, which proves nothing about a norm.

use crate::cg;
use crate::equation::{Equation, apply};
use crate::system::System;

/// Amplification from which a few more products for a sharper bound pay.
const LARGE_AMPLIFICATION: f64 = 1e3;
/// Sup-norm residual of z up to which it is used: 0.1 makes the bound at most 11 % larger than exact importance.
const IMPORTANCE_RESIDUAL: f64 = 0.1;
/// Products spent on the search for z.
const MOST_IMPORTANCE_STEPS: usize = 200;

/// A bound on the power-norm of (I - K)^-1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplification {
    /// |(I - K)^-1| is at most this; infinite where nothing could be proved.
    pub factor: f64,
    /// |K|.
    pub norm: f64,
    /// What proves the factor.
    pub proof: Proof,
}

/// What proves an [`Amplification`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// 1 / (1 - |K|).
    Norm,
    /// An importance vector, checked.
    Importance,
    /// Nothing: there is no bound.
    None,
}

impl Amplification {
    /// Bound from the norm alone, given `seen` = S rho, W.
    pub fn from_norm(areas: &[f64], reflectance: &[f64], seen: &[f64]) -> Self {
        let columns = (0..areas.len()).filter(|&j| reflectance[j] > 0.0).map(|j| seen[j] / areas[j]);
        let norm = columns.fold(0.0, f64::max);
        match norm < 1.0 {
            true => Self { factor: 1.0 / (1.0 - norm), norm, proof: Proof::Norm },
            false => Self { factor: f64::INFINITY, norm, proof: Proof::None },
        }
    }

    /// The norm's bound, or importance's where the norm gives a poor one and importance a better.
    pub fn find(system: &System<'_>, reflectance: &[f64], seen: &[f64]) -> Self {
        let plain = Self::from_norm(system.areas, reflectance, seen);
        if plain.factor < LARGE_AMPLIFICATION {
            return plain;
        }
        match importance(system, reflectance) {
            Some(factor) if factor < plain.factor => Self { factor, proof: Proof::Importance, ..plain },
            _ => plain,
        }
    }
}

/// max z / c of a checked importance vector z, if one is found.
fn importance(system: &System<'_>, reflectance: &[f64]) -> Option<f64> {
    let rows = || (0..reflectance.len()).filter(|&i| reflectance[i] > 0.0);
    // A z - S (rho z) = A has the solution z = 1 + F (rho z).
    let mut equation = [Equation::new(system.areas, reflectance, system.areas.to_vec())];
    let worst =
        |_: usize, e: &Equation<'_>| rows().map(|i| (e.residual[i] / e.areas[i]).abs()).fold(0.0, f64::max);
    let steps = Some(MOST_IMPORTANCE_STEPS);
    cg::improve(&system.product, &mut equation, worst, IMPORTANCE_RESIDUAL, steps, |_| ()).ok()?;
    let [equation] = equation;
    let seen = apply(&system.product, &[equation.reflected()]).swap_remove(0);
    let (mut least, mut lowest, mut largest) = (f64::INFINITY, f64::INFINITY, 0.0f64);
    for i in rows() {
        let z = equation.irradiance[i];
        least = least.min(z - seen[i] / system.areas[i]);
        lowest = lowest.min(z);
        largest = largest.max(z);
    }
    (least > 0.0 && lowest > 0.0 && largest.is_finite()).then_some(largest / least)
}
