//! What a reader checks of a matrix file before it hands out a number (`FORMAT.md`, sections 5 and 7).

use super::{Block, BlockKind, BlockView, MatrixRecord, PartFile, Values, views};
use crate::error::{Error, Result};
use crate::tool::progress;

const UPDATE: &str = "this program is older than the file: update it";

/// Checks one file but for its entries: what is of the size of the rows or the blocks.
pub(super) fn all_but_entries(file: &PartFile) -> Result<()> {
    header(file)?;
    blocks(file)?;
    row_numbers(file)
}

/// Checks the entries of a file of which all else was checked.
pub(super) fn entries(file: &PartFile) -> Result<()> {
    let blocks = file.blocks()?;
    let bar = progress("entries", blocks.len());
    for (i, view) in views(blocks, file.values()?, file.structure()?).enumerate() {
        structure(file, i, &view)?;
        let bad = match view.values {
            Values::F32(v) => v.iter().position(|&x| !usable(x.into())),
            Values::F64(v) => v.iter().position(|&x| !usable(x)),
        };
        if let Some(at) = bad {
            return Err(unusable(file, view.values.get(at), view.block.offset + at as u64));
        }
        bar.inc(1);
    }
    Ok(())
}

/// Whether a number can be an entry, an error or a sum.
pub(super) fn usable(x: f64) -> bool {
    x.is_finite() && x >= 0.0
}

/// The error for entry `at` of the values.
pub(super) fn unusable(file: &PartFile, value: f64, at: u64) -> Error {
    file.damaged("values", format!("{value} at {at}"), "finite entries of at least 0")
}

fn header(file: &PartFile) -> Result<()> {
    let record = &file.record;
    let refuse = |found: String, expected: &str, remedy: &str| {
        Err(Error::format(file.path(), "header", found, expected, remedy))
    };
    if record.part >= record.parts {
        let found = format!("part {} of {}", record.part, record.parts);
        return refuse(found, "a part below the number of parts, from 0", "compute the matrix again");
    }
    if record.extended {
        return refuse("extended true".into(), "extended false", UPDATE);
    }
    Ok(())
}

fn blocks(file: &PartFile) -> Result<()> {
    let (values, structure) = (file.values()?, file.structure()?);
    let (mut stored, mut items) = (0u64, 0u64);
    for (i, block) in file.blocks()?.iter().enumerate() {
        let part = format!("block {i}");
        place(file, &part, block)?;
        if block.offset != stored {
            return Err(file.damaged(&part, format!("offset {}", block.offset), format!("{stored}")));
        }
        let sum = |a: u64, b: u64| {
            a.checked_add(b).ok_or_else(|| file.damaged(&part, "more entries than can be", "fewer entries"))
        };
        stored = sum(stored, block.stored())?;
        items = sum(items, block.structure_length())?;
    }
    if stored != values.len() as u64 {
        let found = format!("{} entries", values.len());
        return Err(file.damaged("values", found, format!("{stored}, as the blocks say")));
    }
    if items != structure.len() as u64 {
        let found = format!("{} items", structure.len());
        return Err(file.damaged("sparse", found, format!("{items}, as the blocks say")));
    }
    Ok(())
}

/// Checks where block `i` of a file, where it is sparse, has its entries: starts from 0 to the number of entries, never
/// falling; columns rising, within the block, not before the diagonal.
pub(super) fn structure(file: &PartFile, i: usize, view: &BlockView<'_>) -> Result<()> {
    if view.block.kind() != Ok(BlockKind::Sparse) {
        return Ok(());
    }
    let wrong = |found: String, expected: &str| file.damaged(&format!("block {i}"), found, expected);
    let (starts, columns) = view.structure.split_at(view.block.rows as usize + 1);
    if starts[0] != 0 || starts.last() != Some(&view.block.rank) || !starts.is_sorted() {
        return Err(wrong(
            "row starts that fall or do not fit".into(),
            "starts from 0 to the number of entries",
        ));
    }
    for (row, ends) in starts.windows(2).enumerate() {
        let columns = &columns[ends[0] as usize..ends[1] as usize];
        let first = if view.block.is_diagonal() { row as u32 } else { 0 };
        let fits = columns.first().is_none_or(|&c| c >= first)
            && columns.last().is_none_or(|&c| c < view.block.columns)
            && columns.windows(2).all(|pair| pair[0] < pair[1]);
        if !fits {
            return Err(wrong(
                format!("columns of row {row} out of place"),
                "rising columns within the block",
            ));
        }
    }
    Ok(())
}

fn place(file: &PartFile, part: &str, block: &Block) -> Result<()> {
    let MatrixRecord { elements, symmetric, .. } = file.record;
    let kind = block.kind().map_err(|code| {
        let (found, expected) = (format!("storage kind {code}"), "0 (dense), 1 (triangle) or 2 (sparse)");
        Error::format(file.path(), part, found, expected, UPDATE)
    })?;
    let rows_end = u64::from(block.row_start) + u64::from(block.rows);
    let columns_end = u64::from(block.column_start) + u64::from(block.columns);
    let above = rows_end <= u64::from(block.column_start);
    let (ordered, expected) = match (kind, symmetric) {
        (BlockKind::Dense, true) => (above, "a place above the diagonal of"),
        (BlockKind::Triangle, true) => (block.is_diagonal(), "a square on the diagonal of"),
        (BlockKind::Sparse, true) => {
            (above || block.is_diagonal(), "a place above the diagonal, or a square on it, of")
        }
        (BlockKind::Dense, false) => (true, "a place within"),
        (BlockKind::Triangle | BlockKind::Sparse, false) => {
            (false, "dense blocks, as the matrix is not symmetric, of")
        }
    };
    if rows_end > u64::from(elements) || columns_end > u64::from(elements) || !ordered {
        return Err(file.damaged(part, format!("{block:?}"), format!("{expected} {elements} rows")));
    }
    Ok(())
}

fn row_numbers(file: &PartFile) -> Result<()> {
    let (areas, errors) = (file.areas()?, file.row_errors()?);
    if let Some(i) = areas.iter().position(|&a| !(a.is_finite() && a > 0.0)) {
        return Err(file.damaged("areas", format!("{} at {i}", areas[i]), "areas above 0"));
    }
    if let Some(i) = errors.iter().position(|&e| !usable(e)) {
        return Err(file.damaged("row_errors", format!("{} at {i}", errors[i]), "errors of at least 0"));
    }
    let sums = file.row_sums()?.unwrap_or_default();
    if let Some(i) = sums.iter().position(|&sum| !usable(sum)) {
        return Err(file.damaged("row_sums", format!("{} at {i}", sums[i]), "sums of at least 0"));
    }
    Ok(())
}
