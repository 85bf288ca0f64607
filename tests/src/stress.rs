//! Rows of the stress table: a number that was got, the number it may not exceed, and why that one.

use crate::chain::{Chain, Stage};
use crate::programs::run;
use crate::surfaces::{Surface, write};
use std::f64::consts::PI;

/// Tolerance of the matrices here: row errors are bounded by it, so a single factor's error is, too.
pub const TOLERANCE: f64 = 1e-6;

/// A row of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// What was stressed, and how much.
    pub case: String,
    /// Error that was measured; infinite where the tools failed.
    pub error: f64,
    /// Error that is allowed.
    pub limit: f64,
    /// Where the limit comes from.
    pub reason: &'static str,
}

impl Row {
    /// A row of the table.
    pub fn new(case: impl Into<String>, error: f64, limit: f64, reason: &'static str) -> Self {
        Self { case: case.into(), error, limit, reason }
    }

    /// Whether the limit is met; a NaN does not meet it.
    pub fn met(&self) -> bool {
        self.error <= self.limit
    }
}

/// The rows as a table.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from("| case | error | allowed | because |\n|---|---|---|---|\n");
    for row in rows {
        let mark = if row.met() { "" } else { " **missed**" };
        text += &format!("| {} | {:.1e}{mark} | {:.1e} | {} |\n", row.case, row.error, row.limit, row.reason);
    }
    text
}

/// Factors between the faces of a scene, as given: `F[i][j]`; what was said where a tool refused.
pub fn factors(surfaces: &[Surface], build: &[&str], compute: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let folder = crate::folder();
    let mut chain = Chain::as_given(write(folder.path(), surfaces), folder.path());
    chain.mesh_flags = build.iter().map(|&flag| flag.to_owned()).collect();
    let tolerance = format!("{TOLERANCE:e}");
    let flags = ["--tolerance", tolerance.as_str(), "--precision", "f64", "--closure", "off"];
    chain.matrix_flags = flags.iter().chain(compute).map(|&flag| flag.to_owned()).collect();
    for stage in [Stage::Build, Stage::Compute] {
        let done = run(&mut chain.command(stage));
        if !matches!(done.code, Some(0 | 3)) {
            return Err(done.stderr);
        }
    }
    let table = chain.factors("face");
    let number = |cell: &String| cell.parse().unwrap_or(f64::NAN);
    Ok(table
        .rows
        .iter()
        .map(|row| row[row.len() - table.rows.len()..].iter().map(number).collect())
        .collect())
}

/// F between opposed `a` by `b` rectangles at distance `c` (Howell's catalogue, C-11). Its terms are of the order of
/// the sides over the distance and leave a number below one, hence a relative error of some ulp times that order
/// over the product of both: below 1e-14 for the cases here.
pub fn opposed(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (root_x, root_y) = (x.hypot(1.0), y.hypot(1.0));
    // x (root_y atan(x / root_y) - atan x) without cancellation of the pi/2 both arctangents tend to.
    let logarithm = ((root_x / x.hypot(root_y)) * root_y).ln();
    let sum = logarithm + x * root_y * (x / root_y).atan() + y * root_x * (y / root_x).atan()
        - x * x.atan()
        - y * y.atan();
    2.0 / (PI * x * y) * sum
}

/// Two rectangles `a` by `b` that face each other at distance `c`.
pub fn opposed_faces(a: f64, b: f64, c: f64) -> Vec<Surface> {
    vec![
        Surface::new("low", [[0.0, 0.0, 0.0], [a, 0.0, 0.0], [a, b, 0.0], [0.0, b, 0.0]]),
        Surface::new("high", [[0.0, 0.0, c], [0.0, b, c], [a, b, c], [a, 0.0, c]]),
    ]
}

/// Two unit squares that share the edge on the y axis, with this angle between their fronts.
pub fn wedge(angle: f64) -> Vec<Surface> {
    let (s, c) = angle.sin_cos();
    vec![
        Surface::new("floor", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]),
        Surface::new("wall", [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [c, 1.0, s], [c, 0.0, s]]),
    ]
}

/// Two rectangles of width 1 and this length that share a long edge, with this angle between their fronts.
pub fn plates(angle: f64, length: f64) -> Vec<Surface> {
    let mut plates = wedge(angle);
    plates.iter_mut().flat_map(|plate| &mut plate.corners).for_each(|corner| corner[1] *= length);
    plates
}

/// Perpendicular unit squares, the second moved by `shift` along the edge they had in common.
pub fn shifted(shift: f64) -> Vec<Surface> {
    let mut squares = wedge(std::f64::consts::FRAC_PI_2);
    squares[1].corners.iter_mut().for_each(|corner| corner[1] += shift);
    squares
}

/// F between the squares of [`shifted`]. The exchange is the double integral of an even kernel of the distance along
/// the edge, hence half the second difference of A F of perpendicular rectangles with a common edge.
pub fn shifted_exchange(shift: f64) -> f64 {
    (perpendicular(1.0 + shift) - 2.0 * perpendicular(shift) + perpendicular((1.0 - shift).abs())) / 2.0
}

/// A F between perpendicular rectangles of width 1 with a common edge of this length (Howell's catalogue, C-14).
fn perpendicular(length: f64) -> f64 {
    if length == 0.0 {
        return 0.0;
    }
    let w = 1.0 / length;
    let (square, both) = (w * w, 1.0 + 2.0 * w * w);
    let root = w * std::f64::consts::SQRT_2;
    let logarithm = 2.0 * (1.0 + square).ln() - both.ln()
        + 2.0 * square * (square * both / ((1.0 + square) * 2.0 * square)).ln();
    let sum = 2.0 * w * length.atan() - root * (1.0 / root).atan() + 0.25 * logarithm;
    length * sum / (PI * w)
}

/// The unit cube from inside, each face cut into n by n cells whose edges grow with the cube of their number.
pub fn graded_cube(n: usize) -> Vec<Surface> {
    let at = |k: usize| (k as f64 / n as f64).powi(3);
    let mut cells = Vec::new();
    for side in crate::surfaces::room([1.0; 3]) {
        let [a, b, d] = [0, 1, 3].map(|k| side.corners[k]);
        let point = |u: f64, v: f64| [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (d[k] - a[k]));
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let (u, v) = ([at(i), at(i + 1)], [at(j), at(j + 1)]);
            let corners = [point(u[0], v[0]), point(u[1], v[0]), point(u[1], v[1]), point(u[0], v[1])];
            cells.push(Surface::new("cell", corners));
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Tolerance, assert_close};

    #[test]
    fn opposed_rectangles_tend_to_one() {
        assert_close(
            "unit squares",
            opposed(1.0, 1.0, 1.0),
            crate::two_squares::FORM_FACTOR,
            Tolerance::Abs(1e-15),
        );
        // 1 - F is of the order of the gap; the rounding of the form itself is smaller still.
        assert!((1.0 - opposed(1.0, 1.0, 1e-12)).abs() < 1e-10);
    }

    #[test]
    fn shifted_squares_tend_to_those_with_a_common_edge() {
        // Hottel & Sarofim's perpendicular squares, 13 digits.
        assert_close("no shift", shifted_exchange(0.0), 0.200_043_776_075_4, Tolerance::Abs(1e-13));
        assert!(shifted_exchange(0.5) > shifted_exchange(1.0) && shifted_exchange(1.0) > 0.0);
    }
}
