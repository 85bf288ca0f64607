//! The make rule that says what a scene depends on, as compilers write it: the OBJ names its MTL files, so only the
//! reader knows them. An empty rule for each keeps make going when one of them is deleted or renamed.

use interchange::scene::Scene;
use std::path::{Path, PathBuf};

/// Files that were read for `scene`.
pub fn dependencies(scene: &Scene) -> Vec<PathBuf> {
    let settings = scene.path.with_extension("toml");
    let mut files = vec![scene.path.clone()];
    files.extend(scene.material_files.iter().cloned());
    // Only where it exists: make would take a missing file with an empty rule for one that always changes.
    files.extend(settings.exists().then_some(settings));
    let mut seen = std::collections::HashSet::new();
    files.retain(|file| seen.insert(file.clone()));
    files
}

/// The rule: `target` depends on `files`.
pub fn rule(target: &Path, files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|file| escaped(file)).collect();
    let mut text = format!("{}: {}\n", escaped(target), names.join(" "));
    for name in names {
        text += &format!("{name}:\n");
    }
    text
}

/// A file name as make reads it.
fn escaped(path: &Path) -> String {
    path.to_string_lossy().chars().fold(String::new(), |mut text, letter| {
        match letter {
            ' ' | '\t' | '#' | ':' | '%' => text.push('\\'),
            '$' => text.push('$'),
            _ => {}
        }
        text.push(letter);
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_and_every_file_has_a_rule() {
        let files = [PathBuf::from("a dir/s.obj"), PathBuf::from("s$.mtl")];
        let text = rule(Path::new("out/s.materials"), &files);
        assert_eq!(text, "out/s.materials: a\\ dir/s.obj s$$.mtl\na\\ dir/s.obj:\ns$$.mtl:\n");
    }
}
