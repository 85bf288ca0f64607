//! Which files the `mtllib` statements of an OBJ mean.

use crate::error::{Error, Result, nearest_file};
use std::path::{Path, PathBuf};

/// The files that `libraries` (what follows each `mtllib`, with its line) name, beside the OBJ `path`, each once,
/// in order. A name may hold spaces: the whole rest of the line is one file if such a file exists, else its words are
/// files of their own.
pub(super) fn locate(path: &Path, libraries: &[(String, usize)]) -> Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = Vec::new();
    for (rest, line) in libraries {
        for file in named(path, rest, *line)? {
            if !files.contains(&file) {
                files.push(file);
            }
        }
    }
    Ok(files)
}

/// The files one `mtllib` names.
fn named(path: &Path, rest: &str, line: usize) -> Result<Vec<PathBuf>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let whole = folder.join(rest);
    // Exporters on Windows write `.\walls.mtl`.
    let slashed = folder.join(rest.replace('\\', "/"));
    if let Some(file) = [&whole, &slashed].into_iter().find(|file| file.is_file()) {
        return Ok(vec![file.clone()]);
    }
    let words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
    let split: Vec<PathBuf> = words.map(|word| folder.join(word)).collect();
    let Some(missing) = split.iter().find(|file| !file.is_file()) else { return Ok(split) };
    // Where no word is a file either, the author more likely meant one name.
    let missing = if split.iter().any(|file| file.is_file()) { missing } else { &whole };
    let remedy = match nearest_file(missing) {
        Some(near) => format!("did you mean {}?", near.display()),
        None => "put it beside the OBJ or correct the line".to_owned(),
    };
    let message = format!("material file {} does not exist; {remedy}", missing.display());
    Err(Error::scene(path, line, message))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn folder(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), "").unwrap());
        folder
    }

    fn names(folder: &Path, libraries: &[&str]) -> Result<Vec<String>> {
        let libraries: Vec<(String, usize)> = libraries.iter().map(|l| ((*l).to_owned(), 7)).collect();
        let files = locate(&folder.join("s.obj"), &libraries)?;
        Ok(files.iter().map(|f| f.strip_prefix(folder).unwrap().display().to_string()).collect())
    }

    #[test]
    fn two_names_after_one_mtllib() {
        let folder = folder(&["a.mtl", "b.mtl"]);
        assert_eq!(names(folder.path(), &["a.mtl  b.mtl"]).unwrap(), ["a.mtl", "b.mtl"]);
        assert_eq!(names(folder.path(), &["b.mtl", "a.mtl", "b.mtl"]).unwrap(), ["b.mtl", "a.mtl"]);
        assert_eq!(names(folder.path(), &["a.mtl # walls"]).unwrap(), ["a.mtl"]);
    }

    #[test]
    fn a_name_with_spaces_is_one_file_where_it_exists() {
        let folder = folder(&["my scene.mtl", "scene.mtl"]);
        assert_eq!(names(folder.path(), &["my scene.mtl"]).unwrap(), ["my scene.mtl"]);
    }

    #[test]
    fn backslashes_of_windows_separate_folders() {
        let folder = folder(&["walls.mtl"]);
        let files = locate(&folder.path().join("s.obj"), &[(".\\walls.mtl".to_owned(), 1)]).unwrap();
        assert_eq!(files, [folder.path().join("./walls.mtl")]);
    }

    #[test]
    fn a_missing_file_is_an_error_with_line_and_nearest_name() {
        let folder = folder(&["walls.mtl", "my scene.mtl"]);
        let message = names(folder.path(), &["wals.mtl"]).unwrap_err().to_string();
        assert!(message.contains("s.obj:7: material file"), "{message}");
        assert!(message.contains("wals.mtl does not exist; did you mean"), "{message}");
        assert!(message.ends_with("walls.mtl?"), "{message}");
        let message = names(folder.path(), &["walls.mtl other.mtl"]).unwrap_err().to_string();
        assert!(message.contains("other.mtl does not exist; put it beside the OBJ"), "{message}");
        let message = names(folder.path(), &["my scen.mtl"]).unwrap_err().to_string();
        assert!(message.ends_with("my scene.mtl?"), "{message}");
    }
}
