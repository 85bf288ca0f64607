//! Factors as comma-separated values: a header of names and a row per line, its name first; read also without either, and
//! with blanks or semicolons between the numbers.

use super::{RowSource, Table};
use interchange::atomic_write::Outcome;
use interchange::error::{Error, Result};
use interchange::tables::{number, write_csv};
use interchange::tool::progress;
use std::path::Path;

/// Writes a table.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    let (title, labels) = source.labels();
    let header: Vec<String> = std::iter::once(title.to_owned()).chain(labels.iter().cloned()).collect();
    let lines = source
        .rows()
        .zip(labels)
        .map(|(row, label)| std::iter::once(label.clone()).chain(row.into_iter().map(number)).collect());
    write_csv(path, &header, lines)
}

/// Reads a table: with a header, where the first line has a cell that is no number; then the first cell of every line is
/// a name where the header has one cell more than there are lines.
///
/// # Errors
/// Lines of different lengths, a cell that is no number, a table that is not square.
pub fn read(path: &Path, text: &str, expected: usize) -> Result<Table> {
    let blanks_only = text.lines().next().is_some_and(|first| !first.contains([',', ';']));
    // One blank between numbers, as `numpy.savetxt` writes by default, or any number of them.
    let spaced: String;
    let text = if blanks_only {
        spaced =
            text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(",") + "\n").collect();
        &spaced
    } else {
        text
    };
    let semicolons = text.lines().next().is_some_and(|first| first.contains(';') && !first.contains(','));
    let delimiter = if semicolons { b';' } else { b',' };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .from_reader(text.as_bytes());
    let mut lines = Vec::new();
    let bar = progress("lines", text.len());
    for record in reader.records() {
        let record = record.map_err(|e| Error::whole(path, format!("not a CSV table: {e}")))?;
        bar.set_position(record.position().map_or(0, csv::Position::byte));
        let line = record.position().map_or(0, |position| position.line() as usize);
        lines.push((line, record));
    }
    let is_number = |cell: &str| cell.trim().parse::<f64>().is_ok();
    let headed = lines.first().is_some_and(|(_, record)| !record.iter().all(is_number));
    let lines = &lines[usize::from(headed)..];
    let cells = lines.first().map_or(0, |(_, record)| record.len());
    let named = headed && cells == lines.len() + 1;
    let count = Table::check_square(path, lines.len(), cells - usize::from(named), expected)?;
    let mut table = Table::empty();
    for (line, record) in progress("read", lines.len()).wrap_iter(lines.iter()) {
        if record.len() != cells {
            let message = format!("found {} cells, expected {cells} as in the lines before", record.len());
            return Err(Error::scene(path, *line, message));
        }
        let mut row = Vec::with_capacity(count);
        for cell in record.iter().skip(usize::from(named)) {
            let value = cell.trim().parse();
            row.push(
                value.map_err(|_| Error::scene(path, *line, format!("found {cell}, expected a number")))?,
            );
        }
        table.push_row(row);
    }
    Ok(table)
}
