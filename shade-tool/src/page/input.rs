//! The files a report page is made of, read together and checked against each other.

use super::PageArguments;
use crate::camera::{Camera, Wishes};
use crate::error::Result;
use crate::exr_reader::StoredPicture;
use crate::frames::frames;
use crate::info;
use glam::DVec3;
use interchange::Error;
use interchange::digest::Digest;
use interchange::foreign::base64;
use interchange::materials::Material;
use interchange::materials_input::load_materials;
use interchange::matrix::{Matrix, MatrixRecord};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Settings;
use interchange::solution::Solution;
use std::path::Path;

/// First bytes of every PNG file.
const PNG_MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// One file of the pipeline as the page tells of it.
#[derive(Debug)]
pub struct Stage {
    /// What it is: `mesh`, `matrix`, `solution`, `picture`.
    pub role: &'static str,
    /// Identity.
    pub digest: Option<Digest>,
    /// Where it comes from.
    pub provenance: Option<Provenance>,
    /// What its stage told.
    pub report: Option<Report>,
}

/// All that the page shows.
#[derive(Debug)]
pub struct Input {
    /// Geometry and names.
    pub mesh: Mesh,
    /// Radiosity and irradiance.
    pub solution: Solution,
    /// Materials in the mesh's order.
    pub materials: Vec<Material>,
    /// Area of each element.
    pub areas: Vec<f64>,
    /// Half the distance between the bounds of each radiosity.
    pub half_bounds: Option<Vec<[f64; 3]>>,
    /// The stages in their order.
    pub stages: Vec<Stage>,
    /// The header of the matrix.
    pub matrix: Option<MatrixRecord>,
    /// Pictures: what each shows, and its file in base64.
    pub figures: Vec<(String, String)>,
    /// Where the 3-D view begins.
    pub camera: Camera,
    /// Unit of length.
    pub unit: String,
    /// Lumens per watt.
    pub efficacy: f64,
}

impl Input {
    /// Reads all files; those that do not belong together are refused.
    pub fn read(arguments: &PageArguments) -> Result<Self> {
        let (solution_path, mesh_path) = (&arguments.solution, &arguments.mesh);
        let (mesh, mesh_provenance, mesh_digest) = Mesh::read(mesh_path)?;
        let (solution, provenance, origins, digest) = Solution::read(solution_path)?;
        Solution::belongs_to(solution_path, &origins, mesh_path, mesh_digest)?;
        let count = mesh.element_count();
        if solution.radiosity.len() != count {
            let detail = format!("{} elements are solved, {count} meshed", solution.radiosity.len());
            return Err(mismatch(solution_path, mesh_path, detail));
        }
        let (materials, materials_digest) =
            load_materials(mesh_path, arguments.materials.as_deref(), &mesh.materials)?;
        if materials_digest != origins.materials {
            let solution = solution_path.display();
            tracing::warn!(
                "{solution}: solved with other materials than those given; powers are the solution's own"
            );
        }
        let bounds = match &arguments.bounds {
            None => solution.details.bounds.clone(),
            Some(path) => {
                let (bounded, _, others, _) = Solution::read(path)?;
                if others != origins {
                    let detail = "they were solved from other files".into();
                    return Err(mismatch(path, solution_path, detail));
                }
                bounded.details.bounds
            }
        };
        let half_bounds = bounds.map(|[lower, upper]| {
            let half = |(l, u): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| 0.5 * (u[c] - l[c]));
            lower.iter().zip(&upper).map(half).collect()
        });

        let stage = |role, path: &Path, digest, provenance| {
            let report = Report::path_for(path);
            let report = report.exists().then(|| Report::read(&report)).transpose()?;
            Ok::<_, Error>(Stage { role, digest: Some(digest), provenance: Some(provenance), report })
        };
        let mut stages = vec![stage("mesh", mesh_path, mesh_digest, mesh_provenance)?];
        let mut matrix_record = None;
        if let Some(path) = &arguments.matrix {
            let matrix = Matrix::open_part(path)?;
            if matrix.digest() != origins.matrix {
                return Err(mismatch(solution_path, path, "it was solved from another matrix".into()));
            }
            matrix_record = Some(matrix.record().clone());
            stages.push(stage("matrix", path, matrix.digest(), matrix.provenance().clone())?);
        }
        stages.push(stage("solution", solution_path, digest, provenance)?);
        if let Some(path) = &arguments.picture {
            info::check_kind(path)?;
            StoredPicture::read(path)?.check_input("solution", solution_path, digest)?;
            let report = Report::path_for(path);
            let report = report.exists().then(|| Report::read(&report)).transpose()?;
            stages.push(Stage { role: "picture", digest: None, provenance: None, report });
        }

        let settings = arguments.camera.as_deref().map(Settings::read).transpose()?.unwrap_or_default();
        let areas = mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
        let figures: Result<Vec<_>> = arguments.figures.iter().map(|f| embedded(&f.name, &f.path)).collect();
        let figures = figures?;
        let cameras = frames(&Wishes::default(), &settings.cameras, bounds_of(&mesh), false, None)?;
        let camera = cameras.into_iter().next().map(|frame| frame.camera);
        let camera = camera.ok_or_else(|| crate::Error::camera("there is none", "give another toml"))?;
        Ok(Self {
            areas,
            half_bounds,
            stages,
            matrix: matrix_record,
            figures,
            camera,
            unit: settings.units.unwrap_or_else(|| "m".into()),
            efficacy: arguments.efficacy,
            mesh,
            solution,
            materials,
        })
    }

    /// Lowest and highest coordinates of the faces.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        bounds_of(&self.mesh)
    }

    /// Unit of powers: the sum of W m^-2 over areas in the square of the scene's unit.
    pub fn power_unit(&self) -> String {
        if self.unit == "m" { "W".into() } else { format!("W m⁻² {}²", self.unit) }
    }
}

fn bounds_of(mesh: &Mesh) -> (DVec3, DVec3) {
    let corners = mesh.faces.values().iter().map(|&v| mesh.position(v));
    let empty = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    corners.fold(empty, |(low, high), p| (low.min(p), high.max(p)))
}

fn mismatch(first: &Path, second: &Path, detail: String) -> crate::Error {
    let remedy = "give files of one run of the pipeline, or run it again".into();
    Error::Mismatch { first: first.into(), second: second.into(), detail, remedy }.into()
}

fn embedded(name: &str, path: &Path) -> Result<(String, String)> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    if !bytes.starts_with(PNG_MAGIC) {
        return Err(Error::whole(path, "not a PNG picture; figures are .png files").into());
    }
    Ok((name.into(), base64::encode(&bytes)))
}
