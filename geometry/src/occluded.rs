//! Exchange factor of two patches with blockers between them: exact visible parts from receiver points, the receiver cut
//! along the shadow planes that cross it into cells over which the view changes smoothly, rules of rising order per cell.

use crate::cell::Cell;
use crate::cell_rule::{Points, Rule};
use crate::contour::Exchange;
use crate::lanes::LANES;
use crate::polygon;
use crate::shadow::{Blocking, From, Set, Shadows};
use crate::shadow_planes::{ShadowPlane, WORTHLESS_CUT, shadow_planes};
use crate::visible_part::{Pieces, visible_factor};
use crate::visible_together::{self, visible_factors};
use glam::DVec3;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Rules of rising order, from the first on.
const RULES: [Rule; 3] = [Rule::Eight, Rule::Gauss(4), Rule::Gauss(8)];
/// The error of the eight points over a cell of one kind, relative to the value: at most this many times s3 max(s2, sqrt(s3)),
/// and [`SMOOTH_MOST`] times s2 + s3 (s2, s3 the rule's variations over the value). 99 % of 2 10^5 cells of three scenes were
/// below; sums over many cells overestimate 25 to 40 times.
const SMOOTH_ERROR: f64 = 0.012;
const SMOOTH_MOST: f64 = 0.004;
/// The same where the error must hold by itself, times s2 + s3: as much as the distance from the first degree. At a border
/// that both patches touch the variations see little of the singularity.
const SMOOTH_ALONE: f64 = FIRST_DEGREE;
/// Degrees 5 and 7 are near each other: where the error must hold by itself their distance counts this many times.
const NEXT_DEGREE: f64 = 5.0;
/// Over cells within which the view changes its kind, times s2 + s3: sums overestimate 5 to 20 times.
const BENT_ERROR: f64 = 0.012;
/// The same where the error must hold by itself: 0.137 was the most seen.
const BENT_ALONE: f64 = 0.14;
/// The distance of a rule of the first degree from the eight points, times s2 + s3.
const FIRST_DEGREE: f64 = 0.3;
/// The factor by which the distance between orders is thought to fall next counts this many times in the error of the
/// higher order: the next one may be less lucky.
const DECAY_ERROR: f64 = 5.0;
/// A distance may be small by chance: it never counts less than this many times.
const LEAST_DECAY: f64 = 0.05;
/// Distances between orders that fall more slowly than this speak of a singularity at the cell's border (an edge that both
/// patches touch): halving the cell helps more.
const SLOW_DECAY: f64 = 0.1;
/// Where shadow lines cross a cell, its points may all miss what lies between them: that much of the unblocked
/// factor is never ruled out.
const UNSEEN: f64 = 0.02;
/// Running sums that fell below this part of their largest value are added up anew.
const STALE: f64 = 1e-6;
/// Up to this many shadow planes the receiver is cut along all of them at once; where there are more, along those that
/// matter.
const CUT_AT_ONCE: usize = 16;

/// What an occluded exchange factor cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Visible parts computed.
    pub evaluations: usize,
    /// Whether the evaluations ran out before the tolerance was met.
    pub exhausted: bool,
}

/// How exact an occluded factor is wanted.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Absolute error.
    pub tolerance: f64,
    /// About the factor without blockers.
    pub unblocked: f64,
    /// Whether its error must hold by itself. Among many factors of a row estimates that are too low by chance are made up
    /// for by the others.
    pub alone: bool,
    /// Whether the patches are so near each other for their size that what one point sees says little of its neighbour: the first
    /// rule is then believed only as far as the second one confirms it.
    pub doubtful: bool,
    /// Most visible parts to compute.
    pub most_evaluations: usize,
}

/// Working memory of [`exchange`].
#[derive(Debug, Default)]
pub struct Scratch {
    visible: Pieces,
    together: visible_together::Scratch,
    points: Points,
    corners: Vec<DVec3>,
    cells: BinaryHeap<Cell>,
    values: Vec<(f64, f64)>,
    planes: Vec<ShadowPlane>,
    front: Vec<DVec3>,
    back: Vec<DVec3>,
}

struct Integral<'s, 'a> {
    receiver_area: f64,
    receiver: Set<'s>,
    normal: DVec3,
    source: Set<'s>,
    shadows: &'s mut Shadows<'a>,
    from: From,
    scratch: &'s mut Scratch,
    wanted: Wanted,
    evaluations: usize,
    /// Sum of the cells' errors, sum of their squared doubts, and number of cells made.
    error: f64,
    doubt: f64,
    made: usize,
}

/// Exchange factor of `receiver` and the polygon `source`, each wholly in front of the other, behind the shadows `which`;
/// more are put on the stack and taken off again. `from` says which of the shadows' sets the receiver is.
pub fn exchange(
    receiver: Set<'_>,
    source: Set<'_>,
    shadows: &mut Shadows<'_>,
    (which, from): (Range<usize>, From),
    wanted: Wanted,
    scratch: &mut Scratch,
) -> (Exchange, Effort) {
    let corners = receiver.corners;
    let normal = receiver.normal.unwrap_or_else(|| polygon::vector_area(corners).normalize_or_zero());
    let base = shadows.len();
    scratch.corners.clear();
    scratch.corners.extend_from_slice(corners);
    scratch.cells.clear();
    let mut planes = std::mem::take(&mut scratch.planes);
    shadow_planes(corners, source.corners, shadows, which.clone(), from, &mut planes);
    let receiver_area = polygon::area(corners);
    let mut integral = Integral {
        receiver_area,
        receiver,
        normal,
        source,
        shadows,
        from,
        scratch,
        wanted,
        evaluations: 0,
        error: 0.0,
        doubt: 0.0,
        made: 0,
    };
    let whole = Cell {
        corners: 0..corners.len(),
        shadows: which,
        area: receiver_area,
        crossed: !planes.is_empty(),
        ..Cell::default()
    };
    integral.run(whole, &planes);
    let evaluations = integral.evaluations;
    shadows.truncate(base);
    scratch.planes = planes;

    // Smallest first: the sum does not depend on the order in which cells were made, and loses no digits.
    let values = &mut scratch.values;
    values.clear();
    values.extend(scratch.cells.iter().map(|c| (c.value, c.error)));
    let doubt = scratch.cells.iter().map(|c| c.doubt * c.doubt).sum::<f64>().sqrt();
    values.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (value, error) = values.iter().fold((0.0, 0.0), |(v, e), &(value, error)| (v + value, e + error));
    let error = doubt.max(error);
    (Exchange { value, error }, Effort { evaluations, exhausted: error > wanted.tolerance })
}

impl Integral<'_, '_> {
    fn run(&mut self, whole: Cell, planes: &[ShadowPlane]) {
        let demanding = self.wanted.tolerance < UNSEEN * self.wanted.unblocked;
        if demanding && planes.len() <= CUT_AT_ONCE {
            let all: Vec<usize> = (0..planes.len()).collect();
            self.cut_fully(whole, planes, &all, planes.len());
        } else {
            self.add(whole);
        }
        let mut most = (0.0f64, 0.0f64);
        loop {
            // The running sums have the rounding of their largest values in them: only fresh ones count.
            (most.0, most.1) = (self.error.max(most.0), self.doubt.max(most.1));
            if self.is_met() || self.error < STALE * most.0 || self.doubt < STALE * most.1 {
                self.error = self.scratch.cells.iter().map(|c| c.error).sum();
                self.doubt = self.scratch.cells.iter().map(|c| c.doubt * c.doubt).sum();
                most = (self.error, self.doubt);
            }
            if self.is_met() || self.evaluations >= self.wanted.most_evaluations {
                return;
            }
            let Some(cell) = self.scratch.cells.pop() else { return };
            self.error -= cell.error;
            self.doubt -= cell.doubt * cell.doubt;
            self.improve(cell, planes);
        }
    }

    /// Whether both the sum of the errors and, should none of the credits have been earned, what doubts of random sign add up
    /// to are within the tolerance.
    fn is_met(&self) -> bool {
        self.error <= self.wanted.tolerance && self.doubt <= self.wanted.tolerance * self.wanted.tolerance
    }

    /// Cuts a cell along every one of the `candidates` (places in `planes`) that crosses it and integrates over the parts. Each
    /// plane cuts once on the way to a part, so `cuts_left` ends it also where a plane through nearly collinear places is too
    /// ill defined to have cut cleanly.
    fn cut_fully(&mut self, cell: Cell, planes: &[ShadowPlane], candidates: &[usize], cuts_left: usize) {
        let mut crossing = Vec::new();
        match self.best_cut(&cell, planes, candidates, &mut crossing) {
            Some(plane) if cuts_left > 0 => {
                for part in self.split(&cell, |p| plane.height(p)).into_iter().flatten() {
                    self.cut_fully(part, planes, &crossing, cuts_left - 1);
                }
            }
            left => self.add(Cell { crossed: left.is_some(), ..cell }),
        }
    }

    fn improve(&mut self, cell: Cell, planes: &[ShadowPlane]) {
        if cell.crossed {
            let all: Vec<usize> = (0..planes.len()).collect();
            match self.best_cut(&cell, planes, &all, &mut Vec::new()) {
                Some(plane) => {
                    for part in self.split(&cell, |p| plane.height(p)).into_iter().flatten() {
                        self.add(part);
                    }
                }
                None => self.raise(Cell { crossed: false, ..cell }),
            }
        } else if cell.order + 1 < RULES.len() && !cell.is_rough {
            self.raise(cell);
        } else {
            let corners = &self.scratch.corners[cell.corners.clone()];
            let centroid = polygon::centroid(corners);
            let farthest = corners
                .iter()
                .map(|&c| c - centroid)
                .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                .unwrap_or(DVec3::X);
            for part in self.split(&cell, |p| farthest.dot(p - centroid)).into_iter().flatten() {
                self.add(part);
            }
        }
    }

    /// Applies the next higher order to a cell. The rules are of degrees 5, 7 and 15, their errors powers 6, 8 and 16 of
    /// one ratio: what the distance between orders fell by tells that ratio.
    fn raise(&mut self, mut cell: Cell) {
        cell.order += 1;
        let before = cell.value;
        self.apply(&mut cell);
        let distance = (cell.value - before).abs();
        let decay = if cell.distance > 0.0 { distance / cell.distance } else { 0.0 };
        // From degrees 1 and 5 the decay is the ratio's fourth power, the next rule's error the second power of it.
        let next = if cell.order == 1 { decay.sqrt() } else { decay };
        cell.error = distance * (DECAY_ERROR * next).clamp(LEAST_DECAY, 1.0);
        if self.wanted.alone {
            // Should the present distance be small by chance, the one before tells: powers 2 to 8, and 6 to 16.
            let size = before.max(cell.value).max(f64::MIN_POSITIVE);
            let before = (cell.distance / size).min(1.0);
            let power = if cell.order == 1 { before.powi(4) } else { before.powi(2) * before.cbrt().powi(2) };
            let near = if cell.order == 1 { NEXT_DEGREE } else { 1.0 };
            cell.doubt = (near * distance).max(power * size);
        }
        cell.is_rough |= decay > SLOW_DECAY;
        cell.distance = distance;
        self.keep(cell);
    }

    fn keep(&mut self, mut cell: Cell) {
        cell.serial = self.made;
        self.made += 1;
        self.error += cell.error;
        self.doubt += cell.doubt * cell.doubt;
        cell.urgency = cell.error.max(cell.doubt * cell.doubt / self.wanted.tolerance.max(f64::MIN_POSITIVE));
        self.scratch.cells.push(cell);
    }

    /// The two parts of a cell, with the shadows that still matter to them; fully dark parts are left out.
    fn split(&mut self, cell: &Cell, height: impl Fn(DVec3) -> f64) -> [Option<Cell>; 2] {
        let Scratch { corners, front, back, .. } = &mut *self.scratch;
        let whole = &corners[cell.corners.clone()];
        polygon::clip_by(whole, &height, front);
        polygon::clip_by(whole, |p| -height(p), back);
        let mut parts = [None, None];
        for (part, place) in [&*front, &*back].into_iter().zip(&mut parts) {
            if part.len() < 3 {
                continue;
            }
            let start = self.shadows.len();
            let dark = cell.shadows.clone().any(|at| {
                let part = Set { corners: part, ..self.receiver };
                let (first, second) = match self.from {
                    From::First => (part, self.source),
                    From::Second => (self.source, part),
                };
                self.shadows.narrow(at, first, second, Some(self.from)) == Blocking::Everything
            });
            if dark {
                self.shadows.truncate(start);
                continue;
            }
            let first = corners.len();
            corners.extend_from_slice(part);
            *place = Some(Cell {
                corners: first..corners.len(),
                shadows: start..self.shadows.len(),
                area: polygon::area(part),
                crossed: cell.crossed,
                ..Cell::default()
            });
        }
        parts
    }

    /// Integrates over a new cell and estimates the error.
    fn add(&mut self, mut cell: Cell) {
        cell.order = 0;
        let is_of_one_kind = self.apply(&mut cell);
        let varied = self.scratch.points.variation();
        let both = varied.second + varied.third;
        let alone = self.wanted.alone;
        cell.distance = FIRST_DEGREE * both;
        cell.error = if cell.crossed {
            (BENT_ALONE * both).max(UNSEEN * cell.area / self.receiver_area * self.wanted.unblocked)
        } else if is_of_one_kind && alone {
            SMOOTH_ALONE * both
        } else if is_of_one_kind {
            let size = cell.value.max(f64::MIN_POSITIVE);
            let decay = (varied.second / size).max((varied.third / size).sqrt());
            (SMOOTH_ERROR * varied.third * decay).min(SMOOTH_MOST * both)
        } else {
            // Edges of different bodies that seem to cross are in no shadow plane. Higher orders help little there, but
            // they tell where much less is to be feared.
            cell.is_rough = !alone;
            if alone { BENT_ALONE * both } else { BENT_ERROR * both }
        };
        if alone {
            cell.doubt = cell.error;
        }
        if self.wanted.doubtful {
            return self.raise(cell);
        }
        self.keep(cell);
    }

    /// The shadow plane among the `candidates` that cuts the cell most evenly; those that cut it are put into `crossing`.
    fn best_cut(
        &self,
        cell: &Cell,
        planes: &[ShadowPlane],
        candidates: &[usize],
        crossing: &mut Vec<usize>,
    ) -> Option<ShadowPlane> {
        if cell.shadows.is_empty() {
            return None;
        }
        let corners = &self.scratch.corners[cell.corners.clone()];
        let tolerance = WORTHLESS_CUT * polygon::diameter(corners);
        let mut best = None;
        let mut best_balance = 0.0;
        for &at in candidates {
            if let Some(balance) = planes[at].cut_balance(corners, tolerance) {
                crossing.push(at);
                if balance > best_balance {
                    best_balance = balance;
                    best = Some(planes[at]);
                }
            }
        }
        best
    }

    /// What the places see of the source past the shadows of a cell; `true` where all see it in one way.
    fn look(&mut self, cell: &Cell) -> bool {
        let Scratch { visible, together, points, .. } = &mut *self.scratch;
        let (source, from) = (self.source.corners, self.from);
        self.evaluations += points.places.len();
        points.seen.clear();
        let mut kind = None;
        let mut is_of_one_kind = true;
        for places in points.places.chunks(LANES) {
            let group = std::array::from_fn(|k| places[k.min(places.len() - 1)]);
            let which = cell.shadows.clone();
            match visible_factors(&group, self.normal, source, self.shadows, (which.clone(), from), together)
            {
                Some(found) => {
                    points.seen.extend_from_slice(&found.factors[..places.len()]);
                    is_of_one_kind &= found.kind.is_some() && (kind.is_none() || kind == found.kind);
                    kind = found.kind;
                }
                None => {
                    is_of_one_kind = false;
                    points.seen.extend(places.iter().map(|&place| {
                        visible_factor(place, self.normal, source, self.shadows, which.clone(), from, visible)
                    }));
                }
            }
        }
        is_of_one_kind
    }

    /// Applies the cell's rule; `true` where all its points see the source in one way.
    fn apply(&mut self, cell: &mut Cell) -> bool {
        let Scratch { points, corners, .. } = &mut *self.scratch;
        points.place(&corners[cell.corners.clone()], self.normal, RULES[cell.order]);
        let is_of_one_kind = self.look(cell);
        cell.value = self.scratch.points.sum();
        is_of_one_kind
    }
}
