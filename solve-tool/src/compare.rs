//! `solve-tool compare`: by how much two solutions differ, where most, in W m^-2 and relative to the light there is.
//!
//! Solutions on one mesh are compared element by element unless asked otherwise, solutions on two meshes of a scene by the
//! scene's groups or faces: their area-weighted means.

use crate::channels::CHANNEL_NAMES;
use anyhow::bail;
use interchange::error::Error;
use interchange::grouping::{By, Grouping};
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What `compare` is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Two solutions.
    pub solutions: [PathBuf; 2],
    /// Their meshes, which may be one.
    pub meshes: [PathBuf; 2],
    /// What is compared; by default elements where both have one mesh, else groups.
    pub by: Option<By>,
}

/// One of the two quantities of a key in one channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Place {
    key: usize,
    channel: usize,
    first: f64,
    second: f64,
}

impl Place {
    /// |difference|, W m^-2.
    pub fn difference(&self) -> f64 {
        (self.first - self.second).abs()
    }
}

/// Differences of B or of H.
#[derive(Debug, Clone, Default)]
pub struct Quantity {
    /// Sum of A |difference| over the sum of A times the first, per channel; 0 where both are dark.
    pub relative: [f64; 3],
    /// Root of the area's mean of the squared difference, W m^-2, per channel.
    pub rms: [f64; 3],
    /// Where most.
    pub worst: Place,
}

/// How two solutions differ.
#[derive(Debug)]
pub struct Difference {
    solutions: [Solution; 2],
    request: Request,
    title: &'static str,
    labels: Vec<String>,
    /// Radiosity B.
    pub radiosity: Quantity,
    /// Irradiance H.
    pub irradiance: Quantity,
}

/// Area and mean colours of each key.
struct Means {
    areas: Vec<f64>,
    values: [Vec<[f64; 3]>; 2],
}

impl Means {
    fn new(mesh: &Mesh, grouping: &Grouping, solution: &Solution) -> Self {
        let element: Vec<f64> =
            mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
        let sums = grouping.sums(|i| element[i]);
        let areas: Vec<f64> = sums.iter().zip(&grouping.hidden_areas).map(|(a, hidden)| a + hidden).collect();
        let of = |values: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let channels = [0, 1, 2].map(|c| grouping.sums(|i| element[i] * values[i][c]));
            let mean = |key: usize| {
                channels.each_ref().map(|sums| if areas[key] > 0.0 { sums[key] / areas[key] } else { 0.0 })
            };
            (0..grouping.len()).map(mean).collect()
        };
        let values = [of(&solution.radiosity), of(&solution.irradiance)];
        Self { areas, values }
    }
}

impl Difference {
    /// Compares two solutions.
    ///
    /// # Errors
    /// A file cannot be read, a solution is not of its mesh, or the meshes have other groups or faces.
    pub fn between(request: Request) -> interchange::Result<Self> {
        let read = |k: usize| -> interchange::Result<_> {
            let (mesh, _, digest) = Mesh::read(&request.meshes[k])?;
            let (solution, _, origins, _) = Solution::read(&request.solutions[k])?;
            Solution::belongs_to(&request.solutions[k], &origins, &request.meshes[k], digest)?;
            Ok((mesh, digest, solution))
        };
        let (first_mesh, first_digest, first) = read(0)?;
        let (second_mesh, second_digest, second) = read(1)?;
        let same = first_digest == second_digest;
        let by = request.by.unwrap_or(if same { By::Element } else { By::Group });
        let groupings = [Grouping::new(&first_mesh, by), Grouping::new(&second_mesh, by)];
        if groupings[0].labels != groupings[1].labels || (by == By::Element && !same) {
            let title = groupings[0].title;
            return Err(Error::Mismatch {
                first: request.meshes[0].clone(),
                second: request.meshes[1].clone(),
                detail: format!("their {title}s are not the same"),
                remedy: "compare by another --by, or solutions of one scene".into(),
            });
        }
        let means = [
            Means::new(&first_mesh, &groupings[0], &first),
            Means::new(&second_mesh, &groupings[1], &second),
        ];
        let [radiosity, irradiance] =
            [0, 1].map(|q| quantity(&means[0].areas, &means[0].values[q], &means[1].values[q]));
        let [Grouping { title, labels, .. }, _] = groupings;
        Ok(Self { solutions: [first, second], request, title, labels, radiosity, irradiance })
    }

    /// The largest relative difference of radiosity in any channel.
    pub fn relative(&self) -> f64 {
        self.radiosity.relative.iter().copied().fold(0.0, f64::max)
    }

    /// Refuses a relative difference of radiosity above `most`.
    ///
    /// # Errors
    /// Says both numbers and the worst place.
    pub fn check(&self, most: Option<f64>) -> anyhow::Result<()> {
        match most {
            Some(most) if self.relative() > most => bail!(
                "radiosity differs by {:.3e} of all light, above --max {most:e}; most at {}",
                self.relative(),
                self.place(&self.radiosity.worst)
            ),
            _ => Ok(()),
        }
    }

    fn place(&self, place: &Place) -> String {
        format!("{} {}, {}", self.title, self.labels[place.key], CHANNEL_NAMES[place.channel])
    }

    /// The comparison on one page, or as JSON.
    pub fn describe(&self, as_json: bool) -> String {
        let quantities = [("B", &self.radiosity), ("H", &self.irradiance)];
        if as_json {
            let of = |q: &Quantity| {
                json!({
                    "relative": q.relative, "rms": q.rms,
                    "worst": {
                        "difference": q.worst.difference(), "first": q.worst.first, "second": q.worst.second,
                        self.title: self.labels[q.worst.key], "channel": CHANNEL_NAMES[q.worst.channel],
                    },
                })
            };
            let side = |k: usize| -> Value {
                let summary = &self.solutions[k].summary;
                json!({ "solver": summary.solver, "tolerance": summary.tolerance, "achieved": summary.achieved })
            };
            let data = json!({
                "kind": "solution comparison", "by": self.title, "count": self.labels.len(),
                "radiosity": of(&self.radiosity), "irradiance": of(&self.irradiance),
                "first": side(0), "second": side(1),
            });
            return format!("{data:#}\n");
        }
        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<12} {value}");
        };
        line("compared", format!("{} {}s", self.labels.len(), self.title));
        for (name, q) in quantities {
            for (c, channel) in CHANNEL_NAMES.iter().enumerate() {
                let title = if c == 0 { name } else { "" };
                line(
                    title,
                    format!("{channel}: {:.6e} of all light, RMS {:.6e} W m^-2", q.relative[c], q.rms[c]),
                );
            }
            let worst = &q.worst;
            if worst.difference() > 0.0 {
                line(
                    "",
                    format!(
                        "worst {:.6e} W m^-2: {:.6e} and {:.6e}, at {}",
                        worst.difference(),
                        worst.first,
                        worst.second,
                        self.place(worst)
                    ),
                );
            }
        }
        for (k, name) in ["first", "second"].iter().enumerate() {
            let summary = &self.solutions[k].summary;
            let path = file_name(&self.request.solutions[k]);
            line(
                name,
                format!("{path}: {}, bound {:.2e} of the emitted power", summary.solver, summary.achieved),
            );
        }
        text
    }
}

fn file_name(path: &Path) -> String {
    path.display().to_string()
}

/// Means over the areas of the first; those of the second are the same scene's.
fn quantity(areas: &[f64], first: &[[f64; 3]], second: &[[f64; 3]]) -> Quantity {
    let mut found = Quantity::default();
    let total: f64 = areas.iter().sum();
    for channel in 0..3 {
        let (mut differs, mut light, mut squares) = (0.0, 0.0, 0.0);
        for (key, area) in areas.iter().enumerate() {
            let place = Place { key, channel, first: first[key][channel], second: second[key][channel] };
            let difference = place.difference();
            differs += area * difference;
            light += area * place.first;
            squares += area * difference * difference;
            if difference > found.worst.difference() {
                found.worst = place;
            }
        }
        found.relative[channel] = if differs == 0.0 { 0.0 } else { differs / light };
        found.rms[channel] = (squares / total).sqrt();
    }
    found
}
