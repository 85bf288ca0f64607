//! Reading View3D input (`.vs3`, format 3): a scene of polygons, named and grouped as View3D reports them.
//!
//! The kinds of lines: `T` title, `C` control, `F` format, `V` vertex, `S` surface, `O` obstruction, `M` mask, `N` null
//! surface, `E` end; `!` and `/` begin comments. A surface that is combined with another joins its group.

use super::Surface;
use crate::error::{Error, Result};
use crate::materials::Material;
use crate::tables::number;
use std::path::Path;

/// Group and material of what only blocks light.
const OBSTRUCTION: &str = "obstruction";

/// Reads a scene, with what was left out.
///
/// # Errors
/// The line of the first thing that cannot be read or taken over.
pub fn read(path: &Path) -> Result<(Surface, Vec<String>)> {
    let text = crate::scene::read_text(path)?;
    let mut scene =
        Scene { path, surface: Surface::default(), group_of_surface: Vec::new(), obstructions: 0 };
    let mut said = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = Line { number: number + 1, words: words(line) };
        let Some(kind) = line.words.first().and_then(|word| word.chars().next()) else { continue };
        match kind.to_ascii_uppercase() {
            '!' | '/' => {}
            // What follows the letter. Blanks of any alphabet may stand before it.
            'T' => {
                let title = text.lines().nth(number).unwrap_or_default().trim_start();
                scene.surface.comments.push(title.get(1..).unwrap_or_default().trim().to_owned());
            }
            'F' => scene.format(&line)?,
            'C' => {
                let control = line.words[1..].join(" ").to_lowercase().replace(' ', "");
                if control.contains("emit=1") {
                    said.push("emit=1 asks View3D for factors with reflections in them; the matrix holds those without".into());
                }
            }
            'V' => scene.vertex(&line)?,
            'S' | 'O' => scene.surface(&line, kind.eq_ignore_ascii_case(&'O'))?,
            'M' | 'N' => {
                return Err(scene.wrong(
                    &line,
                    "masks and null surfaces are not read; make them holes in the surfaces they lie on",
                ));
            }
            'E' | '*' => break,
            _ => return Err(scene.wrong(&line, "expected a line that begins with one of T C F V S O E !")),
        }
    }
    if scene.surface.polygons.is_empty() {
        return Err(Error::whole(path, "no surface is in this file"));
    }
    if scene.obstructions > 0 {
        said.push(format!(
            "{} obstructions became black surfaces: they get rows of their own in the matrix",
            scene.obstructions
        ));
    }
    Ok((scene.surface, said))
}

struct Line<'a> {
    number: usize,
    words: Vec<&'a str>,
}

struct Scene<'a> {
    path: &'a Path,
    surface: Surface,
    group_of_surface: Vec<u32>,
    obstructions: usize,
}

impl Scene<'_> {
    fn wrong(&self, line: &Line<'_>, message: impl Into<String>) -> Error {
        Error::scene(self.path, line.number, message)
    }

    fn format(&self, line: &Line<'_>) -> Result<()> {
        match line.words.get(1) {
            Some(&"3") => Ok(()),
            found => Err(self.wrong(line, format!("format {}, expected 3", found.unwrap_or(&"")))),
        }
    }

    fn vertex(&mut self, line: &Line<'_>) -> Result<()> {
        self.in_sequence(line, self.surface.points.len())?;
        let mut place = [0.0; 3];
        for (k, x) in place.iter_mut().enumerate() {
            let word = line.words.get(k + 2).copied().unwrap_or("nothing");
            let read = word.parse().ok().filter(|x: &f64| x.is_finite());
            *x = read.ok_or_else(|| self.wrong(line, format!("found {word}, expected a coordinate")))?;
        }
        self.surface.points.push(place);
        Ok(())
    }

    fn surface(&mut self, line: &Line<'_>, obstruction: bool) -> Result<()> {
        self.in_sequence(line, self.group_of_surface.len())?;
        let integer = |k: usize| -> Result<usize> {
            let word = line.words.get(k).copied().unwrap_or("nothing");
            word.parse().map_err(|_| self.wrong(line, format!("found {word}, expected a whole number")))
        };
        let mut corners = Vec::with_capacity(4);
        for k in 2..6 {
            match integer(k)? {
                0 if k == 5 => {}
                v if (1..=self.surface.points.len()).contains(&v) => corners.push(v as u32 - 1),
                v => {
                    return Err(
                        self.wrong(line, format!("found vertex {v} of {}", self.surface.points.len()))
                    );
                }
            }
        }
        let (group, material) = if obstruction {
            self.obstructions += 1;
            (OBSTRUCTION.to_owned(), (OBSTRUCTION.to_owned(), Material::default()))
        } else {
            let (base, combined) = (integer(6)?, integer(7)?);
            if base != 0 {
                return Err(
                    self.wrong(line, "surfaces on a base surface are not read; cut the base around them")
                );
            }
            if combined > self.group_of_surface.len() {
                return Err(
                    self.wrong(line, format!("combined with surface {combined}, which is not before it"))
                );
            }
            let word = line.words.get(8).copied().unwrap_or("nothing");
            let emittance = word.parse().ok().filter(|x: &f64| (0.0..=1.0).contains(x));
            let emittance = emittance.ok_or_else(|| {
                self.wrong(line, format!("found {word}, expected an emittance from 0 to 1"))
            })?;
            let group = match combined {
                0 => line
                    .words
                    .get(9)
                    .map_or_else(|| format!("surface {}", line.words[1]), |name| (*name).to_owned()),
                first => self.surface.groups[self.group_of_surface[first - 1] as usize].clone(),
            };
            let material = Material { diffuse: [1.0 - emittance; 3], ..Material::default() };
            (group, (format!("emittance_{}", number(emittance)), material))
        };
        let group = position_or_push(&mut self.surface.groups, group);
        let material = position_or_push(&mut self.surface.materials, material);
        self.group_of_surface.push(group);
        self.surface.polygons.push(corners);
        self.surface.polygon_groups.push(group);
        self.surface.polygon_materials.push(material);
        Ok(())
    }

    /// Numbers must count from 1, as View3D wants them.
    fn in_sequence(&self, line: &Line<'_>, before: usize) -> Result<()> {
        let found = line.words.get(1).copied().unwrap_or("nothing");
        match found.parse::<usize>() {
            Ok(n) if n == before + 1 => Ok(()),
            _ => {
                Err(self
                    .wrong(line, format!("found number {found}, expected {}: they count from 1", before + 1)))
            }
        }
    }
}

fn position_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    let found = list.iter().position(|known| *known == item).unwrap_or(list.len());
    if found == list.len() {
        list.push(item);
    }
    found as u32
}

/// The words of a line up to a comment.
fn words(line: &str) -> Vec<&str> {
    let line = line.split('!').next().unwrap_or_default();
    line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    fn parsed(text: &str) -> Result<(Surface, Vec<String>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.vs3");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    /// Found by fuzzing: a blank of two bytes before the letter.
    #[test]
    fn titles_stand_behind_blanks_of_any_alphabet() {
        let lines = "\u{a0}T a room\nT\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 0 0 0.5 floor\nE\n";
        let (found, _) = parsed(lines).unwrap();
        assert_eq!(found.comments, ["a room", ""]);
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.vs3");
        let mut surface = two_polygons();
        surface.materials[0].1.diffuse = [0.25; 3];
        crate::foreign::view3d::write(&path, &surface).unwrap();
        let (found, said) = read(&path).unwrap();
        assert_eq!(said, Vec::<String>::new());
        assert_eq!((&found.points, &found.polygons), (&surface.points, &surface.polygons));
        assert_eq!(found.groups, ["the_floor", "flap"]);
        assert_eq!(found.materials[0].1.diffuse, [0.25; 3]);
        assert_eq!(found.comments, ["made by a test"]);
    }

    /// A file with everything that may stand in one: comments, commas, an obstruction, a combined surface.
    #[test]
    fn combined_surfaces_join_their_group() {
        let (found, said) = parsed(
            "T two halves ! and more\n/ comment\nC encl=1, emit=1\nF 3\nV 1 0. 0. 0.\nV 2 1. 0. 0.\nV 3,1.,1.,0.\nV 4 0. 1. 0.\n\
             S 1 1 2 3 0 0 0 0.9 half ! the first\nS 2 1 3 4 0 0 1 0.9 other\nO 3 4 3 2 1\nEnd of data\nS 4 9\n",
        )
        .unwrap();
        assert_eq!(found.groups, ["half", "obstruction"]);
        assert_eq!(found.polygon_groups, [0, 0, 1]);
        assert_eq!(found.polygons.row(2), [3, 2, 1, 0]);
        assert!((found.materials[0].1.diffuse[0] - 0.1).abs() < 1e-15);
        assert_eq!(said.len(), 2);
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let fails = |text: &str, part: &str| {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        fails("F 3a\n", ":1: format 3a, expected 3");
        fails("F 3\nV 2 0 0 0\n", ":2: found number 2, expected 1");
        fails("V 1 0 x 0\n", ":1: found x");
        fails("V 1 0 0 0\nS 1 1 1 2 0 0 0 .9 a\n", ":2: found vertex 2 of 1");
        fails("V 1 0 0 0\nS 1 1 1 1 0 1 0 .9 a\n", ":2: surfaces on a base");
        fails("V 1 0 0 0\nS 1 1 1 1 0 0 0 9 a\n", ":2: found 9");
        fails("V 1 0 0 0\nN 1 1 1 1 0 0 0 9 a\n", ":2: masks");
        fails("V 1 0 0 0\nE\n", "no surface");
    }
}
