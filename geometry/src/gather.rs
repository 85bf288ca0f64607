//! Everything a point sees: exact point form factors to all elements of a scene, through a tree.
//!
//! A cluster beneath the point's horizon, turned away from it, or wholly behind one body gives nothing; a shadow that
//! does not touch a cluster is not asked again for its elements, nor is a border of it that the cluster lies inside of.
//! What is left is exact, element by element, unless who asks for it takes a part by its middle.

use crate::body::{Body, bodies};
use crate::element_tree::{Element, ElementTree};
use crate::occluder::Occluder;
use crate::point_factor::above_horizon;
use crate::point_shadow::{Bounds, Candidate, Cone, Meets, PointShadows};
use crate::polygon;
use crate::visible_part::{Pieces, Polygons};
use glam::DVec3;
use std::ops::Range;

/// A scene prepared for gathering.
#[derive(Debug)]
pub struct Gatherer {
    bodies: Vec<Body>,
    pub(crate) tree: ElementTree,
}

/// Working memory of [`Gatherer::factors`].
#[derive(Debug, Default)]
pub struct Scratch {
    pub(crate) shadows: PointShadows,
    /// Stack of lists of the shadows that may touch a cluster.
    pub(crate) candidates: Vec<Candidate>,
    pieces: Pieces,
    corners: Vec<DVec3>,
    cut: Vec<DVec3>,
}

/// What a walk through the tree finds.
pub(crate) trait Taker {
    /// Whether anything below a node is wanted.
    fn wants(&mut self, node: usize) -> bool;
    /// Offers a node that lies above the horizon, looks at the point and is hidden nowhere; `true` takes it as a whole.
    fn takes_node(&mut self, node: usize, to_point: Look) -> bool;
    /// Offers an element likewise.
    fn takes_element(&mut self, element: usize, to_point: Look) -> bool;
    /// An element, and what is seen of it: convex pieces above the horizon, from the point as origin.
    fn take(&mut self, element: usize, seen: &Polygons, look: Look);
    /// Whether the convex polygon that a node's elements fill serves instead of them.
    fn stands_in(&mut self, _node: usize, _look: Look) -> bool {
        false
    }
    /// Such a node, and what is seen of its polygon.
    fn take_node(&mut self, _node: usize, _seen: &Polygons, _look: Look) {}
    /// The middle of a flat node, or of an element, from the point, where all of it gives so little that its middle tells
    /// whether it is seen.
    fn faint(&mut self, _part: Part, _look: Look) -> Option<DVec3> {
        None
    }
    /// Such a part, whose middle is seen.
    fn take_faint(&mut self, _part: Part, _look: Look) {}
    /// A cluster proved to be wholly behind one body.
    fn hidden(&mut self) {}
}

/// A part of a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Part {
    Node(usize),
    Element(usize),
}

/// Where everything is looked at from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    pub(crate) point: DVec3,
    pub(crate) normal: DVec3,
    /// Whether clusters wholly behind one body are recognised as such.
    pub(crate) hidden: bool,
}

struct Every<'a>(&'a [Element], &'a mut dyn FnMut(usize, f64));

impl Taker for Every<'_> {
    fn wants(&mut self, _: usize) -> bool {
        true
    }
    fn takes_node(&mut self, _: usize, _: Look) -> bool {
        false
    }
    fn takes_element(&mut self, _: usize, _: Look) -> bool {
        false
    }
    fn take(&mut self, element: usize, seen: &Polygons, look: Look) {
        let factor: f64 = seen.iter().map(|piece| above_horizon(DVec3::ZERO, look.normal, piece)).sum();
        if factor > 0.0 {
            self.1(self.0[element].index, factor);
        }
    }
}

impl Gatherer {
    /// Prepares `occluders` and convex `elements`, one-sided, front counter-clockwise. Elements without area take no part.
    pub fn new(occluders: Vec<Occluder>, elements: Vec<Vec<DVec3>>) -> Gatherer {
        Gatherer { bodies: bodies(&occluders), tree: ElementTree::new(elements) }
    }

    /// Calls `visit(element, F)` for every element with a form factor F > 0 from `point` on a plane with unit `normal`,
    /// in an order of the gatherer's own.
    ///
    /// The face the point lies on never blocks it, nor do faces coplanar with it: none of their parts is in front. A
    /// point within rounding of an element's edge takes the limit from the side it is on.
    pub fn factors(
        &self,
        point: DVec3,
        normal: DVec3,
        scratch: &mut Scratch,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        self.walk(Look { point, normal, hidden: true }, scratch, &mut Every(&self.tree.elements, visit));
    }

    pub(crate) fn walk(&self, look: Look, scratch: &mut Scratch, taker: &mut impl Taker) {
        if self.tree.nodes.is_empty() {
            return;
        }
        scratch.shadows.look(look.point, look.normal, &self.bodies);
        scratch.candidates.clear();
        scratch.candidates.extend(scratch.shadows.all());
        let list = 0..scratch.candidates.len();
        self.visit(0, list, look, scratch, taker);
    }

    /// Visits a node; `list` is where its parent's candidates stand.
    fn visit(
        &self,
        index: usize,
        list: Range<usize>,
        look: Look,
        scratch: &mut Scratch,
        taker: &mut impl Taker,
    ) {
        let node = &self.tree.nodes[index];
        let bounds = Bounds { centre: node.middle - look.point, axes: node.axes, radius: node.radius };
        let (low, high) = bounds.along(look.normal);
        let turned_away = node.front.is_some_and(|front| front.distance(look.point) <= 0.0);
        if high <= 0.0 || turned_away || !taker.wants(index) {
            return;
        }

        if is_faint(Part::Node(index), &list, look, scratch, taker) {
            return;
        }

        // Pass on the shadows that may touch this cluster; one may take all of it.
        let start = scratch.candidates.len();
        let cone = Cone::around(bounds.centre, bounds.radius);
        for at in list {
            if node.plane.is_none() {
                if scratch.shadows.may_touch(scratch.candidates[at], &cone) {
                    scratch.candidates.push(scratch.candidates[at]);
                }
                continue;
            }
            match scratch.shadows.narrow(scratch.candidates[at], &bounds, &cone) {
                Meets::Nothing => {}
                Meets::Part(candidate) => scratch.candidates.push(candidate),
                Meets::Everything if look.hidden => {
                    taker.hidden();
                    scratch.candidates.truncate(start);
                    return;
                }
                Meets::Everything => scratch.candidates.push(scratch.candidates[at]),
            }
        }
        let list = start..scratch.candidates.len();

        let is_free = list.is_empty() && low >= 0.0 && node.plane.is_some();
        if is_free && taker.takes_node(index, look) {
            return;
        }
        let hull = self.tree.hull(node);
        if !hull.is_empty() && taker.stands_in(index, look) {
            let seen = see(hull, list, look, scratch);
            taker.take_node(index, seen, look);
            scratch.candidates.truncate(start);
            return;
        }
        if node.second_child == 0 {
            for &k in &self.tree.order[node.range.clone()] {
                self.visit_element(k as usize, list.clone(), look, scratch, taker);
            }
        } else {
            self.visit(index + 1, list.clone(), look, scratch, taker);
            self.visit(node.second_child, list, look, scratch, taker);
        }
        scratch.candidates.truncate(start);
    }

    fn visit_element(
        &self,
        k: usize,
        list: Range<usize>,
        look: Look,
        scratch: &mut Scratch,
        taker: &mut impl Taker,
    ) {
        let element = &self.tree.elements[k];
        if element.plane.distance(look.point) <= 0.0 {
            return;
        }
        let corners = self.tree.corners(k);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &corner in corners {
            let height = look.normal.dot(corner - look.point);
            (low, high) = (low.min(height), high.max(height));
        }
        if high <= 0.0 {
            return;
        }
        if list.is_empty() && low >= 0.0 && taker.takes_element(k, look) {
            return;
        }
        if !is_faint(Part::Element(k), &list, look, scratch, taker) {
            taker.take(k, see(corners, list, look, scratch), look);
        }
    }
}

/// Whether the taker has had a part by its middle, seen or not past the candidates of the list.
fn is_faint(part: Part, list: &Range<usize>, look: Look, scratch: &Scratch, taker: &mut impl Taker) -> bool {
    let Some(middle) = taker.faint(part, look) else { return false };
    let candidates = &scratch.candidates[list.clone()];
    if !candidates.iter().any(|&candidate| scratch.shadows.hides(candidate, middle)) {
        taker.take_faint(part, look);
    }
    true
}

/// What is seen of a polygon: above the horizon, past the candidates of the list, from the point as origin.
pub(crate) fn see<'s>(
    corners: &[DVec3],
    list: Range<usize>,
    look: Look,
    scratch: &'s mut Scratch,
) -> &'s Polygons {
    let Scratch { shadows, candidates, pieces, corners: above, cut } = scratch;
    cut.clear();
    cut.extend(corners.iter().map(|&c| c - look.point));
    if cut.iter().any(|&r| look.normal.dot(r) < 0.0) {
        polygon::clip_by(cut, |r| look.normal.dot(r), above);
        std::mem::swap(cut, above);
    }
    pieces.visible(cut, &candidates[list], shadows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_faces(low: f64, high: f64, inward: bool) -> Vec<Vec<DVec3>> {
        let (a, b) = (low, high);
        let faces = [
            [(a, a, a), (b, a, a), (b, b, a), (a, b, a)],
            [(a, b, b), (b, b, b), (b, a, b), (a, a, b)],
            [(a, a, a), (a, b, a), (a, b, b), (a, a, b)],
            [(b, a, b), (b, b, b), (b, b, a), (b, a, a)],
            [(a, a, a), (a, a, b), (b, a, b), (b, a, a)],
            [(b, b, a), (b, b, b), (a, b, b), (a, b, a)],
        ];
        let mut faces: Vec<Vec<DVec3>> =
            faces.iter().map(|f| f.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect()).collect();
        if !inward {
            faces.iter_mut().for_each(|face| face.reverse());
        }
        faces
    }

    /// In a closed room with a box inside, whatever the point sees adds up to everything.
    #[test]
    fn factors_close_in_a_room_with_a_box_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut faces = cube_faces(0.0, scale, true);
            faces.extend(cube_faces(0.25 * scale, 0.75 * scale, false));
            let occluders = faces.iter().cloned().filter_map(Occluder::new).collect();
            let gatherer = Gatherer::new(occluders, faces);
            let mut scratch = Scratch::default();
            for (point, normal) in [
                (DVec3::new(0.3, 0.4, 0.0), DVec3::Z),
                (DVec3::new(0.1, 0.9, 0.0), DVec3::Z),
                (DVec3::new(0.5, 0.5, 0.75), DVec3::Z),
                (DVec3::new(1e-7, 1e-7, 0.0), DVec3::Z),
                (DVec3::new(0.25, 0.5, 0.74999), DVec3::NEG_X),
            ] {
                let mut sum = 0.0;
                gatherer.factors(point * scale, normal, &mut scratch, &mut |_, factor| sum += factor);
                assert!((sum - 1.0).abs() < 1e-12, "{point} at scale {scale}: {sum}");
            }
        }
    }

    fn rectangle(corners: [(f64, f64, f64); 4]) -> Vec<DVec3> {
        corners.map(|(x, y, z)| DVec3::new(x, y, z)).to_vec()
    }

    fn square(half: f64, z: f64) -> Vec<DVec3> {
        rectangle([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)])
    }

    fn down(mut corners: Vec<DVec3>) -> Vec<DVec3> {
        corners.reverse();
        corners
    }

    /// What a point of the plane z = 0 sees of one light.
    fn seen(light: &[DVec3], blockers: &[Vec<DVec3>], x: f64, y: f64) -> f64 {
        let occluders = blockers.iter().cloned().filter_map(Occluder::new).collect();
        let gatherer = Gatherer::new(occluders, vec![light.to_vec()]);
        let mut sum = 0.0;
        let visit = &mut |_, factor| sum += factor;
        gatherer.factors(DVec3::new(x, y, 0.0), DVec3::Z, &mut Scratch::default(), visit);
        sum
    }

    /// Light [-.5, .5]^2 at z = 4, occluder [-1, 1]^2 at z = 2: values to 1e-12 from an independent computation.
    #[test]
    fn aligned_squares_have_the_known_point_values() {
        let light = down(square(0.5, 4.0));
        for blocker in [square(1.0, 2.0), down(square(1.0, 2.0))] {
            for (x, y, want) in [
                (1.4, 0.0, 0.0),
                (1.75, 0.0, 0.003_940_506_609),
                (2.0, 0.0, 0.006_946_576_463),
                (2.4, 0.0, 0.009_851_475_759),
                (3.0, 0.0, 0.008_156_271_523),
                (2.0, 2.0, 0.006_974_755_489),
                (1.75, 2.25, 0.007_382_268_251),
            ] {
                let got = seen(&light, std::slice::from_ref(&blocker), x, y);
                assert!((got - want).abs() < 6e-13, "({x}, {y}): {got} {want}");
            }
        }
    }

    #[test]
    fn overlapping_and_repeated_blockers_block_once() {
        let (light, one) = (down(square(0.5, 4.0)), square(1.0, 2.0));
        let halves = [
            rectangle([(-1.0, -1.0, 2.0), (0.3, -1.0, 2.0), (0.3, 1.0, 2.0), (-1.0, 1.0, 2.0)]),
            rectangle([(-0.2, -1.0, 2.0), (1.0, -1.0, 2.0), (1.0, 1.0, 2.0), (-0.2, 1.0, 2.0)]),
        ];
        for (x, y) in [(1.75, 0.0), (2.0, 2.0), (-1.9, 0.4), (0.0, 0.0)] {
            let want = seen(&light, std::slice::from_ref(&one), x, y);
            assert!((seen(&light, &[one.clone(), one.clone()], x, y) - want).abs() < 1e-16);
            assert!((seen(&light, &halves, x, y) - want).abs() < 1e-16);
        }
    }

    #[test]
    fn a_contact_wall_blocks_one_side_only() {
        // Wall x = 0, |y| <= 1, 0 <= z <= 1 on the floor; light [1.5, 2.5] x [-.5, .5] at z = 4.
        let wall = [rectangle([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, -1.0, 1.0)])];
        let light = rectangle([(1.5, 0.5, 4.0), (2.5, 0.5, 4.0), (2.5, -0.5, 4.0), (1.5, -0.5, 4.0)]);
        let seen = |x: f64, y: f64| seen(&light, &wall, x, y);
        assert!((seen(1e-12, 0.0) - 0.012_646_605_888).abs() < 1e-12);
        assert!((seen(1e-12, 0.9) - 0.011_701_807_558).abs() < 1e-12);
        assert_eq!(seen(-1e-12, 0.0), 0.0);
        assert!((seen(-0.6, 0.0) - 0.003_418_156_753).abs() < 1e-12);
        assert!((seen(-0.7, 0.0) - 0.006_137_826_648).abs() < 1e-12);
    }

    #[test]
    fn a_blocker_that_crosses_the_light_hides_only_what_is_behind_it() {
        // A vertical plate through the light's middle, from z = 2 to 5, across the whole light: from x = 1 the far half is hidden.
        let plate = [rectangle([(0.0, -2.0, 2.0), (0.0, 2.0, 2.0), (0.0, 2.0, 5.0), (0.0, -2.0, 5.0)])];
        let near = rectangle([(0.0, 0.5, 4.0), (0.5, 0.5, 4.0), (0.5, -0.5, 4.0), (0.0, -0.5, 4.0)]);
        let (got, want) = (seen(&down(square(0.5, 4.0)), &plate, 1.0, 0.0), seen(&near, &[], 1.0, 0.0));
        assert!((got - want).abs() < 1e-15 && want > 0.0, "{got} {want}");
    }
}
