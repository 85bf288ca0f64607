//! Planar polygons as slices of corners, counter-clockwise seen from the front.

use crate::plane::Plane;
use glam::DVec3;

/// Half the sum of the corners' cross products: normal times area (Newell), exact for non-convex polygons too.
pub fn vector_area(corners: &[DVec3]) -> DVec3 {
    let Some(&origin) = corners.first() else { return DVec3::ZERO };
    let twice =
        corners.windows(2).fold(DVec3::ZERO, |sum, edge| sum + (edge[0] - origin).cross(edge[1] - origin));
    0.5 * twice
}

/// Area.
pub fn area(corners: &[DVec3]) -> f64 {
    vector_area(corners).length()
}

/// Mean of the corners.
pub fn mean_corner(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / corners.len().max(1) as f64
}

/// Centre of gravity; the mean corner where the area is zero.
pub fn centroid(corners: &[DVec3]) -> DVec3 {
    let Some(&origin) = corners.first() else { return DVec3::ZERO };
    let normal = vector_area(corners).normalize_or_zero();
    let (mut moment, mut total) = (DVec3::ZERO, 0.0);
    for edge in corners.windows(2) {
        let (a, b) = (edge[0] - origin, edge[1] - origin);
        let weight = a.cross(b).dot(normal);
        moment += weight * (a + b) / 3.0;
        total += weight;
    }
    if total > 0.0 { origin + moment / total } else { mean_corner(corners) }
}

/// Principal axes of a planar polygon's second moments about its `centre`: the mean of (x - c)(x - c)^T is the sum of
/// t t^T over the two vectors t.
pub fn principal_axes(corners: &[DVec3], centre: DVec3, normal: DVec3) -> (DVec3, DVec3) {
    let (x, y) = normal.any_orthonormal_pair();
    let (mut total, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0);
    for (a, b) in edges(corners) {
        // The triangle with the centre: mean of a product of coordinates is (sum of both corners' and of the sum's) / 12.
        let (a, b) = (a - centre, b - centre);
        let weight = a.cross(b).dot(normal);
        let [(ax, ay), (bx, by)] = [a, b].map(|v| (v.dot(x), v.dot(y)));
        total += weight;
        xx += weight * (ax * ax + bx * bx + (ax + bx) * (ax + bx)) / 12.0;
        xy += weight * (ax * ay + bx * by + (ax + bx) * (ay + by)) / 12.0;
        yy += weight * (ay * ay + by * by + (ay + by) * (ay + by)) / 12.0;
    }
    if total <= 0.0 {
        return (DVec3::ZERO, DVec3::ZERO);
    }
    let (xx, xy, yy) = (xx / total, xy / total, yy / total);
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sine, cosine) = angle.sin_cos();
    let along = xx * cosine * cosine + 2.0 * xy * sine * cosine + yy * sine * sine;
    let across = xx * sine * sine - 2.0 * xy * sine * cosine + yy * cosine * cosine;
    ((x * cosine + y * sine) * along.max(0.0).sqrt(), (y * cosine - x * sine) * across.max(0.0).sqrt())
}

/// Corner and two sides where the polygon is a parallelogram to rounding.
pub fn parallelogram(corners: &[DVec3]) -> Option<(DVec3, DVec3, DVec3)> {
    let &[a, b, c, d] = corners else { return None };
    let (u, v) = (b - a, d - a);
    // Sums of three coordinates each: a few roundings of the coordinates' size relative to the polygon.
    let rounding = 8.0 * f64::EPSILON * (a.abs() + b.abs() + c.abs() + d.abs()).max_element();
    ((a + c - b - d).abs().max_element() <= rounding).then_some((a, u, v))
}

/// Length of the diagonal of the bounding box: between the diameter and sqrt(3) times it.
pub fn diameter(corners: &[DVec3]) -> f64 {
    let Some(&first) = corners.first() else { return 0.0 };
    let (low, high) = corners.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    (high - low).length()
}

/// Directed edges, the last one back to the first corner.
pub fn edges(corners: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&a, &b)| (a, b))
}

/// Whether every corner turns left (or goes straight on, to `straightness` radians) seen against `normal`.
pub fn is_convex(corners: &[DVec3], normal: DVec3, straightness: f64) -> bool {
    let n = corners.len();
    (0..n).all(|k| {
        let (before, after) =
            (corners[(k + 1) % n] - corners[k], corners[(k + 2) % n] - corners[(k + 1) % n]);
        before.cross(after).dot(normal) >= -straightness * before.length() * after.length()
    }) && turning_number_is_one(corners, normal)
}

/// Whether the edges turn once around in all (a pentagram turns left at every corner, but twice around).
fn turning_number_is_one(corners: &[DVec3], normal: DVec3) -> bool {
    let n = corners.len();
    let turn: f64 = (0..n)
        .map(|k| {
            let (before, after) =
                (corners[(k + 1) % n] - corners[k], corners[(k + 2) % n] - corners[(k + 1) % n]);
            before.cross(after).dot(normal).atan2(before.dot(after))
        })
        .sum();
    turn.abs() < 1.5 * std::f64::consts::TAU
}

/// Appends to `out` the part of a convex polygon in front of `plane` (Sutherland & Hodgman 74, one plane).
/// `out` is cleared first and stays empty where nothing is strictly in front.
pub fn clip_to_front(corners: &[DVec3], plane: &Plane, out: &mut Vec<DVec3>) {
    clip_by(corners, |p| plane.distance(p), out);
}

/// As [`clip_to_front`], for any function that is affine along the edges: keeps where it is positive.
pub fn clip_by(corners: &[DVec3], height: impl Fn(DVec3) -> f64, out: &mut Vec<DVec3>) {
    out.clear();
    let Some(&last) = corners.last() else { return };
    let (mut a, mut height_a, mut any_front) = (last, height(last), false);
    for &b in corners {
        let height_b = height(b);
        any_front |= height_b > 0.0;
        // A crossing strictly between the ends; a corner on the plane is its own crossing.
        if (height_a > 0.0 && height_b < 0.0) || (height_a < 0.0 && height_b > 0.0) {
            out.push(a + (b - a) * (height_a / (height_a - height_b)));
        }
        if height_b >= 0.0 {
            out.push(b);
        }
        (a, height_a) = (b, height_b);
    }
    if !any_front || out.len() < 3 {
        out.clear();
    }
}

/// Cuts a convex polygon in two, by the heights of its corners over some line, of which some are above 0 and some below:
/// `front` becomes the part above, the part below is appended to `back`.
pub fn cut_in_two(corners: &[DVec3], heights: &[f64], front: &mut Vec<DVec3>, back: &mut Vec<DVec3>) {
    front.clear();
    let (Some(&a), Some(&height)) = (corners.last(), heights.last()) else { return };
    let (mut a, mut height_a) = (a, height);
    for (&b, &height_b) in corners.iter().zip(heights) {
        if (height_a > 0.0 && height_b < 0.0) || (height_a < 0.0 && height_b > 0.0) {
            let crossing = a + (b - a) * (height_a / (height_a - height_b));
            front.push(crossing);
            back.push(crossing);
        }
        if height_b >= 0.0 {
            front.push(b);
        }
        if height_b <= 0.0 {
            back.push(b);
        }
        (a, height_a) = (b, height_b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<DVec3> {
        [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec()
    }

    #[test]
    fn square_has_area_centroid_and_normal() {
        assert_eq!(vector_area(&square()), DVec3::new(0.0, 0.0, 4.0));
        assert_eq!(centroid(&square()), DVec3::new(1.0, 1.0, 1.0));
        assert!(is_convex(&square(), DVec3::Z, 0.0));
    }

    #[test]
    fn principal_axes_have_the_second_moments() {
        // A rectangle of sides 2 and 1, turned: variances 4 / 12 and 1 / 12 along its sides.
        let turn = |x: f64, y: f64| DVec3::new(0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, 5.0);
        let corners = [turn(0.0, 0.0), turn(2.0, 0.0), turn(2.0, 1.0), turn(0.0, 1.0)];
        let (a, b) = principal_axes(&corners, centroid(&corners), DVec3::Z);
        let mut lengths = [a.length_squared(), b.length_squared()];
        lengths.sort_by(f64::total_cmp);
        assert!((lengths[0] - 1.0 / 12.0).abs() < 1e-15 && (lengths[1] - 4.0 / 12.0).abs() < 1e-15);
        assert!(a.dot(b).abs() < 1e-15);
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (a, b) = principal_axes(&triangle, centroid(&triangle), DVec3::Z);
        // Mean of (x - 1/3)^2 over the triangle: 1/18; of the product with y: -1/36.
        assert!((a.x * a.x + b.x * b.x - 1.0 / 18.0).abs() < 1e-15);
        assert!((a.x * a.y + b.x * b.y + 1.0 / 36.0).abs() < 1e-15);
    }

    #[test]
    fn clipping_keeps_the_front_and_drops_what_only_touches() {
        let plane = Plane { normal: DVec3::X, origin: DVec3::new(0.5, 0.0, 0.0) };
        let mut out = Vec::new();
        clip_to_front(&square(), &plane, &mut out);
        assert_eq!(area(&out), 3.0);
        clip_to_front(&square(), &Plane { normal: DVec3::X, origin: DVec3::new(2.0, 0.0, 0.0) }, &mut out);
        assert!(out.is_empty());
        clip_to_front(&square(), &Plane { normal: DVec3::X, origin: DVec3::ZERO }, &mut out);
        assert_eq!(area(&out), 4.0);
    }

    #[test]
    fn concave_and_star_polygons_are_not_convex() {
        let mut arrow = square();
        arrow[2] = DVec3::new(0.5, 0.5, 1.0);
        assert!(!is_convex(&arrow, DVec3::Z, 0.0));
        let pentagram: Vec<DVec3> = (0..5)
            .map(|k| {
                DVec3::new(
                    (f64::from(k) * 144.0).to_radians().cos(),
                    (f64::from(k) * 144.0).to_radians().sin(),
                    0.0,
                )
            })
            .collect();
        assert!(!is_convex(&pentagram, DVec3::Z, 0.0));
    }
}
