//! Exchange factor of two patches with blockers between them: exact visible parts from receiver points, the receiver cut
//! along the shadow planes that cross it into cells over which the view changes smoothly, rules of rising order per cell.

use crate::contour::Exchange;
use crate::polygon;
use crate::quadrature::gauss;
use crate::shadow::{Blocking, From, Set, Shadows};
use crate::shadow_planes::{ShadowPlane, WORTHLESS_CUT, shadow_planes};
use crate::visible_four::{self, LANES, visible_factors};
use crate::visible_part::{Pieces, visible_factor};
use glam::DVec3;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Points a side of the rules of rising order.
const ORDERS: [usize; 3] = [2, 4, 8];
/// The factor by which the distance between orders fell counts this many times in the error of the higher order: the next
/// one may be less lucky.
const DECAY_ERROR: f64 = 5.0;
/// A distance may be small by chance: it never counts less than this many times.
const LEAST_DECAY: f64 = 0.05;
/// Distances between orders that fall more slowly than this speak of a singularity at the cell's border (an edge that both
/// patches touch): halving the cell helps more.
const SLOW_DECAY: f64 = 0.1;
/// Over a smooth cell the 2 x 2 rule errs like the square of its distance from the centre's value, relative to the value:
/// that distance is the second order term, the error the fourth. The factor covers the worst of 10^5 cells.
const SMOOTH_ERROR: f64 = 4.0;
/// Second order terms may cancel, so that the centre agrees by chance. Then the fourth power of the relative variation v of
/// the values tells: the 2 x 2 rule's error counts at least this many times v^4, and need not count more than
/// [`MOST_VARIATION_ERROR`] (both relative to the value).
const VARIATION_ERROR: f64 = 0.01;
/// Most that the variation alone counts.
const MOST_VARIATION_ERROR: f64 = 3e-5;
/// Unless that is less than this share of the distance: 0.26 of it were seen as error where the centre agreed by chance.
const CHANCE: f64 = 0.3;
/// The same where the error must hold by itself: over triangles and other cells that are not their own mirror image
/// terms of third order remain, with up to 0.07 v^3 seen where the centre agreed by chance.
const ODD_ERROR: f64 = 0.1;
/// Where shadow lines cross a cell, its points may all miss what lies between them: that much of the unblocked
/// factor is never ruled out.
const UNSEEN: f64 = 0.02;
/// Corners are looked at from this part of the way to the centre inside.
const CORNER_INSET: f64 = 1e-3;
/// Share of the distance between the 2 x 2 rule and the mean over the corners that counts as error where the corners see
/// something that the points do not: the part of the cell that it may fill.
const CORNER_ERROR: f64 = 0.1;
/// Share of the distance between the 2 x 2 rule and the centre's value that counts as error where edges of different
/// bodies may cross: the view's second derivative may jump there, of which the rule misses a part.
const KINK: f64 = 0.1;
/// A cell whose corners are this many times farther off than its centre has a bend inside: higher orders do not help there.
const BENT: f64 = 8.0;
/// Up to this many shadow planes the receiver is cut along all of them at once; where there are more, along those that
/// matter.
const CUT_AT_ONCE: usize = 8;

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
    /// Most visible parts to compute.
    pub most_evaluations: usize,
}

/// A convex part of the receiver with its integral.
#[derive(Debug, Clone, Default)]
struct Cell {
    corners: Range<usize>,
    shadows: Range<usize>,
    value: f64,
    error: f64,
    /// Where the error must hold by itself: the error without the credit that holds on average only.
    doubt: f64,
    /// Rule applied, as a place in [`ORDERS`].
    order: usize,
    /// Whether shadow planes may still cross it.
    crossed: bool,
    /// Distance of the value from the one by the order before.
    distance: f64,
    /// Whether higher orders do not help: there is a bend or a singularity inside or at the border.
    is_rough: bool,
    area: f64,
    /// Its part in what has to fall: the larger of its shares in the sums of errors and of squared doubts.
    urgency: f64,
    /// Order of creation: makes the queue's order unique.
    serial: usize,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.urgency.total_cmp(&other.urgency).then(other.serial.cmp(&self.serial))
    }
}

/// Working memory of [`exchange`].
#[derive(Debug, Default)]
pub struct Scratch {
    visible: Pieces,
    four: visible_four::Scratch,
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
    /// Least and largest value seen in the present cell.
    low: f64,
    high: f64,
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
        low: 0.0,
        high: 0.0,
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
            self.cut_fully(whole, planes, planes.len());
        } else {
            self.add(whole);
        }
        loop {
            if self.is_met() {
                // The running sums have rounding in them: only fresh ones count.
                self.error = self.scratch.cells.iter().map(|c| c.error).sum();
                self.doubt = self.scratch.cells.iter().map(|c| c.doubt * c.doubt).sum();
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

    /// Cuts a cell along every plane that crosses it and integrates over the parts. Each plane cuts once on the way to a
    /// part, so `cuts_left` ends it also where a plane through nearly collinear places is too ill defined to have cut cleanly.
    fn cut_fully(&mut self, cell: Cell, planes: &[ShadowPlane], cuts_left: usize) {
        match self.best_cut(&cell, planes) {
            Some(plane) if cuts_left > 0 => {
                for part in self.split(&cell, |p| plane.height(p)).into_iter().flatten() {
                    self.cut_fully(part, planes, cuts_left - 1);
                }
            }
            left => self.add(Cell { crossed: left.is_some(), ..cell }),
        }
    }

    fn improve(&mut self, cell: Cell, planes: &[ShadowPlane]) {
        if cell.crossed {
            match self.best_cut(&cell, planes) {
                Some(plane) => {
                    for part in self.split(&cell, |p| plane.height(p)).into_iter().flatten() {
                        self.add(part);
                    }
                }
                None => self.raise(Cell { crossed: false, ..cell }),
            }
        } else if cell.order + 1 < ORDERS.len() && !cell.is_rough {
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

    /// Applies the next higher order to a cell. Where the distance between orders falls by a factor each time, the error of
    /// the higher one is the distance times that factor.
    fn raise(&mut self, mut cell: Cell) {
        cell.order += 1;
        let value = self.integrate(&cell, ORDERS[cell.order]);
        let distance = (value - cell.value).abs();
        let decay = if cell.distance > 0.0 { distance / cell.distance } else { 0.0 };
        cell.error = distance * (DECAY_ERROR * decay).clamp(LEAST_DECAY, 1.0);
        if self.wanted.alone {
            // Each doubling of the order squares the relative error, should the present distance be small by chance.
            let size = value.max(cell.value).max(f64::MIN_POSITIVE);
            cell.doubt = distance.max((cell.distance / size).powi(4) * size);
        }
        cell.is_rough |= decay > SLOW_DECAY;
        (cell.value, cell.distance) = (value, distance);
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
        (self.low, self.high) = (f64::INFINITY, 0.0);
        let value = self.integrate(&cell, ORDERS[0]);
        let centre = polygon::centroid(&self.scratch.corners[cell.corners.clone()]);
        let middle = cell.area * self.at(centre, cell.shadows.clone());
        let distance = (value - middle).abs();
        (cell.value, cell.distance) = (value, distance);
        let size = value.max(middle).max(f64::MIN_POSITIVE);
        let variation = (self.high - self.low) * cell.area / size;
        let odd = ODD_ERROR * variation.powi(3) * size;
        cell.error = if cell.crossed {
            distance.max(UNSEEN * cell.area / self.receiver_area * self.wanted.unblocked)
        } else if cell.shadows.len() < 2 && self.wanted.alone {
            distance.max(odd)
        } else if cell.shadows.len() < 2 {
            let most = MOST_VARIATION_ERROR.max(CHANCE * distance / size);
            let varied = (VARIATION_ERROR * variation.powi(4)).min(most);
            let smooth = SMOOTH_ERROR * distance / size;
            (distance * smooth.min(1.0)).max(varied * size)
        } else {
            // Edges of different bodies that seem to cross (EEE) are in no shadow plane: what they let through or take
            // away shows first in the cell's corners.
            let outer = self.mean_near_corners(centre, &cell);
            let tip = (value - cell.area * outer).abs();
            cell.is_rough = tip > BENT * distance;
            (KINK * distance).max(if cell.is_rough { CORNER_ERROR * tip } else { 0.0 })
        };
        if self.wanted.alone {
            cell.doubt = cell.error.max(distance).max(odd);
        }
        self.keep(cell);
    }

    /// Mean of what is seen just inside the corners: on a contact line the corner itself has no view of its own.
    fn mean_near_corners(&mut self, centre: DVec3, cell: &Cell) -> f64 {
        let count = cell.corners.len();
        let inset = |corner: DVec3| corner + CORNER_INSET * (centre - corner);
        let mut sum = 0.0;
        for first in (0..count).step_by(LANES) {
            let number = (count - first).min(LANES);
            let at = |k: usize| inset(self.scratch.corners[cell.corners.start + first + k.min(number - 1)]);
            let points = [at(0), at(1), at(2), at(3)];
            sum += self.at_four(&points, cell)[..number].iter().sum::<f64>();
        }
        sum / count as f64
    }

    /// The shadow plane that cuts the cell most evenly.
    fn best_cut(&self, cell: &Cell, planes: &[ShadowPlane]) -> Option<ShadowPlane> {
        if cell.shadows.is_empty() {
            return None;
        }
        let corners = &self.scratch.corners[cell.corners.clone()];
        let tolerance = WORTHLESS_CUT * polygon::diameter(corners);
        let mut best = None;
        let mut best_balance = 0.0;
        for plane in planes {
            if let Some(balance) = plane.cut_balance(corners, tolerance)
                && balance > best_balance
            {
                best_balance = balance;
                best = Some(*plane);
            }
        }
        best
    }

    fn at(&mut self, point: DVec3, shadows: Range<usize>) -> f64 {
        self.evaluations += 1;
        let scratch = &mut self.scratch.visible;
        let (source, from) = (self.source.corners, self.from);
        let seen = visible_factor(point, self.normal, source, self.shadows, shadows, from, scratch);
        (self.low, self.high) = (self.low.min(seen), self.high.max(seen));
        seen
    }

    /// What four points of a cell see.
    fn at_four(&mut self, points: &[DVec3; LANES], cell: &Cell) -> [f64; LANES] {
        let (source, which) = (self.source.corners, (cell.shadows.clone(), self.from));
        match visible_factors(points, self.normal, source, self.shadows, which, &mut self.scratch.four) {
            None => points.map(|point| self.at(point, cell.shadows.clone())),
            Some(seen) => {
                self.evaluations += LANES;
                for value in seen {
                    (self.low, self.high) = (self.low.min(value), self.high.max(value));
                }
                seen
            }
        }
    }

    /// n x n Gauss points on each quadrilateral of a fan, squeezed into triangles.
    fn integrate(&mut self, cell: &Cell, n: usize) -> f64 {
        let rule = gauss(n);
        let count = cell.corners.len();
        let mut value = 0.0;
        let mut k = 1;
        while k + 1 < count {
            let corner = |at: usize| self.scratch.corners[cell.corners.start + at];
            let (a, b, c) = (corner(0), corner(k), corner(k + 1));
            // A triangle is a quadrilateral whose first corner is doubled.
            let d = if k + 2 < count { corner(k + 2) } else { a };
            // Orders are even: the points come in fours.
            let (mut points, mut weights, mut filled) = ([DVec3::ZERO; LANES], [0.0; LANES], 0);
            for (s, ws) in rule.points.iter().zip(&rule.weights) {
                let s = 0.5 * (1.0 + s);
                let (near, far) = (a + s * (b - a), d + s * (c - d));
                let (along_near, along_far) = (b - a, c - d);
                for (t, wt) in rule.points.iter().zip(&rule.weights) {
                    let t = 0.5 * (1.0 + t);
                    let along = along_near + t * (along_far - along_near);
                    points[filled] = near + t * (far - near);
                    weights[filled] = 0.25 * ws * wt * along.cross(far - near).dot(self.normal);
                    filled += 1;
                    if filled == LANES {
                        let seen = self.at_four(&points, cell);
                        value += (0..LANES).map(|k| weights[k] * seen[k]).sum::<f64>();
                        filled = 0;
                    }
                }
            }
            k += 2;
        }
        value
    }
}
