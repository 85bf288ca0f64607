//! `--method auto`: every pair by the cheapest rule that keeps the tolerance, exact visible parts where something blocks.

use crate::estimator::{Estimator, TileBuilder};
use crate::scene::Scene;
use crate::tile::Tile;
use crate::traversal::LeafPair;
use geometry::contour::Exchange;
use geometry::occluder::Occluder;
use geometry::pair::{self, Accuracy};
use geometry::visible::Scratch;

/// Share of a row's error given to unoccluded pairs: their factors add up to at most 1.
const UNOCCLUDED_SHARE: f64 = 0.5;
/// Unoccluded pairs are never asked less: they cost little, and in bright closed rooms what their rows miss of 1 counts
/// 1 / (1 - rho) times.
const UNOCCLUDED_LOOSEST: f64 = 2e-3;
/// Share given to occluded pairs, relative to their factors without blockers, which add up to about 2 at most in rooms.
const OCCLUDED_SHARE: f64 = 0.25;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// The exact method on a scene.
#[derive(Debug)]
pub struct Exact<'a> {
    scene: &'a Scene,
    accuracy: Accuracy,
}

impl<'a> Exact<'a> {
    /// For rows within `tolerance`.
    pub fn new(scene: &'a Scene, tolerance: f64) -> Self {
        let accuracy = Accuracy {
            unoccluded: (UNOCCLUDED_SHARE * tolerance).min(UNOCCLUDED_LOOSEST),
            occluded: OCCLUDED_SHARE * tolerance,
            // Over a row these shares add up to one more factor of 1.
            least_factor: 1.0 / scene.len() as f64,
            most_evaluations: MOST_EVALUATIONS,
        };
        Self { scene, accuracy }
    }
}

impl Estimator for Exact<'_> {
    fn tile(&self, pair: &LeafPair) -> Tile {
        let mut builder = TileBuilder::new(pair);
        let (mut blockers, mut scratch) = (Vec::new(), Scratch::default());
        for i in pair.rows.clone() {
            let first = if pair.is_diagonal() { i } else { pair.columns.start };
            for j in first..pair.columns.end {
                let found = self.entry(i, j, pair, &mut builder, &mut blockers, &mut scratch);
                builder.push(i - pair.rows.start, j - pair.columns.start, found.value, found.error);
            }
        }
        builder.finish()
    }

    fn work(&self, pair: &LeafPair) -> f64 {
        pair.pairs() as f64 * (1.0 + pair.blockers.len() as f64)
    }
}

impl<'a> Exact<'a> {
    fn entry(
        &self,
        i: usize,
        j: usize,
        pair: &LeafPair,
        builder: &mut TileBuilder,
        blockers: &mut Vec<&'a Occluder>,
        scratch: &mut Scratch,
    ) -> Exchange {
        let scene = self.scene;
        if scene.faces[i] == scene.faces[j] {
            builder.counts().same_plane += 1;
            return Exchange::NONE;
        }
        let between = pair
            .blockers
            .iter()
            .map(|&k| k as usize)
            .filter(|&k| scene.sides[i].may_block(&scene.sides[j], k))
            .map(|k| &scene.occluders[k]);
        let (found, class) =
            pair::exchange(&scene.patches[i], &scene.patches[j], between, self.accuracy, blockers, scratch);
        builder.counts().add_class(class);
        found
    }
}
