//! Factors as a two-dimensional numpy array.

use super::table::Steps;
use super::{RowSource, Table};
use interchange::atomic_write::Outcome;
use interchange::error::{Error, Result};
use interchange::tables::write_npy;
use interchange::tool::progress;
use npyz::{Deserialize, NpyFile, NpyReader, Order};
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
    let file = match file.try_data::<f64>() {
        Ok(values) => return items(path, values, |x| x),
        Err(file) => file,
    };
    match file.try_data::<f32>() {
        Ok(values) => items(path, values, f64::from),
        Err(_) => {
            Err(Error::whole(path, format!("found items of type {found}, expected float32 or float64")))
        }
    }
}

/// All items of an array of whole numbers that count or number something; what is out of the range of `T` becomes `none`.
pub(super) fn integers<R: Read, T>(path: &Path, file: NpyFile<R>, none: T) -> Result<Vec<T>>
where
    T: Copy + TryFrom<i32> + TryFrom<i64>,
{
    let found = file.dtype().descr();
    let file = match file.try_data::<i64>() {
        Ok(values) => return items(path, values, |x| T::try_from(x).unwrap_or(none)),
        Err(file) => file,
    };
    match file.try_data::<i32>() {
        Ok(values) => items(path, values, |x| T::try_from(x).unwrap_or(none)),
        Err(_) => Err(Error::whole(path, format!("found items of type {found}, expected int32 or int64"))),
    }
}

fn items<A: Deserialize, R: Read, T>(
    path: &Path,
    values: NpyReader<A, R>,
    convert: impl Fn(A) -> T,
) -> Result<Vec<T>> {
    // As many as the header says, which were found not to be more than the file has bytes.
    let count = values.len() as usize;
    let bar = Steps::new("arrays", count);
    let mut items = Vec::with_capacity(count);
    for value in values {
        bar.at(items.len());
        items.push(convert(value.map_err(|e| Error::whole(path, format!("the array is cut short: {e}")))?));
    }
    Ok(items)
}
