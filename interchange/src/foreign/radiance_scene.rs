//! Reading a Radiance scene description: its polygons, and of their materials what diffuse light transport needs.
//!
//! A primitive is `modifier type identifier`, then its string, integer and real arguments, each list behind its
//! count (Radiance reference manual, "Scene description").

use super::Surface;
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::materials::Material;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// A word with the line it stands on.
type Word<'a> = (usize, &'a str);

/// Reads the polygons of a scene, with what was left out.
///
/// # Errors
/// The line of the first thing that cannot be read; commands (`!xform ...`) must be expanded first.
pub fn read(path: &Path) -> Result<(Surface, Vec<String>)> {
    let text = crate::scene::read_text(path)?;
    let mut reader = Reader { path, words: words(path, &text)?.into_iter().peekable(), last_line: 1 };
    let mut scene = Found::default();
    while reader.words.peek().is_some() {
        primitive(&mut reader, &mut scene)?;
    }
    if scene.surface.polygons.is_empty() {
        return Err(Error::whole(path, "no polygon is in this scene; other shapes are not read"));
    }
    let mut said: Vec<String> =
        scene.left_out.iter().map(|(kind, count)| format!("left out: {count} of type {kind}")).collect();
    said.extend(scene.simplified.iter().map(|(kind, count)| {
        let materials = counted(*count, "material", "materials");
        format!("{materials} of type {kind}: only what is reflected diffusely is kept")
    }));
    Ok((scene.surface, said))
}

#[derive(Default)]
struct Found {
    surface: Surface,
    materials: HashMap<String, u32>,
    points: HashMap<[u64; 3], u32>,
    left_out: BTreeMap<String, usize>,
    simplified: BTreeMap<String, usize>,
}

impl Found {
    fn define(&mut self, name: &str, material: Material) {
        let number = self.surface.materials.len() as u32;
        self.surface.materials.push((name.to_owned(), material));
        self.materials.insert(name.to_owned(), number);
    }

    fn point(&mut self, place: [f64; 3]) -> u32 {
        let points = &mut self.surface.points;
        *self.points.entry(place.map(f64::to_bits)).or_insert_with(|| {
            points.push(place);
            points.len() as u32 - 1
        })
    }
}

/// One primitive.
fn primitive(reader: &mut Reader<'_>, scene: &mut Found) -> Result<()> {
    let (line, modifier) = reader.word("a modifier")?;
    let (_, kind) = reader.word("a type")?;
    let (_, name) = reader.word("an identifier")?;
    if kind == "alias" {
        let (_, old) = reader.word("the material of an alias")?;
        let material = scene.materials.get(old).map(|&m| scene.surface.materials[m as usize].1);
        scene.define(name, material.unwrap_or_default());
        return Ok(());
    }
    let _ = reader.list("string")?;
    let _ = reader.list("integer")?;
    let numbers = reader.numbers()?;
    let wrong = |expected: &str| {
        Err(Error::scene(
            reader.path,
            line,
            format!("{kind} {name}: {} real arguments, expected {expected}", numbers.len()),
        ))
    };
    let colour = || [numbers[0], numbers[1], numbers[2]];
    match kind {
        "plastic" | "metal" | "trans" => {
            if numbers.len() < 5 {
                return wrong("at least 5");
            }
            let specular = numbers[3];
            let through = if kind == "trans" { numbers.get(5).copied().unwrap_or(0.0) } else { 0.0 };
            if specular > 0.0 || kind != "plastic" {
                *scene.simplified.entry(kind.to_owned()).or_default() += 1;
            }
            let diffuse = colour().map(|x| x * (1.0 - specular) * (1.0 - through));
            scene.define(name, Material { diffuse, ..Material::default() });
        }
        "light" | "glow" | "illum" | "spotlight" => {
            if numbers.len() < 3 {
                return wrong("at least 3");
            }
            scene.define(name, Material { radiance: colour(), ..Material::default() });
        }
        "mirror" | "glass" | "dielectric" | "interface" | "antimatter" => {
            *scene.simplified.entry(kind.to_owned()).or_default() += 1;
            scene.define(name, Material::default());
        }
        "polygon" => {
            if numbers.len() < 9 || numbers.len() % 3 != 0 {
                return wrong("3 for each corner, 9 at least");
            }
            let Some(&material) = scene.materials.get(modifier) else {
                let near = crate::error::nearest_name(modifier, scene.materials.keys().map(String::as_str));
                let near = near.map(|near| format!("; did you mean {near}?")).unwrap_or_default();
                return Err(Error::scene(
                    reader.path,
                    line,
                    format!("polygon {name}: no material {modifier}{near}"),
                ));
            };
            let corners: Vec<u32> =
                numbers.as_chunks().0.iter().map(|&place: &[f64; 3]| scene.point(place)).collect();
            scene.surface.polygons.push(corners);
            scene.surface.polygon_groups.push(scene.surface.groups.len() as u32);
            scene.surface.groups.push(name.to_owned());
            scene.surface.polygon_materials.push(material);
        }
        _ => *scene.left_out.entry(kind.to_owned()).or_default() += 1,
    }
    Ok(())
}

struct Reader<'a> {
    path: &'a Path,
    words: std::iter::Peekable<std::vec::IntoIter<Word<'a>>>,
    last_line: usize,
}

impl<'a> Reader<'a> {
    fn word(&mut self, expected: &str) -> Result<Word<'a>> {
        let word = self.words.next().ok_or_else(|| {
            Error::scene(self.path, self.last_line, format!("the file ends where {expected} was expected"))
        })?;
        self.last_line = word.0;
        Ok(word)
    }

    fn list(&mut self, what: &str) -> Result<Vec<Word<'a>>> {
        let (line, word) = self.word(&format!("the number of {what} arguments"))?;
        let count: usize = word.parse().map_err(|_| {
            Error::scene(self.path, line, format!("found {word}, expected the number of {what} arguments"))
        })?;
        (0..count).map(|_| self.word(&format!("a {what} argument"))).collect()
    }

    fn numbers(&mut self) -> Result<Vec<f64>> {
        let path = self.path;
        let number = |(line, word): Word<'_>| {
            let number = word.parse().ok().filter(|x: &f64| x.is_finite());
            number.ok_or_else(|| Error::scene(path, line, format!("found {word}, expected a number")))
        };
        self.list("real")?.into_iter().map(number).collect()
    }
}

/// The words of a text without its comments.
fn words<'a>(path: &Path, text: &'a str) -> Result<Vec<Word<'a>>> {
    let mut words = Vec::new();
    for (number, line) in text.lines().enumerate() {
        if line.starts_with('!') {
            let message = "a command; expand it first (`xform -e scene.rad > expanded.rad` runs it)";
            return Err(Error::scene(path, number + 1, message));
        }
        let line = line.split('#').next().unwrap_or_default();
        words.extend(line.split_whitespace().map(|word| (number + 1, word)));
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    fn parsed(text: &str) -> Result<(Surface, Vec<String>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.rad");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.rad");
        let surface = two_polygons();
        crate::foreign::radiance::write(&path, &surface).unwrap();
        let (found, said) = read(&path).unwrap();
        assert_eq!(said, Vec::<String>::new());
        assert_eq!((&found.points, &found.polygons), (&surface.points, &surface.polygons));
        assert_eq!(found.groups, ["the_floor.1", "flap.2"]);
        assert_eq!(found.materials, surface.materials);
    }

    #[test]
    fn brightness_of_its_own_becomes_glow() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.rad");
        let surface = Surface { radiances: Some(vec![[1.0; 3], [0.5; 3]]), ..two_polygons() };
        crate::foreign::radiance::write(&path, &surface).unwrap();
        let found = read(&path).unwrap().0;
        assert_eq!(found.materials[1].1.radiance, [0.5; 3]);
    }

    #[test]
    fn shiny_and_round_things_are_said() {
        let text = "# a comment\nvoid plastic p\n0\n0\n5 .5 .5 .5 .2 0\nvoid alias q p\nq sphere s 0 0 4 0 0 0 1\n\
                    q polygon t 0 0 9 0 0 0 1 0 0 0 1 0\n";
        let (found, said) = parsed(text).unwrap();
        assert_eq!(found.materials[1].1.diffuse, [0.4; 3]);
        assert_eq!(said.len(), 2);
        assert!(said[0].contains("1 of type sphere"));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let fails = |text: &str, part: &str| {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        fails("void light l\n0\n0\n3 1 1 1\n", "no polygon");
        fails(
            "void light lamp\n0\n0\n3 1 1 1\nlmp polygon a\n0\n0\n9 0 0 0 1 0 0 0 1 0\n",
            ":5: polygon a: no material lmp; did you mean lamp?",
        );
        fails("void light l\n0\n0\n3 1 1 x\n", ":4: found x");
        fails("void light l\n0\n0\n3 1 1", ":4: the file ends");
        fails("\n!xform -t 0 0 1 a.rad\n", ":2: a command");
        fails("void light l 0 0 3 1 1 1 l polygon p 0 0 8 0 0 0 1 0 0 0 1", "8 real arguments");
    }
}
