//! Methods that look out from one element at a time (hemicube, rays): whole rows F_i*, kept sparse, then cut into tiles.
//!
//! Two rows tell of every pair: A_i F_ij from i's side and A_j F_ji from j's, equal only up to their errors. The tile holds
//! their mean. It keeps the matrix symmetric (for conjugate gradients, and to be stored once), and where the
//! errors are independent it halves their variance; taking one side only, say the smaller element's, would waste the other
//! row, and scaling rows to sum 1 would hide what is wrong with them.
//! Rows are computed when the first tile asks for them and depend on their element alone, so any part of the matrix
//! can be computed alone and comes out the same.

use crate::estimator::{Estimator, TileBuilder};
use crate::scene::Scene;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use interchange::report::Report;
use std::ops::Range;
use std::sync::OnceLock;

/// What one element sees: the columns with a factor or an error above 0, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// Columns j.
    pub columns: Vec<u32>,
    /// Factors F_ij.
    pub factors: Vec<f64>,
    /// Estimated |error of F_ij|.
    pub errors: Vec<f64>,
}

impl Row {
    /// Appends the next column.
    pub fn push(&mut self, column: usize, factor: f64, error: f64) {
        self.columns.push(column as u32);
        self.factors.push(factor);
        self.errors.push(error);
    }

    /// Entries with columns in `range`: column counted from its start, factor, error.
    fn within(&self, range: &Range<usize>) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let first = self.columns.partition_point(|&j| (j as usize) < range.start);
        let last = self.columns.partition_point(|&j| (j as usize) < range.end);
        let start = range.start;
        (first..last).map(move |k| (self.columns[k] as usize - start, self.factors[k], self.errors[k]))
    }
}

/// A method that delivers rows.
pub trait RowSource: Sync {
    /// What element `i` sees.
    fn row(&self, i: usize) -> Row;

    /// Error of the mean of two estimates with these errors.
    fn error_of_mean(&self, a: f64, b: f64) -> f64;

    /// Adds to the report what the rows took.
    fn note(&self, report: &mut Report);
}

/// A row-wise method on a scene.
#[derive(Debug)]
pub struct RowWise<'a, S> {
    scene: &'a Scene,
    source: S,
    rows: Vec<OnceLock<Row>>,
}

impl<'a, S: RowSource> RowWise<'a, S> {
    /// With no row computed yet.
    pub fn new(scene: &'a Scene, source: S) -> Self {
        Self { scene, source, rows: (0..scene.len()).map(|_| OnceLock::new()).collect() }
    }

    fn row(&self, i: usize) -> &Row {
        self.rows[i].get_or_init(|| self.source.row(i))
    }
}

/// The two estimates of one entry of S with their errors.
#[derive(Debug, Clone, Copy, Default)]
struct Both {
    from_row: (f64, f64),
    from_column: (f64, f64),
}

impl<S: RowSource> Estimator for RowWise<'_, S> {
    fn tile(&self, pair: &LeafPair) -> Tile {
        let (rows, columns) = (&pair.rows, &pair.columns);
        let mut found = vec![Both::default(); rows.len() * columns.len()];
        for i in rows.clone() {
            let area = self.scene.patches[i].area;
            for (column, factor, error) in self.row(i).within(columns) {
                found[(i - rows.start) * columns.len() + column].from_row = (area * factor, area * error);
            }
        }
        for j in columns.clone() {
            let area = self.scene.patches[j].area;
            for (row, factor, error) in self.row(j).within(rows) {
                found[row * columns.len() + j - columns.start].from_column = (area * factor, area * error);
            }
        }

        let mut builder = TileBuilder::new(pair);
        for row in 0..rows.len() {
            let first = if pair.is_diagonal() { row } else { 0 };
            for column in first..columns.len() {
                // Fan parts of a face that is not quite planar count as one plane, as with every method.
                let one_face = self.scene.faces[rows.start + row] == self.scene.faces[columns.start + column];
                if one_face {
                    builder.counts().same_plane += 1;
                    builder.push(row, column, 0.0, 0.0);
                    continue;
                }
                let Both { from_row, from_column } = found[row * columns.len() + column];
                let error = self.source.error_of_mean(from_row.1, from_column.1);
                builder.push(row, column, 0.5 * (from_row.0 + from_column.0), error);
            }
        }
        builder.finish()
    }

    fn work(&self, pair: &LeafPair) -> f64 {
        // Rows cost the same wherever they are needed.
        (pair.rows.len() + pair.columns.len()) as f64
    }

    fn note(&self, report: &mut Report) {
        report.count("rows computed", self.rows.iter().filter(|row| row.get().is_some()).count());
        self.source.note(report);
    }
}
