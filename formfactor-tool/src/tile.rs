//! One computed rectangle of the matrix: what an estimator delivers and the store keeps.

use crate::counts::Counts;

/// The entries of a leaf pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// S_ij, row after row; in a tile on the diagonal the upper triangle with the diagonal only.
    pub values: Vec<f64>,
    /// Per row: sum over the columns of the estimated |error of S_ij|. On the diagonal every pair counts for both its
    /// elements here.
    pub row_errors: Vec<f64>,
    /// Per column: the same over the rows; empty on the diagonal.
    pub column_errors: Vec<f64>,
    /// Classes of its pairs.
    pub counts: Counts,
}

impl Tile {
    /// Whether nothing sees anything: such a tile is not stored.
    pub fn is_zero(&self) -> bool {
        let zero = |values: &[f64]| values.iter().all(|&x| x == 0.0);
        zero(&self.values) && zero(&self.row_errors) && zero(&self.column_errors)
    }
}
