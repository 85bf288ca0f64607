//! Closed unit boxes with 0, 2 or 8 blockers inside, all of square-ish quads that are elements as given: every row of
//! their matrices sums to 1, and every blocker's side also stands in the way.

use crate::surfaces::{Paint, Surface, write};
use std::path::{Path, PathBuf};

/// Numbers of blockers.
pub const BLOCKERS: [usize; 3] = [0, 2, 8];

/// Quads along an edge of the room, per size.
pub const SIZES: [usize; 3] = [4, 8, 16];

/// A side as its corners, counter-clockwise seen from the side light is on.
type Quad = [[f64; 3]; 4];

/// Lowest and highest corner of a box.
type Corners = ([f64; 3], [f64; 3]);

/// The sides of a box, turned inwards (a room) or outwards (a blocker).
fn sides(low: [f64; 3], high: [f64; 3], inwards: bool) -> Vec<Quad> {
    let at = |corner: [usize; 3]| std::array::from_fn(|k| if corner[k] == 0 { low[k] } else { high[k] });
    let inward = [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]],
        [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]],
        [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]],
        [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]],
        [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]],
    ];
    let turned = |side: Quad| if inwards { side } else { [side[3], side[2], side[1], side[0]] };
    inward.map(|side| turned(side.map(at))).to_vec()
}

/// A side cut into `n` by `n` quads; neighbours have bit-equal corners, as each is computed the same way.
fn cut(side: Quad, n: usize) -> Vec<Quad> {
    let between = |a: [f64; 3], b: [f64; 3], t: f64| std::array::from_fn(|k| a[k] * (1.0 - t) + b[k] * t);
    let point = |i: usize, j: usize| {
        let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
        between(between(side[0], side[1], u), between(side[3], side[2], u), v)
    };
    let quad = |i: usize, j: usize| [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| quad(i, j)).collect()
}

/// Quads of the box with so many blockers whose room has `n` quads along an edge.
pub fn quads(blockers: usize, n: usize) -> Vec<Quad> {
    let eight = |i: usize| {
        let low: [f64; 3] = std::array::from_fn(|k| 0.15 + 0.4 * ((i >> k) & 1) as f64);
        (low, low.map(|x| x + 0.2))
    };
    let (bodies, along): (Vec<Corners>, usize) = match blockers {
        0 => (Vec::new(), 1),
        2 => (vec![([0.15, 0.15, 0.1], [0.4, 0.45, 0.6]), ([0.55, 0.5, 0.2], [0.9, 0.8, 0.5])], n / 2),
        _ => ((0..8).map(eight).collect(), n / 4),
    };
    let room = sides([0.0; 3], [1.0; 3], true).into_iter().flat_map(|side| cut(side, n));
    let inside = bodies.into_iter().flat_map(|(low, high)| sides(low, high, false));
    room.chain(inside.flat_map(|side| cut(side, along.max(1)))).collect()
}

/// Writes the scene into a folder; the quad in the middle of the ceiling emits.
pub fn scene(folder: &Path, blockers: usize, n: usize) -> PathBuf {
    let lamp = n * n + (n / 2) * n + n / 2;
    let surface = |(number, quad): (usize, Quad)| {
        let paint = if number == lamp { Paint::grey(0.0, 1.0) } else { Paint::grey(0.5, 0.0) };
        Surface::new(&format!("q{number}"), quad).painted(paint)
    };
    let surfaces: Vec<Surface> = quads(blockers, n).into_iter().enumerate().map(surface).collect();
    write(folder, &surfaces)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    #[test]
    fn the_sides_enclose_the_air_between_them() {
        // Sum of (p . n) A over faces that look into the air is -3 times its volume (divergence theorem).
        for (blockers, air) in
            [(0, 1.0), (2, 1.0 - 0.25 * 0.3 * 0.5 - 0.35 * 0.3 * 0.3), (8, 1.0 - 8.0 * 0.008)]
        {
            let volume: f64 = quads(blockers, 8)
                .iter()
                .map(|q| {
                    let edge = |k: usize| std::array::from_fn(|i| q[k][i] - q[0][i]);
                    let normal = cross(edge(1), edge(3));
                    -(0..3).map(|i| q[0][i] * normal[i]).sum::<f64>() / 3.0
                })
                .sum();
            crate::assert_close("volume", volume, air, crate::Tolerance::Abs(1e-12));
        }
    }

    #[test]
    fn sizes_are_as_planned() {
        assert_eq!(quads(0, 4).len(), 96);
        assert_eq!(quads(2, 8).len(), 6 * 64 + 2 * 6 * 16);
        assert_eq!(quads(8, 16).len(), 6 * 256 + 8 * 6 * 16);
    }
}
