//! The solution file: radiosity and irradiance per element and channel, and how the solver got there.

use crate::atomic_write::Outcome;
use crate::container::{File, Kind, Writer};
use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::provenance::Provenance;
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
        Writer::new(Kind::Solution)
            .section("radiosity", &self.radiosity)
            .section("irradiance", &self.irradiance)
            .section("history", &self.history)
            .write(path, provenance, record)
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
        };
        for (part, values) in [("radiosity", &solution.radiosity), ("irradiance", &solution.irradiance)] {
            if let Some(i) = values.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
                return Err(file.damaged(part, format!("{:?} at {i}", values[i]), "finite values"));
            }
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
