//! Exact form factor from a point to a polygon: Lambert's contour formula (Lambert 1760; Baum, Rushmeier & Winget 89).
//!
//! F = 1/(2 pi) sum over edges of gamma_k n . (r_k x r_k+1)/|r_k x r_k+1|, with r_k the corner seen from the point and
//! gamma_k the angle the edge subtends. The angle comes from atan2: acos loses half the digits near 0 and pi.
//!
//! # Precision
//! Terms are of size s/d and add up to s^2/d^2 for a polygon of size s at distance d: relative error about epsilon d/s.

use crate::polygon;
use glam::DVec3;
use std::f64::consts::TAU;

/// Form factor from a surface element at `point` with unit `normal` to the front of a polygon that lies wholly at or
/// above the element's horizon; between 0 and 1. A polygon seen from behind gives the negative of its mirror image.
///
/// On an edge or corner of the polygon the value is one of the possible limits: callers move the point inward first.
pub fn above_horizon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let Some(&last) = corners.last() else { return 0.0 };
    let mut before = last - point;
    let mut sum = 0.0;
    for &corner in corners {
        let after = corner - point;
        let cross = before.cross(after);
        sum += angle_over_sine(cross.length_squared(), before.dot(after)) * normal.dot(cross);
        before = after;
    }
    // Seen from the front the polygon runs counter-clockwise for an eye on its normal's side: the sum is negative.
    -sum / TAU
}

/// Squared tangents up to which the series of [`angle_over_sine`] is used, with 6 and with 12 terms: the next term,
/// u^n / (2n + 1), is below the rounding of the first.
const FEW_TERMS: f64 = 0.003;
const MANY_TERMS: f64 = 0.06;

/// atan2(s, d) / s for s = sqrt(`sine_squared`): the angle between two vectors over the length of their cross product.
/// The angles of edges seen from afar are small: their series needs neither root nor arc tangent.
pub(crate) fn angle_over_sine(sine_squared: f64, dot: f64) -> f64 {
    let dot_squared = dot * dot;
    if dot > 0.0 && sine_squared < MANY_TERMS * dot_squared {
        let inverse = 1.0 / dot;
        let u = sine_squared * inverse * inverse;
        let few =
            1.0 + u * (-1.0 / 3.0 + u * (1.0 / 5.0 + u * (-1.0 / 7.0 + u * (1.0 / 9.0 + u * (-1.0 / 11.0)))));
        if u < FEW_TERMS {
            return inverse * few;
        }
        let v = u * u;
        let high = 1.0 / 13.0
            + u * (-1.0 / 15.0
                + u * (1.0 / 17.0
                    + u * (-1.0 / 19.0 + u * (1.0 / 21.0 + u * (-1.0 / 23.0 + u * (1.0 / 25.0))))));
        return inverse * (few + v * v * v * high);
    }
    let sine = sine_squared.sqrt();
    if sine > 0.0 { sine.atan2(dot) / sine } else { 0.0 }
}

/// As [`above_horizon`], for a convex polygon that may reach below the horizon: that part is cut off first.
/// `scratch` is overwritten.
pub fn point_factor(point: DVec3, normal: DVec3, corners: &[DVec3], scratch: &mut Vec<DVec3>) -> f64 {
    let height = |p: DVec3| normal.dot(p - point);
    if corners.iter().all(|&corner| height(corner) >= 0.0) {
        return above_horizon(point, normal, corners);
    }
    polygon::clip_by(corners, height, scratch);
    above_horizon(point, normal, scratch)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down_square(z: f64) -> Vec<DVec3> {
        [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(x, y)| DVec3::new(x, y, z)).to_vec()
    }

    fn close(got: f64, want: f64, relative: f64) {
        assert!((got - want).abs() <= relative * want.abs(), "got {got}, want {want}");
    }

    #[test]
    fn the_series_of_small_angles_joins_the_arc_tangent() {
        for k in 0..4000 {
            let tangent = 0.3 * f64::from(k + 1) / 4000.0;
            let want = tangent.atan() / tangent;
            close(angle_over_sine(tangent * tangent, 1.0), want, 4e-16);
        }
    }

    #[test]
    fn element_under_a_corner_and_close_under_the_centre() {
        let scratch = &mut Vec::new();
        close(
            point_factor(DVec3::ZERO, DVec3::Z, &down_square(1.0), scratch),
            0.138_531_605_994_892_996_78,
            1e-15,
        );
        let centre = DVec3::new(0.5, 0.5, 0.0);
        close(
            point_factor(centre, DVec3::Z, &down_square(1e-3), scratch),
            0.999_996_726_771_548_184_34,
            1e-15,
        );
    }

    #[test]
    fn element_that_cuts_the_polygon_with_its_horizon() {
        let (point, normal) = (DVec3::new(0.25, 0.75, 0.0), DVec3::ONE.normalize());
        close(
            point_factor(point, normal, &down_square(0.5), &mut Vec::new()),
            0.263_122_619_208_100_201,
            1e-15,
        );
    }

    #[test]
    fn far_triangle_keeps_its_digits() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (point, normal) = (DVec3::new(3.0, 4.0, 5.0), -DVec3::ONE.normalize());
        close(point_factor(point, normal, &triangle, &mut Vec::new()), 0.002_501_744_354_202_613_284, 1e-14);
    }

    #[test]
    fn limits_at_a_perpendicular_wall_are_one_half_and_one_quarter() {
        // A wall on x = 0, |y| <= 1, 0 <= z <= 1 facing +x, seen from the floor beside its foot.
        let wall = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)].map(|(y, z)| DVec3::new(0.0, y, z));
        let seen = |x: f64, y: f64| point_factor(DVec3::new(x, y, 0.0), DVec3::Z, &wall, &mut Vec::new());
        for x in [1e-6, 1e-9, 1e-12] {
            assert!((seen(x, 0.0) - 0.5).abs() < x);
            assert!((seen(x, 1.0) - 0.25).abs() < x);
        }
    }
}
