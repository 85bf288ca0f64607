//! `formfactor-tool export`: the factors F as a table, per element, face or group.
//!
//! Rows emit: entry (i, j) is F(i -> j), the share of what leaves i that reaches j. For faces and groups it is the
//! sum of S over the elements of both, divided by the area of i. Both sides of a two-sided face count as one face,
//! their areas summed. Rows are made in bands, so that a table of many elements needs no memory of its size.

use crate::foreign::{self, Format, RowSource};
use interchange::atomic_write::refuse_input;
use interchange::error::Result;
use interchange::grouping::{By, Grouping};
use interchange::matrix::{BlockView, Matrix};
use interchange::mesh::Mesh;
use interchange::tool::progress;
use std::ops::Range;
use std::path::Path;

/// Entries of the table held in memory at a time: 128 MB. Each band reads the blocks it touches once.
const BAND_ENTRIES: usize = 1 << 24;

/// Writes F of a matrix in one file or in all its parts to `output`, in the format asked for or else the one that its ending
/// says.
///
/// # Errors
/// The files do not belong together, the format is not known, or the output cannot be written.
pub fn run(
    matrix_paths: &[impl AsRef<Path>],
    mesh_path: &Path,
    by: By,
    format: Option<Format>,
    output: &Path,
) -> Result<()> {
    let format = Format::of(output, format)?;
    refuse_input(output, matrix_paths.iter().map(AsRef::as_ref).chain([mesh_path]))?;
    let (mesh, _, digest) = Mesh::read(mesh_path)?;
    let matrix = Matrix::open_all(matrix_paths)?;
    matrix.belongs_to(mesh_path, digest, mesh.element_count())?;
    let grouping = Grouping::new(&mesh, by);
    let table = Keyed { factors: Factors::new(&matrix, &grouping)?, grouping: &grouping };
    let written = match format {
        Format::Csv => foreign::csv::write(output, &table),
        Format::Npy => foreign::npy::write(output, &table),
        Format::Npz => foreign::npz::write(output, &table),
        Format::MatrixMarket => foreign::matrix_market::write(output, &table),
        Format::Radiance => foreign::radiance::write(output, &table),
        Format::View3d => foreign::view3d::write(output, &table),
    };
    written.map(|_| ())
}

/// Factors with the names of their rows.
struct Keyed<'a> {
    factors: Factors<'a>,
    grouping: &'a Grouping,
}

impl RowSource for Keyed<'_> {
    fn count(&self) -> usize {
        self.factors.count
    }

    fn labels(&self) -> (&str, &[String]) {
        (self.grouping.title, &self.grouping.labels)
    }

    fn areas(&self) -> &[f64] {
        &self.factors.areas
    }

    fn rows(&self) -> Box<dyn Iterator<Item = Vec<f64>> + '_> {
        let bar = progress("export", self.factors.count);
        Box::new(bar.wrap_iter(self.factors.rows()).map(|(_, row)| row))
    }
}

/// F between the keys of a grouping, row by row.
pub(crate) struct Factors<'a> {
    views: Vec<BlockView<'a>>,
    keys: &'a [u32],
    /// Area of each key.
    areas: Vec<f64>,
    count: usize,
    /// Whether the mirror image of each entry is part of the matrix.
    mirrored: bool,
    /// Rows made at a time.
    band: usize,
}

impl<'a> Factors<'a> {
    /// Of the keys of a grouping of the matrix's elements.
    pub(crate) fn new(matrix: &'a Matrix, grouping: &'a Grouping) -> Result<Self> {
        let element_areas = matrix.areas()?;
        let count = grouping.len();
        Ok(Self {
            views: matrix.views()?,
            keys: &grouping.key_of_element,
            areas: grouping
                .sums(|i| element_areas[i])
                .iter()
                .zip(&grouping.hidden_areas)
                .map(|(area, hidden)| area + hidden)
                .collect(),
            count,
            mirrored: matrix.record().symmetric,
            band: (BAND_ENTRIES / count.max(1)).max(1),
        })
    }

    /// All rows in order: key and F(key -> every key).
    pub(crate) fn rows(&self) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
        (0..self.count).step_by(self.band).flat_map(move |first| {
            let band = first..(first + self.band).min(self.count);
            let sums = self.sums(band.clone());
            band.clone().map(move |key| {
                let row = &sums[(key - band.start) * self.count..][..self.count];
                let area = self.areas[key];
                // A key without elements has no area and no exchange.
                let share = |s: &f64| if area > 0.0 { s / area } else { 0.0 };
                (key, row.iter().map(share).collect())
            })
        })
    }

    /// Sums of S between the keys in `band` and every key.
    fn sums(&self, band: Range<usize>) -> Vec<f64> {
        let mut sums = vec![0.0; band.len() * self.count];
        let mut add = |i: usize, j: usize, s: f64| {
            if band.contains(&i) {
                sums[(i - band.start) * self.count + j] += s;
            }
        };
        for view in &self.views {
            let keys_of = |start: u32, count: u32| &self.keys[start as usize..(start + count) as usize];
            let rows = keys_of(view.block.row_start, view.block.rows);
            let columns = keys_of(view.block.column_start, view.block.columns);
            if !rows.iter().chain(columns).any(|&key| band.contains(&(key as usize))) {
                continue;
            }
            view.for_each(|i, j, s| {
                let (row, column) = (self.keys[i] as usize, self.keys[j] as usize);
                add(row, column, s);
                // The mirror image; an entry on the diagonal is its own.
                if self.mirrored && i != j {
                    add(column, row, s);
                }
            });
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interchange::matrix::{Block, BlockKind, Values, views};

    /// However few rows are made at a time, the table is the same.
    #[test]
    fn bands_make_no_difference() {
        let blocks = [
            Block::new(BlockKind::Triangle, 0..2, 0..2, 0),
            Block::new(BlockKind::Dense, 0..2, 3..5, 3),
            Block::new(BlockKind::Triangle, 2..5, 2..5, 7),
        ];
        let values: Vec<f64> = (1..=13).map(f64::from).collect();
        let keys = [2, 0, 1, 2, 0];
        let table = |band: usize| -> Vec<(usize, Vec<f64>)> {
            let views = views(&blocks, Values::F64(&values), &[]).collect();
            let areas = vec![1.0, 2.0, 4.0, 0.0];
            Factors { views, keys: &keys, areas, count: 4, mirrored: true, band }.rows().collect()
        };
        let whole = table(4);
        // S between key 0 (elements 1 and 4) and itself: S_11 + 2 S_14 + S_44 = 3 + 2 * 7 + 13.
        assert_eq!(whole[0].1[0], 30.0);
        // Keys 1 (element 2) and 2 (elements 0 and 3): S_23 = 9, and S_02 is absent.
        assert_eq!((whole[1].1[2], whole[2].1[1]), (9.0 / 2.0, 9.0 / 4.0));
        assert_eq!(whole[3].1, [0.0; 4]);
        assert_eq!(table(1), whole);
        assert_eq!(table(3), whole);
    }
}
