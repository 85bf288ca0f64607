//! Everything a point sees: exact point form factors to all elements of a scene.

use crate::occluder::Occluder;
use crate::patch::Patch;
use crate::plane::Plane;
use crate::point_factor::point_factor;
use crate::sides::SideBits;
use crate::visible::{self, visible_factor};
use glam::DVec3;

/// A scene prepared for gathering.
#[derive(Debug)]
pub struct Gatherer {
    pub(crate) occluders: Vec<Occluder>,
    /// Elements with area, and their places in the caller's order.
    pub(crate) elements: Vec<(usize, Patch, SideBits)>,
}

/// Working memory of [`Gatherer::factors`].
#[derive(Debug, Default)]
pub struct Scratch {
    pub(crate) visible: visible::Scratch,
    pub(crate) cut: Vec<DVec3>,
    pub(crate) cones: Vec<Option<Cone>>,
    /// Stack of candidate lists of a [`crate::source_tree::SourceTree`].
    pub(crate) candidates: Vec<u32>,
}

/// A body as a point sees it: within `cosine` of `direction`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    pub(crate) direction: DVec3,
    pub(crate) cosine: f64,
    pub(crate) sine: f64,
}

impl Cone {
    /// Cone around a ball; `None` where the point is inside.
    pub(crate) fn around(to_centre: DVec3, radius: f64) -> Option<Cone> {
        let distance = to_centre.length();
        let sine = radius / distance;
        (sine < 1.0).then(|| Cone {
            direction: to_centre / distance,
            cosine: (1.0 - sine * sine).sqrt(),
            sine,
        })
    }

    /// Whether two cones may share a direction: cos of the angle between against cos of the sum of the half angles.
    pub(crate) fn may_meet(&self, other: &Cone) -> bool {
        self.direction.dot(other.direction) >= self.cosine * other.cosine - self.sine * other.sine
    }
}

impl Gatherer {
    /// Prepares `occluders` and convex `elements`, one-sided, front counter-clockwise. Elements without area take no part.
    pub fn new(occluders: Vec<Occluder>, elements: Vec<Vec<DVec3>>) -> Gatherer {
        let prepare = |(index, corners): (usize, Vec<DVec3>)| {
            let patch = Patch::new(corners)?;
            let bits = SideBits::of_patch(&patch.corners, &patch.plane, patch.radius, &occluders);
            Some((index, patch, bits))
        };
        let elements = elements.into_iter().enumerate().filter_map(prepare).collect();
        Gatherer { occluders, elements }
    }

    /// Calls `visit(element, F)` for every element with a form factor F > 0 from `point` on a plane with unit `normal`,
    /// in the elements' order.
    ///
    /// The face the point lies on never blocks it, nor do faces coplanar with it: none of their parts is in front. A
    /// point within rounding of an element's edge takes the limit from the side it is on.
    pub fn factors(
        &self,
        point: DVec3,
        normal: DVec3,
        scratch: &mut Scratch,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        let plane = Plane { normal, origin: point };
        let sides = SideBits::of_point(&plane, &self.occluders);
        let Scratch { visible, cut, cones, .. } = scratch;
        cones.clear();
        cones.extend(self.occluders.iter().map(|o| Cone::around(o.centre - point, o.radius)));

        for (index, element, element_sides) in &self.elements {
            let seen_from_front = element.plane.distance(point) > 0.0;
            if !seen_from_front || element.corners.iter().all(|&c| plane.distance(c) <= 0.0) {
                continue;
            }
            let cone = Cone::around(element.centroid - point, element.radius);
            let may_block = |k: usize| match (&cone, &cones[k]) {
                (Some(cone), Some(blocker)) => cone.may_meet(blocker),
                _ => true,
            };
            let mut blocked = false;
            sides.for_each_candidate(element_sides, self.occluders.len(), |k| blocked |= may_block(k));
            let factor = if blocked {
                let mut blockers: Vec<&Occluder> = Vec::new();
                sides.for_each_candidate(element_sides, self.occluders.len(), |k| {
                    if may_block(k) {
                        blockers.push(&self.occluders[k]);
                    }
                });
                visible_factor(point, normal, &element.corners, &blockers, visible).factor
            } else {
                point_factor(point, normal, &element.corners, cut).max(0.0)
            };
            if factor > 0.0 {
                visit(*index, factor);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_faces(low: f64, high: f64, inward: bool) -> Vec<Vec<DVec3>> {
        let (a, b) = (low, high);
        let faces = [
            [(a, a, a), (b, a, a), (b, b, a), (a, b, a)],
            [(a, b, b), (b, b, b), (b, a, b), (a, a, b)],
            [(a, a, a), (a, b, a), (a, b, b), (a, a, b)],
            [(b, a, b), (b, b, b), (b, b, a), (b, a, a)],
            [(a, a, a), (a, a, b), (b, a, b), (b, a, a)],
            [(b, b, a), (b, b, b), (a, b, b), (a, b, a)],
        ];
        let mut faces: Vec<Vec<DVec3>> =
            faces.iter().map(|f| f.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect()).collect();
        if !inward {
            faces.iter_mut().for_each(|face| face.reverse());
        }
        faces
    }

    /// In a closed room with a box inside, whatever the point sees adds up to everything.
    #[test]
    fn factors_close_in_a_room_with_a_box_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut faces = cube_faces(0.0, scale, true);
            faces.extend(cube_faces(0.25 * scale, 0.75 * scale, false));
            let occluders = faces.iter().cloned().filter_map(Occluder::new).collect();
            let gatherer = Gatherer::new(occluders, faces);
            let mut scratch = Scratch::default();
            for (point, normal) in [
                (DVec3::new(0.3, 0.4, 0.0), DVec3::Z),
                (DVec3::new(0.1, 0.9, 0.0), DVec3::Z),
                (DVec3::new(0.5, 0.5, 0.75), DVec3::Z),
                (DVec3::new(1e-7, 1e-7, 0.0), DVec3::Z),
                (DVec3::new(0.25, 0.5, 0.74999), DVec3::NEG_X),
            ] {
                let mut sum = 0.0;
                gatherer.factors(point * scale, normal, &mut scratch, &mut |_, factor| sum += factor);
                assert!((sum - 1.0).abs() < 1e-12, "{point} at scale {scale}: {sum}");
            }
        }
    }
}
