//! The hemicube (Cohen & Greenberg 85): what a point sees, by item buffers on the five faces of half a cube around it.
//!
//! On a cube of half-width 1 a cell of size dA at (x, y) of the top has the delta factor dA / (pi (x^2 + y^2 + 1)^2), one
//! at height z of a side z dA / (pi (y^2 + z^2 + 1)^2), both taken at the cell's centre. Polygons are cut at the
//! horizon and at each face's pyramid and scan-converted; a depth buffer keeps the nearest. The form factor of a polygon
//! is the sum of the delta factors of the cells it is left with.
//!
//! # Precision
//! The deltas add up to 1 + 0.54 / n^2 for resolution n, and no single one is more than 1.4 / n^2 of itself too large.
//! A polygon that covers N cells has a relative error of about N^(-3/4) / 2 (rms, random direction); one smaller
//! than a cell is often missed. An eye closer to a polygon's plane than `PLANARITY` of its size does not see it.

use crate::plane::{PLANARITY, Plane};
use crate::polygon;
use glam::DVec3;
use std::f64::consts::PI;

/// Marks a cell whose nearest polygon is a blocker, seen from its black side.
const BLOCKED: u32 = u32::MAX - 1;
/// Marks a cell that nothing covers.
const EMPTY: u32 = u32::MAX;
/// An item this little (relative to the depth) behind a blocker lies on it: the two sides of one face are drawn apart.
const SAME_DEPTH: f64 = PLANARITY;

/// Cells of one face: the centres along both directions and the delta factors, row after row.
#[derive(Debug, Clone)]
struct Cells {
    /// Heights of the rows' centres.
    rows: Vec<f64>,
    /// Delta factors.
    deltas: Vec<f64>,
}

/// The cells of a half cube and their delta factors.
#[derive(Debug, Clone)]
pub struct Hemicube {
    resolution: usize,
    /// Places of the columns' centres, the same on all faces.
    columns: Vec<f64>,
    top: Cells,
    side: Cells,
}

/// A polygon for the item buffers.
#[derive(Debug, Clone, Copy)]
pub struct Item<'a> {
    /// Number it is counted under; none for what only blocks.
    pub number: Option<u32>,
    /// Corners.
    pub corners: &'a [DVec3],
    /// Plane.
    pub plane: &'a Plane,
    /// Size that tells what height over its plane is none.
    pub radius: f64,
}

/// A polygon in the eye's frame, cut at the horizon.
#[derive(Debug)]
struct Placed {
    number: u32,
    corners: Vec<DVec3>,
    normal: DVec3,
    /// Distance of its plane from the eye along `normal`.
    offset: f64,
}

impl Hemicube {
    /// A hemicube with `resolution` cells along each edge of the top (at least 1); the sides have half as many rows. With an
    /// odd number the horizon halves the lowest row.
    pub fn new(resolution: usize) -> Self {
        let n = resolution.max(1);
        let width = 2.0 / n as f64;
        let columns: Vec<f64> = (0..n).map(|c| (2 * c + 1) as f64 / n as f64 - 1.0).collect();
        // Heights and half heights of the side's rows: those of the top's upper half, the middle one cut at 0.
        let side_rows: Vec<(f64, f64)> = columns
            .iter()
            .filter(|&&centre| centre + 0.25 * width > 0.0)
            .map(|&centre| if centre > 0.25 * width { (centre, width) } else { (0.25 * width, 0.5 * width) })
            .collect();
        let top = columns.iter().flat_map(|&y| {
            columns.iter().map(move |&x| width * width / (PI * (x * x + y * y + 1.0).powi(2)))
        });
        let side = side_rows.iter().flat_map(|&(z, height)| {
            columns.iter().map(move |&y| z * width * height / (PI * (y * y + z * z + 1.0).powi(2)))
        });
        let top = Cells { deltas: top.collect(), rows: columns.clone() };
        let side = Cells { deltas: side.collect(), rows: side_rows.iter().map(|row| row.0).collect() };
        Self { resolution: n, columns, top, side }
    }

    /// Cells along an edge of the top.
    pub fn resolution(&self) -> usize {
        self.resolution
    }

    /// Sum of the delta factors of the top, and of all faces.
    pub fn sums(&self) -> (f64, f64) {
        let (top, side): (f64, f64) = (self.top.deltas.iter().sum(), self.side.deltas.iter().sum());
        (top, top + 4.0 * side)
    }

    /// Calls `visit(number, F)` for every item that an eye on a plane with unit `normal` sees, in the order of their
    /// numbers below `count`. The cube is turned by `turn` radians about the normal. Items are seen from the front and block from
    /// both sides; items without a number block only where their back is seen (the front is theirs who have numbers) and must
    /// come first.
    pub fn see<'a>(
        &self,
        eye: DVec3,
        normal: DVec3,
        turn: f64,
        count: usize,
        items: impl Iterator<Item = Item<'a>>,
        mut visit: impl FnMut(usize, f64),
    ) {
        let (a, b) = normal.any_orthonormal_pair();
        let (sine, cosine) = turn.sin_cos();
        let frame = [cosine * a + sine * b, cosine * b - sine * a, normal];
        let placed: Vec<Placed> = items.filter_map(|item| place(&item, eye, &frame)).collect();

        let mut factors = vec![0.0; count];
        let mut buffer = Buffer::new(self.resolution);
        // The coordinates that serve as across, up and depth, and the sign of the depth.
        for (axes, sign) in
            [([0, 1, 2], 1.0), ([1, 2, 0], 1.0), ([1, 2, 0], -1.0), ([0, 2, 1], 1.0), ([0, 2, 1], -1.0)]
        {
            let cells = if axes[2] == 2 { &self.top } else { &self.side };
            let turned = |p: DVec3| DVec3::new(p[axes[0]], p[axes[1]], sign * p[axes[2]]);
            buffer.clear(cells.rows.len());
            for polygon in &placed {
                buffer.draw(polygon, turned, &self.columns, &cells.rows);
            }
            for (&number, &delta) in buffer.numbers.iter().zip(&cells.deltas) {
                if number < BLOCKED {
                    factors[number as usize] += delta;
                }
            }
        }
        for (number, &factor) in factors.iter().enumerate().filter(|(_, factor)| **factor > 0.0) {
            visit(number, factor);
        }
    }
}

/// Brings a polygon into the eye's frame and cuts it at the horizon; `None` where it is not to be drawn.
fn place(item: &Item<'_>, eye: DVec3, frame: &[DVec3; 3]) -> Option<Placed> {
    let height = item.plane.distance(eye);
    let rounding = PLANARITY * item.radius;
    let drawn = match item.number {
        // The back of an item is drawn by the blocker of its face.
        Some(_) => height > rounding,
        None => height < -rounding,
    };
    let over_horizon = |c: &DVec3| frame[2].dot(*c - eye) > rounding;
    if !drawn || !item.corners.iter().any(over_horizon) {
        return None;
    }
    let local = |v: DVec3| DVec3::new(frame[0].dot(v), frame[1].dot(v), frame[2].dot(v));
    let mut corners: Vec<DVec3> = item.corners.iter().map(|&c| local(c - eye)).collect();
    if corners.iter().any(|c| c.z < 0.0) {
        let mut above = Vec::with_capacity(corners.len() + 1);
        polygon::clip_by(&corners, |c| c.z, &mut above);
        corners = above;
    }
    let number = item.number.unwrap_or(BLOCKED);
    (corners.len() > 2).then(|| Placed { number, corners, normal: local(item.plane.normal), offset: -height })
}

/// Item and depth buffer of one face, with working memory.
#[derive(Debug)]
struct Buffer {
    width: usize,
    numbers: Vec<u32>,
    /// 1 / depth of the nearest polygon; 0 where there is none.
    nearness: Vec<f64>,
    corners: Vec<DVec3>,
    clipped: Vec<DVec3>,
    /// Least and largest place on the centre line of each row.
    spans: Vec<(f64, f64)>,
}

impl Buffer {
    fn new(width: usize) -> Self {
        Self {
            width,
            numbers: Vec::new(),
            nearness: Vec::new(),
            corners: Vec::new(),
            clipped: Vec::new(),
            spans: Vec::new(),
        }
    }

    fn clear(&mut self, rows: usize) {
        self.numbers.clear();
        self.numbers.resize(rows * self.width, EMPTY);
        self.nearness.clear();
        self.nearness.resize(rows * self.width, 0.0);
    }

    fn draw(
        &mut self,
        polygon: &Placed,
        turned: impl Fn(DVec3) -> DVec3,
        columns: &[f64],
        row_centres: &[f64],
    ) {
        self.corners.clear();
        self.corners.extend(polygon.corners.iter().map(|&c| turned(c)));
        if !self.clip_to_pyramid() {
            return;
        }

        // Where the edges cross the rows' centre lines; a convex polygon crosses each line in one piece.
        let project = |p: DVec3| (p.x / p.z, p.y / p.z);
        let heights = self.corners.iter().map(|&p| p.y / p.z);
        let (low, high) =
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        let first_row = row_centres.partition_point(|&y| y < low);
        let last_row = row_centres.partition_point(|&y| y < high);
        if first_row >= last_row {
            return;
        }
        self.spans.clear();
        self.spans.resize(last_row - first_row, (f64::INFINITY, f64::NEG_INFINITY));
        for (a, b) in polygon::edges(&self.corners) {
            let ((xa, ya), (xb, yb)) = (project(a), project(b));
            let rows = row_centres.partition_point(|&y| y < ya.min(yb))
                ..row_centres.partition_point(|&y| y < ya.max(yb));
            for row in rows {
                let x = xa + (xb - xa) * ((row_centres[row] - ya) / (yb - ya));
                let span = &mut self.spans[row - first_row];
                *span = (span.0.min(x), span.1.max(x));
            }
        }

        // 1 / depth is linear over the face: normal . (x, y, 1) / offset.
        let normal = turned(polygon.normal) / polygon.offset;
        for (row, &(left, right)) in (first_row..last_row).zip(&self.spans) {
            let (start, end) = (self.column(left), self.column(right));
            let constant = normal.y * row_centres[row] + normal.z;
            if start >= end {
                continue;
            }
            let cells = row * self.width + start..row * self.width + end;
            let held = self.nearness[cells.clone()].iter_mut().zip(&mut self.numbers[cells]);
            for (&x, (held, holder)) in columns[start..end].iter().zip(held) {
                let nearness = normal.x * x + constant;
                let least = if *holder == BLOCKED && polygon.number != BLOCKED {
                    *held * (1.0 - SAME_DEPTH)
                } else {
                    *held
                };
                if nearness > least {
                    (*held, *holder) = (nearness, polygon.number);
                }
            }
        }
    }

    /// First column whose centre is at `x` or after it.
    fn column(&self, x: f64) -> usize {
        let n = self.width as f64;
        (0.5 * ((x + 1.0) * n - 1.0)).ceil().clamp(0.0, n) as usize
    }

    /// Cuts the corners at the four planes of the face's pyramid; whether anything is left. All that is left has a
    /// depth above 0: its plane does not hold the eye.
    fn clip_to_pyramid(&mut self) -> bool {
        // One bit per plane: what no corner is inside of cuts all away, what all are inside of cuts nothing.
        let (mut outside_all, mut outside_any) = (0b1111u8, 0u8);
        for &c in &self.corners {
            let codes = [c.z - c.x, c.z + c.x, c.z - c.y, c.z + c.y];
            let bits = |is_out: fn(f64) -> bool| {
                codes.iter().enumerate().fold(0, |bits, (k, &h)| bits | u8::from(is_out(h)) << k)
            };
            outside_all &= bits(|height| height <= 0.0);
            outside_any |= bits(|height| height < 0.0);
        }
        if outside_all != 0 {
            return false;
        }
        let planes: [fn(DVec3) -> f64; 4] = [|p| p.z - p.x, |p| p.z + p.x, |p| p.z - p.y, |p| p.z + p.y];
        for (k, plane) in planes.into_iter().enumerate() {
            if outside_any >> k & 1 == 1 {
                polygon::clip_by(&self.corners, plane, &mut self.clipped);
                std::mem::swap(&mut self.corners, &mut self.clipped);
            }
        }
        self.corners.len() > 2 && self.corners.iter().all(|c| c.z > 0.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::point_factor::point_factor;

    fn square(centre: DVec3, u: DVec3, v: DVec3) -> Vec<DVec3> {
        vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v]
    }

    /// Factors of numbered polygons and blockers seen from the origin, z up.
    fn seen(resolution: usize, turn: f64, items: &[Vec<DVec3>], blockers: &[Vec<DVec3>]) -> Vec<f64> {
        let planes: Vec<Plane> =
            blockers.iter().chain(items).map(|p| Plane::of_polygon(p).unwrap()).collect();
        let mut factors = vec![0.0; items.len()];
        let polygons = blockers.iter().chain(items).zip(&planes).enumerate().map(|(k, (corners, plane))| {
            let number = (k >= blockers.len()).then(|| (k - blockers.len()) as u32);
            Item { number, corners, plane, radius: polygon::diameter(corners) }
        });
        let cube = Hemicube::new(resolution);
        cube.see(DVec3::ZERO, DVec3::Z, turn, items.len(), polygons, |k, f| factors[k] = f);
        factors
    }

    /// Sums of midpoint deltas to the digits of independent computations, and exact shares of top and side in the limit.
    #[test]
    fn deltas_have_their_known_sums() {
        for (n, excess) in
            [(16, 2.12e-3), (50, 2.17e-4), (64, 1.32e-4), (100, 5.42e-5), (128, 3.31e-5), (512, 2.07e-6)]
        {
            let found = Hemicube::new(n).sums().1 - 1.0;
            let half_a_digit = 0.5 * 10f64.powf(f64::log10(excess).floor() - 2.0);
            assert!((found - excess).abs() <= half_a_digit, "n = {n}: {found:e}, want {excess:e}");
        }
        // Midpoint sums err by a series in n^-2: one step of Richardson leaves n^-4.
        let (coarse, fine) = (Hemicube::new(512), Hemicube::new(1024));
        let top = (4.0 * fine.sums().0 - coarse.sums().0) / 3.0;
        assert!((top - 0.554_126_423_980).abs() < 1e-11, "{top}");
        let sides = |cube: &Hemicube| 0.25 * (cube.sums().1 - cube.sums().0);
        let side = (4.0 * sides(&fine) - sides(&coarse)) / 3.0;
        assert!((side - 0.111_468_394_005).abs() < 1e-11, "{side}");
    }

    /// Odd numbers of cells: the horizon cuts the lowest row, and the sum still falls as n^-2.
    #[test]
    fn odd_resolutions_lose_nothing() {
        for n in [1, 3, 15, 51, 101] {
            let excess = (Hemicube::new(n).sums().1 - 1.0) * (n * n) as f64;
            let bound = if n < 4 { 1.1 } else { 0.56 };
            assert!(excess > 0.0 && excess < bound, "n = {n}: {excess}");
        }
    }

    /// A parallel unit square at gap 1, seen from below its centre: the limit that no resolution gets past, 19.8 % above the
    /// exchange of the two squares.
    #[test]
    fn parallel_squares_tend_to_the_point_value() {
        let ceiling = square(DVec3::Z, DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.5, 0.0, 0.0));
        let exact = point_factor(DVec3::ZERO, DVec3::Z, &ceiling, &mut Vec::new());
        assert!((exact - 0.239_456_470).abs() < 1e-9, "{exact}");
        for n in [64, 256, 1024] {
            // The border crosses about 2 n cells, each off by a part of its delta 4 / (pi n^2) at random.
            let border = (2.0 * n as f64).sqrt() * 4.0 / (PI * (n * n) as f64);
            for turn in [0.1, 0.3, 0.7] {
                let error = (seen(n, turn, std::slice::from_ref(&ceiling), &[])[0] - exact).abs();
                assert!(error < border, "n = {n}, turned {turn}: {error:e}, expected {border:e}");
            }
        }
        let untilted = seen(1024, 0.0, &[ceiling], &[])[0];
        assert!((untilted - exact).abs() < 2e-6, "{untilted}");
    }

    /// Closed half space: a box over the eye, its five faces cut by the horizon and crossing all faces of the cube.
    #[test]
    fn every_cell_of_a_closed_room_is_covered_once() {
        let (x, y, z) = (2.0 * DVec3::X, 1.5 * DVec3::Y, DVec3::Z);
        let room = [
            square(DVec3::Z, y, x),
            square(x, z, y),
            square(-x, y, z),
            square(y, x, z),
            square(-y, z, x),
            // Behind the eye's plane.
            square(-0.5 * DVec3::Z, x, y),
        ];
        for (n, turn) in [(50, 0.0), (50, 0.7), (51, 0.4), (100, 1.3)] {
            let factors = seen(n, turn, &room, &[]);
            let total: f64 = factors.iter().sum();
            assert!((total - Hemicube::new(n).sums().1).abs() < 1e-12, "n = {n}: {total}");
            assert_eq!(factors[5], 0.0);
            for (corners, &got) in room.iter().zip(&factors) {
                let want = point_factor(DVec3::ZERO, DVec3::Z, corners, &mut Vec::new());
                assert!(
                    (got - want).abs() < 3.0 * (n as f64).powf(-1.5),
                    "n = {n}, turned {turn}: {got} {want}"
                );
            }
        }
    }

    /// One huge polygon over all five faces is everything; a nearer small one takes its part; a blocker, given with its
    /// back to the eye, takes what it hides; a blocker's front is left to the items of its face.
    #[test]
    fn nearest_polygon_wins_and_backs_are_black() {
        let down = |half: f64, height: f64| square(height * DVec3::Z, half * DVec3::Y, half * DVec3::X);
        let up = |half: f64, height: f64| square(height * DVec3::Z, half * DVec3::X, half * DVec3::Y);
        let (huge, near) = (down(1e4, 1.0), down(0.1, 0.5));
        let cube = Hemicube::new(100).sums().1;
        let alone = seen(100, 0.4, std::slice::from_ref(&huge), &[])[0];
        assert!((alone - cube).abs() < 1e-3, "{alone}");
        let both = seen(100, 0.4, &[huge.clone(), near.clone()], &[]);
        let small = seen(100, 0.4, &[near], &[])[0];
        assert_eq!(both[1], small);
        assert!((both[0] + both[1] - alone).abs() < 1e-12);
        let hidden = seen(100, 0.4, std::slice::from_ref(&huge), &[up(0.1, 0.5)])[0];
        assert!((alone - hidden - small).abs() < 1e-12);
        assert_eq!(seen(100, 0.4, std::slice::from_ref(&huge), &[down(0.1, 0.5)])[0], alone);
        // Both sides of one face: the front wins over the blocker at its own place.
        let two_sided = seen(100, 0.4, &[huge, down(0.1, 0.5)], &[up(0.1, 0.5)]);
        assert_eq!(two_sided, both);
    }

    /// Aliasing of a square in random directions stays near the measured rms: N^(-3/4) / 2 for N cells.
    #[test]
    fn aliasing_is_as_estimated() {
        let mut random = crate::strata::Random::new(1, 1);
        for half in [0.5, 0.15, 0.05] {
            let (mut square_sum, mut runs) = (0.0, 0);
            while runs < 200 {
                let direction = crate::strata::cosine_direction((random.unit(), random.unit()));
                if direction.z < 0.6 {
                    continue;
                }
                let (u, v) = direction.any_orthonormal_pair();
                let corners = square(direction, half * v, half * u);
                let exact = point_factor(DVec3::ZERO, DVec3::Z, &corners, &mut Vec::new());
                let got = seen(50, 1.57 * random.unit(), &[corners], &[])[0];
                square_sum += (got / exact - 1.0).powi(2);
                runs += 1;
            }
            let rms = (square_sum / f64::from(runs)).sqrt();
            let cells = (half * 50.0f64).powi(2);
            let estimate = 0.5 * cells.powf(-0.75);
            assert!(
                rms < 1.5 * estimate && rms > 0.3 * estimate,
                "{half}: rms {rms:e}, estimate {estimate:e}"
            );
        }
    }
}
