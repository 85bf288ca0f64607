//! The journal of finished tiles: what `--resume` needs to go on where a killed run was.
//!
//! Beside the output `s.ff` lie, while it is computed, `.s.ff.work.partial` (the matrix file so far, entries in order) and
//! `.s.ff.journal.partial`: a line of JSON that says which run it is, then per finished tile its length (u32), CRC-32 and
//! head, columns of a sparse block (u32) and errors (f64). A tile is taken over only if its record and its entries have
//! their CRC-32; from the first that has not, everything is computed anew. Both files go when the run ends.

use crate::counts::Counts;
use crate::store::StoredTile;
use crate::traversal::LeafPair;
use interchange::atomic_write::Partial;
use interchange::error::Error;
use interchange::matrix::{Block, MatrixWriter, PackedBlock, Precision};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Words in the names of the two files.
const WORK: &str = "work";
const JOURNAL: &str = "journal";
/// Longest head of a record: some hundred bytes are used.
const HEAD_LIMIT: usize = 1 << 16;
/// What was finished this long ago survives a kill.
const FLUSH_INTERVAL: Duration = Duration::from_millis(500);

/// Which run a journal belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Version of this program.
    pub version: String,
    /// Digest of the mesh.
    pub mesh: String,
    /// Flags that change the tiles.
    pub flags: Vec<String>,
    /// Tiles to compute.
    pub tiles: usize,
    /// CRC-32 of where they lie.
    pub places: u32,
}

impl Run {
    /// The run that computes these pairs.
    pub fn new(mesh: String, flags: Vec<String>, pairs: &[LeafPair]) -> Self {
        let mut places = crc32fast::Hasher::new();
        for pair in pairs {
            for place in [pair.rows.start, pair.rows.end, pair.columns.start, pair.columns.end] {
                places.update(&(place as u64).to_le_bytes());
            }
        }
        let places = places.finalize();
        Self { version: env!("CARGO_PKG_VERSION").into(), mesh, flags, tiles: pairs.len(), places }
    }
}

/// First line of a journal.
#[derive(Debug, Serialize, Deserialize)]
struct Title {
    run: Run,
    /// Process that writes it.
    process: u32,
}

/// What a record holds besides columns and errors.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    index: u64,
    /// Row start, rows, column start, columns, code and rank of its block, and the CRC-32 of its entries.
    block: Option<([u32; 6], u32)>,
    structure: u64,
    errors: u64,
    counts: Counts,
}

fn encoding() -> impl bincode::config::Config {
    bincode::config::standard().with_fixed_int_encoding().with_limit::<HEAD_LIMIT>()
}

/// A journal being written.
#[derive(Debug)]
pub struct Journal {
    partial: Partial,
    file: File,
    /// Records whose entries may not have reached the system yet.
    pending: Vec<u8>,
    flushed: Instant,
}

/// What a killed run left.
#[derive(Debug)]
pub struct Leftover {
    partial: Partial,
    file: BufReader<File>,
    length: u64,
}

/// The files a run begins with.
#[derive(Debug)]
pub struct Begun {
    /// The matrix file to be.
    pub work: Partial,
    /// Finished tiles of a killed run.
    pub leftover: Option<Leftover>,
    /// What the user should know.
    pub notice: Option<String>,
}

/// Looks for what a killed run left beside `output` and opens it, where `resume` asks for it and it is of the same run;
/// begins anew otherwise.
///
/// # Errors
/// Another process is writing this output; or the files cannot be opened.
pub fn begin(output: &Path, run: &Run, resume: bool) -> anyhow::Result<Begun> {
    let path = Partial::path_for(output, JOURNAL);
    let mut notice = None;
    if let Ok(file) = File::open(&path) {
        let length = file.metadata().map_or(0, |data| data.len());
        let mut file = BufReader::new(file);
        let mut line = String::new();
        let title: Option<Title> = file
            .by_ref()
            .take(HEAD_LIMIT as u64)
            .read_line(&mut line)
            .ok()
            .and_then(|_| serde_json::from_str(&line).ok());
        let name = path.display();
        match title {
            Some(title) if is_running(title.process) => anyhow::bail!(
                "{}: process {} is computing this file; wait for it, or choose another output ({name} is its journal)",
                output.display(),
                title.process
            ),
            Some(title) if resume && title.run == *run && Partial::path_for(output, WORK).exists() => {
                let (work, partial) = (Partial::reopen(output, WORK)?, Partial::reopen(output, JOURNAL)?);
                return Ok(Begun { work, leftover: Some(Leftover { partial, file, length }), notice });
            }
            Some(_) if !resume => {
                notice = Some("replacing what a killed run left; --resume would have gone on with it".into());
            }
            Some(title) => {
                notice = Some(format!(
                    "{name} is of another run, version {} on mesh {} with {}: computing everything anew",
                    title.run.version,
                    &title.run.mesh[..title.run.mesh.len().min(12)],
                    title.run.flags.join(" ")
                ));
            }
            None if resume => notice = Some(format!("{name} is damaged: computing everything anew")),
            None => {}
        }
    }
    Ok(Begun { work: Partial::create_named(output, WORK)?, leftover: None, notice })
}

/// Whether a process of this program with this number is at work, other than this one; as far as Linux tells. One that was
/// killed and that its parent has not taken leave of yet has a name still, but no command line.
fn is_running(process: u32) -> bool {
    let told = |process: u32, file: &str| std::fs::read(format!("/proc/{process}/{file}")).ok();
    let own = std::process::id();
    process != own
        && told(process, "comm").is_some_and(|name| told(own, "comm") == Some(name))
        && told(process, "cmdline").is_some_and(|line| !line.is_empty())
}

impl Leftover {
    /// Hands the finished tiles, still without entries, to `take` in order, with the CRC-32 of their entries, until it
    /// refuses one; leaves the journal ready for more. Returns it with the number of tiles, and whether what follows
    /// them was damaged.
    ///
    /// # Errors
    /// The files cannot be read or written.
    pub fn replay(
        mut self,
        pairs: &[LeafPair],
        run: &Run,
        precision: Precision,
        mut take: impl FnMut(&mut StoredTile, u32) -> interchange::Result<bool>,
    ) -> interchange::Result<(Journal, usize, bool)> {
        let target = self.partial.target().to_owned();
        let io = |e| Error::io(&target, "read the journal beside", e);
        let mut good = self.file.stream_position().map_err(io)?;
        let mut tiles = 0;
        while let Some(pair) = pairs.get(tiles) {
            let left = self.length.saturating_sub(good);
            let Some((mut tile, checksum, bytes)) = read_record(&mut self.file, left, tiles, pair, precision)
            else {
                break;
            };
            if !take(&mut tile, checksum)? {
                break;
            }
            good += bytes;
            tiles += 1;
        }
        let damaged = good < self.length;
        // The title anew, with this process; then the good records, then what comes.
        let mut records = Vec::new();
        let start = title_length(&mut self.file).map_err(io)?;
        self.file.seek(SeekFrom::Start(start)).map_err(io)?;
        self.file.by_ref().take(good - start).read_to_end(&mut records).map_err(io)?;
        let journal = Journal::write(self.partial, run, &records)?;
        Ok((journal, tiles, damaged))
    }
}

fn title_length(file: &mut BufReader<File>) -> std::io::Result<u64> {
    file.seek(SeekFrom::Start(0))?;
    let mut line = Vec::new();
    file.read_until(b'\n', &mut line).map(|length| length as u64)
}

/// The next record, if it is whole and of the tile expected: the tile, the CRC-32 of its entries, its length.
fn read_record(
    file: &mut impl Read,
    left: u64,
    index: usize,
    pair: &LeafPair,
    precision: Precision,
) -> Option<(StoredTile, u32, u64)> {
    let mut lead = [0; 8];
    file.read_exact(&mut lead).ok()?;
    let word = |at: usize| u32::from_le_bytes([lead[at], lead[at + 1], lead[at + 2], lead[at + 3]]);
    let (length, checksum) = (u64::from(word(0)), word(4));
    if length + lead.len() as u64 > left {
        return None;
    }
    let mut payload = vec![0; length as usize];
    file.read_exact(&mut payload).ok()?;
    if crc32fast::hash(&payload) != checksum {
        return None;
    }
    let (head, used) = bincode::serde::decode_from_slice::<Head, _>(&payload, encoding()).ok()?;
    let rest = &payload[used..];
    let structure_bytes = usize::try_from(head.structure).ok()?.checked_mul(size_of::<u32>())?;
    let (structure, errors) = rest.split_at_checked(structure_bytes)?;
    let numbers = |bytes: &[u8]| -> Vec<u32> {
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    };
    let errors: Vec<f64> = errors
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
        .collect();
    let elements = pair.rows.len() + if pair.is_diagonal() { 0 } else { pair.columns.len() };
    if head.index != index as u64 || errors.len() != elements || head.errors != elements as u64 {
        return None;
    }
    let mut found = None;
    if let Some(([row_start, rows, column_start, columns, code, rank], entries)) = head.block {
        let block = Block { row_start, rows, column_start, columns, code, rank, offset: 0 };
        let place = [row_start as usize, rows as usize, column_start as usize, columns as usize];
        if place != [pair.rows.start, pair.rows.len(), pair.columns.start, pair.columns.len()]
            || block.kind().is_err()
            || block.structure_length() != head.structure
        {
            return None;
        }
        found = Some((PackedBlock::unfilled(block, precision, numbers(structure)), entries));
    }
    let (packed, entries) = found.unzip();
    let tile = StoredTile { packed, errors, sums: vec![0.0; elements], counts: head.counts };
    Some((tile, entries.unwrap_or(0), length + lead.len() as u64))
}

impl Journal {
    /// An empty journal beside `output`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(output: &Path, run: &Run) -> interchange::Result<Self> {
        Self::write(Partial::create_named(output, JOURNAL)?, run, &[])
    }

    /// Fills the file with a title and these records.
    fn write(partial: Partial, run: &Run, records: &[u8]) -> interchange::Result<Self> {
        let target = partial.target().to_owned();
        let io = |e| Error::io(&target, "write the journal beside", e);
        let title = Title { run: run.clone(), process: std::process::id() };
        let mut line = serde_json::to_vec(&title).map_err(|e| io(e.into()))?;
        line.push(b'\n');
        let mut file = partial.handle()?;
        file.set_len(0).map_err(io)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;
        file.write_all(&line).map_err(io)?;
        file.write_all(records).map_err(io)?;
        Ok(Self { partial, file, pending: Vec::new(), flushed: Instant::now() })
    }

    /// Whether the journal stays when an error ends this process.
    pub fn keep_when_dropped(&mut self, keep: bool) {
        self.partial.keep_when_dropped(keep);
    }

    /// Notes a tile whose entries were appended to `writer`.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(
        &mut self,
        index: usize,
        tile: &StoredTile,
        writer: &mut MatrixWriter,
    ) -> interchange::Result<()> {
        let block = tile.packed.as_ref().map(|packed| {
            let b = &packed.block;
            let fields = [b.row_start, b.rows, b.column_start, b.columns, b.code, b.rank];
            (fields, crc32fast::hash(packed.bytes()))
        });
        let structure: &[u32] = tile.packed.as_ref().map_or(&[], |packed| &packed.structure);
        let head = Head {
            index: index as u64,
            block,
            structure: structure.len() as u64,
            errors: tile.errors.len() as u64,
            counts: tile.counts,
        };
        let io = |e| Error::io(self.partial.target(), "write the journal beside", e);
        let mut payload = bincode::serde::encode_to_vec(&head, encoding())
            .map_err(|e| io(std::io::Error::other(e.to_string())))?;
        structure.iter().for_each(|column| payload.extend_from_slice(&column.to_le_bytes()));
        tile.errors.iter().for_each(|error| payload.extend_from_slice(&error.to_le_bytes()));
        // A longer record would be a tile of more than 10^8 rows.
        self.pending.extend_from_slice(&(payload.len() as u32).to_le_bytes());
        self.pending.extend_from_slice(&crc32fast::hash(&payload).to_le_bytes());
        self.pending.extend_from_slice(&payload);
        if self.flushed.elapsed() >= FLUSH_INTERVAL {
            // Entries first: a record stands for entries that are there.
            writer.flush()?;
            self.file.write_all(&self.pending).map_err(io)?;
            self.pending.clear();
            self.flushed = Instant::now();
        }
        Ok(())
    }

    /// Removes the journal: the run is over.
    pub fn remove(mut self) {
        self.partial.keep_when_dropped(false);
    }
}
