//! `formfactor-tool import`: a matrix file from factors F(i -> j) that another program computed.
//!
//! Checked and said: the shape, that every entry is a number of at least 0, row sums above 1, and reciprocity,
//! A_i F_ij = A_j F_ji. The file stores S = diag(A) F; where the two sides of a pair differ it stores their mean, unless asked
//! to keep both. What a row's error is known to be at least becomes its stated error: half of what its factors differ from
//! reciprocity, what its sum is above 1, and what their maker states.

use crate::closure::{self, Closure};
use crate::compute::note_rows;
use crate::foreign::{self, Table};
use crate::options::{PrecisionName, name};
use crate::store::Store;
use anyhow::Context;
use clap::{Args, ValueEnum};
use geometry::polygon;
use interchange::atomic_write::{Partial, refuse_input, refuse_stdout};
use interchange::counted::counted;
use interchange::error::Error;
use interchange::grouping::{By, Grouping};
use interchange::matrix::{MatrixRecord, PackedBlock, Precision};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::tool::{Finish, positive, progress};
use std::path::{Path, PathBuf};

/// Rows and columns of a block.
const BLOCK: usize = 256;
/// What a row sum may be above 1, or a pair off reciprocity, by rounding alone where the factors were written as f32: half
/// a unit in the last place of each of some thousand factors, added up at their worst.
const ROUNDING: f64 = 1e-6;
/// Areas that a file gives beside the factors agree with those of the mesh to this: they are written with 6 digits.
const SAME_AREA: f64 = 1e-4;

/// What to do with factors whose two sides differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Reciprocity {
    /// Store the mean of A_i F_ij and A_j F_ji
    Mean,
    /// Store both sides; solving such a matrix takes a slower method
    Keep,
}

/// What the rows of a table stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Rows {
    /// Elements of the mesh in order
    Element,
    /// Faces of the scene in order; each must be one element
    Face,
}

/// Flags of `import`.
#[derive(Debug, Clone, Args)]
pub struct Wishes {
    /// What the rows of the table stand for
    #[arg(long, value_enum, default_value_t = Rows::Element)]
    pub by: Rows,
    /// Error of the sum over j of F_ij in any row, as the factors' maker states it; what is found is stated where it is more
    #[arg(long, value_name = "E", value_parser = positive)]
    pub tolerance: Option<f64>,
    /// What to do with factors whose two sides differ
    #[arg(long, value_enum, default_value_t = Reciprocity::Mean)]
    pub reciprocity: Reciprocity,
    /// Stored type of the entries
    #[arg(long, value_enum, default_value_t = PrecisionName::F64)]
    pub precision: PrecisionName,
    /// What to do about row sums of a closed scene that are not exactly 1
    #[arg(long, value_enum, default_value_t = Closure::Off)]
    pub closure: Closure,
}

/// What `import` is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Table of factors.
    pub table: PathBuf,
    /// Mesh they belong to.
    pub mesh: PathBuf,
    /// Matrix file to write.
    pub output: PathBuf,
    /// How.
    pub wishes: Wishes,
}

/// Reads, checks and writes.
///
/// # Errors
/// A table that cannot be read, has another shape than the mesh or entries that no factor can be; an output that cannot be
/// written.
pub fn run(request: &Request) -> anyhow::Result<Finish> {
    let Request { table: table_path, mesh: mesh_path, output, wishes } = request;
    refuse_stdout(output)?;
    refuse_input(output, [table_path.as_path(), mesh_path.as_path()])?;
    let mut report = Report::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    let (mesh, _, digest) = Mesh::read(mesh_path)?;
    let keys = keys(&mesh, mesh_path, wishes.by)?;
    let expected = match wishes.by {
        Rows::Element => mesh.element_count(),
        Rows::Face => mesh.input_face_count as usize,
    };
    let (table, table_digest) = report.phase("read", || foreign::read(table_path, expected))?;
    let areas: Vec<f64> =
        mesh.element_ids().map(|element| polygon::area(&mesh.element_corners(element))).collect();
    check_entries(&table, table_path)?;
    check_areas(&table.areas, &keys, &areas, &mut report);
    let stated = wishes.tolerance.unwrap_or(0.0);
    let (table, strangers) = table.of_elements(&keys);
    let factors = Imported { table: &table, areas: &areas, strangers };
    let findings = report.phase("check", || factors.findings(stated));
    findings.say(&mut report, wishes.reciprocity);

    let row_errors = findings.row_errors(wishes.reciprocity, stated);
    let found = row_errors.iter().copied().fold(0.0, f64::max);
    let keep = wishes.reciprocity == Reciprocity::Keep;
    let symmetric = !keep || findings.worst_reciprocity == 0.0;
    let precision = match wishes.precision {
        PrecisionName::F32 => Precision::F32,
        PrecisionName::F64 => Precision::F64,
    };
    report.flags = flags(wishes);
    let origin = report
        .flags
        .iter()
        .fold(Provenance::new("formfactor-tool", env!("CARGO_PKG_VERSION")), |origin, flag| {
            origin.flag(flag.as_str())
        });
    let origin = origin.input("mesh", digest).input("factors", table_digest);
    let tolerance = wishes.tolerance.unwrap_or(found);
    let record = MatrixRecord {
        elements: areas.len() as u32,
        mesh: digest,
        precision,
        symmetric,
        extended: false,
        tolerance,
        part: 0,
        parts: 1,
    };
    let mut store = Store::create(Partial::create(output)?, origin, record, &areas)?;
    report.phase("blocks", || factors.store(&mut store, symmetric, precision))?;
    store.row_errors = row_errors;
    let closed = if symmetric {
        closure::close(&mut store, Some(wishes.closure))?
    } else if wishes.closure == Closure::Off {
        None
    } else {
        anyhow::bail!(
            "--closure works on both sides of a pair at once: leave --reciprocity keep out, or --closure"
        )
    };
    note_rows(&mut report, &store, closed.as_ref(), tolerance);
    report.estimate("worst difference from reciprocity in a row", findings.worst_reciprocity);
    report.estimate("largest row sum as imported", findings.largest_sum.1);
    report.count("rows whose sum is above 1", findings.above_one);
    report.phase("write", || store.finish())?;
    report.write_beside(output)?;
    match wishes.tolerance {
        Some(asked) if found > asked => Ok(Finish::ToleranceMissed(format!(
            "a row's error is at least {found:.3e}, above the stated {asked:e}; the file says what was found"
        ))),
        _ => Ok(Finish::Done),
    }
}

fn flags(wishes: &Wishes) -> Vec<String> {
    let mut flags = vec!["import".to_owned(), format!("--by {}", name(wishes.by))];
    flags.extend(wishes.tolerance.map(|tolerance| format!("--tolerance {tolerance:e}")));
    flags.push(format!("--reciprocity {}", name(wishes.reciprocity)));
    flags.push(format!("--precision {}", name(wishes.precision)));
    flags.push(format!("--closure {}", name(wishes.closure)));
    flags
}

/// Row of the table for each element.
fn keys(mesh: &Mesh, path: &Path, by: Rows) -> anyhow::Result<Vec<u32>> {
    let by = match by {
        Rows::Element => By::Element,
        Rows::Face => By::Face,
    };
    let keys = Grouping::new(mesh, by).key_of_element;
    let mut seen = std::collections::HashMap::new();
    for (element, &key) in keys.iter().enumerate() {
        if let Some(other) = seen.insert(key, element) {
            return Err(Error::whole(
                path,
                format!("face {} has several elements ({} and {}); factors by face say nothing of each: make the mesh without --elements and --max-edge", key + 1, other + 1, element + 1),
            ))
            .context("import --by face");
        }
    }
    Ok(keys)
}

/// Factors between the elements of a mesh.
struct Imported<'a> {
    table: &'a Table,
    areas: &'a [f64],
    /// Rows and entries of the file that belong to no element and are not zero.
    strangers: usize,
}

/// What is wrong with the factors.
struct Findings {
    /// Row sums of F.
    sums: Vec<f64>,
    /// Sum over j of |F_ij - A_j F_ji / A_i|.
    reciprocity: Vec<f64>,
    worst_reciprocity: f64,
    /// The pair of elements that differs most, with both factors from the first's side.
    worst_pair: (usize, usize, f64, f64),
    largest_sum: (usize, f64),
    /// Rows whose sum is above 1 by more than rounding and the stated error.
    above_one: usize,
    /// Elements that see themselves.
    to_itself: usize,
    /// As [`Imported::strangers`].
    strangers: usize,
}

fn check_entries(table: &Table, path: &Path) -> anyhow::Result<()> {
    for row in 0..table.count() {
        let (columns, values) = table.row(row);
        let wrong = values.iter().position(|x| !(x.is_finite() && *x >= 0.0));
        if let Some(k) = wrong {
            let message = format!(
                "row {}, column {}: found {}, expected a factor of at least 0",
                row + 1,
                columns[k] + 1,
                values[k]
            );
            return Err(Error::whole(path, message).into());
        }
    }
    Ok(())
}

/// Says where the areas that a table gives differ from those of the elements.
fn check_areas(given: &[f64], keys: &[u32], areas: &[f64], report: &mut Report) {
    let of = |element: usize| given.get(keys[element] as usize);
    let differs = |element: &usize| {
        of(*element).is_some_and(|area| (area - areas[*element]).abs() > SAME_AREA * areas[*element])
    };
    let count = (0..areas.len()).filter(differs).count();
    if let Some(element) = (0..areas.len()).find(differs) {
        report.warn(format!(
            "{} of the mesh, first at element {}: {:?} and {}; are rows and elements in the same order?",
            counted(count, "area in the table differs from that", "areas in the table differ from those"),
            element + 1,
            of(element),
            areas[element]
        ));
    }
}

impl Imported<'_> {
    fn findings(&self, stated: f64) -> Findings {
        let count = self.areas.len();
        let mut found = Findings {
            sums: vec![0.0; count],
            reciprocity: vec![0.0; count],
            worst_reciprocity: 0.0,
            worst_pair: (0, 0, 0.0, 0.0),
            largest_sum: (0, 0.0),
            above_one: 0,
            to_itself: 0,
            strangers: self.strangers,
        };
        // The other side of every pair: its column is the row that is looked at, and rises.
        let mut other_side = self.table.ascending();
        for i in progress("check", count).wrap_iter(0..count) {
            let (columns, values) = self.table.row(i);
            for (&column, &forth) in columns.iter().zip(values) {
                let j = column as usize;
                found.sums[i] += forth;
                found.to_itself += usize::from(i == j);
                let back = other_side.get(j, i) * self.areas[j] / self.areas[i];
                // Where the other side is zero, this visit counts for both rows.
                let difference = (forth - back).abs();
                found.reciprocity[i] += difference;
                if back == 0.0 {
                    found.reciprocity[j] += difference * self.areas[i] / self.areas[j];
                }
                let (a, b, f, g) = found.worst_pair;
                if difference * self.areas[i] > (f - g).abs() * self.areas[a] || (a, b) == (0, 0) {
                    found.worst_pair = (i, j, forth, back);
                }
            }
        }
        for (i, &sum) in found.sums.iter().enumerate() {
            if sum > found.largest_sum.1 {
                found.largest_sum = (i, sum);
            }
            found.above_one += usize::from(sum > 1.0 + ROUNDING.max(stated));
        }
        found.worst_reciprocity = found.reciprocity.iter().copied().fold(0.0, f64::max);
        found
    }

    /// Writes the blocks of S: above the diagonal and on it where it is symmetric, else all.
    fn store(&self, store: &mut Store, symmetric: bool, precision: Precision) -> interchange::Result<()> {
        let count = self.areas.len();
        let bar = progress("blocks", count.div_ceil(BLOCK).pow(2));
        let mut across = self.table.ascending();
        for first in (0..count).step_by(BLOCK) {
            let mut along = self.table.ascending();
            // Of a symmetric matrix row k of blocks is k blocks shorter.
            bar.inc(if symmetric { (first / BLOCK) as u64 } else { 0 });
            let rows = first..(first + BLOCK).min(count);
            for start in (if symmetric { first } else { 0 }..count).step_by(BLOCK) {
                bar.inc(1);
                let columns = start..(start + BLOCK).min(count);
                let triangle = symmetric && start == first;
                let mut block = vec![0.0; rows.len() * columns.len()];
                for i in rows.clone() {
                    along.before(i, columns.end, |j, factor| {
                        if j >= columns.start {
                            block[(i - first) * columns.len() + j - start] += self.areas[i] * factor;
                        }
                    });
                }
                if symmetric {
                    for j in columns.clone() {
                        across.before(j, rows.end, |i, factor| {
                            block[(i - first) * columns.len() + j - start] += self.areas[j] * factor;
                        });
                    }
                    block.iter_mut().for_each(|entry| *entry *= 0.5);
                }
                let entries: Vec<f64> = if triangle {
                    block.chunks(columns.len()).enumerate().flat_map(|(i, row)| &row[i..]).copied().collect()
                } else {
                    block
                };
                if entries.iter().all(|&s| s == 0.0) {
                    continue;
                }
                let range = |r: &std::ops::Range<usize>| r.start as u32..r.end as u32;
                let packed =
                    PackedBlock::new(range(&rows), range(&columns), triangle, &entries, precision, symmetric);
                store.append(&packed, symmetric)?;
            }
        }
        Ok(())
    }
}

impl Findings {
    /// Known errors of the rows, at least.
    fn row_errors(&self, reciprocity: Reciprocity, stated: f64) -> Vec<f64> {
        let share = if reciprocity == Reciprocity::Mean { 0.5 } else { 1.0 };
        let known = |(difference, sum): (&f64, &f64)| (share * difference).max(sum - 1.0).max(stated);
        self.reciprocity.iter().zip(&self.sums).map(known).collect()
    }

    fn say(&self, report: &mut Report, reciprocity: Reciprocity) {
        let (row, sum) = self.largest_sum;
        if self.above_one > 0 {
            report.warn(format!(
                "{} up to more than 1, most that of element {}: {sum:.6}; more cannot leave an element than it sends",
                counted(self.above_one, "row sums", "rows sum"),
                row + 1
            ));
        }
        if self.worst_reciprocity > ROUNDING {
            let (i, j, forth, back) = self.worst_pair;
            let what = match reciprocity {
                Reciprocity::Mean => "their mean is stored",
                Reciprocity::Keep => "both are stored",
            };
            report.warn(format!(
                "reciprocity: a row differs by up to {:.3e} in all; most the pair of elements {} and {}: F = {forth:.6e}, and {back:.6e} from the \
                 other side; {what}",
                self.worst_reciprocity,
                i + 1,
                j + 1
            ));
        }
        if self.to_itself > 0 {
            let those = counted(self.to_itself, "element sees itself", "elements see themselves");
            report.warn(format!("{those}, which no plane element does"));
        }
        if self.strangers > 0 {
            report.warn(counted(
                self.strangers,
                "row or entry belongs to a face without an element and was left out",
                "rows or entries belong to faces without an element and were left out",
            ));
        }
    }
}
