//! Where irradiance is gathered for a node: at its vertex, or in the limit towards it from inside its elements.
//!
//! Where something touches a face at a corner, such as the foot of a box or the corner of a room, irradiance has no one
//! limit: at the end of a wall's foot the wall gives a quarter, 3/8 or half of its radiosity to points that come
//! perpendicular to it, diagonally or along it; behind a box's foot it is dark and beside it light. Such a node is *split*: it
//! has one value per edge of its elements, gathered on that edge.

use crate::convex;
use crate::lit_scene::LitScene;
use crate::receiver::{INWARD, Receiver, limit_from_inside};
use geometry::plane::Plane;
use geometry::polygon;
use geometry::ray_cast::RayCaster;
use glam::DVec3;
use interchange::ids::{ElementId, FaceId, NodeId, VertexId};
use interchange::ragged::Ragged;

/// What is left of the sum of the unit vectors of a node's sectors, below which they surround it and above 2 less which
/// they fill a half plane: rounding leaves 1e-15, a sector of 359 degrees 0.017, one of 179 degrees 2 - 8e-5.
const STRAIGHT: f64 = 1e-6;
/// What comes this near to a node, as part of the scene's diagonal, touches it. Generous: a split node costs some more
/// gathering, but is right with or without contact.
const TOUCHING: f64 = 1e-6;
/// The limit along an edge is taken at this part of its length. Irradiance there differs from the limit by about
/// x ln(1 / x) at the relative distance x: 1e-3, a tenth of what interpolation leaves there.
const ALONG: f64 = 1e-4;
/// and aside of the edge by this part of the way to the element's centroid from there, so as to be on the open side of
/// a contact along the edge: a thousandth of a radian, 1.6e-4 of what fills all azimuths.
const ASIDE: f64 = 1e-3;

/// The nodes of a mesh as places to gather at.
#[derive(Debug)]
pub struct NodePlaces<'a> {
    scene: &'a LitScene,
    /// Elements that have the node as a corner.
    elements: Ragged<u32>,
    pieces: Vec<Vec<DVec3>>,
    planes: Vec<Option<Plane>>,
    caster: RayCaster,
    reach: f64,
}

/// How a node receives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodePlace {
    /// One of its elements: they have one face and so one material.
    pub element: ElementId,
    /// Place and direction, the same for all its elements.
    pub receiver: Receiver,
    /// Whether its limit depends on the direction it is approached from.
    pub split: bool,
}

impl<'a> NodePlaces<'a> {
    /// The nodes of the scene's mesh.
    pub fn new(scene: &'a LitScene) -> NodePlaces<'a> {
        let pieces = scene.pieces();
        NodePlaces {
            elements: elements_of_nodes(scene),
            caster: RayCaster::new(&pieces),
            planes: pieces.iter().map(|piece| Plane::of_polygon(piece)).collect(),
            pieces,
            reach: TOUCHING * scene.diagonal(),
            scene,
        }
    }

    /// How a node receives; `None` where no element with area has it as a corner.
    ///
    /// It is approached along the middle of the sector that its elements fill. Where they surround it, any direction
    /// serves, and the largest element gives it: a thin one may be all within reach of rounding.
    pub fn of_node(&self, node: NodeId) -> Option<NodePlace> {
        let (scene, elements) = (self.scene, self.elements.row(node.index()));
        let place = scene.mesh.node_vertices[node.index()];
        let vertex = scene.mesh.position(place);
        let mut largest = (0.0, ElementId(0), DVec3::ZERO);
        let (mut turn, mut nearest) = (DVec3::ZERO, f64::INFINITY);
        for element in elements.iter().map(|&element| ElementId(element)) {
            let corners = scene.mesh.element_corners(element);
            let (area, centroid) = (polygon::area(&corners), polygon::centroid(&corners));
            if area > largest.0 {
                largest = (area, element, centroid);
            }
            nearest = nearest.min(centroid.distance(vertex));
            turn += turn_at(scene, element, place);
        }
        let (area, element, centroid) = largest;
        if area <= 0.0 {
            return None;
        }
        let normal = polygon::vector_area(&scene.mesh.element_corners(element)) / area;
        // The integral of the unit vectors of a sector from a to b is (b - a) x n; sectors side by side telescope.
        let middle = turn.cross(normal);
        let along_middle = vertex + INWARD * nearest * middle.normalize_or_zero();
        let is_within = |&element: &u32| {
            let corners = scene.mesh.element_corners(ElementId(element));
            polygon::edges(&corners).all(|(a, b)| (b - a).cross(along_middle - a).dot(normal) >= 0.0)
        };
        let open = middle.length() > STRAIGHT && elements.iter().any(is_within);
        let point = if open { along_middle } else { limit_from_inside(vertex, centroid) };
        let face = scene.mesh.element_face(element);
        // All directions into a half plane see the same, whatever stands along its border.
        let half_plane = (middle.length() - 2.0).abs() < STRAIGHT;
        let split = !half_plane && self.is_touched(vertex, normal, face);
        Some(NodePlace { element, receiver: Receiver { point, normal, face: Some(face.0) }, split })
    }

    /// The receiver on the edge of `element` from its corner `corner` towards the corner `end` beside it.
    pub fn on_edge(&self, element: ElementId, corner: usize, end: usize) -> Receiver {
        let corners = self.scene.mesh.element_corners(element);
        let vertex = corners[corner];
        let aside = polygon::centroid(&corners) - vertex;
        let point = vertex + ALONG * ((1.0 - ASIDE) * (corners[end] - vertex) + ASIDE * aside);
        let normal = polygon::vector_area(&corners).normalize_or_zero();
        Receiver { point, normal, face: Some(self.scene.mesh.element_face(element).0) }
    }

    /// Whether another face comes to the vertex from in front.
    fn is_touched(&self, vertex: DVec3, normal: DVec3, face: FaceId) -> bool {
        let in_front = Plane { normal, origin: vertex };
        let mut touched = false;
        self.caster.near(vertex, self.reach, |piece| {
            let corners = &self.pieces[piece];
            let rises = || corners.iter().any(|&corner| in_front.distance(corner) > self.reach);
            let touches = |plane| convex::nearest(corners, plane, vertex).distance(vertex) <= self.reach;
            let other = self.scene.piece_face(piece) != face;
            touched |= other && rises() && self.planes[piece].as_ref().is_some_and(touches);
        });
        touched
    }
}

/// Corner nodes of an element, in the order of its corners.
pub fn corner_nodes(scene: &LitScene, element: ElementId) -> &[NodeId] {
    let corners = scene.mesh.elements.row(element.index()).len();
    &scene.mesh.element_nodes.row(element.index())[..corners]
}

/// For each node the elements that have it as a corner, lowest first.
fn elements_of_nodes(scene: &LitScene) -> Ragged<u32> {
    let mut rows = vec![Vec::new(); scene.mesh.node_vertices.len()];
    for element in scene.mesh.element_ids() {
        for node in corner_nodes(scene, element) {
            rows[node.index()].push(element.0);
        }
    }
    rows.into_iter().collect()
}

/// Unit vector from the corner at `place` to the one before it, less that to the one after it.
fn turn_at(scene: &LitScene, element: ElementId, place: VertexId) -> DVec3 {
    let corners = scene.mesh.elements.row(element.index());
    let Some(k) = corners.iter().position(|&corner| corner == place) else { return DVec3::ZERO };
    let at = |k: usize| scene.mesh.position(corners[k % corners.len()]);
    let towards = |k: usize| (at(k) - scene.mesh.position(place)).normalize_or_zero();
    towards(k + corners.len() - 1) - towards(k + 1)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};

    /// In the corners of a room the limit depends on the direction, along its edges and within its walls not.
    #[test]
    fn corners_of_a_room_are_split_and_nothing_else() {
        let scene = cube(3);
        let places = NodePlaces::new(&scene);
        for node in (0..scene.mesh.node_vertices.len()).map(NodeId::new) {
            let vertex = scene.mesh.position(scene.mesh.node_vertices[node.index()]);
            let place = places.of_node(node).unwrap();
            let is_corner = vertex.to_array().iter().all(|&x| x == 0.0 || x == 1.0);
            assert_eq!(place.split, is_corner, "{vertex}");
            let moved = place.receiver.point - vertex;
            assert!(moved.length() < 1e-6 && moved.length() > 1e-8, "{moved}");
            assert!(place.receiver.normal.dot(moved).abs() < 1e-20);
            let inside = place.receiver.point + 1e-3 * place.receiver.normal;
            assert!(inside.min_element() > 0.0 && inside.max_element() < 1.0, "{inside}");
        }
    }

    #[test]
    fn corners_that_nothing_touches_are_whole_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut mesh = empty_mesh();
            add_parallelogram(&mut mesh, DVec3::ZERO, scale * DVec3::Z, scale * DVec3::X, 1, 0);
            // Falls away from the edge z = 0, so it does not rise in front of the floor.
            add_parallelogram(&mut mesh, DVec3::ZERO, scale * DVec3::X, -scale * DVec3::Y, 1, 0);
            let scene = lit(mesh);
            let places = NodePlaces::new(&scene);
            assert!((0..4).all(|node| !places.of_node(NodeId(node)).unwrap().split));
        }
    }

    #[test]
    fn receiver_on_an_edge_is_just_inside_the_element() {
        let scene = cube(1);
        let places = NodePlaces::new(&scene);
        // Element 0 is the floor, with corners (0, 0), (0, 1), (1, 1), (1, 0) in x and z.
        let receiver = places.on_edge(ElementId(0), 0, 1);
        assert!(receiver.point.abs_diff_eq(DVec3::new(5e-8, 0.0, 1e-4 - 5e-8), 1e-15), "{}", receiver.point);
        let receiver = places.on_edge(ElementId(0), 0, 3);
        assert!(receiver.point.abs_diff_eq(DVec3::new(1e-4 - 5e-8, 0.0, 5e-8), 1e-15), "{}", receiver.point);
    }
}
