//! Orientation: faces that contradict their neighbours are turned over.
//!
//! Across an edge of exactly two faces both must run along it in opposite directions. Faces connected by such edges
//! form a patch, which has two consistent orientations or none. A patch that is consistent as given stays, whichever way
//! it looks (a room looks inward). Else the faces that disagree with the rest yield: those of the smaller area in all;
//! of equal areas, those whose turning makes the patch look outward. Edges with more than two faces say nothing.

use crate::clean::Face;
use crate::places::Places;
use geometry::polygon;
use glam::DVec3;
use std::collections::BTreeMap;

/// Areas this close to each other, relative, are a tie: far above the rounding of a sum of areas.
const TIE: f64 = 1e-9;

/// What was done.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Oriented {
    /// Faces turned over, in rising order.
    pub flipped: Vec<usize>,
    /// Faces of patches that have no consistent orientation (one-sided like a Moebius strip), left as they are: the
    /// first of each.
    pub one_sided: Vec<usize>,
}

/// Turns over the faces that contradict their neighbours.
pub fn orient(faces: &mut [Face], places: &Places) -> Oriented {
    let mut uses: BTreeMap<(u32, u32), Vec<(usize, bool)>> = BTreeMap::new();
    for (index, face) in faces.iter().enumerate() {
        for (a, b) in ring_edges(&face.corners) {
            uses.entry((a.min(b), a.max(b))).or_default().push((index, a < b));
        }
    }
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); faces.len()];
    for pair in uses.values() {
        if let &[(f, along_f), (g, along_g)] = &pair[..]
            && f != g
        {
            neighbours[f].push((g, along_f == along_g));
            neighbours[g].push((f, along_f == along_g));
        }
    }

    let mut oriented = Oriented::default();
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    for start in 0..faces.len() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let (mut patch, mut next, mut consistent) = (vec![start], 0, true);
        while next < patch.len() {
            let face = patch[next];
            next += 1;
            for &(other, contradicts) in &neighbours[face] {
                let wished = turned[face] != Some(contradicts);
                match turned[other] {
                    None => {
                        turned[other] = Some(wished);
                        patch.push(other);
                    }
                    Some(is) => consistent &= is == wished,
                }
            }
        }
        let minority: Vec<usize> = patch.iter().copied().filter(|&face| turned[face] == Some(true)).collect();
        if !consistent {
            oriented.one_sided.push(start);
        } else if !minority.is_empty() {
            oriented.flipped.extend(yielding(faces, places, &patch, &minority));
        }
    }
    oriented.flipped.sort_unstable();
    for &face in &oriented.flipped {
        faces[face].corners.reverse();
        faces[face].plane = faces[face].plane.flipped();
    }
    oriented
}

/// Which of the two sides of a contradiction yields: `some` of the faces of a patch or all others.
fn yielding(faces: &[Face], places: &Places, patch: &[usize], some: &[usize]) -> Vec<usize> {
    let mut patch = patch.to_vec();
    patch.sort_unstable();
    let mut some = some.to_vec();
    some.sort_unstable();
    let is_some = |face: &usize| some.binary_search(face).is_ok();
    let others: Vec<usize> = patch.iter().copied().filter(|face| !is_some(face)).collect();
    let area = |set: &[usize]| -> f64 {
        set.iter().map(|&face| polygon::area(&places.corners(&faces[face].corners))).sum()
    };
    let (area_some, area_others) = (area(&some), area(&others));
    if (area_some - area_others).abs() > TIE * (area_some + area_others) {
        return if area_some < area_others { some } else { others };
    }
    // Signed volume where `some` are turned over; it is the negative where `others` are.
    let all: Vec<DVec3> = patch.iter().flat_map(|&face| places.corners(&faces[face].corners)).collect();
    let centre = polygon::mean_corner(&all);
    let volume: f64 = patch
        .iter()
        .map(|face| {
            let corners = places.corners(&faces[*face].corners);
            let height = (corners[0] - centre).dot(polygon::vector_area(&corners)) / 3.0;
            if is_some(face) { -height } else { height }
        })
        .sum();
    if volume >= 0.0 { some } else { others }
}

/// Directed edges of a ring.
pub fn ring_edges(ring: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| (a, b))
}
