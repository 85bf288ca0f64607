//! Parts of a segment, one for each of several points: what a cone of half-spaces leaves of it.

use crate::lanes::{LANES, Lane, count, lanes};

/// Parts of lines this short do not tell one kind of view from another: rounding makes them where a corner of the source
/// lies on a shadow's border for all points.
pub(crate) const NO_PART: f64 = 1e-9;

/// Part of a segment: parameters from 0 to 1; nothing where the end is not above the start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval {
    /// Where it begins.
    pub start: Lane,
    /// Where it ends.
    pub end: Lane,
}

impl Interval {
    /// All of a segment.
    pub const WHOLE: Interval = Interval { start: [0.0; LANES], end: [1.0; LANES] };
    /// None of it.
    pub const NOTHING: Interval = Interval { start: [2.0; LANES], end: [-1.0; LANES] };

    /// Cuts it by heights over a half-space at 0 and at 1; where the height is zero in between.
    #[inline(always)]
    pub fn cut(&mut self, ha: &Lane, hb: &Lane) -> Lane {
        let crossing = lanes(|k| ha[k] / (ha[k] - hb[k]));
        let start = lanes(|k| {
            let inside = if hb[k] < 0.0 { 2.0 } else { crossing[k] };
            if ha[k] < 0.0 { inside } else { 0.0 }
        });
        let end = lanes(|k| {
            let inside = if ha[k] < 0.0 { -1.0 } else { crossing[k] };
            if hb[k] < 0.0 { inside } else { 1.0 }
        });
        self.start = lanes(|k| if start[k] > self.start[k] { start[k] } else { self.start[k] });
        self.end = lanes(|k| if end[k] < self.end[k] { end[k] } else { self.end[k] });
        crossing
    }

    /// Itself, and beyond all others in the lanes where it is nothing.
    #[inline(always)]
    pub fn or_beyond(&self) -> Interval {
        let is_something = |k: usize| self.end[k] > self.start[k];
        Interval {
            start: lanes(|k| if is_something(k) { self.start[k] } else { 2.0 }),
            end: lanes(|k| if is_something(k) { self.end[k] } else { -1.0 }),
        }
    }

    /// Puts two intervals in the order of their starts; the number of lanes in which they were not.
    #[inline(always)]
    pub fn sort(first: &mut Interval, second: &mut Interval) -> usize {
        let (a, b) = (*first, *second);
        let swapped = |k: usize| b.start[k] < a.start[k];
        *first = Interval {
            start: lanes(|k| if swapped(k) { b.start[k] } else { a.start[k] }),
            end: lanes(|k| if swapped(k) { b.end[k] } else { a.end[k] }),
        };
        *second = Interval {
            start: lanes(|k| if swapped(k) { a.start[k] } else { b.start[k] }),
            end: lanes(|k| if swapped(k) { a.end[k] } else { b.end[k] }),
        };
        count(|k| b.start[k] < a.start[k] - NO_PART)
    }
}
