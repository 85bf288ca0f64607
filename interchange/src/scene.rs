//! The scene as its author wrote it: OBJ geometry, MTL materials, and the optional toml beside them.

mod camera_check;
mod current;
mod material_files;
mod mtl;
mod obj;
mod obj_scan;
mod polygons;
mod settings;
mod statement;

pub use settings::{CameraSettings, Settings};

use crate::digest::Digest;
use crate::error::{Error, Result};
use crate::ids::{GroupId, MaterialId};
use crate::materials::MaterialTable;
use std::path::{Path, PathBuf};

/// Name of the built-in material of faces before any `usemtl`, and of the group of faces before any `g` or `o`.
pub const NONE: &str = "(none)";

/// A polygon of the scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneFace {
    /// Indices into the scene's vertices, at least 3, front counter-clockwise. Zero-area and repeated corners may occur.
    pub corners: Vec<u32>,
    /// Group.
    pub group: GroupId,
    /// Material.
    pub material: MaterialId,
    /// Line of the OBJ it begins on, from 1.
    pub line: usize,
}

/// A scene read from files: finite coordinates, valid indices, known materials.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The OBJ file.
    pub path: PathBuf,
    /// Identity of the OBJ file.
    pub digest: Digest,
    /// MTL files it names, in order.
    pub material_files: Vec<PathBuf>,
    /// Vertex positions, in file order; those no face names are left out.
    pub vertices: Vec<[f64; 3]>,
    /// Faces in file order.
    pub faces: Vec<SceneFace>,
    /// Group names in order of their first face.
    pub groups: Vec<String>,
    /// Materials that faces use, in order of first use; two-sided ones marked.
    pub materials: MaterialTable,
    /// Contents of the toml, defaults where there is none.
    pub settings: Settings,
    /// What the author should look at: to be reported by the tool.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Reads `path` (OBJ), the MTL files it names and `NAME.toml` beside it where that exists.
    /// Materials named in `two_sided` are two-sided besides those the toml lists.
    pub fn read(path: &Path, two_sided: &[String]) -> Result<Scene> {
        obj::read(path, two_sided)
    }

    /// The files it was read from, in a fixed order: the OBJ, its MTL files, and the toml if there is one.
    /// Whatever is made from the scene depends on them (a line of a Makefile, say).
    pub fn dependencies(&self) -> Vec<PathBuf> {
        let toml = Some(self.path.with_extension("toml")).filter(|toml| toml.is_file());
        let obj = std::iter::once(self.path.clone());
        obj.chain(self.material_files.iter().cloned()).chain(toml).collect()
    }
}

/// All materials of one MTL file in order of definition, the file's identity, and what its author should look at.
/// Which of them are two-sided an MTL file does not say.
pub fn read_materials(path: &Path) -> Result<(MaterialTable, Digest, Vec<String>)> {
    let mut library = mtl::Library::default();
    library.read(path)?;
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let mut entries: Vec<_> = library.entries.into_iter().collect();
    entries.sort_by_key(|(_, entry)| entry.line);
    let (names, values) = entries.into_iter().map(|(name, entry)| (name, entry.material)).unzip();
    Ok((MaterialTable { names, values }, Digest::of(&bytes), library.warnings))
}
