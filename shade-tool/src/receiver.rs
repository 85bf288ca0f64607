//! Irradiance at a point of space or of a surface: H = sum over j of F_j B_j, with the exact form factor F_j of the
//! visible part of element j.

use crate::joined::Sources;
use crate::lit_scene::LitScene;
use geometry::gather::{Gatherer, Scratch};
use geometry::merge::merged_occluders;
use geometry::source_tree::{Opening, SourceTree};
use glam::DVec3;
use interchange::ids::ElementId;
use interchange::report::Report;
use std::sync::atomic::{AtomicU64, Ordering};

/// Points on the border of a face or element take the limit from inside: they are moved by this part of the way towards
/// its centroid.
///
/// Near a contact the irradiance differs from its limit by at most about (x / d) ln(d / x) of its value at distance x,
/// d being the size of what it touches: 1.4e-5 here, below what is asked of any picture. Clipping in f64 keeps 1e-16 of
/// the scene, so a move of 1e-6 within an element of 1e-4 of the scene is still known to six digits.
pub const INWARD: f64 = 1e-6;

/// The point [`INWARD`] of the way from `point` to `centroid`.
pub fn limit_from_inside(point: DVec3, centroid: DVec3) -> DVec3 {
    point + INWARD * (centroid - point)
}

/// Where irradiance is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// The point.
    pub point: DVec3,
    /// Unit normal of the plane that receives.
    pub normal: DVec3,
    /// Face that the point lies on, if any.
    pub face: Option<u32>,
}

/// Irradiance, W m^-2, by where it comes from: RGB from the light that lamps emit, then RGB from what surfaces reflect.
pub type Parts = [f64; 6];

/// Both parts together.
pub fn total(parts: &Parts) -> [f64; 3] {
    std::array::from_fn(|c| parts[c] + parts[c + 3])
}

/// What a source's elements may deviate from it, in units of what its share may be off by: the form factors of all of
/// them together are 1, and deviations have both signs.
const JOINED: f64 = 25.0;

/// Everything that can light a point.
#[derive(Debug)]
pub struct Light {
    tree: SourceTree<6>,
    opening: Opening,
    /// Elements by exact factors, clusters by moments, clusters by fitted polygons, clusters hidden, in this order.
    tally: [AtomicU64; 4],
    /// Elements less sources.
    joined: usize,
}

impl Light {
    /// The elements of the scene as sources, its faces as blockers.
    pub fn new(scene: &LitScene, opening: Opening) -> Light {
        let mut strengths = vec![[0.0; 6]; scene.sources.len()];
        for (drawn, &source) in scene.source_of.iter().enumerate() {
            let exitance = scene.material(ElementId::new(drawn)).exitance();
            let radiosity = scene.radiosity[source as usize];
            // Where a lamp was changed since the solution, the light that reaches others is the solved one.
            let emitted: [f64; 3] = std::array::from_fn(|c| exitance[c].min(radiosity[c]));
            strengths[source as usize] =
                std::array::from_fn(|c| if c < 3 { emitted[c] } else { radiosity[c - 3] - emitted[c - 3] });
        }
        let sources = if opening.blur > 0.0 {
            Sources::joined(scene, &strengths, JOINED * opening.blur)
        } else {
            Sources::elements(scene, &strengths)
        };
        Light::with_sources(scene, sources, opening)
    }

    /// Sources whose six numbers may be something else than [`Parts`].
    pub fn with_sources(scene: &LitScene, sources: Sources, opening: Opening) -> Light {
        let mesh = &scene.mesh;
        let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
        let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
        let Sources { polygons, strengths, slopes } = sources;
        let count = polygons.len();
        let gatherer = Gatherer::new(merged_occluders(pieces, &positions), polygons);
        let tree = SourceTree::with_slopes(gatherer, &strengths, &slopes);
        Light { tree, opening, tally: Default::default(), joined: scene.sources.len().saturating_sub(count) }
    }

    /// Irradiance by its parts.
    pub fn irradiance(&self, receiver: &Receiver, scratch: &mut Scratch) -> Parts {
        let (parts, counts) = self.tree.gather(receiver.point, receiver.normal, self.opening, scratch);
        for (sum, count) in self.tally.iter().zip([counts.exact, counts.far, counts.fitted, counts.hidden]) {
            sum.fetch_add(count, Ordering::Relaxed);
        }
        parts
    }

    /// Tells how sources were counted so far.
    pub fn count(&self, report: &mut Report) {
        report.count("elements_joined_skipped", self.joined);
        for (name, sum) in ["sources_exact", "sources_far", "sources_fitted", "sources_hidden_skipped"]
            .iter()
            .zip(&self.tally)
        {
            report.count(name, sum.load(Ordering::Relaxed) as usize);
        }
    }
}
