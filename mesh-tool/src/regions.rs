//! Planar regions: coplanar neighbours of one material and group become one face, with holes where others hold the
//! place. What is meshed, casts shadows and receives lines then no longer depends on how a wall was cut into faces.

use crate::clean::{Cleaned, Face, Member, without_repeats};
use crate::given::drawn;
use crate::outline::{regions, ring};
use crate::planar::PlanarGraph;
use crate::sheets::Layer;
use crate::triangulation::{RESOLUTION, Triangulation, Trouble};
use geometry::plane::Plane;
use geometry::polygon;
use interchange::ids::GroupId;
use interchange::report::Report;
use std::collections::{BTreeMap, HashMap};

/// A ring turns by less than this at corners that are left out, in radians; far below what a shadow can tell.
const STRAIGHT: f64 = 1e-10;
/// So are corners closer than this, in units of the frame, to the line between those beside them: no triangle between
/// the three could be told from one that is turned over.
const FLAT: f64 = RESOLUTION;

/// Corners of a region lie within so many weld tolerances of its plane: those of coplanar faces do, but for the weld.
const FLATNESS: f64 = 2.0;

/// An emitter that lost part of its place to another face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LostEmitter {
    /// Its group.
    pub group: GroupId,
    /// Its line in the OBJ.
    pub line: usize,
    /// Line of the face that holds the place.
    pub winner_line: usize,
}

/// Merges the faces of a scene; one-sided ones only, for both sides of a two-sided face must stay one face. Also
/// returns the emitters that lost their place to another, and the area that any faces lost so.
pub fn merged(scene: Cleaned, layers: &[Layer], report: &mut Report) -> (Cleaned, Vec<LostEmitter>, f64) {
    let (mut lost, mut overlapped) = (Vec::new(), 0.0);
    let mut overlapping = 0;
    let before = scene.faces.len();
    let mut replaced = vec![false; before];
    let mut made: Vec<Face> = Vec::new();
    let mut scene = scene;
    for layer in layers.iter().filter(|layer| layer.sheets.len() > 1) {
        // Faces too close to be told apart stay faces, and so do slivers whose union is thinner than it is flat.
        let Ok((found, losers, area)) = regions_of(layer, &mut scene) else {
            report.count("planes not merged", 1);
            continue;
        };
        overlapped += area;
        let face_of = |sheet: u32| &scene.faces[layer.sheets[sheet as usize].face as usize];
        for (&loser, &winner) in &losers {
            let (face, holder) = (face_of(loser), face_of(winner));
            // Two-sided faces stay and are counted when their elements are made.
            overlapping += usize::from(!face.two_sided);
            if face.emits && !face.two_sided {
                lost.push(LostEmitter { group: face.group, line: face.line, winner_line: holder.line });
            }
        }
        // Faces that were alone stay as they were given.
        let mut regions_of_face = vec![0usize; layer.sheets.len()];
        for region in &found {
            region.sheets.iter().for_each(|&sheet| regions_of_face[sheet as usize] += 1);
        }
        for region in found {
            let alone = |&sheet: &u32| {
                let face = &scene.faces[layer.sheets[sheet as usize].face as usize];
                let whole = polygon::area(&scene.places.corners(&face.corners));
                regions_of_face[sheet as usize] == 1 && (region.area - whole).abs() <= 1e-12 * whole
            };
            if region.sheets.len() == 1 && region.sheets.iter().all(alone) {
                continue;
            }
            for &sheet in &region.sheets {
                replaced[layer.sheets[sheet as usize].face as usize] = true;
            }
            made.push(region.face(layer, &scene));
        }
        // A face that holds no place at all is gone.
        for (sheet, count) in regions_of_face.iter().enumerate() {
            let face = layer.sheets[sheet].face as usize;
            if *count == 0 && !scene.faces[face].two_sided {
                replaced[face] = true;
            }
        }
    }
    let kept = scene.faces.into_iter().zip(replaced).filter(|(_, gone)| !gone).map(|(face, _)| face);
    let mut faces: Vec<Face> = kept.chain(made).collect();
    // In the order of the scene: the first given holds a place.
    faces.sort_by_key(|face| (face.input, face.line, face.corners.first().copied()));
    report.count("faces merged into regions", before.saturating_sub(faces.len()));
    report.count("overlapping faces cut", overlapping);
    (Cleaned { faces, ..scene }, lost, overlapped)
}

/// A region before it is a face.
struct Region {
    corners: Vec<u32>,
    sheets: Vec<u32>,
    area: f64,
}

impl Region {
    /// Whether the plane that the ring itself spans is that of its corners.
    fn is_flat(&self, scene: &Cleaned) -> bool {
        let (corners, tolerance) = (scene.places.corners(&self.corners), scene.places.tolerance());
        let near = |plane: Plane| corners.iter().all(|&p| plane.distance(p).abs() <= FLATNESS * tolerance);
        Plane::of_polygon(&corners).is_none_or(near)
    }

    fn face(&self, layer: &Layer, scene: &Cleaned) -> Face {
        let face_of = |&sheet: &u32| &scene.faces[layer.sheets[sheet as usize].face as usize];
        let area = |face: &Face| polygon::area(&scene.places.corners(&face.corners));
        let mut members: Vec<&Face> = self.sheets.iter().map(face_of).collect();
        members.sort_by_key(|face| (face.input, face.line));
        let mut largest = members[0];
        for face in &members {
            if area(face) > 1.000001 * area(largest) {
                largest = face;
            }
        }
        let mut corners = self.corners.clone();
        if layer.reversed {
            corners.reverse();
        }
        let own: Vec<Member> = members
            .iter()
            .flat_map(|face| match &face.members[..] {
                [] => vec![Member { input: face.input, corners: face.corners.clone() }],
                members => members.to_vec(),
            })
            .collect();
        Face { corners, plane: largest.plane, members: own, ..members[0].clone() }
    }
}

/// Sheets that lost part of their place, and one that holds it.
type Losers = BTreeMap<u32, u32>;

/// The regions of one layer that one-sided faces hold, and the area that one-sided faces lose to others.
fn regions_of(layer: &Layer, scene: &mut Cleaned) -> Result<(Vec<Region>, Losers, f64), Trouble> {
    let graph = drawn(layer, 0..layer.sheets.len() as u32, scene, |_| {});
    let (graph, triangulation) = graph.arrange(scene.places.tolerance() / layer.frame.size)?;
    let winner = |t: usize| winner(layer, &triangulation, t);
    let class = |t: usize| {
        let face = &scene.faces[layer.sheets[winner(t)? as usize].face as usize];
        (!face.two_sided).then_some((face.material, face.group))
    };
    let found = regions(&triangulation, class);
    let regions: Vec<Region> = found
        .iter()
        .map(|triangles| {
            let mut sheets: Vec<u32> = triangles.iter().filter_map(|&t| winner(t)).collect();
            sheets.sort_unstable();
            sheets.dedup();
            let ring = ring(&graph, &triangulation, triangles);
            let corners = placed(&graph, &without_straight(&graph, ring), scene);
            let area = polygon::area(&scene.places.corners(&corners));
            Region { corners, sheets, area }
        })
        .collect();
    if regions.iter().any(|region| !region.is_flat(scene)) {
        return Err(Trouble::Crowded);
    }
    let mut losers = Losers::new();
    for t in 0..triangulation.triangles.len() {
        let Some(winner) = winner(t) else { continue };
        for (sheet, _) in triangulation.sheets(t).filter(|&(sheet, w)| w > 0 && sheet != winner) {
            losers.entry(sheet).or_insert(winner);
        }
    }
    let two_sided = |sheet: u32| scene.faces[layer.sheets[sheet as usize].face as usize].two_sided;
    let overlapped = overlapped_area(layer, &graph, &triangulation, |sheet| !two_sided(sheet));
    Ok((regions, losers, overlapped))
}

/// The sheet that holds a triangle.
pub fn winner(layer: &Layer, triangulation: &Triangulation, triangle: usize) -> Option<u32> {
    let own = |&(sheet, winding): &(u32, i32)| winding > 0 && (sheet as usize) < layer.sheets.len();
    layer.winner(triangulation.sheets(triangle).filter(own).map(|(sheet, _)| sheet))
}

/// Area that the sheets for which `counts` holds would have where another holds the place.
pub fn overlapped_area(
    layer: &Layer,
    graph: &PlanarGraph,
    triangulation: &Triangulation,
    counts: impl Fn(u32) -> bool,
) -> f64 {
    let lost = |t: usize| {
        let holder = winner(layer, triangulation, t)?;
        let own = triangulation.sheets(t).filter(|&(sheet, _)| (sheet as usize) < layer.sheets.len());
        let times: i32 = own
            .filter(|&(sheet, winding)| winding > 0 && counts(sheet))
            .map(|(sheet, winding)| winding - i32::from(sheet == holder))
            .sum();
        let corners = triangulation.triangles[t].corners.map(|p| graph.points[p as usize].position);
        (times > 0).then(|| f64::from(times) * polygon::area(&corners))
    };
    (0..triangulation.triangles.len()).filter_map(lost).sum::<f64>().abs()
}

/// Places of points; where borders cross each other, new ones.
fn placed(graph: &PlanarGraph, ring: &[u32], scene: &mut Cleaned) -> Vec<u32> {
    let place = |&p: &u32| {
        let point = &graph.points[p as usize];
        point.place.unwrap_or_else(|| scene.places.insert(point.position))
    };
    without_repeats(ring.iter().map(place).collect())
}

/// A ring without the corners it runs straight on at. Where it comes by more than once, at the ends of its seams, it
/// keeps them: left out on the way there but not on the way back, such a corner would take a triangle along.
fn without_straight(graph: &PlanarGraph, mut ring: Vec<u32>) -> Vec<u32> {
    let mut visits: HashMap<u32, u32> = HashMap::new();
    ring.iter().for_each(|&point| *visits.entry(point).or_default() += 1);
    let mut k = 0;
    while k < ring.len() && ring.len() > 3 {
        let n = ring.len();
        let [a, b, c] =
            [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]].map(|p| graph.points[p as usize].uv);
        let (before, after) = (b - a, c - b);
        let limit = (STRAIGHT * before.length() * after.length()).max(FLAT * a.distance(c));
        let straight = before.perp_dot(after).abs() <= limit;
        if straight && before.dot(after) > 0.0 && visits[&ring[k]] == 1 {
            ring.remove(k);
        } else {
            k += 1;
        }
    }
    ring
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::planar::Point;
    use glam::DVec2;

    /// The seam meets the hole at a corner that lies nearly on the line from its other end to the next one: by less
    /// than `FLAT`, so it would be left out on the way there. The rim's straight corner is.
    #[test]
    fn seam_comes_back_by_the_corner_it_went_by() {
        let mut graph = PlanarGraph::default();
        let rim = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let hole = [(0.25, 0.25), (0.25 + 1e-7, 0.25 + 1e-7 + 4e-11), (0.25 + 1e-7, 0.25)];
        let points: Vec<u32> = rim
            .iter()
            .chain(&hole)
            .map(|&(x, y)| {
                let uv = DVec2::new(x, y);
                graph.point(Point { uv, position: uv.extend(0.0), place: None })
            })
            .collect();
        let ring: Vec<u32> = [0, 5, 6, 7, 5, 0, 1, 2, 3, 4].map(|k: usize| points[k]).to_vec();
        let area = |ring: &[u32]| -> f64 {
            let at = |k: usize| graph.points[ring[k % ring.len()] as usize].uv;
            0.5 * (0..ring.len()).map(|k| at(k).perp_dot(at(k + 1))).sum::<f64>()
        };
        let kept = without_straight(&graph, ring);
        assert_eq!(kept, [0, 5, 6, 7, 5, 0, 2, 3, 4].map(|k: usize| points[k]));
        // A square less half one of 1e-7 (and 4e-11); ten products of at most one, each rounded.
        assert!((area(&kept) - (1.0 - 0.5e-14)).abs() < 10.0 * f64::EPSILON, "{}", area(&kept) - 1.0);
    }
}
