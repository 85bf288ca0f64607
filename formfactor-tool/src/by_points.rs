//! Two clusters with blockers between them at a loose tolerance: all their pairs by shares of visibility ([`crate::point_views`]),
//! the worst of them by the adaptive rule while a row or a column is above its share of the tolerance.

use crate::counts::Counts;
use crate::filling::{Filling, NEAR};
use crate::point_views::{CAUTION, Points};
use crate::scene::Cluster;
use geometry::body::Body;
use geometry::contour::Exchange;
use geometry::pair::{InFront, Scratch, View, look};
use geometry::shadow::Blocking;
use geometry::unoccluded::{Facing, exchange_in_front, facing, mutual_parts};
use std::f64::consts::PI;

/// The pairs of two clusters together may take so many times their share: all pairs of a row that look past something
/// have a share, most of them are wholly seen or hidden and take nothing of it. Times the part of a row's error given to partly
/// occluded pairs (0.7) it stays below the whole: with 2 the worst rows of a room missed a tolerance of 0.2.
const OF_POINTS: f64 = 1.4;
/// Below this error of a factor relative to its value without blockers a single point of each element says too little: where both
/// sides miss the same the difference is silent, and rows of a room with blocks asked for 0.02 were off by up to 12 times what they stated.
const ONE_POINT: f64 = 0.1;
/// Below this a few points are not tried either: too many pairs would be computed twice.
const FEW_POINTS: f64 = 5e-3;
/// From this tolerance on points serve nearer clusters, too: those whose sizes add up to this many times their distance.
const ROUGH: f64 = 0.1;
const ROUGH_NEAR: f64 = 1.5;
/// A single pair between clusters at the limit of what serves may take so many times what must hold by itself: the
/// limit is for elements face to face.
const TURNED: f64 = 5.0;

/// A pair on its way.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: usize,
    column: usize,
    /// Without blockers.
    whole: Exchange,
    /// Share of it that is seen, and half the difference of the two sides.
    share: f64,
    doubt: f64,
    /// Error it may have.
    allowed: f64,
}

impl Entry {
    fn found(&self) -> Exchange {
        let error = CAUTION * self.doubt * self.whole.value + self.share * self.whole.error;
        Exchange { value: self.share * self.whole.value, error }
    }
}

/// Errors of the rows and columns of two clusters and what they may be.
struct Sums {
    rows: Vec<(f64, f64)>,
    columns: Vec<(f64, f64)>,
}

impl Sums {
    fn new(entries: &[Entry], rows: usize, columns: usize) -> Self {
        let mut sums = Self { rows: vec![(0.0, 0.0); rows], columns: vec![(0.0, 0.0); columns] };
        for entry in entries {
            let error = entry.found().error;
            for sum in [&mut sums.rows[entry.row], &mut sums.columns[entry.column]] {
                *sum = (sum.0 + error, sum.1 + entry.allowed);
            }
        }
        sums
    }

    fn wants_less(&self, entry: &Entry) -> bool {
        let above = |(error, allowed): (f64, f64)| error > allowed;
        above(self.rows[entry.row]) || above(self.columns[entry.column])
    }

    fn replace(&mut self, entry: &Entry, error: f64) {
        self.rows[entry.row].0 += error - entry.found().error;
        self.columns[entry.column].0 += error - entry.found().error;
    }
}

impl Filling<'_> {
    /// Whether points serve two clusters: the tolerance is loose, all their pairs are far, and none of them carries much
    /// of its row.
    fn is_for_points(&self, first: &Cluster, second: &Cluster) -> bool {
        if self.exact.points.is_none() {
            return false;
        }
        let middle = |cluster: &Cluster| cluster.hull.iter().sum::<glam::DVec3>() / cluster.hull.len() as f64;
        let distance = (middle(second) - middle(first)).length();
        let near = if self.exact.tolerance >= ROUGH { ROUGH_NEAR } else { NEAR };
        if first.radius + second.radius > near * distance {
            return false;
        }
        let patches = &self.exact.scene.patches;
        let largest = |c: &Cluster| patches[c.range.clone()].iter().map(|p| p.area).fold(0.0, f64::max);
        let tightest =
            |c: &Cluster| self.exact.occluded[c.range.clone()].iter().copied().fold(f64::INFINITY, f64::min);
        let loosest = |c: &Cluster| self.exact.occluded[c.range.clone()].iter().copied().fold(0.0, f64::max);
        // The largest factor there can be, both elements face to face at the clusters' distance.
        let share = largest(first).max(largest(second)) / (PI * distance * distance);
        let dominates = share * loosest(first).max(loosest(second)) > TURNED * self.dominant();
        !dominates && tightest(first).min(tightest(second)) >= FEW_POINTS
    }

    /// Computes all pairs of two clusters past `bodies` by points, where points serve; `false` where they do not.
    pub(crate) fn by_points<'a>(
        &mut self,
        (first, second): (&'a Cluster, &'a Cluster),
        bodies: impl Fn() -> Vec<&'a Body>,
        counts: &mut Counts,
        scratch: &mut Scratch<'a>,
    ) -> bool {
        if !self.is_for_points(first, second) {
            return false;
        }
        let Some(views) = &self.exact.points else { return false };
        let patches = &self.exact.scene.patches;
        let bodies = bodies();
        let allowed = |i: usize, j: usize| self.exact.occluded[i].min(self.exact.occluded[j]);
        let (first_start, second_start) = (first.range.start, second.range.start);
        let (mut cut, mut full) = (Vec::new(), vec![Vec::new(); first.len()]);
        for i in first.range.clone() {
            for j in second.range.clone().filter(|&j| !self.exact.reuse.has(i, j)) {
                match facing(&patches[i], &patches[j]) {
                    Facing::Away => counts.behind += 1,
                    Facing::Cut => cut.push((i, j)),
                    Facing::Full => full[i - first_start].push(j as u32),
                }
            }
        }

        let mut unused = Counts::default();
        let mut lists = std::mem::take(&mut self.lists);
        let points = if allowed(first_start, second_start) >= ONE_POINT { Points::One } else { Points::Few };
        let shares = views.shares((first, second), &bodies, points, &mut self.view);
        counts.visible_parts += shares.looks;
        let mut entries = Vec::new();
        let mut enter = |i: usize, j: usize, whole: Exchange| {
            let (row, column) = (i - first_start, j - second_start);
            // Where no point of either side sees the other element, they see each other at grazing angles at most.
            let (share, doubt) = shares.of(row, column).unwrap_or((0.5, 0.5));
            let allowed = OF_POINTS * allowed(i, j) * whole.value;
            entries.push(Entry { row, column, whole, share, doubt, allowed });
        };
        // Nothing is seen from either side: zero, whatever the value without blockers.
        let is_hidden = |i: usize, j: usize| shares.of(i - first_start, j - second_start) == Some((0.0, 0.0));
        for (i, columns) in first.range.clone().zip(&full) {
            lists.pending.clear();
            lists.pending.extend(columns.iter().filter(|&&j| !is_hidden(i, j as usize)));
            self.exact.row_in_front(i, &mut lists, &mut unused, |j, whole| enter(i, j, whole));
        }
        for &(i, j) in cut.iter().filter(|&&(i, j)| !is_hidden(i, j)) {
            if let Some((p, q)) = mutual_parts(&patches[i], &patches[j]) {
                enter(i, j, exchange_in_front(&p, &q, self.exact.unoccluded).0);
            }
        }
        self.lists = lists;
        let seen_in_front: usize = full.iter().map(Vec::len).sum();
        counts.by_points += seen_in_front + cut.len() - entries.len();
        let sums = Sums::new(&entries, first.len(), second.len());
        self.settle(&mut entries, sums, (first, second), &bodies, counts, scratch);
        true
    }

    /// Takes the entries as they are where rows and columns are within their shares, and computes the worst ones anew where
    /// they are not.
    fn settle<'a>(
        &mut self,
        entries: &mut [Entry],
        mut sums: Sums,
        (first, second): (&Cluster, &Cluster),
        bodies: &[&'a Body],
        counts: &mut Counts,
        scratch: &mut Scratch<'a>,
    ) {
        let place = |e: &Entry| (e.row, e.column);
        entries.sort_by(|a, b| {
            let excess = |e: &Entry| e.found().error;
            excess(b).total_cmp(&excess(a)).then(place(a).cmp(&place(b)))
        });
        for entry in entries.iter() {
            let (i, j) = (first.range.start + entry.row, second.range.start + entry.column);
            let found = entry.found();
            if found.error > 0.0 && sums.wants_less(entry) {
                let error = self.single(i, j, bodies, counts, scratch);
                sums.replace(entry, error);
            } else {
                counts.by_points += 1;
                self.set(i, j, found);
            }
        }
    }

    /// One pair by itself past these bodies; the error it was left with.
    fn single<'a>(
        &mut self,
        i: usize,
        j: usize,
        bodies: &[&'a Body],
        counts: &mut Counts,
        scratch: &mut Scratch<'a>,
    ) -> f64 {
        let patches = &self.exact.scene.patches;
        let Some(pair) = InFront::new(&patches[i], &patches[j]) else {
            counts.behind += 1;
            return 0.0;
        };
        let start = scratch.shadows.len();
        let (p, q) = pair.patches();
        let [first, second] = [p, q].map(geometry::pair::set);
        let covered =
            bodies.iter().any(|body| look(body, first, second, &mut scratch.shadows) == Blocking::Everything);
        let now = start..scratch.shadows.len();
        let view = match (covered, now.is_empty()) {
            (true, _) => View::Covered,
            (false, true) => View::Clear,
            (false, false) => View::Partial,
        };
        let error = match view {
            View::Covered => {
                counts.covered += 1;
                0.0
            }
            View::Clear => {
                counts.empty_shaft += 1;
                let (found, rule) = pair.unoccluded(self.exact.unoccluded);
                counts.add_unoccluded(rule);
                self.set(i, j, found);
                found.error
            }
            View::Partial => self.adaptive((i, j), &pair, now, counts, scratch).error,
        };
        scratch.shadows.truncate(start);
        error
    }
}
