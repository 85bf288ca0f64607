//! Closed bodies, and what lies inside them.
//!
//! A body is a set of faces connected by edges of two faces, whose edges all cancel: a closed surface that looks outward.
//! A body may be open towards one plane that all of it stands on (a block without a bottom): it hides the places of
//! that plane it stands on. Inside is where the winding number is not zero: the solid angle of all faces, over 4 pi
//! (van Oosterom & Strackee 1983). A closed body with a lamp inside hides nothing.

use crate::clean::Cleaned;
use crate::orient::ring_edges;
use crate::places::Places;
use crate::sheets::{bounds, root};
use geometry::plane::Plane;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

/// Places are looked at from this many weld tolerances above their plane: clear of the rounding of a face in contact.
const ABOVE: f64 = 64.0;

/// A closed body.
#[derive(Debug)]
pub struct Solid {
    /// Its faces.
    pub faces: Vec<u32>,
    /// The scene's faces that these are.
    inputs: Vec<u32>,
    triangles: Vec<[DVec3; 3]>,
    low: DVec3,
    high: DVec3,
    /// The plane it stands on, normal towards the body, where it is open there.
    open: Option<Plane>,
}

/// The closed bodies of a scene.
#[derive(Debug, Default)]
pub struct Solids {
    solids: Vec<Solid>,
    /// Distance from a plane at which its places are looked at.
    above: f64,
}

impl Solids {
    /// Finds the bodies that can hide something.
    pub fn new(scene: &Cleaned) -> Solids {
        let rings: Vec<Vec<u32>> = met_rings(scene);
        let mut uses: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
        for (face, ring) in rings.iter().enumerate() {
            for edge in ring_edges(ring) {
                uses.entry(edge).or_default().push(face);
            }
        }
        let mut parent: Vec<usize> = (0..rings.len()).collect();
        for (&(a, b), faces) in uses.iter().filter(|((a, b), _)| a < b) {
            if let ([face], Some([other])) = (&faces[..], uses.get(&(b, a)).map(Vec::as_slice)) {
                let (p, q) = (root(&mut parent, *face), root(&mut parent, *other));
                parent[p.max(q)] = p.min(q);
            }
        }
        let mut bodies: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for face in 0..rings.len() {
            bodies.entry(root(&mut parent, face)).or_default().push(face as u32);
        }
        let bodies = bodies.into_values().filter(|faces| faces.len() >= 3);
        let mut solids: Vec<Solid> = bodies.filter_map(|faces| Solid::new(faces, &rings, scene)).collect();
        // A lamp inside lights what would be hidden. One that only may be inside counts: being wrong costs elements.
        let margin = DVec3::splat(scene.places.tolerance());
        let lamps: Vec<(u32, DVec3, DVec3)> = scene
            .faces
            .iter()
            .enumerate()
            .filter(|(_, face)| face.emits)
            .map(|(k, face)| {
                let (low, high) = bounds(&scene.places.corners(&face.corners));
                (k as u32, low + margin, high - margin)
            })
            .collect();
        solids.retain(|solid| {
            let holds = |&(face, low, high): &(u32, DVec3, DVec3)| {
                !solid.faces.contains(&face) && low.cmplt(solid.high).all() && solid.low.cmplt(high).all()
            };
            !lamps.iter().any(holds)
        });
        Solids { solids, above: ABOVE * scene.places.tolerance() }
    }

    /// The same bodies, by the numbers of the faces of `scene` that their faces became part of.
    pub fn renumbered(mut self, scene: &Cleaned) -> Solids {
        let mut face_of_input: HashMap<u32, Vec<u32>> = HashMap::new();
        for (face, given) in scene.faces.iter().enumerate() {
            let inputs = std::iter::once(given.input).chain(given.members.iter().map(|m| m.input));
            for input in inputs {
                face_of_input.entry(input).or_default().push(face as u32);
            }
        }
        for solid in &mut self.solids {
            let of = |input: &u32| face_of_input.get(input).cloned().unwrap_or_default();
            solid.faces = solid.inputs.iter().flat_map(of).collect();
            solid.faces.sort_unstable();
            solid.faces.dedup();
        }
        self
    }

    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.solids.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.solids.is_empty()
    }

    /// Whether any body comes near the box around some points.
    pub fn reach(&self, points: impl Iterator<Item = DVec3>) -> bool {
        let points: Vec<DVec3> = points.collect();
        let (low, high) = bounds(&points);
        let margin = DVec3::splat(2.0 * self.above);
        let near = |s: &Solid| s.low.cmple(high + margin).all() && low.cmple(s.high + margin).all();
        self.solids.iter().any(near)
    }

    /// The bodies that a place just in front of `point` on a plane with unit `normal` is inside of.
    pub fn hiding(&self, point: DVec3, normal: DVec3) -> impl Iterator<Item = &Solid> + '_ {
        let eye = point + self.above * normal;
        let touches = move |solid: &&Solid| solid.low.cmple(eye).all() && eye.cmple(solid.high).all();
        self.solids.iter().filter(touches).filter(move |solid| solid.hides(eye, point, normal, self.above))
    }
}

impl Solid {
    fn new(faces: Vec<u32>, rings: &[Vec<u32>], scene: &Cleaned) -> Option<Solid> {
        let mut balance: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for (a, b) in faces.iter().flat_map(|&face| ring_edges(&rings[face as usize])) {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
        let rim: Vec<u32> =
            balance.into_iter().filter(|(_, sum)| *sum != 0).flat_map(|((a, b), _)| [a, b]).collect();
        let corners: Vec<DVec3> = faces
            .iter()
            .flat_map(|&face| scene.places.corners(&scene.faces[face as usize].corners))
            .collect();
        let (low, high) = bounds(&corners);
        let tolerance = scene.places.tolerance();
        let open = if rim.is_empty() {
            None
        } else {
            // Two-sided walls would light what they stand around.
            if faces.iter().any(|&face| scene.faces[face as usize].two_sided) {
                return None;
            }
            Some(standing_plane(&scene.places.corners(&rim), &corners, tolerance)?)
        };
        let mut triangles = Vec::new();
        for &face in &faces {
            let corners = scene.places.corners(&scene.faces[face as usize].corners);
            triangles.extend((2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]]));
        }
        let origin = open.map_or(low, |plane| plane.origin);
        let volume: f64 =
            triangles.iter().map(|[a, b, c]| (*a - origin).dot((*b - origin).cross(*c - origin)) / 6.0).sum();
        let thick = volume > 2.0 * ABOVE * tolerance * (high - low).length_squared() * 1e-3;
        let inputs = faces.iter().map(|&face| scene.faces[face as usize].input).collect();
        thick.then_some(Solid { faces, inputs, triangles, low, high, open })
    }

    fn hides(&self, eye: DVec3, point: DVec3, normal: DVec3, above: f64) -> bool {
        let angle: f64 = self.triangles.iter().map(|triangle| solid_angle(eye, triangle)).sum();
        match self.open {
            None => angle > 2.0 * PI,
            // The missing bottom would add the other half of the directions.
            Some(plane) => {
                plane.distance(point).abs() <= above && plane.normal.dot(normal) > 0.5 && angle > PI
            }
        }
    }
}

/// The plane through all of `rim` with all `corners` on one side; its normal points there.
fn standing_plane(rim: &[DVec3], corners: &[DVec3], tolerance: f64) -> Option<Plane> {
    let &first = rim.first()?;
    let far = |from: DVec3| rim.iter().copied().max_by(|a, b| a.distance(from).total_cmp(&b.distance(from)));
    let second = far(first)?;
    let cross = |p: DVec3| (second - first).cross(p - first);
    let third = rim.iter().copied().max_by(|a, b| cross(*a).length().total_cmp(&cross(*b).length()))?;
    let normal = cross(third).try_normalize()?;
    let mut plane = Plane { normal, origin: first };
    if corners.iter().map(|&p| plane.distance(p)).sum::<f64>() < 0.0 {
        plane = plane.flipped();
    }
    let flat = rim.iter().all(|&p| plane.distance(p).abs() <= 4.0 * tolerance);
    (flat && corners.iter().all(|&p| plane.distance(p) >= -4.0 * tolerance)).then_some(plane)
}

/// Solid angle of a triangle, positive where it is seen from behind.
fn solid_angle(eye: DVec3, triangle: &[DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - eye);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(denominator)
}

/// The rings of all faces with every place that lies on one of their edges put in: faces that meet along part of an
/// edge share that part.
pub fn met_rings(scene: &Cleaned) -> Vec<Vec<u32>> {
    let Cleaned { places, faces } = scene;
    let mut used: Vec<u32> = faces.iter().flat_map(|face| face.corners.iter().copied()).collect();
    used.sort_unstable();
    used.dedup();
    used.sort_by(|&a, &b| places.position(a).x.total_cmp(&places.position(b).x).then(a.cmp(&b)));
    faces.iter().map(|face| met_ring(&face.corners, &used, places)).collect()
}

/// One ring; `by_x` are the places in use, by their first coordinate.
fn met_ring(ring: &[u32], by_x: &[u32], places: &Places) -> Vec<u32> {
    let tolerance = places.tolerance();
    let mut met = Vec::with_capacity(ring.len());
    for (a, b) in ring_edges(ring) {
        let (from, to) = (places.position(a), places.position(b));
        let (low, high) = (from.min(to) - tolerance, from.max(to) + tolerance);
        let first = by_x.partition_point(|&p| places.position(p).x < low.x);
        let length2 = from.distance_squared(to);
        let mut within: Vec<(f64, u32)> = by_x[first..]
            .iter()
            .take_while(|&&p| places.position(p).x <= high.x)
            .filter(|&&p| p != a && p != b)
            .filter_map(|&p| {
                let position = places.position(p);
                if !(low.cmple(position).all() && position.cmple(high).all()) {
                    return None;
                }
                let along = (position - from).dot(to - from) / length2;
                let near = position.distance(from.lerp(to, along)) <= tolerance;
                (near && along > 0.0 && along < 1.0).then_some((along, p))
            })
            .collect();
        within.sort_by(|x, y| x.0.total_cmp(&y.0));
        met.push(a);
        met.extend(within.into_iter().map(|(_, p)| p));
    }
    met
}
