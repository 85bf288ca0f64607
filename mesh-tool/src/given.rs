//! Elements as given: every convex face is one element, a concave one its convex pieces. Only where area would be
//! counted twice (coplanar overlap) or where another face pokes through is a face cut; all others stay exactly as
//! they are. No lines, no refinement: the exchange matrix then holds exact polygon-to-polygon factors.

use crate::clean::Cleaned;
use crate::contact::{Pieces, contact_lines, convex_outlines};
use crate::convex::convex_pieces;
use crate::frame::turn;
use crate::patch::{Patch, PatchElement};
use crate::planar::{Border, Contact, PlanarGraph, Point};
use crate::sheets::Layer;
use crate::steps::{Off, Step};
use crate::triangulation::Trouble;
use geometry::polygon;
use glam::DVec2;

/// Elements of a layer.
pub fn as_given(
    layer: &Layer,
    scene: &Cleaned,
    pieces: &Pieces,
    off: &Off<Step>,
) -> Result<Patch, (u32, Trouble)> {
    let mut patch = Patch::default();
    let outlines: Vec<Vec<Vec<DVec2>>> =
        layer.sheets.iter().map(|sheet| convex_outlines(layer, sheet.face, scene, pieces)).collect();
    let mut crossings: Vec<Vec<(u32, [DVec2; 2])>> = vec![Vec::new(); layer.sheets.len()];
    for line in contact_lines(layer, scene, pieces) {
        if line.crosses && !line.along_border && off.leaves(Step::Cross) {
            crossings[line.sheet as usize].push((line.source, line.ends));
        }
    }
    let tolerance = scene.places.tolerance() / layer.frame.size;
    for (index, sheet) in layer.sheets.iter().enumerate() {
        let winners: Vec<u32> = (0..layer.sheets.len() as u32)
            .filter(|&other| layer.sheets[other as usize].rank < sheet.rank)
            .filter(|&other| overlap(&outlines[index], &outlines[other as usize], tolerance))
            .collect();
        patch.overlapping += usize::from(!winners.is_empty());
        if let Some(&winner) = winners.first()
            && scene.faces[sheet.face as usize].emits
        {
            patch.lost_emitters.push((index as u32, winner));
        }
        patch.crossing += usize::from(!crossings[index].is_empty());
        if winners.is_empty() && crossings[index].is_empty() {
            whole(layer, index as u32, scene, pieces, &mut patch);
        } else {
            cut(layer, index as u32, &winners, &crossings[index], scene, &mut patch)
                .map_err(|trouble| (sheet.face, trouble))?;
        }
    }
    Ok(patch)
}

/// Adds a sheet that nothing cuts: its face, or the convex pieces of it.
fn whole(layer: &Layer, index: u32, scene: &Cleaned, pieces: &Pieces, patch: &mut Patch) {
    let sheet = &layer.sheets[index as usize];
    let along = scene.faces[sheet.face as usize].plane.normal.dot(layer.frame.plane.normal) > 0.0;
    for piece in &pieces[sheet.face as usize] {
        let mut ring = piece.clone();
        if !along {
            ring.reverse();
        }
        let start = patch.points.len() as u32;
        patch.points.extend(ring.iter().map(|&place| {
            let position = scene.places.position(place);
            Point { uv: layer.frame.flatten(position), position, place: Some(place) }
        }));
        patch.elements.push(PatchElement {
            corners: (start..patch.points.len() as u32).collect(),
            seams: vec![false; ring.len()],
            sheet: index,
        });
    }
}

/// Adds what remains of a sheet without the parts that `winners` hold, cut along `crossings`.
fn cut(
    layer: &Layer,
    index: u32,
    winners: &[u32],
    crossings: &[(u32, [DVec2; 2])],
    scene: &Cleaned,
    patch: &mut Patch,
) -> Result<(), Trouble> {
    let graph = drawn(layer, [index].iter().chain(winners).copied(), scene, |graph| {
        for &(source, ends) in crossings {
            let [from, to] =
                ends.map(|uv| graph.point(Point { uv, position: layer.frame.lift(uv), place: None }));
            graph.contact(from, to, Contact { sheet: index, source, order: 0 });
        }
    });
    let (graph, triangulation) = graph.arrange(scene.places.tolerance() / layer.frame.size)?;
    let held = |t: usize| {
        let sheets = triangulation.sheets(t).filter(|&(_, winding)| winding > 0).map(|(sheet, _)| sheet);
        layer.winner(sheets) == Some(index)
    };
    let seam = |edge: u32| !graph.edges[edge as usize].contacts.is_empty();
    let own: Vec<u32> = layer.sheets[index as usize].ring.clone();
    let keep = |point: u32| graph.points[point as usize].place.is_some_and(|place| own.contains(&place));
    let rings = convex_pieces(&layer.frame, &graph, &triangulation, held, seam, keep);
    let lost =
        (0..triangulation.triangles.len()).filter(|&t| triangulation.winding(t, index) > 0 && !held(t));
    let area = |t: usize| {
        polygon::area(&triangulation.triangles[t].corners.map(|p| graph.points[p as usize].position))
    };
    patch.overlapped += lost.map(area).sum::<f64>();
    let start = patch.points.len() as u32;
    patch.points.extend(&graph.points);
    let is_seam = |a: u32, b: u32| {
        let same = |e: &&crate::planar::Edge| (e.from, e.to) == (a, b) || (e.from, e.to) == (b, a);
        graph.edges.iter().find(same).is_some_and(|edge| !edge.contacts.is_empty())
    };
    for ring in rings {
        let seams = (0..ring.len()).map(|k| is_seam(ring[k], ring[(k + 1) % ring.len()])).collect();
        let corners = ring.iter().map(|&point| start + point).collect();
        patch.elements.push(PatchElement { corners, seams, sheet: index });
    }
    Ok(())
}

/// A graph with the borders of some sheets, and what `more` adds.
pub fn drawn(
    layer: &Layer,
    sheets: impl Iterator<Item = u32>,
    scene: &Cleaned,
    more: impl FnOnce(&mut PlanarGraph),
) -> PlanarGraph {
    let mut graph = PlanarGraph::default();
    for sheet in sheets {
        let ring: Vec<u32> = layer.sheets[sheet as usize]
            .ring
            .iter()
            .map(|&place| graph.corner(&layer.frame, place, scene.places.position(place)))
            .collect();
        graph.ring(&ring, Border { sheet, forward: true });
    }
    more(&mut graph);
    graph
}

/// Whether two sets of convex outlines have more in common than a border that both were rounded to.
fn overlap(a: &[Vec<DVec2>], b: &[Vec<DVec2>], tolerance: f64) -> bool {
    a.iter().flat_map(|p| b.iter().map(move |q| (p, q))).any(|(p, q)| {
        let common = intersection(p, q);
        let perimeter: f64 =
            (0..common.len()).map(|k| common[k].distance(common[(k + 1) % common.len()])).sum();
        let twice: f64 = (2..common.len()).map(|k| turn(common[0], common[k - 1], common[k])).sum();
        // The two long sides of a strip as wide as the tolerance make up its perimeter.
        twice > 2.0 * tolerance * perimeter
    })
}

/// Common part of two convex polygons (Sutherland & Hodgman 1974).
fn intersection(p: &[DVec2], q: &[DVec2]) -> Vec<DVec2> {
    let mut rest = p.to_vec();
    for (k, &a) in q.iter().enumerate() {
        let b = q[(k + 1) % q.len()];
        let mut next = Vec::with_capacity(rest.len() + 1);
        for (i, &to) in rest.iter().enumerate() {
            let from = rest[(i + rest.len() - 1) % rest.len()];
            let (side_from, side_to) = (turn(a, b, from), turn(a, b, to));
            if side_from * side_to < 0.0 {
                next.push(from.lerp(to, side_from / (side_from - side_to)));
            }
            if side_to >= 0.0 {
                next.push(to);
            }
        }
        rest = next;
    }
    rest
}
