//! Edges and corners of a scene that can throw a shadow's boundary: which faces meet there, and whether they are a
//! silhouette seen from a point.
//!
//! An edge of two faces is no silhouette from where both look at the eye or both away. All other edges are: borders of
//! a sheet, edges of three faces.

use crate::clean::Cleaned;
use crate::orient::ring_edges;
use crate::solids::met_rings;
use geometry::plane::Plane;
use glam::DVec3;
use std::collections::BTreeMap;

/// Two edges that meet at a corner are one straight edge where they turn by less than this, in radians.
const STRAIGHT: f64 = 1e-9;

/// An edge where faces meet.
#[derive(Debug, Clone)]
pub struct Edge {
    /// Its ends, as places.
    pub ends: [u32; 2],
    /// Faces along it.
    pub faces: Vec<u32>,
    /// Whether it is an edge of two faces that run along it in opposite directions.
    pub paired: bool,
}

/// Edges and corners of a scene.
#[derive(Debug)]
pub struct Features {
    /// Edges, by their ends.
    pub edges: Vec<Edge>,
    /// Corners and the edges that end there, by place.
    pub corners: Vec<(u32, Vec<u32>)>,
}

impl Features {
    /// The edges and corners of all faces; seams of a face with itself are none.
    pub fn new(scene: &Cleaned) -> Features {
        let mut uses: BTreeMap<(u32, u32), Vec<(u32, bool)>> = BTreeMap::new();
        for (face, ring) in met_rings(scene).iter().enumerate() {
            for (a, b) in ring_edges(ring).filter(|(a, b)| a != b) {
                let uses = uses.entry((a.min(b), a.max(b))).or_default();
                match uses.iter().position(|&u| u == (face as u32, a > b)) {
                    Some(seam) => drop(uses.remove(seam)),
                    None => uses.push((face as u32, a < b)),
                }
            }
        }
        let mut edges = Vec::new();
        let mut corners: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for ((a, b), uses) in uses.into_iter().filter(|(_, uses)| !uses.is_empty()) {
            let paired = matches!(uses[..], [(_, along), (_, other)] if along != other);
            corners.entry(a).or_default().push(edges.len() as u32);
            corners.entry(b).or_default().push(edges.len() as u32);
            edges.push(Edge { ends: [a, b], faces: uses.into_iter().map(|u| u.0).collect(), paired });
        }
        Features { edges, corners: corners.into_iter().collect() }
    }

    /// Whether an edge is a silhouette for an eye.
    pub fn is_silhouette(&self, edge: u32, eye: DVec3, planes: &[Plane], tolerance: f64) -> bool {
        let edge = &self.edges[edge as usize];
        let side = |face: u32| {
            let distance = planes[face as usize].distance(eye);
            if distance.abs() <= tolerance { 0.0 } else { distance.signum() }
        };
        match edge.faces[..] {
            [face] => side(face) != 0.0,
            [f, g] if edge.paired => side(f) != side(g),
            _ => true,
        }
    }

    /// Whether a corner (by its number in `corners`) may bound what an eye sees: silhouette edges end there and do not
    /// merely run through.
    pub fn is_silhouette_corner(
        &self,
        corner: usize,
        eye: DVec3,
        scene: &Cleaned,
        planes: &[Plane],
        tolerance: f64,
    ) -> bool {
        let (place, edges) = &self.corners[corner];
        let at = scene.places.position(*place);
        let directions: Vec<DVec3> = edges
            .iter()
            .filter(|&&edge| self.is_silhouette(edge, eye, planes, tolerance))
            .map(|&edge| {
                let [a, b] = self.edges[edge as usize].ends;
                (scene.places.position(if a == *place { b } else { a }) - at).normalize_or_zero()
            })
            .collect();
        match directions[..] {
            [] => false,
            [a, b] => a.cross(b).length() > STRAIGHT,
            _ => true,
        }
    }
}
