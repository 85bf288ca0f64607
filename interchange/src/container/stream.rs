//! Writing a container whose sections are larger than memory: they are appended as they come, and the header, whose
//! length does not depend on what is in the sections, is filled in at the end. Until then the file has no magic, so that
//! what a killed run leaves is no file of this format.

use super::{ENVELOPE_LENGTH, Header, Kind, SECTION_ALIGNMENT, Section, checksum_into, encode, envelope};
use crate::atomic_write::{Outcome, Partial};
use crate::error::{Error, Result};
use crate::provenance::Provenance;
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};

/// A container being written section after section.
#[derive(Debug)]
pub struct Stream<R> {
    kind: Kind,
    partial: Partial,
    out: BufWriter<File>,
    header: Header<R>,
    /// Sections begun so far; the last of them is open.
    begun: usize,
    hasher: crc32fast::Hasher,
    /// End of what was written.
    at: u64,
}

impl<R: Serialize> Stream<R> {
    /// A container with these sections in this order, all empty so far.
    pub fn create(
        partial: Partial,
        kind: Kind,
        provenance: Provenance,
        sections: &[&str],
        record: R,
    ) -> Result<Self> {
        let empty = |name: &&str| Section { name: (*name).into(), offset: 0, length: 0, crc32: 0 };
        let header = Header { provenance, sections: sections.iter().map(empty).collect(), record };
        // Integers have a fixed size, so a header with zero offsets is as long as the final one.
        let at = (ENVELOPE_LENGTH + encode(partial.target(), &header)?.len()) as u64;
        let out = BufWriter::with_capacity(1 << 20, partial.handle()?);
        let mut stream = Self { kind, partial, out, header, begun: 0, hasher: crc32fast::Hasher::new(), at };
        stream.try_io("write", |out| out.seek(SeekFrom::Start(at)).map(|_| ()))?;
        Ok(stream)
    }

    fn try_io<T>(
        &mut self,
        action: &'static str,
        work: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<T>,
    ) -> Result<T> {
        work(&mut self.out).map_err(|e| Error::io(self.partial.target(), action, e))
    }

    /// Ends the open section and begins the next, which must be `name`.
    pub fn begin(&mut self, name: &str) -> Result<()> {
        self.end();
        debug_assert_eq!(self.header.sections[self.begun].name, name, "sections out of order");
        let offset = self.at.next_multiple_of(SECTION_ALIGNMENT);
        let padding = (offset - self.at) as usize;
        // Over a file that a killed run left, the padding may hold anything.
        self.try_io("write", |out| out.write_all(&[0; SECTION_ALIGNMENT as usize][..padding]))?;
        self.at = offset;
        self.header.sections[self.begun].offset = offset;
        self.begun += 1;
        Ok(())
    }

    fn end(&mut self) {
        if let Some(open) = self.begun.checked_sub(1).and_then(|k| self.header.sections.get_mut(k)) {
            open.length = self.at - open.offset;
            open.crc32 = std::mem::take(&mut self.hasher).finalize();
        }
    }

    /// Appends to the open section.
    pub fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.try_io("write", |out| out.write_all(bytes))?;
        checksum_into(&mut self.hasher, bytes);
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Takes the next `bytes.len()` bytes of the open section from the file, where an earlier run wrote them, and
    /// leaves a copy in `bytes`. False, with nothing taken, where the file does not hold as many.
    pub fn adopt(&mut self, bytes: &mut [u8]) -> Result<bool> {
        self.out.flush().map_err(|e| Error::io(self.partial.target(), "write", e))?;
        let at = self.at;
        let found = self.try_io("read", |out| match out.get_mut().read_exact(bytes) {
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                out.get_mut().seek(SeekFrom::Start(at)).map(|_| false)
            }
            other => other.map(|()| true),
        })?;
        if found {
            checksum_into(&mut self.hasher, bytes);
            self.at += bytes.len() as u64;
        }
        Ok(found)
    }

    /// Takes back what [`Stream::adopt`] took last: `hasher` and length as they were before.
    pub fn disown(&mut self, bytes: usize, hasher: crc32fast::Hasher) -> Result<()> {
        self.at -= bytes as u64;
        self.hasher = hasher;
        let at = self.at;
        self.try_io("write", |out| out.seek(SeekFrom::Start(at)).map(|_| ()))
    }

    /// Checksum of the open section so far.
    pub fn hasher(&self) -> crc32fast::Hasher {
        self.hasher.clone()
    }

    /// Hands what was appended to the system, so that it survives this process.
    pub fn flush(&mut self) -> Result<()> {
        self.try_io("write", BufWriter::flush)
    }

    /// Whether the unfinished file stays when an error or a signal ends this process.
    pub fn keep_when_dropped(&mut self, keep: bool) {
        self.partial.keep_when_dropped(keep);
    }

    /// Reads bytes of the open section back, from `offset` within it.
    pub fn read_back(&mut self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let (start, at) = (self.open_start() + offset, self.at);
        self.try_io("read", |out| {
            out.seek(SeekFrom::Start(start))?;
            out.get_mut().read_exact(bytes)?;
            out.seek(SeekFrom::Start(at)).map(|_| ())
        })
    }

    /// Replaces bytes of the open section, from its first on: `offset` must be the sum of what was replaced before, and
    /// once begun, all of the section must be replaced.
    pub fn replace(&mut self, offset: u64, bytes: &[u8]) -> Result<()> {
        if offset == 0 {
            self.hasher = crc32fast::Hasher::new();
        }
        let (start, at) = (self.open_start() + offset, self.at);
        debug_assert!(start + bytes.len() as u64 <= at, "replacing {start} beyond {at}");
        self.try_io("write", |out| {
            out.seek(SeekFrom::Start(start))?;
            out.write_all(bytes)?;
            out.seek(SeekFrom::Start(at)).map(|_| ())
        })?;
        checksum_into(&mut self.hasher, bytes);
        Ok(())
    }

    fn open_start(&self) -> u64 {
        self.begun.checked_sub(1).map_or(0, |k| self.header.sections[k].offset)
    }

    /// Writes envelope and header and puts the file in its place; identical output leaves the old file alone.
    pub fn finish(mut self) -> Result<Outcome> {
        self.end();
        debug_assert_eq!(self.begun, self.header.sections.len(), "sections missing");
        let encoded = encode(self.partial.target(), &self.header)?;
        let (envelope, end) = (envelope(self.kind, &encoded), self.at);
        self.try_io("write", |out| {
            out.flush()?;
            // A killed run may have written further.
            out.get_mut().set_len(end)?;
            out.seek(SeekFrom::Start(0))?;
            out.write_all(&envelope)?;
            out.write_all(&encoded)?;
            out.flush()
        })?;
        drop(self.out);
        self.partial.commit()
    }
}
