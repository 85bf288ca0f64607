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
use glam::DVec2;

/// Edges of the graph may be longer than the spacing by this part before they are split once more.
const SLACK: f64 = 0.2;

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

    /// Elements with edges of about `spacing` and none longer than `max_edge`, both in units of length.
    pub fn mesh(&self, spacing: f64, max_edge: f64) -> Result<Patch, Trouble> {
        let target =
            Target { spacing: spacing / self.layer.frame.size, max_edge: max_edge / self.layer.frame.size };
        let mut graph = self.graph.clone();
        graph.divide(|length| (length / target.spacing - SLACK).ceil().max(1.0) as usize);
        let seeds = lattice(&graph, &self.rings, target.spacing);
        let (mut graph, free, triangulation) = Refinement::new(graph, &seeds, target).run()?;
        for (point, free) in graph.points.iter_mut().zip(free) {
            if free {
                point.position = self.layer.frame.lift(point.uv);
            }
        }
        Ok(self.patch(&graph, &triangulation))
    }

    /// Gives every triangle to the sheet that holds it.
    fn patch(&self, graph: &PlanarGraph, triangulation: &Triangulation) -> Patch {
        let winner = |t: usize| {
            let holders = triangulation.sheets(t).filter(|&(_, winding)| winding > 0).map(|(sheet, _)| sheet);
            self.layer.winner(holders)
        };
        let winners: Vec<Option<u32>> = (0..triangulation.triangles.len()).map(winner).collect();
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
