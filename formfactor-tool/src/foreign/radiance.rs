//! Factors as a Radiance matrix: a text header (`NROWS`, `NCOLS`, `NCOMP`, `FORMAT`) that an empty line ends, then rows of
//! numbers, as `rmtxop`, `dctimestep` and `rfluxmtx` read and write them.

use super::table::Numbers;
use super::{RowSource, Table};
use interchange::atomic_write::{self, Outcome};
use interchange::error::{Error, Result};
use interchange::tool::progress;
use std::path::Path;

/// Components of one entry (colour channels) agree to this, in units of the largest: they are one number in f32.
const SAME_COMPONENTS: f64 = 4.0 * f32::EPSILON as f64;

/// Writes a table with one component, little-endian doubles.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, source: &dyn RowSource) -> Result<Outcome> {
    let count = source.count();
    atomic_write::write(path, |out| {
        write!(out, "#?RADIANCE\nSOFTWARE= formfactor-tool export\n")?;
        write!(out, "NROWS={count}\nNCOLS={count}\nNCOMP=1\nBigEndian=0\nFORMAT=double\n\n")?;
        source.rows().flatten().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    })
}

/// Reads a square matrix. Of several components all must be equal: a factor has no colour.
///
/// # Errors
/// A header that lacks a size, another format, a file cut short or with bytes left over.
pub fn read(path: &Path, bytes: &[u8], expected: usize) -> Result<Table> {
    let end = bytes.windows(2).position(|pair| pair == b"\n\n");
    let end = end.ok_or_else(|| Error::whole(path, "no empty line ends the header"))?;
    let header = String::from_utf8_lossy(&bytes[..end]);
    // Where several programs have written a field, the last one holds, as in Radiance itself.
    let field = |name: &str| {
        let line = header.lines().rev().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        line.map(str::trim)
    };
    let size = |name: &str| {
        let number = field(name).and_then(|text| text.parse::<usize>().ok());
        number.ok_or_else(|| Error::whole(path, format!("the header lacks {name}=")))
    };
    let count = Table::check_square(path, size("NROWS")?, size("NCOLS")?, expected)?;
    let components = field("NCOMP").and_then(|text| text.parse().ok()).unwrap_or(3usize).max(1);
    let body = &bytes[end + 2..];
    let wanted = count.checked_mul(count).and_then(|n| n.checked_mul(components));
    let wanted = wanted.ok_or_else(|| Error::whole(path, "the header gives an impossible size"))?;
    let big_endian = field("BigEndian") == Some("1");
    let binary = |width: usize, value: fn(&[u8], bool) -> f64| -> Result<Vec<f64>> {
        if wanted.checked_mul(width) != Some(body.len()) {
            let message =
                format!("found {} bytes behind the header, expected {wanted} numbers of {width}", body.len());
            return Err(Error::whole(path, message));
        }
        Ok(body.chunks_exact(width).map(|chunk| value(chunk, big_endian)).collect())
    };
    let values = match field("FORMAT") {
        Some("double") => binary(8, |b, big| {
            let bytes = [b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]];
            if big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) }
        })?,
        Some("float") => binary(4, |b, big| {
            let bytes = [b[0], b[1], b[2], b[3]];
            f64::from(if big { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) })
        })?,
        Some("ascii") => {
            let text =
                std::str::from_utf8(body).map_err(|_| Error::whole(path, "the numbers are not text"))?;
            let mut numbers = Numbers::new(path, text, header.lines().count() + 1, |_| true);
            // No more than the file can hold, whatever the header says.
            let mut values = Vec::with_capacity(wanted.min(body.len()));
            for _ in 0..wanted {
                values.push(numbers.next("a number")?);
            }
            numbers.end()?;
            values
        }
        other => {
            let message =
                format!("found FORMAT={}, expected ascii, float or double", other.unwrap_or("nothing"));
            return Err(Error::whole(path, message));
        }
    };
    // An exposure says what all values were multiplied by; several multiply.
    let exposures =
        header.lines().filter_map(|line| line.strip_prefix("EXPOSURE=")?.trim().parse::<f64>().ok());
    let exposure: f64 = exposures.product();
    let largest = values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut table = Table::empty();
    let rows = values.chunks_exact(count * components).enumerate();
    for (row, entries) in progress("read", count).wrap_iter(rows) {
        for (column, entry) in entries.chunks_exact(components).enumerate() {
            if entry.iter().any(|x| (x - entry[0]).abs() > SAME_COMPONENTS * largest) {
                let message = format!(
                    "row {}, column {}: found {entry:?}, expected equal components",
                    row + 1,
                    column + 1
                );
                return Err(Error::whole(path, message));
            }
        }
        table.push_row(entries.chunks_exact(components).map(|entry| entry[0] / exposure));
    }
    Ok(table)
}
