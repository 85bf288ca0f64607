//! Sheets and layers: what is meshed together.
//!
//! A sheet is one side of a face that takes part in the light. A layer is all sheets that lie in one plane and look
//! the same way. Only within a layer can area be counted twice, and there one sheet wins wherever several overlap:
//! an emitter before others, a front before the back of a two-sided face, then the first given.

use crate::clean::{Cleaned, Face};
use crate::frame::Frame;
use geometry::plane::PLANARITY;
use geometry::polygon;
use glam::DVec3;

/// Normals of coplanar faces agree within this angle in radians; it keeps a small facet of a curved surface, whose
/// corners all lie within rounding of a large face's plane, from being counted as part of it.
const SAME_DIRECTION: f64 = 1e-4;

/// One side of a face.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Index of the face.
    pub face: u32,
    /// 0 front, 1 back of a two-sided face.
    pub side: u32,
    /// Places of its corners, counter-clockwise in the layer's frame.
    pub ring: Vec<u32>,
    /// Material: nodes are shared between coplanar sheets of one material.
    pub material: u32,
    /// Smallest wins where sheets overlap.
    pub rank: (bool, u32, u32),
}

/// Sheets that lie in one plane and look the same way.
#[derive(Debug, Clone)]
pub struct Layer {
    /// Frame of the plane, the same for both layers of a plane, so that both sides of a face get equal elements.
    pub frame: Frame,
    /// Whether the sheets look against the frame's normal.
    pub reversed: bool,
    /// Sheets, by face and side.
    pub sheets: Vec<Sheet>,
}

impl Layer {
    /// The sheet that holds a place where the sheets of `candidates` overlap.
    pub fn winner(&self, candidates: impl Iterator<Item = u32>) -> Option<u32> {
        candidates.min_by_key(|&sheet| self.sheets[sheet as usize].rank)
    }
}

/// The layers of a scene, in the order of their first faces; unless `together`, every face is in layers of its own.
pub fn layers(scene: &Cleaned, together: bool) -> Vec<Layer> {
    let Cleaned { places, faces } = scene;
    let corners: Vec<Vec<DVec3>> = faces.iter().map(|face| places.corners(&face.corners)).collect();
    let mut layers = Vec::new();
    let planes = if together {
        coplanar_groups(faces, &corners, places.tolerance())
    } else {
        (0..faces.len()).map(|face| vec![face]).collect()
    };
    for plane in planes {
        // The largest face fixes the plane best.
        let Some(largest) = largest(&plane, &corners) else { continue };
        let frame = Frame::new(&faces[largest].plane, plane.iter().map(|&face| corners[face].as_slice()));
        for reversed in [false, true] {
            let sheets: Vec<Sheet> =
                plane.iter().flat_map(|&face| sheets_of(face, &faces[face], &frame, reversed)).collect();
            if !sheets.is_empty() {
                layers.push(Layer { frame, reversed, sheets });
            }
        }
    }
    layers
}

/// The sides of a face that look along the frame's normal, or against it.
fn sheets_of(index: usize, face: &Face, frame: &Frame, reversed: bool) -> impl Iterator<Item = Sheet> {
    let along = face.plane.normal.dot(frame.plane.normal) > 0.0;
    let mut ring = face.corners.clone();
    if !along {
        ring.reverse();
    }
    let (emits, material, sides) = (face.emits, face.material.0, 1 + u32::from(face.two_sided));
    (0..sides).filter(move |&side| (along == (side == 0)) != reversed).map(move |side| Sheet {
        face: index as u32,
        side,
        ring: ring.clone(),
        material,
        rank: (!emits, side, index as u32),
    })
}

/// Faces grouped by plane: two that are coplanar and whose boxes touch belong together, and so do chains of them as far
/// as they lie in the plane of the largest.
fn coplanar_groups(faces: &[Face], corners: &[Vec<DVec3>], tolerance: f64) -> Vec<Vec<usize>> {
    let margin = DVec3::splat(tolerance);
    let boxes: Vec<(DVec3, DVec3)> = corners.iter().map(|corners| bounds(corners)).collect();
    let mut group: Vec<usize> = (0..faces.len()).collect();
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&i, &j| boxes[i].0.x.total_cmp(&boxes[j].0.x).then(i.cmp(&j)));
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            // Sorted by lower x: all later boxes begin beyond this one.
            if boxes[j].0.x > boxes[i].1.x + margin.x {
                break;
            }
            let touch =
                boxes[i].0.cmple(boxes[j].1 + margin).all() && boxes[j].0.cmple(boxes[i].1 + margin).all();
            if touch && coplanar(&faces[i], &corners[i], &faces[j], &corners[j]) {
                let (a, b) = (root(&mut group, i), root(&mut group, j));
                group[a.max(b)] = a.min(b);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); faces.len()];
    for face in 0..faces.len() {
        let root = root(&mut group, face);
        groups[root].push(face);
    }
    // A sliver may lie in the planes of two faces that do not lie in each other's: what is in the plane of the largest
    // face stays together, the rest forms groups of its own.
    let mut flat: Vec<Vec<usize>> = Vec::new();
    for mut group in groups.into_iter().filter(|group| !group.is_empty()) {
        while let Some(reference) = largest(&group, corners) {
            let lies = |&face: &usize| {
                face == reference
                    || coplanar(&faces[face], &corners[face], &faces[reference], &corners[reference])
            };
            let (within, rest): (Vec<usize>, Vec<usize>) = group.into_iter().partition(lies);
            flat.push(within);
            group = rest;
        }
    }
    flat.sort_by_key(|group| group[0]);
    flat
}

/// The largest face of a group; the first of (nearly) equal ones, so that rounding does not choose.
fn largest(group: &[usize], corners: &[Vec<DVec3>]) -> Option<usize> {
    let mut largest = *group.first()?;
    for &face in group {
        if polygon::area(&corners[face]) > 1.000001 * polygon::area(&corners[largest]) {
            largest = face;
        }
    }
    Some(largest)
}

/// Whether the smaller face lies in the plane of the larger one, looking either way.
fn coplanar(a: &Face, corners_a: &[DVec3], b: &Face, corners_b: &[DVec3]) -> bool {
    let (size_a, size_b) = (polygon::diameter(corners_a), polygon::diameter(corners_b));
    let (plane, small) = if size_a >= size_b { (&a.plane, corners_b) } else { (&b.plane, corners_a) };
    let tolerance = PLANARITY * (size_a + size_b);
    let parallel = a.plane.normal.cross(b.plane.normal).length() <= SAME_DIRECTION;
    parallel && small.iter().all(|&corner| plane.distance(corner).abs() <= tolerance)
}

/// Lower and upper corner of the bounding box.
pub fn bounds(corners: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
    corners.iter().fold(start, |(low, high), &p| (low.min(p), high.max(p)))
}

/// Representative of a set, with path halving.
pub fn root(parent: &mut [usize], mut node: usize) -> usize {
    while parent[node] != node {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    node
}
