//! Solutions on their way, as files of their own beside the output: `s.000004.sol` after four shots or steps.

use std::path::{Path, PathBuf};

/// Files written at most: a wish for one after every shot of a long solve fills no disk.
const MOST_FILES: usize = 1000;

/// After how many shots or steps a snapshot is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Plan {
    /// After every so many.
    Every(usize),
    /// After these.
    At(Vec<usize>),
}

impl Plan {
    /// One number for every so many, several for these.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let number = |part: &str| {
            part.trim().parse().ok().filter(|&count: &usize| count > 0).ok_or_else(|| {
                format!("{part:?}: expected a count of at least 1, or several with commas between")
            })
        };
        let counts = text.split(',').map(number).collect::<Result<Vec<usize>, String>>()?;
        Ok(match counts[..] {
            [every] => Plan::Every(every),
            _ => Plan::At(counts),
        })
    }

    /// Whether there is one after `count`; none beyond the first thousand.
    pub fn wants(&self, count: usize) -> bool {
        match self {
            Plan::Every(every) => count.is_multiple_of(*every) && count / every <= MOST_FILES,
            Plan::At(counts) => counts.iter().take(MOST_FILES).any(|&at| at == count),
        }
    }

    /// As it is said on the command line.
    pub fn describe(&self) -> String {
        match self {
            Plan::Every(every) => every.to_string(),
            Plan::At(counts) => counts.iter().map(usize::to_string).collect::<Vec<_>>().join(","),
        }
    }
}

/// Where the snapshot after `count` lies.
pub fn path_for(output: &Path, count: usize) -> PathBuf {
    let ending = output.extension().map(|ending| ending.to_string_lossy().into_owned());
    output.with_extension(match ending {
        Some(ending) => format!("{count:06}.{ending}"),
        None => format!("{count:06}"),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn plans_are_read_and_kept() {
        let every = Plan::parse("8").unwrap();
        assert!(every.wants(16) && !every.wants(4) && every.wants(8000) && !every.wants(8008));
        let at = Plan::parse("1, 4,64").unwrap();
        assert!(at.wants(1) && at.wants(64) && !at.wants(8));
        assert_eq!((every.describe(), at.describe()), ("8".into(), "1,4,64".into()));
        for bad in ["0", "", "1,,2", "-1", "x", "1.5"] {
            assert!(Plan::parse(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn names_sort_in_order() {
        assert_eq!(path_for(Path::new("out/s.sol"), 4), Path::new("out/s.000004.sol"));
        assert_eq!(path_for(Path::new("s"), 12), Path::new("s.000012"));
    }
}
