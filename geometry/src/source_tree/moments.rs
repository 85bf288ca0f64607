//! Moments of flat sources up to the second order, and the series of the kernel that turns them into irradiance.

use super::Change;
use crate::plane::Plane;
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;

/// Moments of the sources over their plane, about a centre.
#[derive(Debug, Clone)]
pub(super) struct Moments<const N: usize> {
    pub(super) axes: [DVec3; 2],
    /// Largest strength times area, over pi.
    pub(super) size: f64,
    /// Strength times area.
    pub(super) zeroth: [f64; N],
    pub(super) first: [[f64; N]; 2],
    /// Along the first axis twice, the second twice, and both.
    pub(super) second: [[f64; N]; 3],
}

impl<const N: usize> Moments<N> {
    pub(super) fn none(plane: &Plane) -> Moments<N> {
        let (u, v) = plane.axes();
        Moments { axes: [u, v], size: 0.0, zeroth: [0.0; N], first: [[0.0; N]; 2], second: [[0.0; N]; 3] }
    }

    /// Adds a polygon of the given strength at its centroid, even or with a slope: over a triangle with corners u_i, of area
    /// A, u has the mean of the corners and u v the integral A / 12 (sum u_i v_i + sum u_i sum v_i). With a slope, third
    /// moments about the centroid are left out, as the series leaves them out.
    pub(super) fn add(
        &mut self,
        polygon: &[DVec3],
        plane: &Plane,
        (strength, centroid): (&[f64; N], DVec3),
        slope: &Change<N>,
        centre: DVec3,
    ) {
        let (mut area, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for k in 2..polygon.len() {
            let corners = [polygon[0], polygon[k - 1], polygon[k]];
            let twice = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(plane.normal);
            let places = corners.map(|corner| self.axes.map(|axis| axis.dot(corner - centre)));
            let sum = [0, 1].map(|c| places.iter().map(|p| p[c]).sum::<f64>());
            area += 0.5 * twice;
            (0..2).for_each(|c| first[c] += twice / 6.0 * sum[c]);
            for (at, (a, b)) in [(0, 0), (1, 1), (0, 1)].into_iter().enumerate() {
                let products: f64 = places.iter().map(|p| p[a] * p[b]).sum();
                second[at] += twice / 24.0 * (products + sum[a] * sum[b]);
            }
        }
        for (n, &s) in strength.iter().enumerate() {
            self.zeroth[n] += s * area;
            (0..2).for_each(|c| self.first[c][n] += s * first[c]);
            (0..3).for_each(|c| self.second[c][n] += s * second[c]);
            if let Some((_, slope)) = slope {
                // Moments of the change: (second moments about the centroid) times the slope, and its products with the shift.
                let shift = self.axes.map(|axis| axis.dot(centroid - centre));
                let g = self.axes.map(|axis| axis.dot(slope[n]));
                let about = |at: usize, a: usize, b: usize| second[at] - area * shift[a] * shift[b];
                let (uu, vv, uv) = (about(0, 0, 0), about(1, 1, 1), about(2, 0, 1));
                let change = [uu * g[0] + uv * g[1], uv * g[0] + vv * g[1]];
                (0..2).for_each(|c| self.first[c][n] += change[c]);
                self.second[0][n] += 2.0 * change[0] * shift[0];
                self.second[1][n] += 2.0 * change[1] * shift[1];
                self.second[2][n] += change[0] * shift[1] + change[1] * shift[0];
            }
        }
        let brightest = self.zeroth.iter().fold(0.0, |most: f64, z| most.max(z.abs()));
        self.size = FRAC_1_PI * brightest;
    }

    /// Adds the integral of the kernel times the sources. Over the sources' plane the kernel is h a / (pi r^4), with h the
    /// constant height of the point over that plane and a the height over the point's own, linear in place.
    pub(super) fn add_to(&self, sum: &mut [f64; N], to_centre: DVec3, source_normal: DVec3, normal: DVec3) {
        let r2 = to_centre.length_squared();
        let h = -source_normal.dot(to_centre) * FRAC_1_PI / (r2 * r2);
        let a = normal.dot(to_centre);
        let slope = self.axes.map(|axis| normal.dot(axis));
        let d = self.axes.map(|axis| axis.dot(to_centre) / r2);
        // Derivatives of a / r^4 times r^4, d being the place over r^2.
        let along = |c: usize| slope[c] - 4.0 * a * d[c];
        let twice = |b: usize, c: usize| {
            let equal = if b == c { a / r2 } else { 0.0 };
            -4.0 * (slope[b] * d[c] + slope[c] * d[b] + equal) + 24.0 * a * d[b] * d[c]
        };
        let (g, q) = ([along(0), along(1)], [0.5 * twice(0, 0), 0.5 * twice(1, 1), twice(0, 1)]);
        for (n, sum) in sum.iter_mut().enumerate() {
            let first = g[0] * self.first[0][n] + g[1] * self.first[1][n];
            let second = (0..3).map(|c| q[c] * self.second[c][n]).sum::<f64>();
            *sum += h * (a * self.zeroth[n] + first + second);
        }
    }
}
