//! Facets cut further where radiosity is not linear over them: an edge whose gathered middle differs from the mean of its
//! ends by more than the tolerance makes the facets on both of its sides into four each, and so on, down to a pixel.
//!
//! The decision belongs to the edge, so neighbours agree along it: an edge that is not cut stays linear on both sides,
//! and its halves are never asked again. Only shadow borders and corners cost gathering.

use crate::nodes::{Ends, NodeRadiosity};
use crate::receiver::{Receiver, limit_from_inside};
use crate::visible::VisibleSurface;
use geometry::gather::Scratch;
use glam::{DVec2, DVec3};
use interchange::ids::ElementId;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Cuts in a row; 2^8 is more than any picture's pixels across a facet that matter.
const DEEPEST: usize = 8;
/// Deviations count relative to the value in the middle, or to this part of the mean radiosity where that is darker: what
/// is dark as a whole needs no fine structure.
const DARK: f64 = 0.05;

/// Radiosity at a corner, in the limit along the edges to the corner before and to the one after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Along the edge that comes from the corner before.
    pub before: [f64; 3],
    /// Along the edge that goes to the corner after.
    pub after: [f64; 3],
}

impl Corner {
    fn whole(value: [f64; 3]) -> Corner {
        Corner { before: value, after: value }
    }
}

/// A triangle over which radiosity is linear, or cut into four.
#[derive(Debug, Clone)]
struct Piece {
    element: ElementId,
    ids: [u32; 3],
    points: [DVec3; 3],
    places: [DVec2; 3],
    corners: [Corner; 3],
    /// Index of the first of four children; 0 for none (piece 0 is nobody's child).
    children: usize,
}

/// The triangles of a picture.
#[derive(Debug, Default)]
pub struct RefinedFacets {
    roots: BTreeMap<ElementId, usize>,
    pieces: Vec<Piece>,
    /// Points gathered to decide.
    pub gathered: usize,
    /// Triangles that were cut.
    pub cut: usize,
}

/// Middle of an edge: a corner of its children.
#[derive(Debug, Clone, Copy)]
struct Middle {
    id: u32,
    value: [f64; 3],
    flagged: bool,
}

type EdgeKey = (u32, u32);

fn key(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

fn mean(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
}

impl RefinedFacets {
    /// Cuts the triangular `facets` (each with the pixels it covers), whose nodes are gathered, until no edge deviates
    /// by more than `tolerance` or a triangle is below a pixel. `done` is called after each gathered point.
    pub fn new(
        nodes: &NodeRadiosity<'_>,
        surface: &VisibleSurface,
        facets: &[(ElementId, f64)],
        tolerance: f64,
        done: impl Fn() + Sync,
    ) -> RefinedFacets {
        let mut refined = RefinedFacets::default();
        let mut active: Vec<(usize, f64)> = Vec::new();
        for &(element, pixels) in facets {
            if let Some(piece) = root(nodes, surface, element) {
                refined.roots.insert(element, refined.pieces.len());
                if nodes.reflects(element) {
                    active.push((refined.pieces.len(), pixels));
                }
                refined.pieces.push(piece);
            }
        }
        let dark = DARK * refined.mean_radiosity();
        let mut next_id = nodes.node_count() as u32;
        let mut straight: BTreeSet<EdgeKey> = BTreeSet::new();
        for _ in 0..DEEPEST {
            active.retain(|&(_, pixels)| pixels > 1.0);
            if active.is_empty() {
                break;
            }
            let middles = refined.middles(nodes, &active, &straight, tolerance, dark, &mut next_id, &done);
            let mut children = Vec::new();
            for &(piece, pixels) in &active {
                if let Some(first) = refined.cut(piece, &middles, &mut straight) {
                    children.extend((first..first + 4).map(|child| (child, 0.25 * pixels)));
                }
            }
            active = children;
        }
        refined
    }

    fn mean_radiosity(&self) -> f64 {
        let values = self.pieces.iter().flat_map(|piece| piece.corners).flat_map(|corner| corner.before);
        values.sum::<f64>() / (9 * self.pieces.len().max(1)) as f64
    }

    /// The middles of all edges of the active triangles.
    #[allow(clippy::too_many_arguments)] // what is drawn, what is asked, and the counters
    fn middles(
        &mut self,
        nodes: &NodeRadiosity<'_>,
        active: &[(usize, f64)],
        straight: &BTreeSet<EdgeKey>,
        tolerance: f64,
        dark: f64,
        next_id: &mut u32,
        done: &(impl Fn() + Sync),
    ) -> BTreeMap<EdgeKey, Middle> {
        // Each edge once, on its first triangle.
        let mut edges: BTreeMap<EdgeKey, (usize, usize)> = BTreeMap::new();
        for &(piece, _) in active {
            let ids = self.pieces[piece].ids;
            (0..3).for_each(|k| {
                edges.entry(key(ids[k], ids[(k + 1) % 3])).or_insert((piece, k));
            });
        }
        let edges: Vec<(EdgeKey, (usize, usize))> = edges.into_iter().collect();
        let pieces = &self.pieces;
        let middle = |scratch: &mut Scratch, edge: &(EdgeKey, (usize, usize))| {
            let (key, (piece, k)) = *edge;
            let piece = &pieces[piece];
            let linear = mean(piece.corners[k].after, piece.corners[(k + 1) % 3].before);
            if straight.contains(&key) {
                return (linear, false, false);
            }
            let value = nodes.gathered(piece.element, &piece.middle_receiver(k), scratch);
            done();
            let deviates = (0..3).any(|c| (value[c] - linear[c]).abs() > tolerance * value[c].max(dark));
            (if deviates { value } else { linear }, deviates, true)
        };
        let found: Vec<([f64; 3], bool, bool)> =
            edges.par_iter().map_init(Scratch::default, middle).collect();
        self.gathered += found.iter().filter(|(.., gathered)| *gathered).count();
        let mut middles = BTreeMap::new();
        for ((key, _), (value, flagged, _)) in edges.into_iter().zip(found) {
            middles.insert(key, Middle { id: *next_id, value, flagged });
            *next_id += 1;
        }
        middles
    }

    /// Cuts a triangle into four if one of its edges is to be cut; returns the first child.
    fn cut(
        &mut self,
        piece: usize,
        middles: &BTreeMap<EdgeKey, Middle>,
        straight: &mut BTreeSet<EdgeKey>,
    ) -> Option<usize> {
        let whole = self.pieces[piece].clone();
        let ends = |k: usize| (whole.ids[k], whole.ids[(k + 1) % 3]);
        let mut middle = [Middle { id: 0, value: [0.0; 3], flagged: false }; 3];
        for (k, middle) in middle.iter_mut().enumerate() {
            *middle = *middles.get(&key(ends(k).0, ends(k).1))?;
        }
        if middle.iter().all(|m| !m.flagged) {
            return None;
        }
        for (k, m) in middle.iter().enumerate().filter(|(_, m)| !m.flagged) {
            straight.insert(key(ends(k).0, m.id));
            straight.insert(key(ends(k).1, m.id));
        }
        // Corners 0 to 2, then the middles of edges 0-1, 1-2 and 2-0.
        let ids = [whole.ids[0], whole.ids[1], whole.ids[2], middle[0].id, middle[1].id, middle[2].id];
        let point = |k: usize| match k {
            0..3 => (whole.points[k], whole.places[k], whole.corners[k]),
            _ => {
                let (a, b) = (k - 3, (k - 2) % 3);
                let point = 0.5 * (whole.points[a] + whole.points[b]);
                let place = 0.5 * (whole.places[a] + whole.places[b]);
                (point, place, Corner::whole(middle[k - 3].value))
            }
        };
        let first = self.pieces.len();
        for corners in CHILDREN {
            self.pieces.push(Piece {
                element: whole.element,
                ids: corners.map(|k| ids[k]),
                points: corners.map(|k| point(k).0),
                places: corners.map(|k| point(k).1),
                corners: corners.map(|k| point(k).2),
                children: 0,
            });
        }
        self.pieces[piece].children = first;
        self.cut += 1;
        Some(first)
    }

    /// Radiosity at a place of a facet; `None` for facets that are no triangles.
    pub fn at(&self, element: ElementId, place: DVec2, weights: &mut Vec<f64>) -> Option<[f64; 3]> {
        let mut piece = &self.pieces[*self.roots.get(&element)?];
        loop {
            crate::interpolation::corner_weights(&piece.places, place, weights);
            if piece.children == 0 {
                return Some(piece.linear(weights));
            }
            let corner = (0..3).find(|&k| weights[k] > 0.5).unwrap_or(3);
            piece = &self.pieces[piece.children + corner];
        }
    }
}

/// Corners of the children: one at each corner, in the order of the corners, and the one in the middle.
const CHILDREN: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

impl Piece {
    /// Where the middle of edge `k` receives: just inside.
    fn middle_receiver(&self, k: usize) -> Receiver {
        let [a, b, c] = self.points;
        let middle = 0.5 * (self.points[k] + self.points[(k + 1) % 3]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Receiver { point: limit_from_inside(middle, (a + b + c) / 3.0), normal, face: None }
    }

    /// Interpolation; the value of a corner turns with the direction from it.
    fn linear(&self, weights: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (k, corner) in self.corners.iter().enumerate() {
            let (before, after) = (weights[(k + 2) % 3], weights[(k + 1) % 3]);
            let turned = if before + after > 0.0 { after / (before + after) } else { 0.5 };
            for (channel, sum) in sum.iter_mut().enumerate() {
                *sum +=
                    weights[k] * ((1.0 - turned) * corner.before[channel] + turned * corner.after[channel]);
            }
        }
        sum
    }
}

/// The facet as a piece, if it is a triangle.
fn root(nodes: &NodeRadiosity<'_>, surface: &VisibleSurface, element: ElementId) -> Option<Piece> {
    let places = <[DVec2; 3]>::try_from(surface.corners(element)).ok()?;
    let Ends { ids, points, corners } = nodes.ends(element)?;
    Some(Piece { element, ids, points, places, corners, children: 0 })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::lit_scene::LitScene;
    use crate::test_scenes::{add_parallelogram, empty_mesh, lit};
    use interchange::ids::{NodeId, VertexId};

    /// The unit floor as two triangles on the diagonal, lit by a small bright plate close above its middle.
    fn floor_under_a_lamp() -> LitScene {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::ZERO, DVec3::Z, DVec3::X, 1, 0);
        let lamp = DVec3::new(0.45, 0.1, 0.45);
        add_parallelogram(&mut mesh, lamp, 0.1 * DVec3::X, 0.1 * DVec3::Z, 1, 0);
        let halves = [[0, 1, 2], [0, 2, 3]];
        let corners: Vec<Vec<VertexId>> = mesh.elements.rows().map(<[_]>::to_vec).collect();
        let nodes: Vec<Vec<NodeId>> = mesh.element_nodes.rows().map(<[_]>::to_vec).collect();
        let cut_corners = halves.map(|half| half.map(|k| corners[0][k]).to_vec());
        let cut_nodes = halves.map(|half| half.map(|k| nodes[0][k]).to_vec());
        mesh.elements = cut_corners.into_iter().chain(corners[1..].to_vec()).collect();
        mesh.element_nodes = cut_nodes.into_iter().chain(nodes[1..].to_vec()).collect();
        mesh.element_faces.insert(0, mesh.element_faces[0]);
        mesh.element_sides.push(0);
        let mut scene = lit(mesh);
        scene.radiosity = vec![[0.0; 3], [0.0; 3], [1.0; 3]];
        scene
    }

    fn refined(scene: &LitScene, tolerance: f64) -> (RefinedFacets, Vec<[DVec2; 3]>) {
        let surface = VisibleSurface::new(scene);
        let mut nodes = NodeRadiosity::new(scene);
        let floor = [ElementId(0), ElementId(1)];
        nodes.gather(&floor, |_| {}, || {});
        let facets = floor.map(|element| (element, 1e6));
        let places = floor.map(|e| <[DVec2; 3]>::try_from(surface.corners(e)).unwrap()).to_vec();
        (RefinedFacets::new(&nodes, &surface, &facets, tolerance, || {}), places)
    }

    #[test]
    fn a_spot_between_the_corners_is_found_and_neighbours_agree_along_their_edge() {
        let scene = floor_under_a_lamp();
        let (refined, places) = refined(&scene, 0.01);
        assert!(refined.cut > 20 && refined.gathered > 100, "{refined:?}");
        let weights = &mut Vec::new();
        // The middle of the floor sees the lamp, a square of side 0.1 at height 0.1, by four right-angled corners: each
        // gives (1 / pi) l atan(l) with l = s / sqrt(1 + s^2), s = 1/2.
        let leg = 0.5 / 1.25f64.sqrt();
        let want = 4.0 / std::f64::consts::PI * leg * leg.atan();
        let middle = 0.5 * (places[0][0] + places[0][2]);
        let got = refined.at(ElementId(0), middle, weights).unwrap()[0];
        assert!((got - want).abs() < 1e-4 * want, "{got} {want}");
        for t in [0.1, 0.3, 0.45, 0.7] {
            let place = places[0][0].lerp(places[0][2], t);
            let [a, b] = [ElementId(0), ElementId(1)].map(|e| refined.at(e, place, weights).unwrap()[0]);
            assert!((a - b).abs() < 1e-6 * want, "at {t} of the diagonal: {a} and {b}");
        }
    }

    #[test]
    fn interpolation_keeps_the_tolerance_where_it_was_cut() {
        let scene = floor_under_a_lamp();
        let mut nodes = NodeRadiosity::new(&scene);
        nodes.gather(&[ElementId(0), ElementId(1)], |_| {}, || {});
        let surface = VisibleSurface::new(&scene);
        let corners = <[DVec2; 3]>::try_from(surface.corners(ElementId(0))).unwrap();
        let points = nodes.ends(ElementId(0)).unwrap().points;
        let mut worst = [0.0f64; 2];
        for (worst, tolerance) in worst.iter_mut().zip([0.1, 0.01]) {
            let (refined, _) = refined(&scene, tolerance);
            for (u, v) in [(0.2, 0.3), (0.4, 0.35), (0.1, 0.6), (0.33, 0.33), (0.48, 0.03)] {
                let blend = |a: f64, b: f64, c: f64| 1.0 * a + u * (b - a) + v * (c - a);
                let place = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
                let point = DVec3::from_array(std::array::from_fn(|c| {
                    blend(points[0][c], points[1][c], points[2][c])
                }));
                let receiver = Receiver { point, normal: DVec3::Y, face: None };
                let want = nodes.gathered(ElementId(0), &receiver, &mut Scratch::default())[0];
                let got = refined.at(ElementId(0), place, &mut Vec::new()).unwrap()[0];
                *worst = worst.max((got - want).abs() / want.max(0.01));
            }
        }
        // The middle of an edge is asked, not every point: twice the tolerance is what is left in between.
        assert!(worst[0] < 0.2 && worst[1] < 0.02, "{worst:?}");
    }
}
