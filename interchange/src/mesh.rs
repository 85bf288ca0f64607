//! The mesh file: elements (one unknown each), the planar faces that block light, nodes, names and cluster order.

use crate::atomic_write::Outcome;
use crate::container::{File, Kind, Writer, pack_names};
use crate::digest::Digest;
use crate::error::Result;
use crate::ids::{ElementId, FaceId, GroupId, MaterialId, NodeId, VertexId};
use crate::provenance::Provenance;
use crate::ragged::Ragged;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Face flag: the material emits, so the face wins where coplanar faces overlap.
pub const FACE_EMITS: u32 = 1;
/// Face flag: both sides emit, reflect and receive.
pub const FACE_TWO_SIDED: u32 = 2;

/// A line across which radiosity or its derivatives jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Line {
    /// One end.
    pub from: VertexId,
    /// Other end.
    pub to: VertexId,
    /// Face the line lies on.
    pub face: FaceId,
    /// 0 value (contact), 1 slope, 2 curvature.
    pub order: u32,
    /// Face that causes the line: the one in contact, or the emitter.
    pub source: FaceId,
}

/// A range of elements close in space and direction. Cluster 0 is the root; children follow their parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Cluster {
    /// First element.
    pub start: u32,
    /// One past the last element.
    pub end: u32,
    /// Index of the first child, 0 for a leaf; the second child follows the first one's subtree.
    pub first_child: u32,
    /// Index of the second child, 0 for a leaf.
    pub second_child: u32,
}

impl Cluster {
    /// Whether it has no children.
    pub fn is_leaf(&self) -> bool {
        self.first_child == 0
    }
}

/// Elements, faces and names of a scene. Colours and powers are not in it: they belong to the material table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Places, in metres unless the scene says otherwise.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of each element, counter-clockwise seen from its front: convex planar polygons.
    pub elements: Ragged<VertexId>,
    /// Nodes of each element: one per corner; where meshed also one per edge (from corner k to k + 1), after the corners.
    pub element_nodes: Ragged<NodeId>,
    /// Face each element lies on.
    pub element_faces: Vec<FaceId>,
    /// 0: the element looks where its face looks; 1: it is the back of a two-sided face.
    pub element_sides: Vec<u32>,
    /// The scene's face (from 0, in file order) each element belongs to: a region made of several faces gives an element
    /// to the face that holds its middle. Empty where no faces were merged: see [`Mesh::element_input`].
    pub element_inputs: Vec<u32>,
    /// Vertex of each node. Nodes are shared by elements that meet along edges without a value discontinuity: those in
    /// one plane that look the same way and have the same material, be they of one face or of several.
    pub node_vertices: Vec<VertexId>,
    /// Corners of each planar face: simple polygons, counter-clockwise seen from the front. They block light.
    pub faces: Ragged<VertexId>,
    /// The scene's face (from 0, in file order) each planar face is all or part of; the first, where coplanar faces were
    /// merged into one region.
    pub face_inputs: Vec<u32>,
    /// Area of each face, all sides together, that nothing can shine on (under a block) and that therefore has no
    /// elements. It counts in means over faces and groups, with irradiance and radiosity 0. Empty where nothing is hidden.
    pub hidden_areas: Vec<f64>,
    /// Group of each face.
    pub face_groups: Vec<GroupId>,
    /// Material of each face.
    pub face_materials: Vec<MaterialId>,
    /// [`FACE_EMITS`] and [`FACE_TWO_SIDED`].
    pub face_flags: Vec<u32>,
    /// Convex pieces of the faces; together they cover them exactly. What visibility is computed against.
    pub occluders: Ragged<VertexId>,
    /// Face of each convex piece.
    pub occluder_faces: Vec<FaceId>,
    /// Discontinuity lines.
    pub lines: Vec<Line>,
    /// Binary tree over the element order.
    pub clusters: Vec<Cluster>,
    /// Names of the groups, in order of first appearance.
    pub groups: Vec<String>,
    /// Names of the materials, in the order of the material table.
    pub materials: Vec<String>,
    /// Number of faces in the scene, dropped ones included.
    pub input_face_count: u32,
}

/// Counts in the header: what the sections must hold.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Record {
    vertices: u32,
    elements: u32,
    nodes: u32,
    faces: u32,
    occluders: u32,
    groups: u32,
    materials: u32,
    input_faces: u32,
}

impl Mesh {
    /// Number of elements: unknowns, rows of the matrix.
    pub fn element_count(&self) -> usize {
        self.elements.len()
    }

    /// Number of planar faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Position of a vertex.
    pub fn position(&self, vertex: VertexId) -> DVec3 {
        DVec3::from_array(self.vertices[vertex.index()])
    }

    /// Corners of an element.
    pub fn element_corners(&self, element: ElementId) -> Vec<DVec3> {
        self.elements.row(element.index()).iter().map(|&v| self.position(v)).collect()
    }

    /// Corners of a face.
    pub fn face_corners(&self, face: FaceId) -> Vec<DVec3> {
        self.faces.row(face.index()).iter().map(|&v| self.position(v)).collect()
    }

    /// Corners of a convex piece of a face.
    pub fn occluder_corners(&self, occluder: usize) -> Vec<DVec3> {
        self.occluders.row(occluder).iter().map(|&v| self.position(v)).collect()
    }

    /// Face of an element.
    pub fn element_face(&self, element: ElementId) -> FaceId {
        self.element_faces[element.index()]
    }

    /// The scene's face an element belongs to.
    pub fn element_input(&self, element: ElementId) -> u32 {
        let of_face = || self.face_inputs[self.element_face(element).index()];
        self.element_inputs.get(element.index()).copied().unwrap_or_else(of_face)
    }

    /// Material of an element.
    pub fn element_material(&self, element: ElementId) -> MaterialId {
        self.face_materials[self.element_face(element).index()]
    }

    /// Group of an element.
    pub fn element_group(&self, element: ElementId) -> GroupId {
        self.face_groups[self.element_face(element).index()]
    }

    /// Identity of each element: equal in two meshes of a scene where the element has the same corners in the same
    /// order, up to rotation, on a face of the same material. With it and [`Mesh::occluder_identity`] equal, so is
    /// every form factor between two such elements.
    pub fn element_identities(&self) -> Vec<u64> {
        let identity = |element: usize| {
            let bits: Vec<[u64; 3]> = self
                .elements
                .row(element)
                .iter()
                .map(|v| self.vertices[v.index()].map(f64::to_bits))
                .collect();
            let first = (0..bits.len()).min_by_key(|&k| bits[k]).unwrap_or(0);
            let ring = (0..bits.len()).flat_map(|k| bits[(first + k) % bits.len()]);
            let material = self.face_materials[self.element_faces[element].index()].0;
            mixed(ring.chain([u64::from(material)]))
        };
        (0..self.element_count()).map(identity).collect()
    }

    /// Identity of everything that blocks light.
    pub fn occluder_identity(&self) -> u64 {
        let corners = self.occluders.rows().flat_map(|row| {
            let end = [u64::MAX];
            row.iter().flat_map(|v| self.vertices[v.index()].map(f64::to_bits)).chain(end)
        });
        mixed(corners)
    }

    /// Whether both sides of the face take part.
    pub fn is_two_sided(&self, face: FaceId) -> bool {
        self.face_flags[face.index()] & FACE_TWO_SIDED != 0
    }

    /// All elements.
    pub fn element_ids(&self) -> impl Iterator<Item = ElementId> + use<> {
        (0..self.element_count()).map(ElementId::new)
    }

    /// Writes the mesh; an identical file is left alone.
    pub fn write(&self, path: &Path, provenance: Provenance) -> Result<Outcome> {
        let record = Record {
            vertices: self.vertices.len() as u32,
            elements: self.elements.len() as u32,
            nodes: self.node_vertices.len() as u32,
            faces: self.faces.len() as u32,
            occluders: self.occluders.len() as u32,
            groups: self.groups.len() as u32,
            materials: self.materials.len() as u32,
            input_faces: self.input_face_count,
        };
        let (groups, materials) = (pack_names(&self.groups), pack_names(&self.materials));
        let writer = Writer::new(Kind::Mesh)
            .section("vertices", &self.vertices)
            .section("element_starts", self.elements.starts())
            .section("element_corners", self.elements.values())
            .section("element_node_starts", self.element_nodes.starts())
            .section("element_nodes", self.element_nodes.values())
            .section("element_faces", &self.element_faces)
            .section("element_sides", &self.element_sides)
            .section("node_vertices", &self.node_vertices)
            .section("face_starts", self.faces.starts())
            .section("face_corners", self.faces.values())
            .section("face_inputs", &self.face_inputs)
            .section("face_groups", &self.face_groups)
            .section("face_materials", &self.face_materials)
            .section("face_flags", &self.face_flags)
            .section("occluder_starts", self.occluders.starts())
            .section("occluder_corners", self.occluders.values())
            .section("occluder_faces", &self.occluder_faces)
            .section("lines", &self.lines)
            .section("clusters", &self.clusters)
            .section("groups", &groups)
            .section("materials", &materials);
        // What a mesh does not have is not in the file: meshes of faces as given stay as version 1.0 wrote them.
        let writer = if self.element_inputs.is_empty() {
            writer
        } else {
            writer.section("element_inputs", &self.element_inputs)
        };
        let writer = if self.hidden_areas.is_empty() {
            writer
        } else {
            writer.section("hidden_areas", &self.hidden_areas)
        };
        writer.write(path, provenance, record)
    }

    /// Reads and checks a mesh. The digest is what dependent files must name.
    pub fn read(path: &Path) -> Result<(Mesh, Provenance, Digest)> {
        let file = File::<Record>::open(path, Kind::Mesh)?;
        let n = file.record.clone();
        let (elements, faces, occluders) = (n.elements as usize, n.faces as usize, n.occluders as usize);
        let mut mesh = Mesh {
            vertices: file.counted_section::<[f64; 3]>("vertices", n.vertices as usize)?.to_vec(),
            elements: ragged(&file, "element_starts", "element_corners", elements)?,
            element_nodes: ragged(&file, "element_node_starts", "element_nodes", elements)?,
            element_faces: file.counted_section("element_faces", elements)?.to_vec(),
            element_sides: file.counted_section("element_sides", elements)?.to_vec(),
            element_inputs: Vec::new(),
            node_vertices: file.counted_section("node_vertices", n.nodes as usize)?.to_vec(),
            faces: ragged(&file, "face_starts", "face_corners", faces)?,
            face_inputs: file.counted_section("face_inputs", faces)?.to_vec(),
            hidden_areas: Vec::new(),
            face_groups: file.counted_section("face_groups", faces)?.to_vec(),
            face_materials: file.counted_section("face_materials", faces)?.to_vec(),
            face_flags: file.counted_section("face_flags", faces)?.to_vec(),
            occluders: ragged(&file, "occluder_starts", "occluder_corners", occluders)?,
            occluder_faces: file.counted_section("occluder_faces", occluders)?.to_vec(),
            lines: file.section("lines")?.to_vec(),
            clusters: file.section("clusters")?.to_vec(),
            groups: file.names("groups", n.groups as usize)?,
            materials: file.names("materials", n.materials as usize)?,
            input_face_count: n.input_faces,
        };
        // Sections of version 1.1 that a mesh may have.
        if file.has("element_inputs") {
            mesh.element_inputs = file.counted_section("element_inputs", elements)?.to_vec();
        }
        if file.has("hidden_areas") {
            mesh.hidden_areas = file.counted_section("hidden_areas", faces)?.to_vec();
        }
        mesh.check().map_err(|(part, found)| file.damaged(part, found, "the invariants of FORMAT.md"))?;
        let digest = file.digest();
        Ok((mesh, file.provenance, digest))
    }

    /// The invariants every reader may rely on: indices within their arrays, finite places, polygons with three or
    /// more corners, clusters that tile the element order. The error names section and finding.
    fn check(&self) -> std::result::Result<(), (&'static str, String)> {
        if self.elements.is_empty() {
            return Err(("elements", "none".into()));
        }
        if let Some(i) = self.vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            return Err(("vertices", format!("a coordinate of vertex {i} is not finite")));
        }
        let vertices = self.vertices.len();
        for (part, polygons) in [
            ("element_corners", &self.elements),
            ("face_corners", &self.faces),
            ("occluder_corners", &self.occluders),
        ] {
            if let Some(i) = polygons.rows().position(|p| p.len() < 3) {
                return Err((part, format!("polygon {i} has fewer than 3 corners")));
            }
            in_range(part, polygons.values().iter().map(|v| v.0), vertices)?;
        }
        in_range("node_vertices", self.node_vertices.iter().map(|v| v.0), vertices)?;
        in_range("element_nodes", self.element_nodes.values().iter().map(|n| n.0), self.node_vertices.len())?;
        for (i, (corners, nodes)) in self.elements.rows().zip(self.element_nodes.rows()).enumerate() {
            if nodes.len() != corners.len() && nodes.len() != 2 * corners.len() {
                return Err((
                    "element_nodes",
                    format!("element {i}: {} nodes for {} corners", nodes.len(), corners.len()),
                ));
            }
        }
        in_range("element_faces", self.element_faces.iter().map(|f| f.0), self.faces.len())?;
        in_range("element_inputs", self.element_inputs.iter().copied(), self.input_face_count as usize)?;
        if let Some(i) = self.hidden_areas.iter().position(|&area| !(area.is_finite() && area >= 0.0)) {
            return Err(("hidden_areas", format!("{} at {i}", self.hidden_areas[i])));
        }
        in_range("element_sides", self.element_sides.iter().copied(), 2)?;
        in_range("face_groups", self.face_groups.iter().map(|g| g.0), self.groups.len())?;
        in_range("face_materials", self.face_materials.iter().map(|m| m.0), self.materials.len())?;
        in_range("face_inputs", self.face_inputs.iter().copied(), self.input_face_count as usize)?;
        in_range("occluder_faces", self.occluder_faces.iter().map(|f| f.0), self.faces.len())?;
        for line in &self.lines {
            in_range("lines", [line.from.0, line.to.0].into_iter(), vertices)?;
            in_range("lines", [line.face.0, line.source.0].into_iter(), self.faces.len())?;
            in_range("lines", [line.order].into_iter(), 3)?;
        }
        self.check_clusters()
    }

    fn check_clusters(&self) -> std::result::Result<(), (&'static str, String)> {
        let root = self.clusters.first().map(|c| (c.start, c.end));
        if root != Some((0, self.elements.len() as u32)) {
            return Err(("clusters", format!("the root covers {root:?}")));
        }
        for (i, cluster) in self.clusters.iter().enumerate() {
            if cluster.start >= cluster.end {
                return Err(("clusters", format!("cluster {i} is empty")));
            }
            if cluster.is_leaf() {
                continue;
            }
            let child = |k: u32| self.clusters.get(k as usize).filter(|_| k as usize > i);
            let tiled = matches!((child(cluster.first_child), child(cluster.second_child)),
                (Some(a), Some(b)) if a.start == cluster.start && a.end == b.start && b.end == cluster.end);
            if !tiled {
                return Err(("clusters", format!("the children of cluster {i} do not tile it")));
            }
        }
        Ok(())
    }
}

/// A hash of words: FNV-1a over whole words, finished as in SplitMix64.
fn mixed(words: impl Iterator<Item = u64>) -> u64 {
    let sum = words.fold(0xcbf2_9ce4_8422_2325_u64, |hash, word| {
        let hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        hash ^ (hash >> 29)
    });
    let sum = (sum ^ (sum >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let sum = (sum ^ (sum >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    sum ^ (sum >> 31)
}

fn ragged<T: Pod>(file: &File<Record>, starts: &str, values: &str, rows: usize) -> Result<Ragged<T>> {
    let (start, values) = (file.section::<u32>(starts)?.to_vec(), file.section::<T>(values)?.to_vec());
    if start.len() != rows + 1 {
        return Err(file.damaged(starts, format!("{} entries", start.len()), format!("{}", rows + 1)));
    }
    Ragged::from_parts(start, values).map_err(|found| file.damaged(starts, found, "starts that rise from 0"))
}

fn in_range(
    part: &'static str,
    mut values: impl Iterator<Item = u32>,
    limit: usize,
) -> std::result::Result<(), (&'static str, String)> {
    match values.find(|&v| v as usize >= limit) {
        Some(value) => Err((part, format!("{value} where fewer than {limit} exist"))),
        None => Ok(()),
    }
}
