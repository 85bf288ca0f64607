//! Sources gathered at a point through a tree: what all of a cluster's elements have in common is decided once.
//!
//! A cluster beneath the point's horizon, turned away from it, or wholly behind one blocker gives nothing; a blocker that
//! cannot reach into the shaft to a cluster is not asked again for its elements. What is left is exact, element by
//! element. Where an error is allowed, a flat, unblocked cluster seen under a small angle is not opened: its sources
//! count by their moments, Taylor's series of the kernel to second order (as far blocks in hierarchical radiosity, Hanrahan,
//! Salzman & Aupperle 1991, but with the field's variation inside the cluster instead of its mean).
//!
//! # Precision
//! An unopened cluster of radius R at distance d is off by a few (R / d)^3 of its own share: see [`SourceTree::gather`].

use crate::gather::{Cone, Gatherer, Scratch};
use crate::patch::Patch;
use crate::plane::{PLANARITY, Plane};
use crate::point_factor::point_factor;
use crate::sides::SideBits;
use crate::visible::visible_factor;
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

/// Elements in a leaf: fewer cost more lists than they spare.
const LEAF: usize = 4;

/// A scene with the strengths of its sources, N numbers each.
#[derive(Debug)]
pub struct SourceTree<const N: usize> {
    gatherer: Gatherer,
    /// Strength of each of the gatherer's elements.
    strengths: Vec<[f64; N]>,
    /// Moments of each of the gatherer's elements.
    element_moments: Vec<Moments<N>>,
    /// Elements in the order of the leaves.
    order: Vec<u32>,
    /// Depth first: the first child follows its parent.
    nodes: Vec<Node<N>>,
}

#[derive(Debug)]
struct Node<const N: usize> {
    range: Range<usize>,
    /// 0 for a leaf.
    second_child: usize,
    centre: DVec3,
    radius: f64,
    /// What holds for all elements.
    bits: SideBits,
    /// Whether anything here has a strength.
    lit: bool,
    /// Plane and moments, where all elements lie in one plane and look the same way.
    flat: Option<(Plane, Moments<N>)>,
}

/// Moments of the sources over their plane, about a centre.
#[derive(Debug, Clone)]
struct Moments<const N: usize> {
    axes: [DVec3; 2],
    /// Strength times area.
    zeroth: [f64; N],
    first: [[f64; N]; 2],
    /// Along the first axis twice, the second twice, and both.
    second: [[f64; N]; 3],
}

/// How sources were counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Elements by their exact form factor.
    pub exact: u64,
    /// Clusters and elements by their moments.
    pub far: u64,
    /// Clusters proved to be wholly behind one blocker.
    pub hidden: u64,
}

/// What may be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Flat unblocked clusters are counted by their moments where radius over distance is below this; 0 for never.
    pub far: f64,
    /// Whether clusters behind one blocker are recognised as such.
    pub hidden: bool,
}

impl Opening {
    /// Everything exactly; only what is proved to give nothing is left out.
    pub const EXACT: Opening = Opening { far: 0.0, hidden: true };
}

struct Look<'a> {
    point: DVec3,
    normal: DVec3,
    opening: Opening,
    sides: &'a SideBits,
}

impl<const N: usize> SourceTree<N> {
    /// Prepares the elements of `gatherer`, with `strengths` in the order they were given to it.
    pub fn new(gatherer: Gatherer, strengths: &[[f64; N]]) -> SourceTree<N> {
        let elements = &gatherer.elements;
        let strengths: Vec<[f64; N]> =
            elements.iter().map(|(index, ..)| strengths.get(*index).copied().unwrap_or([0.0; N])).collect();
        let element_moments =
            elements.iter().zip(&strengths).map(|((_, patch, _), s)| Moments::of_patch(patch, s)).collect();
        let order: Vec<u32> = (0..elements.len() as u32).collect();
        let mut tree = SourceTree { gatherer, strengths, element_moments, order, nodes: Vec::new() };
        if !tree.order.is_empty() {
            let all = 0..tree.order.len();
            tree.grow(all);
        }
        tree
    }

    /// Grows the node over a range of the order, and all below it; returns its index.
    fn grow(&mut self, range: Range<usize>) -> usize {
        let index = self.nodes.len();
        let node = self.node(range.clone());
        let leaf = range.len() <= LEAF;
        self.nodes.push(node);
        if !leaf {
            let middle = self.split(range.clone());
            self.grow(range.start..middle);
            self.nodes[index].second_child = self.grow(middle..range.end);
        }
        index
    }

    /// Orders a range along its longest extent, directions counting like the size of the range, and returns its middle.
    fn split(&mut self, range: Range<usize>) -> usize {
        let elements = &self.gatherer.elements;
        let patch = |k: u32| &elements[k as usize].1;
        let spread = |key: &dyn Fn(&Patch) -> f64| {
            let keys = self.order[range.clone()].iter().map(|&k| key(patch(k)));
            let (low, high) =
                keys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        let size = (0..3).map(|c| spread(&|p| p.centroid[c])).fold(0.0, f64::max);
        let (mut axis, mut widest) = (0, f64::NEG_INFINITY);
        for candidate in 0..6 {
            let extent = match candidate {
                0..3 => spread(&|p| p.centroid[candidate]),
                _ => size * spread(&|p| p.plane.normal[candidate - 3]),
            };
            if extent > widest {
                (axis, widest) = (candidate, extent);
            }
        }
        let key = |&k: &u32| match axis {
            0..3 => patch(k).centroid[axis],
            _ => patch(k).plane.normal[axis - 3],
        };
        // Directions split at their largest gap would serve walls better than halves do, but halves keep the tree shallow.
        let by_key = |a: &u32, b: &u32| key(a).total_cmp(&key(b)).then(a.cmp(b));
        let middle = range.len() / 2;
        self.order[range.clone()].select_nth_unstable_by(middle, by_key);
        range.start + middle
    }

    fn node(&self, range: Range<usize>) -> Node<N> {
        let members: Vec<usize> = self.order[range.clone()].iter().map(|&k| k as usize).collect();
        let elements = &self.gatherer.elements;
        let area: f64 = members.iter().map(|&k| elements[k].1.area).sum();
        let weighted: DVec3 = members.iter().map(|&k| elements[k].1.area * elements[k].1.centroid).sum();
        let centre = weighted / area;
        let corners = members.iter().flat_map(|&k| &elements[k].1.corners);
        let radius = corners.map(|&corner| corner.distance(centre)).fold(0.0, f64::max);
        let bits =
            members[1..].iter().fold(elements[members[0]].2.clone(), |bits, &k| bits.common(&elements[k].2));
        let plane = elements[members[0]].1.plane;
        let in_plane = |k: &usize| {
            let patch = &elements[*k].1;
            plane.normal.dot(patch.plane.normal) > 0.0
                && patch.corners.iter().all(|&c| plane.distance(c).abs() <= PLANARITY * radius)
        };
        let flat = members.iter().all(in_plane).then(|| {
            let mut moments = Moments::none(&plane);
            members.iter().for_each(|&k| moments.add(&elements[k].1, &self.strengths[k], centre));
            (plane, moments)
        });
        let lit = members.iter().any(|&k| self.strengths[k].iter().any(|&s| s != 0.0));
        Node { range, second_child: 0, centre, radius, bits, lit, flat }
    }

    /// Sum over the elements of form factor times strength, at `point` on a plane with unit `normal`; and how it was found.
    ///
    /// With `opening.far` = t clusters of radius below t times their distance are counted by their moments. The remainder of
    /// the series is below 10 t^3 of such a cluster's share for a point that sees it well above its horizon, and
    /// signs differ between clusters: t = 0.2 is measured at 1e-4 of the whole in a room.
    pub fn gather(
        &self,
        point: DVec3,
        normal: DVec3,
        opening: Opening,
        scratch: &mut Scratch,
    ) -> ([f64; N], Counts) {
        let (mut sum, mut counts) = ([0.0; N], Counts::default());
        if self.nodes.is_empty() {
            return (sum, counts);
        }
        let occluders = &self.gatherer.occluders;
        let sides = SideBits::of_point(&Plane { normal, origin: point }, occluders);
        scratch.cones.clear();
        scratch.cones.extend(occluders.iter().map(|o| Cone::around(o.centre - point, o.radius)));
        scratch.candidates.clear();
        scratch.candidates.extend(0..occluders.len() as u32);
        let look = Look { point, normal, opening, sides: &sides };
        self.visit(0, 0..occluders.len(), &look, scratch, &mut sum, &mut counts);
        (sum, counts)
    }

    /// Adds what a node gives; `list` is where its parent's candidates stand.
    fn visit(
        &self,
        index: usize,
        list: Range<usize>,
        look: &Look<'_>,
        scratch: &mut Scratch,
        sum: &mut [f64; N],
        counts: &mut Counts,
    ) {
        let node = &self.nodes[index];
        let to_centre = node.centre - look.point;
        let height = look.normal.dot(to_centre);
        let turned_away = |(plane, _): &(Plane, _)| plane.distance(look.point) <= 0.0;
        if !node.lit || height <= -node.radius || node.flat.as_ref().is_some_and(turned_away) {
            return;
        }

        // Pass on the blockers that may reach into the shaft to this cluster; one may take all of it.
        let cone = Cone::around(to_centre, node.radius);
        let start = scratch.candidates.len();
        for at in list {
            let k = scratch.candidates[at] as usize;
            let blocker_cone = &scratch.cones[k];
            let meets = cone.as_ref().zip(blocker_cone.as_ref()).is_none_or(|(a, b)| a.may_meet(b));
            if !meets || !look.sides.may_block(&node.bits, k) {
                continue;
            }
            if look.opening.hidden && self.hides(k, look.point, to_centre, node.radius, &cone, blocker_cone) {
                counts.hidden += 1;
                scratch.candidates.truncate(start);
                return;
            }
            scratch.candidates.push(k as u32);
        }
        let list = start..scratch.candidates.len();

        let is_far = |radius: f64, height: f64, squared: f64| {
            height >= radius && radius * radius < look.opening.far * look.opening.far * squared
        };
        let unblocked = list.is_empty();
        match &node.flat {
            Some((plane, moments))
                if unblocked && is_far(node.radius, height, to_centre.length_squared()) =>
            {
                moments.add_to(sum, to_centre, plane.normal, look.normal);
                counts.far += 1;
            }
            _ if node.second_child == 0 => {
                for &k in &self.order[node.range.clone()] {
                    self.visit_element(k as usize, list.clone(), look, scratch, sum, counts);
                }
            }
            _ => {
                self.visit(index + 1, list.clone(), look, scratch, sum, counts);
                self.visit(node.second_child, list, look, scratch, sum, counts);
            }
        }
        scratch.candidates.truncate(start);
    }

    fn visit_element(
        &self,
        k: usize,
        list: Range<usize>,
        look: &Look<'_>,
        scratch: &mut Scratch,
        sum: &mut [f64; N],
        counts: &mut Counts,
    ) {
        let (_, patch, bits) = &self.gatherer.elements[k];
        let horizon = Plane { normal: look.normal, origin: look.point };
        if patch.plane.distance(look.point) <= 0.0
            || patch.corners.iter().all(|&c| horizon.distance(c) <= 0.0)
        {
            return;
        }
        let to_centre = patch.centroid - look.point;
        let Scratch { visible, cut, cones, candidates } = scratch;
        let cone = Cone::around(to_centre, patch.radius);
        let blockers = candidates[list].iter().map(|&b| b as usize).filter(|&b| {
            cone.as_ref().zip(cones[b].as_ref()).is_none_or(|(a, b)| a.may_meet(b))
                && look.sides.may_block(bits, b)
        });
        let blockers: Vec<_> = blockers.map(|b| &self.gatherer.occluders[b]).collect();
        let far = look.opening.far;
        let factor = if !blockers.is_empty() {
            counts.exact += 1;
            visible_factor(look.point, look.normal, &patch.corners, &blockers, visible).factor
        } else if look.normal.dot(to_centre) >= patch.radius
            && patch.radius * patch.radius < far * far * to_centre.length_squared()
        {
            counts.far += 1;
            let moments = &self.element_moments[k];
            moments.add_to(sum, to_centre, patch.plane.normal, look.normal);
            return;
        } else {
            counts.exact += 1;
            point_factor(look.point, look.normal, &patch.corners, cut).max(0.0)
        };
        for (sum, strength) in sum.iter_mut().zip(&self.strengths[k]) {
            *sum += factor * strength;
        }
    }

    /// Whether the ball at `to_centre` from the point lies inside the blocker's pyramid, beyond its plane.
    fn hides(
        &self,
        k: usize,
        point: DVec3,
        to_centre: DVec3,
        radius: f64,
        cone: &Option<Cone>,
        blocker_cone: &Option<Cone>,
    ) -> bool {
        let blocker = &self.gatherer.occluders[k];
        // Cheap first: a ball that looks larger, or whose centre lies outside the blocker's cone, is not hidden.
        let Some(cone) = cone else { return false };
        if blocker_cone
            .as_ref()
            .is_some_and(|b| b.sine < cone.sine || b.direction.dot(cone.direction) < b.cosine)
        {
            return false;
        }
        let height = blocker.plane.distance(point);
        let inward = -height.signum();
        if height == 0.0 || inward * (blocker.plane.normal.dot(to_centre) + height) < radius {
            return false;
        }
        crate::polygon::edges(&blocker.corners).all(|(a, b)| {
            let side = inward * (a - point).cross(b - point);
            let along = side.dot(to_centre);
            along > 0.0 && along * along >= radius * radius * side.length_squared()
        })
    }
}

impl<const N: usize> Moments<N> {
    fn none(plane: &Plane) -> Moments<N> {
        let (u, v) = plane.axes();
        Moments { axes: [u, v], zeroth: [0.0; N], first: [[0.0; N]; 2], second: [[0.0; N]; 3] }
    }

    fn of_patch(patch: &Patch, strength: &[f64; N]) -> Moments<N> {
        let mut moments = Moments::none(&patch.plane);
        moments.add(patch, strength, patch.centroid);
        moments
    }

    /// Adds a patch of even strength: over a triangle with corners u_i, of area A, u has the mean of the corners and
    /// u v the integral A / 12 (sum u_i v_i + sum u_i sum v_i).
    fn add(&mut self, patch: &Patch, strength: &[f64; N], centre: DVec3) {
        let (mut area, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for k in 2..patch.corners.len() {
            let corners = [patch.corners[0], patch.corners[k - 1], patch.corners[k]];
            let twice = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(patch.plane.normal);
            let places = corners.map(|corner| self.axes.map(|axis| axis.dot(corner - centre)));
            let sum = [0, 1].map(|c| places.iter().map(|p| p[c]).sum::<f64>());
            area += 0.5 * twice;
            (0..2).for_each(|c| first[c] += twice / 6.0 * sum[c]);
            for (at, (a, b)) in [(0, 0), (1, 1), (0, 1)].into_iter().enumerate() {
                let products: f64 = places.iter().map(|p| p[a] * p[b]).sum();
                second[at] += twice / 24.0 * (products + sum[a] * sum[b]);
            }
        }
        for (n, &s) in strength.iter().enumerate() {
            self.zeroth[n] += s * area;
            (0..2).for_each(|c| self.first[c][n] += s * first[c]);
            (0..3).for_each(|c| self.second[c][n] += s * second[c]);
        }
    }

    /// Adds the integral of the kernel times the sources. Over the sources' plane the kernel is h a / (pi r^4), with h the
    /// constant height of the point over that plane and a the height over the point's own, linear in place.
    fn add_to(&self, sum: &mut [f64; N], to_centre: DVec3, source_normal: DVec3, normal: DVec3) {
        let r2 = to_centre.length_squared();
        let h = -source_normal.dot(to_centre) * FRAC_1_PI / (r2 * r2);
        let a = normal.dot(to_centre);
        let slope = self.axes.map(|axis| normal.dot(axis));
        let d = self.axes.map(|axis| axis.dot(to_centre) / r2);
        // Derivatives of a / r^4 times r^4, d being the place over r^2.
        let along = |c: usize| slope[c] - 4.0 * a * d[c];
        let twice = |b: usize, c: usize| {
            let equal = if b == c { a / r2 } else { 0.0 };
            -4.0 * (slope[b] * d[c] + slope[c] * d[b] + equal) + 24.0 * a * d[b] * d[c]
        };
        let (g, q) = ([along(0), along(1)], [0.5 * twice(0, 0), 0.5 * twice(1, 1), twice(0, 1)]);
        for (n, sum) in sum.iter_mut().enumerate() {
            let first = g[0] * self.first[0][n] + g[1] * self.first[1][n];
            let second = (0..3).map(|c| q[c] * self.second[c][n]).sum::<f64>();
            *sum += h * (a * self.zeroth[n] + first + second);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::occluder::Occluder;

    /// Quadrilaterals n x n over a parallelogram.
    fn grid(corner: DVec3, u: DVec3, v: DVec3, n: usize) -> Vec<Vec<DVec3>> {
        let at = |i: usize, j: usize| corner + u * (i as f64 / n as f64) + v * (j as f64 / n as f64);
        (0..n * n)
            .map(|k| (k % n, k / n))
            .map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect()
    }

    /// The unit cube from inside, n x n to a wall, with a box standing in it.
    fn room(n: usize, scale: f64) -> (Vec<Occluder>, Vec<Vec<DVec3>>) {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let walls =
            [(DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, x, y), (z, y, x)];
        let (mut faces, mut elements) = (Vec::new(), Vec::new());
        for (low, size, n, inside) in [(0.0, 1.0, n, true), (0.3, 0.25, n / 4, false)] {
            let base = if inside { DVec3::ZERO } else { DVec3::new(low, 0.0, low) };
            for (corner, u, v) in walls {
                let (u, v) = if inside { (u, v) } else { (v, u) };
                let place = scale * (base + size * corner);
                let (u, v) = (scale * size * u, scale * size * v);
                faces.extend(grid(place, u, v, 1));
                elements.extend(grid(place, u, v, n.max(1)));
            }
        }
        (faces.into_iter().filter_map(Occluder::new).collect(), elements)
    }

    fn strengths(elements: &[Vec<DVec3>], scale: f64) -> Vec<[f64; 2]> {
        let field = |p: DVec3| [1.0 + (5.0 * p.x).sin() * p.y, 1.0];
        elements.iter().map(|e| field(crate::polygon::mean_corner(e) / scale)).collect()
    }

    const POINTS: [(f64, f64, f64, DVec3); 5] = [
        (0.12, 0.0, 0.7, DVec3::Y),
        (0.299, 0.0, 0.4, DVec3::Y),
        (0.0, 0.3, 0.31, DVec3::X),
        (0.4, 0.25, 0.5, DVec3::Y),
        (0.61, 1.0, 0.9, DVec3::NEG_Y),
    ];

    #[test]
    fn unopened_clusters_change_the_sum_by_less_than_stated_and_exact_means_exact() {
        for scale in [1e-6, 1.0, 1e6] {
            let (occluders, elements) = room(16, scale);
            let strengths = strengths(&elements, scale);
            let exact = Gatherer::new(occluders.clone(), elements.clone());
            let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
            let scratch = &mut Scratch::default();
            let mut counts = [0; 3];
            for (x, y, z, normal) in POINTS {
                let point = scale * DVec3::new(x, y, z);
                let mut want = [0.0; 2];
                exact.factors(point, normal, scratch, &mut |k, factor| {
                    (0..2).for_each(|c| want[c] += factor * strengths[k][c]);
                });
                for (far, allowed) in [(0.0, 1e-12), (0.1, 2e-5), (0.2, 2e-4), (0.4, 2e-3)] {
                    let opening = Opening { far, hidden: true };
                    let (got, count) = tree.gather(point, normal, opening, scratch);
                    for (got, want) in got.iter().zip(want) {
                        let error = (got / want - 1.0).abs();
                        assert!(error < allowed, "{point} {far}: {got} {want} {error:.1e}");
                    }
                    counts = [count.exact, count.far, count.hidden];
                    let (all, count) = tree.gather(point, normal, Opening { far, hidden: false }, scratch);
                    assert_eq!(count.hidden, 0);
                    assert!(all.iter().zip(got).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
                }
            }
            assert!(counts[0] < 300 && counts[1] > 10, "{counts:?}");
        }
    }

    #[test]
    fn clusters_behind_the_box_are_proved_hidden() {
        let (occluders, elements) = room(16, 1.0);
        let strengths = vec![[1.0]; elements.len()];
        let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
        let beside = DVec3::new(0.299, 0.0, 0.4);
        let ([sum], counts) = tree.gather(beside, DVec3::Y, Opening::EXACT, &mut Scratch::default());
        assert!((sum - 1.0).abs() < 1e-12 && counts.hidden > 3 && counts.far == 0, "{sum} {counts:?}");
    }
}
