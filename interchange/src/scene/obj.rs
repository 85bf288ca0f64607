//! The scene reader: scan, geometry, materials and settings brought together.

use super::material_files;
use super::mtl::Library;
use super::obj_scan::{self, Scan};
use super::settings::Located;
use super::statement::{decode, shown};
use super::{NONE, Scene, SceneFace, polygons};
use crate::counted::counted;
use crate::digest::Digest;
use crate::error::{Error, Result, nearest_name};
use crate::ids::{GroupId, MaterialId};
use crate::materials::{Material, MaterialTable};
use std::collections::HashSet;
use std::path::Path;

/// Rounding of a sum of two written decimals: 0.35 + 0.65 may come out one ulp above 1.
const SUM_ROUNDING: f64 = 2.0 * f64::EPSILON;

/// How many defined materials an error lists where none is close to the wanted name.
const NAMES_LISTED: usize = 8;

/// Reads the scene of `path`, with the materials named in `two_sided` two-sided besides those of the toml.
pub(super) fn read(path: &Path, two_sided: &[String]) -> Result<Scene> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let scan = obj_scan::scan(path, decode(path, &bytes)?)?;
    let geometry = polygons::read(path, &scan)?;

    let material_files = material_files::locate(path, &scan.libraries)?;
    let mut library = Library::default();
    material_files.iter().try_for_each(|file| library.read(file))?;
    check_names(path, &scan, &library)?;

    let toml = path.with_extension("toml");
    let located = if toml.is_file() { Located::read(&toml)? } else { Located::default() };
    let mut lines = located.settings.two_sided.iter().zip(&located.two_sided_lines);
    if let Some((name, line)) = lines.find(|(name, _)| !is_known(name, &library)) {
        let message = format!("two_sided names material {}, {}", shown(name), unknown(name, &library));
        return Err(Error::scene(&toml, *line, message));
    }
    if let Some(name) = two_sided.iter().find(|name| !is_known(name, &library)) {
        let message =
            format!("two-sided material {} was asked for, {}", shown(name), unknown(name, &library));
        return Err(Error::whole(path, message));
    }

    let attributes = scan.faces.iter().zip(geometry.faces);
    let faces = attributes.map(|(face, corners)| SceneFace {
        corners,
        group: GroupId(face.group),
        material: MaterialId(face.material),
        line: face.line,
    });
    let faces = faces.collect();
    let marked: HashSet<&String> = located.settings.two_sided.iter().chain(two_sided).collect();
    let values = scan.materials.iter().map(|name| Material {
        two_sided: if marked.contains(name) { 1.0 } else { 0.0 },
        ..library.entries.get(name).map(|entry| entry.material).unwrap_or_default()
    });
    let values = values.collect();
    let mut warnings = scan.warnings;
    warnings.extend(bright_materials(&scan.materials, &library));
    warnings.append(&mut library.warnings);
    Ok(Scene {
        path: path.to_owned(),
        digest: Digest::of(&bytes),
        material_files,
        vertices: geometry.vertices,
        faces,
        groups: scan.groups,
        materials: MaterialTable { names: scan.materials, values },
        settings: located.settings,
        warnings,
    })
}

/// Whether a face may have the material.
fn is_known(name: &str, library: &Library) -> bool {
    name == NONE || library.entries.contains_key(name)
}

/// Refuses the first `usemtl` whose name no file defines.
fn check_names(path: &Path, scan: &Scan, library: &Library) -> Result<()> {
    let Some((name, line)) = scan.named_materials.iter().find(|(name, _)| !is_known(name, library)) else {
        return Ok(());
    };
    let message = if scan.libraries.is_empty() {
        format!("usemtl {}, but no mtllib line names a material file; add one", shown(name))
    } else {
        format!("usemtl {}, {}", shown(name), unknown(name, library))
    };
    Err(Error::scene(path, *line, message))
}

/// Second half of the message about an unknown name: what there is instead.
fn unknown(name: &str, library: &Library) -> String {
    let mut names: Vec<&str> = library.entries.keys().map(String::as_str).collect();
    names.sort_unstable();
    let remedy = match nearest_name(name, names.iter().copied()) {
        Some(near) => format!("did you mean {}?", shown(near)),
        None if names.is_empty() => "there are no materials".to_owned(),
        None => {
            let listed: Vec<String> = names.iter().take(NAMES_LISTED).map(|name| shown(name)).collect();
            let more = if names.len() > NAMES_LISTED { ", ..." } else { "" };
            format!("there are {}{more}", listed.join(", "))
        }
    };
    format!("which no material file defines; {remedy}")
}

/// One warning about the used materials that reflect more than they receive once the specular part counts.
fn bright_materials(used: &[String], library: &Library) -> Option<String> {
    let entries = used.iter().filter_map(|name| library.entries.get(name).map(|entry| (name, entry)));
    let bright = |material: &Material| {
        let sums = material.diffuse.iter().zip(&material.specular).map(|(kd, ks)| kd + ks);
        sums.into_iter().any(|sum| sum > 1.0 + SUM_ROUNDING)
    };
    let bright: Vec<_> = entries.filter(|(_, entry)| bright(&entry.material)).collect();
    let (name, first) = bright.first()?;
    let place = format!("{}:{}: material {}", first.file.display(), first.line, shown(name));
    let others = match bright.len() - 1 {
        0 => String::new(),
        count => format!(" (and {})", counted(count, "other", "others")),
    };
    Some(format!("{place}{others}: Kd + Ks exceeds 1 in a channel; a stage that uses Ks would create energy"))
}

#[cfg(test)]
mod tests;
