//! `formfactor-tool info`: what a matrix file holds, for people and as JSON. Entries are read only where they are to be
//! verified: the page of a file larger than memory is there at once.

use crate::reuse::source::{REUSED_MATRIX, REUSED_MESH};
use interchange::error::Result;
use interchange::matrix::{BlockKind, Matrix};
use interchange::report::Report;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Said of what was only glanced at.
pub(crate) const UNVERIFIED: &str = "header, blocks and rows; not the entries, which --verify reads";

/// Describes the matrix in one file, in all its parts, or one part alone; with the counters of the report beside the
/// file, where there is one. With `verify` all of it is read and checked.
pub fn describe(paths: &[impl AsRef<Path>], as_json: bool, verify: bool) -> Result<String> {
    let matrix = match (paths, verify) {
        ([path], true) => Matrix::open_part(path.as_ref())?,
        ([path], false) => Matrix::glance_part(path.as_ref())?,
        (all, true) => Matrix::open_all(all)?,
        (all, false) => Matrix::glance_all(all)?,
    };
    let (path, files) = (matrix.path(), paths.len());
    let record = matrix.record();
    let elements = matrix.element_count();
    let stored = matrix.stored_entries()? as u64;
    // The half that is stored: the upper triangle with the diagonal.
    let half = elements as u64 * (elements as u64 + 1) / 2;
    let absent_share = 1.0 - stored as f64 / half as f64;
    let sums = if verify { Some(matrix.check_row_sums()?) } else { matrix.stated_row_sums()? };
    let row_sums = sums.as_deref().map(Spread::of);
    let row_errors = Spread::of(matrix.row_errors()?);
    let precision = record.precision.name();
    let views = matrix.views()?;
    let sparse = views.iter().filter(|view| view.block.kind() == Ok(BlockKind::Sparse)).count();
    let part = record.parts != 1 && files == 1;
    let defect = row_sums.as_ref().map(|sums| (1.0 - sums.least).max(sums.largest - 1.0));
    // A row sum within its own estimated error of 1 loses nothing that could be told from error.
    let errors = matrix.row_errors()?;
    let closed = sums.map(|sums| sums.iter().zip(errors).all(|(sum, error)| (1.0 - sum).abs() <= *error));
    let provenance = matrix.provenance();
    let inputs: serde_json::Map<String, Value> =
        provenance.inputs.iter().map(|i| (i.role.clone(), json!(i.digest.to_string()))).collect();
    let report = if files == 1 { read_report(path) } else { None };

    if as_json {
        let data = json!({
            "kind": "matrix",
            "digest": matrix.digest().to_string(),
            "bytes": matrix.length(),
            "elements": elements,
            "blocks": views.len(),
            "sparse_blocks": sparse,
            "stored_entries": stored,
            "absent_share": absent_share,
            "precision": precision,
            "symmetric": record.symmetric,
            "extended": record.extended,
            "part": record.part,
            "parts": record.parts,
            "tolerance": record.tolerance,
            "row_errors": row_errors.json(),
            "row_sums": row_sums.map(|sums| sums.json()),
            "largest_row_sum_defect": defect,
            "closed": closed.map(|closed| closed && !part),
            "verified": matrix.is_verified(),
            "mesh": record.mesh.to_string(),
            "tool": provenance.tool,
            "version": provenance.version,
            "flags": provenance.flags,
            "inputs": inputs,
            "report": report,
        });
        return Ok(format!("{data:#}\n"));
    }

    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<12} {value}");
    };
    line("matrix", format!("{} ({})", path.display(), matrix.digest().short()));
    line("elements", elements.to_string());
    line(
        "stored",
        format!(
            "{stored} entries ({precision}) in {} blocks ({sparse} of them sparse), {} bytes; {:.1} % of the pairs are \
             absent (zero)",
            views.len(),
            matrix.length(),
            100.0 * absent_share
        ),
    );
    if part {
        let rest = "row sums and errors are those of this part alone";
        line("part", format!("{} of {}: {rest}", record.part + 1, record.parts));
    } else if files > 1 {
        line("files", format!("{files} parts"));
    }
    line("tolerance", format!("{:e} asked per row", record.tolerance));
    line("row errors", row_errors.text());
    match &row_sums {
        Some(sums) => line("row sums", sums.text()),
        None => line("row sums", "not in the file; --verify adds them up".to_owned()),
    }
    if let (Some(closed), Some(defect), false) = (closed, defect, part) {
        let scene = match closed {
            true => "closed: every row sum is 1 within its error".to_owned(),
            false => format!("open, or inexact: row sums differ from 1 by up to {defect:.3e}"),
        };
        line("scene", scene);
    }
    line("verified", if matrix.is_verified() { "all of it" } else { UNVERIFIED }.to_owned());
    if let Some(counters) = report.as_ref().and_then(|r| r["counters"].as_object()) {
        counters.iter().for_each(|(name, count)| line("", format!("{name}: {count}")));
    }
    line("made by", format!("{} {} {}", provenance.tool, provenance.version, provenance.flags.join(" ")));
    line("mesh", record.mesh.short());
    if let Some((matrix, mesh)) = provenance.digest_of(REUSED_MATRIX).zip(provenance.digest_of(REUSED_MESH)) {
        line("reused", format!("factors of matrix {} for mesh {}", matrix.short(), mesh.short()));
    }
    Ok(text)
}

/// Least, mean and largest value.
pub(crate) struct Spread {
    pub(crate) least: f64,
    pub(crate) mean: f64,
    pub(crate) largest: f64,
}

impl Spread {
    pub(crate) fn of(values: &[f64]) -> Self {
        Self {
            least: values.iter().copied().fold(f64::INFINITY, f64::min),
            mean: values.iter().sum::<f64>() / values.len().max(1) as f64,
            largest: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    pub(crate) fn json(&self) -> Value {
        json!({ "least": self.least, "mean": self.mean, "largest": self.largest })
    }

    pub(crate) fn text(&self) -> String {
        format!("{:.6e} least, {:.6e} mean, {:.6e} largest", self.least, self.mean, self.largest)
    }
}

/// The report beside the file, if it is there and can be read.
fn read_report(path: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(Report::path_for(path)).ok()?;
    serde_json::from_str(&text).ok()
}
