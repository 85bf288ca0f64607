//! What every `--method` is: a way to fill one rectangle of the matrix after another.

use crate::counts::Counts;
use crate::tile::Tile;
use crate::traversal::LeafPair;

/// Fills rectangles of the matrix. The same pair always gives the same tile, whichever others were asked for before.
pub trait Estimator: Sync {
    /// Computes the entries of a leaf pair.
    fn tile(&self, pair: &LeafPair) -> Tile;

    /// Expected work of a leaf pair in a unit of its own: for balancing shards and the time left.
    fn work(&self, pair: &LeafPair) -> f64;
}

/// Collects the entries of one tile in the order of the matrix.
#[derive(Debug)]
pub struct TileBuilder {
    diagonal: bool,
    tile: Tile,
}

impl TileBuilder {
    /// An empty tile of zeros for a leaf pair.
    pub fn new(pair: &LeafPair) -> Self {
        let diagonal = pair.is_diagonal();
        let columns = if diagonal { 0 } else { pair.columns.len() };
        let tile = Tile {
            values: Vec::with_capacity(pair.pairs()),
            row_errors: vec![0.0; pair.rows.len()],
            column_errors: vec![0.0; columns],
            counts: Counts::default(),
        };
        Self { diagonal, tile }
    }

    /// Appends entry (row, column), counted from the tile's first: row after row.
    pub fn push(&mut self, row: usize, column: usize, value: f64, error: f64) {
        self.tile.values.push(value);
        self.tile.row_errors[row] += error;
        if !self.diagonal {
            self.tile.column_errors[column] += error;
        } else if row != column {
            self.tile.row_errors[column] += error;
        }
    }

    /// Where pairs are counted.
    pub fn counts(&mut self) -> &mut Counts {
        &mut self.tile.counts
    }

    /// The finished tile.
    pub fn finish(self) -> Tile {
        self.tile
    }
}
