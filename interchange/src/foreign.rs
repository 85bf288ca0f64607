//! Geometry as other programs read and write it: PLY, VTK XML, glTF, OBJ, Radiance, View3D.
//!
//! Everything passes through a [`Surface`]: polygons with values at their corners and on themselves. A mesh becomes one,
//! a solution adds its fields, and each format is one file here that writes it, some that also read it.
//!
//! | ending | what is kept | numbers |
//! |---|---|---|
//! | `.ply` | all fields; colours as sRGB bytes | 17 digits |
//! | `.vtu` | all fields; colours linear | f64, base64 |
//! | `.glb` | fields of the points, colours linear; one node per group | f32 (all that glTF has) |
//! | `.obj` | groups, materials (`.mtl` beside it), colours after the coordinates | 17 digits |
//! | `.rad` | materials, or with colours each polygon's own glow | 17 digits |
//! | `.vs3` | triangles and quadrilaterals, groups, emittances | 17 digits |

pub mod base64;
pub mod glb;
pub mod obj;
pub mod ply;
pub mod radiance;
pub mod radiance_scene;
mod surface;
pub mod view3d;
pub mod view3d_scene;
pub mod vtu;

pub use surface::{Field, Surface, Values};

use crate::atomic_write::{Outcome, is_stdout};
use crate::error::{Error, Result, meant_ending};
use clap::ValueEnum;
use std::path::Path;

/// What the end of a file name asks for, or a flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Polygon file format, binary.
    Ply,
    /// VTK unstructured grid in XML.
    Vtu,
    /// glTF 2.0 in one binary file.
    Glb,
    /// Wavefront OBJ with its MTL.
    Obj,
    /// Radiance scene description.
    Rad,
    /// View3D input.
    Vs3,
}

/// Endings of the formats that can be written.
const ENDINGS: [(&str, Format); 6] = [
    ("ply", Format::Ply),
    ("vtu", Format::Vtu),
    ("glb", Format::Glb),
    ("obj", Format::Obj),
    ("rad", Format::Rad),
    ("vs3", Format::Vs3),
];

impl Format {
    /// The format that the name's ending asks for, if it is one of geometry.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_lowercase();
        ENDINGS.iter().find(|(name, _)| *name == ending).map(|(_, format)| *format)
    }

    /// As [`Format::of`]; an ending that is none is an error that lists all.
    pub fn required(path: &Path) -> Result<Self> {
        Self::of(path).ok_or_else(|| {
            let names: Vec<String> = ENDINGS.iter().map(|(name, _)| format!(".{name}")).collect();
            let meant = meant_ending(path, ENDINGS.map(|(name, _)| name));
            let names = names.join(", ");
            let message =
                format!("the name must end in {names}, which says the format{meant}; or say --format");
            Error::whole(path, message)
        })
    }

    /// The format asked for, or else as [`Format::required`].
    ///
    /// # Errors
    /// The ending is none of the formats, or standard output cannot take this one.
    pub fn asked_or(path: &Path, asked: Option<Self>) -> Result<Self> {
        let format = asked.map_or_else(|| Self::required(path), Ok)?;
        if format == Self::Obj && is_stdout(path) {
            let message = "an OBJ has its materials in a file beside it; give a name that ends in .obj";
            return Err(Error::whole(path, message));
        }
        Ok(format)
    }
}

/// Writes a surface in the format that is asked for, or else that the name asks for.
///
/// # Errors
/// As [`Format::asked_or`], or the file cannot be written.
pub fn write(path: &Path, surface: &Surface, asked: Option<Format>) -> Result<Outcome> {
    match Format::asked_or(path, asked)? {
        Format::Ply => ply::write(path, surface),
        Format::Vtu => vtu::write(path, surface),
        Format::Glb => glb::write(path, surface),
        Format::Obj => obj::write(path, surface),
        Format::Rad => radiance::write(path, surface),
        Format::Vs3 => view3d::write(path, surface),
    }
}

/// Reads a scene that another program describes, with what could not be taken over said in the second part.
///
/// # Errors
/// The ending is neither `.vs3` nor `.rad`, or the file is not what it should be: its line is named.
pub fn read_scene(path: &Path) -> Result<(Surface, Vec<String>)> {
    match Format::of(path) {
        Some(Format::Vs3) => view3d_scene::read(path),
        Some(Format::Rad) => radiance_scene::read(path),
        Some(Format::Obj) => Err(Error::whole(path, "mesh-tool build reads OBJ as it is")),
        _ => Err(Error::whole(
            path,
            format!(
                "the name must end in .vs3 (View3D) or .rad (Radiance), which says the format{}",
                meant_ending(path, ["vs3", "rad"])
            ),
        )),
    }
}

/// Words of a text that other programs split at white space: a name as one word.
fn word(name: &str) -> String {
    let word: String =
        name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    if word.is_empty() { "_".into() } else { word }
}

/// Encoding of IEC 61966-2-1 of a linear value within [0, 1].
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
