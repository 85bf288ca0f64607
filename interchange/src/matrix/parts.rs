//! A matrix from several files: each part exactly once, all of the same run.

use super::{Matrix, MatrixRecord, PartFile};
use crate::error::{Error, Result};
use std::path::Path;

/// Missing parts named in a message.
const MOST_NAMED: usize = 8;

impl Matrix {
    /// Maps and checks the files of a matrix, in any order: one whole matrix, or every part of one exactly once.
    ///
    /// # Errors
    /// Besides damage: an incomplete set, a part given twice, parts of different runs; the file is named.
    pub fn open_all(paths: &[impl AsRef<Path>]) -> Result<Self> {
        Self::combine(paths, Self::open_part)
    }

    /// [`Matrix::open_all`] without a look at the entries, see [`Matrix::glance_part`].
    ///
    /// # Errors
    /// As those of [`Matrix::open_all`].
    pub fn glance_all(paths: &[impl AsRef<Path>]) -> Result<Self> {
        Self::combine(paths, Self::glance_part)
    }

    fn combine(paths: &[impl AsRef<Path>], open: impl Fn(&Path) -> Result<Self>) -> Result<Self> {
        let (mut files, mut verified) = (Vec::with_capacity(paths.len()), true);
        for path in paths {
            let part = open(path.as_ref())?;
            verified &= part.verified;
            files.extend(part.files);
        }
        files.sort_by_key(|file| file.record.part);
        let Some(first) = files.first() else {
            return Err(Error::whole(Path::new("."), "no matrix file was given"));
        };
        for file in &files[1..] {
            same_run(first, file)?;
        }
        complete(&files)?;
        let mut row_errors = vec![0.0; first.record.elements as usize];
        for file in &files {
            row_errors.iter_mut().zip(file.row_errors()?).for_each(|(sum, error)| *sum += error);
        }
        Ok(Self { files, row_errors, verified })
    }
}

/// Refuses files that are not parts of one matrix.
fn same_run(first: &PartFile, other: &PartFile) -> Result<()> {
    let mismatch = |detail: String| {
        let remedy = "give the parts of one matrix: same mesh, same flags".into();
        Err(Error::Mismatch { first: first.path().into(), second: other.path().into(), detail, remedy })
    };
    let (a, b) = (&first.record, &other.record);
    if a.mesh != b.mesh {
        return mismatch(format!("they were computed for meshes {} and {}", a.mesh.short(), b.mesh.short()));
    }
    if a.parts != b.parts {
        return mismatch(format!("one is of {} parts, the other of {}", a.parts, b.parts));
    }
    let same = MatrixRecord { part: a.part, ..b.clone() } == *a;
    let origin = |file: &PartFile| {
        let mut origin = file.provenance.clone();
        // The flag that says which part it is.
        origin.flags.retain(|flag| !flag.starts_with("--shard "));
        origin
    };
    if !same || origin(first) != origin(other) {
        let flags = |file: &PartFile| format!("{} {}", file.provenance.version, origin(file).flags.join(" "));
        return mismatch(format!("they were computed with {} and {}", flags(first), flags(other)));
    }
    if first.areas()? != other.areas()? {
        return mismatch("their areas differ".into());
    }
    Ok(())
}

/// Refuses a set with a part missing or given twice. `files` are sorted by part.
fn complete(files: &[PartFile]) -> Result<()> {
    if let Some(twice) = files.windows(2).find(|pair| pair[0].record.part == pair[1].record.part) {
        let part = twice[1].record.part + 1;
        let detail = format!("both are part {part} of {}", twice[1].record.parts);
        let remedy = "give each part once".into();
        let (first, second) = (twice[0].path().into(), twice[1].path().into());
        return Err(Error::Mismatch { first, second, detail, remedy });
    }
    let file = &files[0];
    let parts = file.record.parts;
    // No more than are named: the number of parts is what a file says.
    let absent = |&k: &u32| files.iter().all(|f| f.record.part != k);
    let missing: Vec<u32> = (0..parts).filter(absent).take(MOST_NAMED + 1).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let given = files.iter().map(|f| (f.record.part + 1).to_string()).collect::<Vec<_>>().join(", ");
    let lacking = missing.iter().take(MOST_NAMED).map(|k| (k + 1).to_string()).collect::<Vec<_>>().join(", ");
    let more = if missing.len() > MOST_NAMED { ", ..." } else { "" };
    let found = format!("part {given} of {parts}; part {lacking}{more} is missing");
    let remedy = format!(
        "give all {parts} files, make a missing one with formfactor-tool compute --shard i/{parts}, or put all together with \
         formfactor-tool merge"
    );
    Err(Error::format(file.path(), "header", found, "the whole matrix", remedy))
}
