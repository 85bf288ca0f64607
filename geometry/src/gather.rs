//! Irradiance gathering at a point: exact point form factors. Placeholder without occlusion.

use crate::plane::Plane;
use crate::polygon;
use glam::DVec3;

/// Elements seen from a point.
#[derive(Debug)]
pub struct Gatherer {
    elements: Vec<Vec<DVec3>>,
    planes: Vec<Option<Plane>>,
}

/// Memory that one thread reuses from point to point.
#[derive(Debug, Default)]
pub struct Scratch {
    clipped: Vec<DVec3>,
}

impl Gatherer {
    /// Occluders: convex pieces and the face each belongs to; elements: convex polygons and their face.
    pub fn new(
        _occluders: Vec<Vec<DVec3>>,
        _occluder_faces: Vec<u32>,
        elements: Vec<Vec<DVec3>>,
        _element_faces: Vec<u32>,
    ) -> Gatherer {
        let planes = elements.iter().map(|corners| Plane::of_polygon(corners)).collect();
        Gatherer { elements, planes }
    }

    /// Calls `visit(element, F)` for every element with F > 0.
    pub fn factors(
        &self,
        point: DVec3,
        normal: DVec3,
        _on_face: Option<u32>,
        scratch: &mut Scratch,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        let horizon = Plane { normal, origin: point };
        for (i, corners) in self.elements.iter().enumerate() {
            let Some(plane) = self.planes[i] else { continue };
            if plane.distance(point) <= 0.0 {
                continue;
            }
            polygon::clip_to_front(corners, &horizon, &mut scratch.clipped);
            let sum: f64 = polygon::edges(&scratch.clipped)
                .map(|(a, b)| {
                    let (a, b) = (a - point, b - point);
                    let cross = a.cross(b);
                    let length = cross.length();
                    if length > 0.0 { length.atan2(a.dot(b)) * cross.dot(normal) / length } else { 0.0 }
                })
                .sum();
            // Counter-clockwise seen from the point is clockwise about the normal.
            let factor = -sum / std::f64::consts::TAU;
            if factor > 0.0 {
                visit(i, factor);
            }
        }
    }
}
