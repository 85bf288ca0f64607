//! `--method contour` and `--method area`: the two forms of the double integral (Goral, Torrance, Greenberg & Battaile 84),
//! the same form for every pair, however far apart; and, which they did without, occlusion: the factor without blockers
//! times the share of it that stratified rays find visible.
//!
//! # Error
//! The form's own (rounding of the contour grows with the distance; the area form's points lose digits where elements
//! come close), and for pairs with blockers the statistical error of the visible share, estimated from the rays.

use crate::area_form::area_form;
use crate::estimator::{Estimator, TileBuilder};
use crate::scene::Scene;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use crate::visible_share::{RAYS, visible_share};
use geometry::area_rule::Separation;
use geometry::contour::{Exchange, contour};
use geometry::occluder::separated;
use geometry::patch::Patch;
use geometry::ray_cast::RayCaster;
use geometry::sides::SideBits;
use geometry::unoccluded::{Facing, facing, mutual_parts};
use glam::DVec3;
use interchange::report::Report;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The form of the integral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Around both outlines.
    Contour,
    /// Over both surfaces.
    Area,
}

/// Share of a row's error given to the form itself: factors add up to about 1.
const FORM_SHARE: f64 = 0.5;
/// Never asked more loosely than this: what a row misses of 1 counts 1 / (1 - rho) times when solving.
const LOOSEST: f64 = 2e-3;
/// Tighter than this is rounding.
const TIGHTEST: f64 = 1e-12;

/// One of the classical forms on a scene.
#[derive(Debug)]
pub struct Classical<'a> {
    scene: &'a Scene,
    form: Form,
    relative: f64,
    /// Side facts of each element against each occluder.
    sides: Vec<SideBits>,
    caster: RayCaster,
    rays: AtomicUsize,
}

impl<'a> Classical<'a> {
    /// For pairs without blockers within a share of `tolerance`.
    pub fn new(scene: &'a Scene, form: Form, tolerance: f64) -> Self {
        let blockers: Vec<Vec<DVec3>> = scene.occluders.iter().map(|o| o.corners.clone()).collect();
        Self {
            scene,
            form,
            sides: scene
                .patches
                .par_iter()
                .map(|p| SideBits::of_patch(&p.corners, &p.plane, p.radius, &scene.occluders))
                .collect(),
            relative: (FORM_SHARE * tolerance).clamp(TIGHTEST, LOOSEST),
            caster: RayCaster::new(&blockers),
            rays: AtomicUsize::new(0),
        }
    }

    fn entry(&self, i: usize, j: usize, pair: &LeafPair, builder: &mut TileBuilder) -> Exchange {
        let scene = self.scene;
        if scene.faces[i] == scene.faces[j] {
            builder.counts().same_plane += 1;
            return Exchange::NONE;
        }
        let (p, q) = (&scene.patches[i], &scene.patches[j]);
        let parts = match facing(p, q) {
            Facing::Away => None,
            Facing::Full => return self.in_front(i, j, (p, q), pair, builder),
            Facing::Cut => mutual_parts(p, q),
        };
        match parts {
            Some((p, q)) => self.in_front(i, j, (&p, &q), pair, builder),
            None => {
                builder.counts().behind += 1;
                Exchange::NONE
            }
        }
    }

    fn in_front(
        &self,
        i: usize,
        j: usize,
        (p, q): (&Patch, &Patch),
        pair: &LeafPair,
        builder: &mut TileBuilder,
    ) -> Exchange {
        let (occluders, sides) = (&self.scene.occluders, [&self.sides[i], &self.sides[j]]);
        let shaft: Vec<DVec3> = p.corners.iter().chain(&q.corners).copied().collect();
        let (mut open, mut covered) = (true, false);
        // The traversal proved that nothing stands between any two elements of the pair of clusters, or did not.
        if !pair.blockers.is_empty() {
            sides[0].for_each_candidate(sides[1], occluders.len(), |k| {
                if !covered && !separated(&shaft, &occluders[k].corners) {
                    open = false;
                    covered = occluders[k].covers(&p.corners, &q.corners);
                }
            });
        }
        if covered {
            builder.counts().covered += 1;
            return Exchange::NONE;
        }

        let whole = match self.form {
            Form::Contour => {
                // The centres say little about near pairs: half the smaller element is the most that can pass.
                let separation = Separation::new(p, q);
                let size = separation.value.max(1e-3 * separation.kernel.min(p.area.min(q.area)));
                contour(&p.corners, &q.corners, self.relative * size)
            }
            Form::Area => area_form(p, q, self.relative),
        };
        if open {
            let rule = if self.form == Form::Contour { 4 } else { 3 };
            builder.counts().unoccluded[rule] += 1;
            return whole;
        }
        builder.counts().occluded += 1;
        self.rays.fetch_add(RAYS, Ordering::Relaxed);
        let passes = |k: usize| !sides[0].may_block(sides[1], k);
        let share = visible_share(p, q, (i, j), |from, to| self.caster.any_between(from, to, passes));
        let error = share.value * whole.error + share.error * whole.value;
        Exchange { value: share.value * whole.value, error }
    }
}

impl Estimator for Classical<'_> {
    fn tile(&self, pair: &LeafPair) -> Tile {
        let mut builder = TileBuilder::new(pair);
        for i in pair.rows.clone() {
            let first = if pair.is_diagonal() { i } else { pair.columns.start };
            for j in first..pair.columns.end {
                let found = self.entry(i, j, pair, &mut builder);
                builder.push(i - pair.rows.start, j - pair.columns.start, found.value, found.error);
            }
        }
        builder.finish()
    }

    fn work(&self, pair: &LeafPair) -> f64 {
        pair.pairs() as f64 * (1.0 + pair.blockers.len() as f64)
    }

    fn note(&self, report: &mut Report) {
        report.count("rays between occluded pairs", self.rays.load(Ordering::Relaxed));
    }
}
