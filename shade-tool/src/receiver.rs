//! Irradiance at a point of space or of a surface: H = sum over j of F_j B_j, with the exact form factor F_j of the
//! visible part of element j.

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

/// Irradiance, W m^-2, by where it comes from: RGB from the light that lamps emit, then RGB from what surfaces reflect.
pub type Parts = [f64; 6];

/// Both parts together.
pub fn total(parts: &Parts) -> [f64; 3] {
    std::array::from_fn(|c| parts[c] + parts[c + 3])
}
