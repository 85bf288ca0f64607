//! One channel's equation for the irradiance and its residual.
//!
//! With B = E + rho H and H = F B the irradiance solves A H - S (rho H) = S E. In this form rows with rho = 0 need no
//! care: they feed nothing back, and no reflectance is ever divided by. In the inner product weighted with rho the
//! operator A - S rho is symmetric positive definite on the rows with rho > 0; this is the same system as
//! (A / rho - S) B = A E / rho (with b = rho H, b = B - E), row i scaled.

use crate::product::Product;

/// A H - S (rho H) = c, an iterate H and its residual r = c - A H + S (rho H), W.
#[derive(Debug, Clone)]
pub(crate) struct Equation<'a> {
    pub areas: &'a [f64],
    /// Reflectances; 0 on rows that take no part.
    pub reflectance: &'a [f64],
    /// Emitted radiosity; empty where the right-hand side is no emission.
    pub exitance: &'a [f64],
    /// S rho, W, where it is known: the image of the constant mode.
    pub seen: Option<&'a [f64]>,
    /// Iterate.
    pub irradiance: Vec<f64>,
    /// Residual of the iterate.
    pub residual: Vec<f64>,
}

impl<'a> Equation<'a> {
    /// Starts from H = 0, whose residual is the right-hand side itself.
    pub fn new(areas: &'a [f64], reflectance: &'a [f64], right_hand_side: Vec<f64>) -> Self {
        let irradiance = vec![0.0; areas.len()];
        Self { areas, reflectance, exitance: &[], seen: None, irradiance, residual: right_hand_side }
    }

    /// Power of the second-kind residual E + rho F B - B of B = E + rho H: sum of A |rho r / A|, W.
    pub fn residual_power(&self) -> f64 {
        self.residual.iter().zip(self.reflectance).map(|(r, rho)| rho * r.abs()).sum()
    }

    /// Radiosity that the iterate reflects, rho H.
    pub fn reflected(&self) -> Vec<f64> {
        self.irradiance.iter().zip(self.reflectance).map(|(h, rho)| rho * h).collect()
    }

    /// Radiosity that has arrived according to the iterate and was not yet passed on, rho r / A.
    pub fn unshot(&self) -> Vec<f64> {
        let terms = self.residual.iter().zip(self.areas).zip(self.reflectance);
        terms.map(|((r, area), rho)| rho * r / area).collect()
    }

    /// Replaces the residual by the true one, given `arriving` = S B of the iterate's B, W.
    pub fn set_residual(&mut self, arriving: &[f64]) {
        let terms = arriving.iter().zip(self.areas).zip(&self.irradiance);
        self.residual = terms.map(|((power, area), h)| power - area * h).collect();
    }
}

/// S x for several vectors.
pub(crate) fn apply(product: &Product<'_>, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let borrowed: Vec<&[f64]> = vectors.iter().map(Vec::as_slice).collect();
    product.apply(&borrowed)
}
