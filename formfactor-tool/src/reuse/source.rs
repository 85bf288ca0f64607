//! The old matrix with its mesh, and whether its entries will do: computed by this version and method, at a tolerance that is
//! not too loose, for the same blocking faces, and not changed by closure.

use super::elements::{same_blockers, same_elements};
use super::entries::Entries;
use super::{MOST_STATED, Reuse};
use crate::closure::raw::is_raw;
use crate::exact::unoccluded_error;
use crate::method::Choice;
use crate::scene::Scene;
use clap::Args;
use interchange::digest::Digest;
use interchange::error::{Error, Result};
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use std::path::{Path, PathBuf};

/// Role of the old matrix among the inputs of the new one.
pub const REUSED_MATRIX: &str = "reused matrix";
/// Role of its mesh.
pub const REUSED_MESH: &str = "reused mesh";

/// Flags that name an old matrix.
#[derive(Debug, Clone, Default, Args)]
pub struct OldMatrix {
    /// Matrix of the same scene on another mesh, all files of one computed in shards: factors of elements that did not change
    /// are taken from it, where its closure was off or report
    #[arg(long, value_name = "FILE", num_args = 1.., requires = "reuse_mesh")]
    pub reuse: Vec<PathBuf>,
    /// Mesh that --reuse was computed for
    #[arg(long, value_name = "FILE", requires = "reuse")]
    pub reuse_mesh: Option<PathBuf>,
}

/// Why an old matrix is of no use. Everything is computed then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// Another method fills the new matrix.
    #[error("only --method auto reuses factors")]
    Method,
    /// Imported, or computed by another version or with other flags.
    #[error(
        "it was made by {found}, expected formfactor-tool compute of version {} with --method auto; compute it anew",
        env!("CARGO_PKG_VERSION")
    )]
    Origin {
        /// Program, version and flags.
        found: String,
    },
    /// Its entries are not those that were computed.
    #[error("its factors may have been changed by closure; compute it with --closure off or report")]
    Closed,
    /// Single factors may be off by more than the new matrix allows.
    #[error(
        "it was asked for a tolerance of {found:e}, too loose for single factors at {asked:e}; compute it with {asked:e} or less"
    )]
    Loose {
        /// Tolerance of the old matrix.
        found: f64,
        /// Tolerance of the new one.
        asked: f64,
    },
    /// What blocks light has changed.
    #[error("the faces that block light differ: the meshes are of different scenes")]
    Blockers,
    /// Its blocks lie elsewhere than those that are computed.
    #[error("its blocks are not pairs of leaf clusters of its mesh; compute it anew")]
    Blocks,
    /// No element of the new mesh is in the old one.
    #[error("no element of the mesh is in the old mesh")]
    Elements,
    /// All rows of unchanged elements state too much.
    #[error(
        "all {unchanged} unchanged elements have rows whose stated error is above {limit:.1e}, {MOST_STATED} of the tolerance; \
         compute it with a smaller --tolerance"
    )]
    Errors {
        /// Number of elements in both meshes.
        unchanged: usize,
        /// Most that a row may state.
        limit: f64,
    },
}

/// An old matrix and its mesh.
#[derive(Debug)]
pub struct Source {
    matrix: Matrix,
    mesh: Mesh,
    mesh_digest: Digest,
}

impl Source {
    /// Opens the files that the flags name, if any.
    ///
    /// # Errors
    /// A file is damaged, parts are missing, or the mesh is not that of the matrix.
    pub fn open(flags: &OldMatrix) -> Result<Option<Self>> {
        let Some(path) = flags.reuse_mesh.as_deref().filter(|_| !flags.reuse.is_empty()) else {
            return Ok(None);
        };
        let matrix = Matrix::open_all(&flags.reuse)?;
        let (mesh, _, mesh_digest) = Mesh::read(path)?;
        let record = matrix.record();
        if record.mesh != mesh_digest || matrix.element_count() != mesh.element_count() {
            return Err(Error::Mismatch {
                first: matrix.path().into(),
                second: path.into(),
                detail: format!(
                    "--reuse was computed for mesh {} with {} elements, --reuse-mesh is {} with {}",
                    record.mesh.short(),
                    record.elements,
                    mesh_digest.short(),
                    mesh.element_count()
                ),
                remedy: "give --reuse-mesh the mesh that --reuse was computed for".into(),
            });
        }
        Ok(Some(Self { matrix, mesh, mesh_digest }))
    }

    /// Path of the matrix; of several files that of the first part.
    pub fn path(&self) -> &Path {
        self.matrix.path()
    }

    /// What was read: roles and identities.
    pub fn inputs(&self) -> [(&'static str, Digest); 2] {
        [(REUSED_MATRIX, self.matrix.digest()), (REUSED_MESH, self.mesh_digest)]
    }

    /// What a matrix of `scene`, made of `mesh`, can take from it. The inner error says why nothing.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn reuse(
        &self,
        (mesh, scene): (&Mesh, &Scene),
        method: &Choice,
        tolerance: f64,
    ) -> Result<std::result::Result<Reuse<'_>, Refusal>> {
        if let Err(refusal) = self.origin(method, tolerance) {
            return Ok(Err(refusal));
        }
        if !is_raw(&self.matrix)? {
            return Ok(Err(Refusal::Closed));
        }
        if !same_blockers(mesh, &self.mesh) {
            return Ok(Err(Refusal::Blockers));
        }
        let mut old = same_elements(mesh, &self.mesh);
        let unchanged = old.iter().flatten().count();
        if unchanged == 0 {
            return Ok(Err(Refusal::Elements));
        }
        let (stated, limit) = (self.matrix.row_errors()?, MOST_STATED * tolerance);
        old.iter_mut().for_each(|place| *place = place.filter(|&k| stated[k as usize] <= limit));
        if old.iter().flatten().next().is_none() {
            return Ok(Err(Refusal::Errors { unchanged, limit }));
        }
        Ok(Entries::new(&self.matrix, &self.mesh)?
            .map(|entries| Reuse::new(&scene.clusters, old, stated, entries)))
    }

    /// Refuses what another method, version or wish has made.
    fn origin(&self, method: &Choice, tolerance: f64) -> std::result::Result<(), Refusal> {
        if *method != Choice::AUTO {
            return Err(Refusal::Method);
        }
        let (origin, record) = (self.matrix.provenance(), self.matrix.record());
        let is_own = origin.tool == "formfactor-tool" && origin.version == env!("CARGO_PKG_VERSION");
        let is_auto = !origin.flags.iter().any(|flag| flag.starts_with("--method "));
        let is_imported = origin.digest_of("factors").is_some();
        if !is_own || !is_auto || is_imported || !record.symmetric || record.extended {
            let found = format!("{} {} {}", origin.tool, origin.version, origin.flags.join(" "));
            return Err(Refusal::Origin { found: found.trim_end().to_owned() });
        }
        // Pairs without blockers are promised within ten times the tolerance, each by itself.
        if unoccluded_error(record.tolerance) > tolerance {
            return Err(Refusal::Loose { found: record.tolerance, asked: tolerance });
        }
        Ok(())
    }
}
