//! `formfactor-tool compare`: by how much two matrices of one mesh differ, where most, and whether their stated errors
//! account for it.

use crate::export::Factors;
use crate::info::Spread;
use anyhow::bail;
use interchange::counted::counted;
use interchange::error::{Error, Result};
use interchange::grouping::Grouping;
use interchange::ids::ElementId;
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::tool::progress;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// One entry in both matrices.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Entry {
    /// Emitting element, from 0.
    pub from: usize,
    /// Receiving element, from 0.
    pub to: usize,
    /// F in the first matrix.
    pub first: f64,
    /// F in the second matrix.
    pub second: f64,
}

impl Entry {
    /// |difference|.
    pub fn absolute(&self) -> f64 {
        (self.first - self.second).abs()
    }

    /// |difference| in units of the larger of both; 0 where both are 0.
    pub fn relative(&self) -> f64 {
        let larger = self.first.max(self.second);
        if larger > 0.0 { self.absolute() / larger } else { 0.0 }
    }
}

/// How two matrices differ.
#[derive(Debug)]
pub struct Difference {
    sides: [Matrix; 2],
    mesh: Option<Mesh>,
    /// Sum over j of |dF_ij| per row.
    pub rows: Vec<f64>,
    /// The entry that differs most.
    pub absolute: Entry,
    /// The entry that differs most in units of itself.
    pub relative: Entry,
}

impl Difference {
    /// Compares the matrices of two files; `mesh` names the places.
    ///
    /// # Errors
    /// A file cannot be read, or they do not belong to one mesh.
    pub fn between(first: &Path, second: &Path, mesh: Option<&Path>) -> Result<Self> {
        let sides = [Matrix::open(first)?, Matrix::open(second)?];
        let count = sides[0].element_count();
        let meshes = sides.each_ref().map(|side| side.record().mesh);
        if meshes[0] != meshes[1] {
            let detail = format!(
                "the first is of mesh {} with {count} elements, the second of mesh {} with {}",
                meshes[0].short(),
                meshes[1].short(),
                sides[1].element_count()
            );
            let remedy = "compute both from one mesh file".into();
            return Err(Error::Mismatch { first: first.into(), second: second.into(), detail, remedy });
        }
        let mesh = match mesh {
            None => None,
            Some(path) => {
                let (mesh, _, digest) = Mesh::read(path)?;
                sides[0].belongs_to(path, digest, mesh.element_count())?;
                Some(mesh)
            }
        };

        // Row by row: neither matrix is unpacked whole.
        let elements = Grouping {
            title: "element",
            labels: vec![String::new(); count],
            key_of_element: (0..count as u32).collect(),
            hidden_areas: vec![0.0; count],
        };
        let factors = [Factors::new(&sides[0], &elements)?, Factors::new(&sides[1], &elements)?];
        let mut rows = Vec::with_capacity(count);
        let (mut absolute, mut relative) = (Entry::default(), Entry::default());
        let pairs = factors[0].rows().zip(factors[1].rows());
        for ((from, a), (_, b)) in progress("compare", count).wrap_iter(pairs) {
            let mut sum = 0.0;
            for (to, (&first, &second)) in a.iter().zip(&b).enumerate() {
                let entry = Entry { from, to, first, second };
                sum += entry.absolute();
                if entry.absolute() > absolute.absolute() {
                    absolute = entry;
                }
                if entry.relative() > relative.relative() {
                    relative = entry;
                }
            }
            rows.push(sum);
        }
        drop(factors);
        Ok(Self { sides, mesh, rows, absolute, relative })
    }

    /// Row that differs most, and by how much.
    pub fn worst_row(&self) -> (usize, f64) {
        let larger = |best: (usize, f64), (i, &d): (usize, &f64)| if d > best.1 { (i, d) } else { best };
        self.rows.iter().enumerate().fold((0, 0.0), larger)
    }

    /// Refuses a difference of any row above `most`.
    pub fn check(&self, most: Option<f64>) -> anyhow::Result<()> {
        let (row, worst) = self.worst_row();
        match most {
            Some(most) if worst > most => {
                bail!("row of {}: the difference is {worst:.3e}, above --max {most:e}", self.place(row))
            }
            _ => Ok(()),
        }
    }

    /// Per row the difference in units of the errors the two files state: above 1 where one of them states too little.
    /// Infinite where neither states any.
    fn shares(&self) -> Result<Vec<f64>> {
        let errors = [self.sides[0].row_errors()?, self.sides[1].row_errors()?];
        let stated = errors[0].iter().zip(errors[1]).map(|(a, b)| a + b);
        let share = |(&difference, stated): (&f64, f64)| {
            if difference == 0.0 { 0.0 } else { difference / stated }
        };
        Ok(self.rows.iter().zip(stated).map(share).collect())
    }

    /// Element as people count, with face and group where the mesh is known.
    fn place(&self, element: usize) -> String {
        let mut text = format!("element {}", element + 1);
        if let Some(mesh) = &self.mesh {
            let (face, group) = names(mesh, element);
            // Writing to a string cannot fail.
            let _ = write!(text, " (face {face}, group {group})");
        }
        text
    }

    fn place_json(&self, element: usize) -> Value {
        match &self.mesh {
            None => json!({ "element": element + 1 }),
            Some(mesh) => {
                let (face, group) = names(mesh, element);
                json!({ "element": element + 1, "face": face, "group": group })
            }
        }
    }

    /// The comparison on one page, or as JSON.
    pub fn describe(&self, as_json: bool) -> Result<String> {
        let (worst, worst_difference) = self.worst_row();
        let rows = Spread::of(&self.rows);
        let shares = self.shares()?;
        let beyond = shares.iter().filter(|&&share| share > 1.0).count();
        let share = shares.iter().copied().fold(0.0, f64::max);
        if as_json {
            let entry = |e: &Entry| {
                json!({
                    "absolute": e.absolute(), "relative": e.relative(), "first": e.first, "second": e.second,
                    "from": self.place_json(e.from), "to": self.place_json(e.to),
                })
            };
            let data = json!({
                "kind": "matrix comparison",
                "elements": self.rows.len(),
                "mesh": self.sides[0].record().mesh.to_string(),
                "row_difference": { "worst": worst_difference, "mean": rows.mean, "at": self.place_json(worst) },
                "largest_absolute_entry": entry(&self.absolute),
                "largest_relative_entry": entry(&self.relative),
                "rows_beyond_stated_errors": beyond,
                "largest_difference_over_stated_errors": share.is_finite().then_some(share),
                "first": side_json(&self.sides[0])?,
                "second": side_json(&self.sides[1])?,
            });
            return Ok(format!("{data:#}\n"));
        }

        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<12} {value}");
        };
        line("elements", self.rows.len().to_string());
        let at =
            if worst_difference > 0.0 { format!(", worst at {}", self.place(worst)) } else { String::new() };
        let words = format!("{worst_difference:.6e} worst, {:.6e} mean{at}", rows.mean);
        line("row differs", words);
        for (name, entry) in [("absolute", &self.absolute), ("relative", &self.relative)] {
            if entry.absolute() == 0.0 {
                line(name, "no entry differs".into());
                continue;
            }
            let value = if name == "absolute" { entry.absolute() } else { entry.relative() };
            let places = format!("{} to {}", self.place(entry.from), self.place(entry.to));
            let both = format!("{:.6e} and {:.6e}", entry.first, entry.second);
            line(name, format!("{value:.6e} at most: {both}, from {places}"));
        }
        line(
            "accounted",
            format!(
                "{share:.3} of the stated row errors at most; {} beyond them",
                counted(beyond, "row", "rows")
            ),
        );
        for (name, side) in ["first", "second"].iter().zip(&self.sides) {
            line(name, format!("{} ({})", side.path().display(), side.digest().short()));
            line(
                "",
                format!("tolerance {:e}, {}", side.record().tolerance, side.provenance().flags.join(" ")),
            );
            line("", format!("row errors {}", Spread::of(side.row_errors()?).text()));
            line("", format!("row sums   {}", Spread::of(&side.row_sums()?).text()));
        }
        Ok(text)
    }
}

fn names(mesh: &Mesh, element: usize) -> (u32, &str) {
    let element = ElementId(element as u32);
    let face = mesh.face_inputs[mesh.element_face(element).index()];
    (face + 1, &mesh.groups[mesh.element_group(element).0 as usize])
}

fn side_json(side: &Matrix) -> Result<Value> {
    Ok(json!({
        "digest": side.digest().to_string(),
        "tolerance": side.record().tolerance,
        "flags": side.provenance().flags,
        "row_errors": Spread::of(side.row_errors()?).json(),
        "row_sums": Spread::of(&side.row_sums()?).json(),
    }))
}
