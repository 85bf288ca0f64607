//! What a sample of the picture sees.

use crate::camera::Camera;
use crate::face_elements::FaceElements;
use crate::lit_scene::LitScene;
use geometry::ray_cast::RayCaster;
use glam::DVec2;
use interchange::ids::{ElementId, FaceId};
use interchange::mesh::Mesh;

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

/// The scene as rays see it.
#[derive(Debug)]
pub struct VisibleSurface {
    caster: RayCaster,
    piece_faces: Vec<FaceId>,
    two_sided: Vec<bool>,
    elements: FaceElements,
}

impl VisibleSurface {
    /// Rays meet the faces' convex pieces, not the elements, which are many more.
    pub fn new(scene: &LitScene) -> VisibleSurface {
        VisibleSurface::of_mesh(&scene.mesh)
    }

    /// As [`VisibleSurface::new`], for a mesh without light.
    pub fn of_mesh(mesh: &Mesh) -> VisibleSurface {
        let pieces: Vec<_> = (0..mesh.occluders.len()).map(|piece| mesh.occluder_corners(piece)).collect();
        VisibleSurface {
            caster: RayCaster::new(&pieces),
            piece_faces: mesh.occluder_faces.clone(),
            two_sided: (0..mesh.face_count()).map(|face| mesh.is_two_sided(FaceId::new(face))).collect(),
            elements: FaceElements::new(mesh),
        }
    }

    /// What the camera sees at the place `x`, `y` of the picture, in pixels.
    pub fn seen(&self, camera: &Camera, x: f64, y: f64) -> Seen {
        let (origin, direction) = camera.ray(x, y);
        let drawn = |piece: usize, front: bool| {
            front || !camera.framing || self.two_sided[self.piece_faces[piece].index()]
        };
        let Some(hit) = self.caster.closest_where(origin, direction, drawn) else {
            return Seen::Background;
        };
        let face = self.piece_faces[hit.piece];
        if !hit.front && !self.two_sided[face.index()] {
            return Seen::Back;
        }
        let point = origin + hit.distance * direction;
        let element = self.elements.at(face, usize::from(!hit.front), point);
        // Directions are such that the distance along them is the depth.
        element.map_or(Seen::Back, |(element, place)| Seen::Surface(element, place, hit.distance))
    }

    /// Corners of an element in the plane of the places that are seen.
    pub fn corners(&self, element: ElementId) -> &[DVec2] {
        self.elements.corners(element)
    }
}
