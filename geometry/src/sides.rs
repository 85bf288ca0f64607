//! For every patch and occluder the side facts that rule a blocker out, as bits: a pair's
//! possible blockers come from a few words of logic instead of a loop over the scene.
//!
//! A blocker cannot matter where both ends lie on one side of its plane, or where it lies wholly behind the plane of
//! one end. In a convex room these two facts alone leave no blocker for any pair.

use crate::occluder::Occluder;
use crate::plane::{PLANARITY, Plane};
use glam::DVec3;

/// Bits of one patch, one per occluder.
#[derive(Debug, Clone, Default)]
pub struct SideBits {
    /// The receiver lies at or in front of the occluder's plane.
    front: Vec<u64>,
    /// The receiver lies at or behind the occluder's plane.
    back: Vec<u64>,
    /// The occluder lies at or behind the receiver's plane.
    beneath: Vec<u64>,
}

impl SideBits {
    /// Facts of a patch with these corners, plane and size.
    pub fn of_patch(corners: &[DVec3], plane: &Plane, radius: f64, occluders: &[Occluder]) -> Self {
        let words = occluders.len().div_ceil(64);
        let mut bits = Self { front: vec![0; words], back: vec![0; words], beneath: vec![0; words] };
        for (k, occluder) in occluders.iter().enumerate() {
            let (word, bit) = (k / 64, 1u64 << (k % 64));
            let tolerance = PLANARITY * (occluder.radius + radius);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for &corner in corners {
                let height = occluder.plane.distance(corner);
                (low, high) = (low.min(height), high.max(height));
            }
            if low >= -tolerance {
                bits.front[word] |= bit;
            }
            if high <= tolerance {
                bits.back[word] |= bit;
            }
            if occluder.corners.iter().all(|&c| plane.distance(c) <= PLANARITY * occluder.radius) {
                bits.beneath[word] |= bit;
            }
        }
        bits
    }

    /// Calls `visit` with every occluder out of `count` that may block between two receivers, in order.
    pub fn for_each_candidate(&self, other: &SideBits, count: usize, mut visit: impl FnMut(usize)) {
        for word in 0..self.front.len() {
            let harmless = (self.front[word] & other.front[word])
                | (self.back[word] & other.back[word])
                | self.beneath[word]
                | other.beneath[word];
            let mut left = !harmless;
            let used = count - 64 * word;
            if used < 64 {
                left &= (1 << used) - 1;
            }
            while left != 0 {
                visit(64 * word + left.trailing_zeros() as usize);
                left &= left - 1;
            }
        }
    }

    /// Whether the occluder may block between the two patches.
    pub fn may_block(&self, other: &SideBits, occluder: usize) -> bool {
        let (word, bit) = (occluder / 64, 1u64 << (occluder % 64));
        let harmless = (self.front[word] & other.front[word])
            | (self.back[word] & other.back[word])
            | self.beneath[word]
            | other.beneath[word];
        harmless & bit == 0
    }
}
