//! Radiance scene description (`.rad`): polygons with `plastic` and `light` materials, or, where the surface has its own
//! brightness, each with a `glow` of its own, which `rpict -ab 0` shows without any further light.

use super::{Surface, word};
use crate::atomic_write::{self, Outcome};
use crate::error::Result;
use crate::tables::number;
use std::path::Path;

/// Writes a surface; an identical file is left alone.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    atomic_write::write(path, |out| {
        for comment in &surface.comments {
            writeln!(out, "# {}", comment.replace(['\n', '\r'], " "))?;
        }
        if surface.radiances.is_none() {
            for (name, material) in &surface.materials {
                let name = word(name);
                // A material either reflects or emits here; a lamp's reflectance is lost.
                match material.emits() {
                    true => writeln!(out, "void light {name}\n0\n0\n3 {}", triple(material.radiance))?,
                    false => writeln!(out, "void plastic {name}\n0\n0\n5 {} 0 0", triple(material.diffuse))?,
                }
            }
        }
        for (i, polygon) in surface.polygons.rows().enumerate() {
            let group = word(&surface.groups[surface.polygon_groups[i] as usize]);
            let material = match &surface.radiances {
                None => word(&surface.materials[surface.polygon_materials[i] as usize].0),
                Some(radiances) => {
                    // Radius 0: seen, but no source of light for others.
                    writeln!(out, "void glow glow.{}\n0\n0\n4 {} 0", i + 1, triple(radiances[i]))?;
                    format!("glow.{}", i + 1)
                }
            };
            writeln!(out, "{material} polygon {group}.{}\n0\n0\n{}", i + 1, 3 * polygon.len())?;
            for &point in polygon {
                writeln!(out, "  {}", triple(surface.points[point as usize]))?;
            }
        }
        Ok(())
    })
}

fn triple(values: [f64; 3]) -> String {
    values.map(number).join(" ")
}
