//! Irradiance at a point of space or of a surface: H = sum over j of F_j B_j, with the exact form factor F_j of the
//! visible part of element j.

use crate::lit_scene::LitScene;
use geometry::gather::{Gatherer, Scratch};
use geometry::merge::merged_occluders;
use glam::DVec3;

/// Points on the border of a face or element take the limit from inside: they are moved by this part of the way towards
/// its centroid.
///
/// Near a contact the irradiance differs from its limit by at most about (x / d) ln(d / x) of its value at distance x,
/// d being the size of what it touches: 1.4e-5 here, below what is asked of any picture. Clipping in f64 keeps 1e-16 of
/// the scene, so a move of 1e-6 within an element of 1e-4 of the scene is still known to six digits.
pub const INWARD: f64 = 1e-6;

/// The point [`INWARD`] of the way from `point` to `centroid`.
pub fn limit_from_inside(point: DVec3, centroid: DVec3) -> DVec3 {
    point + INWARD * (centroid - point)
}

/// Where irradiance is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// The point.
    pub point: DVec3,
    /// Unit normal of the plane that receives.
    pub normal: DVec3,
    /// Face that the point lies on, if any.
    pub face: Option<u32>,
}

/// Everything that can light a point.
#[derive(Debug)]
pub struct Light<'a> {
    gatherer: Gatherer,
    radiosity: &'a [[f64; 3]],
}

impl<'a> Light<'a> {
    /// The elements of the scene as sources, its faces as blockers.
    pub fn new(scene: &'a LitScene) -> Light<'a> {
        let mesh = &scene.mesh;
        let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
        let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
        let gatherer = Gatherer::new(merged_occluders(pieces, &positions), scene.sources.clone());
        Light { gatherer, radiosity: &scene.radiosity }
    }

    /// Irradiance, RGB, W m^-2.
    pub fn irradiance(&self, receiver: &Receiver, scratch: &mut Scratch) -> [f64; 3] {
        let mut irradiance = [0.0; 3];
        let mut add = |element: usize, factor: f64| {
            for (sum, b_j) in irradiance.iter_mut().zip(self.radiosity[element]) {
                *sum += factor * b_j;
            }
        };
        self.gatherer.factors(receiver.point, receiver.normal, scratch, &mut add);
        irradiance
    }
}
