//! Coordinates within a plane: centred on it and divided by the size of what lies there, so that triangulation
//! sees numbers of order one whatever the scene's unit.

use geometry::plane::Plane;
use geometry::polygon;
use glam::{DVec2, DVec3};

/// Steps of the coordinates in a unit of the frame, 2^40: a step is 1e-12.
const STEPS: f64 = 1_099_511_627_776.0;

/// A right-handed frame in a plane.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// The plane; its origin is that of the frame.
    pub plane: Plane,
    /// Length of one unit of the frame.
    pub size: f64,
    x: DVec3,
    y: DVec3,
}

impl Frame {
    /// The frame of `plane` for polygons lying in it. Its first axis runs along their longest edge, so that a
    /// lattice of points lies along the walls.
    pub fn new<'a>(plane: &Plane, polygons: impl Iterator<Item = &'a [DVec3]>) -> Frame {
        let (mut longest, mut points) = (DVec3::ZERO, Vec::new());
        for corners in polygons {
            points.extend_from_slice(corners);
            for (a, b) in polygon::edges(corners) {
                // The first of (nearly) equal edges, so that rounding does not choose.
                if (b - a).length() > 1.000001 * longest.length() {
                    longest = b - a;
                }
            }
        }
        let along = (longest - longest.dot(plane.normal) * plane.normal).normalize_or_zero();
        let x = if along == DVec3::ZERO { plane.axes().0 } else { along };
        Frame { plane: *plane, size: polygon::diameter(&points), x, y: plane.normal.cross(x) }
    }

    /// Coordinates of the foot of `point`.
    pub fn flatten(&self, point: DVec3) -> DVec2 {
        let offset = (point - self.plane.origin) / self.size;
        DVec2::new(offset.dot(self.x), offset.dot(self.y))
    }

    /// The point with these coordinates.
    pub fn lift(&self, uv: DVec2) -> DVec3 {
        self.plane.origin + self.size * (uv.x * self.x + uv.y * self.y)
    }
}

/// Coordinates in steps far below the weld tolerance and far above rounding: a scene in another unit, whose coordinates
/// differ in their last digits, has the same.
pub fn stepped(uv: DVec2) -> DVec2 {
    (uv * STEPS).round() / STEPS
}

/// Twice the signed area of a triangle, positive where it runs counter-clockwise.
pub fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether `point` lies inside a polygon (odd number of crossings of a ray); undefined within rounding of its border.
pub fn contains(polygon: &[DVec2], point: DVec2) -> bool {
    let mut inside = false;
    for (k, &b) in polygon.iter().enumerate() {
        let a = polygon[(k + polygon.len() - 1) % polygon.len()];
        if (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y) {
            inside = !inside;
        }
    }
    inside
}

/// Place along the segment (0 at `a`, 1 at `b`) nearest to `point`, and the distance there.
pub fn nearest_on_segment(a: DVec2, b: DVec2, point: DVec2) -> (f64, f64) {
    let along = b - a;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((point - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (t, point.distance(a + t * along))
}

/// A pair of edges of a polygon, by the index of their first corner, that cross each other by more than `tolerance`;
/// `None` for simple polygons and for those that only touch themselves (a hole joined to the rim by a seam).
pub fn crossing_edges(polygon: &[DVec2], tolerance: f64) -> Option<(usize, usize)> {
    let n = polygon.len();
    let edge = |k: usize| (polygon[k], polygon[(k + 1) % n]);
    let straddles = |(a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)| {
        let limit = tolerance * a.distance(b);
        let (side_c, side_d) = (turn(a, b, c), turn(a, b, d));
        (side_c > limit && side_d < -limit) || (side_c < -limit && side_d > limit)
    };
    (0..n)
        .flat_map(|i| (i + 1..n).map(move |j| (i, j)))
        .find(|&(i, j)| straddles(edge(i), edge(j)) && straddles(edge(j), edge(i)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn frame_takes_points_there_and_back_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let corners = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)]
                .map(|(x, y)| scale * DVec3::new(x, 2.0 * y, 1.0 + y));
            let plane = Plane::of_polygon(&corners).unwrap();
            let frame = Frame::new(&plane, [corners.as_slice()].into_iter());
            for corner in corners {
                assert!(frame.lift(frame.flatten(corner)).distance(corner) <= 1e-15 * 8.0 * scale);
            }
        }
    }

    #[test]
    fn bow_tie_crosses_itself_and_keyhole_does_not() {
        let tie = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        assert_eq!(crossing_edges(&tie, 1e-9), Some((0, 2)));
        let keyhole = [
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (0.0, 3.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
        ]
        .map(|(x, y)| DVec2::new(x, y));
        assert_eq!(crossing_edges(&keyhole, 1e-9), None);
        assert!(contains(&keyhole, DVec2::new(0.5, 1.5)));
        assert!(!contains(&keyhole, DVec2::new(1.5, 1.4)));
    }
}
