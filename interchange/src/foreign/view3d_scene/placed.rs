//! Surfaces of View3D's format 3a: flat shapes, turned by an azimuth and a tilt and moved to a place.

use glam::DVec3;

/// Where a shape's own coordinates lie: x to the right and y up, seen from its front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placing {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Placing {
    /// The azimuth turns the front from +y towards +x; the tilt is 0 for one that looks up, 90 for a wall, 180 for one that
    /// looks down. Both in degrees.
    pub(super) fn new([x, y, z, azimuth, tilt]: [f64; 5]) -> Self {
        let ((sin_a, cos_a), (sin_t, cos_t)) = (sin_cos_deg(azimuth), sin_cos_deg(tilt));
        let normal = DVec3::new(sin_a * sin_t, cos_a * sin_t, cos_t);
        let right = DVec3::new(-cos_a, sin_a, 0.0);
        Self { origin: DVec3::new(x, y, z), right, up: normal.cross(right) }
    }

    /// A point of the shape in space.
    pub(super) fn point(&self, x: f64, y: f64) -> DVec3 {
        self.origin + x * self.right + y * self.up
    }
}

/// Exact for whole right angles, which most rooms are made of.
fn sin_cos_deg(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_floors_and_ceilings_lie_where_they_should() {
        // A wall that looks to +y: to its right is -x.
        let wall = Placing::new([3.0, 0.0, 0.0, 0.0, 90.0]);
        assert_eq!(wall.point(3.0, 2.0), DVec3::new(0.0, 0.0, 2.0));
        let east = Placing::new([0.0, 0.0, 0.0, 90.0, 90.0]);
        assert_eq!(east.point(3.0, 2.0), DVec3::new(0.0, 3.0, 2.0));
        let ceiling = Placing::new([3.0, 0.0, 3.0, 0.0, 180.0]);
        assert_eq!(ceiling.point(2.0, 1.0), DVec3::new(1.0, 1.0, 3.0));
        let floor = Placing::new([0.0, 0.0, 0.0, 180.0, 0.0]);
        assert_eq!(floor.point(2.0, 1.0), DVec3::new(2.0, 1.0, 0.0));
    }

    #[test]
    fn slanted_shapes_keep_their_size() {
        let roof = Placing::new([0.0, 0.0, 0.0, 30.0, 40.0]);
        let [right, up] = [roof.point(1.0, 0.0), roof.point(0.0, 1.0)];
        assert!((right.length() - 1.0).abs() < 1e-15 && (up.length() - 1.0).abs() < 1e-15);
        assert!(right.dot(up).abs() < 1e-15);
        // Its front looks up, and to an azimuth of 30 degrees.
        let front = right.cross(up);
        assert!((front.z - 40f64.to_radians().cos()).abs() < 1e-15);
        assert!((front.x / front.y - 30f64.to_radians().tan()).abs() < 1e-15);
    }
}
