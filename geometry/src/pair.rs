//! The exchange factor of any two patches of a scene: classified first, then computed by the means of its class.

use crate::area_rule::{Separation, kernel_sum};
use crate::contour::Exchange;
use crate::occluded::{self, Effort};
use crate::occluder::{Occluder, separated};
use crate::patch::Patch;
use crate::unoccluded::{self, Facing, Rule, facing, mutual_parts};
use crate::visible::Scratch;
use glam::DVec3;

/// Class of a pair: for the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// The patches face away from each other.
    Invisible,
    /// Nothing stands between them; the rule that served.
    Unoccluded(Rule),
    /// One convex blocker covers the whole view.
    FullyBlocked,
    /// Partly occluded; what it cost.
    Occluded(Effort),
}

/// How exact a factor is wanted.
#[derive(Debug, Clone, Copy)]
pub struct Accuracy {
    /// Relative error of an unoccluded factor.
    pub unoccluded: f64,
    /// Error of an occluded factor, relative to the factor without blockers.
    pub occluded: f64,
    /// Factor (of the smaller patch) whose relative error is asked of smaller factors too: they cannot matter more.
    pub least_factor: f64,
    /// Most visible parts computed for one pair.
    pub most_evaluations: usize,
}

/// Exchange factor of two patches; `candidates` are all occluders that could stand between them (none in the plane of
/// either). `blockers` and `scratch` are working memory.
pub fn exchange<'a>(
    p: &Patch,
    q: &Patch,
    candidates: impl Iterator<Item = &'a Occluder>,
    accuracy: Accuracy,
    blockers: &mut Vec<&'a Occluder>,
    scratch: &mut Scratch,
) -> (Exchange, Class) {
    match facing(p, q) {
        Facing::Away => (Exchange::NONE, Class::Invisible),
        Facing::Full => exchange_in_front(p, q, candidates, accuracy, blockers, scratch),
        Facing::Cut => match mutual_parts(p, q) {
            Some((p, q)) => exchange_in_front(&p, &q, candidates, accuracy, blockers, scratch),
            None => (Exchange::NONE, Class::Invisible),
        },
    }
}

fn exchange_in_front<'a>(
    p: &Patch,
    q: &Patch,
    candidates: impl Iterator<Item = &'a Occluder>,
    accuracy: Accuracy,
    blockers: &mut Vec<&'a Occluder>,
    scratch: &mut Scratch,
) -> (Exchange, Class) {
    // Blockers that reach into the hull of the pair; one that covers it ends the matter.
    let shaft: Vec<DVec3> = p.corners.iter().chain(&q.corners).copied().collect();
    blockers.clear();
    for candidate in candidates {
        if separated(&shaft, &candidate.corners) {
            continue;
        }
        if candidate.covers(&p.corners, &q.corners) {
            return (Exchange::NONE, Class::FullyBlocked);
        }
        blockers.push(candidate);
    }
    if blockers.is_empty() {
        let (found, rule) = unoccluded::exchange_in_front(p, q, accuracy.unoccluded);
        return (found, Class::Unoccluded(rule));
    }

    // The smaller patch receives: shadow planes are fewer across it, and the source is cut exactly anyway.
    let (receiver, source) = if q.area < p.area { (q, p) } else { (p, q) };
    let unblocked = unblocked_size(p, q);
    let tolerance = accuracy.occluded * unblocked.max(accuracy.least_factor * p.area.min(q.area));
    let (found, effort) =
        occluded::exchange(receiver, source, blockers, tolerance, accuracy.most_evaluations, scratch);
    (found, Class::Occluded(effort))
}

/// About the exchange factor without blockers, for sharing out the tolerance.
fn unblocked_size(p: &Patch, q: &Patch) -> f64 {
    let separation = Separation::new(p, q);
    let estimate = kernel_sum(&p.low, p.plane.normal, &q.low, q.plane.normal);
    // Beside a common edge the points overestimate; a factor is at most 1 on either side.
    estimate.max(1e-3 * separation.kernel).min(p.area.min(q.area))
}
