//! Which materials a stage works with: the table beside the mesh, or one given in its place, put in the mesh's order.

use crate::digest::Digest;
use crate::error::{Error, Result, nearest_name};
use crate::materials::{Material, MaterialTable};
use crate::scene::{NONE, read_materials};
use std::path::{Path, PathBuf};

/// Where `mesh-tool build` leaves the table of `mesh`: `room.materials` for `room.mesh`.
pub fn table_beside(mesh: &Path) -> PathBuf {
    mesh.with_extension("materials")
}

/// The materials called `names` (those of the mesh, in its order) and the identity of the file they come from: the
/// table beside the mesh, or `given`, a table or an MTL file.
///
/// # Errors
/// A file that cannot be read; a name that the file does not define. The built-in `(none)` needs no definition.
pub fn load_materials(
    mesh: &Path,
    given: Option<&Path>,
    names: &[String],
) -> Result<(Vec<Material>, Digest)> {
    let path = given.map_or_else(|| table_beside(mesh), Path::to_owned);
    if given.is_none() && !path.exists() {
        let message = "no such file, but it holds the colours of the mesh; mesh-tool build writes it beside the mesh, \
                       mesh-tool materials writes it alone, --materials names another";
        return Err(Error::whole(&path, message));
    }
    let (table, digest) = read(&path)?;
    let values: Result<Vec<Material>> = names.iter().map(|name| find(&table, name, &path, mesh)).collect();
    Ok((values?, digest))
}

fn read(path: &Path) -> Result<(MaterialTable, Digest)> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if ending.as_deref() == Some("mtl") {
        let (table, warnings) = read_materials(path)?;
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
        let digest = Digest::of(&bytes);
        warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        return Ok((table, digest));
    }
    let (table, _, digest) = MaterialTable::read(path)?;
    Ok((table, digest))
}

fn find(table: &MaterialTable, name: &str, path: &Path, mesh: &Path) -> Result<Material> {
    match table.get(name) {
        Some(material) => Ok(*material),
        None if name == NONE => Ok(Material::default()),
        None => {
            let near = nearest_name(name, table.names.iter().map(String::as_str));
            let near = near.map(|near| format!(" (nearest name: {near})")).unwrap_or_default();
            let message = format!(
                "material {name}, which {} uses, is not defined here{near}; add it, or give the materials of that \
                 mesh's scene",
                mesh.display()
            );
            Err(Error::whole(path, message))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::provenance::Provenance;

    fn table(path: &Path, names: &[&str]) {
        let values: Vec<Material> = (0..names.len())
            .map(|i| Material { diffuse: [0.1 * (i as f64 + 1.0); 3], ..Material::default() })
            .collect();
        let names = names.iter().map(|&n| n.to_owned()).collect();
        MaterialTable { names, values }.write(path, Provenance::new("test", "1")).unwrap();
    }

    #[test]
    fn names_are_looked_up_in_the_order_of_the_mesh() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("room.mesh");
        table(&folder.path().join("room.materials"), &["white", "red"]);
        let names = ["red".to_owned(), NONE.to_owned(), "white".to_owned()];
        let (values, digest) = load_materials(&mesh, None, &names).unwrap();
        assert_eq!(values.iter().map(|m| m.diffuse[0]).collect::<Vec<_>>(), [0.2, 0.0, 0.1]);

        let other = folder.path().join("other.materials");
        table(&other, &["red", "white"]);
        let (values, other_digest) = load_materials(&mesh, Some(&other), &names).unwrap();
        assert_eq!(values.iter().map(|m| m.diffuse[0]).collect::<Vec<_>>(), [0.1, 0.0, 0.2]);
        assert_ne!(digest, other_digest);
    }

    #[test]
    fn an_mtl_file_stands_in_for_a_table() {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, mtl) = (folder.path().join("room.mesh"), folder.path().join("new.mtl"));
        std::fs::write(&mtl, "newmtl white\nKd 0.8 0.8 0.8\nnewmtl lamp\nKd 0 0 0\nKe 2 3 4\n").unwrap();
        let (values, digest) = load_materials(&mesh, Some(&mtl), &["lamp".into(), "white".into()]).unwrap();
        assert_eq!((values[0].radiance, values[1].diffuse), ([2.0, 3.0, 4.0], [0.8; 3]));
        assert_eq!(digest, Digest::of(&std::fs::read(&mtl).unwrap()));
        std::fs::write(&mtl, "newmtl white\nKd 1.5 0.8 0.8\n").unwrap();
        let message = load_materials(&mesh, Some(&mtl), &["white".into()]).unwrap_err().to_string();
        assert!(message.contains("new.mtl:2"), "{message}");
    }

    #[test]
    fn a_missing_name_or_file_is_named_with_its_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("room.mesh");
        let message = load_materials(&mesh, None, &[]).unwrap_err().to_string();
        assert!(message.contains("room.materials") && message.contains("mesh-tool"), "{message}");
        table(&folder.path().join("room.materials"), &["white", "red"]);
        let message = load_materials(&mesh, None, &["whit".into()]).unwrap_err().to_string();
        assert!(message.contains("material whit,") && message.contains("nearest name: white"), "{message}");
    }
}
