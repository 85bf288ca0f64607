//! The parts of polygons that a point sees, as polygons: what an integral over a source needs that is no form factor, such
//! as that of a highlight. Each blocker's pyramid is cut out of the source, exactly.
//!
//! # Precision
//! Cuts are interpolations along edges. A blocker in the plane of the receiver or of the source, to the planarity of faces,
//! blocks nothing; nor does one seen edge-on.

use crate::occluder::Occluder;
use crate::plane::{PLANARITY, Plane};
use crate::polygon;
use glam::DVec3;

/// Convex polygons that are looked at, and what may stand in the way.
#[derive(Debug)]
pub struct VisiblePieces {
    sources: Vec<Source>,
    blockers: Vec<Occluder>,
}

#[derive(Debug)]
struct Source {
    corners: Vec<DVec3>,
    plane: Plane,
    centre: DVec3,
    radius: f64,
    /// Blockers that are not wholly behind the source's plane.
    blockers: Vec<u32>,
}

/// Working memory of [`VisiblePieces::visit`].
#[derive(Debug, Default)]
pub struct Scratch {
    pieces: Vec<Vec<DVec3>>,
    next: Vec<Vec<DVec3>>,
    spare: Vec<Vec<DVec3>>,
    heights: Vec<f64>,
    sides: Vec<(DVec3, f64)>,
}

impl VisiblePieces {
    /// Prepares convex polygons, seen from their fronts, and blockers. Polygons without area are never seen.
    pub fn new(sources: Vec<Vec<DVec3>>, blockers: Vec<Occluder>) -> VisiblePieces {
        let prepare = |corners: Vec<DVec3>| {
            let centre = polygon::mean_corner(&corners);
            let radius = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
            // Without a plane it has no front to be seen.
            let plane = Plane::of_polygon(&corners).unwrap_or(Plane { normal: DVec3::ZERO, origin: centre });
            let before = |&k: &u32| reaches_above(&blockers[k as usize], &plane, radius);
            let candidates = (0..blockers.len() as u32).filter(before).collect();
            Source { corners, plane, centre, radius, blockers: candidates }
        };
        let sources = sources.into_iter().map(prepare).collect();
        VisiblePieces { sources, blockers }
    }

    /// Calls `visit(source, corners)` with every convex piece of every source that is seen from `point` and lies above the
    /// plane with unit `normal` through it. Corners are given from the point on, in the source's order.
    pub fn visit(
        &self,
        point: DVec3,
        normal: DVec3,
        scratch: &mut Scratch,
        mut visit: impl FnMut(usize, &[DVec3]),
    ) {
        let horizon = Plane { normal, origin: point };
        for (index, source) in self.sources.iter().enumerate() {
            let above = source.corners.iter().any(|&c| horizon.distance(c) > 0.0);
            if source.plane.distance(point) <= 0.0 || !above {
                continue;
            }
            scratch.start(source, point, normal);
            for &k in &source.blockers {
                if scratch.pieces.is_empty() {
                    break;
                }
                let blocker = &self.blockers[k as usize];
                let apart =
                    miss(source.centre - point, source.radius, blocker.centre - point, blocker.radius);
                if !apart && reaches_above(blocker, &horizon, 0.0) {
                    scratch.cut_out(blocker, point);
                }
            }
            scratch.pieces.iter().filter(|piece| piece.len() >= 3).for_each(|piece| visit(index, piece));
        }
    }
}

/// Whether the blocker has a part in front of the plane, beyond what its own and the other's planarity leave open.
fn reaches_above(blocker: &Occluder, plane: &Plane, other_radius: f64) -> bool {
    blocker.corners.iter().any(|&c| plane.distance(c) > PLANARITY * (blocker.radius + other_radius))
}

/// Whether two balls are seen in different directions throughout: the angle between their middles is larger than that of
/// both radii together.
fn miss(a: DVec3, radius_a: f64, b: DVec3, radius_b: f64) -> bool {
    let (distance_a, distance_b) = (a.length(), b.length());
    let (sine_a, sine_b) = (radius_a / distance_a, radius_b / distance_b);
    if !(sine_a < 1.0 && sine_b < 1.0) {
        return false;
    }
    let cosines = ((1.0 - sine_a * sine_a) * (1.0 - sine_b * sine_b)).sqrt();
    a.dot(b) < (cosines - sine_a * sine_b) * distance_a * distance_b
}

impl Scratch {
    fn start(&mut self, source: &Source, point: DVec3, normal: DVec3) {
        self.spare.append(&mut self.pieces);
        let mut whole = self.spare.pop().unwrap_or_default();
        let from_point: Vec<DVec3> = source.corners.iter().map(|&c| c - point).collect();
        polygon::clip_by(&from_point, |r| normal.dot(r), &mut whole);
        self.pieces.push(whole);
    }

    /// Takes what lies behind the blocker out of all pieces.
    fn cut_out(&mut self, blocker: &Occluder, point: DVec3) {
        let height = blocker.plane.distance(point);
        if height == 0.0 {
            return;
        }
        // Half-spaces whose common part is hidden: within the pyramid's sides, and beyond the blocker's plane.
        let inward = -height.signum();
        self.sides.clear();
        self.sides.push((inward * blocker.plane.normal, inward * height));
        let edges = polygon::edges(&blocker.corners);
        self.sides.extend(edges.map(|(a, b)| (inward * (a - point).cross(b - point), 0.0)));
        while let Some(piece) = self.pieces.pop() {
            self.cut_piece(piece);
        }
        std::mem::swap(&mut self.pieces, &mut self.next);
    }

    fn cut_piece(&mut self, piece: Vec<DVec3>) {
        let heights = |(normal, offset): &(DVec3, f64)| {
            let (normal, offset) = (*normal, *offset);
            move |&r: &DVec3| normal.dot(r) + offset
        };
        let untouched = self.sides.iter().any(|side| piece.iter().map(heights(side)).all(|h| h <= 0.0));
        if untouched {
            return self.next.push(piece);
        }
        // What lies outside each side stays; what is left inside all of them is hidden.
        let mut rest = piece;
        for side in &self.sides {
            self.heights.clear();
            self.heights.extend(rest.iter().map(heights(side)));
            if self.heights.iter().all(|&h| h >= 0.0) {
                continue;
            }
            let (mut inside, mut outside) =
                (self.spare.pop().unwrap_or_default(), self.spare.pop().unwrap_or_default());
            inside.clear();
            outside.clear();
            polygon::cut_in_two(&rest, &self.heights, &mut inside, &mut outside);
            self.spare.push(std::mem::replace(&mut rest, inside));
            if outside.len() >= 3 {
                self.next.push(outside);
            }
            if rest.len() < 3 {
                break;
            }
        }
        self.spare.push(rest);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::point_factor::above_horizon;

    fn square(half: f64, z: f64, down: bool) -> Vec<DVec3> {
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        let mut corners = corners.map(|(x, y)| DVec3::new(x, y, z)).to_vec();
        if down {
            corners.reverse();
        }
        corners
    }

    fn factor(view: &VisiblePieces, point: DVec3, normal: DVec3) -> f64 {
        let mut sum = 0.0;
        view.visit(point, normal, &mut Scratch::default(), |_, piece| {
            sum += above_horizon(DVec3::ZERO, normal, piece);
        });
        sum
    }

    /// Light [-.5, .5]^2 at z = 4, occluder [-1, 1]^2 at z = 2: values to 1e-12 from an independent computation.
    #[test]
    fn pieces_add_up_to_the_known_factors() {
        for down in [false, true] {
            let blocker = Occluder::new(square(1.0, 2.0, down)).unwrap();
            // Twice the same blocker takes nothing twice.
            let view = VisiblePieces::new(vec![square(0.5, 4.0, true)], vec![blocker.clone(), blocker]);
            for (x, y, want) in [
                (1.4, 0.0, 0.0),
                (1.75, 0.0, 0.003_940_506_609),
                (2.0, 0.0, 0.006_946_576_463),
                (2.4, 0.0, 0.009_851_475_759),
                (3.0, 0.0, 0.008_156_271_523),
                (2.0, 2.0, 0.006_974_755_489),
                (1.75, 2.25, 0.007_382_268_251),
            ] {
                let got = factor(&view, DVec3::new(x, y, 0.0), DVec3::Z);
                assert!((got - want).abs() < 6e-13, "({x}, {y}): {got} {want}");
            }
        }
    }

    #[test]
    fn backs_horizons_and_coplanar_blockers_block_as_they_should() {
        let light = square(0.5, 4.0, true);
        let point = DVec3::new(1.0, 0.0, 0.0);
        let open = VisiblePieces::new(vec![light.clone()], Vec::new());
        let whole = factor(&open, point, DVec3::Z);
        // The floor, the ceiling around the light and a wall behind the point do not block.
        let wall = [(1.2, -9.0, 0.0), (1.2, 9.0, 0.0), (1.2, 9.0, 9.0), (1.2, -9.0, 9.0)].map(DVec3::from);
        let harmless = [square(9.0, 0.0, false), square(9.0, 4.0, true), wall.to_vec()];
        let harmless = harmless.map(|corners| Occluder::new(corners).unwrap()).to_vec();
        let view = VisiblePieces::new(vec![light.clone(), square(0.5, 4.0, false)], harmless);
        assert!((factor(&view, point, DVec3::Z) - whole).abs() < 1e-15);
        // From a vertical plane through x = 0 only the half x > 0 is above the horizon.
        let half = factor(&open, DVec3::ZERO, DVec3::X);
        let right = [(0.0, 0.5), (0.5, 0.5), (0.5, -0.5), (0.0, -0.5)].map(|(x, y)| DVec3::new(x, y, 4.0));
        assert!((half - above_horizon(DVec3::ZERO, DVec3::X, &right)).abs() < 1e-15);
        assert_eq!(factor(&open, DVec3::new(0.0, 0.0, 5.0), DVec3::NEG_Z), 0.0);
    }

    /// SplitMix64 (Steele, Lea & Flood 2014): seeded numbers in [0, 1).
    struct Random(u64);
    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }
        fn point(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    /// In clutter the pieces of every source add up to what the gatherer, which cuts in another order and culls by other
    /// tests, gives as its factor.
    #[test]
    fn pieces_agree_with_the_gatherer_in_clutter() {
        let mut random = Random(7);
        let parallelogram = |random: &mut Random, size: f64| {
            let (corner, u, v) = (random.point(), random.point() - 0.5, random.point() - 0.5);
            vec![corner, corner + size * u, corner + size * (u + v), corner + size * v]
        };
        let sources: Vec<Vec<DVec3>> = (0..12).map(|_| parallelogram(&mut random, 0.6)).collect();
        let clutter: Vec<Vec<DVec3>> = (0..40).map(|_| parallelogram(&mut random, 0.5)).collect();
        let blockers = |all: &[Vec<DVec3>]| all.iter().cloned().filter_map(Occluder::new).collect::<Vec<_>>();
        let all: Vec<Vec<DVec3>> = sources.iter().chain(&clutter).cloned().collect();
        let view = VisiblePieces::new(sources.clone(), blockers(&all));
        let gatherer = crate::gather::Gatherer::new(blockers(&all), sources.clone());
        let mut memory = (Scratch::default(), crate::gather::Scratch::default());
        let mut partly = 0;
        for _ in 0..200 {
            let (point, normal) = (random.point(), (random.point() - 0.5).normalize_or(DVec3::Z));
            let (mut got, mut want) = ([0.0; 12], [0.0; 12]);
            view.visit(point, normal, &mut memory.0, |source, piece| {
                got[source] += above_horizon(DVec3::ZERO, normal, piece);
            });
            gatherer.factors(point, normal, &mut memory.1, &mut |source, factor| want[source] = factor);
            for (source, (got, want)) in got.iter().zip(want).enumerate() {
                let whole =
                    crate::point_factor::point_factor(point, normal, &sources[source], &mut Vec::new());
                partly += usize::from(want > 1e-6 && want < 0.99 * whole);
                assert!((got - want).abs() < 1e-12, "{source} from {point}: {got}, want {want}");
            }
        }
        assert!(partly > 100, "{partly} partly seen sources are a test");
    }
}
