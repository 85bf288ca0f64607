//! What the two ways of making elements (as given, meshed) hand on: the elements of one layer.

use crate::planar::Point;

/// A convex polygon of one sheet.
#[derive(Debug, Clone)]
pub struct PatchElement {
    /// Points, counter-clockwise in the layer's frame.
    pub corners: Vec<u32>,
    /// For each edge (from corner k to k + 1) whether a value discontinuity runs along it.
    pub seams: Vec<bool>,
    /// Sheet, by its number within the layer.
    pub sheet: u32,
}

/// A piece of a discontinuity line that is an edge of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PatchLine {
    /// Sheet it lies on.
    pub sheet: u32,
    /// First point.
    pub from: u32,
    /// Second point.
    pub to: u32,
    /// 0 value, 1 slope, 2 curvature.
    pub order: u32,
    /// Face in contact, or the emitter.
    pub source: u32,
}

/// Elements of one layer.
#[derive(Debug, Clone, Default)]
pub struct Patch {
    /// Points.
    pub points: Vec<Point>,
    /// Elements.
    pub elements: Vec<PatchElement>,
    /// Discontinuity lines.
    pub lines: Vec<PatchLine>,
    /// Area of each sheet that is hidden and has no elements: sheet and area.
    pub hidden: Vec<(u32, f64)>,
    /// Area that sheets would have where another holds the place.
    pub overlapped: f64,
    /// Emitters that lost part of their area to another face: sheet and the one that holds it.
    pub lost_emitters: Vec<(u32, u32)>,
    /// Sheets that lost part of their area to another.
    pub overlapping: usize,
    /// Sheets cut along a line where another face pokes through.
    pub crossing: usize,
    /// Contact lines on the layer, before they are split.
    pub contacts: usize,
}
