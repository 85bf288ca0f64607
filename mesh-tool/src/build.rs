//! The whole of `mesh-tool build`: scene in, mesh out, with a report of every repair.

use crate::assemble::assemble;
use crate::clean::{Cleaned, clean};
use crate::contact::Pieces;
use crate::convex::pieces_of_polygon;
use crate::frame::Frame;
use crate::given::as_given;
use crate::light::Light;
use crate::meshed::Drawing;
use crate::patch::Patch;
use crate::sheets::{Layer, layers};
use crate::sized::sized;
use crate::triangulation::Trouble;
use geometry::plane::PLANARITY;
use geometry::polygon;
use glam::DVec3;
use interchange::digest::Digest;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::tables::number;
use interchange::{Error, Result};
use rayon::prelude::*;

/// What the elements should be. With neither, the faces are elements as given; with both, the finer wins.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// No edge longer than this, in units of the scene.
    pub max_edge: Option<f64>,
    /// About this many elements in the whole scene, small where light changes; without emitters of equal area.
    pub elements: Option<u32>,
}

impl Options {
    fn meshes(&self) -> bool {
        self.max_edge.is_some() || self.elements.is_some()
    }

    /// Flags for the provenance.
    pub fn flags(&self) -> Vec<String> {
        let max_edge = self.max_edge.map(|length| format!("--max-edge {}", number(length)));
        max_edge.into_iter().chain(self.elements.map(|count| format!("--elements {count}"))).collect()
    }
}

/// Where a mesh of this scene with these options comes from. Of the materials only what geometry depends on counts.
pub fn provenance(scene: &Scene, options: &Options) -> Provenance {
    let start = Provenance::new(crate::NAME, crate::VERSION);
    let flagged = options.flags().into_iter().fold(start, Provenance::flag);
    let surfaces = Digest::of(scene.materials.surfaces().as_bytes());
    flagged.input("scene", scene.digest).input("surfaces", surfaces)
}

/// Makes the mesh of `scene`.
pub fn build(scene: &Scene, options: &Options, report: &mut Report) -> Result<Mesh> {
    let start = std::time::Instant::now();
    let cleaned = clean(scene, report)?;
    let pieces = convex_pieces_of_faces(scene, &cleaned)?;
    let layers = layers(&cleaned);
    note(report, "clean", start);

    let start = std::time::Instant::now();
    let name = |face: u32, trouble: Trouble| trouble.at(scene, cleaned.faces[face as usize].line);
    let patches: Vec<(&Layer, Patch)>;
    let drawings: Vec<Drawing>;
    if options.meshes() {
        drawings = layers
            .into_par_iter()
            .map(|layer| {
                let face = layer.sheets[0].face;
                Drawing::new(layer, &cleaned, &pieces).map_err(|trouble| name(face, trouble))
            })
            .collect::<Result<_>>()?;
        note(report, "lines", start);
        let start = std::time::Instant::now();
        let light = options.elements.and_then(|_| Light::new(&cleaned, &pieces));
        let meshes = sized(scene, &drawings, light.as_ref(), options, report, &name)?;
        patches = drawings.iter().map(Drawing::layer).zip(meshes).collect();
        note(report, "triangulate", start);
    } else {
        let given: Vec<Patch> = layers
            .par_iter()
            .map(|layer| as_given(layer, &cleaned, &pieces).map_err(|(face, trouble)| name(face, trouble)))
            .collect::<Result<_>>()?;
        patches = layers.iter().zip(given).collect();
        note(report, "cut", start);
    }

    let start = std::time::Instant::now();
    let total = |part: fn(&Patch) -> usize| patches.iter().map(|(_, patch)| part(patch)).sum();
    report.count("overlapping faces cut", total(|p| p.overlapping));
    report.count("crossing faces cut", total(|p| p.crossing));
    report.count("contact lines", total(|p| p.contacts));
    let (mesh, flat) = assemble(scene, cleaned, &pieces, &patches, options.meshes());
    report.count("pieces without area left out", flat);
    note(report, "assemble", start);
    measure(&mesh, report);
    if mesh.elements.is_empty() {
        return Err(Error::whole(
            &scene.path,
            "no element is left; a scene needs at least one face with area",
        ));
    }
    Ok(mesh)
}

fn note(report: &mut Report, phase: &str, start: std::time::Instant) {
    let seconds = start.elapsed().as_secs_f64();
    report.phases.push(interchange::report::Phase { name: phase.into(), seconds });
}

/// Convex pieces of every face, front counter-clockwise: what blocks light.
fn convex_pieces_of_faces(scene: &Scene, cleaned: &Cleaned) -> Result<Pieces> {
    cleaned
        .faces
        .par_iter()
        .map(|face| {
            let corners = cleaned.places.corners(&face.corners);
            if polygon::is_convex(&corners, face.plane.normal, PLANARITY) {
                return Ok(vec![face.corners.clone()]);
            }
            let frame = Frame::new(&face.plane, [corners.as_slice()].into_iter());
            pieces_of_polygon(&frame, &face.corners, &cleaned.places)
                .map_err(|trouble| trouble.at(scene, face.line))
        })
        .collect()
}

/// Counts and measures the finished mesh.
fn measure(mesh: &Mesh, report: &mut Report) {
    report.count("elements", mesh.element_count());
    report.count("vertices", mesh.vertices.len());
    report.count("nodes", mesh.node_vertices.len());
    report.count("lines", mesh.lines.len());
    let quality = Quality::of(mesh);
    report.estimate("area of faces", quality.face_area);
    report.estimate("area of elements", quality.element_area);
    report.estimate("longest edge", quality.longest_edge);
    report.estimate("smallest angle deg", quality.smallest_angle_deg);
    report.estimate("median smallest angle deg", quality.median_smallest_angle_deg);
}

/// Shape of the elements of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Quality {
    /// Area of the faces, both sides of two-sided ones.
    pub face_area: f64,
    /// Area of the elements.
    pub element_area: f64,
    /// Longest edge of an element.
    pub longest_edge: f64,
    /// Smallest angle of any element, degrees.
    pub smallest_angle_deg: f64,
    /// Median over the elements of their smallest angles, degrees.
    pub median_smallest_angle_deg: f64,
}

impl Quality {
    /// Measures a mesh.
    pub fn of(mesh: &Mesh) -> Quality {
        let faces = (0..mesh.face_count()).map(interchange::ids::FaceId::new);
        let face_area = faces
            .map(|face| {
                let sides = 1.0 + f64::from(u8::from(mesh.is_two_sided(face)));
                sides * polygon::area(&mesh.face_corners(face))
            })
            .sum();
        let (mut element_area, mut longest_edge, mut angles) = (0.0, 0.0f64, Vec::new());
        for element in mesh.element_ids() {
            let corners = mesh.element_corners(element);
            element_area += polygon::area(&corners);
            longest_edge = polygon::edges(&corners).map(|(a, b)| a.distance(b)).fold(longest_edge, f64::max);
            angles.push(smallest_angle(&corners).to_degrees());
        }
        angles.sort_by(f64::total_cmp);
        Quality {
            face_area,
            element_area,
            longest_edge,
            smallest_angle_deg: angles.first().copied().unwrap_or(0.0),
            median_smallest_angle_deg: angles.get(angles.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

fn smallest_angle(corners: &[DVec3]) -> f64 {
    let n = corners.len();
    (0..n)
        .map(|k| {
            let (a, b) = (corners[(k + 1) % n] - corners[k], corners[(k + n - 1) % n] - corners[k]);
            a.cross(b).length().atan2(a.dot(b))
        })
        .fold(f64::INFINITY, f64::min)
}
