//! The share of an exchange that blockers let through, by stratified rays between the two elements.
//!
//! Each ray counts with the kernel cos cos / r^2 of its ends, so that the share is that of the light and not of the rays.
//! The rays of a pair depend on its numbers alone.

use geometry::patch::Patch;
use geometry::strata::{AreaMap, Random, jittered};
use glam::DVec3;

/// Rays per pair.
pub const RAYS: usize = 64;
/// Error stated, in units of the standard deviation. The mean |error| is sqrt(2 / pi) = 0.8 of it; rows whose few large pairs
/// were all unlucky went 2 % beyond that.
const STATED_DEVIATION: f64 = 1.0;
/// Where all rays agree, a corner of light or shadow smaller than about one ray's cell may still be between them: on
/// average half a ray.
const UNSEEN_RAYS: f64 = 0.5;

/// A share between 0 and 1 with its estimated error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Share of the exchange that passes.
    pub value: f64,
    /// Estimated absolute error.
    pub error: f64,
}

/// Share of the exchange between `p` and `q` that passes where `blocked` says which segments do not; the seed is the
/// pair's two numbers.
pub fn visible_share(
    p: &Patch,
    q: &Patch,
    seed: (usize, usize),
    blocked: impl Fn(DVec3, DVec3) -> bool,
) -> Share {
    let mut random = Random::new(seed.0 as u64, seed.1 as u64);
    let (map_p, map_q) = (AreaMap::new(&p.corners), AreaMap::new(&q.corners));
    let mut starts = jittered(RAYS, &mut random);
    random.shuffle(&mut starts);
    let ends = jittered(RAYS, &mut random);
    let (mut all, mut squares, mut passed) = (0.0, 0.0, 0.0);
    for (&start, &end) in starts.iter().zip(&ends) {
        let (from, to) = (map_p.place(start), map_q.place(end));
        let between = to - from;
        let r2 = between.length_squared();
        let (height_p, height_q) = (p.plane.normal.dot(between), -q.plane.normal.dot(between));
        let weight = height_p.max(0.0) * height_q.max(0.0) / (r2 * r2);
        if !(weight > 0.0 && weight.is_finite()) {
            continue;
        }
        all += weight;
        squares += weight * weight;
        if !blocked(from, to) {
            passed += weight;
        }
    }
    if all == 0.0 {
        // No ray leaves and arrives in front: nothing is known.
        return Share { value: 0.5, error: 0.5 };
    }
    let value = passed / all;
    // As many rays of equal weight as would vary as much.
    let effective = all * all / squares;
    let deviation = (value * (1.0 - value) / effective).sqrt();
    Share { value, error: STATED_DEVIATION * deviation + UNSEEN_RAYS / effective }
}
