//! Stratified points from a seed: one jittered point in each of n cells of equal area (Cook, Porter & Carpenter 84), and
//! the maps that carry the unit square, areas kept, onto a polygon and onto directions with cosine density.
//!
//! The mean of a function over such points varies no more than over as many independent ones; where two sets are
//! combined in shuffled order (Latin hypercube), by at most n / (n - 1) of that (Owen 97).

use crate::polygon;
use glam::DVec3;

/// SplitMix64 (Steele, Lea & Flood 2014): seeded numbers, the same on every machine.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for every pair of numbers.
    pub fn new(first: u64, second: u64) -> Self {
        let mut random = Self(first);
        // Scrambled before the second number enters, so that (0, 1) and (1, 0) are unrelated.
        random.0 = random.bits() ^ second;
        random.0 = random.bits();
        random
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Brings `items` into a random order (Fisher & Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let other = (self.unit() * (last + 1) as f64) as usize;
            items.swap(last, other);
        }
    }
}

/// One random point in each of `count` cells of equal area of the unit square: about sqrt(count) bands of about as many.
pub fn jittered(count: usize, random: &mut Random) -> Vec<(f64, f64)> {
    let bands = ((count as f64).sqrt().round() as usize).max(1);
    let mut points = Vec::with_capacity(count);
    for band in 0..bands {
        let (start, end) = (count * band / bands, count * (band + 1) / bands);
        let cells = (end - start) as f64;
        for cell in start..end {
            let u = (start as f64 + cells * random.unit()) / count as f64;
            let v = ((cell - start) as f64 + random.unit()) / cells;
            points.push((u, v));
        }
    }
    points
}

/// The unit square laid over a convex polygon: cells of equal area keep equal areas.
#[derive(Debug, Clone)]
pub struct AreaMap {
    /// Triangles of the polygon, each with the share of the area up to its end.
    triangles: Vec<([DVec3; 3], f64)>,
}

impl AreaMap {
    /// The map onto a convex polygon of at least three corners.
    pub fn new(corners: &[DVec3]) -> Self {
        let total = polygon::area(corners);
        let mut covered = 0.0;
        let triangles = (2..corners.len()).map(|k| {
            let triangle = [corners[0], corners[k - 1], corners[k]];
            covered += polygon::area(&triangle) / total;
            (triangle, covered)
        });
        Self { triangles: triangles.collect() }
    }

    /// The point of the polygon for a point of the unit square.
    pub fn place(&self, (u, v): (f64, f64)) -> DVec3 {
        let last = self.triangles.len().saturating_sub(1);
        let k = self.triangles.iter().position(|&(_, end)| u < end).unwrap_or(last);
        let Some(&([a, b, c], end)) = self.triangles.get(k) else { return DVec3::ZERO };
        let start = if k == 0 { 0.0 } else { self.triangles[k - 1].1 };
        let within = ((u - start) / (end - start)).clamp(0.0, 1.0);
        // The area up to a line parallel to bc grows with the square of its distance from a.
        let along = within.sqrt();
        a + along * ((1.0 - v) * (b - a) + v * (c - a))
    }
}

/// Direction about the z axis with density cos / pi: the concentric map to the disk (Shirley & Chiu 97), lifted to the
/// hemisphere (Malley).
pub fn cosine_direction((u, v): (f64, f64)) -> DVec3 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (radius, angle) = if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    let (sine, cosine) = angle.sin_cos();
    DVec3::new(radius * cosine, radius * sine, (1.0 - radius * radius).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every cell has one point, whatever their number.
    #[test]
    fn each_cell_has_its_point() {
        for count in [1, 2, 5, 16, 37, 1000] {
            let points = jittered(count, &mut Random::new(1, 2));
            assert_eq!(points.len(), count);
            let bands = (count as f64).sqrt().round() as usize;
            for (k, &(u, v)) in points.iter().enumerate() {
                let band = (0..bands).rfind(|b| count * b / bands <= k).unwrap_or(0);
                let (start, end) = (count * band / bands, count * (band + 1) / bands);
                let (low, high) = (start as f64 / count as f64, end as f64 / count as f64);
                let cells = (end - start) as f64;
                assert!(u >= low && u < high, "{count}: {k} at {u}");
                assert_eq!((v * cells) as usize, k - start, "{count}: {k} at {v}");
            }
        }
    }

    /// Centroid and second moment of an uneven quadrilateral, by points and by Gauss.
    #[test]
    fn points_cover_a_polygon_evenly() {
        let corners =
            [(0.0, 0.0), (3.0, 0.0), (2.0, 1.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec();
        let map = AreaMap::new(&corners);
        let count = 40_000;
        let points = jittered(count, &mut Random::new(3, 4));
        let (mut mean, mut square) = (DVec3::ZERO, 0.0);
        for &point in &points {
            let x = map.place(point);
            mean += x / count as f64;
            square += x.length_squared() / count as f64;
        }
        let (mut at, mut weight) = (Vec::new(), Vec::new());
        let strength = crate::quadrature::Strength::Middle;
        crate::quadrature::polygon_rule(&corners, strength, &mut at, &mut weight);
        let area: f64 = weight.iter().sum();
        let want: f64 = at.iter().zip(&weight).map(|(p, w)| w * p.length_squared()).sum::<f64>() / area;
        // Only the band of cells across both triangles is uneven: 200 points that err by 1 / sqrt(200) of their share 1 / 200,
        // a tenth of what independent points do. Four times that.
        assert!((mean - polygon::centroid(&corners)).length() < 1.4e-3, "{mean}");
        assert!((square - want).abs() < 4e-3, "{square} {want}");
    }

    /// Moments of the cosine density: the mean of cos is 2/3, of x^2 it is 1/4.
    #[test]
    fn directions_have_cosine_density() {
        let points = jittered(10_000, &mut Random::new(5, 6));
        let mean = |f: &dyn Fn(DVec3) -> f64| {
            points.iter().map(|&p| f(cosine_direction(p))).sum::<f64>() / points.len() as f64
        };
        // A cell is 0.02 of the disk's radius wide: 10^4 points in theirs err by 0.02 / sqrt(12 10^4). Four times that.
        assert!((mean(&|d| d.z) - 2.0 / 3.0).abs() < 2.4e-4);
        assert!((mean(&|d| d.x * d.x) - 0.25).abs() < 2.4e-4);
        assert!(mean(&|d| d.x).abs() < 2.4e-4);
        assert!(points.iter().all(|&p| (cosine_direction(p).length() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn seeds_give_unrelated_sequences() {
        let start = |a, b| Random::new(a, b).unit();
        assert!(start(0, 1) != start(1, 0) && start(0, 0) != start(0, 1));
        let mut order: Vec<usize> = (0..100).collect();
        Random::new(7, 8).shuffle(&mut order);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(order != sorted && sorted == (0..100).collect::<Vec<_>>());
    }
}
