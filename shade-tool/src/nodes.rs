//! Radiosity at the nodes that a picture needs: B = E + rho H, with H gathered exactly at the node instead of
//! averaged from the elements around it.

use crate::lit_scene::LitScene;
use crate::receiver::{INWARD, Light, Receiver, limit_from_inside};
use geometry::gather::Scratch;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::{ElementId, NodeId, VertexId};
use interchange::ragged::Ragged;
use rayon::prelude::*;

/// Elements surround a node when what is left of the sum of their sectors' unit vectors is below this: rounding leaves
/// 1e-15, and a sector of 359 degrees 2 sin(179.5 degrees) = 0.017.
const SURROUNDED: f64 = 1e-6;

/// Radiosity of the nodes gathered so far.
#[derive(Debug)]
pub struct NodeRadiosity<'a> {
    scene: &'a LitScene,
    light: Light<'a>,
    /// Elements that have the node as a corner.
    elements: Ragged<u32>,
    radiosity: Vec<Option<[f64; 3]>>,
    /// Nodes gathered.
    pub gathered: usize,
    /// Nodes whose material reflects nothing, so that B = E without gathering.
    pub black: usize,
}

impl<'a> NodeRadiosity<'a> {
    /// No node gathered yet.
    pub fn new(scene: &'a LitScene) -> NodeRadiosity<'a> {
        NodeRadiosity {
            scene,
            light: Light::new(scene),
            elements: elements_of_nodes(scene),
            radiosity: vec![None; scene.mesh.node_vertices.len()],
            gathered: 0,
            black: 0,
        }
    }

    /// Corner nodes of an element, in the order of its corners.
    pub fn of_element(&self, element: ElementId) -> &'a [NodeId] {
        corner_nodes(self.scene, element)
    }

    /// Gathers those of the nodes that are not known yet; `done` is called after each.
    pub fn gather(&mut self, wanted: &[NodeId], done: impl Fn() + Sync) {
        let mut missing: Vec<NodeId> =
            wanted.iter().copied().filter(|node| self.radiosity[node.index()].is_none()).collect();
        missing.sort_unstable();
        missing.dedup();
        let (scene, light, elements) = (self.scene, &self.light, &self.elements);
        let values: Vec<([f64; 3], bool)> = missing
            .par_iter()
            .map_init(Scratch::default, |scratch, &node| {
                let value = node_radiosity(scene, light, elements.row(node.index()), node, scratch);
                done();
                value
            })
            .collect();
        for (node, (radiosity, was_gathered)) in missing.iter().zip(values) {
            self.radiosity[node.index()] = Some(radiosity);
            *(if was_gathered { &mut self.gathered } else { &mut self.black }) += 1;
        }
    }

    /// Radiosity of a node, RGB, W m^-2; zero where it was not gathered.
    pub fn value(&self, node: NodeId) -> [f64; 3] {
        debug_assert!(self.radiosity[node.index()].is_some(), "node {node:?} was not gathered");
        self.radiosity[node.index()].unwrap_or_default()
    }

    /// Number of nodes that nothing needed.
    pub fn skipped(&self) -> usize {
        self.radiosity.len() - self.gathered - self.black
    }
}

fn corner_nodes(scene: &LitScene, element: ElementId) -> &[NodeId] {
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

/// Radiosity of a node, and whether light had to be gathered for it.
fn node_radiosity(
    scene: &LitScene,
    light: &Light,
    elements: &[u32],
    node: NodeId,
    scratch: &mut Scratch,
) -> ([f64; 3], bool) {
    let Some((element, receiver)) = node_receiver(scene, elements, node) else { return ([0.0; 3], false) };
    let material = scene.material(element);
    if material.diffuse == [0.0; 3] {
        return (material.exitance(), false);
    }
    let irradiance = light.irradiance(&receiver, scratch);
    let exitance = material.exitance();
    let radiosity = std::array::from_fn(|c| exitance[c] + material.diffuse[c] * irradiance[c]);
    (radiosity, true)
}

/// Where a node receives: just inside its elements, for on a contact only the limit from there exists.
///
/// At a corner where walls meet, that limit depends on the direction of approach. The node stands for all of them, so it
/// is approached along the middle of the sector that its elements fill. Where they surround it, any direction serves, and
/// the largest element gives it: a thin one may be all within reach of rounding.
fn node_receiver(scene: &LitScene, elements: &[u32], node: NodeId) -> Option<(ElementId, Receiver)> {
    let place = scene.mesh.node_vertices[node.index()];
    let vertex = scene.mesh.position(place);
    let mut largest = (0.0, ElementId(0), DVec3::ZERO);
    let (mut turn, mut nearest) = (DVec3::ZERO, f64::INFINITY);
    for element in elements.iter().map(|&element| ElementId(element)) {
        let corners = scene.mesh.element_corners(element);
        let (vector_area, centroid) = (polygon::vector_area(&corners), polygon::centroid(&corners));
        if vector_area.length() > largest.0 {
            largest = (vector_area.length(), element, centroid);
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
    let open = middle.length() > SURROUNDED && elements.iter().any(is_within);
    let point = if open { along_middle } else { limit_from_inside(vertex, centroid) };
    Some((element, Receiver { point, normal, face: Some(scene.mesh.element_face(element).0) }))
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
    use crate::test_scenes::cube;

    fn furnace(n: usize) -> LitScene {
        let mut scene = cube(n);
        scene.radiosity = vec![[1.0, 2.0, 3.0]; scene.mesh.element_count()];
        scene.materials[0].diffuse = [0.5, 0.25, 1.0];
        scene.materials[0].radiance = [0.5 / std::f64::consts::PI, 0.0, 0.0];
        scene
    }

    /// In a closed cube where all radiosity is 1, H = 1 at every node, corners included.
    #[test]
    fn furnace_has_unit_irradiance_at_every_node() {
        for n in [1, 3] {
            let scene = furnace(n);
            let mut nodes = NodeRadiosity::new(&scene);
            let all: Vec<NodeId> = (0..scene.mesh.node_vertices.len()).map(NodeId::new).collect();
            nodes.gather(&all, || {});
            for &node in &all {
                let want = [0.5 + 0.5, 0.25 * 2.0, 3.0];
                for (got, want) in nodes.value(node).iter().zip(want) {
                    assert!((got - want).abs() < 1e-9, "node {node:?} of {n}: {got}, want {want}");
                }
            }
            assert_eq!((nodes.gathered, nodes.black, nodes.skipped()), (all.len(), 0, 0));
        }
    }

    /// In the corner of a box an adjoining wall fills 180 degrees of azimuth for a point approaching along the wall, 90 for
    /// one along the other wall, and 135 for one along the diagonal: H = 3/8 of its radiosity.
    #[test]
    fn corner_node_is_approached_along_the_diagonal() {
        let mut scene = furnace(1);
        let light =
            (0..6).find(|&e| scene.mesh.element_corners(ElementId(e)).iter().all(|p| p.x == 0.0)).unwrap();
        scene.radiosity = vec![[0.0; 3]; 6];
        scene.radiosity[light as usize] = [1.0; 3];
        scene.materials[0].diffuse = [1.0; 3];
        scene.materials[0].radiance = [0.0; 3];
        let floor =
            (0..6).find(|&e| scene.mesh.element_corners(ElementId(e)).iter().all(|p| p.y == 0.0)).unwrap();
        let mut nodes = NodeRadiosity::new(&scene);
        let floor_nodes = nodes.of_element(ElementId(floor));
        nodes.gather(floor_nodes, || {});
        for &node in floor_nodes {
            let x = scene.mesh.position(scene.mesh.node_vertices[node.index()]).x;
            let got = nodes.value(node)[0];
            // At the far corners the wall of the unit cube subtends (1/2 pi)(atan 1 - (1/sqrt 2) atan (1/sqrt 2)).
            let far = (1f64.atan() - 0.5f64.sqrt() * 0.5f64.sqrt().atan()) / std::f64::consts::TAU;
            let want = if x == 0.0 { 0.375 } else { far };
            assert!((got - want).abs() < 1e-5, "x = {x}: {got}, want {want}");
        }
        assert_eq!(nodes.skipped(), 20);
    }

    #[test]
    fn black_materials_are_not_gathered() {
        let mut scene = furnace(1);
        scene.materials[0].diffuse = [0.0; 3];
        let mut nodes = NodeRadiosity::new(&scene);
        nodes.gather(&[NodeId(0), NodeId(3), NodeId(0)], || {});
        assert_eq!((nodes.gathered, nodes.black, nodes.skipped()), (0, 2, 22));
        assert_eq!(nodes.value(NodeId(3)), [0.5, 0.0, 0.0]);
    }
}
