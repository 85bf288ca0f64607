//! Wavefront OBJ with its MTL: groups, materials, and colours after the coordinates as many programs read them.

use super::{Surface, srgb, word};
use crate::atomic_write::{self, Outcome};
use crate::error::Result;
use crate::scene::NONE;
use crate::tables::number;
use std::fmt::Write as _;
use std::path::Path;

/// Writes a surface as `NAME.obj` and its materials as `NAME.mtl`; identical files are left alone.
///
/// # Errors
/// A file cannot be written.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    let library = path.with_extension("mtl");
    let names = material_names(surface);
    atomic_write::write_bytes(&library, materials(surface, &names).as_bytes())?;
    atomic_write::write(path, |out| {
        for comment in &surface.comments {
            writeln!(out, "# {}", comment.replace(['\n', '\r'], " "))?;
        }
        writeln!(out, "mtllib {}", library.file_name().unwrap_or_default().to_string_lossy())?;
        for (i, point) in surface.points.iter().enumerate() {
            let [x, y, z] = point.map(number);
            match &surface.colours {
                None => writeln!(out, "v {x} {y} {z}")?,
                Some(colours) => {
                    let [r, g, b] = colours[i].map(|x| (1e4 * srgb(x)).round() / 1e4);
                    writeln!(out, "v {x} {y} {z} {r} {g} {b}")?;
                }
            }
        }
        let mut before = (None, None);
        for (i, polygon) in surface.polygons.rows().enumerate() {
            let (group, material) = (surface.polygon_groups[i], surface.polygon_materials[i]);
            if before.0 != Some(group) {
                writeln!(out, "g {}", surface.groups[group as usize].replace(['\n', '\r'], " "))?;
            }
            if before.1 != Some(material) {
                writeln!(out, "usemtl {}", names[material as usize])?;
            }
            before = (Some(group), Some(material));
            write!(out, "f")?;
            polygon.iter().try_for_each(|point| write!(out, " {}", point + 1))?;
            writeln!(out)?;
        }
        Ok(())
    })
}

/// Names as MTL can hold them, each once.
fn material_names(surface: &Surface) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(surface.materials.len());
    for (name, _) in &surface.materials {
        let mut free = word(name);
        while names.contains(&free) {
            free.push('_');
        }
        names.push(free);
    }
    names
}

fn materials(surface: &Surface, names: &[String]) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    for ((_, material), name) in surface.materials.iter().zip(names) {
        // Built in: an MTL that defines it is refused.
        if name == NONE {
            continue;
        }
        let triple = |values: [f64; 3]| values.map(number).join(" ");
        let _ = writeln!(text, "newmtl {name}\nKd {}", triple(material.diffuse));
        if material.emits() {
            let _ = writeln!(text, "Ke {}", triple(material.radiance));
        }
        if material.specular != [0.0; 3] {
            let _ = writeln!(text, "Ks {}\nNs {}", triple(material.specular), number(material.exponent));
        }
        if material.opacity != 1.0 {
            let _ = writeln!(text, "d {}\nNi {}", number(material.opacity), number(material.refraction));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;
    use crate::scene::Scene;

    /// What is written is read back with the same coordinates to the bit, the same groups and colours.
    #[test]
    fn our_own_reader_finds_everything_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.obj");
        let mut surface = two_polygons();
        surface.colours = Some(vec![[0.5; 3]; 5]);
        write(&path, &surface).unwrap();
        assert!(std::fs::read_to_string(&path).unwrap().contains("\nv 0.5 0.1 0.3333333333333333 0.7354"));
        let scene = Scene::read(&path, &[]).unwrap();
        assert_eq!(scene.vertices, surface.points);
        assert_eq!(scene.groups, surface.groups);
        assert_eq!(scene.materials.get("grey").unwrap().diffuse, [0.5, 0.25, 0.125]);
        assert_eq!(scene.materials.get("lamp").unwrap().radiance, [3.0, 2.0, 1.0]);
    }
}
