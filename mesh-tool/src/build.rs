//! The whole of `mesh-tool build`: scene in, mesh out, with a report of every repair.

use crate::assemble::assemble;
use crate::clean::{Cleaned, Face, clean};
use crate::conform;
use crate::contact::Pieces;
use crate::convex::pieces_of_polygon;
use crate::discontinuity::{self, DrawnLine, Order};
use crate::frame::Frame;
use crate::given::as_given;
use crate::light::Light;
use crate::meshed::{Drawing, Drawn, Triangles};
use crate::patch::Patch;
use crate::regions::{LostEmitter, merged};
use crate::sheets::{Layer, layers};
use crate::sized::sized;
use crate::solids::Solids;
use crate::solved::{self, Solved};
use crate::steps::{Off, Skip, Step};
use crate::strength::strongest;
use crate::triangulation::Trouble;
use geometry::plane::PLANARITY;
use geometry::polygon;
use glam::DVec3;
use interchange::digest::Digest;
use interchange::ids::VertexId;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::tables::number;
use interchange::{Error, Result};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::time::Instant;

/// What the elements should be. With no size, tolerance or order of lines the faces are elements as given; with several
/// sizes, the finest wins.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// No edge longer than this, in units of the scene.
    pub max_edge: Option<f64>,
    /// About this many elements in the whole scene, small where light changes; without emitters of equal area.
    pub elements: Option<u32>,
    /// Interpolating the direct light over the nodes of an element may miss it by this part of the mean light.
    pub tolerance: Option<f64>,
    /// Refine the mesh that the other options make by the error of this solution on it.
    pub refine_with: Option<Solved>,
    /// Part of the mean irradiance that the solution may miss; none given: [`solved::TOLERANCE`].
    pub refine_tolerance: Option<f64>,
    /// Draw the lines of so many of the faces that the solution shows brightest, too.
    pub sources: u32,
    /// Lines up to this order; none given: as far as the elements can use them.
    pub discontinuity: Option<Order>,
    /// Curves of three edges, too.
    pub eee: bool,
    /// Three nodes an element in place of six.
    pub linear: bool,
    /// Steps of cleaning that are left out.
    pub no_clean: Off<Step>,
    /// What is not to be skipped.
    pub no_skip: Off<Skip>,
}

impl Options {
    fn meshes(&self) -> bool {
        let sized = self.max_edge.is_some() || self.elements.is_some() || self.tolerance.is_some();
        sized || self.discontinuity.is_some()
    }

    /// Highest order of lines that is drawn. Irradiance gathered at reference points was off by (RMS, without lines, d1, d2)
    /// 0.0225, 0.0220, 0.0164 in the furnished room (6000 elements) and 0.0040, 0.0040, 0.0044 in the Cornell box (3000); means
    /// over the Cornell box's faces by up to 0.8, 0.8, 1.2 % (2500). Curvature lines pay where elements are many.
    pub fn order(&self) -> Order {
        self.discontinuity.unwrap_or(Order::D1)
    }

    /// Flags for the provenance.
    pub fn flags(&self) -> Vec<String> {
        let mut flags: Vec<String> = Vec::new();
        flags.extend(self.max_edge.map(|length| format!("--max-edge {}", number(length))));
        flags.extend(self.elements.map(|count| format!("--elements {count}")));
        flags.extend(self.tolerance.map(|tolerance| format!("--tolerance {}", number(tolerance))));
        flags.extend(self.discontinuity.and_then(|order| {
            let value = clap::ValueEnum::to_possible_value(&order)?;
            Some(format!("--discontinuity {}", value.get_name()))
        }));
        flags.extend(self.refine_tolerance.map(|t| format!("--refine-tolerance {}", number(t))));
        flags.extend((self.sources > 0).then(|| format!("--sources {}", self.sources)));
        flags.extend(self.eee.then(|| "--eee".to_owned()));
        flags.extend(self.linear.then(|| "--linear".to_owned()));
        flags.extend(self.no_clean.flags("--no-clean"));
        flags.extend(self.no_skip.flags("--no-skip"));
        flags
    }
}

/// Where a mesh of this scene with these options comes from. Of the materials only what geometry depends on counts.
pub fn provenance(scene: &Scene, options: &Options) -> Provenance {
    let start = Provenance::new(crate::NAME, crate::VERSION);
    let flagged = options.flags().into_iter().fold(start, Provenance::flag);
    let surfaces = Digest::of(scene.materials.surfaces().as_bytes());
    let start = flagged.input("scene", scene.digest).input("surfaces", surfaces);
    match &options.refine_with {
        Some(solved) => start.input("solution", solved.digest),
        None => start,
    }
}

/// Makes the mesh of `scene`.
pub fn build(scene: &Scene, options: &Options, report: &mut Report) -> Result<Mesh> {
    let start = Instant::now();
    let mut cleaned = clean(scene, &options.no_clean, report)?;
    let mut layers = layers_of(&cleaned, options);
    note(report, "clean", start);
    let mut overlapped = 0.0;
    let name = |faces: &[Face], face: u32, trouble: Trouble| trouble.at(scene, faces[face as usize].line);

    let pieces;
    let patches: Vec<(&Layer, Patch)>;
    let drawings: Vec<Drawing>;
    if options.meshes() {
        let start = Instant::now();
        let off = &options.no_clean;
        let solids = if off.leaves(Step::Hidden) { Solids::new(&cleaned) } else { Solids::default() };
        report.count("closed bodies", solids.len());
        if off.leaves(Step::Regions) && off.leaves(Step::Meet) && off.leaves(Step::Overlap) {
            let (merged, lost, area) = merged(cleaned, &layers, report);
            overlapped = area;
            lost.iter().for_each(|loss| warn_of_lost_emitter(scene, loss, report));
            cleaned = merged;
            layers = layers_of(&cleaned, options);
        }
        let solids = solids.renumbered(&cleaned);
        pieces = convex_pieces_of_faces(scene, &cleaned)?;
        note(report, "regions", start);

        let start = Instant::now();
        let mut lines = discontinuity_lines(&cleaned, &pieces, options, report);
        if let Some(count) = options.elements.filter(|_| options.no_skip.leaves(Skip::Budget)) {
            let before = lines.len();
            lines = strongest(lines, &cleaned, &pieces, count);
            report.count("skipped: lines too weak for the number of elements", before - lines.len());
        }
        let drawn = Drawn { pieces: &pieces, lines: &lines, order: options.order(), solids: &solids, off };
        drawings = (0..layers.len())
            .into_par_iter()
            .map(|k| {
                let layer = &layers[k];
                let same_plane = |other: &&Layer| {
                    other.reversed != layer.reversed && other.frame.plane == layer.frame.plane
                };
                let opposite = [k.checked_sub(1), Some(k + 1)]
                    .into_iter()
                    .flatten()
                    .filter_map(|other| layers.get(other))
                    .find(same_plane);
                Drawing::new(layer.clone(), opposite, &cleaned, drawn)
                    .map_err(|trouble| name(&cleaned.faces, layer.sheets[0].face, trouble))
            })
            .collect::<Result<_>>()?;
        note(report, "lines", start);
        let start = Instant::now();
        let lit = options.elements.is_some() || options.tolerance.is_some();
        let light = lit.then(|| Light::new(&cleaned, &pieces)).flatten();
        let name = |face: u32, trouble: Trouble| name(&cleaned.faces, face, trouble);
        let tolerance = cleaned.places.tolerance();
        let mut meshes = sized(scene, &drawings, light.as_ref(), options, &cleaned.places, report, &name)?;
        let made = |meshes: &[Triangles]| -> Vec<(&Layer, Patch)> {
            let patches = drawings.par_iter().zip(meshes).map(|(drawing, mesh)| drawing.patch(mesh));
            drawings.iter().map(Drawing::layer).zip(patches.collect::<Vec<_>>()).collect()
        };
        if let Some(solved) = &options.refine_with {
            let (base, _) = assemble(scene, cleaned.clone(), &pieces, &made(&meshes), !options.linear);
            solved.check(&base)?;
            let sources = solved.brightest(options.sources as usize);
            let fail =
                |(layer, trouble): (usize, Trouble)| name(drawings[layer].layer().sheets[0].face, trouble);
            let asked = options.refine_tolerance.unwrap_or(solved::TOLERANCE);
            solved.refine(&drawings, &mut meshes, asked, tolerance, report).map_err(fail)?;
            if !sources.is_empty() && options.order() >= Order::D1 {
                let mut lines = lines_of(&cleaned, &pieces, sources, options, report);
                lines = strongest(lines, &cleaned, &pieces, base.element_count() as u32);
                report.count("lines of secondary sources", lines.len());
                for (drawing, mesh) in drawings.iter().zip(&mut meshes) {
                    // Where they tangle with what is there, they are left out.
                    let drawn = drawing.draw_more(mesh, &lines, tolerance);
                    report.count("planes without lines of secondary sources", usize::from(drawn.is_err()));
                }
            }
            if off.leaves(Step::Meet) {
                conform::meet(&drawings, &mut meshes, &cleaned.places);
            }
            report.count("elements kept", kept(&base, &meshes));
        }
        patches = made(&meshes);
        note(report, "triangulate", start);
    } else {
        let start = Instant::now();
        pieces = convex_pieces_of_faces(scene, &cleaned)?;
        let given: Vec<Patch> = layers
            .par_iter()
            .map(|layer| {
                as_given(layer, &cleaned, &pieces, &options.no_clean)
                    .map_err(|(face, trouble)| name(&cleaned.faces, face, trouble))
            })
            .collect::<Result<_>>()?;
        patches = layers.iter().zip(given).collect();
        note(report, "cut", start);
    }

    let start = Instant::now();
    for (layer, patch) in &patches {
        for &(sheet, winner) in &patch.lost_emitters {
            let face = |sheet: u32| &cleaned.faces[layer.sheets[sheet as usize].face as usize];
            let (lost, held) = (face(sheet), face(winner));
            let loss = LostEmitter { group: lost.group, line: lost.line, winner_line: held.line };
            warn_of_lost_emitter(scene, &loss, report);
        }
    }
    let total = |part: fn(&Patch) -> usize| patches.iter().map(|(_, patch)| part(patch)).sum();
    report.count("overlapping faces cut", total(|p| p.overlapping));
    report.count("crossing faces cut", total(|p| p.crossing));
    report.count("contact lines", total(|p| p.contacts));
    report.count("hidden parts", total(|p| p.hidden.len()));
    let hidden: f64 = patches.iter().flat_map(|(_, patch)| &patch.hidden).map(|(_, area)| area).sum();
    report.estimate("hidden area", hidden.abs());
    overlapped += patches.iter().map(|(_, patch)| patch.overlapped).sum::<f64>();
    report.estimate("overlapped area", overlapped);
    let (mesh, flat) = assemble(scene, cleaned, &pieces, &patches, options.meshes() && !options.linear);
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

/// Lines of all emitters.
fn discontinuity_lines(
    cleaned: &Cleaned,
    pieces: &Pieces,
    options: &Options,
    report: &mut Report,
) -> Vec<DrawnLine> {
    if options.order() < Order::D1 {
        return Vec::new();
    }
    let emits = |&face: &u32| cleaned.faces[face as usize].emits;
    let sources: Vec<u32> = (0..cleaned.faces.len() as u32).filter(emits).collect();
    lines_of(cleaned, pieces, sources, options, report)
}

/// Elements of `base` that are still among the triangles.
fn kept(base: &Mesh, meshes: &[Triangles]) -> usize {
    let bits = |corners: &[DVec3]| -> BTreeSet<[u64; 3]> {
        corners.iter().map(|corner| corner.to_array().map(f64::to_bits)).collect()
    };
    let before: HashSet<BTreeSet<[u64; 3]>> =
        base.element_ids().map(|e| bits(&base.element_corners(e))).collect();
    let now = meshes.iter().flat_map(|mesh| mesh.elements().map(|(_, corners)| bits(&corners)));
    now.filter(|corners| before.contains(corners)).count()
}

/// Lines of the light of some faces.
fn lines_of(
    cleaned: &Cleaned,
    pieces: &Pieces,
    sources: Vec<u32>,
    options: &Options,
    report: &mut Report,
) -> Vec<DrawnLine> {
    let skips = &options.no_skip;
    let (order, eee) = (options.order(), options.eee);
    discontinuity::Drawing { scene: cleaned, pieces, sources, order, skips, eee }.lines(report)
}

/// Layers of faces that are meshed together: each face alone where overlaps or meeting edges are not cared for.
fn layers_of(cleaned: &Cleaned, options: &Options) -> Vec<Layer> {
    let off = &options.no_clean;
    layers(cleaned, off.leaves(Step::Overlap) && off.leaves(Step::Meet))
}

fn warn_of_lost_emitter(scene: &Scene, loss: &LostEmitter, report: &mut Report) {
    report.warn(format!(
        "{}:{}: this emitter (group {}) lies under the face on line {}, which holds the place where they overlap",
        scene.path.display(),
        loss.line,
        scene.groups[loss.group.index()],
        loss.winner_line
    ));
}

fn note(report: &mut Report, phase: &str, start: Instant) {
    let seconds = start.elapsed().as_secs_f64();
    report.phases.push(interchange::report::Phase { name: phase.into(), seconds });
}

/// Convex pieces of every face, front counter-clockwise: what blocks light.
pub fn convex_pieces_of_faces(scene: &Scene, cleaned: &Cleaned) -> Result<Pieces> {
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
    report.count("elements below 25 deg", quality.narrow);
    report.count("elements below 25 deg that no line or border forces", quality.narrow_freely);
    report.count("neighbours of more than twice the size", quality.uneven);
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
    /// Elements with an angle below 25 degrees.
    pub narrow: usize,
    /// Of these, elements whose smallest angle is not one between two lines or borders.
    pub narrow_freely: usize,
    /// Pairs of elements across an edge, the longest edge of one more than twice that of the other.
    pub uneven: usize,
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
        let lines: HashSet<(u32, u32)> = mesh.lines.iter().map(|l| sorted(l.from.0, l.to.0)).collect();
        let mut sides: HashMap<(u32, u32, u32), Vec<f64>> = HashMap::new();
        let longest =
            |corners: &[DVec3]| polygon::edges(corners).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        for element in mesh.element_ids() {
            let ring = mesh.elements.row(element.index());
            let length = longest(&mesh.element_corners(element));
            for (a, b) in edges_of(ring) {
                let face = mesh.element_faces[element.index()].0;
                sides.entry((face, a, b)).or_default().push(length);
            }
        }
        let uneven = sides.values().filter(|l| l.len() == 2 && l[0].max(l[1]) > 2.0 * l[0].min(l[1])).count();
        let (mut element_area, mut longest_edge, mut angles) = (0.0, 0.0f64, Vec::new());
        let (mut narrow, mut narrow_freely) = (0, 0);
        for element in mesh.element_ids() {
            let corners = mesh.element_corners(element);
            element_area += polygon::area(&corners);
            longest_edge = longest_edge.max(longest(&corners));
            let (angle, at) = smallest_angle(&corners);
            angles.push(angle.to_degrees());
            if angle.to_degrees() < NARROW_DEG {
                narrow += 1;
                let ring = mesh.elements.row(element.index());
                let face = mesh.element_faces[element.index()].0;
                let edges: Vec<(u32, u32)> = edges_of(ring).collect();
                let given = |(a, b): (u32, u32)| lines.contains(&(a, b)) || sides[&(face, a, b)].len() == 1;
                let n = edges.len();
                narrow_freely += usize::from(!(given(edges[at]) && given(edges[(at + n - 1) % n])));
            }
        }
        angles.sort_by(f64::total_cmp);
        Quality {
            face_area,
            element_area,
            longest_edge,
            smallest_angle_deg: angles.first().copied().unwrap_or(0.0),
            median_smallest_angle_deg: angles.get(angles.len() / 2).copied().unwrap_or(0.0),
            narrow,
            narrow_freely,
            uneven,
        }
    }
}

/// Elements with a smaller angle are narrow, degrees.
const NARROW_DEG: f64 = 24.999_999;

fn sorted(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn edges_of(ring: &[VertexId]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..ring.len()).map(|k| sorted(ring[k].0, ring[(k + 1) % ring.len()].0))
}

/// The smallest angle of a polygon, radians, and the corner it is at.
pub fn smallest_angle(corners: &[DVec3]) -> (f64, usize) {
    let n = corners.len();
    let angle = |k: usize| {
        let (a, b) = (corners[(k + 1) % n] - corners[k], corners[(k + n - 1) % n] - corners[k]);
        a.cross(b).length().atan2(a.dot(b))
    };
    let mut best = (f64::INFINITY, 0);
    for k in 0..n {
        let angle = angle(k);
        if angle < best.0 {
            best = (angle, k);
        }
    }
    best
}
