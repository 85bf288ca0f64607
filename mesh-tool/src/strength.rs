//! Where lines of an emitter can matter: on receivers that it reaches, past something that stands between, with light
//! enough to be seen.

use crate::clean::Cleaned;
use crate::contact::Pieces;
use crate::discontinuity::{DrawnLine, Emitter};
use crate::light::{Light, Lit};
use crate::sheets::bounds;
use crate::sized::EQUILATERAL;
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
/// Lines may cost this part of the elements.
const SHARE: f64 = 0.4;
/// A jump in curvature counts this part of one in slope.
const CURVATURE: f64 = 0.25;

/// The strongest of the lines, as many as `elements` elements can follow: strength is the light that the source could
/// give, unblocked, to the line's middle, times its length. The order of the lines stays.
pub fn strongest(lines: Vec<DrawnLine>, scene: &Cleaned, pieces: &Pieces, elements: u32) -> Vec<DrawnLine> {
    let area: f64 = scene.faces.iter().map(|face| polygon::area(&scene.places.corners(&face.corners))).sum();
    let spacing = (area / (EQUILATERAL * f64::from(elements))).sqrt();
    let length = |line: &DrawnLine| line.ends[0].distance(line.ends[1]);
    let cost = |line: &DrawnLine| COST.0 * length(line) / spacing + COST.1;
    let mut left = SHARE * f64::from(elements);
    if lines.iter().map(cost).sum::<f64>() <= left {
        return lines;
    }
    let strength = |line: &DrawnLine| {
        let point = 0.5 * (line.ends[0] + line.ends[1]);
        let plane = scene.faces[line.face as usize].plane;
        let normal = if line.side == 0 { plane.normal } else { -plane.normal };
        let mut cut = Vec::new();
        let shone =
            |piece: &Vec<u32>| point_factor(point, normal, &scene.places.corners(piece), &mut cut).abs();
        let light: f64 = pieces[line.source as usize].iter().map(shone).sum();
        light * length(line) * if line.order < 2 { 1.0 } else { CURVATURE }
    };
    let strengths: Vec<f64> = lines.par_iter().map(strength).collect();
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|&a, &b| strengths[b].total_cmp(&strengths[a]).then(a.cmp(&b)));
    let mut kept = vec![false; lines.len()];
    for k in order {
        left -= cost(&lines[k]);
        if left < 0.0 {
            break;
        }
        kept[k] = true;
    }
    lines.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(line, _)| line).collect()
}
