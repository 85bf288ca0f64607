//! Seeds: a triangular lattice of points inside the sheets of a layer, along the frame's first axis and fitted to
//! their bounding box, so that the triangles of a plain wall are nearly equilateral. For the same number of
//! elements these interpolate with 3/4 of the error of halved squares (the error grows with the square of the
//! smallest enclosing circle's radius).

use crate::frame::{contains, nearest_on_segment};
use crate::planar::PlanarGraph;
use glam::DVec2;
use std::collections::HashMap;

/// Seeds keep this part of the spacing away from every edge. The outermost points of every second row lie half a
/// spacing inside the wall: they stay.
const CLEARANCE: f64 = 0.45;

/// Points of a lattice with this spacing inside the polygons `rings`, outside the `holes` and clear of the edges of
/// `graph`, which are no longer than about the spacing.
pub fn lattice(graph: &PlanarGraph, rings: &[Vec<DVec2>], holes: &[Vec<DVec2>], spacing: f64) -> Vec<DVec2> {
    let edges = EdgeGrid::new(graph, spacing);
    let low = rings.iter().flatten().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = rings.iter().flatten().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let extent = high - low;
    let columns = (extent.x / spacing - 1e-6).round().max(1.0);
    let rows = (extent.y / (spacing * 0.75f64.sqrt()) - 1e-6).round().max(1.0);
    let step = DVec2::new(extent.x / columns, extent.y / rows);
    let boxes: Vec<(DVec2, DVec2)> = rings
        .iter()
        .map(|ring| {
            let low = ring.iter().copied().fold(DVec2::INFINITY, DVec2::min);
            (low, ring.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max))
        })
        .collect();
    let mut points = Vec::new();
    for row in 1..rows as usize {
        let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
        for column in 0..=columns as usize {
            let point = low + step * DVec2::new(column as f64 + shift, row as f64);
            let in_box = |(low, high): &(DVec2, DVec2)| low.cmple(point).all() && point.cmple(*high).all();
            let inside = rings.iter().zip(&boxes).any(|(ring, b)| in_box(b) && contains(ring, point));
            let clear = || edges.distance(point) >= CLEARANCE * spacing;
            if inside && clear() && !holes.iter().any(|hole| contains(hole, point)) {
                points.push(point);
            }
        }
    }
    points
}

/// Edges by the cells of a square grid near which they pass.
struct EdgeGrid {
    cell: f64,
    cells: HashMap<(i64, i64), Vec<[DVec2; 2]>>,
}

impl EdgeGrid {
    fn new(graph: &PlanarGraph, cell: f64) -> Self {
        let mut cells: HashMap<(i64, i64), Vec<[DVec2; 2]>> = HashMap::new();
        for edge in &graph.edges {
            let ends = [edge.from, edge.to].map(|p| graph.points[p as usize].uv);
            let (low, high) = (ends[0].min(ends[1]) / cell, ends[0].max(ends[1]) / cell);
            for x in low.x.floor() as i64 - 1..=high.x.floor() as i64 + 1 {
                for y in low.y.floor() as i64 - 1..=high.y.floor() as i64 + 1 {
                    cells.entry((x, y)).or_default().push(ends);
                }
            }
        }
        Self { cell, cells }
    }

    /// Distance to the nearest edge, infinite where none passes within a cell.
    fn distance(&self, point: DVec2) -> f64 {
        let cell = ((point.x / self.cell).floor() as i64, (point.y / self.cell).floor() as i64);
        let near = self.cells.get(&cell).map_or(&[][..], Vec::as_slice);
        near.iter().map(|&[a, b]| nearest_on_segment(a, b, point).1).fold(f64::INFINITY, f64::min)
    }
}
