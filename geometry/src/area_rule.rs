//! Exchange factor of well-separated polygons: Gauss points on both, summed over the kernel cos cos / (pi r^2).
//!
//! The only rule that does not lose digits far away (theory 4.2): all terms have one sign. Its error falls as a power
//! of theta = (R_i + R_j)/d, sizes over distance.

use crate::patch::RulePoints;
use crate::quadrature::Strength;
use glam::DVec3;
use std::f64::consts::PI;

/// sum over a, b of w_a w_b cos cos / (pi r^2): n_p . r and -n_q . r over r^4, r from p's points to q's.
pub fn kernel_sum(p: &RulePoints, normal_p: DVec3, q: &RulePoints, normal_q: DVec3) -> f64 {
    let mut sum = 0.0;
    for a in 0..p.weight.len() {
        let (x, y, z) = (p.x[a], p.y[a], p.z[a]);
        let mut inner = 0.0;
        for b in 0..q.weight.len() {
            let (dx, dy, dz) = (q.x[b] - x, q.y[b] - y, q.z[b] - z);
            let r2 = dx * dx + dy * dy + dz * dz;
            let height_p = normal_p.x * dx + normal_p.y * dy + normal_p.z * dz;
            let height_q = normal_q.x * dx + normal_q.y * dy + normal_q.z * dz;
            inner -= q.weight[b] * height_p * height_q / (r2 * r2);
        }
        sum += p.weight[a] * inner;
    }
    sum / PI
}

/// Constants c of the error estimate c K theta^(degree + 1), from the worst of 4 10^4 random pairs of triangles and
/// quadrilaterals (test `estimate_covers_the_error`), rounded up. K is the kernel with its largest cosines.
fn constant(strength: Strength) -> f64 {
    match strength {
        Strength::Centroid => 1.2,
        Strength::Low => 0.06,
        Strength::Middle => 0.009,
        // A product rule gains a constant factor with every point besides the power.
        Strength::Product(n) => 5e-4 * 0.1f64.powi(n as i32 - 4),
    }
}

/// Up to this theta the estimates hold.
const FARTHEST: f64 = 0.7;
/// Up to this one a product rule gains what [`constant`] says with every point. The kernel's nearest singularity is where the
/// other polygon begins, (d - R_j)/R_i half lengths from the middle: 3 for equal ones at 0.5, where Gauss points gain 34 times
/// each; at 1, slivers end to end, nothing.
const FARTHEST_PRODUCT: f64 = 0.5;

/// What the rules' error depends on: a pair of polygons seen from afar.
#[derive(Debug, Clone, Copy)]
pub struct Separation {
    /// (R_i + R_j) / d.
    pub theta: f64,
    /// A_i A_j / (pi d^2) times the largest cosines that occur: bounds the exchange factor.
    pub kernel: f64,
    /// The same with the cosines at the centres (0 where a centre is behind): about the exchange factor.
    pub value: f64,
}

impl Separation {
    /// From centroids, radii, areas and unit normals.
    pub fn new(p: &crate::patch::Patch, q: &crate::patch::Patch) -> Self {
        let between = q.centroid - p.centroid;
        let distance2 = between.length_squared();
        let distance = distance2.sqrt();
        let (height_p, height_q) = (p.plane.normal.dot(between), -q.plane.normal.dot(between));
        let theta = (p.radius + q.radius) / distance;
        let areas = p.area * q.area / (PI * distance2);
        let cosine = |height: f64| (height / distance).clamp(0.0, 1.0);
        let largest = |height: f64| (height.abs() / distance + theta).min(1.0);
        Self {
            theta,
            kernel: areas * largest(height_p) * largest(height_q),
            value: areas * cosine(height_p) * cosine(height_q),
        }
    }

    /// Estimated absolute error of the rule of this strength on both polygons; infinite where they are too near for one.
    pub fn error(&self, strength: Strength) -> f64 {
        let farthest = if matches!(strength, Strength::Product(_)) { FARTHEST_PRODUCT } else { FARTHEST };
        if self.theta > farthest {
            return f64::INFINITY;
        }
        constant(strength) * self.kernel * self.theta.powi(strength.degree() as i32 + 1)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::contour::contour;
    use crate::patch::Patch;
    use crate::unoccluded::{Facing, facing};

    /// Numbers between -1 and 1 from a small generator with a fixed start.
    fn noise(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn random_patch(state: &mut u64) -> Patch {
        let mut vector = || DVec3::new(noise(state), noise(state), noise(state));
        loop {
            let (c, u, v) = (vector(), vector(), vector());
            let triangle = vec![c, c + 0.5 * u, c + 0.5 * v];
            let quad = vec![c, c + 0.5 * u, c + 0.5 * (u + v), c + 0.5 * v];
            let corners = if u.x > 0.0 { triangle } else { quad };
            if u.cross(v).length() > 0.3 * u.length() * v.length() {
                return Patch::new(corners).unwrap();
            }
        }
    }

    #[test]
    fn estimate_covers_the_error() {
        let state = &mut 1;
        let mut worst = [0.0f64; 5];
        for _ in 0..40_000 {
            let p = random_patch(state);
            let mut q = random_patch(state);
            let shift = DVec3::new(noise(state), noise(state), noise(state)) * 6.0;
            q = Patch::new(q.corners.iter().map(|&c| c + shift).collect()).unwrap();
            let separation = Separation::new(&p, &q);
            if facing(&p, &q) != Facing::Full || separation.theta > 0.7 {
                continue;
            }
            let exact = contour(&p.corners, &q.corners, 1e-15);
            let product = |n| {
                (
                    RulePoints::new(&p.corners, Strength::Product(n)),
                    RulePoints::new(&q.corners, Strength::Product(n)),
                )
            };
            let ((a, b), (c, d)) = (product(4), product(5));
            let rules = [
                (Strength::Centroid, &p.centre, &q.centre),
                (Strength::Low, &p.low, &q.low),
                (Strength::Middle, &p.middle, &q.middle),
                (Strength::Product(4), &a, &b),
                (Strength::Product(5), &c, &d),
            ];
            for (k, (strength, p_points, q_points)) in rules.into_iter().enumerate() {
                let value = kernel_sum(p_points, p.plane.normal, q_points, q.plane.normal);
                let error = ((value - exact.value).abs() - exact.error).max(0.0);
                worst[k] = worst[k].max(error / separation.error(strength));
            }
        }
        assert!(worst.iter().all(|&w| w <= 1.0 && w > 0.05), "{worst:?}");
    }
}
