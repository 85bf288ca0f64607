//! The material table: what solving and shading need to know of a scene's materials, and `.surfaces`, the part
//! of it that geometry depends on.

use crate::atomic_write::{self, Outcome};
use crate::container::{File, Kind, Writer, pack_names};
use crate::digest::Digest;
use crate::error::Result;
use crate::provenance::Provenance;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One material, as its MTL file gives it. RGB triples are linear.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Material {
    /// Diffuse reflectance, 0 to 1 (`Kd`).
    pub diffuse: [f64; 3],
    /// Emitted radiance, W m^-2 sr^-1, at least 0 (`Ke`).
    pub radiance: [f64; 3],
    /// Specular reflectance (`Ks`).
    pub specular: [f64; 3],
    /// Transmission filter (`Tf`).
    pub transmission: [f64; 3],
    /// Phong exponent (`Ns`).
    pub exponent: f64,
    /// Index of refraction (`Ni`).
    pub refraction: f64,
    /// Opacity, 0 to 1 (`d`).
    pub opacity: f64,
    /// Roughness, 0 to 1 (`Pr`).
    pub roughness: f64,
    /// Metalness, 0 to 1 (`Pm`).
    pub metalness: f64,
    /// 1 where the scene's toml declares both sides alike, else 0.
    pub two_sided: f64,
}

impl Default for Material {
    /// Black, dark, opaque: what a face without a material is.
    fn default() -> Self {
        Self {
            diffuse: [0.0; 3],
            radiance: [0.0; 3],
            specular: [0.0; 3],
            transmission: [1.0; 3],
            exponent: 0.0,
            refraction: 1.0,
            opacity: 1.0,
            roughness: 0.0,
            metalness: 0.0,
            two_sided: 0.0,
        }
    }
}

impl Material {
    /// Whether any channel emits.
    pub fn emits(&self) -> bool {
        self.radiance.iter().any(|&x| x > 0.0)
    }

    /// Whether both sides emit, reflect and receive.
    pub fn is_two_sided(&self) -> bool {
        self.two_sided != 0.0
    }

    /// Exitance E = pi Ke of the diffuse emitter, W m^-2.
    pub fn exitance(&self) -> [f64; 3] {
        self.radiance.map(|x| std::f64::consts::PI * x)
    }
}

/// The scene's materials, in order of first use.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MaterialTable {
    /// Names, unique.
    pub names: Vec<String>,
    /// Values, one per name.
    pub values: Vec<Material>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Record {
    materials: u32,
}

impl MaterialTable {
    /// The material of this name.
    pub fn get(&self, name: &str) -> Option<&Material> {
        self.names.iter().position(|n| n == name).map(|i| &self.values[i])
    }

    /// Writes the table; an identical file is left alone.
    pub fn write(&self, path: &Path, provenance: Provenance) -> Result<Outcome> {
        let names = pack_names(&self.names);
        let record = Record { materials: self.names.len() as u32 };
        Writer::new(Kind::Materials)
            .section("names", &names)
            .section("values", &self.values)
            .write(path, provenance, record)
    }

    /// Reads and checks a table.
    pub fn read(path: &Path) -> Result<(Self, Provenance, Digest)> {
        let file = File::<Record>::open(path, Kind::Materials)?;
        let count = file.record.materials as usize;
        let names = file.names("names", count)?;
        let values = file.counted_section::<Material>("values", count)?.to_vec();
        for (name, material) in names.iter().zip(&values) {
            let reflectances = material.diffuse.iter().all(|x| (0.0..=1.0).contains(x));
            let radiances = material.radiance.iter().all(|x| x.is_finite() && *x >= 0.0);
            if !reflectances || !radiances {
                let found = format!("material {name}: Kd {:?}, Ke {:?}", material.diffuse, material.radiance);
                return Err(file.damaged("values", found, "Kd within [0, 1], Ke finite and at least 0"));
            }
        }
        let digest = file.digest();
        Ok((Self { names, values }, file.provenance, digest))
    }

    /// The text of `.surfaces`: per material what geometry depends on, one line each, name last.
    pub fn surfaces(&self) -> String {
        let header = "# what geometry depends on: emits|dark one-sided|two-sided material\n".to_owned();
        self.names.iter().zip(&self.values).fold(header, |text, (name, material)| {
            let light = if material.emits() { "emits" } else { "dark" };
            let sides = if material.is_two_sided() { "two-sided" } else { "one-sided" };
            text + &format!("{light} {sides} {name}\n")
        })
    }

    /// Writes `.surfaces`, only where it differs from what is there.
    pub fn write_surfaces(&self, path: &Path) -> Result<Outcome> {
        atomic_write::write_bytes(path, self.surfaces().as_bytes())
    }
}
