//! The scene as the matrix sees it: elements in cluster order, occluders, and the cluster tree with what holds for all
//! members of a cluster.

use crate::skips::{Skip, Skips};
use anyhow::Context;
use geometry::body::{Body, bodies};
use geometry::merge::merged_occluders;
use geometry::occluder::Occluder;
use geometry::patch::Patch;
use geometry::plane::{PLANARITY, Plane};
use geometry::polygon::mean_corner;
use geometry::shadow::Set;
use geometry::unoccluded::HEIGHT_ROUNDING;
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
    /// Convex blocking polygons, merged; none where nothing can block.
    pub occluders: Vec<Occluder>,
    /// The convex bodies that they make up.
    pub bodies: Vec<Body>,
    /// Cluster tree; the root is first.
    pub clusters: Vec<Cluster>,
    /// Whether the scene was found to be a convex enclosure seen from inside, where nothing can block.
    pub convex: bool,
}

/// A range of elements with what holds for all of them.
#[derive(Debug)]
pub struct Cluster {
    /// Its place in the tree.
    pub number: usize,
    /// Its elements.
    pub range: Range<usize>,
    /// Its children in the tree; none for a single element.
    pub children: Option<[usize; 2]>,
    /// Whether it is a leaf of the mesh's tree: pairs of those are the blocks of the matrix.
    pub is_block: bool,
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
        let convex = skips.has(Skip::ConvexEnclosure) && is_convex_enclosure(&occluders, &patches);
        if convex {
            occluders.clear();
        }
        let mut bodies = bodies(&occluders);
        seal(&mut bodies, mesh);
        let faces = mesh.element_ids().map(|e: ElementId| mesh.element_face(e).0).collect();
        let clusters = cluster_tree(mesh, &patches);
        Ok(Scene { patches, faces, occluders, bodies, clusters, convex })
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

/// Seals the bodies that have no front inside: those without two-sided faces.
fn seal(bodies: &mut [Body], mesh: &Mesh) {
    let of_two_sided = |k: &usize| mesh.is_two_sided(mesh.occluder_faces[*k]);
    let looking_in: Vec<DVec3> = (0..mesh.occluders.len())
        .filter(of_two_sided)
        .map(|k| mean_corner(&mesh.occluder_corners(k)))
        .collect();
    for body in bodies {
        if !looking_in.iter().any(|&place| body.has_on_surface(place)) {
            body.seal();
        }
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

/// The mesh's tree, whose leaves become blocks of the matrix, continued by halving down to single elements.
fn cluster_tree(mesh: &Mesh, patches: &[Patch]) -> Vec<Cluster> {
    struct Node {
        range: Range<usize>,
        children: Option<[usize; 2]>,
        is_block: bool,
    }
    let mut nodes: Vec<Node> = mesh
        .clusters
        .iter()
        .map(|c| Node {
            range: c.start as usize..c.end as usize,
            children: (!c.is_leaf()).then_some([c.first_child as usize, c.second_child as usize]),
            is_block: c.is_leaf(),
        })
        .collect();
    let mut at = 0;
    while at < nodes.len() {
        let range = nodes[at].range.clone();
        if nodes[at].children.is_none() && range.len() > 1 {
            let middle = range.start + range.len() / 2;
            nodes[at].children = Some([nodes.len(), nodes.len() + 1]);
            for range in [range.start..middle, middle..range.end] {
                nodes.push(Node { range, children: None, is_block: false });
            }
        }
        at += 1;
    }
    let cluster = |(number, node): (usize, Node)| Cluster {
        number,
        ..Cluster::new(node.range, node.children, node.is_block, patches)
    };
    nodes.into_par_iter().enumerate().map(cluster).collect()
}

impl Cluster {
    fn new(range: Range<usize>, children: Option<[usize; 2]>, is_block: bool, patches: &[Patch]) -> Cluster {
        if range.len() == 1 {
            let patch = &patches[range.start];
            let (hull, radius) = (patch.corners.clone(), patch.radius);
            return Cluster { number: 0, range, children, is_block, hull, plane: Some(patch.plane), radius };
        }
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
        Cluster { number: 0, range, children, is_block, hull, plane, radius }
    }

    /// It as a set of points.
    pub fn set(&self) -> Set<'_> {
        Set { corners: &self.hull, radius: self.radius, normal: self.plane.map(|plane| plane.normal) }
    }

    /// Whether all members of both lie in one plane.
    pub fn shares_plane(&self, other: &Cluster) -> bool {
        let (Some(p), Some(q)) = (&self.plane, &other.plane) else { return false };
        let tolerance = PLANARITY * self.radius.max(other.radius);
        let lies_in =
            |hull: &[DVec3], plane: &Plane| hull.iter().all(|&c| plane.distance(c).abs() <= tolerance);
        lies_in(&self.hull, q) && lies_in(&other.hull, p)
    }

    /// Whether all of `other` lies at or behind the plane that all of this cluster looks from.
    pub fn turns_away_from(&self, other: &Cluster) -> bool {
        let tolerance = PLANARITY * self.radius.max(other.radius);
        self.plane.is_some_and(|plane| other.hull.iter().all(|&c| plane.distance(c) <= tolerance))
    }

    /// Whether all of `other` lies at or in front of the plane that all of this cluster looks from.
    pub fn faces(&self, other: &Cluster) -> bool {
        let rounding =
            HEIGHT_ROUNDING * (self.radius + other.radius + (self.hull[0] - other.hull[0]).length());
        self.plane.is_some_and(|plane| other.hull.iter().all(|&c| plane.distance(c) >= -rounding))
    }

    /// Whether the body lies at or behind the plane that all of this cluster looks from.
    pub fn turns_away_from_body(&self, body: &Body) -> bool {
        let tolerance = PLANARITY * body.radius;
        self.plane.is_some_and(|plane| body.corners.iter().all(|&c| plane.distance(c) <= tolerance))
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
