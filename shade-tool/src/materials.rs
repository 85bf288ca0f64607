//! The material table that shading uses: the one beside the mesh, or another that the user names.

use crate::error::{Error, Result};
use interchange::digest::Digest;
use interchange::materials::{Material, MaterialTable};
use interchange::mesh::Mesh;
use std::path::{Path, PathBuf};

/// A table with its path and identity.
#[derive(Debug)]
pub struct LoadedMaterials {
    /// Where it was read from.
    pub path: PathBuf,
    /// The materials.
    pub table: MaterialTable,
    /// Identity of the file.
    pub digest: Digest,
}

/// Reads `materials`, or without one the table beside the mesh: `s.materials` for `s.mesh`.
pub fn load_materials(mesh_path: &Path, materials: Option<&Path>) -> Result<LoadedMaterials> {
    let path = materials.map_or_else(|| mesh_path.with_extension("materials"), Path::to_owned);
    let (table, _, digest) = MaterialTable::read(&path)?;
    Ok(LoadedMaterials { path, table, digest })
}

/// The table's materials in the mesh's own order, matched by name.
pub fn matched_to_mesh(mesh_path: &Path, mesh: &Mesh, loaded: &LoadedMaterials) -> Result<Vec<Material>> {
    let find = |name: &String| loaded.table.get(name).copied().ok_or_else(|| name.clone());
    let (found, missing): (Vec<_>, Vec<_>) = mesh.materials.iter().map(find).partition(|m| m.is_ok());
    if missing.is_empty() {
        return Ok(found.into_iter().flatten().collect());
    }
    let missing = missing.into_iter().filter_map(|m| m.err()).collect();
    Err(Error::MissingMaterials { table: loaded.path.clone(), mesh: mesh_path.into(), missing })
}
