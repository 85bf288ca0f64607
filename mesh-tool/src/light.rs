//! The light that decides where elements are small: direct irradiance, exact, and a rough estimate of the indirect.
//!
//! All emitters have unit radiance and all faces one reflectance: colours never enter the mesh. Direct light comes
//! from exact point form factors to the emitters. Indirect light comes along a fixed set of rays, which see the mean
//! light of the elements they meet. It is needed where direct light says nothing: in a narrow gap all is dark, yet an
//! element that reaches from its entry to its depth would carry light inside.

use crate::clean::Cleaned;
use crate::contact::Pieces;
use geometry::gather::{Gatherer, Scratch};
use geometry::merge::merged_occluders;
use geometry::plane::Plane;
use geometry::polygon;
use geometry::ray_cast::RayCaster;
use glam::DVec3;
use rayon::prelude::*;

/// Reflectance assumed for all faces: that of a furnished room.
const REFLECTANCE: f64 = 0.5;
/// Points of an element where light is computed: close to corners and middles of edges, where it differs most, but
/// inside, where one face only is touched; and the centroid.
pub const POINTS: usize = 7;
const CORNER: f64 = 0.9;
/// Rays from every point for indirect light, equally distributed by projected solid angle.
const RAYS: u32 = 24;
/// Angle between successive rays around the normal, radians: the golden angle spreads any number of them evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
/// Rays start this part of the scene above their face, beyond the rounding of its plane.
const LIFT: f64 = 1e-9;
/// Both sides of a two-sided face are met at the same distance, but for rounding.
const SAME_DISTANCE: f64 = 1e-9;

/// What shines on the faces of a scene.
#[derive(Debug)]
pub struct Light {
    gatherer: Gatherer,
    lift: f64,
}

/// A triangle to be lit; front counter-clockwise.
#[derive(Debug, Clone, Copy)]
pub struct Lit {
    /// Corners.
    pub corners: [DVec3; 3],
    /// Unit normal of the front.
    pub normal: DVec3,
}

/// Light at the points of a triangle: form factors to what shines, between 0 and about 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct Irradiance {
    /// From the emitters.
    pub direct: [f64; POINTS],
    /// From elsewhere.
    pub indirect: [f64; POINTS],
}

impl Irradiance {
    /// Direct and indirect light together, per point.
    pub fn total(&self) -> [f64; POINTS] {
        std::array::from_fn(|k| self.direct[k] + self.indirect[k])
    }

    /// Mean over the points.
    pub fn mean(&self) -> f64 {
        self.total().iter().sum::<f64>() / POINTS as f64
    }

    /// Mean distance from the mean: the error of a constant.
    pub fn deviation(&self) -> f64 {
        let mean = self.mean();
        self.total().iter().map(|light| (light - mean).abs()).sum::<f64>() / POINTS as f64
    }
}

impl Light {
    /// The light of all emitting faces; `None` where there are none.
    pub fn new(scene: &Cleaned, pieces: &Pieces) -> Option<Light> {
        let corners = |piece: &Vec<u32>| scene.places.corners(piece);
        let mut sources = Vec::new();
        for (face, pieces) in scene.faces.iter().zip(pieces).filter(|(face, _)| face.emits) {
            sources.extend(pieces.iter().map(corners));
            if face.two_sided {
                sources.extend(pieces.iter().map(|piece| corners(piece).into_iter().rev().collect()));
            }
        }
        let positions = scene.places.positions();
        let blockers = || merged_occluders(pieces.iter().flatten().cloned().collect(), positions);
        (!sources.is_empty()).then(|| Light {
            gatherer: Gatherer::new(blockers(), sources),
            lift: LIFT * polygon::diameter(positions),
        })
    }

    /// Direct light at a point on a plane with unit `normal`.
    pub fn at(&self, point: DVec3, normal: DVec3, scratch: &mut Scratch) -> f64 {
        let mut sum = 0.0;
        self.gatherer.factors(point, normal, scratch, &mut |_, factor| sum += factor);
        sum
    }

    /// Direct light on a triangle.
    pub fn direct(&self, lit: &Lit, scratch: &mut Scratch) -> [f64; POINTS] {
        points(&lit.corners).map(|point| self.at(point, lit.normal, scratch))
    }

    /// Indirect light on those of the triangles that `wanted` accepts, where all send back what `radiosity` says.
    pub fn indirect(
        &self,
        triangles: &[Lit],
        radiosity: &[f64],
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Option<[f64; POINTS]>> {
        let pieces: Vec<Vec<DVec3>> = triangles.iter().map(|lit| lit.corners.to_vec()).collect();
        let caster = RayCaster::new(&pieces);
        let seen = |origin: DVec3, direction: DVec3| -> f64 {
            let Some(hit) = caster.closest(origin, direction) else { return 0.0 };
            if hit.front {
                return radiosity[hit.piece];
            }
            // The back of a two-sided face is a front, too.
            let front = caster.closest_where(origin, direction, |_, front| front);
            let other = front.filter(|front| front.distance <= hit.distance * (1.0 + SAME_DISTANCE));
            other.map_or(0.0, |front| radiosity[front.piece])
        };
        let light = |lit: &Lit| {
            let (x, y) = Plane { normal: lit.normal, origin: lit.corners[0] }.axes();
            points(&lit.corners).map(|point| {
                let origin = point + self.lift * lit.normal;
                let ray = |k: u32| {
                    let sine2 = (f64::from(k) + 0.5) / f64::from(RAYS);
                    let (sine, cosine) = (sine2.sqrt(), (1.0 - sine2).sqrt());
                    // Half a step on, no ray runs along an axis, where it would graze the edges of aligned boxes.
                    let around = GOLDEN_ANGLE * (f64::from(k) + 0.5);
                    seen(origin, sine * (around.cos() * x + around.sin() * y) + cosine * lit.normal)
                };
                REFLECTANCE * (0..RAYS).map(ray).sum::<f64>() / f64::from(RAYS)
            })
        };
        triangles.par_iter().enumerate().map(|(k, lit)| wanted(k).then(|| light(lit))).collect()
    }
}

/// Where the light on a triangle is computed.
fn points(&[a, b, c]: &[DVec3; 3]) -> [DVec3; POINTS] {
    let centre = (a + b + c) / 3.0;
    let inward = |point: DVec3| centre.lerp(point, CORNER);
    [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), centre].map(inward)
}
