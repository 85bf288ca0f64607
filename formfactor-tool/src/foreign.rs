//! Factors F(i -> j) as other programs read and write them, one file per format.
//!
//! | format | ending | writes | reads |
//! |---|---|---|---|
//! | CSV | `.csv` | header of names, a row per line | the same, or plain numbers without a header |
//! | npy | `.npy` | dense float64 | float32 and float64, either order |
//! | npz | `.npz` | scipy CSR, float64 | scipy CSR, CSC and COO |
//! | MatrixMarket | `.mtx` | coordinates, real, general | coordinates and arrays, real and integer, general and symmetric |
//! | Radiance | `.rmx` | one component, double | one component, or equal ones; ASCII, float and double |
//! | View3D | `.vf` | text, 6 decimals as View3D itself | text |
//!
//! Zeros are not kept, but in dense formats written as such. Reading holds the whole matrix in memory, 12 bytes for
//! each entry that is not zero.

pub mod csv;
pub mod matrix_market;
pub mod npy;
pub mod npz;
pub mod radiance;
mod table;
pub mod view3d;
mod zip;

pub use table::{RowSource, Table};

use clap::ValueEnum;
use interchange::atomic_write::is_stdout;
use interchange::digest::Digest;
use interchange::error::{Error, Result, meant_ending};
use interchange::tool::progress;
use std::io::Read;
use std::path::Path;

/// Bytes between two steps of the bar.
const PART: u64 = 1 << 24;

/// How a table of factors is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated values with a header (.csv)
    Csv,
    /// numpy array (.npy)
    Npy,
    /// scipy sparse matrix, CSR (.npz)
    Npz,
    /// MatrixMarket coordinates (.mtx)
    MatrixMarket,
    /// Radiance matrix, as rmtxop and dctimestep read it (.rmx)
    Radiance,
    /// Output of View3D, format 0 (.vf)
    View3d,
}

/// Formats and the endings that ask for them.
const ENDINGS: [(&str, Format); 6] = [
    ("csv", Format::Csv),
    ("npy", Format::Npy),
    ("npz", Format::Npz),
    ("mtx", Format::MatrixMarket),
    ("rmx", Format::Radiance),
    ("vf", Format::View3d),
];

impl Format {
    /// The one asked for, or else the one that the name's ending asks for; CSV for standard output.
    ///
    /// # Errors
    /// The ending is none of the known ones.
    pub fn of(path: &Path, asked: Option<Format>) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let for_stdout = is_stdout(path).then_some(Format::Csv);
        let by_ending =
            || for_stdout.or(ENDINGS.iter().find(|(name, _)| *name == ending).map(|(_, format)| *format));
        asked.or_else(by_ending).ok_or_else(|| {
            let names: Vec<String> = ENDINGS.iter().map(|(name, _)| format!(".{name}")).collect();
            let message = format!(
                "the name must end in {}, which says the format{}; or say --format",
                names.join(", "),
                meant_ending(path, ENDINGS.map(|(name, _)| name))
            );
            Error::whole(path, message)
        })
    }
}

/// Reads a table of `expected` rows and columns, whose format its first bytes tell, and the digest of its file.
///
/// # Errors
/// What was found and what was expected, with line or place.
pub fn read(path: &Path, expected: usize) -> Result<(Table, Digest)> {
    let bytes = read_shown(path).map_err(|e| Error::io(path, "read", e))?;
    // The digest of a long file takes as long as reading it does: both at once.
    let (table, digest) = rayon::join(|| parse(path, &bytes, expected), || Digest::of(&bytes));
    Ok((table?, digest))
}

/// The bytes of a file, with a bar while they come.
fn read_shown(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = std::fs::File::open(path)?;
    let length = file.metadata()?.len();
    let bar = progress("file", (length / PART + 1) as usize);
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    while file.by_ref().take(PART).read_to_end(&mut bytes)? > 0 {
        bar.inc(1);
    }
    Ok(bytes)
}

fn parse(path: &Path, bytes: &[u8], expected: usize) -> Result<Table> {
    if bytes.starts_with(b"\x93NUMPY") {
        return npy::read(path, bytes, expected);
    }
    if bytes.starts_with(b"PK") {
        return npz::read(path, bytes, expected);
    }
    if bytes.starts_with(b"#?") {
        return radiance::read(path, bytes, expected);
    }
    let text = std::str::from_utf8(bytes).map_err(|_| {
        Error::whole(
            path,
            "found neither text nor npy, npz or a Radiance matrix; see formfactor-tool import --help",
        )
    })?;
    if text.starts_with("%%MatrixMarket") {
        matrix_market::read(path, text, expected)
    } else if text.starts_with("View3D") || text.starts_with("VIEW3D") {
        view3d::read(path, text, expected)
    } else {
        csv::read(path, text, expected)
    }
}
