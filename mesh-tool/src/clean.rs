//! Cleaning: the scene's polygons become planar faces over welded places (Baum, Mann, Smith & Winget 1991).
//!
//! Equal corners become one place; repeated corners, faces without area and faces given twice are dropped; polygons
//! whose corners lie off their plane are cut into triangles. Everything dropped or cut is counted.

use crate::duplicates::without_duplicates;
use crate::frame::{Frame, crossing_edges};
use crate::orient::orient;
use crate::places::{Places, weld_tolerance};
use crate::planar::{Border, PlanarGraph};
use crate::steps::{Off, Step};
use crate::triangulation::Trouble;
use geometry::plane::{PLANARITY, Plane};
use geometry::polygon;
use glam::DVec3;
use interchange::counted::counted;
use interchange::ids::{GroupId, MaterialId};
use interchange::report::Report;
use interchange::scene::{Scene, SceneFace};
use interchange::{Error, Result};

/// A face of the scene that a region was made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// The scene's face.
    pub input: u32,
    /// Places of its corners.
    pub corners: Vec<u32>,
}

/// A planar polygon of the scene.
#[derive(Debug, Clone)]
pub struct Face {
    /// Places of its corners, counter-clockwise from the front, no two in a row equal.
    pub corners: Vec<u32>,
    /// Its plane, normal to the front.
    pub plane: Plane,
    /// The scene's face it is all or part of; of a region the first.
    pub input: u32,
    /// What a region was made of; empty for a face that is itself.
    pub members: Vec<Member>,
    /// Group.
    pub group: GroupId,
    /// Material.
    pub material: MaterialId,
    /// Whether the material emits.
    pub emits: bool,
    /// Whether both sides take part.
    pub two_sided: bool,
    /// Line of the OBJ.
    pub line: usize,
}

/// A cleaned scene.
#[derive(Debug, Clone)]
pub struct Cleaned {
    /// Places of all corners.
    pub places: Places,
    /// Planar faces, in scene order.
    pub faces: Vec<Face>,
}

/// Cleans `scene`, but for the steps that `off` names; every repair goes into `report`.
pub fn clean(scene: &Scene, off: &Off<Step>, report: &mut Report) -> Result<Cleaned> {
    let vertices: Vec<DVec3> = scene.vertices.iter().copied().map(DVec3::from_array).collect();
    let tolerance = weld_tolerance(&vertices);
    if scene.faces.is_empty() || tolerance <= 0.0 {
        return Err(Error::whole(&scene.path, "no face with area; a scene needs at least one"));
    }
    let mut places = Places::new(vertices.first().copied().unwrap_or_default(), tolerance);
    let weld = off.leaves(Step::Weld);
    let place = |&vertex: &DVec3| if weld { places.insert(vertex) } else { places.append(vertex) };
    let welded: Vec<u32> = vertices.iter().map(place).collect();
    report.count("input faces", scene.faces.len());
    report.count("welded vertices", vertices.len() - places.positions().len());

    let (mut faces, mut largest_deviation) = (Vec::new(), 0.0f64);
    let (mut without_area, mut cut) = (0, 0);
    for (input, given) in scene.faces.iter().enumerate() {
        let corners = without_repeats(given.corners.iter().map(|&corner| welded[corner as usize]).collect());
        let positions = places.corners(&corners);
        let Some(plane) = plane_of(&positions, tolerance) else {
            if !off.leaves(Step::ZeroArea) {
                let found =
                    "a face without area, which --no-clean zero-area keeps from being dropped; remove it";
                return Err(Error::scene(&scene.path, given.line, found));
            }
            without_area += 1;
            continue;
        };
        let deviation = positions.iter().map(|&p| plane.distance(p).abs()).fold(0.0, f64::max)
            / polygon::diameter(&positions);
        let convex = polygon::is_convex(&positions, plane.normal, PLANARITY);
        if !convex {
            refuse_crossing(scene, given, &positions, &plane, tolerance)?;
        }
        let material = scene.materials.values.get(given.material.index()).copied().unwrap_or_default();
        let face = |corners: Vec<u32>, plane: Plane| Face {
            corners,
            plane,
            input: input as u32,
            members: Vec::new(),
            group: given.group,
            material: given.material,
            emits: material.emits(),
            two_sided: material.is_two_sided(),
            line: given.line,
        };
        if deviation <= PLANARITY {
            faces.push(face(corners, plane));
            continue;
        }
        cut += 1;
        largest_deviation = largest_deviation.max(fan_deviation(&positions));
        let pieces = if convex { fan(&corners) } else { triangles(scene, given, &corners, &places, &plane)? };
        for piece in pieces {
            match plane_of(&places.corners(&piece), tolerance) {
                Some(plane) => faces.push(face(piece, plane)),
                None => without_area += 1,
            }
        }
    }
    let (mut faces, dropped) = if off.leaves(Step::Duplicates) {
        without_duplicates(faces, &places, scene, report)
    } else {
        (faces, 0)
    };
    let oriented = if off.leaves(Step::Orient) { orient(&mut faces, &places) } else { Default::default() };

    report.count("dropped zero area", without_area);
    report.count("dropped duplicates", dropped);
    report.count("non-planar faces cut", cut);
    report.count("turned over", oriented.flipped.len());
    report.count("patches without orientation", oriented.one_sided.len());
    report.count("faces", faces.len());
    report.estimate("largest plane deviation", largest_deviation);
    if without_area > 0 {
        report.warn(format!(
            "{}: {}",
            scene.path.display(),
            counted(without_area, "face without area was dropped", "faces without area were dropped")
        ));
    }
    if cut > 0 {
        report.warn(format!(
            "{}: {} (largest deviation {largest_deviation:.1e} of the side)",
            scene.path.display(),
            counted(
                cut,
                "face that is not planar was cut into triangles",
                "faces that are not planar were cut into triangles"
            )
        ));
    }
    let lines = |which: &[usize]| {
        let lines: Vec<String> = which.iter().map(|&face| faces[face].line.to_string()).collect();
        lines.join(", ")
    };
    if !oriented.flipped.is_empty() {
        report.warn(format!(
            "{}: {}, on {} {} (--no-clean orient keeps this)",
            scene.path.display(),
            counted(
                oriented.flipped.len(),
                "face contradicted its neighbours and was turned over",
                "faces contradicted their neighbours and were turned over"
            ),
            if oriented.flipped.len() == 1 { "line" } else { "lines" },
            lines(&oriented.flipped)
        ));
    }
    if !oriented.one_sided.is_empty() {
        report.warn(format!(
            "{}: the faces connected to those on lines {} have no consistent orientation and were left as they are",
            scene.path.display(),
            lines(&oriented.one_sided)
        ));
    }
    if faces.is_empty() {
        return Err(Error::whole(&scene.path, "no face with area; a scene needs at least one"));
    }
    Ok(Cleaned { places, faces })
}

/// Without corners that repeat the one before them, the last one counting as before the first.
pub fn without_repeats(mut corners: Vec<u32>) -> Vec<u32> {
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    corners
}

/// Plane of a polygon, or `None` where it is thinner than the tolerance and so has no area to speak of.
fn plane_of(positions: &[DVec3], tolerance: f64) -> Option<Plane> {
    let thick = polygon::area(positions) > 0.5 * tolerance * polygon::diameter(positions);
    Plane::of_polygon(positions).filter(|_| thick)
}

fn refuse_crossing(
    scene: &Scene,
    given: &SceneFace,
    positions: &[DVec3],
    plane: &Plane,
    tolerance: f64,
) -> Result<()> {
    let frame = Frame::new(plane, [positions].into_iter());
    let flat: Vec<_> = positions.iter().map(|&p| frame.flatten(p)).collect();
    match crossing_edges(&flat, tolerance / frame.size) {
        None => Ok(()),
        Some((first, second)) => Err(Error::scene(
            &scene.path,
            given.line,
            format!(
                "the polygon crosses itself (the edges after its corners {} and {}); split it into simple polygons",
                first + 1,
                second + 1
            ),
        )),
    }
}

/// How far a corner lies from the plane of the fan's triangle before it, at most, in parts of the polygon's side (the
/// root of its area).
fn fan_deviation(positions: &[DVec3]) -> f64 {
    let off = |k: usize| {
        let plane = Plane::of_polygon(&[positions[0], positions[k - 1], positions[k]]);
        plane.map_or(0.0, |plane| plane.distance(positions[k + 1]).abs())
    };
    (2..positions.len() - 1).map(off).fold(0.0, f64::max) / polygon::area(positions).sqrt()
}

/// Triangles from the first corner.
fn fan(corners: &[u32]) -> Vec<Vec<u32>> {
    corners[1..].windows(2).map(|edge| vec![corners[0], edge[0], edge[1]]).collect()
}

/// Triangles of a concave polygon that is not planar: a fan would leave it, so its projection is triangulated.
fn triangles(
    scene: &Scene,
    given: &SceneFace,
    corners: &[u32],
    places: &Places,
    plane: &Plane,
) -> Result<Vec<Vec<u32>>> {
    let positions = places.corners(corners);
    let frame = Frame::new(plane, [positions.as_slice()].into_iter());
    let mut graph = PlanarGraph::default();
    let ring: Vec<_> =
        corners.iter().zip(&positions).map(|(&corner, &p)| graph.corner(&frame, corner, p)).collect();
    graph.ring(&ring, Border { sheet: 0, forward: true });
    let cut = graph.arrange(places.tolerance() / frame.size);
    let (graph, triangulation) = cut.map_err(|trouble| trouble.at(scene, given.line))?;
    let inside = |t: usize| triangulation.winding(t, 0) > 0;
    let triangles: Option<Vec<Vec<u32>>> = (0..triangulation.triangles.len())
        .filter(|&t| inside(t))
        .map(|t| triangulation.triangles[t].corners.iter().map(|&p| graph.points[p as usize].place).collect())
        .collect();
    // A point without a place would be one that the split made: the polygon touches itself.
    triangles.ok_or_else(|| Trouble::Crowded.at(scene, given.line))
}
