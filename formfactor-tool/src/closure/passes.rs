//! What closure asks of the blocks on disk: sums over all entries, some blocks in memory at a time, on all cores. The
//! order of every sum follows the file alone.

use crate::block_sums::{Ends, add, terms_of};
use interchange::matrix::{BlockView, MatrixWriter, Precision};
use interchange::tool::progress;
use rayon::prelude::*;

/// Sums over the entries of a matrix that is being written.
pub(super) struct Passes<'a> {
    writer: &'a mut MatrixWriter,
    count: usize,
    /// Entries that count as 0, by their place in the file, rising.
    clamped: Vec<u64>,
}

/// What replacing the entries did.
pub(super) struct Replaced {
    /// Sums over j of the new S_ij.
    pub sums: Vec<f64>,
    /// Sums over j of |change of S_ij|.
    pub changes: Vec<f64>,
    /// Largest relative change of an entry.
    pub largest_change: f64,
}

impl<'a> Passes<'a> {
    /// Over `count` elements.
    pub fn new(writer: &'a mut MatrixWriter, count: usize) -> Self {
        Self { writer, count, clamped: Vec::new() }
    }

    /// Number of entries that count as 0.
    pub fn clamped(&self) -> usize {
        self.clamped.len()
    }

    /// Sums over j of S_ij.
    pub fn sums(&mut self) -> interchange::Result<Vec<f64>> {
        self.sum(&vec![0.0; self.count], |s, _, _| s)
    }

    /// Sums over j of w_ij = S_ij^2.
    pub fn weights(&mut self) -> interchange::Result<Vec<f64>> {
        self.sum(&vec![0.0; self.count], |s, _, _| s * s)
    }

    /// (diag(w 1) + w) l.
    pub fn apply(&mut self, l: &[f64]) -> interchange::Result<Vec<f64>> {
        self.sum(l, |s, l_i, l_j| s * s * (l_i + l_j))
    }

    /// Sums over j of `term(S_ij, l_i, l_j)`, which must be symmetric and 0 where S_ij is.
    fn sum(
        &mut self,
        l: &[f64],
        term: impl Fn(f64, f64, f64) -> f64 + Sync,
    ) -> interchange::Result<Vec<f64>> {
        let (mut total, clamped) = (vec![0.0; self.count], &self.clamped);
        self.writer.for_each_chunk(|views| {
            let parts: Vec<Vec<f64>> =
                views.par_iter().map(|view| terms_of(view, &without(view, clamped), l, &term)).collect();
            views.iter().zip(&parts).for_each(|(view, part)| add(&mut total, view, part));
        })?;
        Ok(total)
    }

    /// Notes the entries that would become negative; whether there are any new ones.
    pub fn clamp_negative(&mut self, l: &[f64]) -> interchange::Result<bool> {
        let (mut found, clamped) = (Vec::new(), &self.clamped);
        self.writer.for_each_chunk(|views| {
            for view in views {
                let mut at = view.block.offset;
                view.for_each(|i, j, s| {
                    if s * (l[i] + l[j]) < -1.0 && clamped.binary_search(&at).is_err() {
                        found.push(at);
                    }
                    at += 1;
                });
            }
        })?;
        let any = !found.is_empty();
        self.clamped.extend(found);
        self.clamped.sort_unstable();
        Ok(any)
    }

    /// Replaces S_ij by S_ij + w_ij (l_i + l_j), or by 0 where that was noted.
    pub fn replace(&mut self, l: &[f64], precision: Precision) -> interchange::Result<Replaced> {
        let mut replaced =
            Replaced { sums: vec![0.0; self.count], changes: vec![0.0; self.count], largest_change: 0.0 };
        let clamped = &self.clamped;
        let bar = progress("closed factors", self.writer.block_count());
        self.writer.replace(|views, bytes| {
            let replace = |view: &BlockView<'_>| {
                let mut fresh = Fresh::of(view);
                let mut at = view.block.offset;
                view.for_each(|i, j, s| {
                    // Rounding must not make a negative number of what is nearly 0.
                    let exact = (s + s * s * (l[i] + l[j])).max(0.0);
                    let x = if clamped.binary_search(&at).is_ok() { 0.0 } else { exact };
                    at += 1;
                    let x = fresh.push(x, precision);
                    if s > 0.0 {
                        fresh.largest_change = fresh.largest_change.max((x - s).abs() / s);
                    }
                    fresh.sums.add(i, j, x);
                    fresh.changes.add(i, j, (x - s).abs());
                });
                fresh
            };
            bar.inc(views.len() as u64);
            let parts: Vec<Fresh> = views.par_iter().map(replace).collect();
            for (view, fresh) in views.iter().zip(&parts) {
                bytes.extend_from_slice(&fresh.bytes);
                add(&mut replaced.sums, view, &fresh.sums.values);
                add(&mut replaced.changes, view, &fresh.changes.values);
                replaced.largest_change = replaced.largest_change.max(fresh.largest_change);
            }
        })?;
        Ok(replaced)
    }
}

/// A block's new entries and what they changed.
struct Fresh {
    bytes: Vec<u8>,
    sums: Ends,
    changes: Ends,
    largest_change: f64,
}

impl Fresh {
    fn of(view: &BlockView<'_>) -> Self {
        let bytes = Vec::with_capacity(view.values.bytes().len());
        Self { bytes, sums: Ends::of(view), changes: Ends::of(view), largest_change: 0.0 }
    }

    /// Appends an entry and returns it as it is stored.
    fn push(&mut self, x: f64, precision: Precision) -> f64 {
        match precision {
            Precision::F32 => {
                self.bytes.extend_from_slice(&(x as f32).to_le_bytes());
                f64::from(x as f32)
            }
            Precision::F64 => {
                self.bytes.extend_from_slice(&x.to_le_bytes());
                x
            }
        }
    }
}

/// Places of a block's entries that count as 0, from its first.
fn without(view: &BlockView<'_>, clamped: &[u64]) -> Vec<usize> {
    let (first, end) = (view.block.offset, view.block.offset + view.block.stored());
    let range = clamped.partition_point(|&at| at < first)..clamped.partition_point(|&at| at < end);
    clamped[range].iter().map(|at| (at - first) as usize).collect()
}
