//! As much of the ZIP format (PKWARE's APPNOTE 6.3) as npz needs: entries stored as they are when writing, stored or
//! deflated when reading, nothing beyond 4 GiB, and no clock, so that the same arrays give the same bytes.

use flate2::read::DeflateDecoder;
use interchange::error::{Error, Result};
use interchange::tool::progress;
use std::borrow::Cow;
use std::io::{Read, Write};
use std::path::Path;

const LOCAL: u32 = 0x0403_4b50;
const CENTRAL: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
/// Length of the record at the end, without its comment.
const END_LENGTH: usize = 22;
const CENTRAL_LENGTH: usize = 46;
const LOCAL_LENGTH: usize = 30;
/// Version of the format that stored entries need: 2.0.
const VERSION: u16 = 20;
/// 1980-01-01, the earliest date the format knows.
const DATE: u16 = 0x0021;
const STORED: u16 = 0;
const DEFLATED: u16 = 8;
/// Bytes between two steps of the bar.
const PART: usize = 1 << 20;

/// The bytes of an archive; `None` where it would not fit 4 GiB.
pub(super) fn write(out: &mut dyn Write, entries: &[(&str, Vec<u8>)]) -> std::io::Result<()> {
    let too_long =
        |_| std::io::Error::new(std::io::ErrorKind::FileTooLarge, "an npz file holds 4 GiB at most");
    let (mut at, mut central) = (0u64, Vec::new());
    for (name, content) in entries {
        let length = u32::try_from(content.len()).map_err(too_long)?;
        let offset = u32::try_from(at).map_err(too_long)?;
        // What the entry's two headers have in common.
        let mut common = Vec::new();
        for short in [VERSION, 0, STORED, 0, DATE] {
            common.extend_from_slice(&short.to_le_bytes());
        }
        for word in [crc32fast::hash(content), length, length] {
            common.extend_from_slice(&word.to_le_bytes());
        }
        common.extend_from_slice(&(name.len() as u16).to_le_bytes());
        common.extend_from_slice(&0u16.to_le_bytes());

        out.write_all(&LOCAL.to_le_bytes())?;
        out.write_all(&common)?;
        out.write_all(name.as_bytes())?;
        let parts = content.chunks(PART);
        progress("write", parts.len()).wrap_iter(parts).try_for_each(|part| out.write_all(part))?;
        at += (LOCAL_LENGTH + name.len() + content.len()) as u64;

        central.extend_from_slice(&CENTRAL.to_le_bytes());
        central.extend_from_slice(&VERSION.to_le_bytes());
        central.extend_from_slice(&common);
        // No comment, disk 0, no attributes.
        central.extend_from_slice(&[0; 10]);
        central.extend_from_slice(&offset.to_le_bytes());
        central.extend_from_slice(name.as_bytes());
    }
    let start = u32::try_from(at).map_err(too_long)?;
    out.write_all(&central)?;
    out.write_all(&END.to_le_bytes())?;
    out.write_all(&[0; 4])?;
    let count = (entries.len() as u16).to_le_bytes();
    out.write_all(&count)?;
    out.write_all(&count)?;
    out.write_all(&(central.len() as u32).to_le_bytes())?;
    out.write_all(&start.to_le_bytes())?;
    out.write_all(&[0; 2])
}

/// All entries of an archive with their names; those that are stored as they are stay where they are.
///
/// # Errors
/// The archive is damaged, encrypted, larger than 4 GiB or compressed in another way.
pub(super) fn read<'a>(path: &Path, bytes: &'a [u8]) -> Result<Vec<(String, Cow<'a, [u8]>)>> {
    let damaged = |what: &str| Error::whole(path, format!("the archive is damaged: {what}"));
    let short = |at: usize| bytes.get(at..at + 2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])));
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let missing = || damaged("it ends too early");

    // The record at the end lies before a comment of at most 64 KiB.
    let last = bytes.len().checked_sub(END_LENGTH).ok_or_else(missing)?;
    let first = last.saturating_sub(usize::from(u16::MAX));
    let end =
        (first..=last).rev().find(|&at| word(at) == Some(END)).ok_or_else(|| damaged("it has no end"))?;
    let count = short(end + 10).ok_or_else(missing)?;
    let mut at = word(end + 16).ok_or_else(missing)? as usize;

    let mut entries = Vec::with_capacity(count);
    for _ in 0..count {
        if word(at) != Some(CENTRAL) {
            return Err(damaged("its directory is not where it should be"));
        }
        let [flags, method] = [8, 10].map(|k| short(at + k).unwrap_or(usize::MAX));
        let [checksum, packed, length, local] = [16, 20, 24, 42].map(|k| word(at + k).unwrap_or(u32::MAX));
        let [name_length, extra, comment] = [28, 30, 32].map(|k| short(at + k).unwrap_or(0));
        let name = bytes.get(at + CENTRAL_LENGTH..at + CENTRAL_LENGTH + name_length).ok_or_else(missing)?;
        let name = String::from_utf8_lossy(name).into_owned();
        at += CENTRAL_LENGTH + name_length + extra + comment;
        if flags & 1 != 0 || packed == u32::MAX || length == u32::MAX {
            return Err(damaged(&format!("{name} is encrypted or larger than 4 GiB")));
        }
        let local = local as usize;
        let own = [26, 28].iter().map(|k| short(local + k)).sum::<Option<usize>>().ok_or_else(missing)?;
        let start = local + LOCAL_LENGTH + own;
        let content = bytes.get(start..start + packed as usize).ok_or_else(missing)?;
        let content = match method as u16 {
            STORED => Cow::Borrowed(content),
            DEFLATED => {
                let plain = inflated(content, length as usize);
                Cow::Owned(plain.map_err(|e| damaged(&format!("{name}: {e}")))?)
            }
            other => {
                return Err(damaged(&format!("{name} is compressed by method {other}, which is not read")));
            }
        };
        if content.len() != length as usize || crc32fast::hash(&content) != checksum {
            return Err(damaged(&format!("{name} is not what its checksum says")));
        }
        entries.push((name, content));
    }
    Ok(entries)
}

/// What an entry of `length` bytes was before it was deflated. One byte more than said is unpacked where there is more, so
/// that a longer entry is found out and not unpacked without end.
fn inflated(content: &[u8], length: usize) -> std::io::Result<Vec<u8>> {
    let mut source = DeflateDecoder::new(content).take(length as u64 + 1);
    let mut plain = Vec::new();
    let bar = progress("unpack", length / PART + 1);
    while source.by_ref().take(PART as u64).read_to_end(&mut plain)? > 0 {
        bar.inc(1);
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn entries_come_back_and_damage_is_found_everywhere() {
        let entries = [("a.npy", b"some bytes".to_vec()), ("b.npy", Vec::new())];
        let mut bytes = Vec::new();
        write(&mut bytes, &entries).unwrap();
        let path = Path::new("t.npz");
        let found = read(path, &bytes).unwrap();
        assert_eq!((found[0].0.as_str(), &*found[0].1), ("a.npy", &b"some bytes"[..]));
        assert_eq!((found.len(), found[1].1.len()), (2, 0));
        for cut in 0..bytes.len() {
            assert!(read(path, &bytes[..cut]).is_err(), "{cut}");
        }
        let mut changed = bytes.clone();
        changed[36] ^= 1;
        assert!(read(path, &changed).unwrap_err().to_string().contains("checksum"));
    }
}
