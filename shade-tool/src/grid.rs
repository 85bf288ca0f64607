//! Calculation grids of lighting design: points spread evenly over the faces of a group, and what they say together.
//!
//! As EN 12464-1 lays them out: each face's bounding rectangle, along its longer side, is divided into as few equal cells as are
//! not longer than the spacing; points stand in the middles of the cells that lie on the face.

use crate::convex::depth;
use crate::error::{Error, Result};
use crate::lit_scene::LitScene;
use crate::picture::luminance;
use crate::points::ProbePoint;
use geometry::polygon;
use glam::DVec3;
use interchange::error::nearest_name;
use interchange::ids::FaceId;
use interchange::tables::number;

/// Points of one grid at most: a spacing in a wrong unit is told instead of tried.
const MOST_POINTS: f64 = 1e7;

/// The grid over a group, or over an input face given by its number from 0, `height` above the faces.
pub fn points(scene: &LitScene, what: &str, spacing: f64, height: f64) -> Result<Vec<ProbePoint>> {
    let faces = faces(scene, what)?;
    let area: f64 = faces.iter().map(|&face| polygon::area(&scene.mesh.face_corners(face))).sum();
    if area / (spacing * spacing) > MOST_POINTS {
        let found = format!("a spacing of {spacing} makes {:.0} points", area / (spacing * spacing));
        return Err(Error::grid(found, format!("give a --spacing above {}", (area / MOST_POINTS).sqrt())));
    }
    let mut points = Vec::new();
    for face in faces {
        points.extend(on_face(scene, face, spacing, height));
    }
    if points.is_empty() {
        return Err(Error::grid(format!("no point of {what} lies on a face"), "give a smaller --spacing"));
    }
    Ok(points)
}

fn faces(scene: &LitScene, what: &str) -> Result<Vec<FaceId>> {
    let mesh = &scene.mesh;
    let all = || (0..mesh.face_count()).map(FaceId::new);
    if let Some(group) = mesh.groups.iter().position(|name| name == what) {
        return Ok(all().filter(|face| mesh.face_groups[face.index()].index() == group).collect());
    }
    if let Ok(input) = what.parse::<u32>() {
        let faces: Vec<FaceId> = all().filter(|face| mesh.face_inputs[face.index()] == input).collect();
        return if faces.is_empty() {
            let last = mesh.input_face_count.saturating_sub(1);
            Err(Error::grid(format!("there is no face {input}"), format!("faces are 0 to {last}")))
        } else {
            Ok(faces)
        };
    }
    let remedy = match nearest_name(what, mesh.groups.iter().map(String::as_str)) {
        Some(near) => format!("did you mean {near}?"),
        None => "mesh-tool info lists the groups".into(),
    };
    Err(Error::grid(format!("no group and no face is called {what}"), remedy))
}

fn on_face(scene: &LitScene, face: FaceId, spacing: f64, height: f64) -> Vec<ProbePoint> {
    let corners = scene.mesh.face_corners(face);
    let normal = polygon::vector_area(&corners).normalize_or_zero();
    // The rectangle along the longest edge: a rectangular face is its own.
    let longest = polygon::edges(&corners)
        .map(|(a, b)| b - a)
        .fold(DVec3::ZERO, |best, edge| if edge.length() > best.length() { edge } else { best });
    let u = longest.normalize_or_zero();
    let v = normal.cross(u);
    let origin = corners.first().copied().unwrap_or_default();
    let range = |axis: DVec3| {
        corners
            .iter()
            .map(|&c| axis.dot(c - origin))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let pieces: Vec<Vec<DVec3>> = (0..scene.mesh.occluders.len())
        .filter(|&piece| scene.piece_face(piece) == face)
        .map(|piece| scene.mesh.occluder_corners(piece))
        .collect();
    let middles = |axis: DVec3| -> Vec<f64> {
        let (low, high) = range(axis);
        let cells = ((high - low) / spacing).ceil().max(1.0) as usize;
        let middle = |k: usize| low + (high - low) * (k as f64 + 0.5) / cells as f64;
        (0..cells).map(middle).collect()
    };
    let mut points = Vec::new();
    for y in middles(v) {
        for x in middles(u) {
            let on_face = origin + x * u + y * v;
            if pieces.iter().any(|corners| depth(corners, normal, on_face) >= 0.0) {
                let point = on_face + height * normal;
                let fields = point.to_array().into_iter().chain(normal.to_array()).map(number).collect();
                points.push(ProbePoint { point, normal, fields });
            }
        }
    }
    points
}

/// What the points of a grid say together, of the luminance-weighted irradiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Number of points.
    pub points: usize,
    /// Mean, W m^-2.
    pub mean: f64,
    /// Least, W m^-2.
    pub minimum: f64,
    /// Largest, W m^-2.
    pub maximum: f64,
    /// Least over mean, U_0; 1 in the dark.
    pub uniformity: f64,
    /// Largest estimated error, W m^-2.
    pub error: f64,
}

impl Summary {
    /// Of irradiance and its estimated error at each point.
    pub fn of(irradiance: &[[f64; 3]], errors: &[f64]) -> Summary {
        let values: Vec<f64> = irradiance.iter().map(|&h| luminance(h)).collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let minimum = values.iter().copied().reduce(f64::min).unwrap_or(0.0);
        Summary {
            points: values.len(),
            mean,
            minimum,
            maximum: values.iter().copied().fold(0.0, f64::max),
            uniformity: if mean > 0.0 { minimum / mean } else { 1.0 },
            error: errors.iter().copied().fold(0.0, f64::max),
        }
    }

    /// For people and programs: a name and a number per line; illuminance by the luminous efficacy, lm W^-1.
    pub fn text(&self, efficacy: f64) -> String {
        format!(
            "points {}\nmean {} W/m2, {} lx\nminimum {} W/m2, {} lx\nmaximum {} W/m2, {} lx\nuniformity {}\n\
             largest estimated error {} W/m2\n",
            self.points,
            number(self.mean),
            number(efficacy * self.mean),
            number(self.minimum),
            number(efficacy * self.minimum),
            number(self.maximum),
            number(efficacy * self.maximum),
            number(self.uniformity),
            number(self.error)
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};

    #[test]
    fn points_stand_in_the_middles_of_equal_cells() {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::ZERO, 2.0 * DVec3::X, DVec3::Y, 1, 0);
        let scene = lit(mesh);
        let points = points(&scene, "0", 0.6, 0.25).unwrap();
        // 2 / 0.6 makes four cells of 0.5, 1 / 0.6 two.
        assert_eq!(points.len(), 8);
        assert_eq!((points[0].point, points[0].normal), (DVec3::new(0.25, 0.25, 0.25), DVec3::Z));
        assert_eq!(points[7].point, DVec3::new(1.75, 0.75, 0.25));
        assert_eq!(points[0].fields[2], "0.25");
    }

    #[test]
    fn groups_and_numbers_choose_faces_and_slips_are_told() {
        let scene = cube(1);
        assert_eq!(points(&scene, "all", 0.5, 0.0).unwrap().len(), 24);
        assert_eq!(points(&scene, "3", 0.5, 0.0).unwrap().len(), 4);
        for (what, spacing, word) in
            [("6", 0.5, "0 to 5"), ("al", 0.5, "did you mean all?"), ("all", 1e-5, "--spacing above")]
        {
            let message = points(&scene, what, spacing, 0.0).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn uniformity_is_least_over_mean() {
        let summary = Summary::of(&[[1.0; 3], [2.0; 3], [3.0; 3]], &[0.1, 0.3, 0.2]);
        assert!((summary.mean - 2.0).abs() < 1e-15 && (summary.uniformity - 0.5).abs() < 1e-15);
        assert_eq!((summary.points, summary.error), (3, 0.3));
        assert!(summary.text(179.0).contains("uniformity 0.5"));
        assert_eq!(Summary::of(&[[0.0; 3]], &[0.0]).uniformity, 1.0);
    }
}
