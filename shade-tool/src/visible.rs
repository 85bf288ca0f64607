//! What a sample of the picture sees.

use crate::camera::Camera;
use crate::face_elements::FaceElements;
use crate::lit_scene::LitScene;
use geometry::ray_cast::RayCaster;
use glam::DVec2;
use interchange::ids::{ElementId, FaceId};

/// What lies behind a place of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// Nothing.
    Background,
    /// The black back of a one-sided face.
    Back,
    /// An element, at a place in its face's plane.
    Surface(ElementId, DVec2),
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
        let mesh = &scene.mesh;
        VisibleSurface {
            caster: RayCaster::new(&scene.pieces()),
            piece_faces: mesh.occluder_faces.clone(),
            two_sided: (0..mesh.face_count()).map(|face| mesh.is_two_sided(FaceId::new(face))).collect(),
            elements: FaceElements::new(mesh),
        }
    }

    /// What the camera sees at the place `x`, `y` of the picture, in pixels.
    pub fn seen(&self, camera: &Camera, x: f64, y: f64) -> Seen {
        let direction = camera.direction(x, y);
        let drawn = |piece: usize, front: bool| {
            front || !camera.framing || self.two_sided[self.piece_faces[piece].index()]
        };
        let Some(hit) = self.caster.closest_where(camera.eye, direction, drawn) else {
            return Seen::Background;
        };
        let face = self.piece_faces[hit.piece];
        if !hit.front && !self.two_sided[face.index()] {
            return Seen::Back;
        }
        let point = camera.eye + hit.distance * direction;
        let element = self.elements.at(face, usize::from(!hit.front), point);
        element.map_or(Seen::Back, |(element, place)| Seen::Surface(element, place))
    }

    /// Corners of an element in the plane of the places that are seen.
    pub fn corners(&self, element: ElementId) -> &[DVec2] {
        self.elements.corners(element)
    }
}
