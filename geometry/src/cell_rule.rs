//! Rules of rising order on a convex cell: its points, what is seen from them, and their sum.

use crate::quadrature::gauss;
use crate::square_rule::{self, POINTS, Variation};
use glam::DVec3;

/// A rule on a quadrilateral.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rule {
    /// [`square_rule`], of the fifth degree.
    Eight,
    /// n x n Gauss points, of degree 2n - 1.
    Gauss(usize),
}

/// Places in a cell and what they see.
#[derive(Debug, Default)]
pub(crate) struct Points {
    /// The places.
    pub places: Vec<DVec3>,
    /// Their weights, which add up to the cell's area.
    pub weights: Vec<f64>,
    /// What each of them sees.
    pub seen: Vec<f64>,
}

impl Points {
    /// Places the points of a rule on each quadrilateral of a cell's fan, squeezed into triangles.
    pub fn place(&mut self, corners: &[DVec3], normal: DVec3, rule: Rule) {
        let Points { places, weights, .. } = self;
        places.clear();
        weights.clear();
        for k in (1..corners.len() - 1).step_by(2) {
            let (a, b, c) = (corners[0], corners[k], corners[k + 1]);
            // A triangle is a quadrilateral whose first corner is doubled.
            let d = corners.get(k + 2).copied().unwrap_or(a);
            let (along_near, along_far) = (b - a, c - d);
            let mut place = |s: f64, t: f64, weight: f64| {
                let (near, far) = (a + s * along_near, d + s * along_far);
                let along = along_near + t * (along_far - along_near);
                places.push(near + t * (far - near));
                weights.push(weight * along.cross(far - near).dot(normal));
            };
            match rule {
                Rule::Eight => square_rule::for_each_point(place),
                Rule::Gauss(n) => {
                    let rule = gauss(n);
                    for (s, ws) in rule.points.iter().zip(&rule.weights) {
                        for (t, wt) in rule.points.iter().zip(&rule.weights) {
                            place(0.5 * (1.0 + s), 0.5 * (1.0 + t), 0.25 * ws * wt);
                        }
                    }
                }
            }
        }
    }

    /// The integral, once all points have been looked at.
    pub fn sum(&self) -> f64 {
        self.weights.iter().zip(&self.seen).map(|(weight, seen)| weight * seen).sum()
    }

    /// How what is seen varies, where the rule was [`Rule::Eight`].
    pub fn variation(&self) -> Variation {
        let parts = self.weights.chunks_exact(POINTS).zip(self.seen.chunks_exact(POINTS));
        parts.fold(Variation::default(), |sum, (weights, seen)| {
            let part = Variation::new(&std::array::from_fn(|k| weights[k] * seen[k]));
            Variation { second: sum.second + part.second, third: sum.third + part.third }
        })
    }
}
