//! Meshing: all sheets of a layer are triangulated together, so that their elements meet edge to edge, with the
//! borders of the faces and the contact lines as edges.

use crate::arranged::{Arranged, arranged};
use crate::clean::Cleaned;
use crate::conform::EdgeSplit;
use crate::contact::{ContactLine, Pieces, contact_lines};
use crate::discontinuity::{DrawnLine, Order};
use crate::frame::stepped;
use crate::hidden::{HIDDEN, HiddenParts};
use crate::patch::{Patch, PatchElement, PatchLine};
use crate::planar::{Contact, PlanarGraph};
use crate::refine::{Refinement, Target};
use crate::regions::{overlapped_area, winner};
use crate::seeds::lattice;
use crate::sheets::Layer;
use crate::solids::Solids;
use crate::steps::{Off, Step};
use crate::triangulation::{Triangulation, Trouble};
use geometry::polygon;
use glam::{DVec2, DVec3};

/// Edges of the graph may be longer than the spacing by this part before they are split once more.
const SLACK: f64 = 0.2;

/// A layer in triangles that can be refined further.
#[derive(Debug, Clone)]
pub struct Triangles {
    refinement: Refinement,
    triangulation: Triangulation,
    /// Sheet that holds each triangle; triangles without one are not part of the scene.
    winners: Vec<Option<u32>>,
}

impl Triangles {
    /// Number of triangles that become elements.
    pub fn count(&self) -> usize {
        self.winners.iter().flatten().count()
    }

    /// Triangles more than twice as large as a neighbour.
    pub fn uneven(&self) -> usize {
        self.refinement.uneven(&self.triangulation)
    }

    /// Sheet that holds a triangle.
    pub fn sheet(&self, triangle: usize) -> Option<u32> {
        self.winners[triangle]
    }

    /// Points on edges of the graph, which no smoothing moves: number and position.
    pub fn fixed_points(&self) -> impl Iterator<Item = (usize, DVec3)> + '_ {
        let Refinement { graph, free, .. } = &self.refinement;
        graph.points.iter().enumerate().filter(|(k, _)| !free[*k]).map(|(k, point)| (k, point.position))
    }

    /// Points on the edges of the graph that elements have.
    pub fn edge_points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.edges().flat_map(|(_, ends)| ends)
    }

    /// Edges of the graph that elements have, with their ends.
    pub fn edges(&self) -> impl Iterator<Item = (usize, [DVec3; 2])> + '_ {
        let graph = &self.refinement.graph;
        let mut used = vec![false; graph.edges.len()];
        for (t, triangle) in self.triangulation.triangles.iter().enumerate() {
            if self.winners[t].is_some() {
                triangle.constraints.into_iter().flatten().for_each(|edge| used[edge as usize] = true);
            }
        }
        let ends = |k: usize| {
            let edge = &graph.edges[k];
            [edge.from, edge.to].map(|p| graph.points[p as usize].position)
        };
        (0..graph.edges.len()).filter(move |&k| used[k]).map(move |k| (k, ends(k)))
    }

    /// The triangles that become elements: number and corners, counter-clockwise in the layer's frame.
    pub fn elements(&self) -> impl Iterator<Item = (usize, [DVec3; 3])> + '_ {
        let corners = |t: usize| {
            self.triangulation.triangles[t].corners.map(|p| self.refinement.graph.points[p as usize].position)
        };
        (0..self.winners.len()).filter(|&t| self.winners[t].is_some()).map(move |t| (t, corners(t)))
    }
}

/// A layer ready to be meshed at any size: everything that does not depend on the size is done.
#[derive(Debug, Clone)]
pub struct Drawing {
    layer: Layer,
    graph: PlanarGraph,
    rings: Vec<Vec<DVec2>>,
    hidden: HiddenParts,
    contacts: usize,
    overlapping: usize,
    overlapped: f64,
    crossing: usize,
    lost_emitters: Vec<(u32, u32)>,
    /// Lines that are gone, because others pass too close.
    pub gone: usize,
    /// Area that the elements will cover, in square units of length.
    pub area: f64,
}

/// What is drawn on a layer besides the borders of its faces.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// Convex pieces of all faces.
    pub pieces: &'a Pieces,
    /// Discontinuity lines of the whole scene.
    pub lines: &'a [DrawnLine],
    /// Lines keep this distance from each other and from borders, in units of length.
    pub nearness: f64,
    /// Highest order that is wished.
    pub order: Order,
    /// Bodies that hide parts.
    pub solids: &'a Solids,
    /// Steps of cleaning that are switched off.
    pub off: &'a Off<Step>,
}

impl Drawing {
    /// Draws the borders and lines of a layer and splits them where they meet. `opposite` is the layer of the same plane
    /// that looks the other way.
    pub fn new(
        layer: Layer,
        opposite: Option<&Layer>,
        scene: &Cleaned,
        drawn_lines: Drawn,
    ) -> Result<Drawing, Trouble> {
        let Drawn { pieces, lines, nearness, order, solids, off } = drawn_lines;
        let mut contacts = contact_lines(&layer, scene, pieces);
        contacts.retain(|line| off.leaves(if line.crosses { Step::Cross } else { Step::Meet }));
        // Where faces lie too close to be told apart, nothing is taken for hidden.
        let hidden = HiddenParts::of(&layer, opposite, &contacts, scene, solids).unwrap_or_default();
        let Arranged { mut graph, triangulation, hidden, gone } =
            arranged(&layer, scene, &contacts, hidden, lines, nearness)?;
        let rings = layer
            .sheets
            .iter()
            .map(|sheet| {
                let at = |&p: &u32| stepped(layer.frame.flatten(scene.places.position(p)));
                sheet.ring.iter().map(at).collect()
            })
            .collect();
        let (mut area, mut losers) = (0.0, std::collections::BTreeMap::new());
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            let Some(winner) = winner(&layer, &triangulation, t) else { continue };
            if triangulation.is_lit(t) {
                area += polygon::area(&triangle.corners.map(|p| graph.points[p as usize].position));
            }
            let holders = triangulation.sheets(t).filter(|&(sheet, w)| w > 0 && sheet != HIDDEN);
            for (sheet, _) in holders.filter(|&(sheet, _)| sheet != winner) {
                losers.entry(sheet).or_insert(winner);
            }
        }
        if order == Order::Off {
            // Elements still meet there, but nothing jumps.
            graph.edges.iter_mut().for_each(|edge| edge.contacts.clear());
        }
        let within: Vec<&ContactLine> = contacts.iter().filter(|line| !line.along_border).collect();
        let mut crossed: Vec<u32> = within.iter().filter(|l| l.crosses).map(|line| line.sheet).collect();
        crossed.sort_unstable();
        crossed.dedup();
        let emits = |sheet: &u32| scene.faces[layer.sheets[*sheet as usize].face as usize].emits;
        let overlapped = overlapped_area(&layer, &graph, &triangulation, |_| true);
        Ok(Drawing {
            graph,
            rings,
            hidden,
            contacts: within.len(),
            overlapping: losers.len(),
            overlapped,
            crossing: crossed.len(),
            lost_emitters: losers.into_iter().filter(|(sheet, _)| emits(sheet)).collect(),
            gone,
            area,
            layer,
        })
    }

    /// Unit normal of where the layer looks.
    pub fn normal(&self) -> DVec3 {
        if self.layer.reversed { -self.layer.frame.plane.normal } else { self.layer.frame.plane.normal }
    }

    /// The layer.
    pub fn layer(&self) -> &Layer {
        &self.layer
    }

    /// Triangles with edges of about `spacing` and none longer than `max_edge`, both in units of length; none is made
    /// shorter than `floor` times the spacing for the sake of shape.
    pub fn mesh(&self, spacing: f64, max_edge: f64, floor: f64) -> Result<Triangles, Trouble> {
        let size = self.layer.frame.size;
        let target = Target { spacing: spacing / size, max_edge: max_edge / size, floor };
        let mut graph = self.graph.clone();
        graph.divide(|length| (length / target.spacing - SLACK).ceil().max(1.0) as usize);
        let seeds = lattice(&graph, &self.rings, &self.hidden.rings, target.spacing);
        let mut refinement = Refinement::new(graph, &seeds, target);
        let triangulation = refinement.run()?;
        Ok(self.owned(refinement, triangulation))
    }

    /// Halves the edges of the triangles `marked` (by their number in `triangles`) that are at least the part `long` of
    /// their longest and twice as long as `shortest`, in units of length. `false` where there are none.
    pub fn halve(
        &self,
        triangles: &mut Triangles,
        marked: &[usize],
        long: f64,
        shortest: f64,
    ) -> Result<bool, Trouble> {
        let shortest = shortest / self.layer.frame.size;
        let halved =
            triangles.refinement.halve_triangles(&triangles.triangulation, marked, long, shortest)?;
        let Some(triangulation) = halved else { return Ok(false) };
        let refinement = triangles.refinement.clone();
        *triangles = self.owned(refinement, triangulation);
        Ok(true)
    }

    /// Divides triangles beside much smaller ones, halving no edge to less than `shortest`, in units of length. `false` where there are none.
    pub fn grade(&self, triangles: &mut Triangles, shortest: f64) -> Result<bool, Trouble> {
        let mut refinement = triangles.refinement.clone();
        let graded = refinement.grade(&triangles.triangulation, shortest / self.layer.frame.size)?;
        let Some(triangulation) = graded else { return Ok(false) };
        *triangles = self.owned(refinement, triangulation);
        Ok(true)
    }

    /// Draws more lines through a mesh; what they do not touch stays as it is.
    pub fn draw_more(
        &self,
        triangles: &mut Triangles,
        lines: &[DrawnLine],
        tolerance: f64,
    ) -> Result<(), Trouble> {
        let mut refinement = triangles.refinement.clone();
        let mut any = false;
        for (index, sheet) in self.layer.sheets.iter().enumerate() {
            for line in lines.iter().filter(|line| line.face == sheet.face && line.side == sheet.side) {
                let contact = Contact { sheet: index as u32, source: line.source, order: line.order };
                refinement.add_line(line.ends, contact, &self.layer.frame);
                any = true;
            }
        }
        if any {
            let triangulation = refinement.rearrange(tolerance / self.layer.frame.size)?;
            *triangles = self.owned(refinement, triangulation);
        }
        Ok(())
    }

    /// Moves points by no more than `tolerance`, in units of length, and joins those that get to one place.
    pub fn move_points(
        &self,
        triangles: &mut Triangles,
        moves: impl Iterator<Item = (usize, DVec3)>,
        tolerance: f64,
    ) -> Result<(), Trouble> {
        let tolerance = tolerance / self.layer.frame.size;
        let mut refinement = triangles.refinement.clone();
        match refinement.move_points(moves, &self.layer.frame, tolerance)? {
            Some(triangulation) => *triangles = self.owned(refinement, triangulation),
            None => triangles.refinement = refinement,
        }
        Ok(())
    }

    /// Splits edges of the graph at given points; with `widen`, widens the small angles that this makes. What tangles is
    /// joined within `tolerance`, in units of length.
    pub fn split_edges(
        &self,
        triangles: &mut Triangles,
        splits: &[EdgeSplit],
        widen: bool,
        tolerance: f64,
    ) -> Result<(), Trouble> {
        let mut refinement = triangles.refinement.clone();
        let tolerance = tolerance / self.layer.frame.size;
        let triangulation = refinement.split_edges(splits, &self.layer.frame, widen, tolerance)?;
        *triangles = self.owned(refinement, triangulation);
        Ok(())
    }

    /// Finds the sheet that holds each triangle, and the places of the points that moved.
    fn owned(&self, mut refinement: Refinement, triangulation: Triangulation) -> Triangles {
        for (point, free) in refinement.graph.points.iter_mut().zip(&refinement.free) {
            if *free {
                point.position = self.layer.frame.lift(point.uv);
            }
        }
        let winner = |t: usize| winner(&self.layer, &triangulation, t).filter(|_| triangulation.is_lit(t));
        let winners = (0..triangulation.triangles.len()).map(winner).collect();
        Triangles { refinement, triangulation, winners }
    }

    /// The elements.
    pub fn patch(&self, triangles: &Triangles) -> Patch {
        let Triangles { refinement: Refinement { graph, .. }, triangulation, winners } = triangles;
        let mut patch = Patch {
            points: graph.points.clone(),
            contacts: self.contacts,
            overlapping: self.overlapping,
            overlapped: self.overlapped,
            crossing: self.crossing,
            lost_emitters: self.lost_emitters.clone(),
            ..Patch::default()
        };
        let mut hidden = vec![0.0; self.layer.sheets.len()];
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            let Some(sheet) = winners[t] else {
                if let Some(sheet) = winner(&self.layer, triangulation, t) {
                    let corners = triangle.corners.map(|p| graph.points[p as usize].position);
                    hidden[sheet as usize] += polygon::area(&corners);
                }
                continue;
            };
            let mut seams = vec![false; 3];
            for (k, seam) in seams.iter_mut().enumerate() {
                let Some(edge) = triangle.constraints[k].map(|edge| &graph.edges[edge as usize]) else {
                    continue;
                };
                // A line along the outer border separates nothing; what is hidden counts as its other side.
                let beyond = triangle.neighbours[k]
                    .and_then(|n| winners[n as usize].or(winner(&self.layer, triangulation, n as usize)));
                let Some(beyond) = beyond else { continue };
                let [from, to] = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
                let lit = triangle.neighbours[k].is_some_and(|n| winners[n as usize].is_some());
                for order in 0..=2 {
                    let of_order = edge.contacts.iter().filter(|contact| contact.order == order);
                    let mut sources: Vec<u32> = of_order.map(|contact| contact.source).collect();
                    sources.sort_unstable();
                    // Faces in contact say the same; emitters each have their own light.
                    sources.truncate(if order == 0 { 1 } else { sources.len() });
                    *seam |= order == 0 && !sources.is_empty();
                    // One line where both sides belong to one sheet, else one on each.
                    if beyond != sheet || !lit || from < to {
                        let line = |source| PatchLine { sheet, from, to, order, source };
                        patch.lines.extend(sources.into_iter().map(line));
                    }
                }
            }
            patch.elements.push(PatchElement { corners: triangle.corners.to_vec(), seams, sheet });
        }
        patch.lines.sort_unstable();
        let areas = hidden.into_iter().enumerate().filter(|(_, area)| *area > 0.0);
        patch.hidden = areas.map(|(sheet, area)| (sheet as u32, area)).collect();
        patch
    }
}
