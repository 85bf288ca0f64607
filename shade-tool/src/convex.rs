//! Where a point lies relative to a convex polygon in space.

use geometry::polygon;
use glam::DVec3;

/// Least signed distance of a point of the polygon's plane from the lines of the edges: positive within.
pub fn depth(corners: &[DVec3], normal: DVec3, point: DVec3) -> f64 {
    let distance = |(a, b): (DVec3, DVec3)| normal.cross((b - a).normalize_or_zero()).dot(point - a);
    polygon::edges(corners).map(distance).fold(f64::INFINITY, f64::min)
}

/// Point of the border nearest to `point`.
pub fn nearest_on_border(corners: &[DVec3], point: DVec3) -> DVec3 {
    let on_edge = |(a, b): (DVec3, DVec3)| {
        let edge = b - a;
        let along = (point - a).dot(edge) / edge.length_squared();
        if along.is_finite() { a + along.clamp(0.0, 1.0) * edge } else { a }
    };
    let nearer = |a: DVec3, b: DVec3| {
        if b.distance_squared(point) < a.distance_squared(point) { b } else { a }
    };
    polygon::edges(corners).map(on_edge).reduce(nearer).unwrap_or(point)
}

/// Point of the polygon, whose plane is `plane`, nearest to `point`.
pub fn nearest(corners: &[DVec3], plane: &geometry::plane::Plane, point: DVec3) -> DVec3 {
    let foot = plane.project(point);
    if depth(corners, plane.normal, foot) >= 0.0 { foot } else { nearest_on_border(corners, foot) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::plane::Plane;

    #[test]
    fn nearest_points_of_a_square() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let plane = Plane { normal: DVec3::Z, origin: DVec3::ZERO };
        for (point, want, inside) in [
            ((0.25, 0.5, 3.0), (0.25, 0.5, 0.0), 0.25),
            ((2.0, 0.5, -1.0), (1.0, 0.5, 0.0), -1.0),
            ((-1.0, -2.0, 0.0), (0.0, 0.0, 0.0), -2.0),
        ] {
            let (point, want) = (DVec3::from(point), DVec3::from(want));
            assert_eq!(nearest(&square, &plane, point), want);
            assert_eq!(depth(&square, DVec3::Z, plane.project(point)), inside);
        }
    }
}
