//! The whole of `mesh-tool build`: scene in, mesh out, with a report of every repair.

use crate::assemble::assemble;
use crate::chosen::choose;
use crate::clean::{Cleaned, Face, clean};
use crate::contact::Pieces;
use crate::convex::pieces_of_polygon;
use crate::discontinuity::{self, DrawnLine, Order};
use crate::frame::Frame;
use crate::given::as_given;
use crate::grading::{grade, grade_within};
use crate::light::Light;
use crate::meshed::{Drawing, Drawn, Triangles};
use crate::patch::Patch;
use crate::quality::measure;
use crate::regions::{LostEmitter, merged};
use crate::search::{area, count};
use crate::sheets::{Layer, layers};
use crate::sized::{REFINED_TOLERANCE, graded, shortest, sized};
use crate::solids::Solids;
use crate::solved::{self, Solved};
use crate::steps::{Off, Skip, Step};
use crate::strength::{affordable, by_strength, first};
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
use interchange::tool::progress;
use interchange::{Error, Result};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashSet};
use std::time::Instant;

/// Lines of secondary sources may cost this part of the elements.
const SECONDARY: f64 = 0.4;

/// What the elements should be. With no size, tolerance or order of lines the faces are elements as given; with several
/// sizes, the finest wins.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// No edge longer than this, in units of the scene.
    pub max_edge: Option<f64>,
    /// About this many elements in the whole scene, small where light changes; without emitters of equal area.
    pub elements: Option<u32>,
    /// With a number of elements: of equal size, whatever the light.
    pub even: bool,
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

    /// Highest order of lines that is drawn. Curvature lines do not pay in scenes with few elements for each: in the Cornell box
    /// of 1000 elements irradiance at reference points is off by 1.01 % with slope lines, by 1.33 % with curvature lines
    /// besides; in a room of 5000 by 2.12 and 1.96 % (BENCHMARKING.md).
    pub fn order(&self) -> Order {
        self.discontinuity.unwrap_or(Order::D1)
    }

    /// Flags for the provenance.
    pub fn flags(&self) -> Vec<String> {
        let mut flags: Vec<String> = Vec::new();
        flags.extend(self.max_edge.map(|length| format!("--max-edge {}", number(length))));
        flags.extend(self.elements.map(|count| format!("--elements {count}")));
        flags.extend(self.even.then(|| "--even".to_owned()));
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
        let lines = discontinuity_lines(&cleaned, &pieces, options, report);
        let name = |face: u32, trouble: Trouble| name(&cleaned.faces, face, trouble);
        let draw = |lines: &[DrawnLine], nearness: f64| {
            let drawn =
                Drawn { pieces: &pieces, lines, nearness, order: options.order(), solids: &solids, off };
            drawings_of(&layers, &cleaned, drawn, &name)
        };
        let mut chosen = choose(scene, (&cleaned, &pieces), lines, draw, options, report, &name)?;
        report.count(
            "skipped: lines too close to others",
            chosen.drawings.iter().map(|drawing| drawing.gone).sum(),
        );
        note(report, "lines", start);
        let start = Instant::now();
        let lit = (options.elements.is_some() && !options.even) || options.tolerance.is_some();
        let light = lit.then(|| Light::new(&cleaned, &pieces)).flatten();
        let tolerance = cleaned.places.tolerance();
        let mut meshes = sized(scene, &mut chosen, light.as_ref(), options, &cleaned.places, report, &name)?;
        drawings = chosen.drawings;
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
                let order = by_strength(&lines, &cleaned, &pieces);
                let count = affordable(&lines, &order, &cleaned, base.element_count() as u32, SECONDARY);
                lines = first(&lines, &order, count);
                report.count("lines of secondary sources", lines.len());
                for (drawing, mesh) in drawings.iter().zip(&mut meshes) {
                    // Where they tangle with what is there, they are left out.
                    let drawn = drawing.draw_more(mesh, &lines, tolerance);
                    report.count("planes without lines of secondary sources", usize::from(drawn.is_err()));
                }
            }
            let meets = off.leaves(Step::Meet).then_some(&cleaned.places);
            grade(&drawings, &mut meshes, graded(options, area(&drawings)), meets).map_err(fail)?;
            if let Some(wanted) = options.elements.filter(|_| options.no_skip.leaves(Skip::Grading)) {
                let shortest = shortest(area(&drawings), f64::from(wanted));
                let most = (1.0 + REFINED_TOLERANCE) * count(&meshes) as f64;
                grade_within(&drawings, &mut meshes, shortest, meets, most).map_err(fail)?;
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

/// Draws all layers. `name` names the face of an error.
fn drawings_of(
    layers: &[Layer],
    cleaned: &Cleaned,
    drawn: Drawn,
    name: &(impl Fn(u32, Trouble) -> Error + Sync),
) -> Result<Vec<Drawing>> {
    let same_plane = |a: &Layer, b: &Layer| a.reversed != b.reversed && a.frame.plane == b.frame.plane;
    let bar = progress("lines on planes", layers.len());
    let draw = |k: usize| {
        bar.inc(1);
        let layer = &layers[k];
        let beside = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| layers.get(k));
        let opposite = beside.into_iter().find(|other| same_plane(other, layer));
        Drawing::new(layer.clone(), opposite, cleaned, drawn)
            .map_err(|trouble| name(layer.sheets[0].face, trouble))
    };
    (0..layers.len()).into_par_iter().map(draw).collect()
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
