//! The errors a user can cause or meet: each says where, what was found, what was expected and what to do.

use std::path::{Path, PathBuf};

/// Result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A file, scene or combination of files that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("{}: cannot {action}: {cause}{remedy}", path.display())]
    Io {
        /// File it happened to.
        path: PathBuf,
        /// What was tried, as a verb: `read`, `write`, `rename`.
        action: &'static str,
        /// What the system said.
        cause: std::io::Error,
        /// Empty, or `; ` and what to do.
        remedy: String,
    },
    /// A binary file that is not what it should be: foreign, truncated, damaged or newer.
    #[error("{}: {part}: found {found}, expected {expected}; {remedy}", path.display())]
    Format {
        /// File.
        path: PathBuf,
        /// Part of the file.
        part: String,
        /// What stands there.
        found: String,
        /// What should stand there.
        expected: String,
        /// What to do.
        remedy: String,
    },
    /// Two files that do not belong together.
    #[error("{} and {} do not belong together: {detail}; {remedy}", first.display(), second.display())]
    Mismatch {
        /// The dependent file.
        first: PathBuf,
        /// The file it should have been made from.
        second: PathBuf,
        /// What differs.
        detail: String,
        /// What to do.
        remedy: String,
    },
    /// A mistake in a scene's text files.
    #[error("{}:{line}: {message}", path.display())]
    Scene {
        /// OBJ, MTL, CSV or TOML file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Found, expected, remedy.
        message: String,
    },
    /// A scene file that as a whole cannot be used.
    #[error("{}: {message}", path.display())]
    Whole {
        /// File.
        path: PathBuf,
        /// Found, expected, remedy.
        message: String,
    },
}

impl Error {
    /// An operating-system error on `path`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        let remedy = match source.kind() {
            std::io::ErrorKind::NotFound => nearest_file(path)
                .map(|near| format!("; did you mean {}?", near.display()))
                .unwrap_or_else(|| "; check the path".into()),
            std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
                "; free some space and run again (an older output is untouched)".into()
            }
            std::io::ErrorKind::FileTooLarge => {
                "; raise the file-size limit and run again (an older output is untouched)".into()
            }
            std::io::ErrorKind::PermissionDenied => {
                "; check the permissions of the file and its folder".into()
            }
            std::io::ErrorKind::ReadOnlyFilesystem => {
                "; choose a folder that can be written, or mount this one for writing (an older output is untouched)".into()
            }
            _ => String::new(),
        };
        Error::Io { path: path.to_owned(), action, cause: source, remedy }
    }

    /// A binary file whose `part` is wrong.
    pub fn format(
        path: &Path,
        part: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Error::Format {
            path: path.to_owned(),
            part: part.into(),
            found: found.into(),
            expected: expected.into(),
            remedy: remedy.into(),
        }
    }

    /// A mistake at `line` of a scene's text file.
    pub fn scene(path: &Path, line: usize, message: impl Into<String>) -> Self {
        Error::Scene { path: path.to_owned(), line, message: message.into() }
    }

    /// A text file that as a whole cannot be used.
    pub fn whole(path: &Path, message: impl Into<String>) -> Self {
        Error::Whole { path: path.to_owned(), message: message.into() }
    }
}

/// The file in the same folder whose name is closest to the missing one, if any is close.
pub(crate) fn nearest_file(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let wanted = path.file_name()?.to_string_lossy().into_owned();
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    nearest_name(&wanted, names.iter().map(String::as_str)).map(|name| path.with_file_name(name))
}

/// The candidate with the smallest edit distance to `wanted`, if at most a third of its letters differ.
pub fn nearest_name<'a>(wanted: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (wanted.chars().count() / 3).max(1);
    candidates
        .map(|candidate| (edit_distance(wanted, candidate), candidate))
        .filter(|&(distance, _)| distance <= limit)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// `; did you mean m.npy?` for `m.npi`, where one of `endings` is close to that of `path`; else nothing.
pub fn meant_ending<'a>(path: &Path, endings: impl IntoIterator<Item = &'a str>) -> String {
    let ending = path.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    nearest_name(&ending, endings.into_iter())
        .map_or_else(String::new, |near| format!("; did you mean {}?", path.with_extension(near).display()))
}

/// Levenshtein distance, letters compared without case; two letters that change places count once, as people slip that way.
fn edit_distance(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|word| word.to_lowercase().chars().collect::<Vec<char>>());
    let mut above = vec![0; b.len() + 1];
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.iter().enumerate() {
        let mut next = vec![i + 1; b.len() + 1];
        for (j, other) in b.iter().enumerate() {
            let substituted = row[j] + usize::from(letter != other);
            next[j + 1] = substituted.min(row[j + 1] + 1).min(next[j] + 1);
            if i > 0 && j > 0 && (a[i - 1], letter) == (*other, &b[j - 1]) {
                next[j + 1] = next[j + 1].min(above[j - 1] + 1);
            }
        }
        above = std::mem::replace(&mut row, next);
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_takes_no_more_is_told_with_what_helps() {
        let said =
            |kind: std::io::ErrorKind| Error::io(Path::new("m.ff"), "write beside", kind.into()).to_string();
        assert!(said(std::io::ErrorKind::ReadOnlyFilesystem).contains("choose a folder that can be written"));
        assert!(said(std::io::ErrorKind::QuotaExceeded).contains("free some space"));
    }

    #[test]
    fn a_wrong_ending_is_told_with_the_name_that_was_meant() {
        let meant = |name: &str| meant_ending(Path::new(name), ["csv", "npy", "npz"]);
        assert_eq!(meant("out/m.npi"), "; did you mean out/m.npy?");
        assert_eq!(meant("m.cvs"), "; did you mean m.csv?");
        assert_eq!((meant("m.exr"), meant("m")), (String::new(), String::new()));
    }

    #[test]
    fn nearest_name_finds_a_slip_and_refuses_a_stranger() {
        let names = ["white", "red", "green"];
        assert_eq!(nearest_name("whit", names.iter().copied()), Some("white"));
        assert_eq!(nearest_name("Green", names.iter().copied()), Some("green"));
        assert_eq!(nearest_name("rde", names.iter().copied()), Some("red"));
        assert_eq!(edit_distance("illuminance", "iluminacne"), 2);
        assert_eq!(nearest_name("concrete", names.iter().copied()), None);
    }
}
