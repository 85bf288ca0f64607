//! The mesh put together from the patches of all layers: vertices, elements in cluster order, nodes, lines.

use crate::clean::{Cleaned, Face, Member};
use crate::cluster;
use crate::contact::Pieces;
use crate::flat::without_flat;
use crate::frame::contains;
use crate::nodes::{self, Element};
use crate::patch::Patch;
use crate::places::Places;
use crate::sheets::Layer;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::{FaceId, VertexId};
use interchange::mesh::{FACE_EMITS, FACE_TWO_SIDED, Line, Mesh};
use interchange::ragged::Ragged;
use interchange::scene::Scene;
use std::collections::HashMap;

/// Puts the mesh together. With `six_nodes` every edge gets a node in its middle.
///
/// New corners that lie within the weld tolerance of a place become that place, so that walls share the vertices of
/// their common edge. An element that has no area any more after that was thinner than the tolerance: it is left out,
/// counted in the second result, and what lay beyond it meets what is left.
pub fn assemble(
    scene: &Scene,
    cleaned: Cleaned,
    pieces: &Pieces,
    patches: &[(&Layer, Patch)],
    six_nodes: bool,
) -> (Mesh, usize) {
    let Cleaned { mut places, faces } = cleaned;
    let mut hidden_areas = vec![0.0; faces.len()];
    let diagonal = polygon::diameter(places.positions());
    let centre = polygon::mean_corner(places.positions());
    let (mut elements, mut lines, mut flat) = (Vec::new(), Vec::new(), 0);
    for (number, (layer, patch)) in patches.iter().enumerate() {
        let vertices: Vec<u32> =
            patch.points.iter().map(|p| p.place.unwrap_or_else(|| places.insert(p.position))).collect();
        let mut own = Vec::new();
        for element in &patch.elements {
            let sheet = &layer.sheets[element.sheet as usize];
            let mut corners: Vec<u32> = element.corners.iter().map(|&p| vertices[p as usize]).collect();
            let mut seams = element.seams.clone();
            for k in (0..corners.len()).rev() {
                if corners.len() > 1 && corners[k] == corners[(k + 1) % corners.len()] {
                    corners.remove(k);
                    seams.remove(k);
                }
            }
            let surface = (number as u32, sheet.material);
            let element = Element { corners, seams, face: sheet.face, side: sheet.side, surface };
            own.extend(convex_parts(element, &places, layer.frame.plane.normal));
        }
        let area = |ring: &[u32]| polygon::vector_area(&places.corners(ring)).dot(layer.frame.plane.normal);
        let mut with_area = without_flat(own, area, |place| places.position(place));
        flat += with_area.flat;
        if layer.reversed {
            for Element { corners, seams, .. } in &mut with_area.elements {
                // The edge after the last corner stays the last one.
                corners.reverse();
                let n = seams.len();
                seams[..n - 1].reverse();
            }
        }
        elements.append(&mut with_area.elements);
        for line in &patch.lines {
            let mut open = vec![[line.from, line.to].map(|point| vertices[point as usize])];
            while let Some([from, to]) = open.pop() {
                if let Some(&middle) = with_area.middles.get(&(from.min(to), from.max(to))) {
                    open.extend([[from, middle], [middle, to]]);
                    continue;
                }
                lines.push(Line {
                    from: VertexId(from),
                    to: VertexId(to),
                    face: FaceId(layer.sheets[line.sheet as usize].face),
                    order: line.order,
                    source: FaceId(line.source),
                });
            }
        }
        lines.retain(|line: &Line| line.from != line.to);
        for &(sheet, area) in &patch.hidden {
            hidden_areas[layer.sheets[sheet as usize].face as usize] += area;
        }
    }

    // Number the elements in cluster order.
    let corners: Vec<Vec<DVec3>> = elements.iter().map(|element| places.corners(&element.corners)).collect();
    let (order, clusters) = cluster::order(&corners, centre, diagonal);
    let elements: Vec<Element> = order.iter().map(|&old| elements[old].clone()).collect();

    // Vertices that only cleaned-away corners used would be noise: number those in use, in order of use.
    let mut vertices = Vertices { places: places.positions(), number: HashMap::new(), positions: Vec::new() };
    let face_corners: Ragged<VertexId> =
        faces.iter().map(|face| vertices.of(&face.corners)).collect::<Vec<_>>().into_iter().collect();
    let occluders: Vec<(u32, Vec<VertexId>)> = pieces
        .iter()
        .enumerate()
        .flat_map(|(face, pieces)| pieces.iter().map(move |piece| (face as u32, piece)))
        .map(|(face, piece)| (face, vertices.of(piece)))
        .collect();
    let elements: Vec<Element> = elements
        .into_iter()
        .map(|e| Element { corners: vertices.of(&e.corners).iter().map(|v| v.0).collect(), ..e })
        .collect();
    for line in &mut lines {
        (line.from, line.to) = (vertices.one(line.from.0), vertices.one(line.to.0));
    }
    let inputs = elements.iter().map(|e| input_of(&faces[e.face as usize], e, &vertices, places.positions()));
    let merged = faces.iter().any(|face| !face.members.is_empty());
    let element_inputs = if merged { inputs.collect() } else { Vec::new() };
    if hidden_areas.iter().all(|&area| area == 0.0) {
        hidden_areas.clear();
    }
    let middles = six_nodes.then(|| middles(&elements, &mut vertices.positions));
    let nodes = nodes::number(&elements, middles.as_deref());

    let mesh = Mesh {
        vertices: vertices.positions.iter().map(DVec3::to_array).collect(),
        elements: elements.iter().map(|e| e.corners.iter().copied().map(VertexId).collect()).collect(),
        element_nodes: nodes.of_elements,
        element_faces: elements.iter().map(|e| FaceId(e.face)).collect(),
        element_sides: elements.iter().map(|e| e.side).collect(),
        element_inputs,
        hidden_areas,
        node_vertices: nodes.vertices,
        faces: face_corners,
        face_inputs: faces.iter().map(|face| face.input).collect(),
        face_groups: faces.iter().map(|face| face.group).collect(),
        face_materials: faces.iter().map(|face| face.material).collect(),
        face_flags: faces
            .iter()
            .map(|face| {
                (if face.emits { FACE_EMITS } else { 0 }) | (if face.two_sided { FACE_TWO_SIDED } else { 0 })
            })
            .collect(),
        occluder_faces: occluders.iter().map(|(face, _)| FaceId(*face)).collect(),
        // Faces may overlap in their plane and cross each other: as blockers they do no harm, and the fewer the better.
        occluders: occluders.into_iter().map(|(_, corners)| corners).collect(),
        lines,
        clusters,
        groups: scene.groups.clone(),
        materials: scene.materials.names.clone(),
        input_face_count: scene.faces.len() as u32,
    };
    (mesh, flat)
}

/// A corner may turn this far the wrong way, as a sine: ten times what rounding of the corners (1e-16 of the scene) can do
/// between edges as short as the weld tolerance.
const STRAIGHT: f64 = 1e-6;

/// The element, or, where joining places that are one bent it inwards at a corner, triangles around that corner.
fn convex_parts(element: Element, places: &Places, normal: DVec3) -> Vec<Element> {
    let n = element.corners.len();
    let inward = |&k: &usize| {
        let [a, b, c] = [n - 1, 0, 1].map(|step| places.position(element.corners[(k + step) % n]));
        (b - a).cross(c - b).dot(normal) < -STRAIGHT * a.distance(b) * b.distance(c)
    };
    let Some(k) = (0..n).find(inward).filter(|_| n > 3) else { return vec![element] };
    let part = |j: usize| {
        let ring = [k, (k + j) % n, (k + j + 1) % n];
        let seams =
            [j == 1 && element.seams[k], element.seams[ring[1]], j == n - 2 && element.seams[ring[2]]];
        let corners = ring.map(|corner| element.corners[corner]);
        Element { corners: corners.to_vec(), seams: seams.to_vec(), ..element.clone() }
    };
    (1..n - 1).map(part).collect()
}

/// The scene's face that an element belongs to: of a region the first face that holds its middle.
fn input_of(face: &Face, element: &Element, vertices: &Vertices, places: &[DVec3]) -> u32 {
    if face.members.is_empty() {
        return face.input;
    }
    let corners: Vec<DVec3> = element.corners.iter().map(|&v| vertices.positions[v as usize]).collect();
    let centre = polygon::mean_corner(&corners);
    let (x, y) = face.plane.axes();
    let flat = |p: DVec3| glam::DVec2::new((p - centre).dot(x), (p - centre).dot(y));
    let holds = |member: &&Member| {
        let ring: Vec<glam::DVec2> = member.corners.iter().map(|&p| flat(places[p as usize])).collect();
        contains(&ring, glam::DVec2::ZERO)
    };
    face.members.iter().find(holds).map_or(face.input, |member| member.input)
}

/// Vertices of the mesh, numbered when first used.
struct Vertices<'a> {
    places: &'a [DVec3],
    number: HashMap<u32, VertexId>,
    positions: Vec<DVec3>,
}

impl Vertices<'_> {
    fn one(&mut self, place: u32) -> VertexId {
        *self.number.entry(place).or_insert_with(|| {
            self.positions.push(self.places[place as usize]);
            VertexId::new(self.positions.len() - 1)
        })
    }

    fn of(&mut self, places: &[u32]) -> Vec<VertexId> {
        places.iter().map(|&place| self.one(place)).collect()
    }
}

/// A vertex in the middle of each edge, one for all elements that share the edge.
fn middles(elements: &[Element], positions: &mut Vec<DVec3>) -> Vec<Vec<u32>> {
    let mut known: HashMap<(u32, u32), u32> = HashMap::new();
    elements
        .iter()
        .map(|element| {
            let n = element.corners.len();
            (0..n)
                .map(|k| {
                    let (a, b) = (element.corners[k], element.corners[(k + 1) % n]);
                    *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        positions.push(0.5 * (positions[a as usize] + positions[b as usize]));
                        positions.len() as u32 - 1
                    })
                })
                .collect()
        })
        .collect()
}
