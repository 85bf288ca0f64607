//! Exchange factors of one patch with many, all wholly in front of each other and far apart, several pairs at a time.
//!
//! Gauss points on both, summed over the kernel cos cos / (pi r^2): the only rule that loses no digits far away (theory of
//! its cancellation: all terms have one sign). Its error falls as a power of size over distance.

use crate::lanes::{LANES, Lane, all, lanes};
use crate::patch::Patch;
use crate::polygon;
use crate::quadrature::Strength;
use std::f64::consts::PI;

/// Most points of a rule.
const MOST_POINTS: usize = 9;
/// The error estimates hold up to this (R_i + R_j) / r: beyond, the higher orders are not small.
const FAR: f64 = 0.35;

/// How a rule's error falls: c K (m / r^2)^power, m the sum of both patches' second moments, and c K (s / r)^power, s the
/// larger radius of those patches that are not their own mirror image through the centre, where odd moments count too. K
/// is the kernel with its largest cosines. The constants are above the worst of 2 10^4 random pairs of triangles and
/// parallelograms (test `the_estimates_cover_the_errors`).
#[derive(Debug, Clone, Copy)]
struct Decay {
    even: (f64, u32),
    odd: (f64, u32),
}

const LOW: Decay = Decay { even: (5.2, 2), odd: (0.35, 3) };
const MIDDLE: Decay = Decay { even: (2.8, 3), odd: (0.12, 5) };

/// Patches prepared for [`FarPatches::factors`]: the points of one strength, coordinates apart.
#[derive(Debug, Clone)]
pub struct FarPatches {
    decay: Decay,
    centre: [Vec<f64>; 3],
    normal: [Vec<f64>; 3],
    points: Vec<[Vec<f64>; 3]>,
    weights: Vec<Vec<f64>>,
    /// Sum of the second moments.
    moments: Vec<f64>,
    area: Vec<f64>,
    radius: Vec<f64>,
    /// Radius, or 0 where the odd moments are 0; infinite for patches with too many points, which are left to other rules.
    skew: Vec<f64>,
}

impl FarPatches {
    /// Prepares patches with their points of [`Strength::Low`].
    pub fn low(patches: &[Patch]) -> Self {
        Self::new(patches, Strength::Low)
    }

    /// Prepares patches with their points of [`Strength::Middle`].
    pub fn middle(patches: &[Patch]) -> Self {
        Self::new(patches, Strength::Middle)
    }

    fn new(patches: &[Patch], strength: Strength) -> Self {
        let (decay, most_points) = if strength == Strength::Low { (LOW, 4) } else { (MIDDLE, 9) };
        let empty = || [Vec::new(), Vec::new(), Vec::new()];
        let mut far = Self {
            decay,
            centre: empty(),
            normal: empty(),
            points: vec![empty(); most_points],
            weights: vec![Vec::new(); most_points],
            moments: Vec::new(),
            area: Vec::new(),
            radius: Vec::new(),
            skew: Vec::new(),
        };
        for patch in patches {
            let rule = if strength == Strength::Low { &patch.low } else { &patch.middle };
            let count = rule.weight.len();
            for k in 0..most_points {
                // A triangle's last points have no weight; they stand where the kernel is harmless.
                let [x, y, z, weight] = if k < count {
                    [rule.x[k], rule.y[k], rule.z[k], rule.weight[k]]
                } else {
                    [patch.centroid.x, patch.centroid.y, patch.centroid.z, 0.0]
                };
                far.points[k].iter_mut().zip([x, y, z]).for_each(|(list, x)| list.push(x));
                far.weights[k].push(weight);
            }
            for (lists, v) in [(&mut far.centre, patch.centroid), (&mut far.normal, patch.plane.normal)] {
                lists.iter_mut().zip(v.to_array()).for_each(|(list, x)| list.push(x));
            }
            let (first, second) = polygon::principal_axes(&patch.corners, patch.centroid, patch.plane.normal);
            far.moments.push(first.length_squared() + second.length_squared());
            far.area.push(patch.area);
            far.radius.push(patch.radius);
            let is_symmetric = polygon::parallelogram(&patch.corners).is_some();
            far.skew.push(match count {
                _ if is_symmetric => 0.0,
                _ if count <= most_points => patch.radius,
                _ => f64::INFINITY,
            });
        }
        far
    }

    /// Calls `visit(place, value, error)` for patch `i` with each of `columns` (place in the list): exchange factor and
    /// estimate of its error, infinite where they are too near for an error of `relative`. Means nothing for pairs that are
    /// not wholly in front of each other.
    pub fn factors(&self, i: usize, columns: &[u32], relative: f64, mut visit: impl FnMut(usize, f64, f64)) {
        for (group, indices) in columns.chunks(LANES).enumerate() {
            let columns = std::array::from_fn(|k| indices[k.min(indices.len() - 1)] as usize);
            let (values, errors) = self.together(i, &columns, relative);
            for k in 0..indices.len() {
                visit(group * LANES + k, values[k], errors[k]);
            }
        }
    }

    /// Values and errors of one group, with the widest registers of the machine. The loops add up in a fixed order and fuse no
    /// operations: the wide code gives the same bytes as the portable code.
    #[allow(unsafe_code)] // calls of code for features that have just been found
    fn together(&self, i: usize, columns: &[usize; LANES], relative: f64) -> (Lane, Lane) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the feature is there.
                return unsafe { self.together_avx512(i, columns, relative) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the feature is there.
                return unsafe { self.together_avx2(i, columns, relative) };
            }
        }
        self.together_portable(i, columns, relative)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn together_avx512(&self, i: usize, columns: &[usize; LANES], relative: f64) -> (Lane, Lane) {
        self.together_portable(i, columns, relative)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn together_avx2(&self, i: usize, columns: &[usize; LANES], relative: f64) -> (Lane, Lane) {
        self.together_portable(i, columns, relative)
    }

    #[inline(always)]
    fn together_portable(&self, i: usize, columns: &[usize; LANES], relative: f64) -> (Lane, Lane) {
        // Neighbours in the list are mostly neighbours in memory.
        match (1..LANES).all(|k| columns[k] == columns[0] + k) {
            true => self.sums(i, relative, |from| {
                let from = &from[columns[0]..columns[0] + LANES];
                lanes(|k| from[k])
            }),
            false => self.sums(i, relative, |from| lanes(|k| from[columns[k]])),
        }
    }

    #[inline(always)]
    fn sums(&self, i: usize, relative: f64, column: impl Fn(&[f64]) -> Lane) -> (Lane, Lane) {
        let own = |from: &[Vec<f64>; 3]| [from[0][i], from[1][i], from[2][i]];
        let load = |from: &[Vec<f64>; 3]| [column(&from[0]), column(&from[1]), column(&from[2])];
        let (n, m) = (own(&self.normal), load(&self.normal));
        let (c, centre) = (own(&self.centre), load(&self.centre));

        // The error needs no sum; nor does the most that the factor may be.
        let (area, radius) = (column(&self.area), column(&self.radius));
        let (moments, skew) = (column(&self.moments), column(&self.skew));
        let (even, odd) = (self.decay.even, self.decay.odd);
        let r = [0, 1, 2].map(|axis| lanes(|k| centre[axis][k] - c[axis]));
        let inverse = lanes(|k| 1.0 / (r[0][k] * r[0][k] + r[1][k] * r[1][k] + r[2][k] * r[2][k]));
        let root = lanes(|k| inverse[k].sqrt());
        let theta = lanes(|k| (self.radius[i] + radius[k]) * root[k]);
        let kernel = lanes(|k| {
            let height_p = n[0] * r[0][k] + n[1] * r[1][k] + n[2] * r[2][k];
            let height_q = m[0][k] * r[0][k] + m[1][k] * r[1][k] + m[2][k] * r[2][k];
            let largest = |height: f64| (height.abs() * root[k] + theta[k]).min(1.0);
            self.area[i] * area[k] * inverse[k] / PI * largest(height_p) * largest(height_q)
        });
        let errors = lanes(|k| {
            let even = even.0 * power((self.moments[i] + moments[k]) * inverse[k], even.1);
            let odd = odd.0 * power(self.skew[i].max(skew[k]) * root[k], odd.1);
            if theta[k] <= FAR { kernel[k] * (even + odd) } else { f64::INFINITY }
        });
        // Far away the kernel with its largest cosines over the kernel is near 1.
        if all(|k| errors[k] > relative * kernel[k]) {
            return ([0.0; LANES], [f64::INFINITY; LANES]);
        }

        // Heights over a plane do not depend on the point of that plane they are measured from.
        let mut heights = [[0.0; LANES]; MOST_POINTS];
        for ((p, weights), heights) in self.points.iter().zip(&self.weights).zip(&mut heights) {
            let (x, weight) = (own(p), weights[i]);
            *heights = lanes(|k| {
                let r = [x[0] - centre[0][k], x[1] - centre[1][k], x[2] - centre[2][k]];
                weight * (m[0][k] * r[0] + m[1][k] * r[1] + m[2][k] * r[2])
            });
        }
        let mut sum = [0.0; LANES];
        for (q, weights) in self.points.iter().zip(&self.weights) {
            let (y, weight) = (load(q), column(weights));
            let mut part = [0.0; LANES];
            for (p, heights) in self.points.iter().zip(&heights) {
                let x = own(p);
                part = lanes(|k| {
                    let r = [y[0][k] - x[0], y[1][k] - x[1], y[2][k] - x[2]];
                    let squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
                    part[k] + heights[k] / (squared * squared)
                });
            }
            sum = lanes(|k| {
                let r = [y[0][k] - c[0], y[1][k] - c[1], y[2][k] - c[2]];
                sum[k] + weight[k] * part[k] * (n[0] * r[0] + n[1] * r[1] + n[2] * r[2])
            });
        }
        (lanes(|k| sum[k] / PI), errors)
    }
}

/// x^n for the small n of the rules; a call of the library would leave the wide registers.
#[inline(always)]
fn power(x: f64, n: u32) -> f64 {
    (1..n).fold(x, |product, _| product * x)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::contour::contour;
    use crate::unoccluded::{Facing, facing};
    use glam::DVec3;

    /// Numbers between -1 and 1 from a small generator with a fixed start.
    fn noise(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn random_patch(state: &mut u64, shift: DVec3) -> Patch {
        loop {
            let mut vector = || DVec3::new(noise(state), noise(state), noise(state));
            let (c, u, v, w) = (vector() + shift, vector(), vector(), vector());
            let triangle = vec![c, c + 0.5 * u, c + 0.5 * v];
            let quad = vec![c, c + 0.5 * u, c + 0.5 * (u + v), c + 0.5 * v];
            if u.cross(v).length() > 0.3 * u.length() * v.length() {
                return Patch::new(if w.x > 0.0 { triangle } else { quad }).unwrap();
            }
        }
    }

    #[test]
    fn the_estimates_cover_the_errors() {
        let state = &mut 1;
        let (mut worst, mut tried) = ([[0.0f64; 2]; 2], 0);
        while tried < 20_000 {
            let shift = DVec3::new(noise(state), noise(state), noise(state)) * 6.0;
            let pair = [random_patch(state, DVec3::ZERO), random_patch(state, shift)];
            let distance = (pair[0].centroid - pair[1].centroid).length();
            if facing(&pair[0], &pair[1]) != Facing::Full || pair[0].radius + pair[1].radius > FAR * distance
            {
                continue;
            }
            tried += 1;
            let exact = contour(&pair[0].corners, &pair[1].corners, 1e-15);
            let kind = usize::from(pair.iter().any(|p| p.corners.len() == 3));
            for (strength, far) in [FarPatches::low(&pair), FarPatches::middle(&pair)].iter().enumerate() {
                far.factors(0, &[1], f64::INFINITY, |_, value, estimate| {
                    let error = ((value - exact.value).abs() - exact.error).max(0.0);
                    worst[strength][kind] = worst[strength][kind].max(error / estimate);
                });
            }
        }
        assert!(worst.iter().flatten().all(|&w| w <= 1.0 && w > 0.2), "{worst:?}");
    }

    #[test]
    fn a_pair_does_not_depend_on_its_lane() {
        let state = &mut 7;
        let patches: Vec<Patch> =
            (0..30).map(|k| random_patch(state, DVec3::new(f64::from(k), 9.0, 3.0))).collect();
        let far = FarPatches::middle(&patches);
        let others: Vec<u32> = (0..30).filter(|&j| j != 3).collect();
        let mut together = Vec::new();
        far.factors(3, &others, f64::INFINITY, |_, value, error| {
            together.push((value.to_bits(), error.to_bits()))
        });
        let mut portable = Vec::new();
        for group in others.chunks(LANES) {
            let columns = std::array::from_fn(|k| group[k.min(group.len() - 1)] as usize);
            let (values, errors) = far.together_portable(3, &columns, f64::INFINITY);
            portable.extend((0..group.len()).map(|k| (values[k].to_bits(), errors[k].to_bits())));
        }
        assert_eq!(portable, together, "wide and portable code differ");
        for (j, want) in others.iter().zip(together) {
            far.factors(3, &[*j], f64::INFINITY, |_, value, error| {
                assert_eq!((value.to_bits(), error.to_bits()), want)
            });
        }
    }
}
