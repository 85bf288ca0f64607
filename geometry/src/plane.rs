//! Planes, and the side of a plane that a point or polygon lies on.

use crate::polygon;
use glam::DVec3;

/// Corners within this part of a polygon's diameter of its plane count as lying on it: the roundings of a vertex
/// given with 7 to 16 digits, scaled and rotated by a modelling program, stay well below it.
pub const PLANARITY: f64 = 1e-9;

/// The points x with `normal . x = offset`; `normal` has length 1 and points to the front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// A point of the plane: distances are taken from it, so that a scene far from the origin loses no digits.
    pub origin: DVec3,
}

/// Where a set of points lies, relative to a plane and a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// All at or in front of the plane, some strictly.
    Front,
    /// All at or behind it, some strictly.
    Back,
    /// All on the plane.
    On,
    /// Some in front, some behind.
    Both,
}

impl Plane {
    /// Plane of a polygon by Newell's vector area, through its centroid; `None` where the area is zero to rounding.
    pub fn of_polygon(corners: &[DVec3]) -> Option<Plane> {
        let vector_area = polygon::vector_area(corners);
        let area = vector_area.length();
        let diameter = polygon::diameter(corners);
        // Rounding of the cross products is about epsilon times diameter squared.
        let significant = area > 8.0 * f64::EPSILON * diameter * diameter;
        significant.then(|| Plane { normal: vector_area / area, origin: polygon::mean_corner(corners) })
    }

    /// Signed distance of `point`, positive in front.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.origin)
    }

    /// The same points, front and back exchanged.
    pub fn flipped(&self) -> Plane {
        Plane { normal: -self.normal, origin: self.origin }
    }

    /// Side of `points`, those within `tolerance` (a length) counting as on the plane.
    pub fn side(&self, points: &[DVec3], tolerance: f64) -> Side {
        let (mut front, mut back) = (false, false);
        for &point in points {
            let distance = self.distance(point);
            front |= distance > tolerance;
            back |= distance < -tolerance;
        }
        match (front, back) {
            (true, true) => Side::Both,
            (true, false) => Side::Front,
            (false, true) => Side::Back,
            (false, false) => Side::On,
        }
    }

    /// Foot of the perpendicular from `point`.
    pub fn project(&self, point: DVec3) -> DVec3 {
        point - self.distance(point) * self.normal
    }

    /// Two unit vectors that span the plane and with the normal make a right-handed frame.
    pub fn axes(&self) -> (DVec3, DVec3) {
        self.normal.any_orthonormal_pair()
    }
}
