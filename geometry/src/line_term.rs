//! Terms of Lambert's sum for parts of one line, for several points together: gamma n . c / |c|, gamma the angle that the
//! part subtends and c the normal of the plane through point and line.
//!
//! # Precision
//! With a the line's start and d its direction, p x q = (t - s) a x d for its points p at s and q at t: its error is 1e-16 of
//! |a| |d|, where that of the product itself would be 1e-16 of |a|^2.

use crate::lanes::{Lane, Vectors, all, lanes};
use crate::point_factor::angle_over_sine;
use glam::DVec3;

/// Squared tangents up to which the series of the arc tangent has full precision with all its terms, and with six.
const SERIES: f64 = 0.06;
const FEW_TERMS: f64 = 0.003;
/// Coefficients of arctan(t)/t in t^2.
const LOW_TERMS: [f64; 6] = [1.0, -1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0];
const HIGH_TERMS: [f64; 6] = [1.0 / 13.0, -1.0 / 15.0, 1.0 / 17.0, -1.0 / 19.0, 1.0 / 21.0, -1.0 / 23.0];

/// A line from a to a + d as seen from several points.
#[derive(Debug, Clone, Copy)]
pub struct LineTerm {
    /// n . (a x d) and |a x d|^2.
    along: Lane,
    squared: Lane,
    /// a . a, a . d, d . d.
    start: Lane,
    mixed: Lane,
    length: Lane,
}

impl LineTerm {
    /// The line from `a` to `b`, seen from points with unit `normal`.
    #[inline(always)]
    pub fn new(a: &Vectors, b: &Vectors, normal: DVec3) -> LineTerm {
        let d = b.minus(a);
        let cross = a.cross(&d);
        LineTerm {
            along: cross.along(normal),
            squared: cross.dot(&cross),
            start: a.dot(a),
            mixed: a.dot(&d),
            length: d.dot(&d),
        }
    }

    /// The term of its part from s to t, each between 0 and 1; nothing where t is not above s.
    #[inline(always)]
    pub fn part(&self, s: &Lane, t: &Lane) -> Lane {
        let t = lanes(|k| if t[k] > s[k] { t[k] } else { s[k] });
        let width = lanes(|k| t[k] - s[k]);
        let dot = lanes(|k| self.start[k] + (s[k] + t[k]) * self.mixed[k] + s[k] * t[k] * self.length[k]);
        let squared = lanes(|k| width[k] * width[k] * self.squared[k]);
        let angle = angles_over_sines(&squared, &dot);
        lanes(|k| angle[k] * width[k] * self.along[k])
    }
}

/// [`angle_over_sine`] in lanes.
#[inline(always)]
fn angles_over_sines(squared: &Lane, dot: &Lane) -> Lane {
    if !all(|k| dot[k] > 0.0) {
        return lanes(|k| angle_over_sine(squared[k], dot[k]));
    }
    let inverse = lanes(|k| 1.0 / dot[k]);
    let u = lanes(|k| squared[k] * inverse[k] * inverse[k]);
    if all(|k| u[k] < FEW_TERMS) {
        return lanes(|k| inverse[k] * polynomial(u[k], &LOW_TERMS));
    }
    if all(|k| u[k] < SERIES) {
        return lanes(|k| inverse[k] * arc(u[k]));
    }
    // tan(x/2) = tan x / (1 + sqrt(1 + tan^2 x)), three times: angles below 90 degrees come within the series.
    let halve = |u: f64| {
        let divisor = 1.0 + (1.0 + u).sqrt();
        (u / (divisor * divisor), divisor)
    };
    let radius = lanes(|k| dot[k] + (dot[k] * dot[k] + squared[k]).sqrt());
    lanes(|k| {
        let first = squared[k] / (radius[k] * radius[k]);
        let (second, by_second) = halve(first);
        let (third, by_third) = halve(second);
        8.0 / (radius[k] * by_second * by_third) * arc(third)
    })
}

/// arctan(t)/t for t^2 = u below [`SERIES`].
#[inline(always)]
fn arc(u: f64) -> f64 {
    let cubed = u * u * u;
    polynomial(u, &LOW_TERMS) + cubed * cubed * polynomial(u, &HIGH_TERMS)
}

/// c0 + c1 u + ... + c5 u^5, in three independent parts (Estrin).
#[inline(always)]
fn polynomial(u: f64, c: &[f64; 6]) -> f64 {
    let squared = u * u;
    (c[0] + u * c[1]) + squared * ((c[2] + u * c[3]) + squared * (c[4] + u * c[5]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;

    #[test]
    fn angles_of_all_sizes_have_full_precision() {
        for round in 0..2000 {
            let angle = lanes(|k| (f64::from(round) * 8.0 + k as f64 + 0.5) / 16000.0 * 3.1);
            // In one round all lanes are of one branch, now and then of two.
            let (sine, dot) = (lanes(|k| 3.0 * angle[k].sin()), lanes(|k| 3.0 * angle[k].cos()));
            let got = angles_over_sines(&lanes(|k| sine[k] * sine[k]), &dot);
            for k in 0..LANES {
                let want = angle[k] / sine[k];
                // Near a straight angle the sine itself has the rounding of the angle.
                let rounding = 8.0 * f64::EPSILON * (1.0 + angle[k] / angle[k].sin());
                assert!((got[k] - want).abs() <= rounding * want, "{angle:?}: {} {want}", got[k]);
            }
        }
    }
}
