//! Discontinuity lines of the direct light (Lischinski, Tampieri & Greenberg 1992): where wedges between emitters and
//! the silhouettes of what stands before them meet the faces. Along them the irradiance is continuous, but its slope
//! (D1) or its curvature (D2) jumps.
//!
//! A wedge gives a D1 line where an edge of the emitter and an edge of the occluder lie in its plane, else a D2 line.

use crate::clean::Cleaned;
use crate::contact::Pieces;
use crate::features::Features;
use crate::merge_lines::merged_lines;
use crate::orient::ring_edges;
use crate::steps::{Off, Skip};
use crate::strength::{Shafts, weak_pairs};
use crate::wedge::{Piece, Surroundings, Trace, Wedge};
use geometry::plane::Plane;
use glam::DVec3;
use interchange::report::Report;
use interchange::tool::progress;
use rayon::prelude::*;
use robust::{Coord3D, orient3d};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Steps of the bar that an emitter stands for.
const STEPS_PER_EMITTER: usize = 1000;

/// Highest order of the lines that are wished.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Order {
    /// None at all, not even where faces touch
    Off,
    /// Where faces touch or cross: jumps in value
    D0,
    /// Jumps in slope, too
    D1,
    /// Jumps in curvature, too
    D2,
}

/// A line on one side of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnLine {
    /// Face it lies on.
    pub face: u32,
    /// 0 front, 1 back.
    pub side: u32,
    /// Ends.
    pub ends: [DVec3; 2],
    /// 1 slope, 2 curvature.
    pub order: u32,
    /// The emitting face.
    pub source: u32,
}

/// A face that shines, as its border.
#[derive(Debug, Clone)]
pub struct Emitter {
    /// The face.
    pub face: u32,
    /// Its plane, normal to where it shines.
    pub plane: Plane,
    /// Edges of its border, in the direction of the face's ring, without seams and with straight corners left out.
    pub edges: Vec<[DVec3; 2]>,
    /// Corners of the border and the edges that end there.
    pub corners: Vec<(DVec3, Vec<usize>)>,
}

/// What is drawn.
#[derive(Debug, Clone)]
pub struct Drawing<'a> {
    /// The scene.
    pub scene: &'a Cleaned,
    /// Convex pieces of its faces.
    pub pieces: &'a Pieces,
    /// Faces whose light is followed.
    pub sources: Vec<u32>,
    /// Highest order.
    pub order: Order,
    /// What is not to be skipped.
    pub skips: &'a Off<Skip>,
    /// Whether curves of three edges are drawn.
    pub eee: bool,
}

impl Drawing<'_> {
    /// All lines, by face, side, source and place.
    pub fn lines(&self, report: &mut Report) -> Vec<DrawnLine> {
        let Drawing { scene, pieces, skips, .. } = self;
        let tolerance = scene.places.tolerance();
        let planes: Vec<Plane> = scene.faces.iter().map(|face| face.plane).collect();
        let all: Vec<Piece> = pieces
            .iter()
            .enumerate()
            .flat_map(|(face, pieces)| pieces.iter().map(move |piece| (face as u32, piece)))
            .map(|(face, piece)| Piece { corners: scene.places.corners(piece), face })
            .collect();
        let surroundings = Surroundings::new(all, planes, tolerance);
        let features = Features::new(scene);
        let emitters: Vec<Emitter> =
            self.sources.iter().flat_map(|&face| Emitter::of_face(face, scene)).collect();
        let shafts: Vec<Shafts> =
            emitters.par_iter().map(|emitter| Shafts::new(emitter, &surroundings)).collect();
        let weak = weak_pairs(&emitters, scene, pieces, &surroundings);

        let (mut lines, mut wedges, mut spared) = (Vec::new(), 0, 0);
        let (mut empty, mut faint, mut pairs) = (0, 0, 0);
        let bar = progress("lines", emitters.len() * STEPS_PER_EMITTER);
        for (number, ((emitter, shafts), weak)) in emitters.iter().zip(&shafts).zip(&weak).enumerate() {
            bar.set_position((number * STEPS_PER_EMITTER) as u64);
            let wanted = |face: u32| {
                (shafts.holds_blocker(face) || !skips.leaves(Skip::Shaft))
                    && (!weak[face as usize] || !skips.leaves(Skip::Weak))
            };
            for face in (0..scene.faces.len() as u32).filter(|&face| shafts.reaches(face)) {
                pairs += 1;
                empty += usize::from(!shafts.holds_blocker(face));
                faint += usize::from(shafts.holds_blocker(face) && weak[face as usize]);
            }
            if !(0..scene.faces.len() as u32).any(|face| shafts.reaches(face) && wanted(face)) {
                continue;
            }
            let (cast, left_out) = self.wedges(emitter, &features, &surroundings);
            wedges += cast.len();
            spared += left_out;
            let (count, swept) = (cast.len(), AtomicUsize::new(0));
            let traces: Vec<Vec<(Trace, u32)>> = cast
                .par_iter()
                .map(|cast| {
                    let traces = cast.wedge.sweep(&surroundings, cast.range, &cast.own);
                    let part = swept.fetch_add(1, Ordering::Relaxed) * STEPS_PER_EMITTER / count;
                    bar.set_position((number * STEPS_PER_EMITTER + part) as u64);
                    traces.into_iter().map(|trace| (trace, cast.order)).collect()
                })
                .collect();
            let sides = |trace: &Trace| trace.front || scene.faces[trace.face as usize].two_sided;
            let drawn =
                traces.into_iter().flatten().filter(|(trace, _)| sides(trace) && wanted(trace.face)).map(
                    |(trace, order)| DrawnLine {
                        face: trace.face,
                        side: u32::from(!trace.front),
                        ends: trace.ends,
                        order,
                        source: emitter.face,
                    },
                );
            lines.extend(drawn);
            if self.eee {
                let curves = crate::eee::curves(emitter, scene, &features, &surroundings);
                report.count("curves of three edges", curves.len());
                let chords = curves.iter().flat_map(|curve| {
                    curve.points.windows(2).map(|ends| DrawnLine {
                        face: curve.face,
                        side: u32::from(!curve.front),
                        ends: [ends[0], ends[1]],
                        order: 2,
                        source: emitter.face,
                    })
                });
                lines.extend(chords.filter(|line| wanted(line.face)));
            }
        }
        report.count("emitters with lines", emitters.len());
        report.count("wedges swept", wedges);
        report.count("skipped: wedges that are no silhouette", spared);
        report.count("emitter-receiver pairs", pairs);
        report.count("skipped: pairs with nothing between", empty);
        report.count("skipped: pairs with weak light", faint);
        report.count("wedge segments", lines.len());
        lines.retain(|line| {
            let side = line.side == 0 || scene.faces[line.face as usize].two_sided;
            side && line.ends[0].distance(line.ends[1]) > 2.0 * tolerance
        });
        if skips.leaves(Skip::Merge) {
            let before = lines.len();
            lines = merged_lines(lines, tolerance);
            report.count("skipped: segments merged into others", before - lines.len().min(before));
        }
        if skips.leaves(Skip::Order) {
            let before = lines.len();
            lines.retain(|line| line.order <= if self.order >= Order::D2 { 2 } else { 1 });
            report.count("skipped: lines of a higher order than asked", before - lines.len());
        }
        lines
    }

    /// The wedges of an emitter, and the number of those left out as no silhouette.
    fn wedges(
        &self,
        emitter: &Emitter,
        features: &Features,
        surroundings: &Surroundings,
    ) -> (Vec<Cast>, usize) {
        let (scene, tolerance) = (self.scene, surroundings.tolerance);
        let every = !self.skips.leaves(Skip::Silhouette);
        let planes = &surroundings.planes;
        let (mut cast, mut left_out) = (Vec::new(), 0);
        // Corner of the emitter, edge of an occluder.
        for (edge, ends) in features.edges.iter().enumerate() {
            let base = ends.ends.map(|place| scene.places.position(place));
            if ends.faces.contains(&emitter.face) {
                continue;
            }
            let heights = base.map(|p| emitter.plane.distance(p));
            let Some(range) = positive_range(heights, tolerance) else { continue };
            for (corner, at) in &emitter.corners {
                if !every && !features.is_silhouette(edge as u32, *corner, planes, tolerance) {
                    left_out += 1;
                    continue;
                }
                let wedge = Wedge { apex: *corner, base, from_apex: true };
                let in_plane = at.iter().any(|&k| {
                    let [a, b] = emitter.edges[k];
                    let other = if a == *corner { b } else { a };
                    coplanar(*corner, base[0], base[1], other, tolerance)
                });
                cast.push(Cast {
                    wedge,
                    range,
                    own: ends.faces.clone(),
                    order: if in_plane { 1 } else { 2 },
                });
            }
        }
        // Edge of the emitter, corner of an occluder.
        for (corner, (place, edges)) in features.corners.iter().enumerate() {
            let apex = scene.places.position(*place);
            if emitter.plane.distance(apex) <= tolerance {
                continue;
            }
            for &base in &emitter.edges {
                let eyes = [base[0], base[0].lerp(base[1], 0.5), base[1]];
                let bounds =
                    |eye: DVec3| features.is_silhouette_corner(corner, eye, scene, planes, tolerance);
                if !every && !eyes.into_iter().any(bounds) {
                    left_out += 1;
                    continue;
                }
                let wedge = Wedge { apex, base, from_apex: false };
                let in_plane = edges.iter().any(|&edge| {
                    let [a, b] = features.edges[edge as usize].ends;
                    let other = scene.places.position(if a == *place { b } else { a });
                    let silhouette =
                        eyes.iter().any(|&eye| features.is_silhouette(edge, eye, planes, tolerance));
                    silhouette && coplanar(base[0], base[1], apex, other, tolerance)
                });
                cast.push(Cast {
                    wedge,
                    range: [0.0, 1.0],
                    own: Vec::new(),
                    order: if in_plane { 1 } else { 2 },
                });
            }
        }
        (cast, left_out)
    }
}

/// A wedge to be swept.
#[derive(Debug, Clone)]
struct Cast {
    wedge: Wedge,
    range: [f64; 2],
    own: Vec<u32>,
    order: u32,
}

impl Emitter {
    /// The shining sides of a face.
    pub fn of_face(face: u32, scene: &Cleaned) -> Vec<Emitter> {
        let given = &scene.faces[face as usize];
        let (edges, corners) = border(&given.corners, scene);
        let front = Emitter { face, plane: given.plane, edges, corners };
        let back = Emitter { plane: given.plane.flipped(), ..front.clone() };
        if given.two_sided { vec![front, back] } else { vec![front] }
    }
}

/// Edges of a border and its corners with the edges that end there.
type Border = (Vec<[DVec3; 2]>, Vec<(DVec3, Vec<usize>)>);

/// Edges and corners of a ring, without seams and straight corners.
fn border(ring: &[u32], scene: &Cleaned) -> Border {
    let all: Vec<(u32, u32)> = ring_edges(ring).collect();
    let open: Vec<(u32, u32)> = all.iter().copied().filter(|&(a, b)| !all.contains(&(b, a))).collect();
    let position = |place: u32| scene.places.position(place);
    let straight = |a: u32, b: u32, c: u32| {
        let (p, q) = (position(b) - position(a), position(c) - position(b));
        p.cross(q).length() <= geometry::plane::PLANARITY * p.length() * q.length() && p.dot(q) > 0.0
    };
    // Follow each edge on through straight corners.
    let is_start = |&(a, b): &(u32, u32)| !open.iter().any(|&(x, y)| y == a && straight(x, a, b));
    let mut edges = Vec::new();
    for &(start, second) in open.iter().filter(|edge| is_start(edge)) {
        let (mut before, mut end) = (start, second);
        for _ in 0..open.len() {
            match open.iter().find(|&&(x, y)| x == end && straight(before, end, y)) {
                Some(&(_, y)) => (before, end) = (end, y),
                None => break,
            }
        }
        edges.push((start, end));
    }
    let mut places: Vec<u32> = edges.iter().flat_map(|&(a, b)| [a, b]).collect();
    places.sort_unstable();
    places.dedup();
    let corners = places
        .into_iter()
        .map(|place| {
            let at = (0..edges.len()).filter(|&k| edges[k].0 == place || edges[k].1 == place).collect();
            (position(place), at)
        })
        .collect();
    (edges.into_iter().map(|(a, b)| [position(a), position(b)]).collect(), corners)
}

/// The part of an edge, from 0 to 1, with heights above the tolerance.
fn positive_range([a, b]: [f64; 2], tolerance: f64) -> Option<[f64; 2]> {
    match (a > tolerance, b > tolerance) {
        (false, false) => None,
        (true, true) => Some([0.0, 1.0]),
        (true, false) => Some([0.0, (a / (a - b)).clamp(0.0, 1.0)]),
        (false, true) => Some([(a / (a - b)).clamp(0.0, 1.0), 1.0]),
    }
}

/// Whether four points lie in one plane: exactly (Shewchuk's predicate), or within the weld tolerance of it.
fn coplanar(a: DVec3, b: DVec3, c: DVec3, d: DVec3, tolerance: f64) -> bool {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    let volume = orient3d(coord(a), coord(b), coord(c), coord(d));
    let area = (b - a).cross(c - a).length().max((b - a).cross(d - a).length());
    volume.abs() <= tolerance * area
}
