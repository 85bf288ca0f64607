//! The planar straight-line graph of what is drawn on one plane: borders of faces and contact lines, split where
//! they meet, so that a constrained triangulation can take them.
//!
//! Points closer than a tolerance are one point, and an edge that passes a point within the tolerance is led through
//! it (snap rounding in the sense of Hobby 1999, without the pixel grid). Leading an edge through a point moves it,
//! so the search is repeated until nothing changes.

use crate::frame::{Frame, nearest_on_segment, stepped, turn};
use crate::places::Places;
use crate::triangulation::{Triangulation, Trouble};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Rounds of splitting: every round after the first only follows up moves of one tolerance.
const SPLIT_ROUNDS: usize = 16;
/// A graph that stays tangled is tried again with a tolerance this many times larger, twice.
const COARSER: f64 = 8.0;

/// A point of the graph.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Coordinates in the frame.
    pub uv: DVec2,
    /// Position in space; on the true edge where it splits one, not on the rounded plane.
    pub position: DVec3,
    /// The corner of a face it is, if any.
    pub place: Option<u32>,
}

/// An edge is part of the border of a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Border {
    /// Sheet, by its number within the layer.
    pub sheet: u32,
    /// Whether the sheet's border runs from `from` to `to`.
    pub forward: bool,
}

/// An edge is part of a discontinuity line on a sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contact {
    /// Sheet, by its number within the layer.
    pub sheet: u32,
    /// The other face, or the emitter.
    pub source: u32,
    /// What jumps there: 0 value, 1 slope, 2 curvature.
    pub order: u32,
}

/// A straight edge.
#[derive(Debug, Clone)]
pub struct Edge {
    /// First point.
    pub from: u32,
    /// Second point.
    pub to: u32,
    /// Sheets it borders.
    pub borders: Vec<Border>,
    /// Contacts it is part of.
    pub contacts: Vec<Contact>,
}

/// Points and edges.
#[derive(Debug, Clone, Default)]
pub struct PlanarGraph {
    /// Points.
    pub points: Vec<Point>,
    /// Edges.
    pub edges: Vec<Edge>,
}

impl PlanarGraph {
    /// Adds a corner of a face.
    pub fn corner(&mut self, frame: &Frame, place: u32, position: DVec3) -> u32 {
        self.point(Point { uv: frame.flatten(position), position, place: Some(place) })
    }

    /// Adds a point; its coordinates are [`stepped`].
    pub fn point(&mut self, point: Point) -> u32 {
        self.points.push(Point { uv: stepped(point.uv), ..point });
        (self.points.len() - 1) as u32
    }

    /// Adds a closed border.
    pub fn ring(&mut self, points: &[u32], border: Border) {
        for (k, &from) in points.iter().enumerate() {
            let to = points[(k + 1) % points.len()];
            self.border(from, to, border);
        }
    }

    /// Adds one edge of a border.
    pub fn border(&mut self, from: u32, to: u32, border: Border) {
        self.edges.push(Edge { from, to, borders: vec![border], contacts: Vec::new() });
    }

    /// Adds a discontinuity line between two points.
    pub fn contact(&mut self, from: u32, to: u32, contact: Contact) {
        self.edges.push(Edge { from, to, borders: Vec::new(), contacts: vec![contact] });
    }

    /// Splits edge `edge` in the middle. Returns the new point; the new half is the last edge.
    pub fn halve(&mut self, edge: usize) -> u32 {
        let middle = self.point(self.along(edge, 0.5));
        let to = std::mem::replace(&mut self.edges[edge].to, middle);
        let half = Edge { from: middle, to, ..self.edges[edge].clone() };
        self.edges.push(half);
        middle
    }

    /// Splits every edge into the number of equal parts that `parts` gives for its length.
    pub fn divide(&mut self, parts: impl Fn(f64) -> usize) {
        for edge in 0..self.edges.len() {
            let Edge { from, to, .. } = self.edges[edge];
            let parts = parts(self.points[from as usize].uv.distance(self.points[to as usize].uv));
            let inner: Vec<Point> = (1..parts).map(|k| self.along(edge, k as f64 / parts as f64)).collect();
            self.split_at(edge, &inner);
        }
    }

    /// Splits an edge at points, which stand in order along it.
    fn split_at(&mut self, edge: usize, points: &[Point]) {
        let stops: Vec<u32> = points.iter().map(|&point| self.point(point)).collect();
        self.lead_through(edge, &stops);
    }

    /// Leads an edge through points of the graph, in this order. Edges may then lie on each other until
    /// [`PlanarGraph::join_edges`].
    pub fn lead_through(&mut self, edge: usize, stops: &[u32]) {
        let to = self.edges[edge].to;
        let mut at = edge;
        for &middle in stops {
            self.edges[at].to = middle;
            let rest = Edge { from: middle, to, ..self.edges[at].clone() };
            self.edges.push(rest);
            at = self.edges.len() - 1;
        }
    }

    /// Joins edges between the same points into one.
    pub fn join_edges(&mut self) {
        self.edges = merged(std::mem::take(&mut self.edges));
    }

    /// Splits edges where they meet, merges points and edges that coincide within `tolerance` (in units of the
    /// frame), coarsening it where rounding leaves the graph tangled, and triangulates it.
    pub fn arrange(self, tolerance: f64) -> Result<(PlanarGraph, Triangulation), Trouble> {
        self.arrange_renaming(tolerance).map(|(graph, triangulation, _)| (graph, triangulation))
    }

    /// The same; the last result is the new number of every point there was.
    pub fn arrange_renaming(self, tolerance: f64) -> Result<(PlanarGraph, Triangulation, Vec<u32>), Trouble> {
        let attempt = |tolerance: f64| {
            let mut graph = self.clone();
            let renamed = graph.split(tolerance)?;
            let triangulation = graph.triangulate()?;
            Ok((graph, triangulation, renamed))
        };
        attempt(tolerance)
            .or_else(|_: Trouble| attempt(COARSER * tolerance))
            .or_else(|_| attempt(COARSER * COARSER * tolerance))
    }

    /// Constrained Delaunay triangulation of all points, with all edges as constraints.
    pub fn triangulate(&self) -> Result<Triangulation, Trouble> {
        Triangulation::new(self)
    }

    /// Returns the new number of every point there was.
    fn split(&mut self, tolerance: f64) -> Result<Vec<u32>, Trouble> {
        let mut places = Places::new(DVec3::ZERO, tolerance);
        let renamed = self.merge_points(&mut places);
        for _ in 0..SPLIT_ROUNDS {
            let splits = self.find_splits(&mut places, tolerance);
            if splits.iter().all(Vec::is_empty) {
                self.edges.retain(|edge| !edge.borders.is_empty() || !edge.contacts.is_empty());
                return Ok(renamed);
            }
            let mut parts = Vec::new();
            for (edge, mut splits) in self.edges.drain(..).zip(splits) {
                splits.sort_by(|a, b| a.0.total_cmp(&b.0));
                let stops = splits.into_iter().map(|(_, point)| point).chain([edge.to]);
                let mut from = edge.from;
                for to in stops {
                    parts.push(Edge { from, to, ..edge.clone() });
                    from = to;
                }
            }
            self.edges = merged(parts);
        }
        Err(Trouble::Tangled)
    }

    /// Replaces points by the first one within the tolerance; returns the new number of every point there was.
    fn merge_points(&mut self, places: &mut Places) -> Vec<u32> {
        let mut kept = Vec::new();
        let renamed: Vec<u32> = self
            .points
            .iter()
            .map(|point| {
                let place = places.insert(point.uv.extend(0.0));
                if place as usize == kept.len() {
                    kept.push(*point);
                }
                place
            })
            .collect();
        self.points = kept;
        for edge in &mut self.edges {
            (edge.from, edge.to) = (renamed[edge.from as usize], renamed[edge.to as usize]);
        }
        self.join_edges();
        renamed
    }

    /// For each edge the points that lie on it or where it crosses another, with their place along it.
    fn find_splits(&mut self, places: &mut Places, tolerance: f64) -> Vec<Vec<(f64, u32)>> {
        let ends = |edge: &Edge| [edge.from, edge.to].map(|p| self.points[p as usize].uv);
        let boxes: Vec<(DVec2, DVec2)> = self
            .edges
            .iter()
            .map(|edge| {
                let [a, b] = ends(edge);
                (a.min(b) - tolerance, a.max(b) + tolerance)
            })
            .collect();
        // Sweep along u: only edges whose ranges overlap are compared.
        let mut order: Vec<usize> = (0..self.edges.len()).collect();
        order.sort_by(|&i, &j| boxes[i].0.x.total_cmp(&boxes[j].0.x).then(i.cmp(&j)));
        let mut pairs = Vec::new();
        for (k, &i) in order.iter().enumerate() {
            let later = order[k + 1..].iter().take_while(|&&j| boxes[j].0.x <= boxes[i].1.x);
            let near = later.filter(|&&j| boxes[i].0.y <= boxes[j].1.y && boxes[j].0.y <= boxes[i].1.y);
            pairs.extend(near.map(|&j| (i.min(j), i.max(j))));
        }
        pairs.sort_unstable();

        let mut splits = vec![Vec::new(); self.edges.len()];
        for (i, j) in pairs {
            let touching = [(i, j), (j, i)].map(|(edge, other)| {
                let Edge { from, to, .. } = self.edges[edge];
                let [a, b] = [from, to].map(|p| self.points[p as usize].uv);
                let mut any = false;
                for point in [self.edges[other].from, self.edges[other].to] {
                    if point == from || point == to {
                        any = true;
                        continue;
                    }
                    let (along, distance) = nearest_on_segment(a, b, self.points[point as usize].uv);
                    if distance <= tolerance {
                        splits[edge].push((along, point));
                        any = true;
                    }
                }
                any
            });
            if touching == [false, false]
                && let Some((along_i, along_j)) = self.crossing(i, j)
            {
                let crossing = self.along(i, along_i);
                let point = places.insert(stepped(crossing.uv).extend(0.0));
                if point as usize == self.points.len() {
                    self.point(crossing);
                }
                splits[i].push((along_i, point));
                splits[j].push((along_j, point));
            }
        }
        for (edge, splits) in self.edges.iter().zip(&mut splits) {
            splits.retain(|&(_, point)| point != edge.from && point != edge.to);
        }
        splits
    }

    /// Where two edges cross, as places along them.
    fn crossing(&self, i: usize, j: usize) -> Option<(f64, f64)> {
        let [[a, b], [c, d]] =
            [i, j].map(|e| [self.edges[e].from, self.edges[e].to].map(|p| self.points[p as usize].uv));
        let (side_a, side_b) = (turn(c, d, a), turn(c, d, b));
        let (side_c, side_d) = (turn(a, b, c), turn(a, b, d));
        let cross = (side_a > 0.0) != (side_b > 0.0) && (side_c > 0.0) != (side_d > 0.0);
        cross.then(|| (side_a / (side_a - side_b), side_c / (side_c - side_d)))
    }

    /// The point at `t` (0 to 1) along an edge.
    pub fn along(&self, edge: usize, t: f64) -> Point {
        let [a, b] = [self.edges[edge].from, self.edges[edge].to].map(|p| self.points[p as usize]);
        Point { uv: a.uv.lerp(b.uv, t), position: a.position.lerp(b.position, t), place: None }
    }
}

/// Edges with those between the same points joined into one, and those of no length dropped.
fn merged(edges: Vec<Edge>) -> Vec<Edge> {
    let mut kept: Vec<Edge> = Vec::with_capacity(edges.len());
    let mut seen: HashMap<(u32, u32), usize> = HashMap::new();
    for edge in edges {
        if edge.from == edge.to {
            continue;
        }
        let ends = (edge.from.min(edge.to), edge.from.max(edge.to));
        let Some(&first) = seen.get(&ends) else {
            seen.insert(ends, kept.len());
            kept.push(edge);
            continue;
        };
        let first = &mut kept[first];
        let same_way = first.from == edge.from;
        for border in edge.borders.iter().map(|b| Border { forward: b.forward == same_way, ..*b }) {
            // There and back: a seam between parts of one sheet.
            let back = Border { forward: !border.forward, ..border };
            match first.borders.iter().position(|b| *b == back) {
                Some(seam) => drop(first.borders.remove(seam)),
                None => first.borders.push(border),
            }
        }
        for contact in edge.contacts {
            if !first.contacts.contains(&contact) {
                first.contacts.push(contact);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn graph(segments: &[(f64, f64, f64, f64)]) -> PlanarGraph {
        let mut graph = PlanarGraph::default();
        let point = |x: f64, y: f64, graph: &mut PlanarGraph| {
            graph.point(Point { uv: DVec2::new(x, y), position: DVec3::new(x, y, 0.0), place: None })
        };
        for (k, &(a, b, c, d)) in segments.iter().enumerate() {
            let (from, to) = (point(a, b, &mut graph), point(c, d, &mut graph));
            graph.contact(from, to, Contact { sheet: 0, source: k as u32, order: 0 });
        }
        graph
    }

    #[test]
    fn crossing_touching_and_overlapping_edges_are_split() {
        let cross = graph(&[(0.0, 0.0, 1.0, 1.0), (0.0, 1.0, 1.0, 0.0)]).arrange(1e-9).unwrap().0;
        assert_eq!((cross.points.len(), cross.edges.len()), (5, 4));
        let tee = graph(&[(0.0, 0.0, 1.0, 0.0), (0.5, 1e-10, 0.5, 1.0)]).arrange(1e-9).unwrap().0;
        assert_eq!((tee.points.len(), tee.edges.len()), (4, 3));
        let overlap = graph(&[(0.0, 0.0, 0.7, 0.0), (0.3, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 1.0)]);
        let overlap = overlap.arrange(1e-9).unwrap().0;
        assert_eq!((overlap.points.len(), overlap.edges.len()), (5, 4));
        assert_eq!(overlap.edges.iter().filter(|e| e.contacts.len() == 2).count(), 1);
    }

    #[test]
    fn many_nearly_parallel_edges_come_apart() {
        let fan: Vec<_> = (0..60)
            .map(|k| {
                let tilt = 1e-10 * f64::from(k * k);
                (0.0, tilt, 1.0, -tilt)
            })
            .collect();
        let (graph, triangulation) = graph(&fan).arrange(1e-9).unwrap();
        assert!(graph.edges.len() >= 2);
        assert!(
            triangulation
                .triangles
                .iter()
                .all(|t| t.corners.iter().all(|&p| (p as usize) < graph.points.len()))
        );
    }
}
