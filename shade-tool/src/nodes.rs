//! Irradiance at the nodes that a picture needs, gathered at the node instead of averaged from the elements around it; and
//! the linear interpolation between them. Radiosity is B = E + rho H.

use crate::light::{Irradiance, Light, Part};
use crate::lit_scene::LitScene;
use crate::node_places::{NodePlace, NodePlaces, corner_nodes};
use crate::piece::Corner;
use crate::receiver::{Parts, Receiver};
use geometry::gather::Scratch;
use geometry::source_tree::Opening;
use glam::DVec3;
use interchange::ids::{ElementId, NodeId, VertexId};
use rayon::prelude::*;
use std::collections::HashMap;

/// What is known of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Unknown,
    Whole(Parts),
    /// One value per edge of its elements.
    Split,
}

/// An edge of an element, seen from the node at its start.
type NodeEdge = (NodeId, VertexId);

/// Irradiance at the nodes gathered so far.
#[derive(Debug)]
pub struct NodeRadiosity<'a> {
    scene: &'a LitScene,
    light: Light,
    places: NodePlaces<'a>,
    states: Vec<State>,
    /// Values of split nodes. Only looked up, never listed: its order is nobody's.
    on_edges: HashMap<NodeEdge, Parts>,
    /// What was done.
    pub counts: Counts,
}

/// The corners of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// Numbers of the nodes.
    pub ids: [u32; 3],
    /// Places.
    pub points: [DVec3; 3],
    /// Irradiance.
    pub corners: [Corner<Parts>; 3],
}

/// How many nodes were treated how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Gathered once.
    pub whole: usize,
    /// With a value per edge, because their limit depends on direction.
    pub split: usize,
    /// Edges gathered for split nodes.
    pub edges: usize,
    /// Not gathered, because their material reflects nothing: B = E.
    pub black: usize,
    /// Not gathered, because nothing needed them.
    pub unseen: usize,
}

impl<'a> NodeRadiosity<'a> {
    /// No node gathered yet.
    pub fn new(scene: &'a LitScene, opening: Opening) -> NodeRadiosity<'a> {
        let nodes = scene.mesh.node_vertices.len();
        NodeRadiosity {
            scene,
            light: Light::new(scene, opening),
            places: NodePlaces::new(scene),
            states: vec![State::Unknown; nodes],
            on_edges: HashMap::new(),
            counts: Counts { unseen: nodes, ..Counts::default() },
        }
    }

    /// Gathers those corner nodes of the elements that are not known yet. `begin` is told how many points that
    /// takes, `done` is called after each.
    pub fn gather(&mut self, elements: &[ElementId], begin: impl FnOnce(usize), done: impl Fn() + Sync) {
        // Find out which nodes are whole, split or black.
        let mut missing: Vec<NodeId> =
            elements.iter().flat_map(|&element| corner_nodes(self.scene, element)).copied().collect();
        missing.retain(|node| self.states[node.index()] == State::Unknown);
        missing.sort_unstable();
        missing.dedup();
        let places: Vec<Option<NodePlace>> =
            missing.par_iter().map(|&node| self.places.of_node(node)).collect();
        let mut whole: Vec<(NodeId, ElementId, Receiver)> = Vec::new();
        for (&node, place) in missing.iter().zip(&places) {
            self.counts.unseen -= 1;
            let reflecting = place.filter(|p| self.scene.material(p.element).diffuse != [0.0; 3]);
            match (place, reflecting) {
                (_, Some(place)) if place.split => self.states[node.index()] = State::Split,
                (_, Some(place)) => whole.push((node, place.element, place.receiver)),
                (_, None) => {
                    self.states[node.index()] = State::Whole(Parts::default());
                    self.counts.black += 1;
                }
            }
        }
        let split = missing.iter().filter(|node| self.states[node.index()] == State::Split).count();
        let edges = self.missing_edges(elements);

        // Gather.
        begin(whole.len() + edges.len());
        let at = |receivers: &[Receiver]| -> Vec<Parts> {
            let direct = self.light.part_at(Part::Direct, receivers, || {});
            let indirect = self.light.part_at(Part::Indirect, receivers, &done);
            direct.iter().zip(indirect).map(|(&[a, b, c], [d, e, f])| [a, b, c, d, e, f]).collect()
        };
        let receivers = whole.iter().map(|&(.., receiver)| receiver);
        let receivers: Vec<Receiver> =
            receivers.chain(edges.iter().map(|&(.., receiver)| receiver)).collect();
        let mut at_nodes = at(&receivers);
        let mut at_edges = at_nodes.split_off(whole.len());
        // Black surfaces show nothing of it.
        for (irradiance, (_, element, _)) in at_edges.iter_mut().zip(&edges) {
            if !self.reflects(*element) {
                *irradiance = Parts::default();
            }
        }

        // Keep.
        for ((node, ..), irradiance) in whole.iter().zip(at_nodes) {
            self.states[node.index()] = State::Whole(irradiance);
        }
        self.on_edges.extend(edges.iter().map(|(edge, ..)| *edge).zip(at_edges));
        self.counts.whole += whole.len();
        self.counts.split += split;
        self.counts.edges += edges.len();
    }

    /// Irradiance at a receiver on an element, none where the element's material reflects nothing.
    pub fn gathered(&self, element: ElementId, receiver: &Receiver, scratch: &mut Scratch) -> Parts {
        if self.reflects(element) { self.light.irradiance(receiver, scratch) } else { Parts::default() }
    }

    /// One part of it.
    pub fn part(
        &self,
        part: Part,
        element: ElementId,
        receiver: &Receiver,
        scratch: &mut Scratch,
    ) -> Irradiance {
        if self.reflects(element) { self.light.part(part, receiver, scratch) } else { [0.0; 3] }
    }

    /// Radiosity of the element's material under an irradiance: B = E + rho H.
    pub fn radiosity(&self, element: ElementId, irradiance: &Irradiance) -> [f64; 3] {
        let material = self.scene.material(element);
        let exitance = material.exitance();
        std::array::from_fn(|c| exitance[c] + material.diffuse[c] * irradiance[c])
    }

    /// Reflectance of the element's material.
    pub fn reflectance(&self, element: ElementId) -> [f64; 3] {
        self.scene.material(element).diffuse
    }

    /// The sources, for their counters.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// Whether the element's material reflects anything.
    pub fn reflects(&self, element: ElementId) -> bool {
        self.scene.material(element).diffuse != [0.0; 3]
    }

    /// Number of nodes of the mesh.
    pub fn node_count(&self) -> usize {
        self.states.len()
    }

    /// What a triangle with gathered nodes has at its corners; `None` for other polygons.
    pub fn ends(&self, element: ElementId) -> Option<Ends> {
        let (nodes, corners) = self.corners(element);
        let (nodes, vertices) =
            (<[NodeId; 3]>::try_from(nodes).ok()?, <[VertexId; 3]>::try_from(corners).ok()?);
        let value = |k: usize| match self.states[nodes[k].index()] {
            State::Whole(value) => Some(Corner::whole(value)),
            State::Split => {
                let towards = |end: usize| self.on_edges.get(&(nodes[k], vertices[end % 3])).copied();
                Some(Corner { before: towards(k + 2)?, after: towards(k + 1)? })
            }
            State::Unknown => None,
        };
        Some(Ends {
            ids: nodes.map(|node| node.0),
            points: vertices.map(|vertex| self.scene.mesh.position(vertex)),
            corners: [value(0)?, value(1)?, value(2)?],
        })
    }

    /// Edges at split nodes whose value is not known yet. Two elements that share one would get the same; the lower one
    /// is asked.
    fn missing_edges(&self, elements: &[ElementId]) -> Vec<(NodeEdge, ElementId, Receiver)> {
        let mut edges = Vec::new();
        for &element in elements {
            let (nodes, corners) = self.corners(element);
            for (k, &node) in nodes.iter().enumerate() {
                if self.states[node.index()] == State::Split {
                    let [before, after] = beside(k, nodes.len());
                    edges.extend([before, after].map(|end| ((node, corners[end]), element, k, end)));
                }
            }
        }
        edges.retain(|(edge, ..)| !self.on_edges.contains_key(edge));
        edges.sort_unstable();
        edges.dedup_by_key(|(edge, ..)| *edge);
        let receiver =
            |(edge, element, corner, end)| (edge, element, self.places.on_edge(element, corner, end));
        edges.into_iter().map(receiver).collect()
    }

    fn corners(&self, element: ElementId) -> (&'a [NodeId], &'a [VertexId]) {
        (corner_nodes(self.scene, element), self.scene.mesh.elements.row(element.index()))
    }

    /// Irradiance within an element at the point where its corners weigh `weights`; its nodes must have been
    /// gathered.
    ///
    /// The value of a split node is itself interpolated between those on the two edges of the element, as if the corner
    /// were an edge of length zero; so elements agree along the edges they share, and within each the value turns with the
    /// direction from the corner.
    pub fn interpolate(&self, element: ElementId, weights: &[f64]) -> Parts {
        let (nodes, corners) = self.corners(element);
        let mut irradiance = Parts::default();
        let mut add = |weight: f64, value: Parts| {
            for (sum, b) in irradiance.iter_mut().zip(value) {
                *sum += weight * b;
            }
        };
        for (k, &node) in nodes.iter().enumerate() {
            match self.states[node.index()] {
                State::Whole(value) => add(weights[k], value),
                State::Split => {
                    let ends = beside(k, nodes.len());
                    let [before, after] = ends.map(|end| weights[end]);
                    let turned = if before + after > 0.0 { after / (before + after) } else { 0.5 };
                    let [before, after] = ends.map(|end| self.on_edges.get(&(node, corners[end])).copied());
                    add(weights[k] * (1.0 - turned), before.unwrap_or_default());
                    add(weights[k] * turned, after.unwrap_or_default());
                }
                State::Unknown => debug_assert!(false, "node {node:?} was not gathered"),
            }
        }
        irradiance
    }
}

/// Corners before and after corner `k` of `n`.
fn beside(k: usize, n: usize) -> [usize; 2] {
    [(k + n - 1) % n, (k + 1) % n]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::receiver::total;
    use crate::test_scenes::cube;

    fn furnace(n: usize) -> LitScene {
        let mut scene = cube(n);
        scene.radiosity = vec![[1.0, 2.0, 3.0]; scene.mesh.element_count()];
        scene.materials[0].diffuse = [0.5, 0.25, 1.0];
        scene.materials[0].radiance = [0.5 / std::f64::consts::PI, 0.0, 0.0];
        scene
    }

    fn gathered(scene: &LitScene) -> NodeRadiosity<'_> {
        let mut nodes = NodeRadiosity::new(scene, Opening::EXACT);
        let all: Vec<ElementId> = scene.mesh.element_ids().collect();
        nodes.gather(&all, |_| {}, || {});
        nodes
    }

    /// In a closed cube where all radiosity is 1, H = 1 at every node, corners included, and between them.
    #[test]
    fn furnace_has_unit_irradiance_at_every_node() {
        for n in [1, 3] {
            let scene = furnace(n);
            let nodes = gathered(&scene);
            let corner = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
            for element in scene.mesh.element_ids() {
                for weights in [corner(0), corner(1), corner(2), corner(3), [0.4, 0.3, 0.2, 0.1]] {
                    let want = [0.5 + 0.5, 0.25 * 2.0, 3.0];
                    let got = nodes.radiosity(element, &total(&nodes.interpolate(element, &weights)));
                    for (got, want) in got.iter().zip(want) {
                        assert!((got - want).abs() < 1e-9, "{element:?} of {n}: {got}, want {want}");
                    }
                }
            }
            let corners = 24;
            let whole = scene.mesh.node_vertices.len() - corners;
            let want = Counts { whole, split: corners, edges: 2 * corners, black: 0, unseen: 0 };
            assert_eq!(nodes.counts, want);
        }
    }

    /// The wall x = 0 lights the floor of a cube. At the ends of its foot a point that comes along the wall has it on 180
    /// degrees of azimuth, and one that comes perpendicular to it on 90: 1/2 and 1/4 (theory 4.1 case 9).
    #[test]
    fn corner_of_a_room_depends_on_the_direction() {
        let mut scene = furnace(1);
        scene.radiosity = vec![[0.0; 3]; 6];
        scene.radiosity[2] = [1.0; 3];
        scene.materials[0].diffuse = [1.0; 3];
        scene.materials[0].radiance = [0.0; 3];
        let mut nodes = NodeRadiosity::new(&scene, Opening::EXACT);
        let floor = ElementId(0);
        nodes.gather(&[floor], |points| assert_eq!(points, 8), || {});
        // Floor corners in x and z: (0, 0), (0, 1), (1, 1), (1, 0). The far ones see the wall of the unit cube with
        // (1 / 2 pi)(atan 1 - (1 / sqrt 2) atan(1 / sqrt 2)).
        let far = (1f64.atan() - 0.5f64.sqrt() * 0.5f64.sqrt().atan()) / std::f64::consts::TAU;
        let tiny = 1e-12;
        for (weights, want) in [
            ([1.0 - tiny, tiny, 0.0, 0.0], 0.5),
            ([1.0 - tiny, 0.0, 0.0, tiny], 0.25),
            ([1.0 - tiny, tiny / 2.0, 0.0, tiny / 2.0], 0.375),
            ([0.0, 1.0 - tiny, tiny, 0.0], 0.25),
            ([0.0, 0.0, 1.0, 0.0], far),
            ([0.0, 0.0, 0.0, 1.0], far),
        ] {
            let got = total(&nodes.interpolate(floor, &weights))[0];
            // The distance along the edge, 1e-4, with its logarithm.
            assert!((got - want).abs() < 1e-3, "{weights:?}: {got}, want {want}");
        }
        assert_eq!(nodes.counts, Counts { whole: 0, split: 4, edges: 8, black: 0, unseen: 20 });
    }

    /// The floor of a cube as two triangles, which share a diagonal between two corners of the room.
    #[test]
    fn elements_agree_along_an_edge_from_a_split_node() {
        let mut mesh = cube(1).mesh;
        let halves = [[0, 1, 2], [0, 2, 3]];
        let corners: Vec<_> = mesh.elements.rows().map(<[VertexId]>::to_vec).collect();
        let nodes: Vec<_> = mesh.element_nodes.rows().map(<[NodeId]>::to_vec).collect();
        let corners =
            halves.map(|half| half.map(|k| corners[0][k]).to_vec()).into_iter().chain(corners[1..].to_vec());
        let nodes =
            halves.map(|half| half.map(|k| nodes[0][k]).to_vec()).into_iter().chain(nodes[1..].to_vec());
        (mesh.elements, mesh.element_nodes) = (corners.collect(), nodes.collect());
        mesh.element_faces.insert(0, mesh.element_faces[0]);
        mesh.element_sides.push(0);
        let mut scene = crate::test_scenes::lit(mesh);
        scene.radiosity = (0..7).map(|i| [f64::from(i), f64::from(i % 3), 0.0]).collect();
        let nodes = gathered(&scene);
        assert_eq!((nodes.counts.split, nodes.counts.edges), (24, 10 + 5 * 8));
        for t in [1e-9, 0.25, 0.9] {
            let first = nodes.interpolate(ElementId(0), &[1.0 - t, 0.0, t]);
            let second = nodes.interpolate(ElementId(1), &[1.0 - t, t, 0.0]);
            assert_eq!(first, second, "at {t} of the diagonal");
        }
        // Near the corner the diagonal is not what the edges beside it are.
        let beside = total(&nodes.interpolate(ElementId(0), &[1.0 - 1e-9, 1e-9, 0.0]));
        let diagonal = total(&nodes.interpolate(ElementId(0), &[1.0 - 1e-9, 0.0, 1e-9]));
        assert!((beside[0] - diagonal[0]).abs() > 0.1, "{beside:?} and {diagonal:?}");
    }

    #[test]
    fn black_materials_are_not_gathered() {
        let mut scene = furnace(1);
        scene.materials[0].diffuse = [0.0; 3];
        let mut nodes = NodeRadiosity::new(&scene, Opening::EXACT);
        nodes.gather(&[ElementId(3), ElementId(3)], |points| assert_eq!(points, 0), || {});
        nodes.gather(&[ElementId(3)], |points| assert_eq!(points, 0), || {});
        assert_eq!(nodes.counts, Counts { black: 4, unseen: 20, ..Counts::default() });
        let dark = nodes.interpolate(ElementId(3), &[0.25; 4]);
        assert_eq!(nodes.radiosity(ElementId(3), &total(&dark)), [0.5, 0.0, 0.0]);
    }
}
