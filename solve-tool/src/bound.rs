//! How far a residual can be from the solution: rigorous bounds on the inverse of I - K, K = diag(rho) F, in the
//! power norm sum of A |.| (Arvo, Torrance & Smits 1994: |B - B~| <= |r| / (1 - |K|)).
//!
//! In the power norm |K| is its largest column, max over j of (sum over i of A_i rho_i F_ij) / A_j. Where S is
//! symmetric that is max over j of (F rho)_j: the mean reflectance that element j sees, at most rho_max, and exact where
//! rho is uniform. One product gives it.
//!
//! Where that reaches 1 (an element that sees nothing but reflectance 1) or comes so near that the bound would be
//! useless, importance helps: A_j z_j bounds what a residual at j can do in all, if z >= 1 + F (rho z). Any z > 0
//! with z - F (rho z) >= c > 0 proves |(I - K)^-1| <= max z / c, so conjugate gradients may find it and one product
//! proves it. This replaces an estimate of the spectral radius, which proves nothing about a norm.

use crate::equation::Equation;
use crate::method::{ConjugateGradients, Method};
use crate::product::Product;
use crate::work::Work;

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
    /// Bound from the norm alone, given `seen` = S^T rho, W.
    pub fn from_norm(areas: &[f64], reflectance: &[f64], seen: &[f64]) -> Self {
        let columns = (0..areas.len()).filter(|&j| reflectance[j] > 0.0).map(|j| seen[j] / areas[j]);
        let norm = columns.fold(0.0, f64::max);
        match norm < 1.0 {
            true => Self { factor: 1.0 / (1.0 - norm), norm, proof: Proof::Norm },
            false => Self { factor: f64::INFINITY, norm, proof: Proof::None },
        }
    }

    /// The norm's bound, or importance's where the norm gives a poor one and importance a better; and how many products
    /// that took. `product` must be exact between elements that reflect.
    pub fn find(product: &Product<'_>, areas: &[f64], reflectance: &[f64], seen: &[f64]) -> (Self, usize) {
        let plain = Self::from_norm(areas, reflectance, seen);
        if plain.factor < LARGE_AMPLIFICATION {
            return (plain, 0);
        }
        let importance = Importance::find(product, areas, reflectance, Some(seen), IMPORTANCE_RESIDUAL);
        let Some(importance) = importance else { return (plain, MOST_IMPORTANCE_STEPS) };
        let factor = importance.largest / importance.least;
        let better =
            if factor < plain.factor { Self { factor, proof: Proof::Importance, ..plain } } else { plain };
        (better, importance.products)
    }
}

/// How far the solution of a perturbed system is from that of B = E + K B: with |dK| = `perturbation`, |dK B| =
/// `change` and |K| = `norm` in any norm, at most change / (1 - norm - perturbation); infinite where that proves nothing.
pub fn perturbed(norm: f64, perturbation: f64, change: f64) -> f64 {
    let left = 1.0 - norm - perturbation;
    if left > 0.0 { change / left } else { f64::INFINITY }
}

/// z > 0 on the elements that reflect with z - S^T (rho z) / A >= least > 0, checked: a residual of power p at element i
/// changes the radiosity by at most p z_i / least in all.
#[derive(Debug, Clone)]
pub(crate) struct Importance {
    /// z, 0 where nothing is reflected.
    pub values: Vec<f64>,
    /// The least of z - S^T (rho z) / A.
    pub least: f64,
    /// The largest z.
    pub largest: f64,
    /// Passes over the matrix.
    pub products: usize,
}

impl Importance {
    /// Searches for z = 1 + S^T (rho z) / A until its residual is at most `accuracy`, and checks what it found.
    pub fn find(
        product: &Product<'_>,
        areas: &[f64],
        reflectance: &[f64],
        seen: Option<&[f64]>,
        accuracy: f64,
    ) -> Option<Self> {
        let reflecting: Vec<usize> = (0..areas.len()).filter(|&i| reflectance[i] > 0.0).collect();
        let (mut values, mut products) = match product.is_symmetric() {
            true => by_gradients(product, areas, reflectance, seen, &reflecting, accuracy)?,
            false => by_bounces(product, areas, reflectance, &reflecting, accuracy),
        };
        let reflected: Vec<f64> = values.iter().zip(reflectance).map(|(z, rho)| rho * z).collect();
        let seen = product.apply_transposed(&[&reflected]).swap_remove(0);
        products += 1;
        let (mut least, mut lowest, mut largest) = (f64::INFINITY, f64::INFINITY, 0.0f64);
        for &i in &reflecting {
            let z = values[i];
            least = least.min(z - seen[i] / areas[i]);
            lowest = lowest.min(z);
            largest = largest.max(z);
        }
        (0..areas.len()).filter(|&i| reflectance[i] == 0.0).for_each(|i| values[i] = 0.0);
        let proved = least > 0.0 && lowest > 0.0 && largest.is_finite();
        proved.then_some(Self { values, least, largest, products })
    }
}

/// S is symmetric: A z - S (rho z) = A.
fn by_gradients(
    product: &Product<'_>,
    areas: &[f64],
    reflectance: &[f64],
    seen: Option<&[f64]>,
    reflecting: &[usize],
    accuracy: f64,
) -> Option<(Vec<f64>, usize)> {
    let equation = Equation { seen, ..Equation::new(areas, reflectance, areas.to_vec()) };
    let worst = |_: usize, e: &Equation<'_>| {
        reflecting.iter().map(|&i| (e.residual[i] / e.areas[i]).abs()).fold(0.0, f64::max)
    };
    let mut work = Work::new(product, vec![equation], worst, accuracy, MOST_IMPORTANCE_STEPS);
    work.begin(&[true]);
    ConjugateGradients { deflated: true }.improve(&mut work).ok()?;
    work.ends();
    let products = work.history.len();
    Some((work.equations.swap_remove(0).irradiance, products))
}

/// Any S: the series of z.
fn by_bounces(
    product: &Product<'_>,
    areas: &[f64],
    reflectance: &[f64],
    reflecting: &[usize],
    accuracy: f64,
) -> (Vec<f64>, usize) {
    let mut values = vec![1.0; areas.len()];
    for step in 1..=MOST_IMPORTANCE_STEPS {
        let reflected: Vec<f64> = values.iter().zip(reflectance).map(|(z, rho)| rho * z).collect();
        let seen = product.apply_transposed(&[&reflected]).swap_remove(0);
        let mut change = 0.0f64;
        for &i in reflecting {
            let next = 1.0 + seen[i] / areas[i];
            change = change.max((next - values[i]).abs());
            values[i] = next;
        }
        if change <= accuracy {
            return (values, step);
        }
    }
    (values, MOST_IMPORTANCE_STEPS)
}
