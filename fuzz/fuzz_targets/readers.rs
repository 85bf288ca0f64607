//! Every reader: the first byte chooses the kind of file, the rest is the file (`tests::fuzz::reader`).
#![no_main]

use std::sync::LazyLock;
use tests::fuzz::{READERS, reader};

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(tests::folder);

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some((kind, file)) = bytes.split_first() {
        reader(FOLDER.path(), READERS[usize::from(*kind) % READERS.len()], file);
    }
});
