//! What a run will take, known before it begins: time by a fixed cost model, bytes on disk, and the bound on memory that
//! the run then keeps.

use crate::estimator::Estimator;
use crate::reuse::Reuse;
use crate::scene::Scene;
use crate::traversal::{LeafPair, Settled};
use interchange::matrix::Precision;
use interchange::report::peak_memory_bytes;
use std::fmt::Write;

/// Tiles that are computed or wait for their turn take at most this many bytes, unless `--memory` says less.
const IN_FLIGHT: u64 = 1 << 28;
/// Buffers of files, columns of sparse blocks, records not yet written, chunks read back by closure: about 16 MiB.
const BUFFERS: u64 = 24 << 20;
/// What a thread needs besides its tile: stack, blockers, clipped polygons.
const PER_THREAD: u64 = 4 << 20;
/// Vectors of one f64 per element: errors, sums, areas, and a dozen while closing.
const VECTORS: u64 = 20;
/// What can be made anew is kept up to this many bytes in all and for each element, and up to half of what `--memory` leaves.
const MOST_KEPT: u64 = 64 << 20;
const KEPT_PER_ELEMENT: u64 = 6 << 10;
/// What is kept of a tile until the end: its block.
const PER_TILE: u64 = 32;

/// Bytes a tile takes while it is computed and waits: its entries as computed and as stored.
pub fn tile_bytes(pair: &LeafPair) -> u64 {
    (pair.pairs() * 2 * size_of::<f64>()) as u64 + (pair.rows.len() + pair.columns.len()) as u64 * 64
}

/// A bound on memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Largest resident memory of the whole run, bytes.
    pub bound: u64,
    /// Of it, for tiles that are computed or wait.
    pub in_flight: u64,
    /// Of it, for what can be made anew.
    pub anew: u64,
}

/// The memory needed is more than allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "--memory: found {}, expected at least {} for this scene; allow more, take fewer --threads, or build the mesh with \
     smaller leaf clusters",
    size(*allowed),
    size(*needed)
)]
pub struct TooLittle {
    allowed: u64,
    needed: u64,
}

/// The bound on memory of computing `pairs`, of which scene and traversal already took `resident` bytes at their peak.
///
/// # Errors
/// `allowed` is less than the least that will do: one tile at a time.
pub fn memory(
    pairs: &[LeafPair],
    elements: usize,
    threads: usize,
    resident: u64,
    allowed: Option<u64>,
) -> Result<Memory, TooLittle> {
    let kept = elements as u64 * VECTORS * 8 + pairs.len() as u64 * PER_TILE;
    let fixed = resident + kept + BUFFERS + threads as u64 * PER_THREAD;
    let largest = pairs.iter().map(tile_bytes).max().unwrap_or(0);
    let all: u64 = pairs.iter().map(tile_bytes).sum();
    if let Some(allowed) = allowed.filter(|&allowed| allowed < fixed + largest) {
        return Err(TooLittle { allowed, needed: fixed + largest });
    }
    let most_anew = MOST_KEPT.min(elements as u64 * KEPT_PER_ELEMENT);
    let anew = allowed.map_or(most_anew, |allowed| most_anew.min((allowed - fixed - largest) / 2));
    let most = IN_FLIGHT.max(largest).min(all);
    let in_flight = allowed.map_or(most, |allowed| most.min(allowed - fixed - anew));
    Ok(Memory { bound: fixed + anew + in_flight, in_flight, anew })
}

/// Largest resident memory so far, bytes.
pub fn resident() -> u64 {
    peak_memory_bytes()
}

/// What `--dry-run` prints.
pub fn describe(
    scene: &Scene,
    pairs: &[LeafPair],
    (settled, reuse): (&Settled, &Reuse<'_>),
    estimator: &dyn Estimator,
    precision: Precision,
    memory: Memory,
    threads: usize,
) -> String {
    let n = scene.len();
    let seconds: f64 = pairs.iter().map(|pair| estimator.nanoseconds(pair)).sum::<f64>() * 1e-9;
    let entries: u64 = pairs.iter().map(|pair| pair.pairs() as u64).sum();
    let bytes = entries * precision.bytes() as u64 + pairs.len() as u64 * PER_TILE + n as u64 * 16;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<24} {value}");
    };
    line("elements", n.to_string());
    line("occluders", scene.occluders.len().to_string());
    line("pairs", (n * (n + 1) / 2).to_string());
    line("  of one plane", settled.same_plane.to_string());
    line("  facing away", settled.behind.to_string());
    line("  fully blocked", settled.covered.to_string());
    let known = |pair: &LeafPair| reuse.known(pair.clusters[0], pair.clusters[1]);
    let sum = |of: &dyn Fn(&&LeafPair) -> bool| {
        pairs.iter().filter(of).map(|pair| pair.pairs() - known(pair)).sum::<usize>()
    };
    line("  reused", pairs.iter().map(known).sum::<usize>().to_string());
    line("  nothing between", sum(&|pair| pair.blockers.is_empty()).to_string());
    line("  to be looked at", sum(&|pair| !pair.blockers.is_empty()).to_string());
    line("tiles", pairs.len().to_string());
    let wall = seconds / threads as f64;
    line("time", format!("about {} of one core, {} with {threads} threads", span(seconds), span(wall)));
    line("file", format!("at most {} ({} entries)", size(bytes), precision.name()));
    line("memory", format!("at most {}", size(memory.bound)));
    text
}

/// Seconds for people.
fn span(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// Bytes for people.
pub fn size(bytes: u64) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let (mut value, mut unit) = (bytes as f64, 0);
    while value >= 1024.0 && unit + 1 < units.len() {
        (value, unit) = (value / 1024.0, unit + 1);
    }
    if unit == 0 { format!("{bytes} bytes") } else { format!("{value:.1} {}", units[unit]) }
}

/// A size such as `8GiB`, `500MB` or `1000000` as bytes.
///
/// # Errors
/// What was expected, for clap.
pub fn parse_size(text: &str) -> Result<u64, String> {
    let expected = || "expected a size above 0 such as 8GiB, 500MB or 1000000 (bytes)".to_owned();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let (kilo, kibi) = (1000.0f64, 1024.0f64);
    let scale = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "kb" => kilo,
        "mb" => kilo.powi(2),
        "gb" => kilo.powi(3),
        "tb" => kilo.powi(4),
        "k" | "kib" => kibi,
        "m" | "mib" => kibi.powi(2),
        "g" | "gib" => kibi.powi(3),
        "t" | "tib" => kibi.powi(4),
        _ => return Err(expected()),
    };
    let bytes = number.parse::<f64>().ok().map(|number| number * scale);
    bytes.filter(|bytes| *bytes >= 1.0 && *bytes < 1e18).map(|bytes| bytes as u64).ok_or_else(expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_written() {
        assert_eq!(parse_size("8GiB"), Ok(8 << 30));
        assert_eq!(parse_size("1.5 MB"), Ok(1_500_000));
        assert_eq!(parse_size("4096"), Ok(4096));
        assert_eq!(size(3 << 29), "1.5 GiB");
        for bad in ["", "GiB", "-1", "0", "8 parsecs", "1e9", "nan", "inf"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn memory_is_bounded_by_what_is_allowed_or_refused() {
        let pair = |k: usize| LeafPair {
            rows: k..k + 100,
            columns: 9000..9100,
            clusters: [0, 1],
            blockers: Vec::new(),
        };
        let pairs: Vec<LeafPair> = (0..2000).map(|k| pair(4 * k)).collect();
        let free = memory(&pairs, 10_000, 2, 1 << 25, None);
        assert!(free.is_ok_and(|memory| memory.in_flight == IN_FLIGHT));
        let tight = memory(&pairs, 10_000, 2, 1 << 25, Some(100 << 20));
        assert!(tight.is_ok_and(|memory| memory.bound <= 100 << 20 && memory.in_flight < IN_FLIGHT));
        let refused = memory(&pairs, 10_000, 2, 1 << 25, Some(50 << 20)).map_err(|e| e.to_string());
        assert!(refused.is_err_and(|message| message.contains("50.0 MiB") && message.contains("at least")));
    }
}
