//! What the descent finds, computed: clusters and rows that see each other wholly, pairs behind shadows.

use crate::counts::Counts;
use crate::descent::Findings;
use crate::estimator::TileBuilder;
use crate::exact::Exact;
use crate::scene::Cluster;
use crate::skips::Skip;
use crate::traversal::LeafPair;
use geometry::area_rule::Separation;
use geometry::contour::Exchange;
use geometry::occluded::Wanted;
use geometry::pair::{InFront, Scratch};
use geometry::unoccluded::{Facing, Rule, exchange_in_front, facing, mutual_parts};
use std::ops::Range;

/// A single one of them may err by this many times more: the row counts.
const MOST_RELATIVE: f64 = 10.0;
/// A partly occluded pair that may take more than this part of a row's error has to keep its own.
const DOMINANT_SHARE: f64 = 0.02;
/// So has one whose patches are this near (sizes over distance): what they see of each other is not smooth at a common edge.
const NEAR: f64 = 0.7;
/// All others may take this many times their share: most need less than a third of it.
const OF_MANY: f64 = 1.2;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// Computes what the descent finds.
#[derive(Debug)]
pub(crate) struct Filling<'e> {
    exact: &'e Exact<'e>,
    pair: &'e LeafPair,
    /// The tile on its way.
    pub builder: TileBuilder,
    pending: Vec<u32>,
    too_near: Vec<u32>,
    values: Vec<f64>,
}

impl<'e> Filling<'e> {
    /// An empty tile.
    pub fn new(exact: &'e Exact<'e>, pair: &'e LeafPair, builder: TileBuilder) -> Self {
        Self { exact, pair, builder, pending: Vec::new(), too_near: Vec::new(), values: Vec::new() }
    }

    fn set(&mut self, i: usize, j: usize, found: Exchange) {
        let (row, column) = (i - self.pair.rows.start, j - self.pair.columns.start);
        // Far pairs whose points lie on each other's planes sum up to rounding of either sign.
        self.builder.set(row, column, found.value.max(0.0), found.error);
    }

    /// Clusters wholly in front of each other: together where they are far enough apart, else the parts of the larger one,
    /// down to single rows.
    fn in_front(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts) {
        let (rows, columns) = (first.range.clone(), second.range.clone());
        let scene = self.exact.scene;
        if let Some(rule) = &self.exact.clusters {
            let mut values = std::mem::take(&mut self.values);
            let found = rule.block(scene, (first, second), &mut values);
            if let Some(error) = found {
                self.set_block((rows.clone(), columns.clone()), &values, error, counts);
            }
            self.values = values;
            if found.is_some() {
                return;
            }
            let split = |cluster: &Cluster| cluster.children.map(|pair| pair.map(|c| &scene.clusters[c]));
            let larger = if first.radius >= second.radius { first } else { second };
            if let Some(parts) = split(larger).filter(|_| rule.is_worth_splitting(first, second)) {
                for part in parts {
                    let (p, q) = if first.radius >= second.radius { (part, second) } else { (first, part) };
                    self.in_front(p, q, counts);
                }
                return;
            }
        }
        rows.for_each(|i| self.row_in_front(i, columns.clone(), counts));
    }

    /// All pairs of two clusters, with one error per area of both patches; those to which it is too much are computed alone.
    fn set_block(
        &mut self,
        (rows, columns): (Range<usize>, Range<usize>),
        values: &[f64],
        error: f64,
        counts: &mut Counts,
    ) {
        let patches = &self.exact.scene.patches;
        for (i, values) in rows.zip(values.chunks_exact(columns.len())) {
            for (j, &value) in columns.clone().zip(values) {
                let error = error * patches[i].area * patches[j].area;
                if error <= MOST_RELATIVE * self.exact.unoccluded * value {
                    counts.by_clusters += 1;
                    self.set(i, j, Exchange { value, error });
                } else {
                    self.row_in_front(i, j..j + 1, counts);
                }
            }
        }
    }

    /// A row of pairs that see each other wholly: far ones together, those that are too near for a rule by the next one.
    fn row_in_front(&mut self, i: usize, columns: Range<usize>, counts: &mut Counts) {
        let relative = self.exact.unoccluded;
        let mut pending = std::mem::take(&mut self.pending);
        let mut too_near = std::mem::take(&mut self.too_near);
        pending.clear();
        pending.extend(columns.map(|j| j as u32));
        let far = &self.exact.far;
        for (patches, served) in [(&far.low, Rule::Low), (&far.middle, Rule::Middle)] {
            too_near.clear();
            patches.factors(i, &pending, relative, |at, value, error| {
                if error <= relative * value {
                    counts.add_unoccluded(served);
                    self.set(i, pending[at] as usize, Exchange { value, error });
                } else {
                    too_near.push(pending[at]);
                }
            });
            std::mem::swap(&mut pending, &mut too_near);
        }
        for &j in &pending {
            let (p, q) = (&self.exact.scene.patches[i], &self.exact.scene.patches[j as usize]);
            let found = self.exact.poses.as_ref().and_then(|poses| poses.exchange(p, q));
            let (found, rule) = found.unwrap_or_else(|| exchange_in_front(p, q, relative));
            counts.add_unoccluded(rule);
            self.set(i, j as usize, found);
        }
        (self.pending, self.too_near) = (pending, too_near);
    }
}

impl Findings for Filling<'_> {
    fn clear(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts) {
        if first.faces(second) && second.faces(first) && self.exact.skips.has(Skip::FarRules) {
            return self.in_front(first, second, counts);
        }
        let patches = &self.exact.scene.patches;
        for i in first.range.clone() {
            for j in second.range.clone() {
                match facing(&patches[i], &patches[j]) {
                    Facing::Away => counts.behind += 1,
                    Facing::Full if self.exact.skips.has(Skip::FarRules) => {
                        self.row_in_front(i, j..j + 1, counts)
                    }
                    Facing::Full => {
                        let exchange = self.exact.contour(&patches[i], &patches[j]);
                        counts.add_unoccluded(Rule::Contour);
                        self.set(i, j, exchange);
                    }
                    Facing::Cut => match mutual_parts(&patches[i], &patches[j]) {
                        None => counts.behind += 1,
                        Some((p, q)) => {
                            let (found, rule) = exchange_in_front(&p, &q, self.exact.unoccluded);
                            counts.add_unoccluded(rule);
                            self.set(i, j, found);
                        }
                    },
                }
            }
        }
    }

    fn partial(
        &mut self,
        (i, j): (usize, usize),
        pair: &InFront<'_>,
        which: Range<usize>,
        counts: &mut Counts,
        scratch: &mut Scratch<'_>,
    ) {
        let unblocked = pair.unblocked_size();
        let allowed = &self.exact.occluded;
        let tolerance = allowed[i].min(allowed[j]) * unblocked;
        let (p, q) = pair.patches();
        let share = unblocked / p.area.min(q.area) * allowed[i].max(allowed[j]);
        let near = Separation::new(p, q).theta > NEAR;
        let alone = near || share > DOMINANT_SHARE * self.exact.tolerance;
        let tolerance = if alone { tolerance } else { OF_MANY * tolerance };
        let wanted = Wanted { tolerance, unblocked, alone, most_evaluations: MOST_EVALUATIONS };
        let (found, effort) = pair.occluded(which, wanted, scratch);
        counts.add_occluded(effort);
        self.set(i, j, found);
    }
}
