//! The part of a polygon that a point sees behind any number of blocking polygons, exactly: each blocker's pyramid
//! is cut out of the polygon's visible pieces, and the pieces are summed by Lambert's formula.
//!
//! # Precision
//! Cuts are interpolations along edges; there is no epsilon. A blocker seen edge-on blocks nothing.

use crate::occluder::Occluder;
use crate::point_factor::above_horizon;
use crate::polygon;
use glam::DVec3;

/// Convex polygons in one flat array, reused from call to call.
#[derive(Debug, Clone, Default)]
struct Pieces {
    points: Vec<DVec3>,
    ends: Vec<usize>,
}

impl Pieces {
    fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
    }

    fn push(&mut self, polygon: &[DVec3]) {
        if polygon.len() >= 3 {
            self.points.extend_from_slice(polygon);
            self.ends.push(self.points.len());
        }
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.points[start..end])
    }
}

/// Working memory of [`visible_factor`].
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    pieces: Pieces,
    next: Pieces,
    rest: Vec<DVec3>,
    cut: Vec<DVec3>,
    sides: Vec<DVec3>,
}

/// What a point sees of a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visible {
    /// Form factor of the visible part.
    pub factor: f64,
    /// The blocker (its place in the list) that took the last visible piece, where nothing is left. Asked first, it
    /// often settles the next point alone.
    pub last: Option<usize>,
}

/// Form factor from a surface element at `point` with unit `normal` to the front of a convex polygon, as far as
/// the `blockers` leave it in sight. The point must lie in front of the polygon's plane.
pub fn visible_factor(
    point: DVec3,
    normal: DVec3,
    corners: &[DVec3],
    blockers: &[&Occluder],
    scratch: &mut Scratch,
) -> Visible {
    // The polygon above the horizon, seen from the point as origin.
    let Scratch { pieces, next, rest, cut, sides } = scratch;
    rest.clear();
    rest.extend(corners.iter().map(|&c| c - point));
    polygon::clip_by(rest, |r| normal.dot(r), cut);
    pieces.clear();
    pieces.push(cut);

    for (k, blocker) in blockers.iter().enumerate() {
        let height = blocker.plane.distance(point);
        let inward = -height.signum();
        let beyond = |r: DVec3| inward * (blocker.plane.normal.dot(r) + height);
        if height == 0.0 || pieces.points.iter().all(|&r| beyond(r) <= 0.0) {
            continue;
        }
        // Inward normals of the pyramid's sides; its base is the blocker's plane.
        sides.clear();
        sides.extend(polygon::edges(&blocker.corners).map(|(a, b)| inward * (a - point).cross(b - point)));

        next.clear();
        for piece in pieces.iter() {
            let untouched = sides.iter().any(|side| piece.iter().all(|&r| side.dot(r) <= 0.0))
                || piece.iter().all(|&r| beyond(r) <= 0.0);
            if untouched {
                next.push(piece);
                continue;
            }
            // What lies outside each side stays; what is left inside all of them is behind the blocker.
            rest.clear();
            rest.extend_from_slice(piece);
            for side in sides.iter() {
                if rest.iter().all(|&r| side.dot(r) >= 0.0) {
                    continue;
                }
                polygon::clip_by(rest, |r| -side.dot(r), cut);
                next.push(cut);
                polygon::clip_by(rest, |r| side.dot(r), cut);
                std::mem::swap(rest, cut);
                if rest.is_empty() {
                    break;
                }
            }
            if rest.iter().any(|&r| beyond(r) < 0.0) {
                polygon::clip_by(rest, |r| -beyond(r), cut);
                next.push(cut);
            }
        }
        std::mem::swap(pieces, next);
        if pieces.ends.is_empty() {
            return Visible { factor: 0.0, last: Some(k) };
        }
    }
    let factor = pieces.iter().map(|piece| above_horizon(DVec3::ZERO, normal, piece)).sum::<f64>().max(0.0);
    Visible { factor, last: None }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn square(half: f64, z: f64, down: bool) -> Vec<DVec3> {
        let mut corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| DVec3::new(x, y, z))
            .to_vec();
        if down {
            corners.reverse();
        }
        corners
    }

    fn seen(x: f64, y: f64, blockers: &[Occluder]) -> f64 {
        let light = square(0.5, 4.0, true);
        visible_factor(
            DVec3::new(x, y, 0.0),
            DVec3::Z,
            &light,
            &blockers.iter().collect::<Vec<_>>(),
            &mut Scratch::default(),
        )
        .factor
    }

    /// Light [-.5, .5]^2 at z = 4, occluder [-1, 1]^2 at z = 2: values to 1e-12 from an independent computation.
    #[test]
    fn aligned_squares_have_the_known_point_values() {
        for down in [false, true] {
            let blocker = [Occluder::new(square(1.0, 2.0, down)).unwrap()];
            for (x, y, want) in [
                (1.4, 0.0, 0.0),
                (1.75, 0.0, 0.003_940_506_609),
                (2.0, 0.0, 0.006_946_576_463),
                (2.4, 0.0, 0.009_851_475_759),
                (3.0, 0.0, 0.008_156_271_523),
                (2.0, 2.0, 0.006_974_755_489),
                (1.75, 2.25, 0.007_382_268_251),
            ] {
                let got = seen(x, y, &blocker);
                assert!((got - want).abs() < 6e-13, "({x}, {y}): {got} {want}");
            }
        }
    }

    #[test]
    fn overlapping_and_repeated_blockers_block_once() {
        let one = Occluder::new(square(1.0, 2.0, false)).unwrap();
        let halves = [
            [(-1.0, -1.0), (0.3, -1.0), (0.3, 1.0), (-1.0, 1.0)],
            [(-0.2, -1.0), (1.0, -1.0), (1.0, 1.0), (-0.2, 1.0)],
        ]
        .map(|c| Occluder::new(c.map(|(x, y)| DVec3::new(x, y, 2.0)).to_vec()).unwrap());
        for (x, y) in [(1.75, 0.0), (2.0, 2.0), (-1.9, 0.4), (0.0, 0.0)] {
            let want = seen(x, y, std::slice::from_ref(&one));
            assert!((seen(x, y, &[one.clone(), one.clone()]) - want).abs() < 1e-16);
            assert!((seen(x, y, &halves) - want).abs() < 1e-16);
        }
    }

    #[test]
    fn a_contact_wall_blocks_one_side_only() {
        // Wall x = 0, |y| <= 1, 0 <= z <= 1 on the floor; light [1.5, 2.5] x [-.5, .5] at z = 4.
        let wall = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)].map(|(y, z)| DVec3::new(0.0, y, z));
        let wall = Occluder::new(wall.to_vec()).unwrap();
        let light = [(1.5, 0.5), (2.5, 0.5), (2.5, -0.5), (1.5, -0.5)].map(|(x, y)| DVec3::new(x, y, 4.0));
        let seen = |x: f64, y: f64| {
            visible_factor(DVec3::new(x, y, 0.0), DVec3::Z, &light, &[&wall], &mut Scratch::default()).factor
        };
        assert!((seen(1e-12, 0.0) - 0.012_646_605_888).abs() < 1e-12);
        assert!((seen(1e-12, 0.9) - 0.011_701_807_558).abs() < 1e-12);
        assert_eq!(seen(-1e-12, 0.0), 0.0);
        assert!((seen(-0.6, 0.0) - 0.003_418_156_753).abs() < 1e-12);
        assert!((seen(-0.7, 0.0) - 0.006_137_826_648).abs() < 1e-12);
    }

    #[test]
    fn a_blocker_that_crosses_the_light_hides_only_what_is_behind_it() {
        // A vertical plate through the light's middle, from z = 2 to 5, across the whole light: from x = 1 the far half is hidden.
        let plate = [(-2.0, 2.0), (2.0, 2.0), (2.0, 5.0), (-2.0, 5.0)].map(|(y, z)| DVec3::new(0.0, y, z));
        let plate = Occluder::new(plate.to_vec()).unwrap();
        let near_half: Vec<DVec3> =
            [(0.0, 0.5), (0.5, 0.5), (0.5, -0.5), (0.0, -0.5)].map(|(x, y)| DVec3::new(x, y, 4.0)).to_vec();
        let point = DVec3::new(1.0, 0.0, 0.0);
        let want = visible_factor(point, DVec3::Z, &near_half, &[], &mut Scratch::default()).factor;
        let got =
            visible_factor(point, DVec3::Z, &square(0.5, 4.0, true), &[&plate], &mut Scratch::default())
                .factor;
        assert!((got - want).abs() < 1e-16, "{got} {want}");
    }
}
