//! `--reuse`: a matrix of the same scene on another mesh. The factor between two elements depends on them and on what
//! blocks light, so two elements that both meshes have keep theirs, to the bit.
//!
//! A matrix states one error per row, the sum of all its |errors|. It holds for any part of the row: a row that keeps old
//! entries states the old row's error once for all of them, and the pairs that are new to it share what that leaves of the
//! tolerance. Which elements are the same is told in [`elements`], which matrices will do in [`source`].
//!
//! # Limitations
//! Serves `--method auto`: the other methods compute whole rows, or pairs one by one without sharing out a tolerance.

pub mod elements;
mod entries;
pub mod source;

use crate::estimator::TileBuilder;
use crate::scene::Cluster;
use crate::traversal::LeafPair;
use entries::Entries;

/// A row keeps old entries where the old matrix states at most this part of the tolerance. Unoccluded pairs take up to 0.3
/// of it, so 0.2 stays for partly occluded ones, which are few then. Rows of furnished rooms state 0.2 of their tolerance in
/// the mean and 0.7 at most.
pub const MOST_STATED: f64 = 0.5;

/// What a new matrix takes from an old one.
#[derive(Debug, Default)]
pub struct Reuse<'m> {
    /// Per element of the new mesh its number in the old one, where its row keeps old entries.
    old: Vec<Option<u32>>,
    /// Per cluster the number of such elements.
    kept: Vec<usize>,
    /// Per element what the old matrix states for its row; 0 where nothing is kept.
    errors: Vec<f64>,
    entries: Option<Entries<'m>>,
}

impl<'m> Reuse<'m> {
    /// No old matrix.
    pub fn nothing() -> Self {
        Self::default()
    }

    /// Entries of an old matrix for the elements that have a number there; `stated` are its row errors.
    fn new(clusters: &[Cluster], old: Vec<Option<u32>>, stated: &[f64], entries: Entries<'m>) -> Self {
        let kept = clusters.iter().map(|c| old[c.range.clone()].iter().flatten().count()).collect();
        let errors = old.iter().map(|place| place.map_or(0.0, |k| stated[k as usize])).collect();
        Self { old, kept, errors, entries: Some(entries) }
    }

    /// Whether nothing is taken.
    pub fn is_nothing(&self) -> bool {
        self.entries.is_none()
    }

    /// Number of elements whose rows keep old entries.
    pub fn elements(&self) -> usize {
        self.old.iter().flatten().count()
    }

    fn place(&self, element: usize) -> Option<u32> {
        self.old.get(element).copied().flatten()
    }

    /// Whether the old matrix has the entry of these elements.
    pub fn has(&self, i: usize, j: usize) -> bool {
        self.place(i).is_some() && self.place(j).is_some()
    }

    /// Whether it has all entries between an element and those of a cluster.
    pub fn has_all(&self, element: usize, cluster: &Cluster) -> bool {
        self.place(element).is_some() && self.kept[cluster.number] == cluster.len()
    }

    /// How many pairs of two clusters, by their numbers, it has.
    pub fn known(&self, first: usize, second: usize) -> usize {
        let kept = |cluster: usize| self.kept.get(cluster).copied().unwrap_or(0);
        match first == second {
            true => kept(first) * (kept(first) + 1) / 2,
            false => kept(first) * kept(second),
        }
    }

    /// What the old entries of a row may be off by, all together: sum over j of |error of F_ij|.
    pub fn error(&self, element: usize) -> f64 {
        self.errors.get(element).copied().unwrap_or(0.0)
    }

    /// Sets the entries of a tile that the old matrix has, and says how many. Their errors are those of the rows
    /// ([`Reuse::error`]), not the tile's.
    pub fn copy(&self, pair: &LeafPair, builder: &mut TileBuilder) -> usize {
        let Some(entries) = &self.entries else { return 0 };
        if self.known(pair.clusters[0], pair.clusters[1]) == 0 {
            return 0;
        }
        let columns: Vec<(usize, u32)> =
            pair.columns.clone().filter_map(|j| Some((j, self.place(j)?))).collect();
        let (mut near, mut copied) = (entries.start(), 0);
        for i in pair.rows.clone() {
            let Some(row) = self.place(i) else { continue };
            // Of a tile on the diagonal the upper triangle.
            let first = if pair.is_diagonal() { columns.partition_point(|&(j, _)| j < i) } else { 0 };
            for &(j, column) in &columns[first..] {
                let value = entries.get(row, column, &mut near);
                builder.set(i - pair.rows.start, j - pair.columns.start, value, 0.0);
            }
            copied += columns.len() - first;
        }
        copied
    }
}
