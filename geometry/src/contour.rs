//! Exchange factor of two polygons that see each other wholly: Stokes' double contour integral (Goral et al. 84).
//!
//! A_i F_ij = 1/(2 pi) oint oint ln r dx . dx', each pair of edges in closed form or with one Gauss ([`crate::edge_pair`]).

use crate::edge_pair::{Edge, edge_pair};
use crate::polygon;
use glam::DVec3;
use std::f64::consts::TAU;

/// An exchange factor A_i F_ij (a length squared) with an estimate of its absolute error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchange {
    /// A_i F_ij = A_j F_ji.
    pub value: f64,
    /// Estimated absolute error.
    pub error: f64,
}

impl Exchange {
    /// Two polygons that do not see each other.
    pub const NONE: Exchange = Exchange { value: 0.0, error: 0.0 };
}

/// Rounding of one pair of edges in units of the pair's size squared: ten operations on numbers up to about 1.
const ROUNDING_PER_EDGE_PAIR: f64 = 4.0 * f64::EPSILON;

/// Absolute rounding error to expect of [`contour`] for polygons of `corners_p` and `corners_q` corners that fit into a
/// sphere of diameter `size`: the terms are of size 1 in that unit, however small their sum.
pub fn rounding(corners_p: usize, corners_q: usize, size: f64) -> f64 {
    // Roundings are independent: their sum grows with the square root of their number.
    ((corners_p * corners_q) as f64).sqrt() * ROUNDING_PER_EDGE_PAIR / TAU * size * size
}

/// Exchange factor of two convex polygons, each wholly at or in front of the other's plane, nothing between them;
/// absolute error about `tolerance` besides the rounding that is reported with it.
pub fn contour(p: &[DVec3], q: &[DVec3], tolerance: f64) -> Exchange {
    // Centred on the pair and divided by its size, ln r is of size 1 and scenes of any scale round alike.
    let centre = 0.5 * (polygon::mean_corner(p) + polygon::mean_corner(q));
    let size = p.iter().chain(q).map(|&x| (x - centre).length()).fold(0.0, f64::max);
    if size == 0.0 {
        return Exchange::NONE;
    }
    let edges = |corners: &[DVec3]| -> Vec<Edge> {
        polygon::edges(corners).map(|(a, b)| Edge::new((a - centre) / size, (b - centre) / size)).collect()
    };
    let (edges_p, edges_q) = (edges(p), edges(q));
    let unit = size * size;
    let share = tolerance / unit * TAU / (p.len() * q.len()) as f64;
    let mut sum = 0.0;
    for a in &edges_p {
        for b in &edges_q {
            sum += edge_pair(a, b, share.max(f64::EPSILON * f64::EPSILON));
        }
    }
    Exchange { value: (sum / TAU * unit).max(0.0), error: tolerance + rounding(p.len(), q.len(), size) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Vec<DVec3> {
        let (c, u, v) = (DVec3::from_array(corner), DVec3::from_array(u), DVec3::from_array(v));
        vec![c, c + u, c + u + v, c + v]
    }

    #[test]
    fn unit_cube_factors_have_their_closed_form_values() {
        let floor = rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let ceiling = rectangle([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        let wall = rectangle([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        for (q, want) in [(&ceiling, 0.199_824_895_698_387_38), (&wall, 0.200_043_776_075_403_15)] {
            let got = contour(&floor, q, 1e-15);
            assert!((got.value - want).abs() < 1e-15, "{got:?} {want}");
            assert!(got.error >= (got.value - want).abs());
        }
    }

    #[test]
    fn turned_and_scaled_pairs_give_the_same_factor() {
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        let floor = rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let wall = rectangle([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        for scale in [1e-6, 1.0, 1e6] {
            let place = |p: &[DVec3]| p.iter().map(|&x| scale * (turn * x)).collect::<Vec<_>>();
            let got = contour(&place(&floor), &place(&wall), 1e-15 * scale * scale).value / (scale * scale);
            assert!((got - 0.200_043_776_075_403_15).abs() < 2e-15, "{scale}: {got}");
        }
    }
}
