//! Factors as View3D writes them (output format 0): a header line `View3D VERSION FORMAT ENCLOSURE EMITTANCES SURFACES`,
//! the areas, a row of factors per surface, the emittances.

use super::table::Numbers;
use super::{RowSource, Table};
use interchange::atomic_write::{self, Outcome};
use interchange::error::{Error, Result};
use interchange::tool::progress;
use std::path::Path;

/// Length that programs expect of the header line, without its end.
const HEADER: usize = 30;

/// Writes a table as View3D itself would: areas with 6 digits, factors with 6 decimals. The emittances are 0.999, View3D's
/// black.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    let count = source.count();
    atomic_write::write(path, |out| {
        let header = format!("View3D 3.5 0 0 0 {count}");
        writeln!(out, "{header:<HEADER$}")?;
        let areas: Vec<String> = source.areas().iter().map(|area| format!("{area:.5e}")).collect();
        writeln!(out, "{}", areas.join(" "))?;
        for row in source.rows() {
            let cells: Vec<String> = row.iter().map(|factor| format!("{factor:.6}")).collect();
            writeln!(out, "{}", cells.join(" "))?;
        }
        writeln!(out, "{}", vec!["0.999"; count].join(" "))
    })
}

/// Reads factors and areas.
///
/// # Errors
/// Another output format, factors with reflections in them, or a file that is cut short.
pub fn read(path: &Path, text: &str, expected: usize) -> Result<Table> {
    let (header, body) = text.split_once('\n').unwrap_or((text, ""));
    let words: Vec<&str> = header.split_whitespace().collect();
    let [_, _, format, _, emittances, surfaces] = words[..] else {
        return Err(Error::scene(
            path,
            1,
            "expected six words: View3D, version, format, enclosure, emittances, surfaces",
        ));
    };
    if format != "0" {
        let message = format!("found output format {format}, expected 0 (text); run View3D with out=0");
        return Err(Error::scene(path, 1, message));
    }
    if emittances != "0" {
        let message = "these factors have reflections in them (emit=1); run View3D with emit=0";
        return Err(Error::scene(path, 1, message));
    }
    let count: usize = surfaces
        .parse()
        .map_err(|_| Error::scene(path, 1, format!("found {surfaces}, expected the number of surfaces")))?;
    Table::check_square(path, count, count, expected)?;
    let mut numbers = Numbers::new(path, body, 1, |_| true);
    let mut table = Table::empty();
    for _ in 0..count {
        table.areas.push(numbers.next("an area")?);
    }
    for _ in progress("read", count).wrap_iter(0..count) {
        let mut row = Vec::new();
        for _ in 0..count {
            row.push(numbers.next("a factor")?);
        }
        table.push_row(row);
    }
    Ok(table)
}
