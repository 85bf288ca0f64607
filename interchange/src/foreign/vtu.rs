//! VTK XML, unstructured grid (`.vtu`): arrays in base64, each behind its length as a 64-bit word. Cells are
//! triangles, quadrilaterals or convex polygons; fields of points and cells keep their names.

use super::{Field, Surface, Values, base64};
use crate::atomic_write::{self, Outcome, WriteSeek};
use crate::error::Result;
use std::path::Path;

/// Cell types of VTK.
const TRIANGLE: u8 = 5;
const POLYGON: u8 = 7;
const QUADRILATERAL: u8 = 9;

/// Writes a surface; an identical file is left alone.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    atomic_write::write(path, |out| {
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        for comment in &surface.comments {
            writeln!(out, "<!-- {} -->", safe(comment))?;
        }
        for (number, group) in surface.groups.iter().enumerate() {
            writeln!(out, "<!-- group {}: {} -->", number + 1, safe(group))?;
        }
        for (number, (material, _)) in surface.materials.iter().enumerate() {
            writeln!(out, "<!-- material {}: {} -->", number + 1, safe(material))?;
        }
        let byte_order = "byte_order=\"LittleEndian\" header_type=\"UInt64\"";
        writeln!(
            out,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" {byte_order}>\n<UnstructuredGrid>"
        )?;
        let (points, cells) = (surface.points.len(), surface.polygons.len());
        writeln!(out, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;

        writeln!(out, "<Points>")?;
        array(out, "Float64", "Points", 3, bytemuck::cast_slice(&surface.points))?;
        writeln!(out, "</Points>\n<Cells>")?;
        let connectivity: Vec<i64> =
            surface.polygons.values().iter().map(|&point| i64::from(point)).collect();
        let ends: Vec<i64> = surface.polygons.starts()[1..].iter().map(|&end| i64::from(end)).collect();
        let kind = |corners: &[u32]| match corners.len() {
            3 => TRIANGLE,
            4 => QUADRILATERAL,
            _ => POLYGON,
        };
        let kinds: Vec<u8> = surface.polygons.rows().map(kind).collect();
        array(out, "Int64", "connectivity", 1, bytemuck::cast_slice(&connectivity))?;
        array(out, "Int64", "offsets", 1, bytemuck::cast_slice(&ends))?;
        array(out, "UInt8", "types", 1, &kinds)?;
        writeln!(out, "</Cells>\n<PointData>")?;
        fields(out, &surface.point_fields)?;
        if let Some(colours) = &surface.colours {
            array(out, "Float64", "colour", 3, bytemuck::cast_slice(colours))?;
        }
        writeln!(out, "</PointData>\n<CellData>")?;
        fields(out, &surface.polygon_fields)?;
        writeln!(out, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    })
}

fn fields(out: &mut dyn WriteSeek, fields: &[Field]) -> std::io::Result<()> {
    fields.iter().try_for_each(|field| match &field.values {
        Values::F64(all) => array(out, "Float64", &field.name, field.components, bytemuck::cast_slice(all)),
        Values::U32(all) => array(out, "UInt32", &field.name, field.components, bytemuck::cast_slice(all)),
    })
}

fn array(
    out: &mut dyn WriteSeek,
    kind: &str,
    name: &str,
    components: usize,
    bytes: &[u8],
) -> std::io::Result<()> {
    let mut block = (bytes.len() as u64).to_le_bytes().to_vec();
    block.extend_from_slice(bytes);
    // As VTK writes it: some readers make a column of what is said to have one component.
    let components =
        if components == 1 { String::new() } else { format!(" NumberOfComponents=\"{components}\"") };
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{}\"{components} format=\"binary\">{}</DataArray>",
        safe(name),
        base64::encode(&block)
    )
}

/// A text that may stand in a comment or in an attribute.
fn safe(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    // Two hyphens would end a comment.
    text.replace("--", "- -").replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    #[test]
    fn arrays_stand_in_their_places() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.vtu");
        write(&path, &two_polygons()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("NumberOfPoints=\"5\" NumberOfCells=\"2\""), "{text}");
        // Eight bytes of length (2), then the types 9 (quadrilateral) and 5 (triangle).
        let types = base64::encode(&[2, 0, 0, 0, 0, 0, 0, 0, 9, 5]);
        assert!(text.contains(&format!("Name=\"types\" format=\"binary\">{types}<")));
        let ends: Vec<u8> = [16i64, 4, 7].iter().flat_map(|n| n.to_le_bytes()).collect();
        assert!(text.contains(&format!("Name=\"offsets\" format=\"binary\">{}<", base64::encode(&ends))));
        let mut b = 48u64.to_le_bytes().to_vec();
        b.extend([1.0f64, 2.0, 3.0, 0.1, 0.2, 0.3].iter().flat_map(|x| x.to_le_bytes()));
        assert!(text.contains(&format!(
            "Name=\"B\" NumberOfComponents=\"3\" format=\"binary\">{}<",
            base64::encode(&b)
        )));
        let (points, cells) = (text.find("<PointData>").unwrap(), text.find("<CellData>").unwrap());
        assert!((points..cells).contains(&text.find("\"height\"").unwrap()));
    }
}
