//! Factors as a scipy sparse matrix: what `scipy.sparse.save_npz` writes and `load_npz` reads. Written as CSR.

use super::{RowSource, Table, npy, zip};
use interchange::atomic_write::{self, Outcome};
use interchange::error::{Error, Result};
use interchange::tool::progress;
use npyz::{AutoSerialize, DType, WriterBuilder};
use std::path::Path;

/// Values between two looks at the bar.
const PART: usize = 1 << 16;

/// Writes a table; its entries that are not zero are held in memory.
///
/// # Errors
/// The file cannot be written, or would be longer than 4 GiB.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    let mut table = Table::empty();
    source.rows().for_each(|row| table.push_row(row));
    let count = table.count();
    let (mut starts, mut columns, mut values) = (vec![0i64], Vec::new(), Vec::new());
    for row in 0..count {
        let (row_columns, row_values) = table.row(row);
        columns.extend(row_columns.iter().map(|&column| column as i32));
        values.extend_from_slice(row_values);
        starts.push(values.len() as i64);
    }
    // scipy wants both lists of whole numbers to be of one type: the short one where it does.
    let (starts, columns) = match i32::try_from(values.len()) {
        Ok(_) => (array(&starts.iter().map(|&x| x as i32).collect::<Vec<i32>>()), array(&columns)),
        Err(_) => (array(&starts), array(&columns.iter().map(|&x| i64::from(x)).collect::<Vec<i64>>())),
    };
    let fill = || -> std::io::Result<[(&str, Vec<u8>); 5]> {
        Ok([
            ("indices.npy", columns?),
            ("indptr.npy", starts?),
            ("format.npy", name("csr")?),
            ("shape.npy", array(&[count as i64; 2])?),
            ("data.npy", array(&values)?),
        ])
    };
    atomic_write::write(path, |mut out| zip::write(&mut out, &fill()?))
}

fn array<T: AutoSerialize + Copy>(values: &[T]) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let options = npyz::WriteOptions::new().default_dtype().shape(&[values.len() as u64]);
    let mut writer = options.writer(&mut bytes).begin_nd()?;
    let parts = values.chunks(PART);
    let mut parts = progress("arrays", parts.len()).wrap_iter(parts);
    parts.try_for_each(|part| writer.extend(part.iter().copied()))?;
    writer.finish()?;
    Ok(bytes)
}

/// A word as an array without dimensions.
fn name(word: &str) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let kind = format!("|S{}", word.len()).parse().map_err(|_| std::io::ErrorKind::InvalidInput)?;
    let options = npyz::WriteOptions::<[u8]>::new().dtype(DType::Plain(kind)).shape(&[]);
    let mut writer = options.writer(&mut bytes).begin_nd()?;
    writer.push(word.as_bytes())?;
    writer.finish()?;
    Ok(bytes)
}

/// Reads a square sparse matrix in CSR, CSC or COO form.
///
/// # Errors
/// The archive is damaged, or holds another kind of matrix.
pub fn read(path: &Path, bytes: &[u8], expected: usize) -> Result<Table> {
    let entries = zip::read(path, bytes)?;
    let find = |wanted: &str| -> Result<&[u8]> {
        let found = entries.iter().find(|(name, _)| name.strip_suffix(".npy") == Some(wanted));
        found.map(|(_, content)| content.as_ref()).ok_or_else(|| {
            let names: Vec<&str> = entries.iter().map(|(name, _)| name.as_str()).collect();
            let message = format!(
                "no array {wanted} among {}; expected what scipy.sparse.save_npz writes",
                names.join(", ")
            );
            Error::whole(path, message)
        })
    };
    let numbers = |name: &str| npy::integers(path, npy::open(path, find(name)?)?, usize::MAX);
    let indices = |name: &str| npy::integers(path, npy::open(path, find(name)?)?, u32::MAX);
    let shape = numbers("shape")?;
    let [rows, columns] = shape[..] else {
        return Err(Error::whole(path, format!("found the shape {shape:?}, expected two numbers")));
    };
    let count = Table::check_square(path, rows, columns, expected)?;
    let values = npy::floats(path, npy::open(path, find("data")?)?)?;
    // The word stands at the end of its array.
    let format = find("format")?;
    let is = |word: &[u8]| {
        let letters: Vec<u8> =
            format[format.len().saturating_sub(12)..].iter().copied().filter(|&b| b != 0).collect();
        letters.ends_with(word)
    };
    let lengths_agree = |others: &[u32]| {
        let differs = || Error::whole(path, "the lists of places and of values differ in length");
        if others.len() == values.len() { Ok(()) } else { Err(differs()) }
    };
    if is(b"coo") {
        let (rows, columns) = (indices("row")?, indices("col")?);
        lengths_agree(&rows)?;
        lengths_agree(&columns)?;
        let places = rows.into_iter().zip(columns).zip(values);
        let entries: Vec<_> = places.map(|((row, column), value)| (row, column, value)).collect();
        return Table::from_entries(path, count, &entries);
    }
    if !is(b"csr") && !is(b"csc") {
        return Err(Error::whole(
            path,
            "expected a matrix in CSR, CSC or COO form; call .tocsr() before saving it",
        ));
    }
    let starts = numbers("indptr")?;
    let fits =
        starts.len() == count + 1 && starts[0] == 0 && starts.is_sorted() && starts[count] == values.len();
    if !fits {
        return Err(Error::whole(path, "indptr does not rise from 0 to the number of entries"));
    }
    let minor = indices("indices")?;
    lengths_agree(&minor)?;
    if is(b"csr") {
        return Table::from_rows(path, starts, minor, values);
    }
    // The lists of CSC are columns.
    let columns = starts.windows(2).enumerate();
    let columns = columns.flat_map(|(k, pair)| std::iter::repeat_n(k as u32, pair[1] - pair[0]));
    let places = minor.into_iter().zip(columns).zip(values);
    let entries: Vec<_> = places.map(|((row, column), value)| (row, column, value)).collect();
    Table::from_entries(path, count, &entries)
}
