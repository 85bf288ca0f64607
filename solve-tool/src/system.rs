//! The geometric half of the system, the same for all channels: the operator S, areas, row sums and row errors.

use crate::product::Product;
use interchange::matrix::{Matrix, Precision};

/// Half an ulp of a stored f32 entry, relative: what storing alone does to a row sum near 1.
const F32_STORAGE_ERROR: f64 = f32::EPSILON as f64 / 2.0;

/// Everything the solver knows of the scene's geometry.
#[derive(Debug)]
pub struct System<'a> {
    /// S = diag(A) F as an operator.
    pub product: Product<'a>,
    /// Areas A_i, in the square of the scene's length unit.
    pub areas: &'a [f64],
    /// Row sums of F: 1 less the share that escapes.
    pub row_sums: Vec<f64>,
    /// Estimated sum over j of |error of F_ij|, rounding of storage and summation included.
    pub row_errors: Vec<f64>,
    /// What storage and summation alone do to a row sum of 1.
    pub rounding: f64,
}

impl<'a> System<'a> {
    /// The system of a mapped matrix. Costs one product.
    pub fn new(matrix: &'a Matrix) -> interchange::Result<Self> {
        let product = Product::new(matrix)?;
        let storage = match matrix.record().precision {
            Precision::F32 => F32_STORAGE_ERROR,
            Precision::F64 => 0.0,
        };
        Ok(Self::from_parts(product, matrix.areas()?, matrix.row_errors()?, storage))
    }

    /// The system of a product in memory whose entries carry the relative error `storage` besides `row_errors`.
    pub fn from_parts(product: Product<'a>, areas: &'a [f64], row_errors: &[f64], storage: f64) -> Self {
        let powers = product.apply(&[&vec![1.0; areas.len()]]).swap_remove(0);
        let row_sums: Vec<f64> = powers.iter().zip(areas).map(|(power, area)| power / area).collect();
        // Partial sums of n positive terms are off by at most n / 2 ulp.
        let rounding = storage + areas.len() as f64 * f64::EPSILON / 2.0;
        let row_errors =
            row_errors.iter().zip(&row_sums).map(|(error, sum)| error + rounding * sum).collect();
        Self { product, areas, row_sums, row_errors, rounding }
    }
}
