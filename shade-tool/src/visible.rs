//! What a sample of the picture sees.

use crate::camera::Camera;
use crate::face_elements::FaceElements;
use crate::lit_scene::LitScene;
use geometry::plane::Plane;
use geometry::ray_cast::RayCaster;
use glam::{DVec2, DVec3};
use interchange::ids::{ElementId, FaceId};
use interchange::mesh::Mesh;
use std::collections::BTreeMap;

/// What lies behind a place of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// Nothing.
    Background,
    /// The black back of a one-sided face.
    Back,
    /// An element, at a place in its face's plane, at a depth along the view.
    Surface(ElementId, DVec2, f64),
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Met {
    /// Nothing.
    Background,
    /// The black back of a one-sided face.
    Back,
    /// A side of a face.
    Face(Point),
}

/// A point on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The face.
    pub face: FaceId,
    /// Its front (0) or its back (1).
    pub side: usize,
    /// Where.
    pub point: DVec3,
    /// At which depth along the view.
    pub depth: f64,
}

/// The scene as rays see it.
#[derive(Debug)]
pub struct VisibleSurface {
    caster: RayCaster,
    piece_faces: Vec<FaceId>,
    two_sided: Vec<bool>,
    /// Whether each face emits.
    emitting: Vec<bool>,
    elements: FaceElements,
    /// Number of each face's surface.
    surfaces: Vec<u32>,
}

/// Planes whose normals, or distances from the origin over the scene's size, differ by less than about this are one. Rounding may put two
/// parts of one plane on both sides of a step: that costs samples, not truth.
const ONE_PLANE: f64 = 1e-6;

/// Numbers of the surfaces that the faces belong to: faces in one plane and of one material are one.
fn surfaces(mesh: &Mesh) -> Vec<u32> {
    let size = mesh.faces.values().iter().map(|&v| mesh.position(v).abs().max_element()).fold(0.0, f64::max);
    let mut known = BTreeMap::new();
    let faces = (0..mesh.face_count()).map(FaceId::new);
    let number = |face: FaceId| {
        let next = known.len() as u32;
        let steps = |x: f64| (x / ONE_PLANE).round() as i64;
        // A face without a plane has no elements, and is its own surface.
        let key = match Plane::of_polygon(&mesh.face_corners(face)) {
            Some(plane) => {
                let offset = plane.normal.dot(plane.origin) / size;
                let [x, y, z] = plane.normal.to_array().map(steps);
                (mesh.face_materials[face.index()].0, [x, y, z, steps(offset)])
            }
            None => (u32::MAX, [face.index() as i64, 0, 0, 0]),
        };
        *known.entry(key).or_insert(next)
    };
    faces.map(number).collect()
}

impl VisibleSurface {
    /// Rays meet the faces' convex pieces, not the elements, which are many more.
    pub fn new(scene: &LitScene) -> VisibleSurface {
        let mut surface = VisibleSurface::of_mesh(&scene.mesh);
        for element in scene.mesh.element_ids().filter(|&element| scene.material(element).emits()) {
            surface.emitting[scene.mesh.element_face(element).index()] = true;
        }
        surface
    }

    /// As [`VisibleSurface::new`], for a mesh without light.
    pub fn of_mesh(mesh: &Mesh) -> VisibleSurface {
        let pieces: Vec<_> = (0..mesh.occluders.len()).map(|piece| mesh.occluder_corners(piece)).collect();
        VisibleSurface {
            caster: RayCaster::new(&pieces),
            piece_faces: mesh.occluder_faces.clone(),
            two_sided: (0..mesh.face_count()).map(|face| mesh.is_two_sided(FaceId::new(face))).collect(),
            emitting: vec![false; mesh.face_count()],
            elements: FaceElements::new(mesh),
            surfaces: surfaces(mesh),
        }
    }

    /// Whether it is a face that emits.
    pub fn emits(&self, met: &Met) -> bool {
        matches!(met, Met::Face(point) if self.emitting[point.face.index()])
    }

    /// What the ray through the place `x`, `y` of the picture meets, in pixels.
    pub fn met(&self, camera: &Camera, [x, y]: [f64; 2]) -> Met {
        let (origin, direction) = camera.ray(x, y);
        let drawn = |piece: usize, front: bool| {
            front || !camera.framing || self.two_sided[self.piece_faces[piece].index()]
        };
        let Some(hit) = self.caster.closest_where(origin, direction, drawn) else {
            return Met::Background;
        };
        let face = self.piece_faces[hit.piece];
        if !hit.front && !self.two_sided[face.index()] {
            return Met::Back;
        }
        // Directions are such that the distance along them is the depth.
        let (point, depth) = (origin + hit.distance * direction, hit.distance);
        Met::Face(Point { face, side: usize::from(!hit.front), point, depth })
    }

    /// The element that was met.
    pub fn element(&self, met: &Met) -> Seen {
        let met = match met {
            Met::Background => return Seen::Background,
            Met::Back => return Seen::Back,
            Met::Face(met) => met,
        };
        let element = self.elements.at(met.face, met.side, met.point);
        element.map_or(Seen::Back, |(element, place)| Seen::Surface(element, place, met.depth))
    }

    /// What the camera sees at the place `x`, `y` of the picture, in pixels.
    pub fn seen(&self, camera: &Camera, x: f64, y: f64) -> Seen {
        self.element(&self.met(camera, [x, y]))
    }

    /// Whether no border lies between two things that were met: they are in one plane and of one material, or both are nothing.
    pub fn is_one_surface(&self, first: &Met, second: &Met) -> bool {
        match (first, second) {
            (Met::Face(a), Met::Face(b)) => {
                a.side == b.side && self.surfaces[a.face.index()] == self.surfaces[b.face.index()]
            }
            (a, b) => a == b,
        }
    }

    /// Corners of an element in the plane of the places that are seen.
    pub fn corners(&self, element: ElementId) -> &[DVec2] {
        self.elements.corners(element)
    }
}
