//! Everything that can light a point: the lamps, and the surfaces that pass their light on.
//!
//! The two are gathered apart. Lamps are few and what they give is sharp: their shadows are found to the last digit, at many
//! points. All else is many sources, none of them strong, and what they give is smooth: it is gathered to a looser
//! bound, at few points.

use crate::joined::Sources;
use crate::lit_scene::LitScene;
use crate::receiver::{Parts, Receiver};
use geometry::gather::{Gatherer, Scratch};
use geometry::merge::merged_occluders;
use geometry::source_tree::{Opening, SourceTree};
use glam::DVec3;
use interchange::ids::ElementId;
use interchange::report::Report;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a source's elements may deviate from it, in units of what its share may be off by: the form factors of all of
/// them together are 1, and deviations have both signs.
const JOINED: f64 = 25.0;
/// What a lamp's share may be off by, in units of what any other source's may: errors of a few strong sources do not cancel.
const OF_LAMPS: f64 = 0.1;

/// Irradiance by one kind of source, RGB, W m^-2.
pub type Irradiance = [f64; 3];

/// One of the two parts of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// What lamps emit.
    Direct,
    /// What surfaces reflect.
    Indirect,
}

impl Part {
    /// This part of both.
    pub fn of(self, parts: &Parts) -> Irradiance {
        match self {
            Part::Direct => [parts[0], parts[1], parts[2]],
            Part::Indirect => [parts[3], parts[4], parts[5]],
        }
    }
}

/// Lamps and surfaces as sources.
#[derive(Debug)]
pub struct Light {
    lamps: Gathering<3>,
    surfaces: Gathering<3>,
}

impl Light {
    /// The scene's lamps and reflecting surfaces, its faces as blockers.
    pub fn new(scene: &LitScene, opening: Opening) -> Light {
        let mut emitted = vec![[0.0; 3]; scene.sources.len()];
        let mut reflected = emitted.clone();
        for (drawn, &source) in scene.source_of.iter().enumerate() {
            let exitance = scene.material(ElementId::new(drawn)).exitance();
            let (source, radiosity) = (source as usize, scene.radiosity[source as usize]);
            // Where a lamp was changed since the solution, the light that reaches others is the solved one. Where it is dark a
            // solution to some bound may be below zero; that is no lamp.
            emitted[source] = std::array::from_fn(|c| exitance[c].min(radiosity[c]).max(0.0));
            reflected[source] = std::array::from_fn(|c| radiosity[c] - emitted[source][c]);
        }
        let of_lamps = Opening { blur: OF_LAMPS * opening.blur, ..opening };
        let gathering = |strengths: &[[f64; 3]], opening: Opening| {
            let sources = if opening.blur > 0.0 {
                Sources::joined(scene, strengths, JOINED * opening.blur)
            } else {
                Sources::elements(scene, strengths)
            };
            Gathering::new(scene, sources.lit(), opening)
        };
        Light { lamps: gathering(&emitted, of_lamps), surfaces: gathering(&reflected, opening) }
    }

    /// One part of the irradiance.
    pub fn part(&self, part: Part, receiver: &Receiver, scratch: &mut Scratch) -> Irradiance {
        match part {
            Part::Direct => self.lamps.irradiance(receiver, scratch),
            Part::Indirect => self.surfaces.irradiance(receiver, scratch),
        }
    }

    /// One part of the irradiance at many points, in their order.
    pub fn part_at(&self, part: Part, receivers: &[Receiver], done: impl Fn() + Sync) -> Vec<Irradiance> {
        match part {
            Part::Direct => self.lamps.at(receivers, done),
            Part::Indirect => self.surfaces.at(receivers, done),
        }
    }

    /// Irradiance by its parts.
    pub fn irradiance(&self, receiver: &Receiver, scratch: &mut Scratch) -> Parts {
        let [a, b, c] = self.lamps.irradiance(receiver, scratch);
        let [d, e, f] = self.surfaces.irradiance(receiver, scratch);
        [a, b, c, d, e, f]
    }

    /// Tells how sources were counted so far.
    pub fn count(&self, report: &mut Report) {
        self.lamps.count("lamps_", report);
        self.surfaces.count("sources_", report);
    }
}

/// Sources with N strengths each, and how they are gathered.
#[derive(Debug)]
pub struct Gathering<const N: usize> {
    tree: SourceTree<N>,
    opening: Opening,
    points: AtomicU64,
    /// Elements by exact factors, clusters by moments, clusters by fitted polygons, clusters hidden, faint clusters, in this order.
    tally: [AtomicU64; 5],
    /// Sources.
    sources: usize,
}

impl<const N: usize> Gathering<N> {
    /// Sources among the scene's faces as blockers.
    pub fn new(scene: &LitScene, sources: Sources<N>, opening: Opening) -> Gathering<N> {
        let mesh = &scene.mesh;
        let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
        let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
        let Sources { polygons, strengths, slopes } = sources;
        let sources = polygons.len();
        let gatherer = Gatherer::new(merged_occluders(pieces, &positions), polygons);
        let tree = SourceTree::with_slopes(gatherer, &strengths, &slopes);
        Gathering { tree, opening, points: AtomicU64::new(0), tally: Default::default(), sources }
    }

    /// Sums of strength times form factor at many points, in their order.
    pub fn at(&self, receivers: &[Receiver], done: impl Fn() + Sync) -> Vec<[f64; N]> {
        let gathered = |scratch: &mut Scratch, receiver: &Receiver| {
            done();
            self.irradiance(receiver, scratch)
        };
        receivers.par_iter().map_init(Scratch::default, gathered).collect()
    }

    /// Sum of strength times form factor.
    pub fn irradiance(&self, receiver: &Receiver, scratch: &mut Scratch) -> [f64; N] {
        let (sum, counts) = self.tree.gather(receiver.point, receiver.normal, self.opening, scratch);
        self.points.fetch_add(1, Ordering::Relaxed);
        for (tally, count) in
            self.tally.iter().zip([counts.exact, counts.far, counts.fitted, counts.hidden, counts.faint])
        {
            tally.fetch_add(count, Ordering::Relaxed);
        }
        sum
    }

    /// Tells how sources were counted so far, under names that begin with `prefix`.
    pub fn count(&self, prefix: &str, report: &mut Report) {
        report.count(&format!("{prefix}joined"), self.sources);
        report.count(&format!("{prefix}points"), self.points.load(Ordering::Relaxed) as usize);
        for (name, sum) in ["exact", "far", "fitted", "hidden_skipped", "faint"].iter().zip(&self.tally) {
            report.count(&format!("{prefix}{name}"), sum.load(Ordering::Relaxed) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes::cube;

    /// A bounded solution may be below zero in the dark. Lamps are what emits, and both parts add up to the radiosity.
    #[test]
    fn elements_slightly_below_zero_are_no_lamps() {
        let mut scene = cube(2);
        scene.materials[0].diffuse = [0.5; 3];
        scene.materials[0].radiance = [0.0; 3];
        scene.radiosity = (0..24).map(|k| [if k % 2 == 0 { -1e-6 } else { 1.0 }; 3]).collect();
        let light = Light::new(&scene, Opening::EXACT);
        assert_eq!((light.lamps.sources, light.surfaces.sources), (0, 24));
        let receiver = Receiver { point: DVec3::new(0.3, 1e-3, 0.4), normal: DVec3::Y, face: None };
        let scratch = &mut Scratch::default();
        let [direct, .., indirect] = light.irradiance(&receiver, scratch);
        let want = light.part(Part::Indirect, &receiver, scratch)[2];
        assert!(
            direct == 0.0 && indirect == want && (0.1..0.9).contains(&want),
            "{direct} {indirect} {want}"
        );
    }
}
