//! A table of factors in memory, and what formats are written from.

use interchange::error::{Error, Result};
use interchange::tool::{ProgressBar, progress};
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
    pub fn from_entries(path: &Path, count: usize, entries: &[(u32, u32, f64)]) -> Result<Self> {
        // Counted into their rows, which takes one look at each entry where sorting takes many.
        let mut starts = vec![0usize; count + 1];
        for &(row, column, _) in entries {
            if row as usize >= count || column as usize >= count {
                return Err(Error::whole(
                    path,
                    format!("{}: the matrix has {count} rows", place(row, column)),
                ));
            }
            starts[row as usize + 1] += 1;
        }
        (0..count).for_each(|row| starts[row + 1] += starts[row]);
        let mut next = starts.clone();
        let (mut columns, mut values) = (vec![0u32; entries.len()], vec![0.0; entries.len()]);
        let bar = Steps::new("rows", entries.len());
        for (done, &(row, column, value)) in entries.iter().enumerate() {
            bar.at(done);
            let at = &mut next[row as usize];
            (columns[*at], values[*at]) = (column, value);
            *at += 1;
        }
        Self::from_rows(path, starts, columns, values)
    }

    /// From the columns and values of rows one after another, with where each row starts and the last one ends. Columns
    /// may come in any order, none twice in a row.
    ///
    /// # Errors
    /// A column that does not exist, or one given twice.
    pub fn from_rows(
        path: &Path,
        starts: Vec<usize>,
        mut columns: Vec<u32>,
        mut values: Vec<f64>,
    ) -> Result<Self> {
        let count = starts.len().saturating_sub(1);
        let mut any_zero = false;
        for row in progress("order", count).wrap_iter(0..count) {
            let range = starts[row]..starts[row + 1];
            let (columns, values) = (&mut columns[range.clone()], &mut values[range]);
            if !columns.is_sorted() {
                let mut pairs: Vec<(u32, f64)> =
                    columns.iter().copied().zip(values.iter().copied()).collect();
                pairs.sort_unstable_by_key(|&(column, _)| column);
                for (k, (column, value)) in pairs.into_iter().enumerate() {
                    (columns[k], values[k]) = (column, value);
                }
            }
            if let Some(&column) = columns.last().filter(|column| **column as usize >= count) {
                return Err(Error::whole(
                    path,
                    format!("{}: the matrix has {count} rows", place(row as u32, column)),
                ));
            }
            if let Some(pair) = columns.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(Error::whole(path, format!("{} is given twice", place(row as u32, pair[0]))));
            }
            any_zero |= values.contains(&0.0);
        }
        let table = Self { starts, columns, values, areas: Vec::new() };
        Ok(if any_zero { table.without_zeros() } else { table })
    }

    fn without_zeros(self) -> Self {
        let mut kept = Self { areas: self.areas.clone(), ..Self::empty() };
        for row in 0..self.count() {
            let (columns, values) = self.row(row);
            for (&column, &value) in columns.iter().zip(values).filter(|(_, value)| **value != 0.0) {
                kept.columns.push(column);
                kept.values.push(value);
            }
            kept.starts.push(kept.values.len());
        }
        kept
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

    /// The rows and columns `keys` (no key twice) in this order, and how many rows and entries without a key are left out.
    pub fn of_elements(self, keys: &[u32]) -> (Self, usize) {
        if keys.len() == self.count() && keys.is_sorted() {
            return (self, 0);
        }
        let mut element_of = vec![u32::MAX; self.count()];
        keys.iter().zip(0..).for_each(|(&key, element)| element_of[key as usize] = element);
        let no_element = |key: usize| element_of[key] == u32::MAX;
        let mut left_out =
            (0..self.count()).filter(|&row| no_element(row) && !self.row(row).0.is_empty()).count();
        let mut table = Self::empty();
        for &key in keys {
            let (columns, values) = self.row(key as usize);
            let kept =
                columns.iter().zip(values).map(|(&column, &value)| (element_of[column as usize], value));
            let mut kept: Vec<(u32, f64)> = kept.filter(|&(column, _)| column != u32::MAX).collect();
            left_out += columns.len() - kept.len();
            kept.sort_unstable_by_key(|&(column, _)| column);
            table.columns.extend(kept.iter().map(|&(column, _)| column));
            table.values.extend(kept.iter().map(|&(_, value)| value));
            table.starts.push(table.values.len());
        }
        (table, left_out)
    }

    /// Looks at entries whose column never falls from one look to the next in the same row.
    pub fn ascending(&self) -> Ascending<'_> {
        Ascending { table: self, next: self.starts[..self.count()].to_vec() }
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

fn place(row: u32, column: u32) -> String {
    format!("row {}, column {}", row + 1, column + 1)
}

/// A place in each row that only moves on: every entry is passed once, where searching would look at many for each.
#[derive(Debug, Clone)]
pub struct Ascending<'a> {
    table: &'a Table,
    next: Vec<usize>,
}

impl Ascending<'_> {
    /// An entry of a row, at or behind the columns that were asked for in this row before.
    pub fn get(&mut self, row: usize, column: usize) -> f64 {
        let mut found = 0.0;
        self.before(row, column + 1, |other, value| {
            if other == column {
                found = value;
            }
        });
        found
    }

    /// All entries of a row that were not passed yet, up to those before a column.
    pub fn before(&mut self, row: usize, end: usize, mut each: impl FnMut(usize, f64)) {
        let Self { table, next } = self;
        let last = table.starts[row + 1];
        let mut k = next[row];
        while k < last && (table.columns[k] as usize) < end {
            each(table.columns[k] as usize, table.values[k]);
            k += 1;
        }
        next[row] = k;
    }
}

/// A bar for so many small steps that even counting each would cost: it looks at every 4096th.
pub(super) struct Steps(ProgressBar);

impl Steps {
    pub(super) fn new(title: &'static str, steps: usize) -> Self {
        Self(progress(title, steps))
    }

    /// So many steps are done.
    pub(super) fn at(&self, done: usize) {
        if done.is_multiple_of(1 << 12) {
            self.0.set_position(done as u64);
        }
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
            Table::from_entries(path, 3, &[(2, 0, 0.5), (0, 1, 0.25), (2, 1, 0.0), (0, 0, 1.0)]).unwrap();
        assert_eq!(table.row(0), (&[0, 1][..], &[1.0, 0.25][..]));
        assert_eq!(table.row(1), (&[][..], &[][..]));
        assert_eq!((table.row(2), table.entries()), ((&[0][..], &[0.5][..]), 3));
        let twice = Table::from_entries(path, 3, &[(1, 1, 0.5), (1, 1, 0.5)]).unwrap_err().to_string();
        assert!(twice.contains("row 2, column 2 is given twice"), "{twice}");
        let outside = Table::from_entries(path, 3, &[(1, 3, 0.5)]).unwrap_err().to_string();
        assert!(outside.contains("row 2, column 4: the matrix has 3 rows"), "{outside}");
        assert!(Table::from_rows(path, vec![0, 1], vec![1], vec![0.5]).is_err());
    }

    #[test]
    fn looks_that_move_on_find_every_entry() {
        let entries = [(0, 1, 0.25), (0, 2, 0.5), (2, 0, 0.125), (2, 2, 1.0)];
        let table = Table::from_entries(Path::new("t.mtx"), 3, &entries).unwrap();
        let full = |row: usize, column: usize| {
            let found = entries.iter().find(|entry| (entry.0 as usize, entry.1 as usize) == (row, column));
            found.map_or(0.0, |entry| entry.2)
        };
        let mut looks = table.ascending();
        for column in 0..3 {
            for row in 0..3 {
                assert_eq!(looks.get(row, column), full(row, column), "{row} {column}");
            }
        }
    }
}
