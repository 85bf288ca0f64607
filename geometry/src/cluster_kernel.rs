//! Exchange factors of all pairs of two sets of coplanar patches that see each other wholly and from afar, by interpolating
//! the kernel cos cos / (pi r^2) between the sets (Hackbusch & Nowak 89; Hanrahan, Salzman & Aupperle 91 for radiosity).
//!
//! K(x, y) = sum_ab L_a(x) K(x_a, y_b) L_b(y) with Lagrange polynomials on Chebyshev points x_a, y_b of the sets' rectangles,
//! so that S_ij = sum_ab U_ia K_ab V_jb with the integrals U, V of the polynomials over the patches: p^4 kernels in place of
//! several for each pair.
//!
//! # Precision
//! The error of interpolation is largest near the rectangles' corners, where the polynomial of the nodes is: it is measured
//! at all pairs of corners.

use crate::quadrature::{Strength, polygon_rule};
use glam::DVec3;
use std::f64::consts::PI;

/// Points a side that are tried, rising.
pub const ORDERS: [usize; 6] = [3, 4, 5, 6, 7, 8];
/// Largest error over the largest one at pairs of corners (test `the_estimate_covers_the_errors`).
const CAUTION: f64 = 3.0;

/// A set of coplanar patches prepared for one order.
#[derive(Debug, Clone)]
pub struct Basis {
    order: usize,
    normal: DVec3,
    corners: [DVec3; 4],
    /// Coordinates of the points.
    nodes: [Vec<f64>; 3],
    /// Values of the polynomials at each corner.
    at_corners: [Vec<f64>; 4],
    /// Integral of polynomial a over patch i, at a n + i, n the number of patches.
    moments: Vec<f64>,
    patches: usize,
}

/// The kernel between two sets, interpolated.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// K_ab at a p^2 + b.
    values: Vec<f64>,
    /// Bound on its error anywhere.
    pub error: f64,
    /// Its mean value at the points.
    pub mean: f64,
}

impl Basis {
    /// Of patches within the rectangle with these corners, all with this unit normal.
    pub fn new<'p>(
        corners: [DVec3; 4],
        normal: DVec3,
        patches: impl Iterator<Item = &'p [DVec3]>,
        order: usize,
    ) -> Self {
        let (x, y) = (corners[1] - corners[0], corners[3] - corners[0]);
        let polynomials = Lagrange::new(chebyshev(order));
        let nodes = &polynomials.nodes;
        let place = |s: f64, t: f64| corners[0] + 0.5 * (1.0 + s) * x + 0.5 * (1.0 + t) * y;
        let points = nodes.iter().flat_map(|&s| nodes.iter().map(move |&t| (s, t)));
        let points: Vec<DVec3> = points.map(|(s, t)| place(s, t)).collect();
        let mut by_patch: Vec<f64> = Vec::new();
        let (mut rule, mut weights) = (Vec::new(), Vec::new());
        let (mut of_s, mut of_t) = (vec![0.0; order], vec![0.0; order]);
        let along = |p: DVec3, axis: DVec3| 2.0 * (p - corners[0]).dot(axis) / axis.length_squared() - 1.0;
        for patch in patches {
            // Exact for the polynomials, whose degree is 2 (p - 1).
            rule.clear();
            weights.clear();
            polygon_rule(patch, Strength::Product(order), &mut rule, &mut weights);
            let first = by_patch.len();
            by_patch.resize(first + order * order, 0.0);
            for (&point, &weight) in rule.iter().zip(&weights) {
                polynomials.at(along(point, x), &mut of_s);
                polynomials.at(along(point, y), &mut of_t);
                for (row, s) in by_patch[first..].chunks_exact_mut(order).zip(&of_s) {
                    row.iter_mut().zip(&of_t).for_each(|(moment, t)| *moment += weight * s * t);
                }
            }
        }
        let size = order * order;
        let patches = by_patch.len() / size;
        let mut moments = vec![0.0; by_patch.len()];
        for (i, of_patch) in by_patch.chunks_exact(size).enumerate() {
            of_patch.iter().enumerate().for_each(|(a, &moment)| moments[a * patches + i] = moment);
        }
        Self {
            order,
            normal,
            corners,
            nodes: [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect()),
            at_corners: corner_weights(&polynomials),
            moments,
            patches,
        }
    }

    /// Memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + size_of::<f64>() * (self.moments.len() + 7 * self.order * self.order)
    }

    fn node(&self, a: usize) -> DVec3 {
        DVec3::new(self.nodes[0][a], self.nodes[1][a], self.nodes[2][a])
    }

    /// The kernel between this set and another of the same order, each wholly in front of the other; `None` where they touch.
    #[allow(unsafe_code)] // calls of code for features that have just been found
    pub fn kernel(&self, other: &Basis) -> Option<Kernel> {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the feature is there.
                return unsafe { self.kernel_avx512(other) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature is there.
                return unsafe { self.kernel_avx2(other) };
            }
        }
        self.kernel_portable(other)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn kernel_avx512(&self, other: &Basis) -> Option<Kernel> {
        self.kernel_portable(other)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn kernel_avx2(&self, other: &Basis) -> Option<Kernel> {
        self.kernel_portable(other)
    }

    #[inline(always)]
    fn kernel_portable(&self, other: &Basis) -> Option<Kernel> {
        let size = self.order * self.order;
        let mut values = vec![0.0; size * size];
        let (n, m) = (self.normal, other.normal);
        let [ys, zs] = [&other.nodes[1][..size], &other.nodes[2][..size]];
        for (a, row) in values.chunks_exact_mut(size).enumerate() {
            let x = self.node(a);
            for ((value, y), (yy, yz)) in row.iter_mut().zip(&other.nodes[0]).zip(ys.iter().zip(zs)) {
                let r = [y - x.x, yy - x.y, yz - x.z];
                let squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
                let cosines =
                    -(n.x * r[0] + n.y * r[1] + n.z * r[2]) * (m.x * r[0] + m.y * r[1] + m.z * r[2]);
                *value = cosines / (PI * squared * squared);
            }
        }
        let (mut error, mut touches) = (0.0f64, false);
        let mut of_other = vec![0.0; size];
        for (weights, &x) in self.at_corners.iter().zip(&self.corners) {
            of_other.fill(0.0);
            for (row, weight) in values.chunks_exact(size).zip(weights) {
                of_other.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
            }
            for (weights, &y) in other.at_corners.iter().zip(&other.corners) {
                let got: f64 = weights.iter().zip(&of_other).map(|(w, v)| w * v).sum();
                let distance = (got - kernel(x, n, y, m)).abs();
                // Not a number where corners coincide.
                touches |= !distance.is_finite();
                error = if distance > error { distance } else { error };
            }
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (!touches).then_some(Kernel { values, error: CAUTION * error, mean })
    }

    /// Exchange factors S_ij of all patches of this set with all of the other, row after row.
    #[allow(unsafe_code)] // calls of code for features that have just been found
    pub fn exchange(&self, other: &Basis, kernel: &Kernel, out: &mut Vec<f64>) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the feature is there.
                return unsafe { self.exchange_avx512(other, kernel, out) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature is there.
                return unsafe { self.exchange_avx2(other, kernel, out) };
            }
        }
        self.exchange_portable(other, kernel, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn exchange_avx512(&self, other: &Basis, kernel: &Kernel, out: &mut Vec<f64>) {
        self.exchange_portable(other, kernel, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn exchange_avx2(&self, other: &Basis, kernel: &Kernel, out: &mut Vec<f64>) {
        self.exchange_portable(other, kernel, out);
    }

    /// Sums over b run in one order whatever the width: columns lie side by side in the registers.
    #[inline(always)]
    fn exchange_portable(&self, other: &Basis, kernel: &Kernel, out: &mut Vec<f64>) {
        let size = self.order * self.order;
        let columns = other.patches;
        out.clear();
        out.resize(self.patches * columns, 0.0);
        let mut half = vec![0.0; size];
        for (i, row) in out.chunks_exact_mut(columns.max(1)).enumerate() {
            half.fill(0.0);
            for (a, values) in kernel.values.chunks_exact(size).enumerate() {
                let moment = self.moments[a * self.patches + i];
                half.iter_mut().zip(values).for_each(|(sum, value)| *sum += moment * value);
            }
            for (&weight, of_columns) in half.iter().zip(other.moments.chunks_exact(columns.max(1))) {
                row.iter_mut().zip(of_columns).for_each(|(sum, moment)| *sum += weight * moment);
            }
        }
    }
}

/// cos cos / (pi r^2) between x with unit normal n and y with unit normal m, each in front of the other.
fn kernel(x: DVec3, n: DVec3, y: DVec3, m: DVec3) -> f64 {
    let r = y - x;
    let squared = r.length_squared();
    -n.dot(r) * m.dot(r) / (PI * squared * squared)
}

/// Chebyshev points of the first kind between -1 and 1.
fn chebyshev(order: usize) -> Vec<f64> {
    (0..order).map(|k| ((2 * k + 1) as f64 * PI / (2 * order) as f64).cos()).collect()
}

/// Lagrange polynomials on points of a line.
struct Lagrange {
    nodes: Vec<f64>,
    /// One over the product of a point's distances from the others.
    scales: Vec<f64>,
}

impl Lagrange {
    fn new(nodes: Vec<f64>) -> Self {
        let distances = |k: usize| {
            let others = nodes.iter().enumerate().filter(move |(m, _)| *m != k);
            others.fold(1.0, |product, (_, node)| product * (nodes[k] - node))
        };
        let scales = (0..nodes.len()).map(|k| 1.0 / distances(k)).collect();
        Self { nodes, scales }
    }

    /// Their values at t.
    fn at(&self, t: f64, out: &mut [f64]) {
        let mut before = 1.0;
        for ((value, node), scale) in out.iter_mut().zip(&self.nodes).zip(&self.scales) {
            *value = scale * before;
            before *= t - node;
        }
        let mut after = 1.0;
        for (value, node) in out.iter_mut().zip(&self.nodes).rev() {
            *value *= after;
            after *= t - node;
        }
    }
}

/// Per corner of a rectangle, in the order of its corners, the values of the polynomials there.
fn corner_weights(polynomials: &Lagrange) -> [Vec<f64>; 4] {
    let count = polynomials.nodes.len();
    let (mut low, mut high) = (vec![0.0; count], vec![0.0; count]);
    polynomials.at(-1.0, &mut low);
    polynomials.at(1.0, &mut high);
    let product = |of_s: &[f64], of_t: &[f64]| -> Vec<f64> {
        of_s.iter().flat_map(|s| of_t.iter().map(move |t| s * t)).collect()
    };
    [product(&low, &low), product(&high, &low), product(&high, &high), product(&low, &high)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::contour;

    /// Numbers between -1 and 1 from a small generator with a fixed start.
    fn noise(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A rectangle cut into n x n parts, some of them into two triangles.
    fn parts(corner: DVec3, x: DVec3, y: DVec3, n: usize) -> Vec<Vec<DVec3>> {
        let at = |s: usize, t: usize| corner + s as f64 / n as f64 * x + t as f64 / n as f64 * y;
        let mut parts = Vec::new();
        for s in 0..n {
            for t in 0..n {
                let quad = [at(s, t), at(s + 1, t), at(s + 1, t + 1), at(s, t + 1)];
                if (s + t) % 3 == 0 {
                    parts.extend([vec![quad[0], quad[1], quad[2]], vec![quad[0], quad[2], quad[3]]]);
                } else {
                    parts.push(quad.to_vec());
                }
            }
        }
        parts
    }

    #[test]
    fn the_estimate_covers_the_errors() {
        let state = &mut 5;
        let (mut tried, mut worst) = (0, [0.0f64; ORDERS.len()]);
        while tried < 400 {
            let mut vector = || DVec3::new(noise(state), noise(state), noise(state));
            let rectangle = |corner: DVec3, u: DVec3, v: DVec3| {
                let across = (v - u * (u.dot(v) / u.length_squared())).normalize_or_zero();
                (corner, u, across * (0.3 + u.length()))
            };
            let (a, xa, ya) = rectangle(vector(), vector(), vector());
            let (b, xb, yb) = rectangle(vector() * 3.0, vector(), vector());
            let (na, nb) = (xa.cross(ya).normalize_or_zero(), xb.cross(yb).normalize_or_zero());
            let corners = |c: DVec3, x: DVec3, y: DVec3| [c, c + x, c + x + y, c + y];
            let (ca, cb) = (corners(a, xa, ya), corners(b, xb, yb));
            let in_front = ca.iter().all(|&p| nb.dot(p - b) > 0.0) && cb.iter().all(|&p| na.dot(p - a) > 0.0);
            if !in_front {
                continue;
            }
            tried += 1;
            let (pa, pb) = (parts(a, xa, ya, 3), parts(b, xb, yb, 2));
            for (k, &order) in ORDERS.iter().enumerate() {
                let of_a = Basis::new(ca, na, pa.iter().map(Vec::as_slice), order);
                let of_b = Basis::new(cb, nb, pb.iter().map(Vec::as_slice), order);
                let Some(kernel) = of_a.kernel(&of_b) else { continue };
                let mut got = Vec::new();
                of_a.exchange(&of_b, &kernel, &mut got);
                let mut portable = Vec::new();
                of_a.exchange_portable(&of_b, &kernel, &mut portable);
                assert!(got.iter().zip(&portable).all(|(g, p)| g.to_bits() == p.to_bits()));
                for (i, p) in pa.iter().enumerate() {
                    for (j, q) in pb.iter().enumerate() {
                        let exact = contour(p, q, 1e-14);
                        let area = crate::polygon::area(p) * crate::polygon::area(q);
                        let error =
                            ((got[i * pb.len() + j] - exact.value).abs() - exact.error - 1e-14 * area)
                                .max(0.0);
                        worst[k] = worst[k].max(error / (kernel.error * area));
                    }
                }
            }
        }
        assert!(worst.iter().all(|&w| w <= 1.0 && w > 0.03), "{worst:?}");
    }

    #[test]
    fn sets_that_touch_are_refused() {
        let floor = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let wall = [DVec3::ZERO, DVec3::Y, DVec3::new(0.0, 1.0, 1.0), DVec3::Z];
        let of = |corners: [DVec3; 4], n| Basis::new(corners, n, std::iter::once(&corners[..]), 3);
        assert!(of(floor, DVec3::Z).kernel(&of(wall, DVec3::X)).is_none());
    }
}
