//! How well constant radiosity on each element stands for the true one: the residual E + rho H(x) - B at test points x,
//! with H(x) gathered exactly from all elements. An estimate, as it is sampled; named apart from the bounds.
//!
//! The largest residual stays large where elements touch an emitter however small they are: refine by the power norm.

use geometry::gather::{Gatherer, Scratch};
use geometry::occluder::Occluder;
use geometry::plane::Plane;
use geometry::quadrature::{Strength, polygon_rule};
use glam::DVec3;
use interchange::mesh::Mesh;
use interchange::tool::progress;
use rayon::prelude::*;

/// Points of each element: four on a parallelogram, three on each triangle of others. The middle alone would miss that
/// radiosity rises on one side and falls on the other.
const POINTS: Strength = Strength::Low;

/// Residuals of one element, per channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ElementResidual {
    /// Integral over the element of |E + rho H(x) - B|, W.
    pub power: [f64; 3],
    /// Largest |E + rho H(x) - B| at its points, W m^-2.
    pub largest: [f64; 3],
}

/// A point at which the residual is taken.
#[derive(Debug, Clone, Copy)]
pub struct TestPoint {
    /// Position.
    pub position: DVec3,
    /// Area it stands for.
    pub weight: f64,
}

/// The usual test points of a convex polygon.
pub fn test_points(corners: &[DVec3]) -> Vec<TestPoint> {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    polygon_rule(corners, POINTS, &mut points, &mut weights);
    points.into_iter().zip(weights).map(|(position, weight)| TestPoint { position, weight }).collect()
}

/// Radiosity and what makes it, of every element and channel.
#[derive(Debug, Clone, Copy)]
pub struct Radiosities<'a> {
    /// rho.
    pub reflectance: &'a [[f64; 3]],
    /// E.
    pub exitance: &'a [[f64; 3]],
    /// B.
    pub radiosity: &'a [[f64; 3]],
}

/// Residuals of every element of a mesh at its usual test points.
pub fn residuals(mesh: &Mesh, of: Radiosities<'_>) -> Vec<ElementResidual> {
    let pieces = (0..mesh.occluders.len()).map(|piece| mesh.occluder_corners(piece));
    let elements = mesh.element_ids().map(|e| mesh.element_corners(e)).collect();
    residuals_at(elements, pieces.filter_map(Occluder::new).collect(), test_points, of)
}

/// Residuals of convex `elements` among `occluders` at the points that `points` gives for each.
pub fn residuals_at(
    elements: Vec<Vec<DVec3>>,
    occluders: Vec<Occluder>,
    points: impl Fn(&[DVec3]) -> Vec<TestPoint> + Sync,
    of: Radiosities<'_>,
) -> Vec<ElementResidual> {
    let gatherer = Gatherer::new(occluders, elements.clone());
    let bar = progress("test points", elements.len());
    elements
        .par_iter()
        .enumerate()
        .map_init(Scratch::default, |scratch, (i, corners)| {
            bar.inc(1);
            let mut found = ElementResidual::default();
            let black = of.reflectance[i].iter().all(|&rho| rho == 0.0);
            let Some(plane) = Plane::of_polygon(corners).filter(|_| !black) else { return found };
            for point in points(corners) {
                let mut gathered = [0.0; 3];
                gatherer.factors(point.position, plane.normal, scratch, &mut |j, factor| {
                    (0..3).for_each(|c| gathered[c] += factor * of.radiosity[j][c]);
                });
                for (c, &gathered) in gathered.iter().enumerate() {
                    let sent = of.exitance[i][c] + of.reflectance[i][c] * gathered;
                    let residual = sent - of.radiosity[i][c];
                    found.power[c] += point.weight * residual.abs();
                    found.largest[c] = found.largest[c].max(residual.abs());
                }
            }
            found
        })
        .collect()
}
