//! From computed tiles to a matrix file, tile after tile in order: entries are narrowed to their stored precision and go
//! to disk at once; what is kept of them is a row error and a row sum per element.

use crate::block_sums::{self, sums_of};
use crate::counts::Counts;
use crate::journal::{Journal, Leftover, Run};
use crate::scene::Scene;
use crate::skips::{Skip, Skips};
use crate::tile::Tile;
use crate::traversal::LeafPair;
use interchange::atomic_write::{Outcome, Partial};
use interchange::matrix::{BlockView, MatrixRecord, MatrixWriter, PackedBlock, Precision};
use interchange::provenance::Provenance;

/// Relative rounding of an entry stored as f32.
const F32_ROUNDING: f64 = 0.5 * f32::EPSILON as f64;
/// Row errors of tiles are rounded up to multiples of this share of the tolerance (of the power of two below it): sums of
/// such multiples are exact up to 2^21 tolerances, so that shards add up to the same bits in any order, and what 10^4
/// tiles in a row add by it is 2e-6 of the tolerance.
const ERROR_QUANTUM: f64 = 1.0 / (1u64 << 32) as f64;

/// How tiles become blocks.
#[derive(Debug, Clone)]
pub struct Packing {
    precision: Precision,
    rounding: f64,
    quantum: f64,
    keep_zeros: bool,
    areas: Vec<f64>,
}

/// A tile as it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTile {
    /// Its entries; none where all are zero.
    pub packed: Option<PackedBlock>,
    /// Estimated sums of |error of F_ij|: of its rows over its columns, then of its columns over its rows (none on the
    /// diagonal). Multiples of the quantum.
    pub errors: Vec<f64>,
    /// Sums of its stored entries, in the same order.
    pub sums: Vec<f64>,
    /// Classes of its pairs.
    pub counts: Counts,
}

impl Packing {
    /// For the matrix of a scene.
    pub fn new(scene: &Scene, skips: &Skips, precision: Precision, tolerance: f64) -> Self {
        Self {
            precision,
            rounding: if precision == Precision::F32 { F32_ROUNDING } else { 0.0 },
            // The smallest tolerances a user can write leave no number below them.
            quantum: (power_of_two_below(tolerance) * ERROR_QUANTUM).max(f64::MIN_POSITIVE),
            keep_zeros: !skips.has(Skip::ZeroBlocks),
            areas: scene.patches.iter().map(|p| p.area).collect(),
        }
    }

    /// Areas of the elements.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Narrows a tile and rounds its errors up.
    pub fn pack(&self, pair: &LeafPair, tile: &Tile) -> StoredTile {
        let range = |r: &std::ops::Range<usize>| r.start as u32..r.end as u32;
        let (rows, columns) = (range(&pair.rows), range(&pair.columns));
        let packed = (self.keep_zeros || tile.values.iter().any(|&x| x != 0.0)).then(|| {
            let diagonal = pair.is_diagonal();
            PackedBlock::new(rows, columns, diagonal, &tile.values, self.precision, !self.keep_zeros)
        });
        let mirrored = if pair.is_diagonal() { 0 } else { pair.columns.len() };
        let sums = match &packed {
            Some(packed) => sums_of(&packed.view()),
            None => vec![0.0; pair.rows.len() + mirrored],
        };
        let elements = pair.rows.clone().chain(pair.columns.clone());
        let estimates = tile.row_errors.iter().chain(&tile.column_errors);
        let errors = elements
            .zip(estimates.zip(&sums))
            .map(|(i, (error, sum))| self.round_up((error + self.rounding * sum) / self.areas[i]))
            .collect();
        StoredTile { packed, errors, sums, counts: tile.counts }
    }

    fn round_up(&self, error: f64) -> f64 {
        (error / self.quantum).ceil() * self.quantum
    }
}

/// The largest power of two that is not above a positive normal number.
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & f64::INFINITY.to_bits())
}

/// A matrix on its way to disk.
#[derive(Debug)]
pub struct Store {
    /// The blocks.
    pub writer: MatrixWriter,
    /// A_i.
    pub areas: Vec<f64>,
    /// Estimated sum over j of |error of F_ij|.
    pub row_errors: Vec<f64>,
    /// Sum over j of S_ij.
    pub(crate) sums: Vec<f64>,
    /// Stored type of the entries.
    pub precision: Precision,
    /// Classes of pairs.
    pub counts: Counts,
    /// Tiles with nothing in them.
    pub absent_blocks: usize,
}

impl Store {
    /// An empty matrix.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(
        partial: Partial,
        provenance: Provenance,
        record: MatrixRecord,
        areas: &[f64],
    ) -> interchange::Result<Self> {
        let (count, precision) = (areas.len(), record.precision);
        Ok(Self {
            writer: MatrixWriter::create(partial, provenance, record, areas)?,
            areas: areas.to_vec(),
            row_errors: vec![0.0; count],
            sums: vec![0.0; count],
            precision,
            counts: Counts::default(),
            absent_blocks: 0,
        })
    }

    /// Appends a tile.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, pair: &LeafPair, tile: &StoredTile) -> interchange::Result<()> {
        if let Some(packed) = &tile.packed {
            self.writer.push(packed)?;
        }
        self.note(pair, tile);
        Ok(())
    }

    /// Appends a block of another matrix of the same elements and precision; its errors are the caller's business.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn copy(&mut self, view: &BlockView<'_>) -> interchange::Result<()> {
        self.writer.push(&PackedBlock::copy_of(view))?;
        block_sums::add(&mut self.sums, view, &sums_of(view));
        Ok(())
    }

    /// Appends a block made elsewhere; without symmetry its entries count for their rows alone.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, packed: &PackedBlock, symmetric: bool) -> interchange::Result<()> {
        self.writer.push(packed)?;
        let view = packed.view();
        if symmetric {
            block_sums::add(&mut self.sums, &view, &sums_of(&view));
        } else {
            view.for_each(|i, _, s| self.sums[i] += s);
        }
        Ok(())
    }

    /// Adds to the row errors what is no tile's.
    pub fn state(&mut self, packing: &Packing, error: impl Fn(usize) -> f64) {
        self.row_errors.iter_mut().enumerate().for_each(|(i, sum)| *sum += packing.round_up(error(i)));
    }

    /// Keeps what is kept of a tile whose entries are written.
    pub fn note(&mut self, pair: &LeafPair, tile: &StoredTile) {
        self.absent_blocks += usize::from(tile.packed.is_none());
        self.counts.add(&tile.counts);
        let elements = pair.rows.clone().chain(pair.columns.clone());
        for (i, (error, sum)) in elements.zip(tile.errors.iter().zip(&tile.sums)) {
            self.row_errors[i] += error;
            self.sums[i] += sum;
        }
    }

    /// Takes over the finished tiles of a killed run: the journal to go on with, their number, whether what came after
    /// them was damaged.
    ///
    /// # Errors
    /// The files cannot be read or written.
    pub fn replay(
        &mut self,
        leftover: Leftover,
        pairs: &[LeafPair],
        run: &Run,
    ) -> interchange::Result<(Journal, usize, bool)> {
        let (mut tiles, precision) = (0, self.precision);
        leftover.replay(pairs, run, precision, |tile, checksum| {
            if let Some(packed) = &mut tile.packed {
                if !self.writer.adopt(packed, checksum)? {
                    return Ok(false);
                }
                tile.sums = sums_of(&packed.view());
            }
            self.note(&pairs[tiles], tile);
            tiles += 1;
            Ok(true)
        })
    }

    /// Sums over j of F_ij.
    pub fn row_sums(&self) -> Vec<f64> {
        self.sums.iter().zip(&self.areas).map(|(sum, area)| sum / area).collect()
    }

    /// Writes the rest and puts the file in its place.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> interchange::Result<Outcome> {
        let row_sums = self.row_sums();
        self.writer.finish(&self.row_errors, &row_sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packing(tolerance: f64) -> Packing {
        let scene = Scene {
            patches: Vec::new(),
            faces: Vec::new(),
            bodies: Vec::new(),
            occluders: Vec::new(),
            clusters: Vec::new(),
            convex: true,
        };
        Packing::new(&scene, &Skips::default(), Precision::F64, tolerance)
    }

    /// Errors are never rounded down, by next to nothing up, and add up to the same bits in any order.
    #[test]
    fn rounded_errors_add_up_exactly() {
        for tolerance in [0.5, 1e-4, 3e-7, 1e-12, 1e-290] {
            let packing = packing(tolerance);
            let errors: Vec<f64> = (1..2000u32)
                .map(|k| tolerance * f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24))
                .collect();
            let rounded: Vec<f64> = errors.iter().map(|&error| packing.round_up(error)).collect();
            for (error, rounded) in errors.iter().zip(&rounded) {
                assert!(rounded >= error && rounded - error <= 3e-10 * tolerance, "{error:e} {rounded:e}");
            }
            let forwards: f64 = rounded.iter().sum();
            let backwards: f64 = rounded.iter().rev().sum();
            let halves =
                rounded.iter().step_by(2).sum::<f64>() + rounded.iter().skip(1).step_by(2).sum::<f64>();
            assert!(forwards == backwards && forwards == halves, "{forwards:e} {backwards:e} {halves:e}");
        }
        assert!(packing(f64::from_bits(1)).round_up(1e-3).is_finite());
    }
}
