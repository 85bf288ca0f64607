//! CSV tables as the tools and the references write them: a header line, then rows; lines that begin with `#` are skipped.

use std::path::Path;

/// A table in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Cells, row after row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a table; every row must have as many cells as the header.
    pub fn read(path: &Path) -> Self {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_path(path)
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let cells = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
        let header = cells(reader.headers().unwrap_or_else(|e| panic!("{}: {e}", path.display())));
        let rows = reader
            .records()
            .map(|record| cells(&record.unwrap_or_else(|e| panic!("{}: {e}", path.display()))))
            .collect();
        Self { header, rows }
    }

    /// Number of a column.
    pub fn column(&self, name: &str) -> usize {
        let found = self.header.iter().position(|h| h == name);
        found.unwrap_or_else(|| panic!("no column {name} in {:?}", self.header))
    }

    /// The cell of a row in the named column, as a number.
    pub fn number(&self, row: usize, column: &str) -> f64 {
        let cell = &self.rows[row][self.column(column)];
        cell.parse().unwrap_or_else(|e| panic!("row {row}, {column}: {cell:?}: {e}"))
    }

    /// The row whose first cell is `key`.
    pub fn row_of(&self, key: &str) -> usize {
        let found = self.rows.iter().position(|row| row[0] == key);
        found.unwrap_or_else(|| panic!("no row {key}"))
    }
}
