//! What the descent finds, computed: clusters and rows that see each other wholly, pairs behind shadows.

use crate::counts::Counts;
use crate::descent::Findings;
use crate::estimator::TileBuilder;
use crate::exact::Exact;
use crate::scene::Cluster;
use crate::skips::Skip;
use crate::traversal::LeafPair;
use geometry::area_rule::Separation;
use geometry::body::Body;
use geometry::contour::Exchange;
use geometry::occluded::Wanted;
use geometry::pair::{InFront, Scratch};
use geometry::point_view::PointView;
use geometry::unoccluded::{Facing, Rule, exchange_in_front, facing, mutual_parts};
use std::ops::Range;

/// A single one of them may err by this many times more: the row counts.
const MOST_RELATIVE: f64 = 10.0;
/// A partly occluded pair that may take more than this part of a row's error has to keep its own.
const DOMINANT_SHARE: f64 = 0.02;
/// So has one whose patches are this near (sizes over distance): what they see of each other is not smooth at a common edge.
pub(crate) const NEAR: f64 = 0.7;
/// Nearer than this, and asked for less than [`LOOSE`] of their value without blockers, the first rule is not believed alone:
/// triangles of 15 cm at a gap of 2 cm were off by five times what it stated.
const DOUBTFUL: f64 = 1.0;
const LOOSE: f64 = 1e-3;
/// Such pairs are never asked less than this part of their value without blockers: their few points say little.
const NEAR_LOOSEST: f64 = 0.02;
/// All others may take this many times their share: most need less than a third of it.
pub(crate) const OF_MANY: f64 = 1.2;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// Computes what the descent finds.
#[derive(Debug)]
pub(crate) struct Filling<'e> {
    pub(crate) exact: &'e Exact<'e>,
    pair: &'e LeafPair,
    /// The tile on its way.
    pub builder: TileBuilder,
    pub(crate) lists: Lists,
    values: Vec<f64>,
    pub(crate) view: PointView,
}

impl<'e> Filling<'e> {
    /// An empty tile.
    pub fn new(exact: &'e Exact<'e>, pair: &'e LeafPair, builder: TileBuilder) -> Self {
        Self { exact, pair, builder, lists: Lists::default(), values: Vec::new(), view: PointView::default() }
    }

    pub(crate) fn set(&mut self, i: usize, j: usize, found: Exchange) {
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
            let computed = columns.clone().zip(values).filter(|(j, _)| !self.exact.reuse.has(i, *j));
            for (j, &value) in computed {
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

    /// A row of pairs that see each other wholly.
    fn row_in_front(&mut self, i: usize, columns: Range<usize>, counts: &mut Counts) {
        let mut lists = std::mem::take(&mut self.lists);
        lists.pending.clear();
        lists.pending.extend(columns.filter(|&j| !self.exact.reuse.has(i, j)).map(|j| j as u32));
        self.exact.row_in_front(i, &mut lists, counts, |j, found| self.set(i, j, found));
        self.lists = lists;
    }
}

/// Working memory of [`Exact::row_in_front`].
#[derive(Debug, Default)]
pub(crate) struct Lists {
    /// Columns to compute.
    pub pending: Vec<u32>,
    too_near: Vec<u32>,
}

impl Exact<'_> {
    /// The exchange factors of patch `i` with those that are `pending`, each wholly in front of it with nothing between: far
    /// ones together, those that are too near for a rule by the next one.
    pub(crate) fn row_in_front(
        &self,
        i: usize,
        lists: &mut Lists,
        counts: &mut Counts,
        mut visit: impl FnMut(usize, Exchange),
    ) {
        let relative = self.unoccluded;
        let Lists { pending, too_near } = lists;
        for (patches, served) in [(&self.far.low, Rule::Low), (&self.far.middle, Rule::Middle)] {
            too_near.clear();
            patches.factors(i, pending, relative, |at, value, error| {
                if error <= relative * value {
                    counts.add_unoccluded(served);
                    visit(pending[at] as usize, Exchange { value, error });
                } else {
                    too_near.push(pending[at]);
                }
            });
            std::mem::swap(pending, too_near);
        }
        for &j in pending.iter() {
            let (p, q) = (&self.scene.patches[i], &self.scene.patches[j as usize]);
            let found = self.poses.as_ref().and_then(|poses| poses.exchange(p, q));
            let (found, rule) = found.unwrap_or_else(|| exchange_in_front(p, q, relative));
            counts.add_unoccluded(rule);
            visit(j as usize, found);
        }
    }
}

impl Filling<'_> {
    /// What a pair whose error must hold by itself may take of a row's error.
    pub(crate) fn dominant(&self) -> f64 {
        DOMINANT_SHARE * self.exact.tolerance
    }

    /// A pair behind the shadows `which`, by the adaptive rule.
    pub(crate) fn adaptive(
        &mut self,
        (i, j): (usize, usize),
        pair: &InFront<'_>,
        which: Range<usize>,
        counts: &mut Counts,
        scratch: &mut Scratch<'_>,
    ) -> Exchange {
        let unblocked = pair.unblocked_size();
        let allowed = &self.exact.occluded;
        let tolerance = allowed[i].min(allowed[j]) * unblocked;
        let (p, q) = pair.patches();
        let share = unblocked / p.area.min(q.area) * allowed[i].max(allowed[j]);
        let theta = Separation::new(p, q).theta;
        let near = theta > NEAR;
        let tolerance = if near { tolerance.min(NEAR_LOOSEST * unblocked) } else { tolerance };
        let alone = near || share > self.dominant();
        let tolerance = if alone { tolerance } else { OF_MANY * tolerance };
        let doubtful = theta > DOUBTFUL && tolerance > LOOSE * unblocked;
        let wanted = Wanted { tolerance, unblocked, alone, doubtful, most_evaluations: MOST_EVALUATIONS };
        let (found, effort) = pair.occluded(which, wanted, scratch);
        counts.add_occluded(effort);
        self.set(i, j, found);
        found
    }
}

impl Findings for Filling<'_> {
    fn known(&self, first: &Cluster, second: &Cluster) -> usize {
        self.exact.reuse.known(first.number, second.number)
    }

    fn undecided<'a>(
        &mut self,
        clusters: (&'a Cluster, &'a Cluster),
        bodies: impl Fn() -> Vec<&'a Body>,
        counts: &mut Counts,
        scratch: &mut Scratch<'a>,
    ) -> bool {
        self.by_points(clusters, bodies, counts, scratch)
    }

    fn clear(&mut self, first: &Cluster, second: &Cluster, counts: &mut Counts) {
        if first.faces(second) && second.faces(first) && self.exact.skips.has(Skip::FarRules) {
            return self.in_front(first, second, counts);
        }
        let patches = &self.exact.scene.patches;
        for i in first.range.clone() {
            for j in second.range.clone().filter(|&j| !self.exact.reuse.has(i, j)) {
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
        self.adaptive((i, j), pair, which, counts, scratch);
    }
}
