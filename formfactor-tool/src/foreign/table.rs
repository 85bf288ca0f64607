//! A table of factors in memory, and what formats are written from.

use interchange::error::{Error, Result};
use interchange::tool::progress;
use std::path::Path;

/// Rows to be written, made as they are asked for.
pub trait RowSource {
    /// Number of rows and of columns.
    fn count(&self) -> usize;
    /// Names of the rows, and of what they stand for.
    fn labels(&self) -> (&str, &[String]);
    /// Areas of what the rows stand for.
    fn areas(&self) -> &[f64];
    /// All rows in order: F(row -> every column).
    fn rows(&self) -> Box<dyn Iterator<Item = Vec<f64>> + '_>;
}

/// Rows of the entries that are not zero, columns rising; square.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    /// Areas that the file gives beside the factors; empty where it gives none.
    pub areas: Vec<f64>,
}

impl Table {
    /// A table without rows, to be filled row after row.
    pub fn empty() -> Self {
        Self { starts: vec![0], columns: Vec::new(), values: Vec::new(), areas: Vec::new() }
    }

    /// Adds a row given in full.
    pub fn push_row(&mut self, row: impl IntoIterator<Item = f64>) {
        for (column, value) in row.into_iter().enumerate().filter(|(_, value)| *value != 0.0) {
            self.columns.push(column as u32);
            self.values.push(value);
        }
        self.starts.push(self.values.len());
    }

    /// From entries in any order, no place twice.
    ///
    /// # Errors
    /// A place that does not exist, or one given twice.
    pub fn from_entries(path: &Path, count: usize, mut entries: Vec<(u32, u32, f64)>) -> Result<Self> {
        entries.sort_by_key(|&(row, column, _)| (row, column));
        let place = |&(row, column, _): &(u32, u32, f64)| format!("row {}, column {}", row + 1, column + 1);
        let outside =
            |(row, column, _): &&(u32, u32, f64)| *row as usize >= count || *column as usize >= count;
        if let Some(entry) = entries.iter().find(outside) {
            return Err(Error::whole(path, format!("{}: the matrix has {count} rows", place(entry))));
        }
        if let Some(pair) = entries.windows(2).find(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1)) {
            return Err(Error::whole(path, format!("{} is given twice", place(&pair[0]))));
        }
        let mut table = Self::empty();
        let mut next = 0;
        for row in progress("rows", count).wrap_iter(0..count) {
            while let Some(&(_, column, value)) = entries.get(next).filter(|entry| entry.0 as usize == row) {
                if value != 0.0 {
                    table.columns.push(column);
                    table.values.push(value);
                }
                next += 1;
            }
            table.starts.push(table.values.len());
        }
        Ok(table)
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of entries that are not zero.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Columns and values of a row.
    pub fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let range = self.starts[row]..self.starts[row + 1];
        (&self.columns[range.clone()], &self.values[range])
    }

    /// An entry.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        let (columns, values) = self.row(row);
        columns.binary_search(&(column as u32)).map_or(0.0, |k| values[k])
    }

    /// Refuses any shape but the expected square, before anything of the found size is allocated.
    pub(super) fn check_square(path: &Path, rows: usize, columns: usize, expected: usize) -> Result<usize> {
        if (rows, columns) == (expected, expected) {
            return Ok(rows);
        }
        let message =
            format!("found {rows} rows and {columns} columns, expected {expected} of each, as the mesh has");
        Err(Error::whole(path, message))
    }
}

/// Numbers of a text, one after another, with their lines.
pub(super) struct Numbers<'a> {
    path: &'a Path,
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
}

impl<'a> Numbers<'a> {
    /// The words of lines that `keep` keeps; `before` lines were passed over already.
    pub(super) fn new(path: &'a Path, text: &'a str, before: usize, keep: fn(&str) -> bool) -> Self {
        let lines = text.lines().enumerate().filter(move |(_, line)| keep(line));
        let words =
            lines.flat_map(move |(k, line)| line.split_whitespace().map(move |word| (k + 1 + before, word)));
        Self { path, words: Box::new(words) }
    }

    /// The next one.
    ///
    /// # Errors
    /// There is none, or it is no number of this kind.
    pub(super) fn next<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        let Some((line, word)) = self.words.next() else {
            return Err(Error::whole(self.path, format!("the file ends where {what} was expected")));
        };
        word.parse().map_err(|_| Error::scene(self.path, line, format!("found {word}, expected {what}")))
    }

    /// Refuses anything that is left.
    pub(super) fn end(mut self) -> Result<()> {
        match self.words.next() {
            None => Ok(()),
            Some((line, word)) => {
                Err(Error::scene(self.path, line, format!("found {word}, expected the end of the file")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn entries_find_their_rows() {
        let path = Path::new("t.mtx");
        let table =
            Table::from_entries(path, 3, vec![(2, 0, 0.5), (0, 1, 0.25), (2, 1, 0.0), (0, 0, 1.0)]).unwrap();
        assert_eq!(table.row(0), (&[0, 1][..], &[1.0, 0.25][..]));
        assert_eq!(table.row(1), (&[][..], &[][..]));
        assert_eq!((table.get(2, 0), table.get(2, 1), table.entries()), (0.5, 0.0, 3));
        let twice = Table::from_entries(path, 3, vec![(1, 1, 0.5), (1, 1, 0.5)]).unwrap_err().to_string();
        assert!(twice.contains("row 2, column 2 is given twice"), "{twice}");
        assert!(Table::from_entries(path, 3, vec![(1, 3, 0.5)]).is_err());
    }
}
