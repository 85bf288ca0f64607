//! The graph of a layer before any size is chosen: borders, contacts, hidden parts and lines of light, split where they meet.

use crate::clean::Cleaned;
use crate::contact::ContactLine;
use crate::discontinuity::DrawnLine;
use crate::given::drawn;
use crate::hidden::{HiddenParts, draw_contacts};
use crate::near::{self, Wanted};
use crate::planar::{Contact, PlanarGraph, Point};
use crate::sheets::Layer;
use crate::triangulation::{Triangulation, Trouble};

/// A layer's graph and its triangulation.
#[derive(Debug)]
pub struct Arranged {
    /// Points and edges; edges touch only at their ends.
    pub graph: PlanarGraph,
    /// Its triangulation.
    pub triangulation: Triangulation,
    /// The hidden parts that are drawn.
    pub hidden: HiddenParts,
    /// Lines that are gone, because others pass too close.
    pub gone: usize,
}

/// Draws a layer. Lines of light keep `nearness`, in units of length, from each other and from borders; where that is
/// zero, they stay exactly where they are.
pub fn arranged(
    layer: &Layer,
    scene: &Cleaned,
    contacts: &[ContactLine],
    hidden: HiddenParts,
    lines: &[DrawnLine],
    nearness: f64,
) -> Result<Arranged, Trouble> {
    let tolerance = scene.places.tolerance() / layer.frame.size;
    let without_light = |hidden: &HiddenParts| {
        drawn(layer, 0..layer.sheets.len() as u32, scene, |graph| {
            draw_contacts(graph, layer, contacts, |_| 0);
            hidden.draw(graph);
        })
    };
    let wanted = wanted(layer, lines);
    let with_light = || {
        let mut graph = without_light(&hidden);
        let distance = nearness / layer.frame.size;
        if distance <= tolerance || wanted.is_empty() {
            for Wanted { ends, contact } in &wanted {
                let [from, to] = ends.map(|point| graph.point(point));
                graph.contact(from, to, *contact);
            }
            return graph.arrange(tolerance).map(|arranged| (arranged, 0));
        }
        let mut graph = graph.arrange(tolerance)?.0;
        let gone = near::draw(&mut graph, wanted.clone(), distance);
        graph.arrange(tolerance).map(|arranged| (arranged, gone))
    };
    match with_light() {
        Ok(((graph, triangulation), gone)) => Ok(Arranged { graph, triangulation, hidden, gone }),
        // Lines of light that tangle are left out, and where faces lie too close to be told apart, so is what they hide.
        Err(_) => {
            let hidden = HiddenParts::default();
            let (graph, triangulation) = without_light(&hidden).arrange(tolerance)?;
            Ok(Arranged { graph, triangulation, hidden, gone: 0 })
        }
    }
}

/// The lines on the sheets of a layer.
fn wanted(layer: &Layer, lines: &[DrawnLine]) -> Vec<Wanted> {
    let mut wanted = Vec::new();
    for (index, sheet) in layer.sheets.iter().enumerate() {
        for line in lines.iter().filter(|line| line.face == sheet.face && line.side == sheet.side) {
            let ends =
                line.ends.map(|position| Point { uv: layer.frame.flatten(position), position, place: None });
            let contact = Contact { sheet: index as u32, source: line.source, order: line.order };
            wanted.push(Wanted { ends, contact });
        }
    }
    wanted
}
