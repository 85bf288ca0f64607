//! Triangles without area: three corners that lie on one line once points that are one place were joined. To leave such a
//! triangle out would leave its middle corner inside an edge of what lies beyond its longest edge, so that is split there.

use crate::nodes::Element;
use glam::DVec3;
use std::collections::HashMap;

/// Ends of an edge, the smaller first.
pub type Ends = (u32, u32);

/// Splits of one triangle lead to no more than this many others: each shortens an edge, and many at one place are rare.
const SPLITS: usize = 64;

/// What is left, how many were left out, and where edges were split.
#[derive(Debug, Default)]
pub struct WithArea {
    /// Elements with area.
    pub elements: Vec<Element>,
    /// Number of elements left out.
    pub flat: usize,
    /// Places in the middle of edges that were split.
    pub middles: HashMap<Ends, u32>,
}

/// Leaves out elements of one layer without area. `area` is positive for those that have some.
pub fn without_flat(
    elements: Vec<Element>,
    area: impl Fn(&[u32]) -> f64,
    position: impl Fn(u32) -> DVec3,
) -> WithArea {
    let mut slots: Vec<Option<Element>> = elements.into_iter().map(Some).collect();
    let has_area = |element: &Element| element.corners.len() >= 3 && area(&element.corners) > 0.0;
    let mut open: Vec<usize> =
        (0..slots.len()).filter(|&k| slots[k].as_ref().is_some_and(|e| !has_area(e))).collect();
    let mut found = WithArea::default();
    if open.is_empty() {
        found.elements = slots.into_iter().flatten().collect();
        return found;
    }
    let mut owner: HashMap<(u32, u32), usize> = HashMap::new();
    for (k, element) in slots.iter().enumerate() {
        for edge in element.iter().flat_map(edges) {
            owner.insert(edge, k);
        }
    }
    let mut left = SPLITS * open.len();
    while let Some(k) = open.pop() {
        let Some(flat) = slots[k].take() else { continue };
        for edge in edges(&flat).filter(|edge| owner.get(edge) == Some(&k)).collect::<Vec<_>>() {
            owner.remove(&edge);
        }
        found.flat += 1;
        if flat.corners.len() != 3 || left == 0 {
            continue;
        }
        left -= 1;
        let length = |j: usize| position(flat.corners[j]).distance(position(flat.corners[(j + 1) % 3]));
        let long = (0..3).fold(0, |best, j| if length(j) > length(best) { j } else { best });
        let [a, b, c] = [0, 1, 2].map(|j| flat.corners[(long + j) % 3]);
        // Polygons of more corners are faces as given, which need not meet; to bend them would spoil them.
        let seam_of = |j: usize| flat.seams[(long + j) % 3];
        let Some(&beyond) = owner.get(&(b, a)) else { continue };
        let Some(other) = slots[beyond].take_if(|other| other.corners.len() == 3) else { continue };
        let Some(at) = (0..3).find(|&j| other.corners[j] == b) else { continue };
        found.middles.insert((a.min(b), a.max(b)), c);
        let d = other.corners[(at + 2) % 3];
        let half = |corners: [u32; 3], seams: [bool; 3]| Element {
            corners: corners.to_vec(),
            seams: seams.to_vec(),
            ..other.clone()
        };
        let [long_seam, to_d, from_d] = [0, 1, 2].map(|j| other.seams[(at + j) % 3]);
        let halves = [
            half([b, c, d], [long_seam || seam_of(1), false, from_d]),
            half([c, a, d], [long_seam || seam_of(2), to_d, false]),
        ];
        for half in halves {
            let slot = slots.len();
            edges(&half).for_each(|edge| {
                owner.insert(edge, slot);
            });
            if !has_area(&half) {
                open.push(slot);
            }
            slots.push(Some(half));
        }
    }
    found.elements = slots.into_iter().flatten().collect();
    found
}

fn edges(element: &Element) -> impl Iterator<Item = (u32, u32)> + '_ {
    let n = element.corners.len();
    (0..n).map(move |k| (element.corners[k], element.corners[(k + 1) % n]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangle_on_one_line_is_left_out_and_its_neighbour_split() {
        // c lies on the edge from a to b; the triangle beyond it is a, d, b.
        let places = [(0.0, 0.0), (2.0, 0.0), (0.7, 0.0), (1.0, -1.0), (0.7, 1.0)];
        let position = |p: u32| DVec3::new(places[p as usize].0, places[p as usize].1, 0.0);
        let area = |ring: &[u32]| {
            let corners: Vec<DVec3> = ring.iter().map(|&p| position(p)).collect();
            geometry::polygon::vector_area(&corners).z
        };
        let element = |corners: [u32; 3]| Element {
            corners: corners.to_vec(),
            seams: vec![false; 3],
            face: 0,
            side: 0,
            surface: (0, 0),
        };
        let given = vec![element([0, 1, 2]), element([1, 0, 3]), element([0, 2, 4]), element([2, 1, 4])];
        let found = without_flat(given, area, position);
        assert_eq!((found.flat, found.elements.len()), (1, 4));
        assert_eq!(found.middles, HashMap::from([((0, 1), 2)]));
        let whole: f64 = found.elements.iter().map(|e| area(&e.corners)).sum();
        assert!((whole - 2.0).abs() < 1e-15, "{whole}");
        // Every inner edge is met from both sides.
        for edge in [(0, 2), (2, 1)] {
            let uses = |(a, b)| found.elements.iter().flat_map(edges).filter(|&e| e == (a, b)).count();
            assert_eq!((uses(edge), uses((edge.1, edge.0))), (1, 1));
        }
    }
}
