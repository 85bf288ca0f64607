//! Contact lines: where faces of other planes touch or cross a layer. Light jumps in value across them (D0,
//! Lischinski, Tampieri & Greenberg 1992), because what stands on one side of the line hides everything from the
//! places next to it on the other.

use crate::clean::Cleaned;
use crate::frame::{Frame, nearest_on_segment, turn};
use crate::sheets::{Layer, bounds};
use glam::{DVec2, DVec3};

/// A straight part of a sheet where another face touches or crosses it.
#[derive(Debug, Clone, Copy)]
pub struct ContactLine {
    /// Sheet of the layer.
    pub sheet: u32,
    /// The other face.
    pub source: u32,
    /// Ends, in the layer's frame.
    pub ends: [DVec2; 2],
    /// Whether the other face lies on both sides of the plane.
    pub crosses: bool,
    /// Whether it runs along the sheet's border all the way.
    pub along_border: bool,
}

/// Convex pieces of each face, as places.
pub type Pieces = Vec<Vec<Vec<u32>>>;

/// The contact lines on all sheets of `layer`.
///
/// What touches the plane only from behind is left out: the sheet does not look there. So is a face that lies in the
/// plane and looks the other way: being in the plane it hides nothing from any place of it.
pub fn contact_lines(layer: &Layer, scene: &Cleaned, pieces: &Pieces) -> Vec<ContactLine> {
    let tolerance = scene.places.tolerance();
    let frame = &layer.frame;
    let outlines: Vec<Vec<Vec<DVec2>>> =
        layer.sheets.iter().map(|sheet| convex_outlines(layer, sheet.face, scene, pieces)).collect();
    let rings: Vec<Vec<DVec2>> = layer
        .sheets
        .iter()
        .map(|sheet| sheet.ring.iter().map(|&p| frame.flatten(scene.places.position(p))).collect())
        .collect();
    let everything: Vec<DVec3> = layer.sheets.iter().flat_map(|s| scene.places.corners(&s.ring)).collect();
    let (low, high) = bounds(&everything);
    let margin = DVec3::splat(tolerance);

    let mut lines = Vec::new();
    for (source, pieces) in pieces.iter().enumerate() {
        let (mut cuts, mut front, mut back) = (Vec::new(), false, false);
        let corners = scene.places.corners(&scene.faces[source].corners);
        let (source_low, source_high) = bounds(&corners);
        let near = source_low.cmple(high + margin).all() && low.cmple(source_high + margin).all();
        if !near {
            continue;
        }
        for piece in pieces {
            let Some(cut) = cut_by_plane(frame, &scene.places.corners(piece), tolerance) else { continue };
            front |= if layer.reversed { cut.back } else { cut.front };
            back |= if layer.reversed { cut.front } else { cut.back };
            cuts.push(cut.ends);
        }
        if !front {
            continue;
        }
        for (sheet, outline) in outlines.iter().enumerate() {
            for ends in clipped(&cuts, outline, tolerance / frame.size) {
                lines.push(ContactLine {
                    sheet: sheet as u32,
                    source: source as u32,
                    ends,
                    crosses: back,
                    along_border: runs_along(&rings[sheet], ends, tolerance / frame.size),
                });
            }
        }
    }
    lines
}

/// Convex pieces of a face in the layer's frame, counter-clockwise.
pub fn convex_outlines(layer: &Layer, face: u32, scene: &Cleaned, pieces: &Pieces) -> Vec<Vec<DVec2>> {
    let along = scene.faces[face as usize].plane.normal.dot(layer.frame.plane.normal) > 0.0;
    let outline = |piece: &Vec<u32>| {
        let mut outline: Vec<DVec2> =
            piece.iter().map(|&p| layer.frame.flatten(scene.places.position(p))).collect();
        if !along {
            outline.reverse();
        }
        outline
    };
    pieces[face as usize].iter().map(outline).collect()
}

/// Part of a polygon in a plane, and whether it reaches to the front and back of it.
struct Cut {
    ends: [DVec2; 2],
    front: bool,
    back: bool,
}

/// The segment that a convex polygon has in common with the frame's plane; `None` where that is no segment.
fn cut_by_plane(frame: &Frame, corners: &[DVec3], tolerance: f64) -> Option<Cut> {
    let heights: Vec<f64> = corners
        .iter()
        .map(|&corner| frame.plane.distance(corner))
        .map(|height| if height.abs() <= tolerance { 0.0 } else { height })
        .collect();
    let (front, back) = (heights.iter().any(|&h| h > 0.0), heights.iter().any(|&h| h < 0.0));
    if !front && !back {
        return None;
    }
    let mut points = Vec::new();
    for k in 0..corners.len() {
        let next = (k + 1) % corners.len();
        if heights[k] == 0.0 {
            points.push(frame.flatten(corners[k]));
        } else if heights[k] * heights[next] < 0.0 {
            let t = heights[k] / (heights[k] - heights[next]);
            points.push(frame.flatten(corners[k].lerp(corners[next], t)));
        }
    }
    let pairs = (0..points.len()).flat_map(|i| (i + 1..points.len()).map(move |j| (i, j)));
    let (i, j) = pairs
        .max_by(|&(i, j), &(k, l)| points[i].distance(points[j]).total_cmp(&points[k].distance(points[l])))?;
    let ends = [points[i], points[j]];
    (ends[0].distance(ends[1]) > tolerance / frame.size).then_some(Cut { ends, front, back })
}

/// The parts of collinear segments inside a set of convex outlines, joined where they meet.
fn clipped(cuts: &[[DVec2; 2]], outlines: &[Vec<DVec2>], tolerance: f64) -> Vec<[DVec2; 2]> {
    let Some(&[start, end]) = cuts.first() else { return Vec::new() };
    let length = start.distance(end);
    let direction = (end - start) / length;
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for &[a, b] in cuts {
        let (s, t) = ((a - start).dot(direction), (b - start).dot(direction));
        spans.extend(outlines.iter().filter_map(|outline| {
            inside_outline(start, direction, (s.min(t), s.max(t)), outline, tolerance)
        }));
    }
    spans.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut joined: Vec<(f64, f64)> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span.0 <= last.1 + tolerance => last.1 = last.1.max(span.1),
            _ => joined.push(span),
        }
    }
    joined.retain(|span| span.1 - span.0 > tolerance);
    joined.into_iter().map(|(s, t)| [start + s * direction, start + t * direction]).collect()
}

/// The part of a span of a line within `tolerance` of a convex outline.
fn inside_outline(
    start: DVec2,
    direction: DVec2,
    mut span: (f64, f64),
    outline: &[DVec2],
    tolerance: f64,
) -> Option<(f64, f64)> {
    for (k, &a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        let length = a.distance(b);
        if length == 0.0 {
            continue;
        }
        // Distance to the left of the edge, as a function of the place along the line.
        let (at_start, slope) = (turn(a, b, start) / length, (b - a).perp_dot(direction) / length);
        let at = |s: f64| at_start + slope * s;
        let (low, high) = (at(span.0), at(span.1));
        if low < -tolerance && high < -tolerance {
            return None;
        }
        if low < -tolerance {
            span.0 = -at_start / slope;
        } else if high < -tolerance {
            span.1 = -at_start / slope;
        }
    }
    (span.1 > span.0).then_some(span)
}

/// Whether a segment lies on one edge of a ring.
fn runs_along(ring: &[DVec2], ends: [DVec2; 2], tolerance: f64) -> bool {
    (0..ring.len()).any(|k| {
        let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
        ends.iter().all(|&end| nearest_on_segment(a, b, end).1 <= 2.0 * tolerance)
    })
}
