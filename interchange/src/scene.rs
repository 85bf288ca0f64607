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

pub use settings::{CameraSettings, ProjectionSettings, Settings};

use crate::digest::Digest;
use crate::error::Result;
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

/// The materials of one MTL file, in its order, and then [`NONE`]; none is two-sided, which the file cannot say.
/// Beside it, what the author should look at. Errors name the line.
pub fn read_materials(path: &Path) -> Result<(MaterialTable, Vec<String>)> {
    let mut library = mtl::Library::default();
    library.read(path)?;
    let warnings = std::mem::take(&mut library.warnings);
    Ok((library.into_table(), warnings))
}

/// The text of a file; what is not UTF-8 is refused with its line.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(|e| crate::Error::io(path, "read", e))?;
    statement::decode(path, &bytes).map(str::to_owned)
}

impl Scene {
    /// Reads `path` (OBJ), the MTL files it names and `NAME.toml` beside it where that exists.
    /// Materials named in `two_sided` are two-sided besides those the toml lists.
    ///
    /// # Errors
    /// Each names file and line: text that is not UTF-8; coordinates that are not finite or beyond 2^250; indices
    /// that name no vertex; faces of fewer than 3 corners; unknown materials and missing MTL files; material values
    /// out of range; settings that are unknown or make no picture. So does a scene without faces.
    ///
    /// # Limitations
    /// Polygons only: points, lines and free-form surfaces are passed over, textures and vertex colours ignored.
    ///
    /// ```
    /// # let folder = tempfile::tempdir()?;
    /// let path = folder.path().join("square.obj");
    /// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng floor\nf 1 2 3 4\n")?;
    /// let scene = interchange::scene::Scene::read(&path, &[])?;
    /// assert_eq!(scene.faces[0].corners, [0, 1, 2, 3]);
    /// assert_eq!((scene.groups[0].as_str(), scene.materials.names[0].as_str()), ("floor", "(none)"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
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
