//! What every mesh must satisfy, and scenes from a few lines of text.
#![allow(dead_code, clippy::unwrap_used)]

use geometry::plane::Plane;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::{ElementId, FaceId, VertexId};
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::scene::Scene;
use mesh_tool::{Options, build};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

pub mod soup;

pub fn scene_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenes").join(name)
}

pub fn read(name: &str) -> Scene {
    Scene::read(&scene_path(name), &[]).unwrap()
}

/// A scene from the text of its OBJ, with materials `white`, `grey`, `lamp` (emits) and `both` (two-sided).
pub fn scene_of(obj: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.obj");
    let mtl = "newmtl white\nKd .7 .7 .7\nnewmtl grey\nKd .3 .3 .3\nnewmtl lamp\nKe 1 1 1\nnewmtl both\nKd .5 .5 .5\n";
    std::fs::write(folder.path().join("s.mtl"), mtl).unwrap();
    std::fs::write(&path, format!("mtllib s.mtl\n{obj}")).unwrap();
    let uses_both = obj.contains("usemtl both");
    let two_sided: Vec<String> = uses_both.then(|| "both".to_owned()).into_iter().collect();
    Scene::read(&path, &two_sided).unwrap()
}

pub fn scaled(scene: &Scene, factor: f64) -> Scene {
    let vertices = scene.vertices.iter().map(|v| v.map(|x| x * factor)).collect();
    Scene { vertices, ..scene.clone() }
}

pub fn given() -> Options {
    Options::default()
}

pub fn elements(count: u32) -> Options {
    Options { elements: Some(count), ..Options::default() }
}

pub fn max_edge(length: f64) -> Options {
    Options { max_edge: Some(length), ..Options::default() }
}

pub fn made(scene: &Scene, options: Options) -> (Mesh, Report) {
    let mut report = Report::new("mesh-tool", "test");
    let mesh = build(scene, &options, &mut report).unwrap();
    check(&mesh);
    (mesh, report)
}

pub fn refused(scene: &Scene) -> String {
    build(scene, &given(), &mut Report::new("mesh-tool", "test")).unwrap_err().to_string()
}

/// Sum of the element areas of each face and side.
pub fn areas(mesh: &Mesh) -> HashMap<(FaceId, u32), f64> {
    let mut areas = HashMap::new();
    for element in mesh.element_ids() {
        let key = (mesh.element_face(element), mesh.element_sides[element.index()]);
        *areas.entry(key).or_insert(0.0) += polygon::area(&mesh.element_corners(element));
    }
    areas
}

/// Asserts that the elements of every face cover both or one of its sides exactly, but for what is hidden.
pub fn assert_areas(mesh: &Mesh, tolerance: f64) {
    let areas = areas(mesh);
    for face in (0..mesh.face_count()).map(FaceId::new) {
        let sides = 1 + u32::from(mesh.is_two_sided(face));
        let area = polygon::area(&mesh.face_corners(face)) * f64::from(sides);
        let shown: f64 = (0..sides).filter_map(|side| areas.get(&(face, side))).sum();
        let sum = shown + mesh.hidden_areas.get(face.index()).copied().unwrap_or(0.0);
        assert!((sum - area).abs() <= tolerance * area, "face {face:?}: {sum} against {area}");
    }
}

/// Invariants of every mesh: it survives its own reader; elements look where their face looks, lie in it and are
/// convex; nodes lie on the corners and in the middle of the edges of their elements; pieces cover the faces.
pub fn check(mesh: &Mesh) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.mesh");
    mesh.write(&path, interchange::provenance::Provenance::new("t", "t")).unwrap();
    assert!(&Mesh::read(&path).unwrap().0 == mesh, "the mesh reads back as another");

    let mut piece_area = vec![0.0; mesh.face_count()];
    let mut pieces_of = vec![Vec::new(); mesh.face_count()];
    for piece in 0..mesh.occluders.len() {
        let face = mesh.occluder_faces[piece].index();
        let corners = mesh.occluder_corners(piece);
        let normal = polygon::vector_area(&mesh.face_corners(FaceId::new(face)));
        assert!(polygon::is_convex(&corners, normal.normalize(), 1e-8), "piece {piece} is not convex");
        assert!(polygon::vector_area(&corners).dot(normal) > 0.0);
        // Seen along the normal: a strip of a face that is planar to its tolerance may lie at an angle.
        piece_area[face] += polygon::vector_area(&corners).dot(normal.normalize());
        pieces_of[face].push(corners);
    }
    for face in (0..mesh.face_count()).map(FaceId::new) {
        let (area, size) =
            (polygon::area(&mesh.face_corners(face)), polygon::diameter(&mesh.face_corners(face)));
        // Rounding of the cross products counts for faces much longer than wide.
        let rounding = 8.0 * f64::EPSILON * size * size;
        let difference = piece_area[face.index()] - area;
        assert!(difference.abs() <= 1e-12 * area + rounding, "pieces of {face:?}: {difference:e} of {area}");
    }
    let all: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
    let diagonal = polygon::diameter(&all);
    for element in mesh.element_ids() {
        let (corners, face) = (mesh.element_corners(element), mesh.element_face(element));
        let plane = Plane::of_polygon(&mesh.face_corners(face)).unwrap();
        let outward = if mesh.element_sides[element.index()] == 0 { plane.normal } else { -plane.normal };
        assert!(polygon::vector_area(&corners).dot(outward) > 0.0, "{element:?} looks the wrong way");
        assert!(polygon::is_convex(&corners, outward, 1e-6), "{element:?} is not convex");
        for &corner in &corners {
            // Within the weld tolerance, once for the snapping and once for the weld.
            assert!(plane.distance(corner).abs() <= 3e-9 * diagonal, "{element:?} leaves its plane");
        }
        let centre = polygon::mean_corner(&corners);
        let inside = |piece: &Vec<DVec3>| {
            polygon::edges(piece).all(|(a, b)| {
                (b - a).cross(centre - a).dot(plane.normal) >= -3e-9 * (b - a).length() * diagonal
            })
        };
        assert!(pieces_of[face.index()].iter().any(inside), "{element:?} leaves its face");

        let (vertices, nodes) = (mesh.elements.row(element.index()), mesh.element_nodes.row(element.index()));
        for (k, &vertex) in vertices.iter().enumerate() {
            assert_eq!(mesh.node_vertices[nodes[k].index()], vertex);
        }
        for (k, (a, b)) in polygon::edges(&corners).enumerate().filter(|_| nodes.len() > vertices.len()) {
            let middle = mesh.position(mesh.node_vertices[nodes[vertices.len() + k].index()]);
            assert!(middle.distance(0.5 * (a + b)) <= 1e-12 * diagonal);
        }
    }
}

/// Elements of faces that lie in one plane and look the same way.
pub fn planes(mesh: &Mesh) -> Vec<Vec<ElementId>> {
    let mut planes: Vec<(Plane, f64, Vec<ElementId>)> = Vec::new();
    for element in mesh.element_ids() {
        let face = mesh.face_corners(mesh.element_face(element));
        let plane = Plane::of_polygon(&face).unwrap();
        let plane = if mesh.element_sides[element.index()] == 0 { plane } else { plane.flipped() };
        let size = polygon::diameter(&face);
        let same = planes.iter_mut().find(|(other, other_size, _)| {
            other.normal.distance(plane.normal) < 1e-7
                && other.distance(plane.origin).abs() < 1e-8 * size.max(*other_size)
        });
        match same {
            Some((_, _, elements)) => elements.push(element),
            None => planes.push((plane, size, vec![element])),
        }
    }
    planes.into_iter().map(|(_, _, elements)| elements).collect()
}

/// Asserts that within each plane every edge is used once in each direction or lies on the rim, and that no vertex
/// lies inside an edge of the rim. Returns the number of edges used twice.
pub fn assert_conforming(mesh: &Mesh) -> usize {
    assert_conforming_among(mesh, planes(mesh))
}

/// The same within each side of each face.
pub fn assert_faces_conforming(mesh: &Mesh) -> usize {
    let mut faces: HashMap<(FaceId, u32), Vec<ElementId>> = HashMap::new();
    for element in mesh.element_ids() {
        let side = mesh.element_sides[element.index()];
        faces.entry((mesh.element_face(element), side)).or_default().push(element);
    }
    assert_conforming_among(mesh, faces.into_values().collect())
}

fn assert_conforming_among(mesh: &Mesh, sets: Vec<Vec<ElementId>>) -> usize {
    let mut interior = 0;
    for plane in sets {
        let mut uses: HashMap<(VertexId, VertexId), usize> = HashMap::new();
        let mut vertices: Vec<VertexId> = Vec::new();
        for &element in &plane {
            let ring = mesh.elements.row(element.index());
            vertices.extend(ring);
            for k in 0..ring.len() {
                *uses.entry((ring[k], ring[(k + 1) % ring.len()])).or_default() += 1;
            }
        }
        vertices.sort_unstable();
        vertices.dedup();
        for (&(a, b), &count) in &uses {
            assert_eq!(count, 1, "edge {a:?} {b:?} is used {count} times in one direction");
            if uses.contains_key(&(b, a)) {
                interior += usize::from(a < b);
                continue;
            }
            let (p, q) = (mesh.position(a), mesh.position(b));
            for &vertex in vertices.iter().filter(|&&v| v != a && v != b) {
                let x = mesh.position(vertex);
                let along = (x - p).dot(q - p) / (q - p).length_squared();
                let distance = x.distance(p.lerp(q, along));
                let within = along > 1e-9 && along < 1.0 - 1e-9;
                assert!(
                    !within || distance > 1e-9 * (q - p).length(),
                    "{vertex:?} at {x} lies inside edge {a:?} {b:?} from {p} to {q}"
                );
            }
        }
    }
    interior
}

/// Asserts that where faces meet no vertex lies inside an edge: neither within the rims of the faces nor along lines on
/// them, whatever face the vertex is of. What is inside a face cannot meet another, [`assert_conforming`] looks there.
pub fn assert_faces_meet(mesh: &Mesh) {
    let sorted = |a: VertexId, b: VertexId| (a.min(b), a.max(b));
    let lines: std::collections::HashSet<_> = mesh.lines.iter().map(|l| sorted(l.from, l.to)).collect();
    let mut uses: HashMap<(FaceId, u32, (VertexId, VertexId)), usize> = HashMap::new();
    for element in mesh.element_ids() {
        let (face, side) = (mesh.element_face(element), mesh.element_sides[element.index()]);
        let ring = mesh.elements.row(element.index());
        for k in 0..ring.len() {
            *uses.entry((face, side, sorted(ring[k], ring[(k + 1) % ring.len()]))).or_default() += 1;
        }
    }
    uses.retain(|(_, _, edge), &mut count| count == 1 || lines.contains(edge));
    let mut used: Vec<VertexId> = uses.keys().flat_map(|&(_, _, (a, b))| [a, b]).collect();
    used.sort_unstable();
    used.dedup();
    let all: Vec<DVec3> = used.iter().map(|&v| mesh.position(v)).collect();
    let weld = 1e-9 * polygon::diameter(&all);
    for &(face, _, (a, b)) in uses.keys() {
        let (p, q) = (mesh.position(a), mesh.position(b));
        let (low, high) = (p.min(q) - weld, p.max(q) + weld);
        for (&vertex, &x) in used.iter().zip(&all) {
            if !(x.cmpge(low).all() && x.cmple(high).all()) {
                continue;
            }
            let along = (x - p).dot(q - p) / (q - p).length_squared();
            let near = x.distance(p.lerp(q, along)) <= 0.5 * weld;
            let apart = x.distance(p) > 2.0 * weld && x.distance(q) > 2.0 * weld;
            assert!(
                !(near && apart && along > 0.0 && along < 1.0),
                "{vertex:?} at {x} lies inside an edge of {face:?} from {a:?} at {p} to {b:?} at {q}, {:.2e} of the \
                 tolerance beside it",
                x.distance(p.lerp(q, along)) / weld
            );
        }
    }
}

/// OBJ text of an axis-aligned box with outward faces and a bottom only where asked; `first` is the number of its
/// first vertex.
pub fn box_text(low: [f64; 3], high: [f64; 3], bottom: bool, first: usize) -> String {
    let mut text = String::new();
    for k in 0..8 {
        let pick = |axis: usize| if (k >> axis) & 1 == 1 { high[axis] } else { low[axis] };
        text += &format!("v {:?} {:?} {:?}\n", pick(0), pick(1), pick(2));
    }
    let faces = [[2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4]];
    for face in &faces[..if bottom { 6 } else { 5 }] {
        let names: Vec<String> = face.iter().map(|v| (v + first).to_string()).collect();
        text += &format!("f {}\n", names.join(" "));
    }
    text
}

/// OBJ text of a horizontal square floor looking up (y up).
pub fn floor_text(low: f64, high: f64) -> String {
    format!(
        "v {low:?} 0 {low:?}\nv {low:?} 0 {high:?}\nv {high:?} 0 {high:?}\nv {high:?} 0 {low:?}\nusemtl white\nf 1 2 3 4\n"
    )
}
