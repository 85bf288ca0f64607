//! Weights of a convex polygon's corners at a point within it: areal coordinates in a triangle, mean value coordinates
//! otherwise (Floater 2003; evaluated as Hormann & Floater 2006). Both reproduce linear functions, are linear along
//! edges, so that neighbours agree there, and are never negative within.
//!
//! A fan of triangles, the simpler choice for more than three corners, would draw its diagonals.

use glam::DVec2;

/// A point within this part of the polygon's size of an edge counts as on it: a hit point in the plane of its face
/// is known to about 1e-15 of the scene, which may be a million times larger than the element.
const ON_EDGE: f64 = 1e-9;

/// Writes the weight of every corner to `weights`; they sum to 1. `corners` run counter-clockwise; a point outside,
/// by rounding, counts as the nearest one of the border.
pub fn corner_weights(corners: &[DVec2], point: DVec2, weights: &mut Vec<f64>) {
    weights.clear();
    weights.resize(corners.len(), 0.0);
    if !on_border(corners, point, weights) {
        if let [a, b, c] = *corners {
            let areas = [
                (b - point).perp_dot(c - point),
                (c - point).perp_dot(a - point),
                (a - point).perp_dot(b - point),
            ];
            weights.copy_from_slice(&areas);
        } else {
            mean_value_weights(corners, point, weights);
        }
    }
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
}

/// Weights of a triangle's six nodes, three corners and the middles of edges 0-1, 1-2 and 2-0, at the point where
/// `areal` are its areal coordinates: the quadratic that is 1 at its node and 0 at the others.
pub fn quadratic_weights(areal: &[f64]) -> [f64; 6] {
    let corner = |k: usize| areal[k] * (2.0 * areal[k] - 1.0);
    let middle = |k: usize| 4.0 * areal[k] * areal[(k + 1) % 3];
    [corner(0), corner(1), corner(2), middle(0), middle(1), middle(2)]
}

/// Where the point is on an edge or outside of it: weights along that edge.
fn on_border(corners: &[DVec2], point: DVec2, weights: &mut [f64]) -> bool {
    let n = corners.len();
    let size =
        corners.iter().fold(0.0, |size: f64, &corner| size.max(corner.distance_squared(corners[0]))).sqrt();
    let mut nearest: Option<(f64, usize, f64)> = None;
    let mut outside = false;
    for k in 0..n {
        let (a, edge) = (corners[k], corners[(k + 1) % n] - corners[k]);
        if edge == DVec2::ZERO {
            continue;
        }
        outside |= edge.perp_dot(point - a) < ON_EDGE * size * edge.length();
        let along = ((point - a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        let distance = point.distance_squared(a + along * edge);
        if nearest.is_none_or(|(least, ..)| distance < least) {
            nearest = Some((distance, k, along));
        }
    }
    match nearest {
        Some((_, k, along)) if outside => {
            weights[k] = 1.0 - along;
            weights[(k + 1) % n] = along;
            true
        }
        _ => false,
    }
}

/// w_i = (tan(alpha_(i-1) / 2) + tan(alpha_i / 2)) / r_i, alpha_i the angle under which edge i is seen.
fn mean_value_weights(corners: &[DVec2], point: DVec2, weights: &mut [f64]) {
    let n = corners.len();
    for k in 0..n {
        let next = (k + 1) % n;
        let (a, b) = (corners[k] - point, corners[next] - point);
        let (r_a, r_b) = (a.length(), b.length());
        // tan(alpha / 2) = sin / (1 + cos): no cancellation but near alpha = pi, which is an edge's own line.
        let half_tangent = a.perp_dot(b) / (r_a * r_b + a.dot(b));
        weights[k] += half_tangent / r_a;
        weights[next] += half_tangent / r_b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(n: usize) -> Vec<DVec2> {
        (0..n)
            .map(|k| DVec2::from_angle(std::f64::consts::TAU * k as f64 / n as f64) * DVec2::new(3.0, 1.0))
            .collect()
    }

    #[test]
    fn linear_functions_are_reproduced_everywhere() {
        let mut weights = Vec::new();
        for n in [3, 4, 5, 8] {
            let corners = polygon(n);
            for (s, t, k) in
                [(0.1, 0.2, 0), (0.3, 0.3, 1), (0.9, 0.05, 2), (0.0, 0.0, 0), (0.999999, 1e-9, 1)]
            {
                let point = (1.0 - s - t) * corners[k] + s * corners[(k + 1) % n] + t * corners[(k + 2) % n];
                corner_weights(&corners, point, &mut weights);
                let back: DVec2 = weights.iter().zip(&corners).map(|(&w, &corner)| w * corner).sum();
                assert!(back.distance(point) < 1e-8, "{n} corners: {back} for {point}");
                assert!(weights.iter().all(|&w| (0.0..=1.0 + 1e-15).contains(&w)), "{weights:?}");
            }
        }
    }

    #[test]
    fn edges_are_linear_and_corners_are_their_own() {
        let mut weights = Vec::new();
        for n in [3, 4, 7] {
            let corners = polygon(n);
            for k in 0..n {
                corner_weights(&corners, corners[k], &mut weights);
                assert!((weights[k] - 1.0).abs() < 1e-12);
                let point = corners[k].lerp(corners[(k + 1) % n], 0.3);
                // On the edge, and off it by less and more than counts as on it.
                for off in [0.0, 1e-12, 1e-7, -1e-7] {
                    corner_weights(&corners, point * (1.0 - off), &mut weights);
                    assert!((weights[k] - 0.7).abs() < 1e-5, "{n} {k} {off}: {weights:?}");
                    assert!((weights[(k + 1) % n] - 0.3).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn six_nodes_reproduce_quadratics() {
        let f = |x: f64, y: f64| 1.0 + 2.0 * x - y + 3.0 * x * x - x * y + 0.5 * y * y;
        let nodes = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)];
        for (x, y) in [(0.2, 0.3), (0.0, 0.7), (1.0 / 3.0, 1.0 / 3.0), (0.5, 0.0)] {
            let weights = quadratic_weights(&[1.0 - x - y, x, y]);
            let got: f64 = weights.iter().zip(nodes).map(|(w, (x, y))| w * f(x, y)).sum();
            assert!((got - f(x, y)).abs() < 1e-14, "{got}");
        }
    }

    #[test]
    fn centre_of_a_square_weighs_its_corners_alike() {
        let mut weights = Vec::new();
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        corner_weights(&square, DVec2::splat(0.5), &mut weights);
        assert!(weights.iter().all(|w| (w - 0.25).abs() < 1e-15));
    }

    /// A corner on a straight line, as conforming meshing leaves it, neither divides by zero nor loses its weight.
    #[test]
    fn straight_corner_is_one_like_others() {
        let mut weights = Vec::new();
        let corners =
            [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        corner_weights(&corners, DVec2::new(1.0, 0.0), &mut weights);
        assert!((weights[1] - 1.0).abs() < 1e-12);
        corner_weights(&corners, DVec2::new(1.5, 0.0), &mut weights);
        assert!((weights[1] - 0.5).abs() < 1e-12 && (weights[2] - 0.5).abs() < 1e-12);
    }
}
