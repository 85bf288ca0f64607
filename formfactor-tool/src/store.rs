//! From computed tiles to a matrix file: blocks, precision, row errors.

use crate::scene::Scene;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use interchange::digest::Digest;
use interchange::matrix::{self, Block, BlockKind, MatrixRecord, Precision, Values};
use interchange::provenance::Provenance;
use std::path::Path;

/// Tolerances of at least this are stored as f32: its rounding, 6e-8 of an entry, stays below.
const F32_TOLERANCE: f64 = 1e-6;
/// Relative rounding of an entry stored as f32.
const F32_ROUNDING: f64 = 0.5 * f32::EPSILON as f64;

/// The matrix before it is stored.
#[derive(Debug)]
pub struct Assembled {
    /// Blocks in the order of their entries.
    pub blocks: Vec<Block>,
    values: Vec<f64>,
    areas: Vec<f64>,
    /// Estimated sum over j of |error of F_ij| per row.
    pub row_errors: Vec<f64>,
    /// Sum over j of F_ij per row.
    pub row_sums: Vec<f64>,
    precision: Precision,
    /// Rectangles with nothing in them.
    pub absent_blocks: usize,
}

/// Puts tiles together, in the order of `pairs`.
pub fn assemble(scene: &Scene, pairs: &[LeafPair], tiles: &[Tile], tolerance: f64) -> Assembled {
    let count = scene.len();
    let areas: Vec<f64> = scene.patches.iter().map(|p| p.area).collect();
    let precision = if tolerance >= F32_TOLERANCE { Precision::F32 } else { Precision::F64 };
    let rounding = if precision == Precision::F32 { F32_ROUNDING } else { 0.0 };
    let (mut blocks, mut values, mut absent_blocks) = (Vec::new(), Vec::new(), 0);
    let (mut errors, mut sums) = (vec![0.0; count], vec![0.0; count]);
    for (pair, tile) in pairs.iter().zip(tiles) {
        if tile.is_zero() {
            absent_blocks += 1;
            continue;
        }
        let (rows, columns) = (&pair.rows, &pair.columns);
        let kind = if pair.is_diagonal() { BlockKind::Triangle } else { BlockKind::Dense };
        let (row_range, column_range) =
            (rows.start as u32..rows.end as u32, columns.start as u32..columns.end as u32);
        blocks.push(Block::new(kind, row_range, column_range, values.len() as u64));
        let mut entries = tile.values.iter();
        for i in rows.clone() {
            errors[i] += tile.row_errors[i - rows.start];
            let first = if pair.is_diagonal() { i } else { columns.start };
            for (j, &value) in (first..columns.end).zip(entries.by_ref()) {
                values.push(value);
                sums[i] += value;
                if i != j {
                    sums[j] += value;
                }
            }
        }
        for (j, error) in columns.clone().zip(&tile.column_errors) {
            errors[j] += error;
        }
    }
    let row_sums: Vec<f64> = sums.iter().zip(&areas).map(|(sum, area)| sum / area).collect();
    let row_errors = (0..count).map(|i| errors[i] / areas[i] + rounding * row_sums[i]).collect();
    Assembled { blocks, values, areas, row_errors, row_sums, precision, absent_blocks }
}

/// Writes the matrix.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, mesh: Digest, matrix: &Assembled, tolerance: f64) -> interchange::Result<()> {
    let provenance = Provenance::new("formfactor-tool", env!("CARGO_PKG_VERSION"))
        .flag(format!("--tolerance {tolerance}"))
        .input("mesh", mesh);
    let record = MatrixRecord {
        elements: matrix.areas.len() as u32,
        mesh,
        precision: matrix.precision,
        symmetric: true,
        extended: false,
        tolerance,
        part: 0,
        parts: 1,
    };
    let write = |values: Values<'_>| {
        matrix::write(path, provenance, record, &matrix.blocks, values, &matrix.areas, &matrix.row_errors)
    };
    match matrix.precision {
        Precision::F64 => write(Values::F64(&matrix.values)),
        Precision::F32 => {
            let rounded: Vec<f32> = matrix.values.iter().map(|&x| x as f32).collect();
            write(Values::F32(&rounded))
        }
    }
    .map(|_| ())
}
