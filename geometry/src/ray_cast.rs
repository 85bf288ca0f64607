//! Ray casting over convex polygons: closest hit, and whether a segment is blocked.
//!
//! A bounding volume hierarchy ([`tree`]) finds the few polygons near a ray; the test itself ([`piece`]) is watertight:
//! a ray through an edge that two polygons share by equal corners hits at least one of them. Built over the input
//! faces' convex pieces, never over the elements: what blocks light does not depend on how finely it is meshed.
//!
//! # Precision
//! No absolute epsilon. Hits are parameters along the ray with a relative error of a few roundings of the larger of
//! origin and corners. A ray that runs within the plane of a polygon does not hit it. Where a polygon's edge ends
//! within another's (a T contact), the shared line is equal only to rounding, and so is the tightness.

mod piece;
mod tree;

use glam::DVec3;
use piece::Ray;
use tree::{Extent, Tree};

/// Boxes are larger than their content by this part of the whole scene's diagonal. The polygon test moves corners by
/// a few roundings of their distance to the ray's origin; so a ray from up to 10^6 diagonals away still enters every
/// box whose content it hits. The cost is nil, and flat boxes of axis-aligned walls get a thickness.
const BOX_PADDING: f64 = 1e-9;

/// Where a ray meets a polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the polygon, as given to [`RayCaster::new`].
    pub piece: usize,
    /// Place along the ray, in lengths of its direction: the distance where that is a unit vector.
    pub distance: f64,
    /// Whether the ray meets the front, from where the corners run counter-clockwise.
    pub front: bool,
}

/// Convex polygons, ready to be asked what a ray meets. Shared between threads as it is.
///
/// ```
/// use geometry::ray_cast::RayCaster;
/// use glam::DVec3;
/// let wall = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 2.0)).to_vec();
/// let caster = RayCaster::new(&[wall]);
/// let hit = caster.closest(DVec3::new(0.5, 0.5, 0.0), DVec3::Z);
/// assert_eq!(hit.map(|hit| (hit.piece, hit.distance, hit.front)), Some((0, 2.0, false)));
/// assert!(!caster.any_between(DVec3::ZERO, DVec3::new(0.5, 0.5, 1.9), |_| false));
/// ```
#[derive(Debug, Clone, Default)]
pub struct RayCaster {
    /// Corners of all pieces, in the order of the tree's leaves.
    corners: Vec<DVec3>,
    /// Start of each piece's corners, and the end of the last.
    starts: Vec<u32>,
    /// Index each piece was given with.
    given: Vec<u32>,
    tree: Tree,
}

impl RayCaster {
    /// Takes convex polygons with finite corners. Polygons with fewer than 3 corners are never hit.
    pub fn new(pieces: &[Vec<DVec3>]) -> RayCaster {
        let whole = pieces.iter().flatten().fold(Extent::EMPTY, |extent, &corner| extent.with(corner));
        let padding = BOX_PADDING * whole.diagonal();
        let extents: Vec<Extent> = pieces
            .iter()
            .map(|piece| piece.iter().fold(Extent::EMPTY, |extent, &p| extent.with(p)).padded(padding))
            .collect();
        let (tree, given) = Tree::new(&extents);
        let mut caster = RayCaster { starts: vec![0], given, tree, ..RayCaster::default() };
        for &piece in &caster.given {
            caster.corners.extend_from_slice(&pieces[piece as usize]);
            caster.starts.push(caster.corners.len() as u32);
        }
        caster
    }

    /// First polygon that the ray from `origin` along `direction` meets beyond the origin itself; the one with the
    /// lower index where two are met at the same place.
    pub fn closest(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.closest_where(origin, direction, |_, _| true)
    }

    /// As [`RayCaster::closest`], among the polygons that `keep` accepts, given index and whether the front is met.
    pub fn closest_where(
        &self,
        origin: DVec3,
        direction: DVec3,
        keep: impl Fn(usize, bool) -> bool,
    ) -> Option<Hit> {
        let ray = Ray::new(origin, direction);
        let mut closest: Option<Hit> = None;
        self.tree.visit_along(origin, direction, f64::INFINITY, |slots, limit| {
            for slot in slots {
                let Some((distance, front)) = ray.meets(self.slot_corners(slot)) else { continue };
                let piece = self.given[slot] as usize;
                let closer = closest.is_none_or(|best| (distance, piece) < (best.distance, best.piece));
                if distance > 0.0 && closer && keep(piece, front) {
                    closest = Some(Hit { piece, distance, front });
                    *limit = distance;
                }
            }
            true
        });
        closest
    }

    /// Whether any polygon that `skip` does not exempt lies strictly between the two points. Points on a polygon: let
    /// `skip` name it, for rounding decides on which side of it they are.
    pub fn any_between(&self, from: DVec3, to: DVec3, skip: impl Fn(usize) -> bool) -> bool {
        let direction = to - from;
        let ray = Ray::new(from, direction);
        let mut blocked = false;
        self.tree.visit_along(from, direction, 1.0, |slots, _| {
            blocked = slots.into_iter().any(|slot| {
                !skip(self.given[slot] as usize)
                    && ray.meets(self.slot_corners(slot)).is_some_and(|(at, _)| at > 0.0 && at < 1.0)
            });
            !blocked
        });
        blocked
    }

    /// Calls `visit` with every polygon whose bounding box comes within `radius` of the point in each coordinate; some
    /// of them lie farther away. In no particular, but always the same order.
    pub fn near(&self, point: DVec3, radius: f64, mut visit: impl FnMut(usize)) {
        let region = Extent::EMPTY.with(point).padded(radius);
        self.tree.visit_region(&region, |slots| slots.for_each(|slot| visit(self.given[slot] as usize)));
    }

    fn slot_corners(&self, slot: usize) -> &[DVec3] {
        &self.corners[self.starts[slot] as usize..self.starts[slot + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        fn direction(&mut self) -> DVec3 {
            (2.0 * self.point() - DVec3::ONE).normalize_or(DVec3::X)
        }
    }

    /// Regular polygons of 3 to 7 corners, at random places and in random directions.
    fn scattered(count: usize, size: f64, random: &mut Random) -> Vec<Vec<DVec3>> {
        (0..count)
            .map(|i| {
                let (centre, (u, v)) = (random.point(), random.direction().any_orthonormal_pair());
                let corners = 3 + i % 5;
                (0..corners)
                    .map(|k| {
                        let (sin, cos) = (std::f64::consts::TAU * k as f64 / corners as f64).sin_cos();
                        centre + size * (cos * u + sin * v)
                    })
                    .collect()
            })
            .collect()
    }

    /// Oracle: plane equation and one cross product per edge, with none of the caster's code.
    fn naive(pieces: &[Vec<DVec3>], origin: DVec3, direction: DVec3) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for (i, corners) in pieces.iter().enumerate() {
            let normal = crate::polygon::vector_area(corners).normalize();
            let at = normal.dot(corners[0] - origin) / normal.dot(direction);
            let point = origin + at * direction;
            let inside =
                crate::polygon::edges(corners).all(|(a, b)| (b - a).cross(point - a).dot(normal) >= 0.0);
            if at > 0.0 && inside && best.is_none_or(|(_, nearest)| at < nearest) {
                best = Some((i, at));
            }
        }
        best
    }

    #[test]
    fn closest_and_any_agree_with_brute_force() {
        let mut random = Random(1);
        for (count, size) in [(1, 0.3), (7, 0.3), (60, 0.1), (2000, 0.03)] {
            let pieces = scattered(count, size, &mut random);
            let caster = RayCaster::new(&pieces);
            let mut hits = 0;
            for _ in 0..500 {
                let (origin, direction) = (random.point(), random.direction());
                let (got, want) = (caster.closest(origin, direction), naive(&pieces, origin, direction));
                assert_eq!(got.map(|hit| hit.piece), want.map(|w| w.0), "{count}: {origin} {direction}");
                if let (Some(got), Some((piece, at))) = (got, want) {
                    hits += 1;
                    // Rounding of coordinates of order 1 over the cosine of incidence, rarely below 1e-3.
                    assert!((got.distance - at).abs() < 1e-11, "{} against {at}", got.distance);
                    let normal = crate::polygon::vector_area(&pieces[piece]);
                    assert_eq!(got.front, normal.dot(direction) < 0.0);
                    let (before, beyond) = (origin + 0.999 * at * direction, origin + 1.001 * at * direction);
                    assert!(!caster.any_between(origin, before, |_| false));
                    assert!(caster.any_between(origin, beyond, |_| false));
                    let skipping = caster.any_between(origin, beyond, |i| i == piece);
                    let second = naive(&pieces[..piece], origin, direction).into_iter();
                    let second = second.chain(naive(&pieces[piece + 1..], origin, direction));
                    assert_eq!(skipping, second.map(|s| s.1).any(|s| s < 1.001 * at));
                }
            }
            assert!(count < 60 || hits > 100, "{count} polygons: only {hits} hits");
        }
    }

    /// Walls tessellated into axis-aligned quads are what degenerates trees, and rays at their corners and edges are
    /// what falls between polygons.
    #[test]
    fn grid_of_quads_is_watertight_at_corners_and_edges() {
        let n = 30;
        let mut random = Random(2);
        let frame = glam::DMat3::from_axis_angle(random.direction(), 1.0);
        for (frame, shift) in [(glam::DMat3::IDENTITY, DVec3::ZERO), (frame, DVec3::splat(123.456))] {
            let at = |i: usize, j: usize| {
                frame * DVec3::new(i as f64 / n as f64, j as f64 / n as f64, 1.0 / 3.0) + shift
            };
            let pieces: Vec<Vec<DVec3>> = (0..n * n)
                .map(|k| (k % n, k / n))
                .map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
                .collect();
            let caster = RayCaster::new(&pieces);
            for _ in 0..4000 {
                let eye = frame * (DVec3::new(0.5, 0.5, 2.0) + 0.4 * random.direction()) + shift;
                let pick = |random: &mut Random| 1 + (random.next() * (n - 1) as f64) as usize;
                let (i, j) = (pick(&mut random), pick(&mut random));
                let along = if random.next() < 0.3 { 0.0 } else { random.next() };
                let target = at(i, j).lerp(at(i + 1, j), if i + 1 < n { along } else { 0.0 });
                assert!(caster.closest(eye, target - eye).is_some(), "fell through at {target}");
                assert!(caster.any_between(eye, eye + 1.5 * (target - eye), |_| false));
            }
        }
    }

    #[test]
    fn scale_of_the_scene_does_not_matter() {
        let mut random = Random(3);
        let pieces = scattered(200, 0.1, &mut random);
        let rays: Vec<_> = (0..300).map(|_| (random.point(), random.direction())).collect();
        let caster = RayCaster::new(&pieces);
        for scale in [1e-6, 1e6, 1e-20, 1e20] {
            let scaled: Vec<Vec<DVec3>> =
                pieces.iter().map(|piece| piece.iter().map(|&p| scale * p).collect()).collect();
            let scaled = RayCaster::new(&scaled);
            for &(origin, direction) in &rays {
                let (small, large) =
                    (caster.closest(origin, direction), scaled.closest(scale * origin, direction));
                assert_eq!(small.map(|hit| hit.piece), large.map(|hit| hit.piece));
                if let (Some(small), Some(large)) = (small, large) {
                    assert!(
                        (large.distance / scale - small.distance).abs() < 1e-12 * small.distance.max(1.0)
                    );
                }
            }
        }
    }

    #[test]
    fn many_equal_polygons_and_no_polygons_are_no_trouble() {
        assert_eq!(RayCaster::new(&[]).closest(DVec3::ZERO, DVec3::X), None);
        let square: Vec<DVec3> =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let caster = RayCaster::new(&vec![square; 1000]);
        let hit = caster.closest(DVec3::new(0.5, 0.25, 1.0), -DVec3::Z);
        assert_eq!(hit, Some(Hit { piece: 0, distance: 1.0, front: true }));
        let other = caster.closest_where(DVec3::new(0.5, 0.25, 1.0), -DVec3::Z, |i, front| front && i > 41);
        assert_eq!(other.map(|hit| hit.piece), Some(42));
        let mut near = 0;
        caster.near(DVec3::new(2.0, 0.5, 0.0), 1.1, |_| near += 1);
        assert_eq!(near, 1000);
        caster.near(DVec3::new(2.0, 0.5, 0.0), 0.9, |_| near += 1);
        assert_eq!(near, 1000);
    }

    /// A ray in the plane of a wall, and one along its edge, see what stands behind the wall.
    #[test]
    fn ray_within_a_plane_passes_it() {
        let wall = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let screen = vec![
            DVec3::new(2.0, -1.0, -1.0),
            DVec3::new(2.0, -1.0, 1.0),
            DVec3::new(2.0, 2.0, 1.0),
            DVec3::new(2.0, 2.0, -1.0),
        ];
        let caster = RayCaster::new(&[wall, screen]);
        for y in [0.0, 0.5, 1.0] {
            let hit = caster.closest(DVec3::new(-1.0, y, 0.0), DVec3::X);
            assert_eq!(hit.map(|hit| (hit.piece, hit.distance)), Some((1, 3.0)), "y = {y}");
        }
    }
}
