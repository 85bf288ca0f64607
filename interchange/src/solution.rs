//! The solution file: radiosity and irradiance per element and channel, and how the solver got there.

use crate::atomic_write::Outcome;
use crate::container::{File, Kind, Writer};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::provenance::Provenance;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Radiosity B and irradiance H of every element, RGB, W m^-2.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solution {
    /// Radiosity B = E + rho H.
    pub radiosity: Vec<[f64; 3]>,
    /// Irradiance H = sum over j of F_ij B_j.
    pub irradiance: Vec<[f64; 3]>,
    /// Bound on the power-norm error relative to the emitted power, after each product with the matrix.
    pub history: Vec<[f64; 3]>,
    /// What the header says of the run.
    pub summary: Summary,
    /// What not every solution has.
    pub details: Details,
}

/// What not every solution has: optional sections.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Details {
    /// Exitance E.
    pub exitance: Option<Vec<[f64; 3]>>,
    /// Sum over j of F_ij of the matrix: 1 less the share of what leaves the element that escapes.
    pub row_sums: Option<Vec<f64>>,
    /// Snapshots: radiosity that has arrived and was not yet sent on.
    pub unshot: Option<Vec<[f64; 3]>>,
    /// Snapshots: irradiance that was added everywhere for what the unshot radiosity will still do.
    pub ambient: Option<[f64; 3]>,
    /// Lower and upper bound of each radiosity; the upper one may be infinite.
    pub bounds: Option<[Vec<[f64; 3]>; 2]>,
    /// What each element contributes to the error of all radiosities, W, all channels: by errors of the matrix, by the
    /// solver, by the radiosity's being constant over it.
    pub element_errors: Option<Vec<[f64; 3]>>,
    /// Elements by what they contribute in all, the worst first.
    pub error_ranking: Option<Vec<u32>>,
    /// The links that contribute most by errors of the matrix, the worst first.
    pub error_links: Option<Vec<ErrorLink>>,
    /// Temperature, K, and emissivity of each element, where the solution is one of heat.
    pub thermal: Option<Vec<[f64; 2]>>,
}

/// A pair of elements and what the error of the factor between them contributes to the error of all radiosities, W.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ErrorLink {
    /// The element with the lower number.
    pub first: u32,
    /// The other.
    pub second: u32,
    /// Contribution.
    pub error: f64,
}

/// What the header says of the run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Method that solved the system.
    pub solver: String,
    /// Asked bound.
    pub tolerance: f64,
    /// Bound that was reached, worst channel.
    pub achieved: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Record {
    elements: u32,
    mesh: Digest,
    matrix: Digest,
    materials: Digest,
    summary: Summary,
}

/// Identities of the three files a solution was computed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origins {
    /// The mesh.
    pub mesh: Digest,
    /// The matrix.
    pub matrix: Digest,
    /// The material table.
    pub materials: Digest,
}

impl Details {
    fn read<R>(file: &File<R>, count: usize) -> Result<Self> {
        let colours = |name: &str| -> Result<Option<Vec<[f64; 3]>>> {
            let values = optional(file, name, count)?;
            values.iter().try_for_each(|values| check_finite(file, name, values))?;
            Ok(values)
        };
        let upper: Option<Vec<[f64; 3]>> = optional(file, "upper", count)?;
        if let Some(i) = upper.iter().flatten().position(|v| v.iter().any(|x| x.is_nan())) {
            return Err(file.damaged("upper", format!("NaN at {i}"), "numbers"));
        }
        let bounds = match (colours("lower")?, upper) {
            (Some(lower), Some(upper)) => Some([lower, upper]),
            (None, None) => None,
            _ => return Err(file.damaged("lower", "one bound alone", "lower and upper bounds")),
        };
        let ranking: Option<Vec<u32>> = optional(file, "error_ranking", count)?;
        let links: Option<Vec<ErrorLink>> = match file.has("error_links") {
            true => Some(file.section("error_links")?.to_vec()),
            false => None,
        };
        let known = |i: u32| (i as usize) < count;
        if let Some(i) = ranking.iter().flatten().position(|&i| !known(i)) {
            return Err(file.damaged(
                "error_ranking",
                format!("no element at {i}"),
                format!("below {count}"),
            ));
        }
        if let Some(i) = links.iter().flatten().position(|l| !(known(l.first) && known(l.second))) {
            return Err(file.damaged("error_links", format!("no element at {i}"), format!("below {count}")));
        }
        let ambient: Option<Vec<[f64; 3]>> = optional(file, "ambient", 1)?;
        Ok(Self {
            exitance: colours("exitance")?,
            row_sums: optional(file, "row_sums", count)?,
            unshot: colours("unshot")?,
            ambient: ambient.map(|ambient| ambient[0]),
            bounds,
            element_errors: optional(file, "element_errors", count)?,
            error_ranking: ranking,
            error_links: links,
            thermal: optional(file, "thermal", count)?,
        })
    }
}

/// The values of a section of `count` items, where it is there.
fn optional<T: bytemuck::AnyBitPattern, R>(
    file: &File<R>,
    name: &str,
    count: usize,
) -> Result<Option<Vec<T>>> {
    file.has(name).then(|| file.counted_section(name, count).map(<[T]>::to_vec)).transpose()
}

fn check_finite<R>(file: &File<R>, part: &str, values: &[[f64; 3]]) -> Result<()> {
    match values.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
        Some(i) => Err(file.damaged(part, format!("{:?} at {i}", values[i]), "finite values")),
        None => Ok(()),
    }
}

impl Solution {
    /// Writes the solution; an identical file is left alone.
    pub fn write(&self, path: &Path, provenance: Provenance, origins: Origins) -> Result<Outcome> {
        let record = Record {
            elements: self.radiosity.len() as u32,
            mesh: origins.mesh,
            matrix: origins.matrix,
            materials: origins.materials,
            summary: self.summary.clone(),
        };
        let mut writer = Writer::new(Kind::Solution)
            .section("radiosity", &self.radiosity)
            .section("irradiance", &self.irradiance)
            .section("history", &self.history);
        let details = &self.details;
        let [lower, upper] = match &details.bounds {
            Some([lower, upper]) => [Some(lower), Some(upper)],
            None => [None, None],
        };
        for (name, values) in [
            ("exitance", details.exitance.as_ref()),
            ("unshot", details.unshot.as_ref()),
            ("lower", lower),
            ("upper", upper),
            ("element_errors", details.element_errors.as_ref()),
        ] {
            if let Some(values) = values {
                writer = writer.section(name, values);
            }
        }
        if let Some(ambient) = &details.ambient {
            writer = writer.section("ambient", std::slice::from_ref(ambient));
        }
        if let Some(row_sums) = &details.row_sums {
            writer = writer.section("row_sums", row_sums);
        }
        if let Some(ranking) = &details.error_ranking {
            writer = writer.section("error_ranking", ranking);
        }
        if let Some(links) = &details.error_links {
            writer = writer.section("error_links", links);
        }
        if let Some(thermal) = &details.thermal {
            writer = writer.section("thermal", thermal);
        }
        writer.write(path, provenance, record)
    }

    /// Reads and checks a solution.
    pub fn read(path: &Path) -> Result<(Solution, Provenance, Origins, Digest)> {
        let file = File::<Record>::open(path, Kind::Solution)?;
        let record = file.record.clone();
        let count = record.elements as usize;
        let solution = Solution {
            radiosity: file.counted_section("radiosity", count)?.to_vec(),
            irradiance: file.counted_section("irradiance", count)?.to_vec(),
            history: file.section("history")?.to_vec(),
            summary: record.summary,
            details: Details::read(&file, count)?,
        };
        for (part, values) in [("radiosity", &solution.radiosity), ("irradiance", &solution.irradiance)] {
            check_finite(&file, part, values)?;
        }
        let digest = file.digest();
        let origins = Origins { mesh: record.mesh, matrix: record.matrix, materials: record.materials };
        Ok((solution, file.provenance, origins, digest))
    }

    /// Refuses a solution that was not computed on the mesh with this digest.
    pub fn belongs_to(path: &Path, origins: &Origins, mesh_path: &Path, mesh: Digest) -> Result<()> {
        if origins.mesh == mesh {
            return Ok(());
        }
        let detail =
            format!("the solution is for mesh {}, this one is {}", origins.mesh.short(), mesh.short());
        let remedy = "run formfactor-tool compute and solve-tool solve on this mesh".into();
        Err(Error::Mismatch { first: path.into(), second: mesh_path.into(), detail, remedy })
    }
}
