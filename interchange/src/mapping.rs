//! The one place where a file is mapped into memory.
#![allow(unsafe_code)]

use crate::error::{Error, Result};
use memmap2::Mmap;
use std::{fs::File, path::Path};

/// Maps the whole of `path` for reading. An empty file maps to no bytes.
pub fn map(path: &Path) -> Result<Mmap> {
    let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
    if file.metadata().map_err(|e| Error::io(path, "read", e))?.is_dir() {
        return Err(Error::io(path, "read", std::io::ErrorKind::IsADirectory.into()));
    }
    // SAFETY: the mapping is private and read-only. Outputs of the tools are only ever replaced by rename, so a
    // mapped file keeps its bytes; a foreign program that truncates it in place breaks the documented contract.
    unsafe { Mmap::map(&file) }.map_err(|e| Error::io(path, "map", e))
}
