//! Lambert's sum over the border of what several points see, with a digest of how that border is put together.

use crate::interval::{Interval, NO_PART};
use crate::lanes::{LANES, Lane, all, count, lanes};
use crate::line_term::LineTerm;

/// Lambert's sum on its way.
#[derive(Debug, Default)]
pub(crate) struct Sum {
    /// The sum.
    pub total: Lane,
    /// A digest of what its terms are.
    pub kind: u64,
    /// Whether that differs between lanes.
    pub mixed: bool,
}

impl Sum {
    /// Adds the parts of a line that lie in `own` and in none of the `hidden` intervals, which are put in order.
    #[inline(always)]
    pub fn add_visible(&mut self, line: &LineTerm, place: usize, own: &Interval, hidden: &mut [Interval]) {
        if all(|k| own.end[k] <= own.start[k]) {
            return self.note(place, 0);
        }
        let mut number = 0;
        for at in 0..hidden.len() {
            let interval = hidden[at];
            if !all(|k| interval.end[k] <= interval.start[k]) {
                hidden[number] = interval.or_beyond();
                number += 1;
            }
        }
        for last in (1..number).rev() {
            for at in 0..last {
                let (first, second) = hidden.split_at_mut(at + 1);
                let swapped = Interval::sort(&mut first[at], &mut second[0]);
                self.note(place, swapped);
            }
        }
        let mut seen_to = own.start;
        for interval in &hidden[..number] {
            let gap_end =
                lanes(|k| if interval.start[k] < own.end[k] { interval.start[k] } else { own.end[k] });
            self.add_part(line, place, &seen_to, &gap_end);
            let end = lanes(|k| if interval.end[k] > gap_end[k] { interval.end[k] } else { gap_end[k] });
            self.note(place, count(|k| end[k] > seen_to[k] + NO_PART));
            seen_to = lanes(|k| if end[k] > seen_to[k] { end[k] } else { seen_to[k] });
        }
        self.add_part(line, place, &seen_to, &own.end);
    }

    #[inline(always)]
    fn add_part(&mut self, line: &LineTerm, place: usize, start: &Lane, end: &Lane) {
        self.note(place, count(|k| end[k] > start[k] + NO_PART));
        if !all(|k| end[k] <= start[k]) {
            let term = line.part(start, end);
            self.total = lanes(|k| self.total[k] + term[k]);
        }
    }

    /// Takes down in how many lanes something holds at a place of the border.
    #[inline(always)]
    fn note(&mut self, place: usize, number: usize) {
        self.mixed |= number != 0 && number != LANES;
        let bits = (place as u64) << 1 | u64::from(number != 0);
        self.kind = (self.kind ^ bits).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    }
}
