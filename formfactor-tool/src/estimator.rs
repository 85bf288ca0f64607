//! What every `--method` is: a way to fill one rectangle of the matrix after another.

use crate::counts::Counts;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use interchange::report::Report;

/// Time of a unit of work of pairs that nothing can block: a cube of 9600 squares at 1e-4 on a core of an EPYC of 2024.
const NANOSECONDS_UNOCCLUDED: f64 = 180.0;
/// Time of a unit of work of pairs that have to be looked at: between 4000 and 2500 for a cube with eight boxes in 576 and
/// 2304 squares there.
const NANOSECONDS_UNDECIDED: f64 = 3000.0;

/// Fills rectangles of the matrix. The same pair always gives the same tile, whichever others were asked for before.
pub trait Estimator: Sync {
    /// Computes the entries of a leaf pair.
    fn tile(&self, pair: &LeafPair) -> Tile;

    /// Expected work of a leaf pair in a unit of its own: for balancing shards and the time left.
    fn work(&self, pair: &LeafPair) -> f64;

    /// Allows so many bytes for what it can make anew: never a matter of the result.
    fn allow(&self, _bytes: u64) {}

    /// Counters and estimates of its own, after all tiles.
    fn note(&self, _report: &mut Report) {}

    /// Expected time of a leaf pair on one core: for what is said before a run, never for a result.
    fn nanoseconds(&self, pair: &LeafPair) -> f64 {
        match pair.blockers.is_empty() {
            true => NANOSECONDS_UNOCCLUDED * self.work(pair),
            false => NANOSECONDS_UNDECIDED * self.work(pair),
        }
    }
}

/// Collects the entries of one tile in the order of the matrix.
#[derive(Debug)]
pub struct TileBuilder {
    diagonal: bool,
    columns: usize,
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
        Self { diagonal, columns: pair.columns.len(), tile }
    }

    /// A tile that is zero wherever [`TileBuilder::set`] does not say otherwise.
    pub fn zeros(pair: &LeafPair) -> Self {
        let mut builder = Self::new(pair);
        builder.tile.values.resize(pair.pairs(), 0.0);
        builder
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

    /// Sets entry (row, column) of a tile made by [`TileBuilder::zeros`], counted from the tile's first; once per entry.
    pub fn set(&mut self, row: usize, column: usize, value: f64, error: f64) {
        let n = self.tile.row_errors.len();
        let before =
            if self.diagonal { row * n - row * row.saturating_sub(1) / 2 - row } else { row * self.columns };
        self.tile.values[before + column] = value;
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
