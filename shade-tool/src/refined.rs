//! Facets cut further where interpolation is not good enough: an edge on which gathered irradiance differs from the
//! interpolated one by more than the tolerance makes the facets on both of its sides into four each, and so on, down to a
//! pixel. Each part of the light has facets of its own.
//!
//! Linear: the middle of the edge is asked. Quadratic: its two quarter points; or, for light that is known to be smooth, the
//! middle, whose distance from the line is several times what the parabola through it is off by. Gathering: as
//! quadratic, and the middle of the facet besides; what is not resolved at a pixel's size is left to be gathered at every
//! sample. So irradiance is reused where it is smooth, as Ward, Rubinstein & Clear 1988 do, but the error of reuse is
//! measured instead of guessed from distances, and only shadow borders and corners cost.
//!
//! The decision belongs to the edge, so neighbours agree along it: an edge that is not cut stays as it is on both sides,
//! and its halves are never asked again.

use crate::interpolation::corner_weights;
use crate::judge::{Goal, Judge, Other, Scheme};
use crate::light::{Irradiance, Part};
use crate::nodes::{Ends, NodeRadiosity};
use crate::piece::{EdgeKey, Piece, blend, key, quarter};
use crate::receiver::Receiver;
use crate::visible::VisibleSurface;
use glam::DVec2;
use interchange::ids::ElementId;
use interchange::tool::ProgressBar;
use std::collections::{BTreeMap, HashMap};

/// Cuts in a row; 2^8 is more than any picture's pixels across a facet that matter.
const DEEPEST: usize = 8;
/// Deviations count relative to the radiosity there, or to this part of the mean one where that is darker: what is dark as a
/// whole needs no fine structure.
const DARK: f64 = 0.05;
/// Part of a deviation that cutting in two leaves where nothing is measured: halves of a quarter for smooth fields, doubled
/// for fields with a kink.
const LEFT_AFTER_CUT: f64 = 0.5;
/// The middle of an edge.
const MIDDLE: f64 = 0.5;
/// The middle of a facet.
const CENTRE: [f64; 3] = [1.0 / 3.0; 3];

/// What is known of an edge.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Number of the node in its middle.
    id: u32,
    middle: Irradiance,
    /// Part of an edge that interpolation serves.
    straight: bool,
}

/// Whether interpolation serves an edge, from the end with the lower number on.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    flagged: bool,
    deviation: f64,
    quarters: Option<[Irradiance; 2]>,
}

/// What a facet gives at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Irradiance.
    pub irradiance: Irradiance,
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
    /// Facets that were too small to be asked.
    pub small: usize,
}

impl RefinedFacets {
    /// Cuts the triangular `facets` (each with its length in pixels), whose nodes are gathered, until no edge deviates
    /// by more than the tolerance or a triangle is short. `other` is the light that makes up the whole;
    /// `bar` grows by the points that are gathered, and moves on with each.
    pub fn new(
        nodes: &NodeRadiosity<'_>,
        surface: &VisibleSurface,
        facets: &[(ElementId, f64)],
        goal: Goal,
        other: Other<'_>,
        bar: &ProgressBar,
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
            small: 0,
        };
        let mut active: Vec<(usize, f64)> = Vec::new();
        for &(element, pixels) in facets {
            if let Some(piece) = root(nodes, surface, element, goal.part) {
                refined.roots.insert(element, refined.pieces.len());
                if pixels <= goal.pixels {
                    refined.small += 1;
                } else if nodes.reflects(element) {
                    active.push((refined.pieces.len(), pixels));
                }
                refined.pieces.push(piece);
            }
        }
        let judge = Judge { nodes, goal, other, dark: DARK * refined.mean_radiosity(nodes, other), bar };
        for depth in 0..=DEEPEST {
            // What was cut and is not asked again stays doubtful.
            let small = |pixels: f64| pixels <= goal.pixels || depth == DEEPEST;
            for &(piece, _) in active.iter().filter(|&&(_, pixels)| small(pixels)) {
                refined.pieces[piece].unresolved = true;
                refined.unresolved += 1;
            }
            active.retain(|&(_, pixels)| !small(pixels));
            if active.is_empty() {
                break;
            }
            refined.gather_middles(&judge, &active);
            let verdicts = refined.verdicts(&judge, &active);
            let centres = refined.centres(&judge, &active, &verdicts);
            let mut children = Vec::new();
            for (&(piece, pixels), centre) in active.iter().zip(centres) {
                if let Some(first) = refined.cut(piece, &verdicts, centre) {
                    children.extend((first..first + 4).map(|child| (child, 0.5 * pixels)));
                }
            }
            active = children;
        }
        if goal.scheme != Scheme::Linear {
            (0..refined.pieces.len()).for_each(|piece| refined.take_middles(piece));
        }
        refined
    }

    fn mean_radiosity(&self, nodes: &NodeRadiosity<'_>, other: Other<'_>) -> f64 {
        let of_piece = |piece: &Piece| -> f64 {
            let other = other(piece.element, piece.place(&CENTRE));
            let mean = piece.linear(&CENTRE);
            nodes.radiosity(piece.element, &std::array::from_fn(|c| mean[c] + other[c])).iter().sum()
        };
        self.pieces.iter().map(of_piece).sum::<f64>() / (3 * self.pieces.len().max(1)) as f64
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
    fn gather_middles(&mut self, judge: &Judge<'_>, active: &[(usize, f64)]) {
        let edges = self.edges_of(active, |key| !self.edges.contains_key(key));
        let middle = |&(_, (piece, k)): &(EdgeKey, (usize, usize))| {
            let piece: &Piece = &self.pieces[piece];
            (piece, Piece::on_edge(k, MIDDLE))
        };
        let found = judge.gathered(edges.iter().map(middle));
        self.gathered += found.len();
        for ((key, _), middle) in edges.into_iter().zip(found) {
            self.insert(key, middle, false);
        }
    }

    /// Keeps an edge unless it is known.
    fn insert(&mut self, key: EdgeKey, middle: Irradiance, straight: bool) {
        let id = self.next_id;
        let mut is_new = false;
        self.edges.entry(key).or_insert_with(|| {
            is_new = true;
            Edge { id, middle, straight }
        });
        self.next_id += u32::from(is_new);
    }

    /// Which edges of the active triangles interpolation does not serve.
    fn verdicts(&mut self, judge: &Judge<'_>, active: &[(usize, f64)]) -> HashMap<EdgeKey, Verdict> {
        let open = |key: &EdgeKey| self.edges.get(key).is_some_and(|edge| !edge.straight);
        let edges = self.edges_of(active, open);
        let mut found = Vec::new();
        if judge.asks_quarters() {
            let quarters = |&(_, (piece, k)): &(EdgeKey, (usize, usize))| {
                let piece: &Piece = &self.pieces[piece];
                [0.25, 0.75].map(|at| (piece, Piece::on_edge(k, at)))
            };
            found = judge.gathered(edges.iter().flat_map(quarters));
            self.gathered += found.len();
        }
        let mut verdicts = HashMap::new();
        for (at, (key, (piece, k))) in edges.into_iter().enumerate() {
            let piece = &self.pieces[piece];
            let Some(edge) = self.edges.get_mut(&key) else { continue };
            let (start, end) = piece.ends(k);
            if !judge.asks_quarters() {
                let linear = blend(&[(0.5, &start), (0.5, &end)]);
                let (deviation, flagged) =
                    judge.deviation(piece, &Piece::on_edge(k, MIDDLE), &edge.middle, &linear);
                if !flagged && judge.goal.scheme == Scheme::Linear {
                    // An edge that stays linear has its middle there.
                    edge.middle = linear;
                }
                verdicts.insert(key, Verdict { flagged, deviation, quarters: None });
                continue;
            }
            // Parabola through start, middle and end at the quarters.
            let predicted = [quarter(&start, &edge.middle, &end), quarter(&end, &edge.middle, &start)];
            let found = [found[2 * at], found[2 * at + 1]];
            let deviations = [0, 1].map(|c| {
                let weights = Piece::on_edge(k, [0.25, 0.75][c]);
                judge.deviation(piece, &weights, &found[c], &predicted[c])
            });
            let flagged = deviations.iter().any(|(_, flagged)| *flagged);
            let deviation = deviations.iter().fold(0.0, |most: f64, (deviation, _)| most.max(*deviation));
            let mut values = if flagged { found } else { predicted };
            if piece.ids[k] != key.0 {
                values.reverse();
            }
            verdicts.insert(key, Verdict { flagged, deviation, quarters: Some(values) });
        }
        verdicts
    }

    /// Deviation in the middle of triangles that no edge asks to cut; gathering looks there too.
    fn centres(
        &mut self,
        judge: &Judge<'_>,
        active: &[(usize, f64)],
        verdicts: &HashMap<EdgeKey, Verdict>,
    ) -> Vec<(f64, bool)> {
        let mut centres = vec![(0.0, false); active.len()];
        if judge.goal.scheme != Scheme::Gather {
            return centres;
        }
        active.iter().for_each(|&(piece, _)| self.take_middles(piece));
        let is_whole = |piece: &Piece| {
            (0..3).all(|k| verdicts.get(&piece.edge_key(k)).is_none_or(|verdict| !verdict.flagged))
        };
        let asked: Vec<usize> = (0..active.len()).filter(|&k| is_whole(&self.pieces[active[k].0])).collect();
        let found = judge.gathered(asked.iter().map(|&k| (&self.pieces[active[k].0], CENTRE)));
        self.gathered += found.len();
        for (k, found) in asked.into_iter().zip(found) {
            let piece = &self.pieces[active[k].0];
            centres[k] = judge.deviation(piece, &CENTRE, &found, &piece.quadratic(&CENTRE));
        }
        centres
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
        // The halves of its edges: known where the quarters are, still to be gathered where only the middle is.
        let mut middles = [(0, [0.0; 3]); 3];
        for (k, at_middle) in middles.iter_mut().enumerate() {
            let (start, end) = (whole.ids[k], whole.ids[(k + 1) % 3]);
            let Edge { id, middle, .. } = *self.edges.get(&key(start, end))?;
            *at_middle = (id, middle);
            let straight = of_edges[k].is_none_or(|verdict| !verdict.flagged);
            let measured = of_edges[k].and_then(|verdict| verdict.quarters);
            let (a, b) = whole.ends(k);
            let halves = match measured {
                Some([first, second]) if start < end => Some([first, second]),
                Some([first, second]) => Some([second, first]),
                None if !straight => None,
                None if self.scheme == Scheme::Linear => {
                    Some([&a, &b].map(|end| blend(&[(0.5, end), (0.5, &middle)])))
                }
                None => Some([quarter(&a, &middle, &b), quarter(&b, &middle, &a)]),
            };
            if let Some([first, second]) = halves {
                self.insert(key(start, id), first, straight);
                self.insert(key(id, end), second, straight);
            }
        }
        let first = self.pieces.len();
        self.pieces.extend(whole.cut(middles, LEFT_AFTER_CUT * deviation));
        self.pieces[piece].children = first;
        self.cut += 1;
        Some(first)
    }

    /// Gives a triangle the middles of its edges; the mean of the ends where one was never asked.
    fn take_middles(&mut self, piece: usize) {
        for k in 0..3 {
            let whole = &self.pieces[piece];
            let (start, end) = whole.ends(k);
            let middle = self.edges.get(&whole.edge_key(k)).map(|edge| edge.middle);
            self.pieces[piece].middles[k] = middle.unwrap_or_else(|| blend(&[(0.5, &start), (0.5, &end)]));
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

/// The facet as a piece, if it is a triangle.
fn root(
    nodes: &NodeRadiosity<'_>,
    surface: &VisibleSurface,
    element: ElementId,
    part: Part,
) -> Option<Piece> {
    let places = <[DVec2; 3]>::try_from(surface.corners(element)).ok()?;
    let Ends { ids, points, corners } = nodes.ends(element)?;
    Some(Piece {
        element,
        ids,
        points,
        places,
        corners: corners.map(|corner| corner.part(part)),
        middles: [[0.0; 3]; 3],
        children: 0,
        error: 0.0,
        unresolved: false,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::judge::Proof;
    use crate::lit_scene::LitScene;
    use crate::test_scenes::{add_parallelogram, empty_mesh, lit};
    use geometry::gather::Scratch;
    use geometry::source_tree::Opening;
    use glam::DVec3;
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

    /// The lamp does not emit but reflect, so that its light is indirect.
    fn goal(scheme: Scheme, tolerance: f64) -> Goal {
        Goal { part: Part::Indirect, scheme, proof: Proof::Quarters, tolerance, pixels: 1.0 }
    }

    fn refined(scene: &LitScene, scheme: Scheme, tolerance: f64) -> (RefinedFacets, Vec<[DVec2; 3]>) {
        let surface = VisibleSurface::new(scene);
        let mut nodes = NodeRadiosity::new(scene, Opening::EXACT);
        let floor = [ElementId(0), ElementId(1)];
        nodes.gather(&floor, |_| {}, || {});
        let facets = floor.map(|element| (element, 1e6));
        let places = floor.map(|e| <[DVec2; 3]>::try_from(surface.corners(e)).unwrap()).to_vec();
        let goal = goal(scheme, tolerance);
        (
            RefinedFacets::new(&nodes, &surface, &facets, goal, &|_, _| [0.0; 3], &ProgressBar::hidden()),
            places,
        )
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
        let got = refined.at(ElementId(0), middle, weights).unwrap().irradiance[0];
        assert!((got - want).abs() < 1e-4 * want, "{got} {want}");
        for t in [0.1, 0.3, 0.45, 0.7] {
            let place = places[0][0].lerp(places[0][2], t);
            let [a, b] =
                [ElementId(0), ElementId(1)].map(|e| refined.at(e, place, weights).unwrap().irradiance[0]);
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
            let got = refined.at(ElementId(0), place, &mut Vec::new()).unwrap().irradiance[0];
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
