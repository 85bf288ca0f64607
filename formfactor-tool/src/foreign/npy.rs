//! Factors as a two-dimensional numpy array.

use super::{RowSource, Table};
use interchange::atomic_write::Outcome;
use interchange::error::{Error, Result};
use interchange::tables::write_npy;
use interchange::tool::progress;
use npyz::{NpyFile, Order};
use std::io::Read;
use std::path::Path;

/// Writes a table, dense, float64.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    write_npy(path, source.count(), source.count(), source.rows().flatten())
}

/// Reads a square array of floating-point numbers.
///
/// # Errors
/// Another shape or type, or a file cut short.
pub fn read(path: &Path, bytes: &[u8], expected: usize) -> Result<Table> {
    let file = open(path, bytes)?;
    let shape = file.shape().to_vec();
    let [rows, columns] = shape[..] else {
        return Err(Error::whole(
            path,
            format!("found an array of shape {shape:?}, expected a square matrix"),
        ));
    };
    let count = Table::check_square(path, rows as usize, columns as usize, expected)?;
    let order = file.order();
    let values = floats(path, file)?;
    let mut table = Table::empty();
    for row in progress("read", count).wrap_iter(0..count) {
        match order {
            Order::C => table.push_row(values[row * count..][..count].iter().copied()),
            Order::Fortran => table.push_row(values[row..].iter().step_by(count).copied()),
        }
    }
    Ok(table)
}

/// The array in these bytes.
pub(super) fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<NpyFile<&'a [u8]>> {
    let file = NpyFile::new(bytes).map_err(|e| Error::whole(path, format!("not a numpy array: {e}")))?;
    // Every item has at least a byte: a count beyond the file is a lie, and must not be allocated.
    if file.len() > bytes.len() as u64 {
        return Err(Error::whole(path, "the array is cut short"));
    }
    Ok(file)
}

/// All items of an array of numbers, in the order of the file.
pub(super) fn floats<R: Read>(path: &Path, file: NpyFile<R>) -> Result<Vec<f64>> {
    let found = file.dtype().descr();
    let failed = |e: std::io::Error| Error::whole(path, format!("the array is cut short: {e}"));
    let file = match file.try_data::<f64>() {
        Ok(values) => return values.collect::<std::io::Result<_>>().map_err(failed),
        Err(file) => file,
    };
    let file = match file.try_data::<f32>() {
        Ok(values) => {
            return values.map(|x| x.map(f64::from)).collect::<std::io::Result<_>>().map_err(failed);
        }
        Err(file) => file,
    };
    let _ = file;
    Err(Error::whole(path, format!("found items of type {found}, expected float32 or float64")))
}

/// All items of an array of whole numbers.
pub(super) fn integers<R: Read>(path: &Path, file: NpyFile<R>) -> Result<Vec<i64>> {
    let found = file.dtype().descr();
    let failed = |e: std::io::Error| Error::whole(path, format!("the array is cut short: {e}"));
    let file = match file.try_data::<i64>() {
        Ok(values) => return values.collect::<std::io::Result<_>>().map_err(failed),
        Err(file) => file,
    };
    match file.try_data::<i32>() {
        Ok(values) => values.map(|x| x.map(i64::from)).collect::<std::io::Result<_>>().map_err(failed),
        Err(_) => Err(Error::whole(path, format!("found items of type {found}, expected int32 or int64"))),
    }
}
