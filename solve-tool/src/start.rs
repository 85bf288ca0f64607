//! Warm start: the irradiance of an older solution on the same mesh. A changed colour or lamp leaves most of it right.

use interchange::digest::Digest;
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use interchange::{Error, Result};
use std::path::Path;

/// Irradiance per element, and the identity of the file it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Per element.
    pub irradiance: Vec<[f64; 3]>,
    /// Identity.
    pub digest: Digest,
}

/// Reads an older solution.
///
/// # Errors
/// A solution on another mesh.
pub fn read(path: &Path, mesh_path: &Path, mesh: &Mesh, mesh_digest: Digest) -> Result<Start> {
    let (solution, _, origins, digest) = Solution::read(path)?;
    if origins.mesh != mesh_digest || solution.irradiance.len() != mesh.element_count() {
        let detail = format!("the solution to start from is for mesh {}", origins.mesh.short());
        let remedy = "leave --start away, or start from a solution on this mesh".into();
        return Err(Error::Mismatch { first: path.into(), second: mesh_path.into(), detail, remedy });
    }
    Ok(Start { irradiance: solution.irradiance, digest })
}
