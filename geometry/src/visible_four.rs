//! What four points see of a polygon past a few shadows, together: the same quantity as [`crate::visible_part`], in lanes.
//!
//! The visible factor is F(S) - F(S H_1) - F(S H_2) + F(S H_1 H_2) ..., S the source and H_k what shadow k hides, a cone of
//! half-spaces. The border of S cut by half-spaces is made of the edges of S, each cut to an interval, and of one chord per
//! half-space, cut to an interval by the others: no list of corners is built, so the lanes never part.
//!
//! # Precision
//! Rounding of the terms, 1e-16 of a factor of 1. Two half-spaces whose borders coincide share one chord.

use crate::point_factor::angle_over_sine;
use crate::shadow::{Border, From, Shadows};
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::Range;

/// Points looked at together.
pub const LANES: usize = 4;
/// Most corners of a source.
const MOST_CORNERS: usize = 6;
/// Most half-spaces of all shadows together.
const MOST: usize = 8;
/// More shadows than these have too many intersections.
const MOST_SHADOWS: usize = 3;
/// A height this small, in units of the distances, is zero: chords on one line.
const COINCIDENT: f64 = 1e-13;
/// Squared tangents up to which the series of the arc tangent has full precision with all its terms, and with six.
const SERIES: f64 = 0.06;
const FEW_TERMS: f64 = 0.003;
/// Coefficients of arctan(t)/t in t^2.
const LOW_TERMS: [f64; 6] = [1.0, -1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0, -1.0 / 11.0];
const HIGH_TERMS: [f64; 6] = [1.0 / 13.0, -1.0 / 15.0, 1.0 / 17.0, -1.0 / 19.0, 1.0 / 21.0, -1.0 / 23.0];

type Lane = [f64; LANES];

#[derive(Debug, Clone, Copy)]
struct Vectors {
    x: Lane,
    y: Lane,
    z: Lane,
}

const ZERO: Vectors = Vectors { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

#[inline(always)]
fn lanes(of: impl Fn(usize) -> f64) -> Lane {
    [of(0), of(1), of(2), of(3)]
}

impl Vectors {
    #[inline(always)]
    fn dot(&self, o: &Vectors) -> Lane {
        lanes(|k| self.x[k] * o.x[k] + self.y[k] * o.y[k] + self.z[k] * o.z[k])
    }

    #[inline(always)]
    fn cross(&self, o: &Vectors) -> Vectors {
        Vectors {
            x: lanes(|k| self.y[k] * o.z[k] - self.z[k] * o.y[k]),
            y: lanes(|k| self.z[k] * o.x[k] - self.x[k] * o.z[k]),
            z: lanes(|k| self.x[k] * o.y[k] - self.y[k] * o.x[k]),
        }
    }

    /// self + t (o - self).
    #[inline(always)]
    fn toward(&self, o: &Vectors, t: &Lane) -> Vectors {
        Vectors {
            x: lanes(|k| self.x[k] + t[k] * (o.x[k] - self.x[k])),
            y: lanes(|k| self.y[k] + t[k] * (o.y[k] - self.y[k])),
            z: lanes(|k| self.z[k] + t[k] * (o.z[k] - self.z[k])),
        }
    }

    #[inline(always)]
    fn minus(&self, o: &Vectors) -> Vectors {
        Vectors {
            x: lanes(|k| self.x[k] - o.x[k]),
            y: lanes(|k| self.y[k] - o.y[k]),
            z: lanes(|k| self.z[k] - o.z[k]),
        }
    }

    #[inline(always)]
    fn seen_from(place: DVec3, points: &[DVec3; LANES]) -> Vectors {
        Vectors {
            x: lanes(|k| place.x - points[k].x),
            y: lanes(|k| place.y - points[k].y),
            z: lanes(|k| place.z - points[k].z),
        }
    }
}

/// A half-space normal . r + offset >= 0 per lane, with its heights over the source's corners and its chord there.
#[derive(Debug, Clone, Copy)]
struct Cut {
    normal: Vectors,
    offset: Lane,
    heights: [Lane; MOST_CORNERS],
    exit: Vectors,
    entry: Vectors,
}

/// Working memory of [`visible_factors`].
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    cuts: Vec<Cut>,
    borders: Vec<Border>,
}

/// Form factors of what four points with unit `normal` see of a source above their horizon past the shadows `which`; `None`
/// where the shadows are too many or change their kind within the receiver: then each point has to be looked at.
#[allow(unsafe_code)] // a call of code for a feature that has just been found
pub fn visible_factors(
    points: &[DVec3; LANES],
    normal: DVec3,
    source: &[DVec3],
    shadows: &Shadows<'_>,
    (which, from): (Range<usize>, From),
    scratch: &mut Scratch,
) -> Option<Lane> {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the feature is there.
        return unsafe { factors_avx2(points, normal, source, shadows, (which, from), scratch) };
    }
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
) -> Option<Lane> {
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
) -> Option<Lane> {
    if source.len() > MOST_CORNERS || which.len() > MOST_SHADOWS {
        return None;
    }
    let mut corners = [ZERO; MOST_CORNERS];
    for (corner, &place) in corners.iter_mut().zip(source) {
        *corner = Vectors::seen_from(place, points);
    }
    let corners = &corners[..source.len()];
    let Scratch { cuts, borders } = scratch;
    cuts.clear();
    let mut ends = [0; MOST_SHADOWS + 1];
    let mut shadow_count = 0;
    for at in which {
        let (first, mut hides_nothing) = (cuts.len(), false);
        if !shadows.borders(at, from, borders) {
            return None;
        }
        for &border in borders.iter() {
            let mut cut = Cut::new(border, points);
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
        if cuts.len() > MOST {
            return None;
        }
        if hides_nothing {
            cuts.truncate(first);
        } else if cuts.len() == first {
            return Some([0.0; LANES]);
        } else {
            shadow_count += 1;
            ends[shadow_count] = cuts.len();
        }
    }
    for cut in cuts.iter_mut() {
        cut.find_chord(corners);
    }

    // One half-space of one shadow: what lies outside it is seen.
    if let [cut] = &mut cuts[..] {
        cut.turn();
        return Some(seen(region(corners, cuts, &[0], normal)));
    }
    let mut total = region(corners, &[], &[], normal);
    for subset in 1usize..1 << shadow_count {
        let mut chosen = [0; MOST];
        let mut number = 0;
        for k in (0..shadow_count).filter(|k| subset >> k & 1 == 1) {
            for cut in ends[k]..ends[k + 1] {
                chosen[number] = cut;
                number += 1;
            }
        }
        let part = region(corners, cuts, &chosen[..number], normal);
        let sign = if subset.count_ones() % 2 == 1 { -1.0 } else { 1.0 };
        total = lanes(|k| total[k] + sign * part[k]);
    }
    Some(seen(total))
}

/// c0 + c1 u + ... + c5 u^5, in three independent halves (Estrin).
#[inline(always)]
fn polynomial(u: f64, c: &[f64; 6]) -> f64 {
    let squared = u * u;
    (c[0] + u * c[1]) + squared * ((c[2] + u * c[3]) + squared * (c[4] + u * c[5]))
}

#[inline(always)]
fn seen(total: Lane) -> Lane {
    lanes(|k| (-total[k] / TAU).max(0.0))
}

impl Cut {
    #[inline(always)]
    fn height(&self, at: &Vectors) -> Lane {
        let along = self.normal.dot(at);
        lanes(|k| along[k] + self.offset[k])
    }

    #[inline(always)]
    fn new(border: Border, points: &[DVec3; LANES]) -> Cut {
        let (normal, offset) = match border {
            Border::Edge { from, to, inward } => {
                let across = Vectors::seen_from(from, points).cross(&Vectors::seen_from(to, points));
                let turned = Vectors {
                    x: lanes(|k| inward * across.x[k]),
                    y: lanes(|k| inward * across.y[k]),
                    z: lanes(|k| inward * across.z[k]),
                };
                (turned, [0.0; LANES])
            }
            Border::Front(face) => {
                let n = -face.normal;
                let normal = Vectors { x: [n.x; LANES], y: [n.y; LANES], z: [n.z; LANES] };
                (normal, lanes(|k| -face.distance(points[k])))
            }
        };
        Cut { normal, offset, heights: [[0.0; LANES]; MOST_CORNERS], exit: ZERO, entry: ZERO }
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
        if low.iter().all(|&x| x == 0.0) {
            Side::Inside
        } else if high.iter().all(|&x| x == 0.0) {
            Side::Outside
        } else {
            Side::Across
        }
    }

    /// Finds where the border of the source leaves the half-space and comes back.
    #[inline(always)]
    fn find_chord(&mut self, corners: &[Vectors]) {
        (self.exit, self.entry) = (corners[0], corners[0]);
        for a in 0..corners.len() {
            let b = if a + 1 < corners.len() { a + 1 } else { 0 };
            let (ha, hb) = (self.heights[a], self.heights[b]);
            let t = lanes(|k| ha[k] / (ha[k] - hb[k]));
            let crossing = corners[a].toward(&corners[b], &t);
            for k in 0..LANES {
                let (leaves, returns) = (ha[k] >= 0.0 && hb[k] < 0.0, ha[k] < 0.0 && hb[k] >= 0.0);
                self.exit.x[k] = if leaves { crossing.x[k] } else { self.exit.x[k] };
                self.exit.y[k] = if leaves { crossing.y[k] } else { self.exit.y[k] };
                self.exit.z[k] = if leaves { crossing.z[k] } else { self.exit.z[k] };
                self.entry.x[k] = if returns { crossing.x[k] } else { self.entry.x[k] };
                self.entry.y[k] = if returns { crossing.y[k] } else { self.entry.y[k] };
                self.entry.z[k] = if returns { crossing.z[k] } else { self.entry.z[k] };
            }
        }
    }

    /// Makes it the other side of its border.
    #[inline(always)]
    fn turn(&mut self) {
        for height in &mut self.heights {
            *height = lanes(|k| -height[k]);
        }
        std::mem::swap(&mut self.exit, &mut self.entry);
    }
}

/// Where the source lies for all lanes.
enum Side {
    Inside,
    Outside,
    Across,
}

/// Part of a segment that lies in half-spaces: parameters from 0 to 1.
#[derive(Debug, Clone, Copy)]
struct Interval {
    start: Lane,
    end: Lane,
}

impl Interval {
    const WHOLE: Interval = Interval { start: [0.0; LANES], end: [1.0; LANES] };

    /// Cuts it by heights over a half-space at 0 and at 1.
    #[inline(always)]
    fn cut(&mut self, ha: &Lane, hb: &Lane) {
        for k in 0..LANES {
            let crossing = ha[k] / (ha[k] - hb[k]);
            let starts = if hb[k] < 0.0 { 2.0 } else { crossing };
            let ends = if ha[k] < 0.0 { -1.0 } else { crossing };
            let start = if ha[k] < 0.0 { starts } else { 0.0 };
            let end = if hb[k] < 0.0 { ends } else { 1.0 };
            self.start[k] = if start > self.start[k] { start } else { self.start[k] };
            self.end[k] = if end < self.end[k] { end } else { self.end[k] };
        }
    }

    /// Adds the term of Lambert's sum of the segment from `a` to `b`, as far as it lies in the interval.
    #[inline(always)]
    fn add_term(&self, a: &Vectors, b: &Vectors, normal: DVec3, total: &mut Lane) {
        if (0..LANES).all(|k| self.end[k] <= self.start[k]) {
            return;
        }
        let term = self.term(a, b, normal);
        *total = lanes(|k| total[k] + term[k]);
    }

    #[inline(always)]
    fn term(&self, a: &Vectors, b: &Vectors, normal: DVec3) -> Lane {
        let start = lanes(|k| if self.start[k] < 1.0 { self.start[k] } else { 1.0 });
        let end = lanes(|k| if self.end[k] > start[k] { self.end[k] } else { start[k] });
        let (p, q) = (a.toward(b, &start), a.toward(b, &end));
        let cross = p.cross(&q);
        let (squared, dot) = (cross.dot(&cross), p.dot(&q));
        let along = lanes(|k| normal.x * cross.x[k] + normal.y * cross.y[k] + normal.z * cross.z[k]);
        let small = (0..LANES).all(|k| dot[k] > 0.0 && squared[k] < SERIES * dot[k] * dot[k]);
        if !small {
            return lanes(|k| angle_over_sine(squared[k], dot[k]) * along[k]);
        }
        let inverse = lanes(|k| 1.0 / dot[k]);
        let u = lanes(|k| squared[k] * inverse[k] * inverse[k]);
        let low = lanes(|k| polynomial(u[k], &LOW_TERMS));
        if u.iter().all(|&u| u < FEW_TERMS) {
            return lanes(|k| inverse[k] * low[k] * along[k]);
        }
        let high = lanes(|k| polynomial(u[k], &HIGH_TERMS));
        let series = lanes(|k| low[k] + u[k] * u[k] * u[k] * (u[k] * u[k] * u[k]) * high[k]);
        lanes(|k| inverse[k] * series[k] * along[k])
    }
}

/// Lambert's sum over the border of the source within the `chosen` cuts.
#[inline(always)]
fn region(corners: &[Vectors], cuts: &[Cut], chosen: &[usize], normal: DVec3) -> Lane {
    let mut total = [0.0; LANES];
    for a in 0..corners.len() {
        let b = if a + 1 < corners.len() { a + 1 } else { 0 };
        let mut interval = Interval::WHOLE;
        for &p in chosen {
            interval.cut(&cuts[p].heights[a], &cuts[p].heights[b]);
        }
        interval.add_term(&corners[a], &corners[b], normal, &mut total);
    }
    for &p in chosen {
        let mut interval = Interval::WHOLE;
        for &q in chosen.iter().filter(|&&q| q != p) {
            let (ha, hb) = heights_on(&cuts[p], &cuts[q], q < p);
            interval.cut(&ha, &hb);
        }
        interval.add_term(&cuts[p].exit, &cuts[p].entry, normal, &mut total);
    }
    total
}

/// Heights of a chord's ends over another half-space, zero where the chord lies on its border; of two chords on one line
/// that run the same way, the later one is dropped.
#[inline(always)]
fn heights_on(cut: &Cut, other: &Cut, is_later: bool) -> (Lane, Lane) {
    let (ha, hb) = (other.height(&cut.exit), other.height(&cut.entry));
    let sizes = other.normal.dot(&other.normal);
    let (exit, entry) = (cut.exit.dot(&cut.exit), cut.entry.dot(&cut.entry));
    let same_way = cut.entry.minus(&cut.exit).dot(&other.entry.minus(&other.exit));
    let mut out = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        let least = COINCIDENT * COINCIDENT * sizes[k];
        let (on_a, on_b) = (ha[k] * ha[k] <= least * exit[k], hb[k] * hb[k] <= least * entry[k]);
        let dropped = on_a && on_b && is_later && same_way[k] > 0.0;
        out.0[k] = if dropped {
            -1.0
        } else if on_a {
            0.0
        } else {
            ha[k]
        };
        out.1[k] = if dropped {
            -1.0
        } else if on_b {
            0.0
        } else {
            hb[k]
        };
    }
    out
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
    fn four_points_see_what_each_of_them_sees() {
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
            let points = [0.1, 0.4, 0.6, 0.9].map(|t| receiver[0].lerp(receiver[1 + round % 3], t));
            let which = (0..shadows.len(), From::First);
            let four =
                visible_factors(&points, DVec3::Z, &source, &shadows, which.clone(), &mut Scratch::default());
            let Some(four) = four else { continue };
            compared += 1;
            for (point, got) in points.iter().zip(four) {
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
