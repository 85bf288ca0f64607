//! Which face a probe point lies on. Points computed elsewhere carry about 7 digits, so they lie off their face by rounding,
//! before or behind it, and on a border perhaps beyond it.

use crate::convex::{depth, nearest_on_border};
use crate::lit_scene::LitScene;
use crate::receiver::{INWARD, Receiver, limit_from_inside};
use geometry::plane::Plane;
use geometry::polygon;
use geometry::ray_cast::RayCaster;
use glam::DVec3;
use interchange::ids::FaceId;

/// A point this near to a face, as part of the scene's diagonal, lies on it: ten roundings at 7 digits.
const NEAR: f64 = 1e-6;
/// A normal within this angle, radians, of the face's counts as the face's: what 7 digits leave of a unit vector, with room
/// for normals that were interpolated or measured.
const SAME_DIRECTION: f64 = 1e-3;

/// The faces as probe points find them.
#[derive(Debug)]
pub struct Surfaces {
    pieces: Vec<Vec<DVec3>>,
    piece_faces: Vec<FaceId>,
    planes: Vec<Option<Plane>>,
    two_sided: Vec<bool>,
    caster: RayCaster,
    reach: f64,
}

/// A face near enough to the point, of those the one it misses by least.
struct Candidate {
    miss: f64,
    receiver: Receiver,
    on_border: bool,
}

impl Surfaces {
    /// The scene's faces.
    pub fn new(scene: &LitScene) -> Surfaces {
        let mesh = &scene.mesh;
        let faces = || (0..mesh.face_count()).map(FaceId::new);
        let pieces = scene.pieces();
        Surfaces {
            caster: RayCaster::new(&pieces),
            pieces,
            piece_faces: mesh.occluder_faces.clone(),
            planes: faces().map(|face| Plane::of_polygon(&mesh.face_corners(face))).collect(),
            two_sided: faces().map(|face| mesh.is_two_sided(face)).collect(),
            reach: NEAR * scene.diagonal(),
        }
    }

    /// The receiver that a point with a unit normal stands for, and whether it was moved inwards from a border. A point on
    /// a face that looks its way is moved onto the face's plane and takes the face's normal; other points stay as
    /// they are.
    pub fn receiver(&self, point: DVec3, normal: DVec3) -> (Receiver, bool) {
        let mut best: Option<Candidate> = None;
        let mut near = Vec::new();
        self.caster.near(point, self.reach, |piece| near.push(piece));
        // The tree's order is not the user's: of two equally good faces the first one is taken.
        near.sort_unstable();
        for piece in near {
            if let Some(candidate) = self.candidate(piece, point, normal)
                && best.as_ref().is_none_or(|best| candidate.miss < best.miss)
            {
                best = Some(candidate);
            }
        }
        match best {
            Some(best) => (best.receiver, best.on_border),
            None => (Receiver { point, normal, face: None }, false),
        }
    }

    fn candidate(&self, piece: usize, point: DVec3, normal: DVec3) -> Option<Candidate> {
        let face = self.piece_faces[piece];
        let plane = self.planes[face.index()]?;
        let faces_along = plane.normal.dot(normal) > 0.0;
        // Sine of the angle: the cosine would not tell 1e-3 from 0 to more than its half digits.
        let parallel = plane.normal.cross(normal).length() <= SAME_DIRECTION;
        let off_plane = plane.distance(point).abs();
        if !parallel || off_plane > self.reach || !(faces_along || self.two_sided[face.index()]) {
            return None;
        }
        let corners = &self.pieces[piece];
        let foot = plane.project(point);
        let depth = depth(corners, plane.normal, foot);
        let within = if depth >= 0.0 { foot } else { nearest_on_border(corners, foot) };
        let miss = off_plane.max(within.distance(foot));
        if miss > self.reach {
            return None;
        }
        let centroid = polygon::centroid(corners);
        let on_border = depth < INWARD * within.distance(centroid);
        let point = if on_border { limit_from_inside(within, centroid) } else { foot };
        let normal = if faces_along { plane.normal } else { -plane.normal };
        Some(Candidate { miss, on_border, receiver: Receiver { point, normal, face: Some(face.0) } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use interchange::mesh::FACE_TWO_SIDED;

    #[test]
    fn rounded_points_are_moved_onto_their_face() {
        let surfaces = Surfaces::new(&cube(1));
        for off in [0.0, 1e-7, -1e-7, 1.7e-6, -1.7e-6] {
            let (receiver, moved) =
                surfaces.receiver(DVec3::new(0.3, off, 0.6), DVec3::new(5e-4, 1.0, 0.0).normalize());
            assert_eq!((receiver.face, moved), (Some(0), false), "{off}");
            assert!(receiver.point.abs_diff_eq(DVec3::new(0.3, 0.0, 0.6), 1e-15));
            assert_eq!(receiver.normal, DVec3::Y);
        }
    }

    #[test]
    fn other_points_stay_as_they_are() {
        let surfaces = Surfaces::new(&cube(1));
        let up = DVec3::Y;
        for (point, normal) in [
            // Farther than 1e-6 of the diagonal, 1.73e-6, above, below and beside.
            (DVec3::new(0.3, 1.8e-6, 0.6), up),
            (DVec3::new(0.3, -1.8e-6, 0.6), up),
            (DVec3::new(-1.8e-6, 0.0, 0.6), up),
            // Tilted by more than 1e-3, and looking at the face's back.
            (DVec3::new(0.3, 0.0, 0.6), DVec3::new(1.1e-3, 1.0, 0.0).normalize()),
            (DVec3::new(0.3, 0.0, 0.6), -up),
            (DVec3::splat(0.5), up),
        ] {
            assert_eq!(surfaces.receiver(point, normal), (Receiver { point, normal, face: None }, false));
        }
    }

    #[test]
    fn borders_and_corners_take_the_limit_from_inside() {
        let surfaces = Surfaces::new(&cube(1));
        for (x, z) in [(0.0, 0.0), (-1e-6, 0.5), (1.0 + 1e-6, 1.0 + 1e-6), (0.2, 1.0), (1e-7, 0.4)] {
            let (receiver, moved) = surfaces.receiver(DVec3::new(x, 0.0, z), DVec3::Y);
            assert_eq!((receiver.face, moved), (Some(0), true), "{x} {z}");
            let point = receiver.point;
            assert!(point.x > 0.0 && point.x < 1.0 && point.z > 0.0 && point.z < 1.0, "{point}");
            assert!(point.distance(DVec3::new(x, 0.0, z)) < 3e-6);
        }
    }

    #[test]
    fn two_sided_faces_take_points_of_both_sides() {
        for (flags, back) in [(0, None), (FACE_TWO_SIDED, Some(0))] {
            let mut mesh = empty_mesh();
            add_parallelogram(&mut mesh, DVec3::ZERO, DVec3::X, DVec3::Y, 1, flags);
            let surfaces = Surfaces::new(&lit(mesh));
            let (receiver, _) = surfaces.receiver(DVec3::new(0.5, 0.5, 1e-8), -DVec3::Z);
            assert_eq!((receiver.face, receiver.normal), (back, -DVec3::Z));
        }
    }
}
