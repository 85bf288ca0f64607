//! The part of a polygon that a point sees past any number of shadows, exactly: each shadow's half-spaces are cut out of
//! the visible pieces, and the pieces are summed by Lambert's formula.
//!
//! # Precision
//! Cuts are interpolations along edges; there is no epsilon.

use crate::point_factor::above_horizon;
use crate::point_shadow::{Candidate, PointShadows};
use crate::polygon;
use crate::shadow::{From, HalfSpace, Shadows};
use glam::DVec3;
use std::ops::Range;

/// Convex polygons in one flat array, reused from call to call.
#[derive(Debug, Clone, Default)]
pub(crate) struct Polygons {
    points: Vec<DVec3>,
    ends: Vec<usize>,
}

impl Polygons {
    fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
    }

    fn push(&mut self, polygon: &[DVec3]) {
        if polygon.len() >= 3 {
            self.points.extend_from_slice(polygon);
            self.ends.push(self.points.len());
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.points[start..end])
    }
}

/// The pieces of one polygon that are still seen, with working memory for cutting them.
#[derive(Debug, Clone, Default)]
pub struct Pieces {
    pieces: Polygons,
    next: Polygons,
    rest: Vec<DVec3>,
    cut: Vec<DVec3>,
    half_spaces: Vec<HalfSpace>,
    heights: Vec<f64>,
}

impl Pieces {
    /// What the shadows of the `candidates` leave in sight of a convex polygon that is given from the point.
    pub(crate) fn visible(
        &mut self,
        corners: &[DVec3],
        candidates: &[Candidate],
        shadows: &PointShadows,
    ) -> &Polygons {
        self.start(corners.iter().copied());
        for &candidate in candidates {
            shadows.half_spaces(candidate, &mut self.half_spaces);
            self.subtract();
            if self.pieces.ends.is_empty() {
                break;
            }
        }
        &self.pieces
    }

    fn start(&mut self, corners: impl Iterator<Item = DVec3>) {
        self.pieces.clear();
        self.pieces.points.extend(corners);
        self.pieces.ends.push(self.pieces.points.len());
    }

    /// Takes what lies in all half-spaces out of the pieces.
    fn subtract(&mut self) {
        let Pieces { pieces, next, rest, cut, half_spaces, heights } = self;
        next.clear();
        for piece in pieces.iter() {
            subtract(piece, half_spaces, next, rest, cut, heights);
        }
        std::mem::swap(pieces, next);
    }

    fn factor(&self, normal: DVec3) -> f64 {
        self.pieces.iter().map(|piece| above_horizon(DVec3::ZERO, normal, piece)).sum::<f64>().max(0.0)
    }
}

/// Form factor from a surface element at `point` with unit `normal` to the front of a convex polygon that lies above the
/// element's horizon, as far as the shadows `which` leave it in sight.
pub fn visible_factor(
    point: DVec3,
    normal: DVec3,
    corners: &[DVec3],
    shadows: &Shadows<'_>,
    which: Range<usize>,
    from: From,
    scratch: &mut Pieces,
) -> f64 {
    scratch.start(corners.iter().map(|&c| c - point));
    for at in which {
        if !shadows.half_spaces(at, from, point, &mut scratch.half_spaces) {
            continue;
        }
        scratch.subtract();
        if scratch.pieces.ends.is_empty() {
            return 0.0;
        }
    }
    scratch.factor(normal)
}

/// Appends to `out` the parts of a convex piece that lie outside some half-space.
fn subtract(
    piece: &[DVec3],
    half_spaces: &[HalfSpace],
    out: &mut Polygons,
    rest: &mut Vec<DVec3>,
    cut: &mut Vec<DVec3>,
    heights: &mut Vec<f64>,
) {
    let first = (out.points.len(), out.ends.len());
    rest.clear();
    rest.extend_from_slice(piece);
    for space in half_spaces {
        heights.clear();
        heights.extend(rest.iter().map(|&r| space.normal.dot(r) + space.offset));
        if heights.iter().all(|&h| h >= 0.0) {
            continue;
        }
        if heights.iter().all(|&h| h <= 0.0) {
            // Nothing is hidden after all: the piece stays whole instead of in parts.
            out.points.truncate(first.0);
            out.ends.truncate(first.1);
            out.push(piece);
            return;
        }
        polygon::cut_in_two(rest, heights, cut, &mut out.points);
        out.ends.push(out.points.len());
        std::mem::swap(rest, cut);
    }
}
