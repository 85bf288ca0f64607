//! Factors in the MatrixMarket exchange format (Boisvert, Pozo & Remington 1996): a banner, comments, sizes, entries that
//! count from 1.

use super::table::{Numbers, Steps};
use super::{RowSource, Table};
use interchange::atomic_write::{self, Outcome};
use interchange::error::{Error, Result};
use interchange::tables::number;
use std::io::SeekFrom;
use std::path::Path;

/// Writes the entries that are not zero. Their number is known at the end only; its place is kept free in the header.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    let count = source.count();
    atomic_write::write(path, |out| {
        writeln!(out, "%%MatrixMarket matrix coordinate real general")?;
        writeln!(out, "% F(row -> column), rows and columns by {}", source.labels().0)?;
        let size_line = out.stream_position()?;
        let size = |entries: u64| format!("{count} {count} {entries:<20}\n");
        out.write_all(size(0).as_bytes())?;
        let mut entries = 0;
        for (row, values) in source.rows().enumerate() {
            for (column, &value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                writeln!(out, "{} {} {}", row + 1, column + 1, number(value))?;
                entries += 1;
            }
        }
        out.seek(SeekFrom::Start(size_line))?;
        out.write_all(size(entries).as_bytes())?;
        out.seek(SeekFrom::End(0)).map(|_| ())
    })
}

/// Reads a square matrix of real or whole numbers, `general` or `symmetric`, by coordinates or in full (columns one after
/// another).
///
/// # Errors
/// The line of what cannot be read.
pub fn read(path: &Path, text: &str, expected: usize) -> Result<Table> {
    let banner = text.lines().next().unwrap_or_default().to_lowercase();
    let words: Vec<&str> = banner.split_whitespace().collect();
    let [
        "%%matrixmarket",
        "matrix",
        layout @ ("coordinate" | "array"),
        "real" | "double" | "integer",
        symmetry @ ("general" | "symmetric"),
    ] = words[..]
    else {
        let expected = "expected matrix, coordinate or array, real or integer, general or symmetric";
        return Err(Error::scene(path, 1, format!("found {banner}, {expected}")));
    };
    let symmetric = symmetry == "symmetric";
    let mut numbers = Numbers::new(path, text, 0, |line| !line.starts_with('%'));
    let rows: usize = numbers.next("the number of rows")?;
    let columns: usize = numbers.next("the number of columns")?;
    let count = Table::check_square(path, rows, columns, expected)?;
    let mut entries = Vec::new();
    let mut add = |row: usize, column: usize, value: f64| {
        entries.push((row as u32, column as u32, value));
        if symmetric && row != column {
            entries.push((column as u32, row as u32, value));
        }
    };
    if layout == "coordinate" {
        let listed: usize = numbers.next("the number of entries")?;
        let bar = Steps::new("read", listed);
        for k in 0..listed {
            bar.at(k);
            let [row, column] = [numbers.next::<usize>("a row")?, numbers.next::<usize>("a column")?];
            let value = numbers.next("a value")?;
            if !(1..=count).contains(&row) || !(1..=count).contains(&column) {
                return Err(Error::whole(
                    path,
                    format!("row {row}, column {column}: places count from 1 to {count}"),
                ));
            }
            add(row - 1, column - 1, value);
        }
    } else {
        for column in 0..count {
            for row in if symmetric { column } else { 0 }..count {
                let value: f64 = numbers.next("a value")?;
                if value != 0.0 {
                    add(row, column, value);
                }
            }
        }
    }
    numbers.end()?;
    Table::from_entries(path, count, &entries)
}
