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
