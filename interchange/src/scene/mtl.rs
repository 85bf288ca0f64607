//! Material files (Wavefront "MTL Material Format", 1995, and the PBR extension of 2014), read by hand: a single
//! line that is wrong is an error with its number, never a material lost in silence.

use super::NONE;
use super::statement::{Statement, UnknownKeywords, decode, shown, statements};
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::materials::{Material, MaterialTable};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Statements that stages do not use: ambient colour, illumination model, further PBR parameters.
const SILENT: [&str; 10] =
    ["ka", "illum", "sharpness", "pc", "pcr", "ps", "aniso", "anisor", "km", "fresnel"];

/// Statements that name a texture, besides all that begin with `map_`.
const TEXTURES: [&str; 5] = ["bump", "disp", "decal", "refl", "norm"];

/// A material and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    /// Its values.
    pub material: Material,
    /// File.
    pub file: PathBuf,
    /// Line of its `newmtl`.
    pub line: usize,
    /// `d` as given.
    opacity: Option<f64>,
    /// `Tr` as given.
    transparency: Option<f64>,
}

/// The materials of all files of a scene. Where a name is defined twice the later definition holds, as a whole.
#[derive(Debug, Default)]
pub(super) struct Library {
    /// By name.
    pub entries: HashMap<String, Entry>,
    /// What the author should look at.
    pub warnings: Vec<String>,
}

impl Library {
    /// Adds the materials of the file `path`.
    pub fn read(&mut self, path: &Path) -> Result<()> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
        self.add(path, decode(path, &bytes)?)
    }

    /// The materials as a table, in the order of their definitions in a single file, then the built-in one.
    pub fn into_table(self) -> MaterialTable {
        let mut entries: Vec<(String, Entry)> = self.entries.into_iter().collect();
        entries.sort_by_key(|(_, entry)| entry.line);
        let built_in = (NONE.to_owned(), Material::default());
        let all = entries.into_iter().map(|(name, entry)| (name, entry.material)).chain([built_in]);
        let (names, values) = all.unzip();
        MaterialTable { names, values }
    }

    /// Adds the materials of `text`, the contents of `path`.
    fn add(&mut self, path: &Path, text: &str) -> Result<()> {
        let mut current: Option<(String, Entry)> = None;
        let mut textures: Option<(usize, usize)> = None;
        let mut unknown = UnknownKeywords::default();
        for statement in statements(text) {
            // Exporters disagree about capitals (`map_kd`, `Map_Kd`), and no two keywords differ by them alone.
            let keyword = statement.keyword.to_ascii_lowercase();
            if keyword == "newmtl" {
                let next = begin(path, &statement)?;
                self.close(current.replace(next));
                continue;
            }
            let Some((name, entry)) = current.as_mut() else {
                let found = shown(statement.keyword);
                let message =
                    format!("`{found}` before the first newmtl; begin the material with `newmtl NAME`");
                return Err(Error::scene(path, statement.line, message));
            };
            if keyword.starts_with("map_") || TEXTURES.contains(&keyword.as_str()) {
                textures.get_or_insert((statement.line, 0)).1 += 1;
            } else if !SILENT.contains(&keyword.as_str())
                && !(Line { path, name, statement: &statement }).apply(&keyword, entry)?
            {
                unknown.note(&statement);
            }
        }
        self.close(current);
        self.warnings.extend(unknown.warnings(path));
        self.warnings.extend(textures.map(|(line, count)| {
            let path = path.display();
            format!(
                "{path}:{line}: textures are ignored ({}); surfaces have the plain Kd, Ke and Ks",
                counted(count, "line", "lines")
            )
        }));
        Ok(())
    }

    /// Enters a finished material.
    fn close(&mut self, finished: Option<(String, Entry)>) {
        let Some((name, mut entry)) = finished else { return };
        let place = format!("{}:{}: material {}", entry.file.display(), entry.line, shown(&name));
        entry.material.opacity = match (entry.opacity, entry.transparency) {
            (Some(opacity), Some(transparency)) if opacity != 1.0 - transparency => {
                self.warnings.push(format!(
                    "{place}: d {opacity} and Tr {transparency} disagree (Tr is 1 - d); d holds"
                ));
                opacity
            }
            (Some(opacity), _) => opacity,
            (None, Some(transparency)) => 1.0 - transparency,
            (None, None) => entry.material.opacity,
        };
        if let Some(old) = self.entries.get(&name).filter(|old| old.material != entry.material) {
            let first = format!("{}:{}", old.file.display(), old.line);
            self.warnings
                .push(format!("{place} is defined differently at {first}; the later definition holds"));
        }
        self.entries.insert(name, entry);
    }
}

/// A new material.
fn begin(path: &Path, statement: &Statement) -> Result<(String, Entry)> {
    let line = statement.line;
    let name = statement.rest.to_string();
    if name.is_empty() {
        return Err(Error::scene(path, line, "newmtl without a name; name the material"));
    }
    if name == NONE {
        let message = format!("the name {NONE} stands for faces without a material; choose another name");
        return Err(Error::scene(path, line, message));
    }
    let material = Material::default();
    Ok((name, Entry { material, file: path.to_owned(), line, opacity: None, transparency: None }))
}

/// A statement about a material.
struct Line<'s> {
    path: &'s Path,
    name: &'s str,
    statement: &'s Statement<'s>,
}

impl Line<'_> {
    /// Applies the statement to its material; false if nobody knows the keyword.
    fn apply(&self, keyword: &str, entry: &mut Entry) -> Result<bool> {
        const UNIT: (f64, f64, &str) = (0.0, 1.0, "within [0, 1]");
        const POSITIVE: (f64, f64, &str) = (0.0, f64::MAX, "finite and at least 0");
        const INDEX: (f64, f64, &str) = (f64::MIN_POSITIVE, f64::MAX, "finite and greater than 0");
        let material = &mut entry.material;
        match keyword {
            "kd" => material.diffuse = self.colour(UNIT)?,
            "ks" => material.specular = self.colour(UNIT)?,
            "tf" => material.transmission = self.colour(UNIT)?,
            "ke" => material.radiance = self.colour(POSITIVE)?,
            "ns" => material.exponent = self.number(POSITIVE)?,
            "ni" => material.refraction = self.number(INDEX)?,
            "pr" => material.roughness = self.number(UNIT)?,
            "pm" => material.metalness = self.number(UNIT)?,
            "d" => entry.opacity = Some(self.number(UNIT)?),
            "tr" => entry.transparency = Some(self.number(UNIT)?),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn error(&self, message: impl std::fmt::Display) -> Error {
        let (name, keyword) = (shown(self.name), shown(self.statement.keyword));
        Error::scene(self.path, self.statement.line, format!("material {name}: {keyword} {message}"))
    }

    /// Three numbers, or one for grey: the format lets green and blue default to red.
    fn colour(&self, range: (f64, f64, &str)) -> Result<[f64; 3]> {
        if let Some(kind @ ("spectral" | "xyz")) = self.statement.rest.split_whitespace().next() {
            return Err(self.error(format!("{kind} is not supported; give linear r g b")));
        }
        let words: Vec<&str> = self.statement.rest.split_whitespace().collect();
        let colour = match self.values(&words, range)?[..] {
            [grey] => [grey; 3],
            [red, green, blue] => [red, green, blue],
            _ => {
                let count = words.len();
                return Err(
                    self.error(format!("has {count} numbers, expected r g b, or one number for grey"))
                );
            }
        };
        Ok(colour)
    }

    /// One number. `d -halo x` dims by angle; its constant part is taken.
    fn number(&self, range: (f64, f64, &str)) -> Result<f64> {
        let rest = self.statement.rest.as_ref();
        let words: Vec<&str> = rest.strip_prefix("-halo").unwrap_or(rest).split_whitespace().collect();
        match self.values(&words, range)?[..] {
            [value] => Ok(value),
            _ => Err(self.error(format!("has {} numbers, expected one", words.len()))),
        }
    }

    fn values(&self, words: &[&str], (least, most, expected): (f64, f64, &str)) -> Result<Vec<f64>> {
        let value = |word: &&str| {
            let value: f64 = word
                .parse()
                .map_err(|_| self.error(format!("has `{}`, which is not a number", shown(word))))?;
            if !(least..=most).contains(&value) {
                return Err(self.error(format!("is {}, but must be {expected}", shown(&self.statement.rest))));
            }
            Ok(value)
        };
        words.iter().map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn library(text: &str) -> Result<Library> {
        let mut library = Library::default();
        library.add(Path::new("m.mtl"), text).map(|()| library)
    }

    fn refusal(text: &str) -> String {
        library(text).unwrap_err().to_string()
    }

    #[test]
    fn every_statement_reaches_its_field() {
        let text = "newmtl  wet paint \nKa 1 1 1\nKd 0.1 0.2 0.3 # matte\nKs 0.4\nKe 5 6e2 \\\n7\nNs 250\nNi 1.45\n\
                    d -halo 0.25\nTf 0.5 0.6 0.7\nPr 0.8\nPm 0.9\nillum 2\n\nnewmtl plain\nTr 0.25\n";
        let library = library(text).unwrap();
        let expected = Material {
            diffuse: [0.1, 0.2, 0.3],
            radiance: [5.0, 600.0, 7.0],
            specular: [0.4; 3],
            transmission: [0.5, 0.6, 0.7],
            exponent: 250.0,
            refraction: 1.45,
            opacity: 0.25,
            roughness: 0.8,
            metalness: 0.9,
            two_sided: 0.0,
        };
        assert_eq!(library.entries["wet paint"].material, expected);
        assert_eq!(library.entries["plain"].material, Material { opacity: 0.75, ..Default::default() });
        assert_eq!(library.entries["plain"].line, 15);
        assert_eq!(library.warnings, [""; 0]);
    }

    #[test]
    fn kd_takes_one_number_or_three() {
        assert_eq!(library("newmtl a\nKd 0.1").unwrap().entries["a"].material.diffuse, [0.1; 3]);
        let expected = "m.mtl:2: material a: Kd has 2 numbers, expected r g b, or one number for grey";
        assert_eq!(refusal("newmtl a\nKd 0.1 0.2"), expected);
        assert!(refusal("newmtl a\nKd").starts_with("m.mtl:2: material a: Kd has 0 numbers"));
        assert!(refusal("newmtl a\nKe 1 2 3 4").starts_with("m.mtl:2: material a: Ke has 4 numbers"));
        assert!(
            refusal("newmtl a\nNs 1 2").starts_with("m.mtl:2: material a: Ns has 2 numbers, expected one")
        );
    }

    #[test]
    fn spectra_and_xyz_are_refused_with_their_line() {
        let spectral = "m.mtl:2: material a: Kd spectral is not supported; give linear r g b";
        assert_eq!(refusal("newmtl a\nKd spectral wall.rfl 1"), spectral);
        assert!(refusal("newmtl a\n\nKs xyz 0.1 0.2 0.3").starts_with("m.mtl:3: material a: Ks xyz is not"));
    }

    #[test]
    fn values_out_of_range_are_refused_with_line_material_and_value() {
        let kd = "m.mtl:3: material b: Kd is 0.5 1.2 0.5, but must be within [0, 1]";
        assert_eq!(refusal("newmtl a\nnewmtl b\nKd 0.5 1.2 0.5"), kd);
        for (line, expected) in [
            ("Kd -0.1", "within [0, 1]"),
            ("Kd nan", "within [0, 1]"),
            ("Ks 1.0000001", "within [0, 1]"),
            ("Tf 2", "within [0, 1]"),
            ("d 1.5", "within [0, 1]"),
            ("Tr -1", "within [0, 1]"),
            ("Pr 2", "within [0, 1]"),
            ("Pm inf", "within [0, 1]"),
            ("Ke 1 -1 1", "finite and at least 0"),
            ("Ke inf", "finite and at least 0"),
            ("Ke 1e999", "finite and at least 0"),
            ("Ke nan", "finite and at least 0"),
            ("Ns -1", "finite and at least 0"),
            ("Ni 0", "finite and greater than 0"),
        ] {
            let (keyword, value) = line.split_once(' ').unwrap();
            let message = format!("m.mtl:2: material a: {keyword} is {value}, but must be {expected}");
            assert_eq!(refusal(&format!("newmtl a\n{line}")), message);
        }
        assert!(refusal("newmtl a\nKe 1 x 1").ends_with("Ke has `x`, which is not a number"));
    }

    #[test]
    fn statements_before_the_first_material_are_refused_with_their_line() {
        let expected = "m.mtl:2: `Kd` before the first newmtl; begin the material with `newmtl NAME`";
        assert_eq!(refusal("# head\nKd 0.5\nnewmtl a"), expected);
        assert!(refusal("newmtl").starts_with("m.mtl:1: newmtl without a name"));
        assert!(refusal("newmtl (none)").starts_with("m.mtl:1: the name (none) stands for faces without"));
    }

    #[test]
    fn the_later_of_two_definitions_holds_and_is_told() {
        let twice = library("newmtl a\nKd 0.1\nKe 1\nnewmtl b\nnewmtl a\nKd 0.2").unwrap();
        assert_eq!(twice.entries["a"].material, Material { diffuse: [0.2; 3], ..Default::default() });
        let expected = "m.mtl:5: material a is defined differently at m.mtl:1; the later definition holds";
        assert_eq!(twice.warnings, [expected]);
        assert_eq!(library("newmtl a\nKd 0.1\nnewmtl a\nKd 0.1").unwrap().warnings, [""; 0]);
    }

    #[test]
    fn a_table_has_the_materials_in_the_order_of_the_file() {
        let table = library("newmtl z\nKd 0.1\nnewmtl a\nnewmtl m\nKd 0.3").unwrap().into_table();
        assert_eq!(table.names, ["z", "a", "m", NONE]);
        assert_eq!(table.values.iter().map(|m| m.diffuse[0]).collect::<Vec<_>>(), [0.1, 0.0, 0.3, 0.0]);
    }

    #[test]
    fn opacity_and_transparency_that_disagree_are_told() {
        let both = library("newmtl a\nTr 1\nd 1\nnewmtl b\nd 0.9\nTr 0.1").unwrap();
        assert_eq!(both.entries["a"].material.opacity, 1.0);
        assert_eq!(both.warnings, ["m.mtl:1: material a: d 1 and Tr 1 disagree (Tr is 1 - d); d holds"]);
    }

    #[test]
    fn textures_and_unknown_statements_are_told_once() {
        let text = "newmtl a\nmap_Kd a.png\nMap_Ks b.png\nbump c.png\nkd 0.5\nwobble 1\nwobble 2\n";
        let library = library(text).unwrap();
        assert_eq!(library.entries["a"].material.diffuse, [0.5; 3]);
        assert_eq!(
            library.warnings,
            [
                "m.mtl:6: unknown statement `wobble`; it and others like it are ignored",
                "m.mtl:2: textures are ignored (3 lines); surfaces have the plain Kd, Ke and Ks",
            ]
        );
    }
}
