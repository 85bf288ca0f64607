//! Where lines of an emitter can matter: on receivers that it reaches, past something that stands between, with light
//! enough to be seen.

use crate::build::Options;
use crate::clean::Cleaned;
use crate::contact::Pieces;
use crate::discontinuity::{DrawnLine, Emitter};
use crate::light::{Light, Lit};
use crate::search::{EQUILATERAL, SPACING_PER_MAX_EDGE};
use crate::sheets::bounds;
use crate::wedge::Surroundings;
use geometry::gather::Scratch;
use geometry::occluder::separated;
use geometry::point_factor::point_factor;
use geometry::polygon;
use glam::DVec3;
use rayon::prelude::*;

/// An emitter that gives a receiver less than this part of its direct light leaves no lines there.
pub const WEAK: f64 = 1e-3;

/// The shafts between one emitter and all faces.
#[derive(Debug)]
pub struct Shafts {
    reached: Vec<bool>,
    holds: Vec<bool>,
}

impl Shafts {
    /// Looks into the shaft to every face.
    pub fn new(emitter: &Emitter, scene: &Surroundings) -> Shafts {
        let count = scene.planes.len();
        let lamp: Vec<DVec3> = emitter.corners.iter().map(|(corner, _)| *corner).collect();
        let mut corners: Vec<Vec<DVec3>> = vec![Vec::new(); count];
        for piece in &scene.pieces {
            corners[piece.face as usize].extend(&piece.corners);
        }
        let above = |p: &DVec3| emitter.plane.distance(*p) > scene.tolerance;
        let reached: Vec<bool> = (0..count)
            .map(|face| {
                let plane = &scene.planes[face];
                face != emitter.face as usize
                    && corners[face].iter().any(above)
                    && lamp.iter().any(|&p| plane.distance(p).abs() > scene.tolerance)
            })
            .collect();
        let margin = DVec3::splat(scene.tolerance);
        let boxes: Vec<(DVec3, DVec3)> = scene.pieces.iter().map(|piece| bounds(&piece.corners)).collect();
        let holds = (0..count)
            .map(|face| {
                if !reached[face] {
                    return false;
                }
                let shaft: Vec<DVec3> = lamp.iter().chain(&corners[face]).copied().collect();
                let (low, high) = bounds(&shaft);
                scene.pieces.iter().zip(&boxes).any(|(piece, (l, h))| {
                    piece.face != face as u32
                        && piece.face != emitter.face
                        && l.cmplt(high - margin).all()
                        && h.cmpgt(low + margin).all()
                        && !separated(&shaft, &piece.corners)
                })
            })
            .collect();
        Shafts { reached, holds }
    }

    /// Whether some of the face lies before the emitter.
    pub fn reaches(&self, face: u32) -> bool {
        self.reached[face as usize]
    }

    /// Whether anything stands between. A face may stand in its own light only with another face's help.
    pub fn holds_blocker(&self, face: u32) -> bool {
        self.holds[face as usize]
    }
}

/// Per emitter, the faces that it gives so little of their direct light that its lines do not matter: what the whole
/// emitter could give at most, unblocked and from the nearest place, against what all emitters give in the mean.
pub fn weak_pairs(
    emitters: &[Emitter],
    scene: &Cleaned,
    pieces: &Pieces,
    surroundings: &Surroundings,
) -> Vec<Vec<bool>> {
    let faces = scene.faces.len();
    if emitters.len() < 2 {
        return vec![vec![false; faces]; emitters.len()];
    }
    let Some(light) = Light::new(scene, pieces) else { return vec![vec![false; faces]; emitters.len()] };
    let corners: Vec<Vec<DVec3>> =
        scene.faces.iter().map(|face| scene.places.corners(&face.corners)).collect();
    let mean: Vec<f64> = (0..faces)
        .into_par_iter()
        .map_init(Scratch::default, |scratch, face| {
            let (mut sum, mut whole) = (0.0, 0.0);
            for piece in &pieces[face] {
                let corners = scene.places.corners(piece);
                let normal = scene.faces[face].plane.normal;
                let lit = Lit { corners: [corners[0], corners[1], corners[corners.len() - 1]], normal };
                let area = polygon::area(&corners);
                sum += area * light.at(polygon::centroid(&lit.corners), normal, scratch);
                whole += area;
            }
            sum / whole
        })
        .collect();
    let weak = |emitter: &Emitter| {
        let lamp = &corners[emitter.face as usize];
        let (low, high) = bounds(lamp);
        let area = polygon::area(lamp);
        (0..faces)
            .map(|face| {
                let (l, h) = bounds(&corners[face]);
                let gap = (l - high).max(low - h).max(DVec3::ZERO).length();
                let most = area / (std::f64::consts::PI * gap * gap);
                gap > surroundings.tolerance && most < WEAK * mean[face]
            })
            .collect()
    };
    emitters.iter().map(weak).collect()
}

/// Elements that a line costs for each element that it is long, and besides: its ends and crossings.
const COST: (f64, f64) = (2.0, 4.0);
/// A jump in curvature counts this part of one in slope.
const CURVATURE: f64 = 0.25;

/// Lines pass each other and borders at least at this part of the wished length of edges: a kink so far from the nearest
/// edge is interpolated with about this part of the error of one that no edge follows.
const NEAR: f64 = 0.25;

/// The distance that lines keep with the options' size of elements; zero where only a tolerance is given, which bounds no
/// size from below.
pub fn nearness(scene: &Cleaned, options: &Options) -> f64 {
    let by_count = options.elements.map(|count| spacing_of(scene, count));
    let by_length = options.max_edge.map(|length| SPACING_PER_MAX_EDGE * length);
    let spacing = [by_count, by_length].into_iter().flatten().reduce(f64::min);
    NEAR * spacing.unwrap_or(0.0)
}

/// Edge of as many equal triangles.
fn spacing_of(scene: &Cleaned, elements: u32) -> f64 {
    let area: f64 = scene.faces.iter().map(|face| polygon::area(&scene.places.corners(&face.corners))).sum();
    (area / (EQUILATERAL * f64::from(elements))).sqrt()
}

/// The numbers of the lines, the strongest first: strength is the light that the source could give, unblocked, to the line's
/// middle, times its length.
pub fn by_strength(lines: &[DrawnLine], scene: &Cleaned, pieces: &Pieces) -> Vec<usize> {
    let strength = |line: &DrawnLine| {
        let point = 0.5 * (line.ends[0] + line.ends[1]);
        let plane = scene.faces[line.face as usize].plane;
        let normal = if line.side == 0 { plane.normal } else { -plane.normal };
        let mut cut = Vec::new();
        let shone =
            |piece: &Vec<u32>| point_factor(point, normal, &scene.places.corners(piece), &mut cut).abs();
        let light: f64 = pieces[line.source as usize].iter().map(shone).sum();
        light * line.ends[0].distance(line.ends[1]) * if line.order < 2 { 1.0 } else { CURVATURE }
    };
    let strengths: Vec<f64> = lines.par_iter().map(strength).collect();
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|&a, &b| strengths[b].total_cmp(&strengths[a]).then(a.cmp(&b)));
    order
}

/// How many lines, in this order, cost no more than the part `share` of so many elements, by a guess.
pub fn affordable(lines: &[DrawnLine], order: &[usize], scene: &Cleaned, elements: u32, share: f64) -> usize {
    let spacing = spacing_of(scene, elements);
    let cost = |line: &DrawnLine| COST.0 * line.ends[0].distance(line.ends[1]) / spacing + COST.1;
    let mut left = share * f64::from(elements);
    let fits = |&&line: &&usize| {
        left -= cost(&lines[line]);
        left >= 0.0
    };
    order.iter().take_while(fits).count()
}

/// The first `count` lines in this order, as they were ordered before.
pub fn first(lines: &[DrawnLine], order: &[usize], count: usize) -> Vec<DrawnLine> {
    let mut kept = order[..count].to_vec();
    kept.sort_unstable();
    kept.into_iter().map(|line| lines[line]).collect()
}
