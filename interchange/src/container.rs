//! The one container all files share (`FORMAT.md`, "Envelope"): a 32-byte envelope, a small bincode header with
//! provenance and the kind's own record, then 64-byte-aligned little-endian sections that are used where they are
//! mapped. Envelope, header and every section carry checks; all are verified before a number is handed out, but for
//! sections that a caller of [`File::glance`] names.

mod stream;

use crate::atomic_write::{Outcome, Partial};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::mapping;
use crate::provenance::Provenance;
use crate::tool::progress;
use bytemuck::{AnyBitPattern, NoUninit};
use memmap2::Mmap;
use rayon::prelude::*;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

pub use stream::Stream;

/// Largest header: names and block lists are sections, so a header of more than 1 MiB is damage or malice.
pub const HEADER_LIMIT: usize = 1 << 20;
/// Sections start at multiples of a cache line.
pub const SECTION_ALIGNMENT: u64 = 64;
/// Version written; readers take any minor version of a known major one.
pub const VERSION: (u16, u16) = (1, 1);
const ENVELOPE_LENGTH: usize = 32;
/// Checksums of large sections are computed in pieces of this many bytes on all cores.
const CHECKSUM_PIECE: usize = 1 << 22;
/// Pieces between two steps of the bar: enough for all cores.
const CHECKSUM_PIECES: usize = 64;

/// What a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Elements, faces, names.
    Mesh,
    /// Reflectances, emissions and the non-diffuse parts.
    Materials,
    /// The exchange matrix or a part of it.
    Matrix,
    /// Radiosity and irradiance.
    Solution,
}

impl Kind {
    const ALL: [Kind; 4] = [Kind::Mesh, Kind::Materials, Kind::Matrix, Kind::Solution];

    /// Three letters in the magic.
    fn letters(self) -> &'static [u8; 3] {
        match self {
            Kind::Mesh => b"MSH",
            Kind::Materials => b"MAT",
            Kind::Matrix => b"FFM",
            Kind::Solution => b"SOL",
        }
    }

    /// What a person calls it, and the tool that makes it.
    pub fn describe(self) -> (&'static str, &'static str) {
        match self {
            Kind::Mesh => ("a mesh (.mesh)", "mesh-tool build"),
            Kind::Materials => ("a material table (.materials)", "mesh-tool materials"),
            Kind::Matrix => ("an exchange matrix (.ff)", "formfactor-tool compute"),
            Kind::Solution => ("a solution (.sol)", "solve-tool solve"),
        }
    }

    /// A non-ASCII byte, the letters, then the bytes that text-mode transfers damage first (as PNG does).
    fn magic(self) -> [u8; 8] {
        let [a, b, c] = *self.letters();
        [0x8f, a, b, c, b'\r', b'\n', 0x1a, b'\n']
    }
}

/// Where a section lies.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Section {
    name: String,
    offset: u64,
    length: u64,
    crc32: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct Header<R> {
    provenance: Provenance,
    sections: Vec<Section>,
    record: R,
}

fn encoding() -> impl bincode::config::Config {
    bincode::config::standard().with_little_endian().with_fixed_int_encoding().with_limit::<HEADER_LIMIT>()
}

/// A file being put together: sections are borrowed, nothing is copied.
#[derive(Debug)]
pub struct Writer<'a> {
    kind: Kind,
    sections: Vec<(&'static str, &'a [u8])>,
}

impl<'a> Writer<'a> {
    /// An empty file of this kind.
    pub fn new(kind: Kind) -> Self {
        Self { kind, sections: Vec::new() }
    }

    /// Adds a section. Names are unique within a file.
    pub fn section<T: NoUninit>(mut self, name: &'static str, values: &'a [T]) -> Self {
        debug_assert!(self.sections.iter().all(|s| s.0 != name), "section {name} given twice");
        self.sections.push((name, bytemuck::cast_slice(values)));
        self
    }

    /// Writes the file with `provenance` and the kind's own `record`; identical output leaves the old file alone.
    pub fn write<R: Serialize>(&self, path: &Path, provenance: Provenance, record: R) -> Result<Outcome> {
        let names: Vec<&str> = self.sections.iter().map(|s| s.0).collect();
        let mut stream = Stream::create(Partial::create(path)?, self.kind, provenance, &names, record)?;
        for (name, bytes) in &self.sections {
            stream.begin(name)?;
            stream.append(bytes)?;
        }
        stream.finish()
    }
}

fn encode<R: Serialize>(path: &Path, header: &Header<R>) -> Result<Vec<u8>> {
    bincode::serde::encode_to_vec(header, encoding())
        .ok()
        .filter(|bytes| bytes.len() <= HEADER_LIMIT)
        .ok_or_else(|| {
            Error::format(path, "header", "more than 1 MiB", "at most 1 MiB", "use fewer or shorter flags")
        })
}

fn envelope(kind: Kind, header: &[u8]) -> [u8; ENVELOPE_LENGTH] {
    let mut envelope = [0; ENVELOPE_LENGTH];
    envelope[..8].copy_from_slice(&kind.magic());
    envelope[8..10].copy_from_slice(&VERSION.0.to_le_bytes());
    envelope[10..12].copy_from_slice(&VERSION.1.to_le_bytes());
    envelope[12..16].copy_from_slice(&(header.len() as u32).to_le_bytes());
    envelope[16..20].copy_from_slice(&crc32fast::hash(header).to_le_bytes());
    envelope
}

/// CRC-32 of `bytes`.
fn checksum(bytes: &[u8]) -> u32 {
    let mut whole = crc32fast::Hasher::new();
    let parts = bytes.chunks(CHECKSUM_PIECES * CHECKSUM_PIECE);
    progress("checksums", parts.len()).wrap_iter(parts).for_each(|part| checksum_into(&mut whole, part));
    whole.finalize()
}

/// Adds `bytes` to a CRC-32; pieces are hashed on all cores and combined in order, so the value is the plain one.
fn checksum_into(whole: &mut crc32fast::Hasher, bytes: &[u8]) {
    if bytes.len() <= CHECKSUM_PIECE {
        whole.update(bytes);
        return;
    }
    let pieces: Vec<crc32fast::Hasher> = bytes
        .par_chunks(CHECKSUM_PIECE)
        .map(|piece| {
            let mut hasher = crc32fast::Hasher::new();
            hasher.update(piece);
            hasher
        })
        .collect();
    pieces.iter().for_each(|piece| whole.combine(piece));
}

/// A mapped file whose envelope, header and section checksums have been verified, but for sections it was only glanced at.
#[derive(Debug)]
pub struct File<R> {
    path: PathBuf,
    bytes: Mmap,
    digest: Digest,
    sections: Vec<Section>,
    /// Where the file comes from.
    pub provenance: Provenance,
    /// The kind's own part of the header.
    pub record: R,
}

impl<R: DeserializeOwned> File<R> {
    /// Maps and verifies the file at `path`, which must be of this `kind`.
    ///
    /// Checked in this order: magic, version, header length, header checksum, header encoding, section bounds, section
    /// overlap, file length, section checksums.
    pub fn open(path: &Path, kind: Kind) -> Result<Self> {
        Self::glance(path, kind, &[])
    }

    /// [`File::open`], but nothing of the sections named in `unread` is read: neither their checksum is verified nor their
    /// content. For looking at files larger than memory; nothing may be computed with what is in those sections.
    pub fn glance(path: &Path, kind: Kind, unread: &[&str]) -> Result<Self> {
        let bytes = mapping::map(path)?;
        let remake = format!("remake it with {}", kind.describe().1);
        let header_end = check_envelope(path, &bytes, kind, &remake)?;
        let encoded = &bytes[ENVELOPE_LENGTH..header_end];
        let damaged =
            |found: String| Error::format(path, "header", found, "a readable record", remake.clone());
        let (header, used) = bincode::serde::decode_from_slice::<Header<R>, _>(encoded, encoding())
            .map_err(|e| damaged(e.to_string()))?;
        if used != encoded.len() {
            return Err(damaged(format!("{} bytes left over", encoded.len() - used)));
        }
        check_sections(path, &bytes, header_end, &header.sections, unread, &remake)?;
        let digest = Digest::of(&bytes[..header_end]);
        let (provenance, record) = (header.provenance, header.record);
        Ok(Self { path: path.to_owned(), bytes, digest, sections: header.sections, provenance, record })
    }
}

impl<R> File<R> {
    /// Path it was opened by.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Identity: SHA-256 of envelope and header, which hold length and checksum of every section.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Length of the file in bytes.
    pub fn length(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// Names and lengths in bytes of the sections.
    pub fn sections(&self) -> impl Iterator<Item = (&str, u64)> {
        self.sections.iter().map(|s| (s.name.as_str(), s.length))
    }

    /// Whether the section is there.
    pub fn has(&self, name: &str) -> bool {
        self.sections.iter().any(|s| s.name == name)
    }

    /// The values of a section, where they lie.
    pub fn section<T: AnyBitPattern>(&self, name: &str) -> Result<&[T]> {
        let section = self.sections.iter().find(|s| s.name == name);
        let section = section.ok_or_else(|| self.damaged(name, "no such section", "the section"))?;
        let bytes = &self.bytes[section.offset as usize..(section.offset + section.length) as usize];
        bytemuck::try_cast_slice(bytes).map_err(|e| {
            self.damaged(name, format!("{} bytes ({e})", bytes.len()), "a whole number of values, aligned")
        })
    }

    /// The values of a section that must hold `count` of them.
    pub fn counted_section<T: AnyBitPattern>(&self, name: &str, count: usize) -> Result<&[T]> {
        let values = self.section(name)?;
        if values.len() != count {
            return Err(self.damaged(name, format!("{} values", values.len()), format!("{count} values")));
        }
        Ok(values)
    }

    /// The error for content that cannot be right although the checksums hold.
    pub fn damaged(&self, part: &str, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::format(
            &self.path,
            part,
            found,
            expected,
            "the program that wrote it is at fault; remake the file",
        )
    }
}

fn check_envelope(path: &Path, bytes: &[u8], kind: Kind, remake: &str) -> Result<usize> {
    let wrong =
        |part: &str, found: String, expected: String| Error::format(path, part, found, expected, remake);
    let (name, _) = kind.describe();
    if bytes.len() < ENVELOPE_LENGTH {
        return Err(wrong("file", format!("{} bytes", bytes.len()), format!("{name}, which has more")));
    }
    if bytes[..8] != kind.magic() {
        let Some(other) = Kind::ALL.into_iter().find(|k| k.magic() == bytes[..8]) else {
            return Err(wrong("first 8 bytes", "something else".into(), name.into()));
        };
        let (found, maker) = other.describe();
        let shows = maker.split(' ').next().unwrap_or(maker);
        let remedy = format!("give {name}; {shows} info shows what is in this file");
        return Err(Error::format(path, "first 8 bytes", found, name, remedy));
    }
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let (major, minor) = (word(8) & 0xffff, word(8) >> 16);
    if major != u32::from(VERSION.0) {
        let expected = format!("{}.x", VERSION.0);
        let remedy = if major > u32::from(VERSION.0) {
            "the file is newer than this program: update the program, or remake the file with this one"
        } else {
            remake
        };
        return Err(Error::format(path, "version", format!("{major}.{minor}"), expected, remedy));
    }
    let header_length = word(12) as usize;
    if header_length > HEADER_LIMIT || ENVELOPE_LENGTH + header_length > bytes.len() {
        let found = format!("{header_length} bytes in a file of {}", bytes.len());
        return Err(wrong("header length", found, "at most 1 MiB, within the file".into()));
    }
    if bytes[20..ENVELOPE_LENGTH].iter().any(|&b| b != 0) {
        return Err(wrong("envelope", "bytes other than zero at 20 to 31".into(), "zeros".into()));
    }
    let header_end = ENVELOPE_LENGTH + header_length;
    let found = crc32fast::hash(&bytes[ENVELOPE_LENGTH..header_end]);
    if found != word(16) {
        return Err(wrong("header", format!("checksum {found:08x}"), format!("{:08x}", word(16))));
    }
    Ok(header_end)
}

fn check_sections(
    path: &Path,
    bytes: &[u8],
    header_end: usize,
    sections: &[Section],
    unread: &[&str],
    remake: &str,
) -> Result<()> {
    let mut end = header_end as u64;
    for (i, section) in sections.iter().enumerate() {
        let part = format!("section {}", section.name);
        let wrong = |found: String, expected: &str| Error::format(path, &part, found, expected, remake);
        if sections[..i].iter().any(|earlier| earlier.name == section.name) {
            return Err(wrong("listed twice".into(), "each name once"));
        }
        if section.offset != end.next_multiple_of(SECTION_ALIGNMENT) {
            return Err(wrong(format!("offset {}", section.offset), "the next multiple of 64"));
        }
        let padding_start = end;
        let stop = section.offset.checked_add(section.length).filter(|&stop| stop <= bytes.len() as u64);
        end = stop.ok_or_else(|| {
            wrong(format!("end beyond the file's {} bytes", bytes.len()), "a file that was not cut short")
        })?;
        if bytes[padding_start as usize..section.offset as usize].iter().any(|&b| b != 0) {
            return Err(wrong("bytes other than zero in the padding before it".into(), "zeros"));
        }
        if unread.contains(&section.name.as_str()) {
            continue;
        }
        let content = &bytes[section.offset as usize..end as usize];
        let found = checksum(content);
        if found != section.crc32 {
            return Err(wrong(format!("checksum {found:08x}"), &format!("{:08x}", section.crc32)));
        }
    }
    if end != bytes.len() as u64 {
        let found = format!("{} bytes", bytes.len());
        return Err(Error::format(path, "file", found, format!("{end} bytes"), remake));
    }
    Ok(())
}

/// Names as a section: for each its length in bytes (u32), then all bytes as UTF-8.
pub(crate) fn pack_names(names: &[String]) -> Vec<u8> {
    let mut bytes: Vec<u8> = names.iter().flat_map(|n| (n.len() as u32).to_le_bytes()).collect();
    names.iter().for_each(|n| bytes.extend_from_slice(n.as_bytes()));
    bytes
}

impl<R> File<R> {
    /// The names that [`pack_names`] wrote; `count` of them.
    pub(crate) fn names(&self, section: &str, count: usize) -> Result<Vec<String>> {
        let bytes: &[u8] = self.section(section)?;
        let wrong = || self.damaged(section, "lengths that do not fit", format!("{count} names in UTF-8"));
        let (lengths, mut text) =
            count.checked_mul(4).and_then(|at| bytes.split_at_checked(at)).ok_or_else(wrong)?;
        let mut names = Vec::with_capacity(count);
        for length in lengths.chunks_exact(4) {
            let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
            let (name, rest) = text.split_at_checked(length).ok_or_else(wrong)?;
            names.push(std::str::from_utf8(name).map_err(|_| wrong())?.to_owned());
            text = rest;
        }
        if text.is_empty() { Ok(names) } else { Err(wrong()) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn sample(path: &Path) {
        let provenance = Provenance::new("test", "1").flag("--x 1");
        let writer =
            Writer::new(Kind::Mesh).section("numbers", &[1.0f64, 2.0, 3.0]).section("bytes", b"hello");
        writer.write(path, provenance, 7u32).unwrap();
    }

    #[test]
    fn sections_come_back_aligned() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mesh");
        sample(&path);
        let file = File::<u32>::open(&path, Kind::Mesh).unwrap();
        assert_eq!(file.record, 7);
        assert_eq!(file.section::<f64>("numbers").unwrap(), [1.0, 2.0, 3.0]);
        assert_eq!(file.section::<u8>("bytes").unwrap(), b"hello");
        assert!(file.section::<f64>("bytes").unwrap_err().to_string().contains("whole number"));
        assert!(file.section::<f64>("none").is_err());
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (path, bad) = (folder.path().join("a.mesh"), folder.path().join("bad.mesh"));
        sample(&path);
        let good = std::fs::read(&path).unwrap();
        for cut in 0..good.len() {
            std::fs::write(&bad, &good[..cut]).unwrap();
            assert!(File::<u32>::open(&bad, Kind::Mesh).is_err(), "cut at {cut}");
        }
        for bit in 0..good.len() * 8 {
            // The minor version may be anything.
            if (80..96).contains(&bit) {
                continue;
            }
            let mut flipped = good.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&bad, &flipped).unwrap();
            assert!(File::<u32>::open(&bad, Kind::Mesh).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn a_glance_leaves_out_only_what_it_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mesh");
        sample(&path);
        let mut bytes = std::fs::read(&path).unwrap();
        let start = bytes.windows(5).rposition(|window| window == b"hello").unwrap();
        bytes[start] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        assert!(File::<u32>::glance(&path, Kind::Mesh, &["numbers"]).is_err());
        let file = File::<u32>::glance(&path, Kind::Mesh, &["bytes"]).unwrap();
        assert_eq!(file.section::<f64>("numbers").unwrap(), [1.0, 2.0, 3.0]);
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        assert!(File::<u32>::glance(&path, Kind::Mesh, &["bytes"]).is_err());
    }

    #[test]
    fn hostile_lengths_are_refused_without_allocating() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mesh");
        // A header that is nothing but a string length of 2^60.
        let header = (1u64 << 60).to_le_bytes();
        let mut bytes = envelope(Kind::Mesh, &header).to_vec();
        bytes.extend_from_slice(&header);
        std::fs::write(&path, &bytes).unwrap();
        assert!(File::<u32>::open(&path, Kind::Mesh).is_err());
    }

    #[test]
    fn a_foreign_kind_and_a_newer_version_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mesh");
        sample(&path);
        let message = File::<u32>::open(&path, Kind::Matrix).unwrap_err().to_string();
        assert!(message.contains("found a mesh") && message.contains("mesh-tool info"), "{message}");
        let mut newer = std::fs::read(&path).unwrap();
        newer[8] = 9;
        std::fs::write(&path, newer).unwrap();
        let message = File::<u32>::open(&path, Kind::Mesh).unwrap_err().to_string();
        assert!(message.contains("found 9.1") && message.contains("update the program"), "{message}");
    }

    #[test]
    fn checksum_in_pieces_is_the_plain_one() {
        let bytes: Vec<u8> = (0..CHECKSUM_PIECE * 2 + 17).map(|i| (i * 31 % 251) as u8).collect();
        assert_eq!(checksum(&bytes), crc32fast::hash(&bytes));
    }
}
