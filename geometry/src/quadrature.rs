//! Gauss rules: on the interval, on the triangle, and on convex polygons by a fan of triangles or, where the polygon
//! is a parallelogram, by the product rule, which needs half the points.

use crate::polygon;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Largest number of points of [`gauss`].
pub const LARGEST_GAUSS: usize = 24;

/// Points and weights on [-1, 1].
#[derive(Debug, Clone)]
pub struct GaussRule {
    /// Abscissas, rising.
    pub points: Vec<f64>,
    /// Weights; they add up to 2.
    pub weights: Vec<f64>,
}

static GAUSS: LazyLock<Vec<GaussRule>> = LazyLock::new(|| (0..=LARGEST_GAUSS).map(gauss_legendre).collect());

/// The Gauss-Legendre rule with `n` points (clamped to 1..=[`LARGEST_GAUSS`]), exact for polynomials of degree 2n - 1.
pub fn gauss(n: usize) -> &'static GaussRule {
    &GAUSS[n.clamp(1, LARGEST_GAUSS)]
}

/// Roots of the Legendre polynomial by Newton's iteration from Chebyshev-like starting points.
fn gauss_legendre(n: usize) -> GaussRule {
    let (mut points, mut weights) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for k in (0..n).rev() {
        let mut x = (PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, derivative) = legendre(n, x);
            slope = derivative;
            let step = value / derivative;
            x -= step;
            if step.abs() < f64::EPSILON {
                break;
            }
        }
        points.push(x);
        weights.push(2.0 / ((1.0 - x * x) * slope * slope));
    }
    GaussRule { points, weights }
}

/// P_n(x) and its derivative, by the three-term recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, n as f64 * (x * value - before) / (x * x - 1.0))
}

/// An orbit of triangle points: barycentric coordinates (1 - 2a, a, a) and permutations, or the centroid.
#[derive(Debug, Clone, Copy)]
struct Orbit {
    a: f64,
    weight: f64,
}

/// Symmetric triangle rules by polynomial degree. Degree 2, 4: Strang & Fix 73; degree 5: Radon 48. Weights add up to 1.
const DEGREE_1: [Orbit; 1] = [Orbit { a: 1.0 / 3.0, weight: 1.0 }];
const DEGREE_2: [Orbit; 1] = [Orbit { a: 1.0 / 6.0, weight: 1.0 / 3.0 }];
const DEGREE_4: [Orbit; 2] = [
    Orbit { a: 0.445_948_490_915_964_9, weight: 0.223_381_589_678_011_46 },
    Orbit { a: 0.091_576_213_509_770_74, weight: 0.109_951_743_655_321_87 },
];
const DEGREE_5: [Orbit; 3] = [
    Orbit { a: 1.0 / 3.0, weight: 0.225 },
    Orbit { a: 0.101_286_507_323_456_34, weight: 0.125_939_180_544_827_15 },
    Orbit { a: 0.470_142_064_105_115_1, weight: 0.132_394_152_788_506_2 },
];

/// A rule's strength: how many terms of the expansion of a smooth integrand it gets right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Strength {
    /// One point, degree 1.
    Centroid,
    /// Degree 2 on triangles, 3 on parallelograms.
    Low,
    /// Degree 4 on triangles, 5 on parallelograms.
    Middle,
    /// The product of two n-point Gauss rules, squeezed into triangles; degree at least 2n - 2.
    Product(usize),
}

impl Strength {
    /// The lowest polynomial degree it integrates exactly on any convex polygon.
    pub fn degree(self) -> usize {
        match self {
            Strength::Centroid => 1,
            Strength::Low => 2,
            Strength::Middle => 4,
            Strength::Product(n) => 2 * n - 2,
        }
    }
}

/// Appends points and weights (which add up to the area) for a convex polygon.
pub fn polygon_rule(corners: &[DVec3], strength: Strength, points: &mut Vec<DVec3>, weights: &mut Vec<f64>) {
    if strength == Strength::Centroid {
        points.push(polygon::centroid(corners));
        weights.push(polygon::area(corners));
    } else if let Some((origin, u, v)) = polygon::parallelogram(corners) {
        let n = match strength {
            Strength::Centroid => 1,
            Strength::Low => 2,
            Strength::Middle => 3,
            Strength::Product(n) => n,
        };
        let (rule, quarter) = (gauss(n), 0.25 * u.cross(v).length());
        for (s, ws) in rule.points.iter().zip(&rule.weights) {
            for (t, wt) in rule.points.iter().zip(&rule.weights) {
                points.push(origin + 0.5 * (1.0 + s) * u + 0.5 * (1.0 + t) * v);
                weights.push(quarter * ws * wt);
            }
        }
    } else {
        for k in 2..corners.len() {
            triangle_rule([corners[0], corners[k - 1], corners[k]], strength, points, weights);
        }
    }
}

/// Appends points and weights (which add up to the area) for a triangle.
pub fn triangle_rule(
    triangle: [DVec3; 3],
    strength: Strength,
    points: &mut Vec<DVec3>,
    weights: &mut Vec<f64>,
) {
    let area = polygon::area(&triangle);
    let orbits: &[Orbit] = match strength {
        Strength::Centroid => &DEGREE_1,
        Strength::Low => &DEGREE_2,
        Strength::Middle => &DEGREE_4,
        Strength::Product(n) => return squeezed_rule(triangle, area, n, points, weights),
    };
    orbits.iter().for_each(|orbit| push_orbit(triangle, area, orbit, points, weights));
}

/// Appends the seven points of Radon's rule of degree 5: centroid, the three near the corners, the three near the edges.
pub fn radon_rule(triangle: [DVec3; 3], points: &mut Vec<DVec3>, weights: &mut Vec<f64>) {
    let area = polygon::area(&triangle);
    DEGREE_5.iter().for_each(|orbit| push_orbit(triangle, area, orbit, points, weights));
}

/// Weights of a degree-2 rule on the first four of Radon's points (relative to the area), to compare with. From
/// the two moment conditions: W ((1 - 2a)^2 + 2a^2 - 1/3) = 1/6 for the three corner points together.
pub const RADON_INNER: [f64; 4] =
    [0.484_122_918_275_927_1, 0.171_959_027_241_357_63, 0.171_959_027_241_357_63, 0.171_959_027_241_357_63];

fn push_orbit(t: [DVec3; 3], area: f64, orbit: &Orbit, points: &mut Vec<DVec3>, weights: &mut Vec<f64>) {
    let sum = t[0] + t[1] + t[2];
    if orbit.a == 1.0 / 3.0 {
        points.push(sum / 3.0);
        weights.push(orbit.weight * area);
        return;
    }
    for corner in t {
        points.push(orbit.a * sum + (1.0 - 3.0 * orbit.a) * corner);
        weights.push(orbit.weight * area);
    }
}

/// Gauss times Gauss on the square, squeezed into the triangle's first corner (Duffy 82).
fn squeezed_rule(t: [DVec3; 3], area: f64, n: usize, points: &mut Vec<DVec3>, weights: &mut Vec<f64>) {
    let rule = gauss(n);
    for (s, ws) in rule.points.iter().zip(&rule.weights) {
        let s = 0.5 * (1.0 + s);
        for (q, wq) in rule.points.iter().zip(&rule.weights) {
            let q = 0.5 * (1.0 + q);
            points.push(t[0] + s * ((t[1] - t[0]) + q * (t[2] - t[1])));
            weights.push(0.5 * area * ws * wq * s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: u32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    #[test]
    fn gauss_integrates_its_degree() {
        for n in 1..=LARGEST_GAUSS {
            let rule = gauss(n);
            for degree in (0..2 * n).step_by(2) {
                let got: f64 =
                    rule.points.iter().zip(&rule.weights).map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!((got - 2.0 / (degree as f64 + 1.0)).abs() < 4e-15, "n {n} degree {degree}: {got}");
            }
        }
    }

    #[test]
    fn triangle_rules_integrate_their_degree() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let strengths = [Strength::Centroid, Strength::Low, Strength::Middle, Strength::Product(5)];
        let mut rules: Vec<(usize, Vec<DVec3>, Vec<f64>)> = Vec::new();
        for strength in strengths {
            let (mut points, mut weights) = (Vec::new(), Vec::new());
            triangle_rule(triangle, strength, &mut points, &mut weights);
            rules.push((strength.degree(), points, weights));
        }
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        radon_rule(triangle, &mut points, &mut weights);
        rules.push((2, points[..4].to_vec(), RADON_INNER.iter().map(|w| 0.5 * w).collect()));
        rules.push((5, points, weights));
        for (degree, points, weights) in rules {
            for i in 0..=degree as u32 {
                for j in 0..=degree as u32 - i {
                    let want = factorial(i) * factorial(j) / factorial(i + j + 2);
                    let monomial = |p: &DVec3| p.x.powi(i as i32) * p.y.powi(j as i32);
                    let got: f64 = points.iter().zip(&weights).map(|(p, w)| w * monomial(p)).sum();
                    assert!((got - want).abs() < 3e-16, "degree {degree}, x^{i} y^{j}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn parallelograms_use_the_product_rule() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (3.0, 1.0), (1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        polygon_rule(&corners, Strength::Low, &mut points, &mut weights);
        assert_eq!(points.len(), 4);
        let got: f64 = points.iter().zip(&weights).map(|(p, w)| w * p.x * p.y * p.y).sum();
        // x = 2s + t, y = t, area 2: 2 (2 s t^2 + t^3) averages to 2 (1/3 + 1/4).
        assert!((got - 2.0 * (1.0 / 3.0 + 0.25)).abs() < 1e-15);
    }
}
