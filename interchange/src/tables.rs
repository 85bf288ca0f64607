//! Tables for people and other programs: CSV by RFC 4180 with 17 digits, and npy.

use crate::atomic_write::{self, Outcome};
use crate::error::{Error, Result, meant_ending};
use std::path::Path;

/// What the end of a file name asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Comma-separated values.
    Csv,
    /// numpy array.
    Npy,
}

impl TableFormat {
    /// The format that the name's ending asks for, out of those `allowed`; CSV for standard output.
    pub fn of(path: &Path, allowed: &[TableFormat]) -> Result<Self> {
        if atomic_write::is_stdout(path) {
            return Ok(TableFormat::Csv);
        }
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let format = [("csv", TableFormat::Csv), ("npy", TableFormat::Npy)];
        let name = |wanted: &TableFormat| format.iter().find(|(_, f)| f == wanted).map_or("", |(n, _)| *n);
        let found = format.iter().find(|(n, f)| *n == ending && allowed.contains(f)).map(|(_, f)| *f);
        found.ok_or_else(|| {
            let meant = meant_ending(path, allowed.iter().map(name));
            let names: Vec<String> = allowed.iter().map(|f| format!(".{}", name(f))).collect();
            Error::whole(
                path,
                format!("the name must end in {}, which says the format{meant}", names.join(" or ")),
            )
        })
    }
}

/// A number in Rust's shortest form that gives its bits back (at most 17 digits), scientific where plain is long.
pub fn number(x: f64) -> String {
    let plain = format!("{x}");
    if plain.len() <= 24 { plain } else { format!("{x:e}") }
}

/// Writes a CSV table.
pub fn write_csv(path: &Path, header: &[String], rows: impl Iterator<Item = Vec<String>>) -> Result<Outcome> {
    atomic_write::write(path, |out| {
        let mut csv = csv::WriterBuilder::new().from_writer(out);
        csv.write_record(header)?;
        for row in rows {
            csv.write_record(&row)?;
        }
        csv.flush()
    })
}

/// Writes a two-dimensional array of f64 as npy, rows one after another.
pub fn write_npy(
    path: &Path,
    columns: usize,
    rows: usize,
    values: impl Iterator<Item = f64>,
) -> Result<Outcome> {
    use npyz::WriterBuilder;
    atomic_write::write(path, |out| {
        let shape = [rows as u64, columns as u64];
        let mut npy = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(out).begin_nd()?;
        npy.extend(values)?;
        npy.finish()
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn numbers_give_their_bits_back() {
        for x in [0.1, 1.0 / 3.0, 1e-300, 123456789.123456, 0.0, -2.5e17, f64::MIN_POSITIVE] {
            assert_eq!(number(x).parse::<f64>().unwrap().to_bits(), x.to_bits());
        }
    }

    #[test]
    fn csv_quotes_what_needs_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        write_csv(&path, &["a,b".into(), "c\"d".into()], [vec!["1".into(), "x y".into()]].into_iter())
            .unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "\"a,b\",\"c\"\"d\"\n1,x y\n");
    }
}
