//! The solution as few sources: elements joined into convex cells over which radiosity changes linearly.
//!
//! A mesh is fine where light falls, but what it sends on is seen from afar and mostly smooth. Each convex piece of a face
//! is halved until the elements in a cell lie on a plane over it to a share of the tolerance (least squares, weighted by
//! area, so that the cell sends the same power). The line through the elements' means is also closer to the light than
//! steps at their borders: a wall gathered from its neighbour shows no facets of it.

use crate::lit_scene::LitScene;
use geometry::plane::Plane;
use geometry::polygon;
use geometry::source_tree::Slope;
use glam::DVec3;
use interchange::ids::{ElementId, FaceId};

/// A part of an element with less than this part of its cell's area is a rounding of its border.
const SLIVER: f64 = 1e-12;
/// A cell that its elements leave open by less than this part of its area is filled.
const FILLED: f64 = 1e-9;
/// Part of the tolerance that is kept where it is dark.
const DARKEST: f64 = 0.1;
/// Single elements may be off by so many times what the cell may be off in the mean.
const OUTLIER: f64 = 3.0;
/// Values that few elements take are fitted by any line: they have to lie within so many times the tolerance.
const FEW: usize = 6;
const FEW_RANGE: f64 = 10.0;
/// Halvings of a piece in a row.
const DEEPEST: u32 = 40;
/// A plane is not fitted to places that lie on a line to this part.
const ON_LINE: f64 = 1e-6;

/// Convex sources.
#[derive(Debug, Default)]
pub struct Sources<const N: usize> {
    /// Corners, counter-clockwise seen from the front.
    pub polygons: Vec<Vec<DVec3>>,
    /// Strength at the centroid.
    pub strengths: Vec<[f64; N]>,
    /// Change of strength, where there is any.
    pub slopes: Vec<Option<Slope<N>>>,
}

/// What a cell's elements may deviate from it.
#[derive(Debug, Clone, Copy)]
struct Tolerance {
    /// Where it is as bright as in the mean, and brighter.
    full: f64,
    mean: f64,
}

impl Tolerance {
    fn new<const N: usize>(scene: &LitScene, strengths: &[[f64; N]], full: f64) -> Tolerance {
        let (mut power, mut area) = (0.0, 0.0);
        for (corners, strength) in scene.sources.iter().zip(strengths) {
            let own = polygon::area(corners);
            power += own * mean_of(strength);
            area += own;
        }
        Tolerance { full, mean: if area > 0.0 { power / area } else { 0.0 } }
    }

    /// Less in the dark: what is dark there has its light from its neighbours.
    fn of(&self, brightness: f64) -> f64 {
        self.full * if self.mean > 0.0 { (brightness / self.mean).clamp(DARKEST, 1.0) } else { 1.0 }
    }
}

fn mean_of<const N: usize>(strength: &[f64; N]) -> f64 {
    strength.iter().sum::<f64>() / N as f64
}

/// A part of an element within a cell.
#[derive(Debug, Clone)]
struct Part {
    element: usize,
    corners: Vec<DVec3>,
    area: f64,
    centroid: DVec3,
}

impl Part {
    fn new(element: usize, corners: Vec<DVec3>) -> Part {
        Part { element, area: polygon::area(&corners), centroid: polygon::centroid(&corners), corners }
    }
}

impl<const N: usize> Sources<N> {
    fn push(&mut self, polygon: Vec<DVec3>, strength: [f64; N], slope: Option<Slope<N>>) {
        self.polygons.push(polygon);
        self.strengths.push(strength);
        self.slopes.push(slope);
    }

    fn truncate(&mut self, count: usize) {
        self.polygons.truncate(count);
        self.strengths.truncate(count);
        self.slopes.truncate(count);
    }

    /// Without what sends nothing.
    pub fn lit(self) -> Sources<N> {
        let Sources { polygons, strengths, slopes } = self;
        let mut lit = Sources::default();
        for ((polygon, strength), slope) in polygons.into_iter().zip(strengths).zip(slopes) {
            if strength != [0.0; N] || slope.is_some() {
                lit.push(polygon, strength, slope);
            }
        }
        lit
    }

    /// Every element as it is.
    pub fn elements(scene: &LitScene, strengths: &[[f64; N]]) -> Sources<N> {
        let slopes = vec![None; strengths.len()];
        Sources { polygons: scene.sources.clone(), strengths: strengths.to_vec(), slopes }
    }

    /// Elements joined where their strengths are linear within `tolerance`, W m^-2, in the mean.
    pub fn joined(scene: &LitScene, strengths: &[[f64; N]], tolerance: f64) -> Sources<N> {
        let mesh = &scene.mesh;
        let tolerance = Tolerance::new(scene, strengths, tolerance);
        let mut of_side: Vec<(u32, u32, usize)> = Vec::new();
        for (drawn, &source) in scene.source_of.iter().enumerate() {
            let face = mesh.element_face(ElementId::new(drawn)).0;
            of_side.push((face, mesh.element_sides[drawn], source as usize));
        }
        of_side.sort_unstable();
        of_side.dedup();
        let mut pieces: Vec<Vec<usize>> = vec![Vec::new(); mesh.face_count()];
        (0..mesh.occluders.len()).for_each(|piece| pieces[scene.piece_face(piece).index()].push(piece));

        let mut all = Sources::default();
        for side in of_side.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let members: Vec<usize> = side.iter().map(|&(.., source)| source).collect();
            let mut found = Sources::default();
            for &piece in &pieces[FaceId(side[0].0).index()] {
                let mut corners = mesh.occluder_corners(piece);
                if side[0].1 == 1 {
                    corners.reverse();
                }
                join_piece(scene, &members, corners, strengths, tolerance, &mut found);
            }
            let area = |polygons: &mut dyn Iterator<Item = &Vec<DVec3>>| {
                polygons.map(|p| polygon::area(p)).sum::<f64>()
            };
            let meshed = area(&mut members.iter().map(|&k| &scene.sources[k]));
            // Elements that were moved off their face by more than rounding are not described by its pieces.
            let same_area = (area(&mut found.polygons.iter()) - meshed).abs() <= 1e-6 * meshed;
            if same_area {
                all.polygons.append(&mut found.polygons);
                all.strengths.append(&mut found.strengths);
                all.slopes.append(&mut found.slopes);
            } else {
                members.iter().for_each(|&k| all.push(scene.sources[k].clone(), strengths[k], None));
            }
        }
        all
    }
}

fn join_piece<const N: usize>(
    scene: &LitScene,
    members: &[usize],
    corners: Vec<DVec3>,
    strengths: &[[f64; N]],
    tolerance: Tolerance,
    out: &mut Sources<N>,
) {
    let Some(plane) = Plane::of_polygon(&corners) else { return };
    let mut parts = Vec::new();
    for &element in members {
        let mut part = scene.sources[element].clone();
        for (a, b) in polygon::edges(&corners) {
            let inward = plane.normal.cross(b - a).normalize_or_zero();
            let mut kept = Vec::new();
            polygon::clip_by(&part, |p| inward.dot(p - a), &mut kept);
            part = kept;
        }
        parts.push(Part::new(element, part));
    }
    join(corners, parts, &plane, strengths, tolerance, DEEPEST, out);
}

/// Makes a cell one source if its parts allow it, else halves it across its longest extent.
fn join<const N: usize>(
    cell: Vec<DVec3>,
    mut parts: Vec<Part>,
    plane: &Plane,
    strengths: &[[f64; N]],
    tolerance: Tolerance,
    depth: u32,
    out: &mut Sources<N>,
) {
    let area: f64 = parts.iter().map(|part| part.area).sum();
    parts.retain(|part| part.corners.len() >= 3 && part.area > SLIVER * area);
    let Some(first) = parts.first() else { return };
    // A cell may reach under something that lies on the face, where there are no elements: that is cut off.
    let is_filled = area >= polygon::area(&cell) * (1.0 - FILLED);
    if is_filled && parts.iter().all(|part| strengths[part.element] == strengths[first.element]) {
        out.push(cell, strengths[first.element], None);
        return;
    }
    let brightness =
        parts.iter().map(|part| part.area * mean_of(&strengths[part.element])).sum::<f64>() / area;
    let own = tolerance.of(brightness);
    if is_filled && let Some((mean, slope)) = fit(&parts, plane, strengths, own) {
        out.push(cell, mean, Some(slope));
        return;
    }
    if depth == 0 || parts.len() <= 2 {
        parts.into_iter().for_each(|part| out.push(part.corners, strengths[part.element], None));
        return;
    }
    let (u, v) = plane.axes();
    let extent = |axis: DVec3| {
        let heights = cell.iter().map(|&c| axis.dot(c - cell[0]));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let longest = polygon::edges(&cell).map(|(a, b)| b - a).fold(DVec3::ZERO, |best, edge| {
        if edge.length_squared() > best.length_squared() { edge } else { best }
    });
    // Along the longest edge or across it: rectangles are cut into rectangles.
    let along = longest.try_normalize().unwrap_or(u);
    let across = plane.normal.cross(along).try_normalize().unwrap_or(v);
    let ((low, high), (low_across, high_across)) = (extent(along), extent(across));
    let (axis, at) = if high - low >= high_across - low_across {
        (along, 0.5 * (low + high))
    } else {
        (across, 0.5 * (low_across + high_across))
    };
    let origin = cell[0];
    let half = |corners: &[DVec3], sign: f64| {
        let mut kept = Vec::new();
        polygon::clip_by(corners, |p| sign * (axis.dot(p - origin) - at), &mut kept);
        kept
    };
    let before = out.polygons.len();
    for sign in [1.0, -1.0] {
        let parts = parts.iter().map(|part| Part::new(part.element, half(&part.corners, sign))).collect();
        join(half(&cell, sign), parts, plane, strengths, tolerance, depth - 1, out);
    }
    // Where halves are no fewer the elements serve, as in penumbrae, whose elements follow the light.
    if out.polygons.len() - before >= parts.len() {
        out.truncate(before);
        parts.into_iter().for_each(|part| out.push(part.corners, strengths[part.element], None));
    }
}

/// Strength at the centroid and slope of the plane through the parts' strengths, if they lie on it.
fn fit<const N: usize>(
    parts: &[Part],
    plane: &Plane,
    strengths: &[[f64; N]],
    tolerance: f64,
) -> Option<([f64; N], Slope<N>)> {
    let area: f64 = parts.iter().map(|part| part.area).sum();
    let centroid = parts.iter().map(|part| part.area * part.centroid).sum::<DVec3>() / area;
    let mean: [f64; N] = std::array::from_fn(|n| {
        parts.iter().map(|part| part.area * strengths[part.element][n]).sum::<f64>() / area
    });
    let (u, v) = plane.axes();
    let place = |part: &Part| (u.dot(part.centroid - centroid), v.dot(part.centroid - centroid));
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for part in parts {
        let (x, y) = place(part);
        uu += part.area * x * x;
        uv += part.area * x * y;
        vv += part.area * y * y;
    }
    let determinant = uu * vv - uv * uv;
    let is_plane = determinant > ON_LINE * (uu + vv) * (uu + vv);
    let slope: Slope<N> = std::array::from_fn(|n| {
        let (mut us, mut vs) = (0.0, 0.0);
        for part in parts {
            let (x, y) = place(part);
            let aside = part.area * (strengths[part.element][n] - mean[n]);
            us += aside * x;
            vs += aside * y;
        }
        if is_plane {
            ((vv * us - uv * vs) * u + (uu * vs - uv * us) * v) / determinant
        } else if uu + vv > 0.0 {
            // On a line: along it only.
            (us * u + vs * v) / (uu + vv)
        } else {
            DVec3::ZERO
        }
    });
    let mut squares = 0.0;
    for part in parts {
        let aside = part.centroid - centroid;
        let (mut miss, mut range): (f64, f64) = (0.0, 0.0);
        for n in 0..N {
            let from_mean = strengths[part.element][n] - mean[n];
            miss = miss.max((from_mean - slope[n].dot(aside)).abs());
            range = range.max(from_mean.abs());
        }
        if miss > OUTLIER * tolerance || (parts.len() < FEW && range > FEW_RANGE * tolerance) {
            return None;
        }
        squares += part.area * miss * miss;
    }
    (squares <= area * tolerance * tolerance).then_some((mean, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes::cube;

    fn ramp(scene: &LitScene, of: impl Fn(DVec3) -> f64) -> Vec<[f64; 6]> {
        scene.sources.iter().map(|corners| [of(polygon::centroid(corners)); 6]).collect()
    }

    fn power(sources: &Sources<6>) -> f64 {
        sources.polygons.iter().zip(&sources.strengths).map(|(p, s)| polygon::area(p) * s[0]).sum()
    }

    #[test]
    fn a_linear_field_takes_one_source_per_face_and_keeps_slope_and_power() {
        let scene = cube(8);
        let strengths = ramp(&scene, |p| 1.0 + p.x + 2.0 * p.y - p.z);
        let joined = Sources::joined(&scene, &strengths, 1e-9);
        assert_eq!(joined.polygons.len(), 6);
        for (polygon, slope) in joined.polygons.iter().zip(&joined.slopes) {
            let normal = polygon::vector_area(polygon).normalize();
            let full = DVec3::new(1.0, 2.0, -1.0);
            let want = full - full.dot(normal) * normal;
            assert!(slope.is_some_and(|s| s[5].distance(want) < 1e-9), "{slope:?} {want}");
        }
        let elements = Sources::elements(&scene, &strengths);
        assert!((power(&joined) / power(&elements) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_step_keeps_its_elements_and_a_curved_field_takes_few() {
        let scene = cube(16);
        let step = ramp(&scene, |p| f64::from(u8::from(p.x > 0.5)));
        let joined = Sources::joined(&scene, &step, 0.01);
        // The step lies between elements: two even cells on each of four walls, or four where the first cut runs across it.
        assert!(joined.polygons.len() <= 2 + 4 * 4, "{}", joined.polygons.len());
        assert!(joined.slopes.iter().all(Option::is_none));
        let curved = ramp(&scene, |p| (3.0 * p.x).sin() * p.y);
        let [coarse, fine] = [0.02, 0.002].map(|t| Sources::joined(&scene, &curved, t).polygons.len());
        assert!(coarse < fine && fine < 6 * 256 / 2, "{coarse} {fine}");
        let elements = Sources::elements(&scene, &curved);
        assert!((power(&Sources::joined(&scene, &curved, 0.02)) / power(&elements) - 1.0).abs() < 1e-12);
    }
}
