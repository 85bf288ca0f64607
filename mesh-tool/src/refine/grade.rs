//! Grading: elements beside much smaller ones are divided until no two neighbours differ by more than a factor two.
//!
//! Refinement grades only down to its floor, and what splits edges afterwards (planes that meet) makes small elements
//! beside large ones anew; so this is done again at the end, without that floor. Only edges of the larger element are
//! halved and no point moves: what is even already stays.

use super::{Change, GRADING, Refinement, Shape};
use crate::triangulation::{Triangle, Triangulation, Trouble};
use std::collections::BTreeSet;

/// Rounds end here at the latest: each halves what is too large, and sizes differ by less than 2^40.
const ROUNDS: usize = 40;
/// Sizes that are two to one but for rounding are not more than that.
const ROUNDING: f64 = 1e-9;
/// In a strip an edge along its side is halved in place of a longer one across it, if it has at least this part of its
/// length: a point within the strip would only make it two strips.
const ALONG: f64 = 0.6;

impl Refinement {
    /// Halves edges until neighbours differ by no more than [`GRADING`], none to less than `shortest`, in units of the
    /// frame. `None` where nothing is to be halved.
    pub fn grade(
        &mut self,
        triangulation: &Triangulation,
        shortest: f64,
    ) -> Result<Option<Triangulation>, Trouble> {
        let mut graded: Option<Triangulation> = None;
        for _ in 0..ROUNDS {
            let changes = self.gradings(graded.as_ref().unwrap_or(triangulation), shortest);
            if changes.is_empty() {
                break;
            }
            self.apply(&changes);
            graded = Some(self.graph.triangulate()?);
        }
        Ok(graded)
    }

    /// How many triangles are more than [`GRADING`] times as large as a neighbour: grading divides at least these.
    pub fn uneven(&self, triangulation: &Triangulation) -> usize {
        let lit = triangulation.triangles.iter().enumerate().filter(|(t, _)| triangulation.is_lit(*t));
        lit.filter(|(_, triangle)| self.too_large(triangulation, triangle, &self.shape(triangle))).count()
    }

    /// Whether a triangle is more than [`GRADING`] times as large as a neighbour.
    fn too_large(&self, triangulation: &Triangulation, triangle: &Triangle, shape: &Shape) -> bool {
        shape.longest > (1.0 + ROUNDING) * GRADING * self.smallest_neighbour(triangulation, triangle)
    }

    /// The edges to be halved, each once.
    fn gradings(&self, triangulation: &Triangulation, shortest: f64) -> Vec<(Change, f64)> {
        let (mut seen, mut changes) = (BTreeSet::new(), Vec::new());
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            if !triangulation.is_lit(t) {
                continue;
            }
            let shape = self.shape(triangle);
            if !self.too_large(triangulation, triangle, &shape) {
                continue;
            }
            let k = self.graded_edge(triangle, &shape);
            let [a, b] = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
            let length = self.uv(a).distance(self.uv(b));
            if length >= 2.0 * shortest && seen.insert((a.min(b), a.max(b))) {
                changes.push((self.middle(triangle, k), 0.5 * length));
            }
        }
        changes
    }

    /// Whether a triangle lies between edges of the graph, as wide as it can be for their distance.
    fn in_strip(&self, triangle: &Triangle) -> bool {
        triangle.corners.iter().all(|&corner| !self.free[corner as usize])
    }

    /// The edge of a triangle that is halved: the longest, in a strip one along it.
    fn graded_edge(&self, triangle: &Triangle, shape: &Shape) -> usize {
        if !self.in_strip(triangle) {
            return shape.longest_edge;
        }
        let length = |k: usize| self.uv(triangle.corners[k]).distance(self.uv(triangle.corners[(k + 1) % 3]));
        let along = (0..3).filter(|&k| triangle.constraints[k].is_some());
        let longest = along.max_by(|&a, &b| length(a).total_cmp(&length(b)));
        longest.filter(|&k| length(k) >= ALONG * shape.longest).unwrap_or(shape.longest_edge)
    }
}
