//! `formfactor-tool info --row`, `--pair` and `--group`: the factors themselves, read where they lie in the file, with
//! the error that the file states and the flags that made them. Only the blocks that hold them are read, unless all is to be
//! verified.
//!
//! A file states one error per row: the sum over j of |error of F_ij|. It bounds the error of every factor of that row, and
//! the area's mean of it that of a group's factors.

use crate::info::UNVERIFIED;
use anyhow::bail;
use interchange::counted::counted;
use interchange::error::{Error, Result, nearest_name};
use interchange::grouping::{By, Grouping};
use interchange::ids::ElementId;
use interchange::matrix::{Matrix, RowEntry};
use interchange::mesh::Mesh;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Factors of a row that are shown to people.
const SHOWN: usize = 20;

/// What to look at; elements count from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Look {
    /// All factors of an element.
    Row(u32),
    /// The factors between two elements.
    Pair(u32, u32),
    /// The factors between two groups.
    Groups(String, String),
}

/// A matrix with the mesh it was computed for, where that is known.
struct Place {
    matrix: Matrix,
    mesh: Option<Mesh>,
}

/// Tells what was asked for, for people or as JSON. With `verify` the whole matrix is read and checked before.
///
/// # Errors
/// A file cannot be read, or there is no such element or group.
pub fn describe(
    paths: &[impl AsRef<Path>],
    mesh: Option<&Path>,
    look: &Look,
    as_json: bool,
    verify: bool,
) -> anyhow::Result<String> {
    let matrix = if verify { Matrix::open_all(paths)? } else { Matrix::glance_all(paths)? };
    let mesh = match mesh {
        None => None,
        Some(path) => {
            let (mesh, _, digest) = Mesh::read(path)?;
            matrix.belongs_to(path, digest, mesh.element_count())?;
            Some(mesh)
        }
    };
    let place = Place { matrix, mesh };
    Ok(match look {
        Look::Row(element) => place.row(*element, as_json)?,
        Look::Pair(first, second) => place.pair(*first, *second, as_json)?,
        Look::Groups(first, second) => place.groups(first, second, as_json)?,
    })
}

impl Place {
    fn index(&self, element: u32) -> Result<usize> {
        let count = self.matrix.element_count();
        match element as usize {
            i if (1..=count).contains(&i) => Ok(i - 1),
            _ => Err(Error::whole(
                self.matrix.path(),
                format!("there is no element {element}: they count from 1 to {count}"),
            )),
        }
    }

    /// Group and scene's face of an element, where the mesh is known.
    fn name(&self, i: usize) -> String {
        let Some(mesh) = &self.mesh else { return String::new() };
        let element = ElementId::new(i);
        let group = &mesh.groups[mesh.element_group(element).index()];
        format!("{group}, face {}", mesh.element_input(element) + 1)
    }

    fn verified(&self) -> String {
        if self.matrix.is_verified() { "all of it" } else { UNVERIFIED }.to_owned()
    }

    fn made_by(&self) -> String {
        let origin = self.matrix.provenance();
        format!("{} {} {}", origin.tool, origin.version, origin.flags.join(" "))
    }

    fn row(&self, element: u32, as_json: bool) -> Result<String> {
        let i = self.index(element)?;
        let (area, error) = (self.matrix.areas()?[i], self.matrix.row_errors()?[i]);
        let mut row = self.matrix.row(i)?;
        row.retain(|entry| entry.value != 0.0);
        let sum = row.iter().map(|entry| entry.value).sum::<f64>() / area;
        let factor = |entry: &RowEntry| entry.value / area;
        if as_json {
            let factors: Vec<Value> = row.iter().map(|e| json!([e.column + 1, factor(e)])).collect();
            let data = json!({
                "kind": "row", "element": element, "place": self.name(i), "area": area, "row_sum": sum, "row_error": error,
                "made_by": self.made_by(), "verified": self.matrix.is_verified(), "factors": factors,
            });
            return Ok(format!("{data:#}\n"));
        }
        let mut text = Lines::default();
        text.line("element", format!("{element} {}", self.name(i)));
        text.line("area", format!("{area:.6e}"));
        text.line("row sum", format!("{sum:.9}, error at most {error:.3e} as stated"));
        text.line("sees", format!("{} of {} elements", row.len(), self.matrix.element_count()));
        if let Some(mesh) = &self.mesh {
            let grouping = Grouping::new(mesh, By::Group);
            let mut sums = vec![0.0; grouping.len()];
            row.iter().for_each(|e| sums[grouping.key_of_element[e.column] as usize] += factor(e));
            for (label, sum) in grouping.labels.iter().zip(&sums).filter(|(_, sum)| **sum > 0.0) {
                text.line("", format!("{sum:.9} to {label}"));
            }
        }
        row.sort_by(|a, b| b.value.total_cmp(&a.value).then(a.column.cmp(&b.column)));
        for (rank, entry) in row.iter().take(SHOWN).enumerate() {
            let title = if rank == 0 { "most to" } else { "" };
            text.line(
                title,
                format!("{:>7}  {:.9e}  {}", entry.column + 1, factor(entry), self.name(entry.column)),
            );
        }
        if row.len() > SHOWN {
            text.line("", format!("and {} more; --json lists all", row.len() - SHOWN));
        }
        text.line("made by", self.made_by());
        text.line("verified", self.verified());
        Ok(text.0)
    }

    fn pair(&self, first: u32, second: u32, as_json: bool) -> Result<String> {
        let (i, j) = (self.index(first)?, self.index(second)?);
        let (areas, errors) = (self.matrix.areas()?, self.matrix.row_errors()?);
        let find = |i: usize, j: usize| -> Result<Option<RowEntry>> {
            Ok(self.matrix.row(i)?.into_iter().find(|entry| entry.column == j))
        };
        let (forth, back) = (find(i, j)?, find(j, i)?);
        let factor = |entry: Option<RowEntry>, i: usize| entry.map_or(0.0, |e| e.value / areas[i]);
        let stored = match forth.or(back) {
            None => "in no block: zero".to_owned(),
            Some(entry) => {
                format!("{:?} block, {}", entry.kind, self.matrix.record().precision.name()).to_lowercase()
            }
        };
        if as_json {
            let side = |element: u32, i: usize, entry| {
                json!({
                    "element": element, "place": self.name(i), "area": areas[i], "factor": factor(entry, i),
                    "row_error": errors[i],
                })
            };
            let data = json!({
                "kind": "pair", "first": side(first, i, forth), "second": side(second, j, back),
                "exchange": forth.map_or(0.0, |e| e.value), "stored": stored, "made_by": self.made_by(),
                "verified": self.matrix.is_verified(),
            });
            return Ok(format!("{data:#}\n"));
        }
        let mut text = Lines::default();
        for (name, element, other, i, entry) in
            [("first", first, second, i, forth), ("second", second, first, j, back)]
        {
            text.line(name, format!("{element} {}, area {:.6e}", self.name(i), areas[i]));
            let (f, error) = (factor(entry, i), errors[i]);
            text.line(
                "",
                format!("F({element} -> {other}) = {f:.12e}, error at most {error:.3e} (its whole row's)"),
            );
        }
        text.line("exchange", format!("S = {:.12e}", forth.map_or(0.0, |e| e.value)));
        text.line("stored", stored);
        text.line("made by", self.made_by());
        text.line("verified", self.verified());
        Ok(text.0)
    }

    fn groups(&self, first: &str, second: &str, as_json: bool) -> anyhow::Result<String> {
        let Some(mesh) = &self.mesh else { bail!("--group needs --mesh: the matrix alone knows no groups") };
        let number = |name: &str| -> anyhow::Result<u32> {
            if let Some(k) = mesh.groups.iter().position(|group| group == name) {
                return Ok(k as u32);
            }
            let near = nearest_name(name, mesh.groups.iter().map(String::as_str));
            let near = near.map_or_else(
                || format!("the groups are {}", mesh.groups.join(", ")),
                |n| format!("did you mean {n}?"),
            );
            bail!("no group is named {name}; {near}")
        };
        let keys = [number(first)?, number(second)?];
        let grouping = Grouping::new(mesh, By::Group);
        let (areas, errors) = (self.matrix.areas()?, self.matrix.row_errors()?);
        let elements_of = |key: u32| {
            grouping.key_of_element.iter().enumerate().filter(move |(_, k)| **k == key).map(|(i, _)| i)
        };
        let mut sides = Vec::new();
        for (from, to) in [(keys[0], keys[1]), (keys[1], keys[0])] {
            let (mut exchange, mut error, mut area) = (0.0, 0.0, grouping.hidden_areas[from as usize]);
            for i in elements_of(from) {
                let row = self.matrix.row(i)?;
                let reaches = |e: &&RowEntry| grouping.key_of_element[e.column] == to;
                exchange += row.iter().filter(reaches).map(|e| e.value).sum::<f64>();
                error += areas[i] * errors[i];
                area += areas[i];
            }
            // A group of which nothing is left has no factors.
            let share = |x: f64| if area > 0.0 { x / area } else { 0.0 };
            sides.push((area, share(exchange), share(error), elements_of(from).count()));
        }
        if as_json {
            let side = |name: &str, (area, factor, error, elements): &(f64, f64, f64, usize)| json!({ "group": name, "elements": elements, "area": area, "factor": factor, "error": error });
            let data = json!({
                "kind": "groups", "first": side(first, &sides[0]), "second": side(second, &sides[1]),
                "made_by": self.made_by(), "verified": self.matrix.is_verified(),
            });
            return Ok(format!("{data:#}\n"));
        }
        let mut text = Lines::default();
        for (name, from, to, (area, factor, error, elements)) in
            [("first", first, second, sides[0]), ("second", second, first, sides[1])]
        {
            text.line(name, format!("{from}: {}, area {area:.6e}", counted(elements, "element", "elements")));
            text.line("", format!("F({from} -> {to}) = {factor:.12e}, error at most {error:.3e}"));
        }
        text.line("made by", self.made_by());
        text.line("verified", self.verified());
        Ok(text.0)
    }
}

/// Lines with a title.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, name: &str, value: String) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{name:<12} {}", value.trim_end());
    }
}
