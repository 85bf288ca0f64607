//! What one point sees past a few bodies, asked cluster by cluster: none, all, or which share of a polygon.
//!
//! The bodies' shadows are found once per point ([`PointShadows`]); each cluster passes on those that may touch it. The share
//! is the quotient of two point form factors (Lambert's formula) of one polygon, what is seen of it over all of it: the
//! kernel's change over the polygon drops out, what is left is visibility.

use crate::body::Body;
use crate::gather::{Look, Scratch, see};
use crate::point_factor::above_horizon;
use crate::point_shadow::{Bounds, Cone, Meets};
use glam::DVec3;
use std::ops::Range;

/// A point on a plane with the shadows it sees.
#[derive(Debug)]
pub struct PointView {
    look: Look,
    scratch: Scratch,
}

/// What a point sees of a cluster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sight {
    /// All of it.
    Clear,
    /// Nothing: one body hides it.
    Hidden,
    /// These shadows may touch it.
    Across(Range<usize>),
}

impl Default for PointView {
    fn default() -> Self {
        let look = Look { point: DVec3::ZERO, normal: DVec3::Z, hidden: true };
        Self { look, scratch: Scratch::default() }
    }
}

impl PointView {
    /// Looks from `point` over a plane with this unit normal at a box, given in space, past `bodies`; the shadows of those that
    /// may stand before it are the list that is returned.
    pub fn look<'b>(
        &mut self,
        point: DVec3,
        normal: DVec3,
        space: &Bounds,
        bodies: impl IntoIterator<Item = &'b Body>,
    ) -> Range<usize> {
        let cone = Cone::around(space.centre - point, space.radius);
        let may_hide = |body: &&Body| Cone::around(body.centre - point, body.radius).may_meet(&cone);
        self.look = Look { point, normal, hidden: true };
        let Scratch { shadows, candidates, .. } = &mut self.scratch;
        shadows.look(point, normal, bodies.into_iter().filter(may_hide));
        candidates.clear();
        candidates.extend(shadows.all());
        0..candidates.len()
    }

    /// Which shadows of a list may touch a box, given in space; they are put on top of the stack of lists.
    pub fn narrow(&mut self, list: Range<usize>, space: &Bounds) -> Sight {
        let bounds = Bounds { centre: space.centre - self.look.point, ..*space };
        let cone = Cone::around(bounds.centre, bounds.radius);
        let Scratch { shadows, candidates, .. } = &mut self.scratch;
        let start = candidates.len();
        for at in list {
            match shadows.narrow(candidates[at], &bounds, &cone) {
                Meets::Nothing => {}
                Meets::Part(candidate) => candidates.push(candidate),
                Meets::Everything => {
                    candidates.truncate(start);
                    return Sight::Hidden;
                }
            }
        }
        if candidates.len() == start { Sight::Clear } else { Sight::Across(start..candidates.len()) }
    }

    /// Takes the lists from `list` on off the stack.
    pub fn forget(&mut self, list: &Range<usize>) {
        self.scratch.candidates.truncate(list.start);
    }

    /// Share of a convex polygon's form factor that the shadows of a list leave, 0 to 1; `None` where nothing of it lies above
    /// the horizon in front of the point.
    pub fn share(&mut self, corners: &[DVec3], list: Range<usize>) -> Option<f64> {
        let factor = |seen: &crate::visible_part::Polygons, normal: DVec3| {
            seen.iter().map(|piece| above_horizon(DVec3::ZERO, normal, piece)).sum::<f64>()
        };
        let look = self.look;
        let whole = factor(see(corners, 0..0, look, &mut self.scratch), look.normal);
        if whole.is_nan() || whole <= 0.0 {
            return None;
        }
        if list.is_empty() {
            return Some(1.0);
        }
        let seen = factor(see(corners, list, look, &mut self.scratch), look.normal);
        Some((seen / whole).clamp(0.0, 1.0))
    }
}
