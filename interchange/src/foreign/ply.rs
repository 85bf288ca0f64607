//! PLY: points with colours and fields as properties, polygons as lists with theirs.
//!
//! As text: every number in the digits that give its bits back. The binary form is half as long, but a widely used reader
//! (meshio 5.3) mistakes properties of faces there, and takes bytes of colour for signed ones. It also wants polygons of as
//! many corners to stand together: triangles come first, and so on; the field `element` says which is which.

use super::{Field, Surface, Values, srgb};
use crate::atomic_write::{self, Outcome, WriteSeek};
use crate::error::Result;
use crate::tables::number;
use std::path::Path;

/// Letters after the names of properties that belong to one colour.
const CHANNELS: [&str; 3] = ["_r", "_g", "_b"];

/// Writes a surface; an identical file is left alone.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    let most = surface.polygons.rows().map(<[u32]>::len).max().unwrap_or(0);
    // Readers expect a byte here; more corners than that make it a word.
    let counter = if most <= usize::from(u8::MAX) { "uchar" } else { "uint" };
    atomic_write::write(path, |out| {
        write!(out, "ply\nformat ascii 1.0\n")?;
        for comment in &surface.comments {
            writeln!(out, "comment {}", comment.replace(['\n', '\r'], " "))?;
        }
        for (k, group) in surface.groups.iter().enumerate() {
            writeln!(out, "comment group {} {}", k + 1, group.replace(['\n', '\r'], " "))?;
        }
        writeln!(out, "element vertex {}", surface.points.len())?;
        ["x", "y", "z"].iter().try_for_each(|axis| writeln!(out, "property double {axis}"))?;
        if surface.colours.is_some() {
            ["red", "green", "blue"].iter().try_for_each(|name| writeln!(out, "property uchar {name}"))?;
        }
        declare(out, &surface.point_fields)?;
        writeln!(out, "element face {}", surface.polygons.len())?;
        writeln!(out, "property list {counter} uint vertex_indices")?;
        declare(out, &surface.polygon_fields)?;
        writeln!(out, "end_header")?;

        for (i, point) in surface.points.iter().enumerate() {
            write!(out, "{}", point.map(number).join(" "))?;
            if let Some(colours) = &surface.colours {
                let [r, g, b] = colours[i].map(|x| (255.0 * srgb(x) + 0.5) as u8);
                write!(out, " {r} {g} {b}")?;
            }
            values(out, &surface.point_fields, i)?;
        }
        let mut order: Vec<usize> = (0..surface.polygons.len()).collect();
        order.sort_by_key(|&i| surface.polygons.row(i).len());
        for i in order {
            let polygon = surface.polygons.row(i);
            write!(out, "{}", polygon.len())?;
            polygon.iter().try_for_each(|point| write!(out, " {point}"))?;
            values(out, &surface.polygon_fields, i)?;
        }
        Ok(())
    })
}

fn declare(out: &mut dyn WriteSeek, fields: &[Field]) -> std::io::Result<()> {
    for field in fields {
        let kind = match field.values {
            Values::F64(_) => "double",
            Values::U32(_) => "uint",
        };
        match field.components {
            1 => writeln!(out, "property {kind} {}", field.name)?,
            n => {
                (0..n).try_for_each(|c| writeln!(out, "property {kind} {}{}", field.name, CHANNELS[c % 3]))?
            }
        }
    }
    Ok(())
}

/// The values of an item, and the end of its line.
fn values(out: &mut dyn WriteSeek, fields: &[Field], item: usize) -> std::io::Result<()> {
    for field in fields {
        let range = item * field.components..(item + 1) * field.components;
        match &field.values {
            Values::F64(all) => all[range].iter().try_for_each(|&x| write!(out, " {}", number(x)))?,
            Values::U32(all) => all[range].iter().try_for_each(|x| write!(out, " {x}"))?,
        }
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    #[test]
    fn every_line_is_as_it_should_be() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ply");
        let mut surface = two_polygons();
        surface.colours = Some(vec![[0.0, 0.5, 1.0]; 5]);
        write(&path, &surface).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        // 0.5 linear is 187.5 of 255 in sRGB.
        assert_eq!(
            text,
            "ply\nformat ascii 1.0\ncomment made by a test\ncomment group 1 the floor\n\
             comment group 2 flap\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nproperty double height\n\
             element face 2\nproperty list uchar uint vertex_indices\nproperty uint element\n\
             property double B_r\nproperty double B_g\nproperty double B_b\nend_header\n\
             0 0 0 0 188 255 0\n1 0 0 0 188 255 0\n1 1 0 0 188 255 0\n0 1 0 0 188 255 0\n\
             0.5 0.1 0.3333333333333333 0 188 255 0.3333333333333333\n\
             3 1 0 4 2 0.1 0.2 0.3\n4 0 1 2 3 1 1 2 3\n"
        );
    }
}
