//! A scene's elements as a tree of clusters, flat ones as far up as they go: what a cluster's elements have in common is
//! decided once.

use crate::plane::{PLANARITY, Plane};
use crate::polygon;
use glam::DVec3;
use std::ops::Range;

/// Elements in a leaf: fewer cost more lists than they spare.
const LEAF: usize = 4;
/// A gap of this part of the extent splits better than the middle: faces of different directions or places part there.
const GAP: f64 = 0.25;
/// Extent of directions compared with that of places: walls of a room part before they are halved.
const DIRECTIONS: f64 = 4.0;
/// Sine of the angle between planes that count as parallel: what rounding leaves of faces that are. A point aside by a
/// distance d may be in front of such a face by this part of d, and sees as small a part of the hemisphere in it.
const PARALLEL: f64 = 1e-14;
/// Elements whose edges are tried as directions of a flat cluster's box.
const TRIED: usize = 6;

/// A convex element, without its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Element {
    /// Place in the caller's order.
    pub(crate) index: usize,
    pub(crate) plane: Plane,
    pub(crate) centroid: DVec3,
    pub(crate) area: f64,
    /// Largest distance of a corner from the centroid.
    pub(crate) radius: f64,
    first_corner: u32,
    corner_count: u32,
}

/// Elements with area, and clusters of them.
#[derive(Debug, Default)]
pub(crate) struct ElementTree {
    pub(crate) elements: Vec<Element>,
    corners: Vec<DVec3>,
    /// Elements in the order of the leaves.
    pub(crate) order: Vec<u32>,
    /// Depth first: the first child follows its parent.
    pub(crate) nodes: Vec<Node>,
}

#[derive(Debug)]
pub(crate) struct Node {
    /// In the order of the leaves.
    pub(crate) range: Range<usize>,
    /// 0 for a leaf.
    pub(crate) second_child: usize,
    /// Middle and half axes of a box around all elements.
    pub(crate) middle: DVec3,
    pub(crate) axes: [DVec3; 3],
    /// Half the box's diagonal.
    pub(crate) radius: f64,
    /// Where all elements lie in one plane and look the same way.
    pub(crate) plane: Option<Plane>,
    /// Where all elements look the same way: a plane behind all of them. What is not in front of it sees backs only.
    pub(crate) front: Option<Plane>,
    /// Where they also fill a convex polygon: its corners, among the tree's.
    hull: Range<usize>,
}

impl ElementTree {
    pub(crate) fn new(polygons: Vec<Vec<DVec3>>) -> ElementTree {
        let mut tree = ElementTree::default();
        for (index, corners) in polygons.into_iter().enumerate() {
            let Some(plane) = Plane::of_polygon(&corners) else { continue };
            let centroid = polygon::centroid(&corners);
            tree.elements.push(Element {
                index,
                plane,
                centroid,
                area: polygon::area(&corners),
                radius: corners.iter().map(|&c| c.distance(centroid)).fold(0.0, f64::max),
                first_corner: tree.corners.len() as u32,
                corner_count: corners.len() as u32,
            });
            tree.corners.extend(corners);
        }
        tree.order = (0..tree.elements.len() as u32).collect();
        if !tree.order.is_empty() {
            let all = 0..tree.order.len();
            tree.grow(all);
        }
        tree
    }

    pub(crate) fn corners(&self, element: usize) -> &[DVec3] {
        let Element { first_corner, corner_count, .. } = self.elements[element];
        &self.corners[first_corner as usize..(first_corner + corner_count) as usize]
    }

    /// The convex polygon that a node's elements fill; no corners where they fill none.
    pub(crate) fn hull(&self, node: &Node) -> &[DVec3] {
        &self.corners[node.hull.clone()]
    }

    /// The elements below a node.
    pub(crate) fn members(&self, node: &Node) -> impl Iterator<Item = usize> + '_ {
        self.order[node.range.clone()].iter().map(|&k| k as usize)
    }

    /// Grows the node over a range of the order, and all below it; returns its index.
    fn grow(&mut self, range: Range<usize>) -> usize {
        let index = self.nodes.len();
        let mut node = self.node(range.clone());
        let is_flat = node.plane.is_some();
        if let Some(plane) = node.plane.filter(|_| range.len() > 1) {
            let area: f64 = self.members(&node).map(|k| self.elements[k].area).sum();
            let hull = convex_hull(self.members(&node).flat_map(|k| self.corners(k)).copied(), &plane);
            if (polygon::area(&hull) - area).abs() <= PLANARITY * area {
                node.hull = self.corners.len()..self.corners.len() + hull.len();
                self.corners.extend(hull);
            }
        }
        let longest = node.axes.into_iter().fold(DVec3::ZERO, |best, axis| {
            if axis.length_squared() > best.length_squared() { axis } else { best }
        });
        let halves = (node.middle, longest);
        self.nodes.push(node);
        if range.len() > LEAF || (range.len() > 1 && !is_flat) {
            let middle = if is_flat { self.halve(range.clone(), halves) } else { None };
            let middle = middle.unwrap_or_else(|| self.split(range.clone(), is_flat));
            self.grow(range.start..middle);
            self.nodes[index].second_child = self.grow(middle..range.end);
        }
        index
    }

    /// Orders a range by the side of a box's middle that elements lie on, along an axis: cells that came from halving fill
    /// convex polygons again. `None` where all lie on one side.
    fn halve(&mut self, range: Range<usize>, (middle, axis): (DVec3, DVec3)) -> Option<usize> {
        let elements = &self.elements;
        let is_behind = |k: &u32| axis.dot(elements[*k as usize].centroid - middle) < 0.0;
        let members = &mut self.order[range.clone()];
        members.sort_by_key(|k| !is_behind(k));
        let count = members.iter().filter(|k| is_behind(k)).count();
        (count > 0 && count < members.len()).then_some(range.start + count)
    }

    /// Orders a range along its longest extent, directions counting like the size of the range, and returns where to part it.
    fn split(&mut self, range: Range<usize>, is_flat: bool) -> usize {
        let elements = &self.elements;
        let key = |k: u32, axis: usize| match axis {
            0..3 => elements[k as usize].centroid[axis],
            _ => elements[k as usize].plane.normal[axis - 3],
        };
        let spread = |axis: usize| {
            let keys = self.order[range.clone()].iter().map(|&k| key(k, axis));
            let (low, high) =
                keys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        let size = (0..3).map(spread).fold(0.0, f64::max);
        let (mut axis, mut widest) = (0, f64::NEG_INFINITY);
        for candidate in 0..6 {
            let extent =
                if candidate < 3 { spread(candidate) } else { DIRECTIONS * size * spread(candidate) };
            if extent > widest {
                (axis, widest) = (candidate, extent);
            }
        }
        let by_key = |a: &u32, b: &u32| key(*a, axis).total_cmp(&key(*b, axis)).then(a.cmp(b));
        let middle = range.len() / 2;
        let members = &mut self.order[range.clone()];
        if is_flat {
            members.select_nth_unstable_by(middle, by_key);
            return range.start + middle;
        }
        members.sort_unstable_by(by_key);
        let extent = key(members[members.len() - 1], axis) - key(members[0], axis);
        let (mut at, mut widest) = (middle, GAP * extent);
        for k in 1..members.len() {
            let gap = key(members[k], axis) - key(members[k - 1], axis);
            if gap > widest {
                (at, widest) = (k, gap);
            }
        }
        range.start + at
    }

    fn node(&self, range: Range<usize>) -> Node {
        let members: Vec<usize> = self.order[range.clone()].iter().map(|&k| k as usize).collect();
        let corners: Vec<DVec3> = members.iter().flat_map(|&k| self.corners(k)).copied().collect();
        let plane = self.elements[members[0]].plane;
        let tolerance = PLANARITY * polygon::diameter(&corners);
        let is_flat = members.iter().all(|&k| plane.normal.dot(self.elements[k].plane.normal) > 0.0)
            && corners.iter().all(|&c| plane.distance(c).abs() <= tolerance);
        let boxed = |frame: [DVec3; 3]| {
            let mut middle = DVec3::ZERO;
            let axes = frame.map(|axis| {
                let heights = corners.iter().map(|&c| axis.dot(c - corners[0]));
                let (low, high) = heights
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
                middle += 0.5 * (low + high) * axis;
                0.5 * (high - low) * axis
            });
            (corners[0] + middle, axes)
        };
        let (middle, axes) = if is_flat {
            let (u, _) = plane.axes();
            let edges = members.iter().take(TRIED).flat_map(|&k| polygon::edges(self.corners(k)));
            let directions = edges.map(|(a, b)| (b - a).normalize_or_zero()).filter(|d| *d != DVec3::ZERO);
            let boxes =
                std::iter::once(u).chain(directions).map(|u| boxed([u, plane.normal.cross(u), plane.normal]));
            let size = |axes: &[DVec3; 3]| axes[0].length() * axes[1].length();
            boxes.min_by(|a, b| size(&a.1).total_cmp(&size(&b.1))).unwrap_or((corners[0], [DVec3::ZERO; 3]))
        } else {
            boxed([DVec3::X, DVec3::Y, DVec3::Z])
        };
        let radius = axes.iter().map(|axis| axis.length_squared()).sum::<f64>().sqrt();
        let front = if is_flat { Some(plane) } else { self.hindmost(&members, &corners) };
        Node {
            range,
            second_child: 0,
            middle,
            axes,
            radius,
            plane: is_flat.then_some(plane),
            front,
            hull: 0..0,
        }
    }

    /// The plane of the member that lies farthest back, where all look the same way to the planarity of faces.
    fn hindmost(&self, members: &[usize], corners: &[DVec3]) -> Option<Plane> {
        let normal = self.elements[*members.first()?].plane.normal;
        let is_parallel = |&k: &usize| {
            let other = self.elements[k].plane.normal;
            normal.dot(other) > 0.0 && normal.cross(other).length() <= PARALLEL
        };
        if !members.iter().all(is_parallel) {
            return None;
        }
        let back = corners.iter().copied().min_by(|&a, &b| normal.dot(a).total_cmp(&normal.dot(b)))?;
        Some(Plane { normal, origin: back })
    }
}

/// Convex hull of points of a plane, counter-clockwise seen from its front, without straight corners (Andrew 1979).
fn convex_hull(points: impl Iterator<Item = DVec3>, plane: &Plane) -> Vec<DVec3> {
    let (u, v) = plane.axes();
    let mut points: Vec<(f64, f64, DVec3)> = points.map(|p| (u.dot(p), v.dot(p), p)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let extent = points.iter().map(|p| p.2.distance(points[0].2)).fold(0.0, f64::max);
    let mut hull: Vec<(f64, f64, DVec3)> = Vec::new();
    for pass in 0..2 {
        let first = hull.len();
        for k in 0..points.len() {
            let next = if pass == 0 { points[k] } else { points[points.len() - 1 - k] };
            while hull.len() >= first + 2 {
                let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
                let turn = (b.0 - a.0) * (next.1 - a.1) - (b.1 - a.1) * (next.0 - a.0);
                let base = ((next.0 - a.0).powi(2) + (next.1 - a.1).powi(2)).sqrt();
                // How far the corner stands out of the line past it.
                if turn > PLANARITY * extent * base {
                    break;
                }
                hull.pop();
            }
            hull.push(next);
        }
        hull.pop();
    }
    hull.into_iter().map(|p| p.2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_of_a_room_part_before_they_are_halved() {
        // Four squares to each of three perpendicular walls.
        let mut polygons = Vec::new();
        for (u, v) in [(DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X), (DVec3::X, DVec3::Y)] {
            for (i, j) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
                let corner = i * u + j * v;
                polygons.push(vec![corner, corner + u, corner + u + v, corner + v]);
            }
        }
        polygons.push(vec![DVec3::ZERO; 3]);
        let tree = ElementTree::new(polygons);
        assert_eq!(tree.elements.len(), 12);
        let leaves: Vec<&Node> = tree.nodes.iter().filter(|node| node.second_child == 0).collect();
        assert_eq!(leaves.len(), 3);
        for leaf in leaves {
            assert!(leaf.plane.is_some());
            assert_eq!(tree.members(leaf).count(), 4);
            assert!((leaf.radius - 2f64.sqrt()).abs() < 1e-12);
            assert!((leaf.middle.element_sum() - 2.0).abs() < 1e-12);
            let hull = tree.hull(leaf);
            assert!(hull.len() == 4 && (polygon::area(hull) - 4.0).abs() < 1e-12);
        }
        assert!(tree.nodes[0].plane.is_none() && (tree.nodes[0].radius - 3f64.sqrt()).abs() < 1e-12);
    }
}
