//! A triangle over which one part of the irradiance is interpolated: linearly between its corners, or over six nodes, as
//! Lischinski, Tampieri & Greenberg 1992 use them.

use crate::interpolation::quadratic_weights;
use crate::light::{Irradiance, Part};
use crate::receiver::{Parts, Receiver, limit_from_inside};
use glam::{DVec2, DVec3};
use interchange::ids::ElementId;

/// What holds at a corner, in the limit along the edges to the corner before and to the one after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner<T> {
    /// Along the edge that comes from the corner before.
    pub before: T,
    /// Along the edge that goes to the corner after.
    pub after: T,
}

impl<T: Copy> Corner<T> {
    /// The same along both.
    pub fn whole(value: T) -> Corner<T> {
        Corner { before: value, after: value }
    }
}

impl Corner<Parts> {
    /// One part of both.
    pub fn part(&self, part: Part) -> Corner<Irradiance> {
        Corner { before: part.of(&self.before), after: part.of(&self.after) }
    }
}

/// Names an edge by the nodes at its ends, the lower first.
pub type EdgeKey = (u32, u32);

/// The edge between two nodes.
pub fn key(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

/// Sum of weights times values.
pub fn blend(terms: &[(f64, &Irradiance)]) -> Irradiance {
    std::array::from_fn(|c| terms.iter().map(|(weight, value)| weight * value[c]).sum())
}

/// The parabola through `near`, `middle` and `far` at the quarter beside `near`.
pub fn quarter(near: &Irradiance, middle: &Irradiance, far: &Irradiance) -> Irradiance {
    blend(&[(0.375, near), (0.75, middle), (-0.125, far)])
}

/// A triangle, whole or cut into four.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Facet it is all or part of.
    pub element: ElementId,
    /// Numbers of the nodes at its corners.
    pub ids: [u32; 3],
    /// The corners in space.
    pub points: [DVec3; 3],
    /// The corners in the plane of the face.
    pub places: [DVec2; 3],
    /// Irradiance at the corners.
    pub corners: [Corner<Irradiance>; 3],
    /// Of edges 0-1, 1-2 and 2-0; used by quadratic schemes.
    pub middles: [Irradiance; 3],
    /// Index of the first of four children; 0 for none (piece 0 is nobody's child).
    pub children: usize,
    /// Largest deviation of radiosity from what is interpolated, where asked.
    pub error: f64,
    /// Interpolation is known or feared to be off by more than the tolerance.
    pub unresolved: bool,
}

/// Corners of the children: one at each corner, in the order of the corners, and the one in the middle. 3 to 5 are the
/// middles of edges 0-1, 1-2 and 2-0.
pub const CHILDREN: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

impl Piece {
    /// Name of edge `k`, from corner k to the next one.
    pub fn edge_key(&self, k: usize) -> EdgeKey {
        key(self.ids[k], self.ids[(k + 1) % 3])
    }

    /// What holds at the start and at the end of edge `k`.
    pub fn ends(&self, k: usize) -> (Irradiance, Irradiance) {
        (self.corners[k].after, self.corners[(k + 1) % 3].before)
    }

    /// Weights of the corners for a part `at` along edge `k`.
    pub fn on_edge(k: usize, at: f64) -> [f64; 3] {
        let mut weights = [0.0; 3];
        (weights[k], weights[(k + 1) % 3]) = (1.0 - at, at);
        weights
    }

    /// The place with these weights of the corners in the plane of the face.
    pub fn place(&self, weights: &[f64; 3]) -> DVec2 {
        (0..3).map(|k| weights[k] * self.places[k]).sum()
    }

    /// Where the place with these weights of the corners receives: just inside.
    pub fn receiver(&self, weights: &[f64]) -> Receiver {
        let [a, b, c] = self.points;
        let point = weights[0] * a + weights[1] * b + weights[2] * c;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Receiver { point: limit_from_inside(point, (a + b + c) / 3.0), normal, face: None }
    }

    /// Corner values; each turns with the direction from its corner.
    fn turned(&self, weights: &[f64]) -> [Irradiance; 3] {
        std::array::from_fn(|k| {
            let (before, after) = (weights[(k + 2) % 3], weights[(k + 1) % 3]);
            let turned = if before + after > 0.0 { after / (before + after) } else { 0.5 };
            blend(&[(1.0 - turned, &self.corners[k].before), (turned, &self.corners[k].after)])
        })
    }

    /// Between the corners.
    pub fn linear(&self, weights: &[f64]) -> Irradiance {
        let [a, b, c] = &self.turned(weights);
        blend(&[(weights[0], a), (weights[1], b), (weights[2], c)])
    }

    /// Over six nodes; a parabola that dips below zero, as beside an umbra, is cut off there.
    pub fn quadratic(&self, weights: &[f64]) -> Irradiance {
        let ([a, b, c], [ab, bc, ca], w) = (&self.turned(weights), &self.middles, quadratic_weights(weights));
        let value = blend(&[(w[0], a), (w[1], b), (w[2], c), (w[3], ab), (w[4], bc), (w[5], ca)]);
        value.map(|x| x.max(0.0))
    }

    /// The four children of a piece whose edges have these nodes and values in their middles.
    pub fn cut(&self, middles: [(u32, Irradiance); 3], error: f64) -> [Piece; 4] {
        let (mut ids, mut points, mut places) = ([0; 6], [DVec3::ZERO; 6], [DVec2::ZERO; 6]);
        let mut corners = [self.corners[0]; 6];
        for k in 0..3 {
            let (next, (id, value)) = ((k + 1) % 3, middles[k]);
            (ids[k], ids[k + 3]) = (self.ids[k], id);
            (points[k], points[k + 3]) = (self.points[k], 0.5 * (self.points[k] + self.points[next]));
            (places[k], places[k + 3]) = (self.places[k], 0.5 * (self.places[k] + self.places[next]));
            (corners[k], corners[k + 3]) = (self.corners[k], Corner::whole(value));
        }
        CHILDREN.map(|of| Piece {
            element: self.element,
            ids: of.map(|k| ids[k]),
            points: of.map(|k| points[k]),
            places: of.map(|k| places[k]),
            corners: of.map(|k| corners[k]),
            middles: [[0.0; 3]; 3],
            children: 0,
            error,
            unresolved: false,
        })
    }
}
