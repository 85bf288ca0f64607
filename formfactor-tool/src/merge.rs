//! `merge`: the shards of a matrix put together, closed as `compute` would have closed it in one run: the same bytes.

use crate::closure::{self, Closure};
use crate::compute::{finish, note_rows};
use crate::options::name;
use crate::store::Store;
use clap::ValueEnum;
use interchange::atomic_write::{Partial, refuse_input};
use interchange::matrix::{Matrix, MatrixRecord};
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::tool::{Common, Finish};
use std::path::PathBuf;

/// What `merge` is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// All shards of a matrix, in any order.
    pub shards: Vec<PathBuf>,
    /// Matrix file to write.
    pub output: PathBuf,
    /// Closure in place of the one that the shards were asked for.
    pub closure: Option<Closure>,
}

/// Puts shards together and writes the matrix with its report.
pub fn run(request: &Request, common: &Common) -> anyhow::Result<Finish> {
    refuse_input(&request.output, request.shards.iter().map(PathBuf::as_path))?;
    let mut report = Report::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    let matrix = report.phase("read", || Matrix::open_all(&request.shards))?;
    let provenance = merged(matrix.provenance(), request.closure);
    report.flags.clone_from(&provenance.flags);
    let asked = asked(&provenance.flags);
    let record = MatrixRecord { part: 0, parts: 1, ..matrix.record().clone() };
    let tolerance = record.tolerance;
    let mut store = Store::create(Partial::create(&request.output)?, provenance, record, matrix.areas()?)?;

    // In the order of one run, by rows, then columns.
    let mut views = matrix.views()?;
    views.sort_by_key(|view| (view.block.row_start, view.block.column_start));
    let bar = common.progress("merge", views.len());
    report.phase("copy", || {
        views.iter().try_for_each(|view| {
            bar.inc(1);
            store.copy(view)
        })
    })?;
    bar.finish_and_clear();
    store.row_errors = matrix.row_errors()?.to_vec();

    let closed = report.phase("closure", || closure::close(&mut store, asked))?;
    report.count("shards", request.shards.len());
    note_rows(&mut report, &store, closed.as_ref(), tolerance);
    let finish = finish(tolerance, &store);
    report.phase("write", || store.finish())?;
    report.write_beside(&request.output)?;
    Ok(finish)
}

/// The origin of the whole matrix: that of a shard without what makes it a shard.
fn merged(shard: &Provenance, closure: Option<Closure>) -> Provenance {
    let mut whole = shard.clone();
    whole.flags.retain(|flag| !flag.starts_with("--shard "));
    if let Some(closure) = closure {
        whole.flags.retain(|flag| !flag.starts_with("--closure "));
        whole.flags.push(format!("--closure {}", name(closure)));
    }
    whole
}

/// The closure that a run with these flags was asked for.
pub(crate) fn asked(flags: &[String]) -> Option<Closure> {
    let value = flags.iter().find_map(|flag| flag.strip_prefix("--closure "))?;
    Closure::from_str(value, false).ok()
}
