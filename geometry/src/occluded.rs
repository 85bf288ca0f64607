//! Exchange factor of two patches with blockers between them: exact visible parts from receiver points, the receiver cut
//! adaptively along the shadow planes that cross it, two rules compared for the error.

use crate::contour::Exchange;
use crate::occluder::Occluder;
use crate::patch::Patch;
use crate::polygon;
use crate::quadrature::{RADON_INNER, Strength, radon_rule, triangle_rule};
use crate::shadow_planes::{ShadowPlane, shadow_planes};
use crate::visible::{Scratch, visible_factor};
use glam::DVec3;
use std::collections::BinaryHeap;

/// Points a side of the strong rule (degree 6) that a cell without shadow planes is compared with.
const STRONG_POINTS: usize = 4;
/// Share of the distance between the rules that counts as the error of the better one. With the whole distance the
/// estimate of the worst row was 14 to 32 times the true error (a room with two boxes, 576 squares, tolerances 1e-3 to
/// 1e-5). Much tighter or looser tolerances are not covered by that: a feature that all points miss is in no distance.
const WEAK_ERROR: f64 = 0.25;
/// Corners are looked at from this part of the way to the centroid inside: on a contact line the corner itself has no
/// view of its own.
const CORNER_INSET: f64 = 1e-3;
/// A shadow plane that leaves less than this part of the cell's size on one side is not worth a cut.
const WORTHLESS_CUT: f64 = 1e-9;

/// What an occluded exchange factor cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Visible parts computed.
    pub evaluations: usize,
    /// Whether the evaluations ran out before the tolerance was met.
    pub exhausted: bool,
}

/// A convex part of the receiver with its integral.
#[derive(Debug)]
struct Cell {
    corners: Vec<DVec3>,
    value: f64,
    error: f64,
    /// Whether the strong rule has been applied.
    strong: bool,
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
        self.error.total_cmp(&other.error).then(other.serial.cmp(&self.serial))
    }
}

/// The integrand: what one receiver point sees of the source.
struct View<'a> {
    normal: DVec3,
    source: &'a [DVec3],
    blockers: Vec<&'a Occluder>,
    scratch: &'a mut Scratch,
    evaluations: usize,
    points: Vec<DVec3>,
    weights: Vec<f64>,
}

impl View<'_> {
    fn at(&mut self, point: DVec3) -> f64 {
        self.evaluations += 1;
        let seen = visible_factor(point, self.normal, self.source, &self.blockers, self.scratch);
        if let Some(last) = seen.last {
            self.blockers[..=last].rotate_right(1);
        }
        seen.factor
    }

    /// Integral over a convex cell by Radon's rule, and the larger of its distances from two rules of degree 2: one on
    /// four of its points, one on the corners and the centroid. The corners catch light or shadow that only reaches
    /// into a cell's tip, where all seven points would agree on a wrong value.
    fn weak(&mut self, cell: &[DVec3]) -> (f64, f64) {
        let (mut value, mut error) = (0.0, 0.0);
        for k in 2..cell.len() {
            let triangle = [cell[0], cell[k - 1], cell[k]];
            self.points.clear();
            self.weights.clear();
            radon_rule(triangle, &mut self.points, &mut self.weights);
            let area = polygon::area(&triangle);
            let centroid = self.points[0];
            let (mut fine, mut inner, mut outer) = (0.0, 0.0, 0.0);
            for n in 0..self.points.len() {
                let f = self.at(self.points[n]);
                fine += self.weights[n] * f;
                inner += RADON_INNER.get(n).map_or(0.0, |w| w * area * f);
                outer += if n == 0 { 0.75 * area * f } else { 0.0 };
            }
            for corner in triangle {
                outer += area / 12.0 * self.at(corner + CORNER_INSET * (centroid - corner));
            }
            value += fine;
            error += WEAK_ERROR * (fine - inner).abs().max((fine - outer).abs());
        }
        (value, error)
    }

    /// Integral over a convex cell by the strong rule.
    fn strong(&mut self, cell: &[DVec3]) -> f64 {
        let mut value = 0.0;
        for k in 2..cell.len() {
            self.points.clear();
            self.weights.clear();
            let triangle = [cell[0], cell[k - 1], cell[k]];
            triangle_rule(triangle, Strength::Product(STRONG_POINTS), &mut self.points, &mut self.weights);
            for n in 0..self.points.len() {
                value += self.weights[n] * self.at(self.points[n]);
            }
        }
        value
    }
}

/// Exchange factor of two patches, each wholly in front of the other, behind `blockers`: integrated over `receiver`
/// until the estimated absolute error is at most `tolerance` or `most_evaluations` visible parts have been computed.
pub fn exchange(
    receiver: &Patch,
    source: &Patch,
    blockers: &[&Occluder],
    tolerance: f64,
    most_evaluations: usize,
    scratch: &mut Scratch,
) -> (Exchange, Effort) {
    let mut view = View {
        normal: receiver.plane.normal,
        source: &source.corners,
        blockers: blockers.to_vec(),
        scratch,
        evaluations: 0,
        points: Vec::new(),
        weights: Vec::new(),
    };
    let (value, error) = view.weak(&receiver.corners);
    let mut error_sum = error;
    let mut serial = 0;
    let mut queue =
        BinaryHeap::from([Cell { corners: receiver.corners.clone(), value, error, strong: false, serial }]);
    let planes = if error > tolerance { shadow_planes(&source.corners, blockers) } else { Vec::new() };
    // Summing up the queue afresh would be exact but slow: the running sum is corrected when it matters.
    while error_sum > tolerance && view.evaluations < most_evaluations {
        let Some(cell) = queue.pop() else { break };
        if cell.error == 0.0 {
            queue.push(cell);
            break;
        }
        error_sum -= cell.error;
        let cut = if cell.strong { None } else { best_cut(&planes, &cell.corners) };
        let mut add = |corners: Vec<DVec3>, value: f64, error: f64, strong: bool| {
            serial += 1;
            error_sum += error;
            queue.push(Cell { corners, value, error, strong, serial });
        };
        match cut {
            None if !cell.strong => {
                let value = view.strong(&cell.corners);
                // At rounding level a cell cannot get better.
                let error = (value - cell.value).abs();
                add(cell.corners, value, error, true);
            }
            _ => {
                let (front, back) = match cut {
                    Some(plane) => halves(&cell.corners, |p| plane.height(p)),
                    None => bisect(&cell.corners),
                };
                for part in [front, back] {
                    if part.len() >= 3 {
                        let (value, error) = view.weak(&part);
                        add(part, value, error, false);
                    }
                }
            }
        }
        if error_sum <= tolerance {
            error_sum = queue.iter().map(|c| c.error).sum();
        }
    }
    // Smallest first, so that the sum does not depend on the heap's inner order and loses no digits.
    let mut cells = queue.into_vec();
    cells.sort_by(|a, b| a.value.total_cmp(&b.value).then(a.serial.cmp(&b.serial)));
    let error: f64 = cells.iter().map(|c| c.error).sum();
    let value: f64 = cells.iter().map(|c| c.value).sum();
    let effort = Effort { evaluations: view.evaluations, exhausted: error > tolerance };
    (Exchange { value, error }, effort)
}

/// The shadow plane that cuts the cell most evenly.
fn best_cut(planes: &[ShadowPlane], cell: &[DVec3]) -> Option<ShadowPlane> {
    let tolerance = WORTHLESS_CUT * polygon::diameter(cell);
    let mut best = None;
    let mut best_balance = 0.0;
    for plane in planes {
        if let Some(balance) = plane.cut_balance(cell, tolerance)
            && balance > best_balance
        {
            best_balance = balance;
            best = Some(*plane);
        }
    }
    best
}

fn halves(cell: &[DVec3], height: impl Fn(DVec3) -> f64) -> (Vec<DVec3>, Vec<DVec3>) {
    let (mut front, mut back) = (Vec::new(), Vec::new());
    polygon::clip_by(cell, &height, &mut front);
    polygon::clip_by(cell, |p| -height(p), &mut back);
    (front, back)
}

/// Cuts a cell across its longest extent, through its centroid.
fn bisect(cell: &[DVec3]) -> (Vec<DVec3>, Vec<DVec3>) {
    let centroid = polygon::centroid(cell);
    let farthest =
        cell.iter().map(|&c| c - centroid).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let across = farthest.unwrap_or(DVec3::X);
    halves(cell, |p| across.dot(p - centroid))
}
