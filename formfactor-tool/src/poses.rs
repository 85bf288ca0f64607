//! Equal relative poses: pairs of patches that are moved copies of another pair have the same factor, computed once.
//!
//! A pair's pose is its corners in the frame of the first patch, in units of that patch's first edge, rounded. The factor is
//! computed from the rounded pose, not from the pair: so it is a function of the pose alone, the same bytes whichever pair
//! came first and with the skip turned off.

use geometry::contour::Exchange;
use geometry::patch::Patch;
use geometry::unoccluded::{Rule, exchange_in_front};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Steps per unit of a pose: 2^42. The roundings of coordinates in a scene up to a hundred times the patch stay below half
/// a step, and a step moves a factor by about 1e-12 of its value or, for nearly touching patches, of the gap.
const STEPS: f64 = 4_398_046_511_104.0;
/// Poses reaching farther than this many units would not keep their digits.
const REACH: f64 = 64.0;
/// Parts of the table, each with its lock.
const PARTS: usize = 64;

/// Rounded coordinates of a pair: corners of the first, then of the second.
type Pose = (u8, Box<[i64]>);

/// The factors of all poses met, in units of the first edge squared.
#[derive(Debug)]
pub struct Poses {
    parts: Vec<Mutex<HashMap<Pose, (Exchange, Rule)>>>,
    relative: f64,
    is_kept: bool,
    /// Pairs that asked for a pose's factor.
    asked: AtomicUsize,
}

impl Poses {
    /// For factors within `relative`; kept for the next equal pose where `is_kept`.
    pub fn new(relative: f64, is_kept: bool) -> Self {
        let parts = (0..PARTS).map(|_| Mutex::new(HashMap::new())).collect();
        Self { parts, relative, is_kept, asked: AtomicUsize::new(0) }
    }

    /// Exchange factor of two patches, each wholly in front of the other; `None` where the pair has no pose that keeps its
    /// digits.
    pub fn exchange(&self, p: &Patch, q: &Patch) -> Option<(Exchange, Rule)> {
        let unit = (p.corners[1] - p.corners[0]).length();
        let pose = pose(p, q, unit)?;
        self.asked.fetch_add(1, Ordering::Relaxed);
        let scaled = |(found, rule): (Exchange, Rule)| {
            let area = unit * unit;
            (Exchange { value: found.value * area, error: found.error * area }, rule)
        };
        let part = &self.parts[place(&pose)];
        let known = || part.lock().unwrap_or_else(PoisonError::into_inner).get(&pose).copied();
        if let Some(found) = self.is_kept.then(known).flatten() {
            return Some(scaled(found));
        }
        let corners: Vec<DVec3> = pose
            .1
            .chunks(3)
            .map(|c| DVec3::new(c[0] as f64 / STEPS, c[1] as f64 / STEPS, c[2] as f64 / STEPS))
            .collect();
        let (first, second) = corners.split_at(usize::from(pose.0));
        let (first, second) = (Patch::new(first.to_vec())?, Patch::new(second.to_vec())?);
        let found = exchange_in_front(&first, &second, self.relative);
        if self.is_kept {
            part.lock().unwrap_or_else(PoisonError::into_inner).insert(pose, found);
        }
        Some(scaled(found))
    }

    /// Number of different poses met.
    pub fn distinct(&self) -> usize {
        self.parts.iter().map(|part| part.lock().unwrap_or_else(PoisonError::into_inner).len()).sum()
    }

    /// Number of pairs whose pose was met before. Two threads may both have computed a pose that neither had met: this counts
    /// as if one had, so that it does not depend on threads.
    pub fn spared(&self) -> usize {
        if self.is_kept { self.asked.load(Ordering::Relaxed).saturating_sub(self.distinct()) } else { 0 }
    }
}

/// The rounded pose of a pair.
fn pose(p: &Patch, q: &Patch, unit: f64) -> Option<Pose> {
    let origin = p.corners[0];
    let x = (p.corners[1] - origin) / unit;
    let z = p.plane.normal;
    let y = z.cross(x);
    let mut steps = Vec::with_capacity(3 * (p.corners.len() + q.corners.len()));
    for &corner in p.corners.iter().chain(&q.corners) {
        let r = (corner - origin) / unit;
        for coordinate in [r.dot(x), r.dot(y), r.dot(z)] {
            if coordinate.abs() > REACH {
                return None;
            }
            steps.push((coordinate * STEPS).round() as i64);
        }
    }
    Some((p.corners.len() as u8, steps.into_boxed_slice()))
}

/// Part of the table that holds a pose.
fn place(pose: &Pose) -> usize {
    let mix =
        |hash: u64, &step: &i64| (hash ^ step as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    (pose.1.iter().fold(0, mix) >> 40) as usize % PARTS
}
