//! Refinement by a solution's own error: irradiance gathered at test points against what the solution says of the
//! element. Where they differ by more than the tolerance, the element is divided; all others stay as they are.

use crate::lit::LONG;
use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use crate::triangulation::Trouble;
use geometry::gather::{Gatherer, Scratch};
use geometry::merge::merged_occluders;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::FaceId;
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::solution::Solution;
use interchange::tool::progress;
use interchange::{Error, Result};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Test points near the corners lie this part of the way from the centroid to them.
const CORNER: f64 = 0.8;
/// Elements are divided until there are this many times as many, at most.
const GROWTH: f64 = 2.0;
/// Elements that one divided element adds, with those that meet it in other planes (6.7 in the Cornell box).
const ADDED: f64 = 6.5;
/// Asked where no tolerance is: part of the mean irradiance.
pub const TOLERANCE: f64 = 0.02;

/// A solution and the mesh it was computed on.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Where the solution is.
    pub path: PathBuf,
    /// The mesh.
    pub mesh: Mesh,
    /// The solution.
    pub solution: Solution,
    /// Identity of the solution.
    pub digest: interchange::digest::Digest,
}

impl Solved {
    /// Reads `s.sol` and the mesh `s.mesh` beside it.
    pub fn read(path: &Path) -> Result<Solved> {
        let mesh_path = path.with_extension("mesh");
        let (mesh, _, mesh_digest) = Mesh::read(&mesh_path)?;
        let (solution, _, origins, digest) = Solution::read(path)?;
        Solution::belongs_to(path, &origins, &mesh_path, mesh_digest)?;
        Ok(Solved { path: path.into(), mesh, solution, digest })
    }

    /// Refuses a solution on another mesh than `base`, which these flags make.
    pub fn check(&self, base: &Mesh) -> Result<()> {
        if *base == self.mesh {
            return Ok(());
        }
        Err(Error::Mismatch {
            first: self.path.clone(),
            second: self.path.with_extension("mesh"),
            detail: "the solution's mesh is not the one that the other flags make of this scene".into(),
            remedy: "give the flags that the first mesh was built with, and --refine-with besides".into(),
        })
    }

    /// Faces that send most light without emitting themselves, the strongest first.
    pub fn brightest(&self, count: usize) -> Vec<u32> {
        let mut power = vec![0.0; self.mesh.face_count()];
        for element in self.mesh.element_ids() {
            let area = polygon::area(&self.mesh.element_corners(element));
            power[self.mesh.element_face(element).index()] +=
                area * mean(self.solution.radiosity[element.index()]);
        }
        let emits = |face: usize| self.mesh.face_flags[face] & interchange::mesh::FACE_EMITS != 0;
        let mut faces: Vec<usize> = (0..power.len()).filter(|&f| power[f] > 0.0 && !emits(f)).collect();
        faces.sort_by(|&a, &b| power[b].total_cmp(&power[a]).then(a.cmp(&b)));
        faces.into_iter().take(count).map(|face| face as u32).collect()
    }

    /// Divides the elements of `meshes` that the solution describes badly. `tolerance` is part of the mean irradiance,
    /// `weld` the length below which places are one. Errors name the layer.
    pub fn refine(
        &self,
        drawings: &[Drawing],
        meshes: &mut [Triangles],
        tolerance: f64,
        weld: f64,
        report: &mut Report,
    ) -> std::result::Result<(), (usize, Trouble)> {
        let mut places = Places::new(DVec3::ZERO, 8.0 * weld);
        let mut elements: HashMap<(u32, u32, u32), usize> = HashMap::new();
        for element in self.mesh.element_ids() {
            let centre = polygon::mean_corner(&self.mesh.element_corners(element));
            let FaceId(face) = self.mesh.element_face(element);
            let side = self.mesh.element_sides[element.index()];
            elements.insert((places.insert(centre), face, side), element.index());
        }
        let mut triangles: Vec<(usize, usize, [DVec3; 3], usize)> = Vec::new();
        for (layer, (mesh, drawing)) in meshes.iter().zip(drawings).enumerate() {
            for (t, corners) in mesh.elements() {
                let centre = polygon::mean_corner(&corners);
                let Some(sheet) = mesh.sheet(t) else { continue };
                let sheet = &drawing.layer().sheets[sheet as usize];
                // What lines of secondary sources cut anew has no value yet, and is small already.
                if let Some(&element) = elements.get(&(places.insert(centre), sheet.face, sheet.side)) {
                    triangles.push((layer, t, corners, element));
                }
            }
        }
        let areas: Vec<f64> =
            self.mesh.element_ids().map(|e| polygon::area(&self.mesh.element_corners(e))).collect();
        let irradiance = |element: usize| mean(self.solution.irradiance[element]);
        let whole: f64 = areas.iter().sum();
        let level = (0..areas.len()).map(|e| areas[e] * irradiance(e)).sum::<f64>() / whole;
        let gatherer = self.gatherer();
        let bar = progress("test points", triangles.len());
        let errors: Vec<f64> = triangles
            .par_iter()
            .map_init(Scratch::default, |scratch, &(layer, _, corners, element)| {
                bar.inc(1);
                let normal = drawings[layer].normal();
                let centre = polygon::mean_corner(&corners);
                let mut gathered = |point: DVec3| {
                    let mut sum = 0.0;
                    gatherer.factors(point, normal, scratch, &mut |from, factor| {
                        sum += factor * mean(self.solution.radiosity[from]);
                    });
                    sum
                };
                let own = irradiance(element);
                let miss = |light: f64| (light - own).abs() / level;
                let corners = corners.map(|corner| gathered(centre.lerp(corner, CORNER)));
                let at_centre = gathered(centre);
                // What linear interpolation misses counts whole, what the constant misses by its mean.
                let linear = (at_centre - corners.iter().sum::<f64>() / 3.0).abs() / level;
                linear.max(corners.into_iter().chain([at_centre]).map(miss).sum::<f64>() / 4.0)
            })
            .collect();
        let mut order: Vec<usize> = (0..errors.len()).filter(|&k| errors[k] > tolerance).collect();
        report.count("elements whose solution misses the tolerance", order.len());
        let rank = |k: usize| errors[k] * (areas[triangles[k].3] / whole).sqrt();
        order.sort_by(|&a, &b| rank(b).total_cmp(&rank(a)).then(a.cmp(&b)));
        order.truncate(((GROWTH - 1.0) * areas.len() as f64 / ADDED).ceil() as usize);
        let mut marked: Vec<Vec<usize>> = vec![Vec::new(); meshes.len()];
        order.iter().for_each(|&k| marked[triangles[k].0].push(triangles[k].1));
        report.count("elements divided for the solution", order.len());
        report.estimate(
            "mean error of the solution at test points",
            errors.iter().zip(&triangles).map(|(e, t)| e * areas[t.3]).sum::<f64>() / whole,
        );
        meshes.par_iter_mut().zip(drawings).zip(&marked).enumerate().try_for_each(
            |(layer, ((mesh, drawing), marked))| match marked.is_empty() {
                true => Ok(()),
                false => {
                    drawing.halve(mesh, marked, LONG, 0.0).map(|_| ()).map_err(|trouble| (layer, trouble))
                }
            },
        )
    }

    fn gatherer(&self) -> Gatherer {
        let positions: Vec<DVec3> = self.mesh.vertices.iter().copied().map(DVec3::from_array).collect();
        let pieces = self.mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
        let elements = self.mesh.element_ids().map(|e| self.mesh.element_corners(e)).collect();
        Gatherer::new(merged_occluders(pieces, &positions), elements)
    }
}

fn mean([r, g, b]: [f64; 3]) -> f64 {
    (r + g + b) / 3.0
}
