//! Eight points on a square, exact up to the fifth degree (Burnside 1908; Stroud 71, C2 5-2), with null rules: sums over the
//! same values that vanish for polynomials of the first and of the second degree (Lyness 65; Berntsen & Espelid 91).
//! They tell how large the second and third derivatives are, and so how large the rule's error may be.

/// Squares of the distances of the points on the axes, and of the coordinates of those on the diagonals.
const AXIS_SQUARED: f64 = 7.0 / 15.0;
const DIAGONAL_SQUARED: f64 = 7.0 / 9.0;
/// Weights of a point on an axis and on a diagonal; all together add up to 1.
const AXIS_WEIGHT: f64 = 10.0 / 49.0;
const DIAGONAL_WEIGHT: f64 = 9.0 / 196.0;
/// Number of points.
pub const POINTS: usize = 8;

/// Calls `visit(u, v, weight)` for each point, with u and v from 0 to 1.
pub fn for_each_point(mut visit: impl FnMut(f64, f64, f64)) {
    let (a, b) = (0.5 * AXIS_SQUARED.sqrt(), 0.5 * DIAGONAL_SQUARED.sqrt());
    for (u, v) in [(a, 0.0), (-a, 0.0), (0.0, a), (0.0, -a)] {
        visit(0.5 + u, 0.5 + v, AXIS_WEIGHT);
    }
    for (u, v) in [(b, b), (-b, b), (-b, -b), (b, -b)] {
        visit(0.5 + u, 0.5 + v, DIAGONAL_WEIGHT);
    }
}

/// How a function varies over the square: sizes of what null rules of the first and of the second degree leave of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Variation {
    /// From second derivatives on.
    pub second: f64,
    /// From third derivatives on.
    pub third: f64,
}

impl Variation {
    /// Of a function whose values times the weights are `terms`, in the order of [`for_each_point`].
    pub fn new(terms: &[f64; POINTS]) -> Variation {
        let [right, left, up, down] = [0, 1, 2, 3].map(|k| terms[k] / AXIS_WEIGHT);
        let corners = [4, 5, 6, 7].map(|k| terms[k] / DIAGONAL_WEIGHT);
        let laplace = 0.25 * (corners.iter().sum::<f64>() - (right + left + up + down));
        let stretched = 0.5 * (right + left - up - down);
        let twisted = 0.25 * (corners[0] + corners[2] - corners[1] - corners[3]);
        // Slopes over the diagonal points less slopes over those on the axes.
        let (of_corners, of_axes) = (0.25 / DIAGONAL_SQUARED.sqrt(), 0.5 / AXIS_SQUARED.sqrt());
        let across =
            of_corners * (corners[0] + corners[3] - corners[1] - corners[2]) - of_axes * (right - left);
        let along = of_corners * (corners[0] + corners[1] - corners[2] - corners[3]) - of_axes * (up - down);
        Variation {
            second: (laplace * laplace + stretched * stretched + twisted * twisted).sqrt(),
            third: (across * across + along * along).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(f: impl Fn(f64, f64) -> f64) -> [f64; POINTS] {
        let (mut terms, mut at) = ([0.0; POINTS], 0);
        for_each_point(|u, v, weight| {
            terms[at] = weight * f(u, v);
            at += 1;
        });
        terms
    }

    #[test]
    fn polynomials_up_to_the_fifth_degree_are_exact() {
        for p in 0..6 {
            for q in 0..6 - p {
                let sum: f64 = terms(|u, v| u.powi(p) * v.powi(q)).iter().sum();
                let want = 1.0 / (f64::from(p + 1) * f64::from(q + 1));
                assert!((sum - want).abs() < 1e-15, "{p} {q}: {sum} {want}");
            }
        }
        let sixth: f64 = terms(|u, _| u.powi(6)).iter().sum();
        assert!((sixth - 1.0 / 7.0).abs() > 1e-4);
    }

    #[test]
    fn null_rules_vanish_for_their_degree_and_see_the_next() {
        let linear = Variation::new(&terms(|u, v| 3.0 + 2.0 * u - 5.0 * v));
        assert!(linear.second < 1e-14 && linear.third < 1e-14, "{linear:?}");
        for quadratic in [|u: f64, _: f64| u * u, |_: f64, v: f64| v * v, |u: f64, v: f64| u * v] {
            let variation = Variation::new(&terms(quadratic));
            assert!(variation.second > 0.05 && variation.third < 1e-14, "{variation:?}");
        }
        for cubic in [|u: f64, _: f64| u * u * u, |u: f64, v: f64| u * u * v, |_: f64, v: f64| v * v * v] {
            let about_the_middle = Variation::new(&terms(|u, v| cubic(u - 0.5, v - 0.5)));
            assert!(about_the_middle.third > 0.01, "{about_the_middle:?}");
        }
    }
}
