//! Parts of a layer that nothing can shine on: inside a closed body, under one that stands on the layer, and the faces
//! of that body that lie on the layer. They get no element.

use crate::clean::Cleaned;
use crate::contact::ContactLine;
use crate::given::drawn;
use crate::outline::{regions, ring};
use crate::planar::{Border, Contact, PlanarGraph, Point};
use crate::regions::winner;
use crate::sheets::Layer;
use crate::solids::Solids;
use crate::triangulation::Trouble;
use glam::DVec2;

/// Number of the pseudo-sheet that covers what is hidden.
pub const HIDDEN: u32 = u32::MAX;

/// The hidden parts of a layer.
#[derive(Debug, Clone, Default)]
pub struct HiddenParts {
    /// Directed edges around them, the hidden side on the left.
    edges: Vec<[Point; 2]>,
    /// Rings around them, in the layer's frame.
    pub rings: Vec<Vec<DVec2>>,
}

impl HiddenParts {
    /// Finds them. `opposite` are the sheets of the same plane that look the other way.
    pub fn of(
        layer: &Layer,
        opposite: Option<&Layer>,
        contacts: &[ContactLine],
        scene: &Cleaned,
        solids: &Solids,
    ) -> Result<HiddenParts, Trouble> {
        if !solids.reach(layer.sheets.iter().flat_map(|sheet| scene.places.corners(&sheet.ring))) {
            return Ok(HiddenParts::default());
        }
        let own = layer.sheets.len() as u32;
        let graph = drawn(layer, 0..own, scene, |graph| {
            draw_contacts(graph, layer, contacts, |_| 0);
            for (k, sheet) in opposite.iter().flat_map(|other| &other.sheets).enumerate() {
                let ring: Vec<u32> = sheet
                    .ring
                    .iter()
                    .map(|&place| graph.corner(&layer.frame, place, scene.places.position(place)))
                    .collect();
                graph.ring(&ring, Border { sheet: own + k as u32, forward: true });
            }
        });
        let (graph, triangulation) = graph.arrange(scene.places.tolerance() / layer.frame.size)?;
        let normal = if layer.reversed { -layer.frame.plane.normal } else { layer.frame.plane.normal };
        let is_hidden = |t: usize| {
            let Some(sheet) = winner(layer, &triangulation, t) else { return false };
            let face = layer.sheets[sheet as usize].face;
            if scene.faces[face as usize].emits {
                return false;
            }
            let [a, b, c] = triangulation.triangles[t].corners.map(|p| graph.points[p as usize].position);
            let centre = (a + b + c) / 3.0;
            if solids.hiding(centre, normal).next().is_some() {
                return true;
            }
            let covered = triangulation.sheets(t).any(|(sheet, winding)| sheet >= own && winding > 0);
            covered && solids.hiding(centre, -normal).any(|solid| solid.faces.contains(&face))
        };
        let hidden: Vec<bool> = (0..triangulation.triangles.len()).map(is_hidden).collect();
        let mut parts = HiddenParts::default();
        for region in regions(&triangulation, |t| hidden[t].then_some(())) {
            let ring = ring(&graph, &triangulation, &region);
            parts.rings.push(ring.iter().map(|&p| graph.points[p as usize].uv).collect());
            for t in region {
                let triangle = &triangulation.triangles[t];
                for k in (0..3).filter(|&k| !triangle.neighbours[k].is_some_and(|n| hidden[n as usize])) {
                    let ends = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
                    parts.edges.push(ends.map(|p| graph.points[p as usize]));
                }
            }
        }
        Ok(parts)
    }

    /// Draws their borders.
    pub fn draw(&self, graph: &mut PlanarGraph) {
        for ends in &self.edges {
            let [from, to] = ends.map(|point| graph.point(point));
            graph.border(from, to, Border { sheet: HIDDEN, forward: true });
        }
    }
}

/// Draws contact lines, as lines of the order that `order` gives them.
pub fn draw_contacts(
    graph: &mut PlanarGraph,
    layer: &Layer,
    contacts: &[ContactLine],
    order: impl Fn(&ContactLine) -> u32,
) {
    for line in contacts {
        let [from, to] =
            line.ends.map(|uv| graph.point(Point { uv, position: layer.frame.lift(uv), place: None }));
        graph.contact(from, to, Contact { sheet: line.sheet, source: line.source, order: order(line) });
    }
}
