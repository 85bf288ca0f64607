//! The double area integral of cos cos / (pi r^2) by Gauss points on both elements, cut into parts until the points suffice.
//!
//! Parts that touch never get far apart in units of their size: cutting stops at a depth that follows from the
//! tolerance, and there two orders are compared. So what the error of touching pairs falls with is the size of the
//! smallest parts, not its powers: this form suits pairs apart.

use geometry::area_rule::{Separation, kernel_sum};
use geometry::contour::Exchange;
use geometry::patch::{Patch, RulePoints};
use geometry::polygon;
use geometry::quadrature::Strength;

/// Orders of the product rules tried before a cut, the cheaper first.
const ORDERS: [usize; 3] = [4, 6, 8];
/// The error estimates of the rules hold up to this (R_i + R_j) / d; nearer parts are cut.
const LARGEST_THETA: f64 = 0.7;
/// Orders on either side for parts that are not cut any more, and for the second value they are compared with. Two equal
/// orders would put points of both sides opposite each other along a common edge, where the kernel is a narrow ridge: 42 % too
/// much for the faces of a cube at order 4, 30 % at order 8. At 6 and 8 it is 0.34 %, at 6 and 7 it is -5.7 %.
const LAST_ORDERS: [(usize, usize); 2] = [(6, 8), (6, 7)];
/// What these two differ by, relative to the exchange, for faces with a common edge before any cut; each halving halves it.
const TOUCHING_ERROR: f64 = 0.061;
/// Fewest and most halvings of each element.
const DEPTHS: [f64; 2] = [1.0, 8.0];

/// Exchange factor of two patches, each wholly in front of the other, within about `relative` of its value where they do
/// not touch.
pub fn area_form(p: &Patch, q: &Patch, relative: f64) -> Exchange {
    let halvings = (TOUCHING_ERROR / relative).log2().clamp(DEPTHS[0], DEPTHS[1]).ceil() as u32;
    // Each halving of both takes two cuts.
    part(p, q, relative, 2 * halvings)
}

fn part(p: &Patch, q: &Patch, relative: f64, cuts_left: u32) -> Exchange {
    let separation = Separation::new(p, q);
    let near = separation.theta > LARGEST_THETA;
    let allowed = relative * separation.value;
    let prepared = [
        (Strength::Centroid, &p.centre, &q.centre),
        (Strength::Low, &p.low, &q.low),
        (Strength::Middle, &p.middle, &q.middle),
    ];
    for (strength, points_p, points_q) in prepared {
        let error = separation.error(strength);
        if !near && error <= allowed {
            return Exchange { value: kernel_sum(points_p, p.plane.normal, points_q, q.plane.normal), error };
        }
    }
    for order in ORDERS {
        let error = separation.error(Strength::Product(order));
        if !near && error <= allowed {
            return Exchange { value: product(p, q, (order, order)), error };
        }
    }
    if cuts_left == 0 {
        let [value, other] = LAST_ORDERS.map(|orders| product(p, q, orders));
        return Exchange { value, error: (value - other).abs() };
    }

    // The larger is cut; parts of nothing are left out.
    let (cut, other) = if p.radius >= q.radius { (p, q) } else { (q, p) };
    let mut sum = Exchange::NONE;
    for corners in quarters(&cut.corners) {
        let Some(piece) = Patch::new(corners) else { continue };
        let piece = Patch { plane: cut.plane, ..piece };
        let found = part(&piece, other, relative, cuts_left - 1);
        sum.value += found.value;
        sum.error += found.error;
    }
    sum
}

fn product(p: &Patch, q: &Patch, orders: (usize, usize)) -> f64 {
    let points = |patch: &Patch, order| RulePoints::new(&patch.corners, Strength::Product(order));
    kernel_sum(&points(p, orders.0), p.plane.normal, &points(q, orders.1), q.plane.normal)
}

/// Quarters of a triangle by its midpoints; of another convex polygon one quadrilateral per corner.
fn quarters(corners: &[glam::DVec3]) -> Vec<Vec<glam::DVec3>> {
    let n = corners.len();
    let middle = |k: usize| 0.5 * (corners[k % n] + corners[(k + 1) % n]);
    if n == 3 {
        let [a, b, c] = [middle(0), middle(1), middle(2)];
        return vec![vec![corners[0], a, c], vec![a, corners[1], b], vec![c, b, corners[2]], vec![a, b, c]];
    }
    let centre = polygon::mean_corner(corners);
    (0..n).map(|k| vec![middle(k + n - 1), corners[k], middle(k), centre]).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use geometry::contour::contour;
    use glam::DVec3;

    fn patch(corners: &[[f64; 3]]) -> Patch {
        Patch::new(corners.iter().copied().map(DVec3::from_array).collect()).unwrap()
    }

    fn floor() -> Patch {
        patch(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    }

    /// The two forms agree to ten digits on pairs apart: squares, a triangle, a pentagon.
    #[test]
    fn pairs_apart_agree_with_the_contour() {
        let others = [
            patch(&[[0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
            patch(&[[1.5, 0.0, 0.2], [1.5, 0.0, 1.0], [1.5, 1.0, 0.2]]),
            patch(&[[0.0, 2.0, 1.5], [0.6, 2.4, 1.5], [1.0, 1.8, 1.5], [0.7, 1.1, 1.5], [0.0, 1.2, 1.5]]),
        ];
        for other in others {
            let want = contour(&floor().corners, &other.corners, 1e-15);
            let got = area_form(&floor(), &other, 1e-11);
            let difference = (got.value - want.value).abs();
            assert!(difference <= 1e-10 * want.value, "{got:?} {want:?}");
            assert!(difference <= got.error + want.error, "{got:?} {want:?}");
        }
    }

    /// Squares with a common edge: the estimate covers the error, which falls with the depth.
    #[test]
    fn touching_pairs_are_within_their_estimate() {
        let wall = patch(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
        let mut before = f64::INFINITY;
        for relative in [1e-2, 2e-3, 5e-4] {
            let got = area_form(&floor(), &wall, relative);
            let error = (got.value - 0.200_043_776_075_403_15).abs();
            assert!(error <= got.error && got.error < 4.0 * relative, "{relative}: {error:e} {got:?}");
            assert!(error < before);
            before = error;
        }
    }
}
