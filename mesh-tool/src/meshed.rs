//! Meshing: all sheets of a layer are triangulated together, so that their elements meet edge to edge, with the
//! borders of the faces and the contact lines as edges.

use crate::clean::Cleaned;
use crate::contact::{ContactLine, Pieces, contact_lines};
use crate::given::drawn;
use crate::patch::{Patch, PatchElement, PatchLine};
use crate::planar::{Contact, PlanarGraph, Point};
use crate::refine::{Refinement, Target};
use crate::seeds::lattice;
use crate::sheets::Layer;
use crate::triangulation::{Triangulation, Trouble};
use geometry::polygon;
use glam::{DVec2, DVec3};

/// Edges of the graph may be longer than the spacing by this part before they are split once more.
const SLACK: f64 = 0.2;

/// A layer in triangles that can be refined further.
#[derive(Debug)]
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

    /// The triangles that become elements: number and corners, counter-clockwise in the layer's frame.
    pub fn elements(&self) -> impl Iterator<Item = (usize, [DVec3; 3])> + '_ {
        let corners = |t: usize| {
            self.triangulation.triangles[t].corners.map(|p| self.refinement.graph.points[p as usize].position)
        };
        (0..self.winners.len()).filter(|&t| self.winners[t].is_some()).map(move |t| (t, corners(t)))
    }
}

/// A layer ready to be meshed at any size: everything that does not depend on the size is done.
#[derive(Debug)]
pub struct Drawing {
    layer: Layer,
    graph: PlanarGraph,
    rings: Vec<Vec<DVec2>>,
    contacts: usize,
    overlapping: usize,
    crossing: usize,
    /// Area that the elements will cover, in square units of length.
    pub area: f64,
}

impl Drawing {
    /// Draws the borders and contact lines of a layer and splits them where they meet.
    pub fn new(layer: Layer, scene: &Cleaned, pieces: &Pieces) -> Result<Drawing, Trouble> {
        let lines = contact_lines(&layer, scene, pieces);
        let graph = drawn(&layer, 0..layer.sheets.len() as u32, scene, |graph| {
            for &ContactLine { sheet, source, ends, .. } in &lines {
                let [from, to] =
                    ends.map(|uv| graph.point(Point { uv, position: layer.frame.lift(uv), place: None }));
                graph.contact(from, to, Contact { sheet, source });
            }
        });
        let (graph, triangulation) = graph.arrange(scene.places.tolerance() / layer.frame.size)?;
        let rings = layer
            .sheets
            .iter()
            .map(|sheet| sheet.ring.iter().map(|&p| layer.frame.flatten(scene.places.position(p))).collect())
            .collect();
        let (mut area, mut losers) = (0.0, std::collections::BTreeSet::new());
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            let holders: Vec<u32> =
                triangulation.sheets(t).filter(|&(_, winding)| winding > 0).map(|(sheet, _)| sheet).collect();
            let Some(winner) = layer.winner(holders.iter().copied()) else { continue };
            area += polygon::area(&triangle.corners.map(|p| graph.points[p as usize].position));
            losers.extend(holders.into_iter().filter(|&sheet| sheet != winner));
        }
        let within: Vec<&ContactLine> = lines.iter().filter(|line| !line.along_border).collect();
        let mut crossed: Vec<u32> = within.iter().filter(|l| l.crosses).map(|line| line.sheet).collect();
        crossed.dedup();
        crossed.sort_unstable();
        crossed.dedup();
        Ok(Drawing {
            graph,
            rings,
            contacts: within.len(),
            overlapping: losers.len(),
            crossing: crossed.len(),
            area,
            layer,
        })
    }

    /// The layer.
    pub fn layer(&self) -> &Layer {
        &self.layer
    }

    /// Triangles with edges of about `spacing` and none longer than `max_edge`, both in units of length.
    pub fn mesh(&self, spacing: f64, max_edge: f64) -> Result<Triangles, Trouble> {
        let target =
            Target { spacing: spacing / self.layer.frame.size, max_edge: max_edge / self.layer.frame.size };
        let mut graph = self.graph.clone();
        graph.divide(|length| (length / target.spacing - SLACK).ceil().max(1.0) as usize);
        let seeds = lattice(&graph, &self.rings, target.spacing);
        let mut refinement = Refinement::new(graph, &seeds, target);
        let triangulation = refinement.run()?;
        Ok(self.owned(refinement, triangulation))
    }

    /// Halves the edges of the triangles `marked` (by their number in `triangles`) that are at least twice as long
    /// as `shortest`, in units of length. `false` where there are none.
    pub fn halve(&self, triangles: &mut Triangles, marked: &[usize], shortest: f64) -> Result<bool, Trouble> {
        let shortest = shortest / self.layer.frame.size;
        let halved = triangles.refinement.halve_triangles(&triangles.triangulation, marked, shortest)?;
        let Some(triangulation) = halved else { return Ok(false) };
        let refinement = triangles.refinement.clone();
        *triangles = self.owned(refinement, triangulation);
        Ok(true)
    }

    /// Finds the sheet that holds each triangle, and the places of the points that moved.
    fn owned(&self, mut refinement: Refinement, triangulation: Triangulation) -> Triangles {
        for (point, free) in refinement.graph.points.iter_mut().zip(&refinement.free) {
            if *free {
                point.position = self.layer.frame.lift(point.uv);
            }
        }
        let winner = |t: usize| {
            let holders = triangulation.sheets(t).filter(|&(_, winding)| winding > 0).map(|(sheet, _)| sheet);
            self.layer.winner(holders)
        };
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
            crossing: self.crossing,
            ..Patch::default()
        };
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            let Some(sheet) = winners[t] else { continue };
            let mut seams = vec![false; 3];
            for (k, seam) in seams.iter_mut().enumerate() {
                let Some(edge) = triangle.constraints[k].map(|edge| &graph.edges[edge as usize]) else {
                    continue;
                };
                let mut sources = edge.contacts.iter().map(|contact| contact.source);
                // A line along the outer border separates nothing.
                let beyond = triangle.neighbours[k].and_then(|n| winners[n as usize]);
                if let (Some(first), Some(beyond)) = (sources.next(), beyond) {
                    *seam = true;
                    let [from, to] = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
                    // One line where both sides belong to one sheet, else one on each.
                    if beyond != sheet || from < to {
                        let source = sources.fold(first, u32::min);
                        patch.lines.push(PatchLine { sheet, from, to, source });
                    }
                }
            }
            patch.elements.push(PatchElement { corners: triangle.corners.to_vec(), seams, sheet });
        }
        patch.lines.sort_unstable();
        patch
    }
}
