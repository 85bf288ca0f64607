//! What several points see of a polygon past a few shadows, together: the same quantity as [`crate::visible_part`], in lanes.
//!
//! The border of what is seen of a source S consists of parts of the edges of S and of parts of chords, where the borders of
//! the shadows cross S. A shadow is a cone of half-spaces, so it hides one interval of every edge, and one of every chord
//! of another shadow; of its own chords the interval in its other half-spaces bounds it. What the intervals of all shadows
//! leave is summed by Lambert's formula: no list of corners is built, so the lanes never part.
//!
//! # Precision
//! Rounding of the terms, 1e-16 of a factor of 1. Of two chords on one line that bound the same side one counts.

use crate::border_sum::Sum;
use crate::interval::Interval;
use crate::lanes::{LANES, Lane, Vectors, all, lanes};
use crate::line_term::LineTerm;
use crate::shadow::{Border, From, Shadows};
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::Range;

/// Most corners of a source.
const MOST_CORNERS: usize = 6;
/// Most half-spaces of all shadows together.
const MOST_CUTS: usize = 16;
/// Most shadows: more of them are cut out one after the other by [`crate::visible_part`].
const MOST_SHADOWS: usize = 4;
/// A height this small, in units of the distances, is zero: chords on one line.
const COINCIDENT: f64 = 1e-13;

/// What the points see.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Form factor of what each point sees.
    pub factors: Lane,
    /// How the border of what is seen is put together, where that is the same for all the points: between points of one
    /// kind the factor is one analytic function.
    pub kind: Option<u64>,
}

/// A half-space normal . r + offset >= 0 per lane, with its chord on the source.
#[derive(Debug, Clone, Copy)]
struct Cut {
    normal: Vectors,
    offset: Lane,
    heights: [Lane; MOST_CORNERS],
    /// The least of them, at most 0, and the largest, at least 0.
    low: Lane,
    high: Lane,
    exit: Vectors,
    entry: Vectors,
    /// Shadow it belongs to, and its number among the borders of all shadows.
    shadow: usize,
    border: usize,
}

/// Working memory of [`visible_factors`].
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    cuts: Vec<Cut>,
    borders: Vec<Border>,
}

/// What points with unit `normal` see of a source above their horizon past the shadows `which`; `None` where the shadows are
/// too many or change their kind within the receiver: then each point has to be looked at.
#[allow(unsafe_code)] // calls of code for features that have just been found
pub fn visible_factors(
    points: &[DVec3; LANES],
    normal: DVec3,
    source: &[DVec3],
    shadows: &Shadows<'_>,
    (which, from): (Range<usize>, From),
    scratch: &mut Scratch,
) -> Option<Seen> {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the feature is there.
            return unsafe { factors_avx512(points, normal, source, shadows, (which, from), scratch) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the feature is there.
            return unsafe { factors_avx2(points, normal, source, shadows, (which, from), scratch) };
        }
    }
    factors(points, normal, source, shadows, (which, from), scratch)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn factors_avx512(
    points: &[DVec3; LANES],
    normal: DVec3,
    source: &[DVec3],
    shadows: &Shadows<'_>,
    (which, from): (Range<usize>, From),
    scratch: &mut Scratch,
) -> Option<Seen> {
    factors(points, normal, source, shadows, (which, from), scratch)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn factors_avx2(
    points: &[DVec3; LANES],
    normal: DVec3,
    source: &[DVec3],
    shadows: &Shadows<'_>,
    (which, from): (Range<usize>, From),
    scratch: &mut Scratch,
) -> Option<Seen> {
    factors(points, normal, source, shadows, (which, from), scratch)
}

#[inline(always)]
fn factors(
    points: &[DVec3; LANES],
    normal: DVec3,
    source: &[DVec3],
    shadows: &Shadows<'_>,
    (which, from): (Range<usize>, From),
    scratch: &mut Scratch,
) -> Option<Seen> {
    if source.len() > MOST_CORNERS || which.len() > MOST_SHADOWS {
        return None;
    }
    let mut corners = [Vectors::ZERO; MOST_CORNERS];
    for (corner, &place) in corners.iter_mut().zip(source) {
        *corner = Vectors::seen_from(place, points);
    }
    let corners = &corners[..source.len()];
    let Scratch { cuts, borders } = scratch;
    cuts.clear();
    let (mut shadow_count, mut border_count) = (0, 0);
    for at in which {
        let first = cuts.len();
        let mut hides_nothing = false;
        if !shadows.borders(at, from, borders) {
            return None;
        }
        for (k, &border) in borders.iter().enumerate() {
            let mut cut = Cut::new(border, points, shadow_count, border_count + k);
            match cut.find_heights(corners) {
                // It cuts nothing off for any of the points, or all for all of them.
                Side::Inside => {}
                Side::Across => cuts.push(cut),
                Side::Outside => {
                    hides_nothing = true;
                    break;
                }
            }
        }
        border_count += borders.len();
        if cuts.len() > MOST_CUTS {
            return None;
        }
        if hides_nothing {
            cuts.truncate(first);
        } else if cuts.len() == first {
            return Some(Seen { factors: [0.0; LANES], kind: Some(0) });
        } else {
            shadow_count += 1;
        }
    }

    let mut sum = Sum::default();
    let mut edges = [[Interval::WHOLE; MOST_SHADOWS]; MOST_CORNERS];
    for cut in cuts.iter_mut() {
        cut.cross(corners, &mut edges);
    }
    for (a, hidden) in edges[..corners.len()].iter_mut().enumerate() {
        let b = if a + 1 < corners.len() { a + 1 } else { 0 };
        let line = LineTerm::new(&corners[a], &corners[b], normal);
        sum.add_visible(&line, a, &Interval::WHOLE, &mut hidden[..shadow_count]);
    }
    for p in 0..cuts.len() {
        let mut hidden = [Interval::WHOLE; MOST_SHADOWS];
        let squares = (cuts[p].exit.dot(&cuts[p].exit), cuts[p].entry.dot(&cuts[p].entry));
        let chord = cuts[p].entry.minus(&cuts[p].exit);
        for q in (0..cuts.len()).filter(|&q| q != p) {
            let (ha, hb) = heights_on(&cuts[p], &chord, &squares, &cuts[q], q < p);
            hidden[cuts[q].shadow].cut(&ha, &hb);
        }
        // The other half-spaces of its own shadow say how far a chord reaches, not what hides it.
        let mut own = std::mem::replace(&mut hidden[cuts[p].shadow], Interval::NOTHING);
        let crosses = |k: usize| cuts[p].low[k] < 0.0 && cuts[p].high[k] > 0.0;
        own.start = lanes(|k| if crosses(k) { own.start[k] } else { 2.0 });
        // From exit to entry a chord has its shadow on the left: what is seen is on the other side.
        let line = LineTerm::new(&cuts[p].exit, &cuts[p].entry, -normal);
        sum.add_visible(&line, MOST_CORNERS + cuts[p].border, &own, &mut hidden[..shadow_count]);
    }
    Some(Seen { factors: lanes(|k| (-sum.total[k] / TAU).max(0.0)), kind: (!sum.mixed).then_some(sum.kind) })
}

impl Cut {
    #[inline(always)]
    fn height(&self, at: &Vectors) -> Lane {
        let along = self.normal.dot(at);
        lanes(|k| along[k] + self.offset[k])
    }

    #[inline(always)]
    fn new(limit: Border, points: &[DVec3; LANES], shadow: usize, border: usize) -> Cut {
        let (normal, offset) = match limit {
            Border::Edge { from, to, inward } => {
                let across = Vectors::seen_from(from, points).cross(&Vectors::seen_from(to, points));
                let turned = Vectors {
                    x: lanes(|k| inward * across.x[k]),
                    y: lanes(|k| inward * across.y[k]),
                    z: lanes(|k| inward * across.z[k]),
                };
                (turned, [0.0; LANES])
            }
            Border::Front(face) => (Vectors::same(-face.normal), lanes(|k| -face.distance(points[k]))),
        };
        let (exit, entry) = (Vectors::ZERO, Vectors::ZERO);
        let heights = [[0.0; LANES]; MOST_CORNERS];
        Cut { normal, offset, heights, low: [0.0; LANES], high: [0.0; LANES], exit, entry, shadow, border }
    }

    /// Finds the heights of the corners.
    #[inline(always)]
    fn find_heights(&mut self, corners: &[Vectors]) -> Side {
        let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
        for (height, corner) in self.heights.iter_mut().zip(corners) {
            let along = self.normal.dot(corner);
            *height = lanes(|k| along[k] + self.offset[k]);
            low = lanes(|k| if height[k] < low[k] { height[k] } else { low[k] });
            high = lanes(|k| if height[k] > high[k] { height[k] } else { high[k] });
        }
        (self.low, self.high) = (low, high);
        if all(|k| low[k] == 0.0) {
            Side::Inside
        } else if all(|k| high[k] == 0.0) {
            Side::Outside
        } else {
            Side::Across
        }
    }

    /// Cuts its shadow's intervals of the source's edges, and finds where the source's border leaves the half-space and
    /// comes back.
    #[inline(always)]
    fn cross(&mut self, corners: &[Vectors], edges: &mut [[Interval; MOST_SHADOWS]; MOST_CORNERS]) {
        (self.exit, self.entry) = (corners[0], corners[0]);
        for a in 0..corners.len() {
            let b = if a + 1 < corners.len() { a + 1 } else { 0 };
            let (ha, hb) = (self.heights[a], self.heights[b]);
            let interval = &mut edges[a][self.shadow];
            if all(|k| ha[k] >= 0.0 && hb[k] >= 0.0) {
                continue;
            }
            if all(|k| ha[k] < 0.0 && hb[k] < 0.0) {
                *interval = Interval::NOTHING;
                continue;
            }
            let t = interval.cut(&ha, &hb);
            let crossing = corners[a].plus(&t, &corners[b].minus(&corners[a]));
            self.exit.replace(&crossing, |k| ha[k] >= 0.0 && hb[k] < 0.0);
            self.entry.replace(&crossing, |k| ha[k] < 0.0 && hb[k] >= 0.0);
        }
    }
}

/// Where the source lies for all lanes.
enum Side {
    Inside,
    Outside,
    Across,
}

/// Heights of a chord's ends over another half-space, zero where the chord lies on its border. Of two chords on one line that
/// run the same way one counts: in one shadow the later one is outside the other's half-space; of different shadows the
/// later one is hidden and the earlier one is not.
#[inline(always)]
fn heights_on(
    cut: &Cut,
    chord: &Vectors,
    squares: &(Lane, Lane),
    other: &Cut,
    is_later: bool,
) -> (Lane, Lane) {
    let (ha, hb) = (other.height(&cut.exit), other.height(&cut.entry));
    let sizes = other.normal.dot(&other.normal);
    let least = lanes(|k| COINCIDENT * COINCIDENT * sizes[k]);
    let on_a = |k: usize| ha[k] * ha[k] <= least[k] * squares.0[k];
    let on_b = |k: usize| hb[k] * hb[k] <= least[k] * squares.1[k];
    if !(0..LANES).any(|k| on_a(k) || on_b(k)) {
        return (ha, hb);
    }
    let same_way = chord.dot(&other.entry.minus(&other.exit));
    let is_same_shadow = cut.shadow == other.shadow;
    let outside = |k: usize| on_a(k) && on_b(k) && is_later == is_same_shadow && same_way[k] > 0.0;
    let on_border = |k: usize, height: f64, on: bool| match (outside(k), on) {
        (true, _) => -1.0,
        (false, true) => 0.0,
        (false, false) => height,
    };
    (lanes(|k| on_border(k, ha[k], on_a(k))), lanes(|k| on_border(k, hb[k], on_b(k))))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::body::{Body, bodies};
    use crate::occluder::Occluder;
    use crate::shadow::{Blocking, Set};
    use crate::visible_part::{self, visible_factor};

    /// Numbers between -1 and 1 from a small generator with a fixed start.
    fn noise(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn square(centre: DVec3, half: f64, down: bool) -> Vec<DVec3> {
        let mut corners: Vec<DVec3> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| centre + half * DVec3::new(x, y, 0.0))
            .to_vec();
        if down {
            corners.reverse();
        }
        corners
    }

    /// A cuboid, turned about the vertical where `turn` is not zero.
    fn block(centre: DVec3, half: DVec3, turn: f64) -> Vec<Occluder> {
        let (sine, cosine) = turn.sin_cos();
        let at = |k: usize| {
            let pick = |bit: usize| if k >> bit & 1 == 0 { -half[bit] } else { half[bit] };
            centre + DVec3::new(cosine * pick(0) - sine * pick(1), sine * pick(0) + cosine * pick(1), pick(2))
        };
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(|face| Occluder::new(face.map(at).to_vec()).unwrap())
            .to_vec()
    }

    /// Blocks and plates, some of them with edges on one line as seen from many points (aligned and touching ones).
    #[test]
    fn points_see_together_what_each_of_them_sees() {
        let state = &mut 3;
        let (mut compared, mut shadowed) = (0, 0);
        for round in 0..9000 {
            let source = square(DVec3::new(0.0, 0.0, 2.0), 0.5, true);
            let receiver = square(DVec3::new(0.3 * noise(state), 0.3 * noise(state), 0.0), 0.1, false);
            let mut occluders = Vec::new();
            for _ in 0..1 + round % 3 {
                let mut centre = DVec3::new(0.5 * noise(state), 0.5 * noise(state), 1.0 + 0.5 * noise(state));
                let turn = if round % 2 == 0 { 0.0 } else { noise(state) };
                if round % 5 == 0 {
                    // A coarse grid: edges of different blocks coincide.
                    centre = (centre * 4.0).round() / 4.0;
                }
                occluders.extend(block(centre, DVec3::new(0.125, 0.125, 0.125), turn));
            }
            let all: Vec<Body> = bodies(&occluders);
            let mut shadows = Shadows::default();
            let set = |corners| Set { corners, radius: 0.7, normal: None };
            let everything = all
                .iter()
                .any(|body| shadows.add(body, set(&receiver), set(&source)) == Blocking::Everything);
            if everything {
                continue;
            }
            let points = [0.05, 0.1, 0.3, 0.4, 0.6, 0.75, 0.9, 0.95]
                .map(|t| receiver[0].lerp(receiver[1 + round % 3], t));
            let which = (0..shadows.len(), From::First);
            let together =
                visible_factors(&points, DVec3::Z, &source, &shadows, which.clone(), &mut Scratch::default());
            let Some(together) = together else { continue };
            compared += 1;
            for (point, got) in points.iter().zip(together.factors) {
                let (which, from) = which.clone();
                let scratch = &mut visible_part::Pieces::default();
                let want = visible_factor(*point, DVec3::Z, &source, &shadows, which, from, scratch);
                assert!((got - want).abs() < 1e-14, "round {round}: {got} {want}");
                shadowed += usize::from(!shadows.is_empty() && want > 0.0);
            }
        }
        assert!(compared > 1000 && shadowed > 1000, "{compared} {shadowed}");
    }
}
