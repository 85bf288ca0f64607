//! The scene as the matrix sees it: elements in cluster order, occluders, and the cluster tree with what holds for all
//! members of a cluster.

use crate::skips::{Skip, Skips};
use anyhow::Context;
use geometry::merge::merged_occluders;
use geometry::occluder::Occluder;
use geometry::patch::Patch;
use geometry::plane::{PLANARITY, Plane};
use geometry::sides::SideBits;
use glam::DVec3;
use interchange::ids::ElementId;
use interchange::mesh::Mesh;
use rayon::prelude::*;
use std::ops::Range;

/// A mesh prepared for form factors.
#[derive(Debug)]
pub struct Scene {
    /// Elements, in cluster order.
    pub patches: Vec<Patch>,
    /// Face of each element.
    pub faces: Vec<u32>,
    /// Side facts of each element against each occluder.
    pub sides: Vec<SideBits>,
    /// Convex blocking polygons, merged; none where nothing can block.
    pub occluders: Vec<Occluder>,
    /// Cluster tree; the root is first.
    pub clusters: Vec<Cluster>,
    /// Whether the scene is a convex enclosure seen from inside.
    pub convex: bool,
}

/// A range of elements with what holds for all of them.
#[derive(Debug)]
pub struct Cluster {
    /// Its elements.
    pub range: Range<usize>,
    /// Its children in the tree; none for a leaf.
    pub children: Option<[usize; 2]>,
    /// Side facts all of them share.
    pub sides: SideBits,
    /// Points whose convex hull holds all elements: the corners of a rectangle in their plane, or of their bounding box.
    pub hull: Vec<DVec3>,
    /// Plane all elements lie in and look from, where there is one.
    pub plane: Option<Plane>,
    /// Largest distance of a hull point from the hull's mean.
    pub radius: f64,
}

impl Scene {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// An element without area: a mesh that mesh-tool would not write.
    pub fn new(mesh: &Mesh, skips: &Skips) -> anyhow::Result<Scene> {
        let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
        let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
        let mut occluders = merged_occluders(pieces, &positions);
        let patches = mesh
            .element_ids()
            .map(|e| {
                Patch::new(mesh.element_corners(e))
                    .with_context(|| format!("element {} has no area: rebuild the mesh", e.0))
            })
            .collect::<anyhow::Result<Vec<Patch>>>()?;
        let convex = is_convex_enclosure(&occluders, &patches);
        if convex && skips.has(Skip::ConvexEnclosure) {
            occluders.clear();
        }
        let sides: Vec<SideBits> = patches
            .par_iter()
            .map(|p| SideBits::of_patch(&p.corners, &p.plane, p.radius, &occluders))
            .collect();
        let faces = mesh.element_ids().map(|e: ElementId| mesh.element_face(e).0).collect();
        let clusters = mesh
            .clusters
            .iter()
            .map(|c| {
                let range = c.start as usize..c.end as usize;
                let children = (!c.is_leaf()).then_some([c.first_child as usize, c.second_child as usize]);
                Cluster::new(range, children, &patches, &sides)
            })
            .collect();
        Ok(Scene { patches, faces, sides, occluders, clusters, convex })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.patches.len()
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }
}

/// Whether all elements lie on one side of every occluder's plane: then no segment between two of them crosses any.
fn is_convex_enclosure(occluders: &[Occluder], patches: &[Patch]) -> bool {
    occluders.par_iter().all(|occluder| {
        let tolerance = PLANARITY * occluder.radius;
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for &corner in patches.iter().flat_map(|p| &p.corners) {
            let height = occluder.plane.distance(corner);
            (low, high) = (low.min(height), high.max(height));
            if low < -tolerance && high > tolerance {
                return false;
            }
        }
        true
    })
}

impl Cluster {
    fn new(
        range: Range<usize>,
        children: Option<[usize; 2]>,
        patches: &[Patch],
        sides: &[SideBits],
    ) -> Cluster {
        let common = range.clone().skip(1).fold(sides[range.start].clone(), |all, i| all.common(&sides[i]));
        let corners = || range.clone().flat_map(|i| patches[i].corners.iter().copied());
        let first = patches[range.start].plane;
        let extent = corners().map(|c| (c - first.origin).length()).fold(0.0, f64::max);
        let flat = range.clone().all(|i| patches[i].plane.normal.dot(first.normal) > 0.0)
            && corners().all(|c| first.distance(c).abs() <= PLANARITY * extent);
        let plane = flat.then_some(first);
        let hull = match plane {
            Some(plane) => rectangle_around(&plane, &patches[range.start], corners()),
            None => box_around(corners()),
        };
        let middle = hull.iter().sum::<DVec3>() / hull.len() as f64;
        let radius = hull.iter().map(|&c| (c - middle).length()).fold(0.0, f64::max);
        Cluster { range, children, sides: common, hull, plane, radius }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.range.len()
    }

    /// Whether it has no elements: never, in a valid mesh.
    pub fn is_empty(&self) -> bool {
        self.range.is_empty()
    }
}

fn box_around(points: impl Iterator<Item = DVec3>) -> Vec<DVec3> {
    let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = points.fold(ends, |(low, high), c| (low.min(c), high.max(c)));
    let pick = |k: usize, bit: usize| if k >> bit & 1 == 0 { low[bit] } else { high[bit] };
    (0..8).map(|k| DVec3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect()
}

/// The smallest rectangle along the first edge of `patch` around points of its plane.
fn rectangle_around(plane: &Plane, patch: &Patch, points: impl Iterator<Item = DVec3>) -> Vec<DVec3> {
    let along = patch.corners[1] - patch.corners[0];
    let x = (along - along.dot(plane.normal) * plane.normal).normalize_or(plane.axes().0);
    let y = plane.normal.cross(x);
    let place = |p: DVec3| ((p - plane.origin).dot(x), (p - plane.origin).dot(y));
    let start = (f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY);
    let (x0, x1, y0, y1) = points
        .map(place)
        .fold(start, |(x0, x1, y0, y1), (u, v)| (x0.min(u), x1.max(u), y0.min(v), y1.max(v)));
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(u, v)| plane.origin + u * x + v * y).to_vec()
}
