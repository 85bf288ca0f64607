//! Facets cut further where interpolation is not good enough: an edge on which gathered irradiance differs from the
//! interpolated one by more than the tolerance makes the facets on both of its sides into four each, and so on, down to a
//! pixel.
//!
//! Linear: the middle of the edge is asked. Quadratic (six nodes, as Lischinski, Tampieri & Greenberg 1992 use them): its two
//! quarter points. Gathering: as quadratic, and the middle of the facet besides; what is not resolved at a pixel's size
//! is left to be gathered at every sample. So irradiance is reused where it is smooth, as Ward, Rubinstein & Clear
//! 1988 do, but the error of reuse is measured instead of guessed from distances, and only shadow borders and corners cost.
//!
//! The decision belongs to the edge, so neighbours agree along it: an edge that is not cut stays as it is on both sides,
//! and its halves are never asked again.

use crate::interpolation::{corner_weights, quadratic_weights};
use crate::nodes::{Ends, NodeRadiosity};
use crate::receiver::{Parts, Receiver, limit_from_inside};
use crate::visible::VisibleSurface;
use geometry::gather::Scratch;
use glam::{DVec2, DVec3};
use interchange::ids::ElementId;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// Cuts in a row; 2^8 is more than any picture's pixels across a facet that matter.
const DEEPEST: usize = 8;
/// Deviations count relative to the radiosity there, or to this part of the mean one where that is darker: what is dark as a
/// whole needs no fine structure.
const DARK: f64 = 0.05;
/// Part of a deviation that cutting in two leaves where nothing is measured: halves of a quarter for smooth fields, doubled
/// for fields with a kink.
const LEFT_AFTER_CUT: f64 = 0.5;

/// How irradiance is interpolated over a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Between the corners.
    Linear,
    /// Between the corners and the middles of the edges.
    Quadratic,
    /// Quadratic where that is good, gathered at the sample where not.
    Gather,
}

/// Irradiance at a corner, in the limit along the edges to the corner before and to the one after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Along the edge that comes from the corner before.
    pub before: Parts,
    /// Along the edge that goes to the corner after.
    pub after: Parts,
}

impl Corner {
    fn whole(value: Parts) -> Corner {
        Corner { before: value, after: value }
    }
}

/// A triangle over which irradiance is interpolated, or cut into four.
#[derive(Debug, Clone)]
struct Piece {
    element: ElementId,
    ids: [u32; 3],
    points: [DVec3; 3],
    places: [DVec2; 3],
    corners: [Corner; 3],
    /// Of edges 0-1, 1-2 and 2-0; used by quadratic schemes.
    middles: [Parts; 3],
    /// Index of the first of four children; 0 for none (piece 0 is nobody's child).
    children: usize,
    /// Largest deviation of radiosity from what is interpolated, where asked.
    error: f64,
    /// Interpolation is known or feared to be off by more than the tolerance.
    unresolved: bool,
}

/// What is known of an edge.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Number of the node in its middle.
    id: u32,
    middle: Parts,
    /// Part of an edge that interpolation serves.
    straight: bool,
}

/// Whether interpolation serves an edge, from the end with the lower number on.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    flagged: bool,
    deviation: f64,
    quarters: [Parts; 2],
}

/// What a facet gives at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Irradiance.
    pub irradiance: Parts,
    /// Estimated error of radiosity, W m^-2.
    pub error: f64,
    /// Where to gather instead, if interpolation does not serve.
    pub gather: Option<Receiver>,
}

/// The triangles of a picture.
#[derive(Debug)]
pub struct RefinedFacets {
    scheme: Scheme,
    roots: BTreeMap<ElementId, usize>,
    pieces: Vec<Piece>,
    /// Only looked up, never listed: its order is nobody's.
    edges: HashMap<EdgeKey, Edge>,
    next_id: u32,
    /// Points gathered to decide.
    pub gathered: usize,
    /// Triangles that were cut.
    pub cut: usize,
    /// Triangles that are left to be gathered at every sample, or to be off by more than the tolerance.
    pub unresolved: usize,
}

type EdgeKey = (u32, u32);

fn key(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

fn blend(terms: &[(f64, &Parts)]) -> Parts {
    std::array::from_fn(|c| terms.iter().map(|(weight, parts)| weight * parts[c]).sum())
}

/// What is asked of the facets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Interpolation.
    pub scheme: Scheme,
    /// Largest deviation as part of the radiosity.
    pub tolerance: f64,
}

/// Gathers at points of pieces, and judges what is found.
struct Judge<'a> {
    nodes: &'a NodeRadiosity<'a>,
    goal: Goal,
    dark: f64,
}

impl Judge<'_> {
    /// Deviation of radiosity, largest channel, and whether it is above the tolerance.
    fn deviation(&self, element: ElementId, found: &Parts, interpolated: &Parts) -> (f64, bool) {
        let (b, other) = (self.nodes.radiosity(element, found), self.nodes.radiosity(element, interpolated));
        let deviations: [f64; 3] = std::array::from_fn(|c| (b[c] - other[c]).abs());
        let flagged = (0..3).any(|c| deviations[c] > self.goal.tolerance * b[c].max(self.dark));
        (deviations.into_iter().fold(0.0, f64::max), flagged)
    }
}

impl RefinedFacets {
    /// Cuts the triangular `facets` (each with the pixels it covers), whose nodes are gathered, until no edge deviates
    /// by more than the tolerance or a triangle is below a pixel. `done` is called after each gathered point.
    pub fn new(
        nodes: &NodeRadiosity<'_>,
        surface: &VisibleSurface,
        facets: &[(ElementId, f64)],
        goal: Goal,
        done: impl Fn() + Sync,
    ) -> RefinedFacets {
        let mut refined = RefinedFacets {
            scheme: goal.scheme,
            roots: BTreeMap::new(),
            pieces: Vec::new(),
            edges: HashMap::new(),
            next_id: nodes.node_count() as u32,
            gathered: 0,
            cut: 0,
            unresolved: 0,
        };
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
        let judge = Judge { nodes, goal, dark: DARK * refined.mean_radiosity(nodes) };
        for depth in 0..=DEEPEST {
            // What was cut and is not asked again stays doubtful.
            let small = |pixels: f64| pixels <= 1.0 || depth == DEEPEST;
            for &(piece, _) in active.iter().filter(|&&(_, pixels)| depth > 0 && small(pixels)) {
                refined.pieces[piece].unresolved = true;
                refined.unresolved += 1;
            }
            if goal.scheme == Scheme::Linear {
                active.retain(|&(_, pixels)| !small(pixels));
            }
            refined.gather_middles(&judge, &active, &done);
            active.retain(|&(_, pixels)| !small(pixels));
            if active.is_empty() {
                break;
            }
            let verdicts = refined.verdicts(&judge, &active, &done);
            let centres = refined.centres(&judge, &active, &verdicts, &done);
            let mut children = Vec::new();
            for (&(piece, pixels), centre) in active.iter().zip(centres) {
                if let Some(first) = refined.cut(piece, &verdicts, centre) {
                    children.extend((first..first + 4).map(|child| (child, 0.25 * pixels)));
                }
            }
            active = children;
        }
        if goal.scheme != Scheme::Linear {
            (0..refined.pieces.len()).for_each(|piece| refined.take_middles(piece));
        }
        refined
    }

    fn mean_radiosity(&self, nodes: &NodeRadiosity<'_>) -> f64 {
        let corners = self.pieces.iter().flat_map(|p| p.corners.iter().map(|c| (p.element, c.before)));
        let sum: f64 = corners.map(|(e, value)| nodes.radiosity(e, &value).iter().sum::<f64>()).sum();
        sum / (9 * self.pieces.len().max(1)) as f64
    }

    /// Each edge of the active triangles that `wanted` asks for once, on its first triangle.
    fn edges_of(
        &self,
        active: &[(usize, f64)],
        wanted: impl Fn(&EdgeKey) -> bool,
    ) -> Vec<(EdgeKey, (usize, usize))> {
        let mut edges = BTreeMap::new();
        for &(piece, _) in active {
            for k in 0..3 {
                let key = self.pieces[piece].edge_key(k);
                if wanted(&key) {
                    edges.entry(key).or_insert((piece, k));
                }
            }
        }
        edges.into_iter().collect()
    }

    /// Gathers the middles of edges that have none yet.
    fn gather_middles(&mut self, judge: &Judge<'_>, active: &[(usize, f64)], done: &(impl Fn() + Sync)) {
        let edges = self.edges_of(active, |key| !self.edges.contains_key(key));
        let pieces = &self.pieces;
        let gather = |scratch: &mut Scratch, &(_, (piece, k)): &(EdgeKey, (usize, usize))| {
            let piece = &pieces[piece];
            done();
            judge.nodes.gathered(piece.element, &piece.receiver_on_edge(k, 0.5), scratch)
        };
        let found: Vec<Parts> = edges.par_iter().map_init(Scratch::default, gather).collect();
        self.gathered += found.len();
        for ((key, _), middle) in edges.into_iter().zip(found) {
            self.insert(key, middle, false);
        }
    }

    /// Keeps an edge unless it is known.
    fn insert(&mut self, key: EdgeKey, middle: Parts, straight: bool) {
        let id = self.next_id;
        let mut is_new = false;
        self.edges.entry(key).or_insert_with(|| {
            is_new = true;
            Edge { id, middle, straight }
        });
        self.next_id += u32::from(is_new);
    }

    /// Which edges of the active triangles interpolation does not serve.
    fn verdicts(
        &mut self,
        judge: &Judge<'_>,
        active: &[(usize, f64)],
        done: &(impl Fn() + Sync),
    ) -> HashMap<EdgeKey, Verdict> {
        let open = |key: &EdgeKey| self.edges.get(key).is_some_and(|edge| !edge.straight);
        let edges = self.edges_of(active, open);
        let (pieces, known) = (&self.pieces, &self.edges);
        let judged = |scratch: &mut Scratch, &(key, (piece, k)): &(EdgeKey, (usize, usize))| {
            let piece = &pieces[piece];
            let edge = known.get(&key)?;
            let (start, end) = (piece.corners[k].after, piece.corners[(k + 1) % 3].before);
            if judge.goal.scheme == Scheme::Linear {
                let linear = blend(&[(0.5, &start), (0.5, &end)]);
                let (deviation, flagged) = judge.deviation(piece.element, &edge.middle, &linear);
                return Some((Verdict { flagged, deviation, quarters: [linear; 2] }, linear, 0));
            }
            // Parabola through start, middle and end at the quarters.
            let quarters = [(start, end, 0.25), (end, start, 0.75)].map(|(near, far, at)| {
                let predicted = blend(&[(0.375, &near), (0.75, &edge.middle), (-0.125, &far)]);
                let found = judge.nodes.gathered(piece.element, &piece.receiver_on_edge(k, at), scratch);
                done();
                (judge.deviation(piece.element, &found, &predicted), found, predicted)
            });
            let flagged = quarters.iter().any(|((_, flagged), ..)| *flagged);
            let deviation = quarters.iter().fold(0.0, |most: f64, ((deviation, _), ..)| most.max(*deviation));
            let mut values = quarters.map(|(_, found, predicted)| if flagged { found } else { predicted });
            if piece.ids[k] != key.0 {
                values.reverse();
            }
            Some((Verdict { flagged, deviation, quarters: values }, edge.middle, 2))
        };
        let found: Vec<_> = edges.par_iter().map_init(Scratch::default, judged).collect();
        let mut verdicts = HashMap::new();
        for ((key, _), found) in edges.into_iter().zip(found) {
            let Some((verdict, middle, gathered)) = found else { continue };
            self.gathered += gathered;
            if !verdict.flagged
                && let Some(edge) = self.edges.get_mut(&key)
            {
                // An edge that stays linear has its middle there.
                edge.middle = middle;
            }
            verdicts.insert(key, verdict);
        }
        verdicts
    }

    /// Deviation in the middle of triangles that no edge asks to cut; gathering looks there too.
    fn centres(
        &mut self,
        judge: &Judge<'_>,
        active: &[(usize, f64)],
        verdicts: &HashMap<EdgeKey, Verdict>,
        done: &(impl Fn() + Sync),
    ) -> Vec<(f64, bool)> {
        if judge.goal.scheme != Scheme::Gather {
            return vec![(0.0, false); active.len()];
        }
        active.iter().for_each(|&(piece, _)| self.take_middles(piece));
        let pieces = &self.pieces;
        let asked = |scratch: &mut Scratch, &(piece, _): &(usize, f64)| {
            let piece = &pieces[piece];
            if (0..3).any(|k| verdicts.get(&piece.edge_key(k)).is_some_and(|v| v.flagged)) {
                return None;
            }
            let found = judge.nodes.gathered(piece.element, &piece.receiver(&[1.0 / 3.0; 3]), scratch);
            done();
            Some(judge.deviation(piece.element, &found, &piece.quadratic(&[1.0 / 3.0; 3])))
        };
        let found: Vec<Option<(f64, bool)>> = active.par_iter().map_init(Scratch::default, asked).collect();
        self.gathered += found.iter().flatten().count();
        found.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// Cuts a triangle into four if one of its edges or its middle asks for it; returns the first child.
    fn cut(
        &mut self,
        piece: usize,
        verdicts: &HashMap<EdgeKey, Verdict>,
        (centre, centre_flagged): (f64, bool),
    ) -> Option<usize> {
        let whole = self.pieces[piece].clone();
        let of_edges = [0, 1, 2].map(|k| verdicts.get(&whole.edge_key(k)).copied());
        let deviation = of_edges.iter().flatten().fold(centre, |most, v| most.max(v.deviation));
        self.pieces[piece].error = deviation;
        if !centre_flagged && of_edges.iter().flatten().all(|v| !v.flagged) {
            return None;
        }
        // The halves of its edges: known where the quarters are, still to be gathered where an edge was linear.
        let mut middles = [Edge { id: 0, middle: Parts::default(), straight: false }; 3];
        for (k, middle) in middles.iter_mut().enumerate() {
            let (start, end) = (whole.ids[k], whole.ids[(k + 1) % 3]);
            *middle = *self.edges.get(&key(start, end))?;
            let straight = of_edges[k].is_none_or(|v| !v.flagged);
            if straight || self.scheme != Scheme::Linear {
                let corner = |k: usize| whole.corners[k % 3];
                let (a, b) = (corner(k).after, corner(k + 1).before);
                let quarter = |near: &Parts, far: &Parts| match self.scheme {
                    Scheme::Linear => blend(&[(0.5, near), (0.5, &middle.middle)]),
                    _ => blend(&[(0.375, near), (0.75, &middle.middle), (-0.125, far)]),
                };
                let mut values = [quarter(&a, &b), quarter(&b, &a)];
                if let (Some(verdict), true) = (of_edges[k], self.scheme != Scheme::Linear) {
                    values = verdict.quarters;
                    if start > end {
                        values.reverse();
                    }
                }
                self.insert(key(start, middle.id), values[0], straight);
                self.insert(key(middle.id, end), values[1], straight);
            }
        }
        // Corners 0 to 2, then the middles of edges 0-1, 1-2 and 2-0.
        let ids = [whole.ids[0], whole.ids[1], whole.ids[2], middles[0].id, middles[1].id, middles[2].id];
        let point = |k: usize| match k {
            0..3 => (whole.points[k], whole.places[k], whole.corners[k]),
            _ => {
                let (a, b) = (k - 3, (k - 2) % 3);
                let point = 0.5 * (whole.points[a] + whole.points[b]);
                let place = 0.5 * (whole.places[a] + whole.places[b]);
                (point, place, Corner::whole(middles[k - 3].middle))
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
                middles: [Parts::default(); 3],
                children: 0,
                error: LEFT_AFTER_CUT * deviation,
                unresolved: false,
            });
        }
        self.pieces[piece].children = first;
        self.cut += 1;
        Some(first)
    }

    /// Gives a triangle the middles of its edges; the mean of the ends where one was never asked.
    fn take_middles(&mut self, piece: usize) {
        let Piece { corners, .. } = self.pieces[piece];
        for k in 0..3 {
            let middle = self.edges.get(&self.pieces[piece].edge_key(k)).map(|edge| edge.middle);
            let mean = || blend(&[(0.5, &corners[k].after), (0.5, &corners[(k + 1) % 3].before)]);
            self.pieces[piece].middles[k] = middle.unwrap_or_else(mean);
        }
    }

    /// What a facet gives at a place; `None` for facets that are no triangles.
    pub fn at(&self, element: ElementId, place: DVec2, weights: &mut Vec<f64>) -> Option<Found> {
        let mut piece = &self.pieces[*self.roots.get(&element)?];
        loop {
            corner_weights(&piece.places, place, weights);
            if piece.children == 0 {
                let gather = self.scheme == Scheme::Gather && piece.unresolved;
                let irradiance = match self.scheme {
                    Scheme::Linear => piece.linear(weights),
                    _ => piece.quadratic(weights),
                };
                let gather = gather.then(|| piece.receiver(weights));
                return Some(Found { irradiance, error: piece.error, gather });
            }
            let corner = (0..3).find(|&k| weights[k] > 0.5).unwrap_or(3);
            piece = &self.pieces[piece.children + corner];
        }
    }
}

/// Corners of the children: one at each corner, in the order of the corners, and the one in the middle.
const CHILDREN: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

impl Piece {
    fn edge_key(&self, k: usize) -> EdgeKey {
        key(self.ids[k], self.ids[(k + 1) % 3])
    }

    /// Where a part `at` along edge `k` receives: just inside.
    fn receiver_on_edge(&self, k: usize, at: f64) -> Receiver {
        let mut weights = [0.0; 3];
        (weights[k], weights[(k + 1) % 3]) = (1.0 - at, at);
        self.receiver(&weights)
    }

    /// Where the place with these weights of the corners receives: just inside.
    fn receiver(&self, weights: &[f64]) -> Receiver {
        let [a, b, c] = self.points;
        let point = weights[0] * a + weights[1] * b + weights[2] * c;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Receiver { point: limit_from_inside(point, (a + b + c) / 3.0), normal, face: None }
    }

    /// Corner values; each turns with the direction from its corner.
    fn turned(&self, weights: &[f64]) -> [Parts; 3] {
        std::array::from_fn(|k| {
            let (before, after) = (weights[(k + 2) % 3], weights[(k + 1) % 3]);
            let turned = if before + after > 0.0 { after / (before + after) } else { 0.5 };
            blend(&[(1.0 - turned, &self.corners[k].before), (turned, &self.corners[k].after)])
        })
    }

    fn linear(&self, weights: &[f64]) -> Parts {
        let [a, b, c] = &self.turned(weights);
        blend(&[(weights[0], a), (weights[1], b), (weights[2], c)])
    }

    /// Over six nodes; a parabola that dips below zero, as beside an umbra, is cut off there.
    fn quadratic(&self, weights: &[f64]) -> Parts {
        let ([a, b, c], [ab, bc, ca], w) = (&self.turned(weights), &self.middles, quadratic_weights(weights));
        let value = blend(&[(w[0], a), (w[1], b), (w[2], c), (w[3], ab), (w[4], bc), (w[5], ca)]);
        value.map(|x| x.max(0.0))
    }
}

/// The facet as a piece, if it is a triangle.
fn root(nodes: &NodeRadiosity<'_>, surface: &VisibleSurface, element: ElementId) -> Option<Piece> {
    let places = <[DVec2; 3]>::try_from(surface.corners(element)).ok()?;
    let Ends { ids, points, corners } = nodes.ends(element)?;
    let middles = [Parts::default(); 3];
    Some(Piece { element, ids, points, places, corners, middles, children: 0, error: 0.0, unresolved: false })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::lit_scene::LitScene;
    use crate::test_scenes::{add_parallelogram, empty_mesh, lit};
    use geometry::source_tree::Opening;
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
        // White and dark: what is gathered is what is seen.
        scene.materials[0].diffuse = [1.0; 3];
        scene
    }

    fn refined(scene: &LitScene, scheme: Scheme, tolerance: f64) -> (RefinedFacets, Vec<[DVec2; 3]>) {
        let surface = VisibleSurface::new(scene);
        let mut nodes = NodeRadiosity::new(scene, Opening::EXACT);
        let floor = [ElementId(0), ElementId(1)];
        nodes.gather(&floor, |_| {}, || {});
        let facets = floor.map(|element| (element, 1e6));
        let places = floor.map(|e| <[DVec2; 3]>::try_from(surface.corners(e)).unwrap()).to_vec();
        (RefinedFacets::new(&nodes, &surface, &facets, Goal { scheme, tolerance }, || {}), places)
    }

    #[test]
    fn a_spot_between_the_corners_is_found_and_neighbours_agree_along_their_edge() {
        let scene = floor_under_a_lamp();
        let (refined, places) = refined(&scene, Scheme::Linear, 0.01);
        assert!(refined.cut > 20 && refined.gathered > 100, "{refined:?}");
        let weights = &mut Vec::new();
        // The middle of the floor sees the lamp, a square of side 0.1 at height 0.1, by four right-angled corners: each
        // gives (1 / pi) l atan(l) with l = s / sqrt(1 + s^2), s = 1/2.
        let leg = 0.5 / 1.25f64.sqrt();
        let want = 4.0 / std::f64::consts::PI * leg * leg.atan();
        let middle = 0.5 * (places[0][0] + places[0][2]);
        let got = refined.at(ElementId(0), middle, weights).unwrap().irradiance[3];
        assert!((got - want).abs() < 1e-4 * want, "{got} {want}");
        for t in [0.1, 0.3, 0.45, 0.7] {
            let place = places[0][0].lerp(places[0][2], t);
            let [a, b] =
                [ElementId(0), ElementId(1)].map(|e| refined.at(e, place, weights).unwrap().irradiance[3]);
            assert!((a - b).abs() < 1e-6 * want, "at {t} of the diagonal: {a} and {b}");
        }
    }

    /// Worst error of a scheme at some places, relative to the value or 0.01, and the points it gathered.
    fn worst(scheme: Scheme, tolerance: f64) -> (f64, usize) {
        let scene = floor_under_a_lamp();
        let mut nodes = NodeRadiosity::new(&scene, Opening::EXACT);
        nodes.gather(&[ElementId(0), ElementId(1)], |_| {}, || {});
        let surface = VisibleSurface::new(&scene);
        let corners = <[DVec2; 3]>::try_from(surface.corners(ElementId(0))).unwrap();
        let points = nodes.ends(ElementId(0)).unwrap().points;
        let (refined, _) = refined(&scene, scheme, tolerance);
        let mut worst: f64 = 0.0;
        for (u, v) in [(0.2, 0.3), (0.4, 0.35), (0.1, 0.6), (0.33, 0.33), (0.48, 0.03)] {
            let place = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
            let point = points[0] + u * (points[1] - points[0]) + v * (points[2] - points[0]);
            let receiver = Receiver { point, normal: DVec3::Y, face: None };
            let want = nodes.gathered(ElementId(0), &receiver, &mut Scratch::default())[3];
            let got = refined.at(ElementId(0), place, &mut Vec::new()).unwrap().irradiance[3];
            worst = worst.max((got - want).abs() / want.max(0.01));
        }
        (worst, refined.gathered)
    }

    #[test]
    fn interpolation_keeps_the_tolerance_where_it_was_cut() {
        // Some places of an edge are asked, not every point: twice the tolerance is what is left in between.
        for (scheme, tolerance) in [
            (Scheme::Linear, 0.1),
            (Scheme::Linear, 0.01),
            (Scheme::Quadratic, 0.01),
            (Scheme::Gather, 0.001),
        ] {
            let (worst, _) = worst(scheme, tolerance);
            assert!(worst < 2.0 * tolerance, "{scheme:?} {tolerance}: {worst}");
        }
    }

    #[test]
    fn quadratic_needs_fewer_points_for_the_same_error() {
        let [(_, linear), (_, quadratic)] = [Scheme::Linear, Scheme::Quadratic].map(|s| worst(s, 1e-3));
        assert!(quadratic < linear / 2, "{quadratic} against {linear}");
    }
}
