//! `mesh-tool export` and `import`: elements for other programs, and scenes that other programs describe.

use interchange::Result;
use interchange::atomic_write::refuse_input;
use interchange::error::meant_ending;
use interchange::foreign::{self, Field, Format, Surface};
use interchange::materials::MaterialTable;
use interchange::mesh::Mesh;
use std::path::Path;

/// Writes the elements of a mesh in the format that the name of `output` asks for, with the materials beside the mesh where
/// there are any.
///
/// # Errors
/// The mesh cannot be read, the format is not known, or the output cannot be written.
pub fn write(path: &Path, output: &Path, format: Option<Format>) -> Result<()> {
    Format::asked_or(output, format)?;
    let table = path.with_extension("materials");
    refuse_input(output, [path, table.as_path()])?;
    let (mesh, _, digest) = Mesh::read(path)?;
    let materials = if table.exists() { Some(MaterialTable::read(&table)?.0) } else { None };
    let mut surface = Surface::of_mesh(&mesh, materials.as_ref());
    let areas = mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
    surface.polygon_fields.push(Field::scalars("area", areas));
    surface.comments.push(format!("elements of mesh {}", digest.short()));
    foreign::write(output, &surface, format).map(|_| ())
}

/// Turns a scene of View3D or Radiance into an OBJ with its MTL, and says what could not be taken over.
///
/// # Errors
/// The scene cannot be read (its line is named), or the output cannot be written.
pub fn convert(path: &Path, output: &Path) -> Result<Vec<String>> {
    refuse_input(output, [path])?;
    if Format::of(output) != Some(Format::Obj) {
        return Err(interchange::Error::whole(
            output,
            format!("expected a name ending in .obj{}", meant_ending(output, ["obj"])),
        ));
    }
    let (surface, said) = foreign::read_scene(path)?;
    foreign::write(output, &surface, None)?;
    Ok(said)
}
