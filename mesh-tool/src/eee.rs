//! Curves of three edges (EEE events: Gigus & Malik 1990; Drettakis & Fiume 1994): sightlines that touch an edge of the
//! emitter and two edges of different occluders leave a conic on a face, across which curvature jumps. As polylines.
//!
//! Three edges parallel to one plane leave a straight line instead (a hyperbolic paraboloid): the same code draws it, in
//! one piece.

use crate::clean::Cleaned;
use crate::discontinuity::Emitter;
use crate::features::Features;
use crate::wedge::Surroundings;
use glam::DVec3;
use rayon::prelude::*;

/// Places along the first occluder edge where a curve is looked for; shorter curves are missed.
const SAMPLES: usize = 48;
/// Halvings that find the ends of a curve: 2^-40 of the step between samples.
const HALVINGS: usize = 40;
/// The polyline leaves the curve by no more than this part of its length.
const SAG: f64 = 2e-3;
/// Halvings of a chord at most.
const DEPTH: u32 = 6;

/// A curve on one side of a face.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Face it lies on.
    pub face: u32,
    /// Whether on its front.
    pub front: bool,
    /// Its points.
    pub points: Vec<DVec3>,
}

/// Where a sightline ends.
#[derive(Debug, Clone, Copy)]
struct Landing {
    face: u32,
    front: bool,
    point: DVec3,
}

/// Three edges and what they belong to.
struct Triple<'a> {
    lamp: [DVec3; 2],
    first: [DVec3; 2],
    second: [DVec3; 2],
    edges: [u32; 2],
    emitter: &'a Emitter,
    features: &'a Features,
    scene: &'a Surroundings,
}

/// All curves of an emitter.
pub fn curves(
    emitter: &Emitter,
    scene: &Cleaned,
    features: &Features,
    surroundings: &Surroundings,
) -> Vec<Curve> {
    let ends = |edge: usize| features.edges[edge].ends.map(|place| scene.places.position(place));
    let corners: Vec<DVec3> = emitter.corners.iter().map(|(corner, _)| *corner).collect();
    // Edges before the emitter that are a silhouette from somewhere on it.
    let edges: Vec<usize> = (0..features.edges.len())
        .filter(|&edge| {
            let faces = &features.edges[edge].faces;
            let before = ends(edge).iter().any(|&p| emitter.plane.distance(p) > surroundings.tolerance);
            let seen = |&eye: &DVec3| {
                features.is_silhouette(edge as u32, eye, &surroundings.planes, surroundings.tolerance)
            };
            before && !faces.contains(&emitter.face) && corners.iter().any(seen)
        })
        .collect();
    let pairs: Vec<(usize, usize)> = edges
        .iter()
        .enumerate()
        .flat_map(|(k, &first)| edges[k + 1..].iter().map(move |&second| (first, second)))
        .filter(|&(first, second)| {
            let (a, b) = (&features.edges[first], &features.edges[second]);
            !a.faces.iter().any(|face| b.faces.contains(face)) && !a.ends.iter().any(|p| b.ends.contains(p))
        })
        .collect();
    pairs
        .into_par_iter()
        .flat_map_iter(|(first, second)| {
            let triples = emitter.edges.iter().map(move |&lamp| (lamp, first, second));
            triples.flat_map(|(lamp, first, second)| {
                let triple = Triple {
                    lamp,
                    first: ends(first),
                    second: ends(second),
                    edges: [first as u32, second as u32],
                    emitter,
                    features,
                    scene: surroundings,
                };
                triple.curves()
            })
        })
        .collect()
}

impl Triple<'_> {
    fn curves(&self) -> Vec<Curve> {
        // Cheap first: nothing of the geometry may fit anywhere.
        let place = |k: usize| k as f64 / SAMPLES as f64;
        let lines: Vec<bool> = (0..=SAMPLES).map(|k| self.sightline(place(k)).is_some()).collect();
        if !lines.iter().any(|&fits| fits) {
            return Vec::new();
        }
        let landings: Vec<Option<Landing>> =
            (0..=SAMPLES).map(|k| if lines[k] { self.landing(place(k)) } else { None }).collect();
        let same = |a: &Option<Landing>, b: &Option<Landing>| match (a, b) {
            (Some(a), Some(b)) => a.face == b.face && a.front == b.front,
            _ => false,
        };
        let mut curves = Vec::new();
        let mut k = 0;
        while k <= SAMPLES {
            let Some(start) = landings[k] else {
                k += 1;
                continue;
            };
            let mut last = k;
            while last < SAMPLES && same(&landings[last + 1], &landings[k]) {
                last += 1;
            }
            let low = if k == 0 { 0.0 } else { self.end(place(k), place(k - 1), &start) };
            let high = if last == SAMPLES { 1.0 } else { self.end(place(last), place(last + 1), &start) };
            if let Some(from) = self.landing(low) {
                let mut points = vec![from.point];
                // The samples between, so that an inflection is not taken for a straight line.
                let mut before = (low, from.point);
                let stops = (k..=last).map(place).filter(|&u| u > low && u < high).chain([high]);
                let coarse: Vec<f64> = stops.collect();
                let every = (coarse.len() / 4).max(1);
                for (n, &u) in coarse.iter().enumerate() {
                    if n + 1 != coarse.len() && n % every != 0 {
                        continue;
                    }
                    if let Some(landing) = self.landing(u) {
                        self.chord(before, (u, landing.point), DEPTH, &mut points);
                        before = (u, landing.point);
                    }
                }
                curves.push(Curve { face: start.face, front: start.front, points });
            }
            k = last + 1;
        }
        curves
    }

    /// The last place between `inside` and `outside` whose sightline lands as `start` does.
    fn end(&self, mut inside: f64, mut outside: f64, start: &Landing) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            match self.landing(middle) {
                Some(landing) if landing.face == start.face && landing.front == start.front => {
                    inside = middle
                }
                _ => outside = middle,
            }
        }
        inside
    }

    /// Appends points up to and with `to`, halving where the curve leaves the chord.
    fn chord(&self, from: (f64, DVec3), to: (f64, DVec3), depth: u32, points: &mut Vec<DVec3>) {
        let middle = 0.5 * (from.0 + to.0);
        let chord = from.1.distance(to.1);
        if depth > 0
            && chord > 0.0
            && let Some(landing) = self.landing(middle)
        {
            let direction = (to.1 - from.1) / chord;
            let offset = landing.point - from.1;
            if (offset - offset.dot(direction) * direction).length() > SAG * chord {
                self.chord(from, (middle, landing.point), depth - 1, points);
                self.chord((middle, landing.point), to, depth - 1, points);
                return;
            }
        }
        points.push(to.1);
    }

    /// The points on the emitter's edge, the first and the second edge of the sightline through place `u` of the first.
    fn sightline(&self, u: f64) -> Option<[DVec3; 3]> {
        let q = self.first[0].lerp(self.first[1], u);
        let normal = (self.lamp[0] - q).cross(self.lamp[1] - q);
        let (a, b) = (normal.dot(self.second[0] - q), normal.dot(self.second[1] - q));
        if (a > 0.0) == (b > 0.0) {
            return None;
        }
        let r = self.second[0].lerp(self.second[1], a / (a - b));
        // Where the line through q and r meets the emitter's edge: all in one plane.
        let (direction, edge) = (r - q, self.lamp[1] - self.lamp[0]);
        let cross = edge.cross(direction);
        let along = (q - self.lamp[0]).cross(direction).dot(cross) / cross.length_squared();
        if !(0.0..=1.0).contains(&along) {
            return None;
        }
        let p = self.lamp[0] + along * edge;
        let ordered = (q - p).dot(r - p) > 0.0;
        (ordered && self.emitter.plane.distance(q) > 0.0).then_some([p, q, r])
    }

    fn landing(&self, u: f64) -> Option<Landing> {
        let [p, q, r] = self.sightline(u)?;
        let (features, scene) = (self.features, self.scene);
        let silhouettes =
            self.edges.iter().all(|&edge| features.is_silhouette(edge, p, &scene.planes, scene.tolerance));
        if !silhouettes {
            return None;
        }
        let far = if p.distance_squared(q) > p.distance_squared(r) { q } else { r };
        let own = |face: u32| {
            self.edges.iter().any(|&edge| features.edges[edge as usize].faces.contains(&face))
                || face == self.emitter.face
        };
        if !scene.sees(p, far, own) {
            return None;
        }
        let (face, point) = scene.first_hit(far, far - p, own)?;
        Some(Landing { face, front: scene.planes[face as usize].distance(p) > 0.0, point })
    }
}
