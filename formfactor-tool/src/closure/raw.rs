//! Whether the entries of a matrix are those that were computed: closure by default leaves no mark but its effect.

use super::{Closure, F32_TARGET};
use crate::merge::asked;
use interchange::matrix::Matrix;

/// Whether closure has certainly not changed the entries: it was off or only reported, the matrix is in shards (closed when they
/// are merged), or nothing was asked and some row sum is further from 1 than any row states. By default only matrices whose rows
/// are all nearer than they state are closed, and then all row sums are 1, to rounding.
///
/// # Errors
/// The file cannot be read.
pub fn is_raw(matrix: &Matrix) -> interchange::Result<bool> {
    if matrix.record().parts > 1 {
        return Ok(true);
    }
    match asked(&matrix.provenance().flags) {
        Some(Closure::Off | Closure::Report) => Ok(true),
        Some(Closure::LeastSquares) => Ok(false),
        None => {
            let stated = matrix.row_errors()?.iter().copied().fold(F32_TARGET, f64::max);
            Ok(matrix.row_sums()?.iter().any(|sum| (sum - 1.0).abs() > stated))
        }
    }
}
