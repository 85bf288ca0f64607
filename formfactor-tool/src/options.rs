//! Flags of `compute` that say how the matrix is stored, divided and closed.

use crate::closure::Closure;
use crate::plan::parse_size;
use clap::{Args, ValueEnum};
use interchange::matrix::Precision;
use std::fmt;

/// Tolerances of at least this are stored as f32: its rounding, 6e-8 of an entry, stays below.
const F32_TOLERANCE: f64 = 1e-6;
/// Most shards: beyond it a shard of the largest scene is a few blocks.
const MOST_SHARDS: u32 = 10_000;

/// How the matrix is stored, divided and closed.
#[derive(Debug, Clone, Default, Args)]
pub struct Storage {
    /// Stored type of the entries [default: f32 from a tolerance of 1e-6 up, else f64]
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionName>,
    /// What to do about row sums of a closed scene that are not exactly 1 [default: least-squares where every row sum is
    /// within its own estimated error of 1, else report]; of shards, merge does it
    #[arg(long, value_enum)]
    pub closure: Option<Closure>,
    /// Compute part I of N only, balanced by expected work; merge puts the N files together
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Bound on resident memory, such as 8GiB; refused where it cannot be kept
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub memory: Option<u64>,
    /// Say what the run would take, and write nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Go on where a killed run with the same flags was, and keep what is finished when this one fails
    #[arg(long)]
    pub resume: bool,
}

impl Storage {
    /// Stored type of the entries at this tolerance.
    pub fn precision(&self, tolerance: f64) -> Precision {
        match self.precision {
            Some(PrecisionName::F32) => Precision::F32,
            Some(PrecisionName::F64) => Precision::F64,
            None if tolerance >= F32_TOLERANCE => Precision::F32,
            None => Precision::F64,
        }
    }

    /// The flags given that change the file, in a fixed order.
    pub fn flags(&self) -> Vec<String> {
        let precision = self.precision.map(|p| format!("--precision {}", name(p)));
        let closure = self.closure.map(|closure| format!("--closure {}", name(closure)));
        let shard = self.shard.map(|shard| format!("--shard {shard}"));
        [precision, closure, shard].into_iter().flatten().collect()
    }
}

/// How a value of a flag is written.
pub fn name(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// Stored type of the entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PrecisionName {
    /// 32 bits: 7 digits
    F32,
    /// 64 bits: 16 digits
    F64,
}

/// One of several parts of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 0.
    pub part: u32,
    /// Of how many, at least 1.
    pub parts: u32,
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part + 1, self.parts)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected I/N with 1 <= I <= N <= {MOST_SHARDS}, such as 2/4");
        let (part, parts) = text.split_once('/').ok_or_else(expected)?;
        let (part, parts): (u32, u32) = part.parse().ok().zip(parts.parse().ok()).ok_or_else(expected)?;
        if (1..=parts).contains(&part) && parts <= MOST_SHARDS {
            Ok(Self { part: part - 1, parts })
        } else {
            Err(expected())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_count_from_1_to_n() {
        assert_eq!("2/4".parse(), Ok(Shard { part: 1, parts: 4 }));
        assert_eq!(Shard { part: 1, parts: 4 }.to_string(), "2/4");
        for bad in ["0/4", "5/4", "1/0", "2", "a/b", "-1/2", "1/10001", "1/2/3", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
