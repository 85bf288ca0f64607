//! Mesh, solution and materials read together and checked against each other.

use crate::error::Result;
use crate::facets::{Drawn, drawn_mesh};
use glam::DVec3;
use interchange::digest::Digest;
use interchange::ids::{ElementId, FaceId};
use interchange::materials::Material;
use interchange::materials_input::{load_materials, table_beside};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::solution::Solution;
use std::path::Path;

/// A mesh with the radiosity of each element.
#[derive(Debug)]
pub struct LitScene {
    /// Geometry and names, the elements cut into the facets that are drawn.
    pub mesh: Mesh,
    /// Corners of the elements that were solved.
    pub sources: Vec<Vec<DVec3>>,
    /// Source that each drawn facet is all or part of.
    pub source_of: Vec<u32>,
    /// Radiosity of every source, RGB, W m^-2.
    pub radiosity: Vec<[f64; 3]>,
    /// Irradiance of every source as solved, RGB, W m^-2.
    pub irradiance: Vec<[f64; 3]>,
    /// Bound that the solver reached, part of the emitted power.
    pub achieved: f64,
    /// Materials in the mesh's order.
    pub materials: Vec<Material>,
    /// Identities of solution, mesh and materials, with their roles.
    pub inputs: Vec<(&'static str, Digest)>,
}

impl LitScene {
    /// Reads the three files and refuses what does not belong together. Materials that are not the ones the solution was
    /// computed with are used, with a warning.
    pub fn read(
        solution_path: &Path,
        mesh_path: &Path,
        materials_path: Option<&Path>,
        drawn: Drawn,
        report: &mut Report,
    ) -> Result<LitScene> {
        let (mesh, _, mesh_digest) = Mesh::read(mesh_path)?;
        let (solution, _, origins, solution_digest) = Solution::read(solution_path)?;
        Solution::belongs_to(solution_path, &origins, mesh_path, mesh_digest)?;
        if solution.radiosity.len() != mesh.element_count() {
            let detail =
                format!("{} elements are solved, {} meshed", solution.radiosity.len(), mesh.element_count());
            let (first, second) = (solution_path.into(), mesh_path.into());
            let remedy = "run formfactor-tool compute and solve-tool solve on this mesh".into();
            return Err(interchange::Error::Mismatch { first, second, detail, remedy }.into());
        }
        let (materials, materials_digest) = load_materials(mesh_path, materials_path, &mesh.materials)?;
        if materials_digest != origins.materials {
            report.warn(format!(
                "{}: not the materials that {} was solved with: surfaces show these, the light that reaches them is the \
                 old one; run solve-tool solve",
                materials_path.unwrap_or(&table_beside(mesh_path)).display(),
                solution_path.display()
            ));
        }
        let inputs =
            vec![("solution", solution_digest), ("mesh", mesh_digest), ("materials", materials_digest)];
        let sources = mesh.element_ids().map(|element| mesh.element_corners(element)).collect();
        let (mesh, source_of) = drawn_mesh(&mesh, drawn);
        let Solution { radiosity, irradiance, summary, .. } = solution;
        let achieved = summary.achieved;
        Ok(LitScene { mesh, sources, source_of, radiosity, irradiance, achieved, materials, inputs })
    }

    /// Adds the inputs to a provenance.
    pub fn sign(&self, provenance: Provenance) -> Provenance {
        self.inputs.iter().fold(provenance, |provenance, &(role, digest)| provenance.input(role, digest))
    }

    /// Material of a facet.
    pub fn material(&self, element: ElementId) -> &Material {
        &self.materials[self.mesh.element_material(element).index()]
    }

    /// Lowest and highest coordinates of the faces.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let corners = self.mesh.faces.values().iter().map(|&v| self.mesh.position(v));
        let empty = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
        corners.fold(empty, |(low, high), p| (low.min(p), high.max(p)))
    }

    /// Irradiance, W m^-2, mean over the elements' area and the channels.
    pub fn mean_irradiance(&self) -> f64 {
        let (mut power, mut area) = (0.0, 0.0);
        for (corners, irradiance) in self.sources.iter().zip(&self.irradiance) {
            let own = geometry::polygon::area(corners);
            power += own * irradiance.iter().sum::<f64>() / 3.0;
            area += own;
        }
        if area > 0.0 { power / area } else { 0.0 }
    }

    /// Length of the diagonal of the faces' bounding box.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).length()
    }

    /// Corners of all convex pieces of the faces.
    pub fn pieces(&self) -> Vec<Vec<DVec3>> {
        (0..self.mesh.occluders.len()).map(|piece| self.mesh.occluder_corners(piece)).collect()
    }

    /// Face of a convex piece.
    pub fn piece_face(&self, piece: usize) -> FaceId {
        self.mesh.occluder_faces[piece]
    }
}
