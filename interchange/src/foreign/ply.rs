//! PLY, binary little-endian: points with colours and fields as properties, polygons as lists with theirs.

use super::{Field, Surface, Values, srgb};
use crate::atomic_write::{self, Outcome};
use crate::error::Result;
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
    let counted_by_byte = most <= usize::from(u8::MAX);
    atomic_write::write(path, |out| {
        write!(out, "ply\nformat binary_little_endian 1.0\n")?;
        for comment in &surface.comments {
            writeln!(out, "comment {}", comment.replace(['\n', '\r'], " "))?;
        }
        for (number, group) in surface.groups.iter().enumerate() {
            writeln!(out, "comment group {} {}", number + 1, group.replace(['\n', '\r'], " "))?;
        }
        writeln!(out, "element vertex {}", surface.points.len())?;
        ["x", "y", "z"].iter().try_for_each(|axis| writeln!(out, "property double {axis}"))?;
        if surface.colours.is_some() {
            ["red", "green", "blue"].iter().try_for_each(|name| writeln!(out, "property uchar {name}"))?;
        }
        declare(out, &surface.point_fields)?;
        writeln!(out, "element face {}", surface.polygons.len())?;
        let counter = if counted_by_byte { "uchar" } else { "uint" };
        writeln!(out, "property list {counter} uint vertex_indices")?;
        declare(out, &surface.polygon_fields)?;
        writeln!(out, "end_header")?;

        for (i, point) in surface.points.iter().enumerate() {
            out.write_all(bytemuck::bytes_of(point))?;
            if let Some(colours) = &surface.colours {
                out.write_all(&colours[i].map(|x| (255.0 * srgb(x) + 0.5) as u8))?;
            }
            values(out, &surface.point_fields, i)?;
        }
        for (i, polygon) in surface.polygons.rows().enumerate() {
            match counted_by_byte {
                true => out.write_all(&[polygon.len() as u8])?,
                false => out.write_all(&(polygon.len() as u32).to_le_bytes())?,
            }
            out.write_all(bytemuck::cast_slice(polygon))?;
            values(out, &surface.polygon_fields, i)?;
        }
        Ok(())
    })
}

fn declare(out: &mut dyn atomic_write::WriteSeek, fields: &[Field]) -> std::io::Result<()> {
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

fn values(out: &mut dyn atomic_write::WriteSeek, fields: &[Field], item: usize) -> std::io::Result<()> {
    for field in fields {
        let range = item * field.components..(item + 1) * field.components;
        match &field.values {
            Values::F64(all) => out.write_all(bytemuck::cast_slice(&all[range]))?,
            Values::U32(all) => out.write_all(bytemuck::cast_slice(&all[range]))?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    #[test]
    fn header_and_every_byte_after_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ply");
        let mut surface = two_polygons();
        surface.colours = Some(vec![[0.0, 0.5, 1.0]; 5]);
        write(&path, &surface).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = b"end_header\n";
        let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let header = String::from_utf8(bytes[..body].to_vec()).unwrap();
        assert_eq!(
            header,
            "ply\nformat binary_little_endian 1.0\ncomment made by a test\ncomment group 1 the floor\n\
             comment group 2 flap\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nproperty double height\n\
             element face 2\nproperty list uchar uint vertex_indices\nproperty uint element\n\
             property double B_r\nproperty double B_g\nproperty double B_b\nend_header\n"
        );
        // A point: 3 doubles, 3 bytes, 1 double. Polygons: a byte, corners, a word, 3 doubles.
        assert_eq!(bytes.len() - body, 5 * 35 + (1 + 16 + 4 + 24) + (1 + 12 + 4 + 24));
        let last_point = &bytes[body + 4 * 35..][..35];
        let double = |at: usize| f64::from_le_bytes(last_point[at..at + 8].try_into().unwrap());
        assert_eq!((double(0), double(16), double(27)), (0.5, 1.0 / 3.0, 1.0 / 3.0));
        // 0.5 linear is 187.5 of 255 in sRGB.
        assert_eq!(last_point[24..27], [0, 188, 255]);
        let first = &bytes[body + 5 * 35..][..45];
        assert_eq!((first[0], &first[1..5], &first[17..21]), (4, &[0u8, 0, 0, 0][..], &[1u8, 0, 0, 0][..]));
    }
}
