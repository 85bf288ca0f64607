//! Changes to the edges of a triangulated layer: points put on them, moved and joined, and lines added.

use super::Refinement;
use crate::conform::EdgeSplit;
use crate::frame::{Frame, stepped};
use crate::planar::{Contact, Point};
use crate::triangulation::{Triangulation, Trouble, grid_place};
use glam::DVec3;
use std::collections::HashMap;

impl Refinement {
    /// Splits edges at points, which stand in order along them; with `widen`, widens the small angles this makes. Where
    /// edges then tangle, they are joined within `tolerance`, in units of the frame.
    pub fn split_edges(
        &mut self,
        splits: &[EdgeSplit],
        frame: &Frame,
        widen: bool,
        tolerance: f64,
    ) -> Result<Triangulation, Trouble> {
        let first_new = self.graph.points.len();
        // Edges that pass one place closely are all led through the one point there, and so join up to where they part.
        let mut known: HashMap<[u64; 2], u32> = HashMap::new();
        for (k, point) in self.graph.points.iter().enumerate() {
            known.insert(grid_place(point.uv), k as u32);
        }
        for (edge, points) in splits {
            let ends = [self.graph.edges[*edge].from, self.graph.edges[*edge].to];
            let size = ends.iter().map(|&p| self.sizes[p as usize]).fold(0.0, f64::max);
            let mut stops = Vec::new();
            for &(_, position) in points {
                let point = Point { uv: stepped(frame.flatten(position)), position, place: None };
                let stop = *known.entry(grid_place(point.uv)).or_insert_with(|| {
                    self.free.push(false);
                    self.sizes.push(size);
                    self.graph.point(point)
                });
                if std::mem::replace(&mut self.free[stop as usize], false) {
                    self.graph.points[stop as usize].position = position;
                }
                stops.push(stop);
            }
            self.graph.lead_through(*edge, &stops);
        }
        self.graph.join_edges();
        let split = if widen { self.clone().widened(first_new) } else { self.clone().triangulated() };
        let (refinement, triangulation) = split.or_else(|_| {
            self.arrange(0.5 * tolerance).map(|(_, triangulation)| (self.clone(), triangulation))
        })?;
        *self = refinement;
        Ok(triangulation)
    }

    /// Moves points; those that get to one place are joined, and edges that then pass another point closely are led
    /// through it. `None` where the triangulation stays as it is: all moved less than it can tell.
    pub fn move_points(
        &mut self,
        moves: impl Iterator<Item = (usize, DVec3)>,
        frame: &Frame,
        tolerance: f64,
    ) -> Result<Option<Triangulation>, Trouble> {
        let mut far = false;
        for (point, position) in moves {
            let point = &mut self.graph.points[point];
            if point.position != position {
                let uv = stepped(frame.flatten(position));
                far |= grid_place(uv) != grid_place(point.uv);
                (point.uv, point.position) = (uv, position);
            }
        }
        // Half the tolerance: places are further apart than that, so that only equal ones are joined.
        if far {
            self.arrange(0.5 * tolerance).map(|(_, triangulation)| Some(triangulation))
        } else {
            Ok(None)
        }
    }

    /// Adds a line that may cross others; to be followed by [`Refinement::rearrange`].
    pub fn add_line(&mut self, ends: [DVec3; 2], contact: Contact, frame: &Frame) {
        let [from, to] = ends
            .map(|position| self.graph.point(Point { uv: frame.flatten(position), position, place: None }));
        self.graph.contact(from, to, contact);
    }

    /// Splits edges where they cross after lines were added.
    pub fn rearrange(&mut self, tolerance: f64) -> Result<Triangulation, Trouble> {
        let first_new = self.arrange(tolerance)?.0;
        self.widen(first_new)
    }

    /// Splits and joins edges where they meet within the tolerance; also returns the number of the first new point.
    fn arrange(&mut self, tolerance: f64) -> Result<(usize, Triangulation), Trouble> {
        let (graph, triangulation, renamed) = self.graph.clone().arrange_renaming(tolerance)?;
        let count = graph.points.len();
        let (mut free, mut sizes) = (vec![true; count], vec![self.target.spacing; count]);
        for (old, &new) in renamed.iter().enumerate() {
            // Points that were added have no size of their own yet.
            sizes[new as usize] = self.sizes.get(old).copied().unwrap_or(self.target.spacing);
        }
        for edge in &graph.edges {
            for point in [edge.from, edge.to] {
                free[point as usize] = false;
            }
        }
        (self.graph, self.free, self.sizes) = (graph, free, sizes);
        Ok((renamed.iter().max().map_or(0, |&last| last as usize + 1), triangulation))
    }

    fn widened(mut self, first_new: usize) -> Result<(Self, Triangulation), Trouble> {
        let triangulation = self.widen(first_new)?;
        Ok((self, triangulation))
    }

    fn triangulated(self) -> Result<(Self, Triangulation), Trouble> {
        let triangulation = self.graph.triangulate()?;
        Ok((self, triangulation))
    }
}
