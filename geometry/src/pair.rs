//! The exchange factor of any two patches of a scene: classified first, then computed by the means of its class.

use crate::area_rule::{Separation, kernel_sum};
use crate::body::Body;
use crate::contour::Exchange;
use crate::occluded::{self, Effort, Wanted};
use crate::patch::Patch;
use crate::shadow::{Blocking, From, Set, Shadows};
use crate::unoccluded::{self, Facing, Rule, facing, mutual_parts};
use std::ops::Range;

/// Patches whose radii differ by more than this factor: the smaller one receives, however many lines cross it.
const MUCH_LONGER: f64 = 3.0;

/// What stands between two patches that see each other's front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// Nothing.
    Clear,
    /// One body that covers all.
    Covered,
    /// The bodies whose shadows are on the stack.
    Partial,
}

/// Working memory for pairs; `'a` is the scene's.
#[derive(Debug, Default)]
pub struct Scratch<'a> {
    /// What stands between; sets of patches narrow it before the pairs do.
    pub shadows: Shadows<'a>,
    occluded: occluded::Scratch,
}

/// Two patches, each wholly in front of the other.
#[derive(Debug, Clone)]
pub enum InFront<'p> {
    /// As they are.
    Whole(&'p Patch, &'p Patch),
    /// Cut at each other's planes.
    Cut(Box<(Patch, Patch)>),
}

impl<'p> InFront<'p> {
    /// The parts of two patches that see each other's front; `None` where there are none.
    pub fn new(p: &'p Patch, q: &'p Patch) -> Option<Self> {
        match facing(p, q) {
            Facing::Away => None,
            Facing::Full => Some(Self::Whole(p, q)),
            Facing::Cut => mutual_parts(p, q).map(|parts| Self::Cut(Box::new(parts))),
        }
    }

    /// The two patches.
    pub fn patches(&self) -> (&Patch, &Patch) {
        match self {
            Self::Whole(p, q) => (p, q),
            Self::Cut(parts) => (&parts.0, &parts.1),
        }
    }

    /// What of the shadows `which`, found for sets that hold the two patches, stands between them; where some do in part,
    /// their narrowed shadows are put on the stack.
    pub fn view(&self, which: Range<usize>, shadows: &mut Shadows<'_>) -> View {
        let (p, q) = self.patches();
        narrow_all(which, set(p), set(q), shadows)
    }

    /// About the exchange factor without blockers, for sharing out the tolerance.
    pub fn unblocked_size(&self) -> f64 {
        let (p, q) = self.patches();
        let separation = Separation::new(p, q);
        let estimate = kernel_sum(&p.low, p.plane.normal, &q.low, q.plane.normal);
        // Beside a common edge the points overestimate; a factor is at most 1 on either side.
        estimate.max(1e-3 * separation.kernel).min(p.area.min(q.area))
    }

    /// Exchange factor with nothing between, within `relative` of its value.
    pub fn unoccluded(&self, relative: f64) -> (Exchange, Rule) {
        let (p, q) = self.patches();
        unoccluded::exchange_in_front(p, q, relative)
    }

    /// Exchange factor behind the shadows `which` that [`InFront::view`] put on the stack.
    pub fn occluded(
        &self,
        which: Range<usize>,
        wanted: Wanted,
        scratch: &mut Scratch<'_>,
    ) -> (Exchange, Effort) {
        let (p, q) = self.patches();
        let Scratch { shadows, occluded } = scratch;
        // The receiver is the patch that fewer planes through a blocker's edge and a corner of the other one cross: its
        // view changes more smoothly, and the other one is cut exactly anyway.
        let lines_on_p = shadows.crossings(which.clone(), From::First, &p.corners, &q.corners);
        let lines_on_q = shadows.crossings(which.clone(), From::Second, &q.corners, &p.corners);
        // A patch several times as long as the other is far from even over what it sees of that: the shorter one receives.
        let q_receives = if p.radius.max(q.radius) > MUCH_LONGER * p.radius.min(q.radius) {
            q.radius < p.radius
        } else {
            lines_on_q < lines_on_p || (lines_on_q == lines_on_p && q.area < p.area)
        };
        let (receiver, source, from) = if q_receives { (q, p, From::Second) } else { (p, q, From::First) };
        occluded::exchange(set(receiver), set(source), shadows, (which, from), wanted, occluded)
    }
}

/// A patch as a set of points.
pub fn set(patch: &Patch) -> Set<'_> {
    Set { corners: &patch.corners, radius: patch.radius, normal: Some(patch.plane.normal) }
}

/// Narrows the shadows `which` to two sets inside those they were found for.
pub fn narrow_all(which: Range<usize>, first: Set<'_>, second: Set<'_>, shadows: &mut Shadows<'_>) -> View {
    let start = shadows.len();
    for at in which {
        if shadows.narrow(at, first, second, None) == Blocking::Everything {
            shadows.truncate(start);
            return View::Covered;
        }
    }
    if shadows.len() == start { View::Clear } else { View::Partial }
}

/// Looks how a body stands between two sets that see each other's front; its shadow (or those of its faces) is put on the
/// stack where it blocks a part.
pub fn look<'a>(body: &'a Body, first: Set<'_>, second: Set<'_>, shadows: &mut Shadows<'a>) -> Blocking {
    let before = shadows.len();
    match shadows.add(body, first, second) {
        Blocking::Inside => {
            for part in &body.parts {
                if look(part, first, second, shadows) == Blocking::Everything {
                    shadows.truncate(before);
                    return Blocking::Everything;
                }
            }
            if shadows.len() > before { Blocking::Part } else { Blocking::Nothing }
        }
        blocking => blocking,
    }
}
