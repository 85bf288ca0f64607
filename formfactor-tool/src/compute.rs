//! `compute`: a mesh file in, a matrix file out.

use crate::closure::{self, Closed};
use crate::journal::{self, Journal, Run};
use crate::method::Choice;
use crate::options::{Shard, Storage};
use crate::plan;
use crate::reuse::Reuse;
use crate::reuse::source::{OldMatrix, Source};
use crate::scene::Scene;
use crate::schedule::in_order;
use crate::shards;
use crate::skips::{Skip, Skips};
use crate::store::{Packing, Store, StoredTile};
use crate::traversal::leaf_pairs;
use interchange::atomic_write::{refuse_input, refuse_stdout};
use interchange::counted::counted;
use interchange::digest::Digest;
use interchange::matrix::{Block, BlockKind, MatrixRecord};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::tool::{Common, Finish, print_data};
use std::path::PathBuf;

/// What `compute` is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Mesh file.
    pub mesh: PathBuf,
    /// Matrix file to write.
    pub output: PathBuf,
    /// Bound on the estimated sum over j of |error of F_ij| in any row.
    pub tolerance: f64,
    /// How the entries are computed.
    pub method: Choice,
    /// An old matrix to take entries from.
    pub reuse: OldMatrix,
    /// Skips turned off.
    pub no_skip: Vec<Skip>,
    /// How the matrix is stored.
    pub storage: Storage,
}

/// Computes the matrix of a mesh and writes it with its report.
pub fn run(request: &Request, common: &Common) -> anyhow::Result<Finish> {
    let old_files = request.reuse.reuse.iter().chain(&request.reuse.reuse_mesh);
    refuse_stdout(&request.output)?;
    refuse_input(&request.output, std::iter::once(&request.mesh).chain(old_files).map(PathBuf::as_path))?;
    let tolerance = request.tolerance;
    let skips = Skips::without(&request.no_skip);
    let mut report = Report::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    report.flags.push(format!("--tolerance {tolerance}"));
    report.flags.extend(request.method.flags());
    report.flags.extend(request.storage.flags());
    let (mesh, _, digest) = report.phase("read", || Mesh::read(&request.mesh))?;
    let scene = report.phase("prepare", || Scene::new(&mesh, &skips))?;
    let (pairs, settled) = report.phase("traverse", || leaf_pairs(&scene, &skips));

    let wanted = skips.has(Skip::Reuse).then_some(&request.reuse);
    let source = report.phase("open reused", || wanted.map_or(Ok(None), Source::open))?;
    let reuse = match &source {
        None => Reuse::nothing(),
        Some(source) => {
            source.reuse((&mesh, &scene), &request.method, tolerance)?.unwrap_or_else(|refusal| {
                report.warn(format!("{}: nothing is reused: {refusal}", source.path().display()));
                Reuse::nothing()
            })
        }
    };
    let mut inputs = vec![("mesh", digest)];
    inputs.extend(source.iter().filter(|_| !reuse.is_nothing()).flat_map(Source::inputs));
    let estimator =
        report.phase("look", || request.method.estimator(&scene, &skips, &reuse, &pairs, tolerance));
    let shard = request.storage.shard.unwrap_or(Shard { part: 0, parts: 1 });
    let all_pairs = pairs.len();
    let pairs = shards::pairs_of(pairs, estimator.as_ref(), shard);

    let precision = request.storage.precision(tolerance);
    let threads = rayon::current_num_threads();
    let memory = plan::memory(&pairs, scene.len(), threads, plan::resident(), request.storage.memory)?;
    estimator.allow(memory.anew);
    if request.storage.dry_run {
        print_data(&plan::describe(
            &scene,
            &pairs,
            (&settled, &reuse),
            estimator.as_ref(),
            precision,
            memory,
            threads,
        ))?;
        return Ok(Finish::Done);
    }
    if request.storage.memory.is_some() && !common.quiet {
        eprintln!("formfactor-tool: memory: at most {}", plan::size(memory.bound));
    }
    let packing = Packing::new(&scene, &skips, precision, tolerance);
    let record = MatrixRecord {
        elements: scene.len() as u32,
        mesh: digest,
        precision,
        symmetric: true,
        extended: false,
        tolerance,
        part: shard.part,
        parts: shard.parts,
    };
    let mut run_flags = report.flags.clone();
    run_flags.extend(request.no_skip.iter().map(|skip| format!("--no-skip {skip:?}")));
    run_flags.extend(inputs[1..].iter().map(|(role, digest)| format!("{role} {digest}")));
    let run = Run::new(digest.to_string(), run_flags, &pairs);
    let begun = journal::begin(&request.output, &run, request.storage.resume)?;
    begun.notice.iter().for_each(|notice| report.warn(notice.as_str()));
    let origin = provenance(&report.flags, &inputs);
    let mut store = Store::create(begun.work, origin, record, packing.areas())?;
    store.writer.keep_when_dropped(request.storage.resume);
    let (mut journal, resumed) = match begun.leftover {
        None => (Journal::create(&request.output, &run)?, 0),
        Some(leftover) => {
            let (journal, tiles, damaged) =
                report.phase("resume", || store.replay(leftover, &pairs, &run))?;
            if damaged {
                report.warn(format!(
                    "the journal of the killed run is cut short or damaged after {}: the others are computed anew",
                    counted(tiles, "tile", "tiles")
                ));
            }
            (journal, tiles)
        }
    };
    journal.keep_when_dropped(request.storage.resume);
    // Parts count what whole clusters settled once, and state once what the old entries of a row may be off by.
    if shard.part == 0 {
        store.state(&packing, |i| reuse.error(i));
        store.counts.same_plane += settled.same_plane;
        store.counts.behind += settled.behind;
        store.counts.covered += settled.covered;
    }
    let bar = common.progress("form factors", pairs.len());
    bar.inc(resumed as u64);
    report.phase("pairs", || {
        let work = |k: usize| {
            let tile = packing.pack(&pairs[k], &estimator.tile(&pairs[k]));
            bar.inc(1);
            tile
        };
        let take = |k: usize, tile: StoredTile| {
            store.add(&pairs[k], &tile)?;
            journal.add(k, &tile, &mut store.writer)
        };
        let (budget, cost) = (memory.in_flight as usize, |k: usize| plan::tile_bytes(&pairs[k]) as usize);
        in_order(resumed..pairs.len(), threads, budget, cost, work, take)
    })?;
    bar.finish_and_clear();

    // A shard alone says nothing of row sums.
    let closed = match request.storage.shard {
        None => report.phase("closure", || closure::close(&mut store, request.storage.closure))?,
        Some(_) => None,
    };
    note(&mut report, &mesh, &scene, &store);
    note_rows(&mut report, &store, closed.as_ref(), tolerance);
    estimator.note(&mut report);
    report.count("tests of occluders against shafts of clusters", settled.shaft_tests);
    report.count("tests of occluders against shafts of clusters (skipped)", settled.shaft_tests_spared);
    report.count("pairs of one plane, by whole clusters", settled.same_plane);
    report.count("pairs facing away, by whole clusters", settled.behind);
    report.count("pairs fully blocked, by whole clusters", settled.covered);
    report.count("elements with reused factors", reuse.elements());
    report.count("tiles", pairs.len());
    report.count("memory bound in bytes", memory.bound as usize);
    report.count("tiles resumed", resumed);
    report.count("tiles of other shards", all_pairs - pairs.len());
    let finish = finish(tolerance, &store);
    report.phase("write", || store.finish())?;
    journal.remove();
    report.write_beside(&request.output)?;
    Ok(finish)
}

/// Where a matrix with these flags comes from.
fn provenance(flags: &[String], inputs: &[(&str, Digest)]) -> Provenance {
    let origin = Provenance::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    let origin = flags.iter().fold(origin, |origin, flag| origin.flag(flag.as_str()));
    inputs.iter().fold(origin, |origin, (role, digest)| origin.input(role, *digest))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn note(report: &mut Report, mesh: &Mesh, scene: &Scene, store: &Store) {
    let n = scene.len();
    report.count("occluders", mesh.occluders.len());
    report.count("occluders after merging", scene.occluders.len());
    report.count("bodies that block", scene.bodies.len());
    report.count("convex enclosure (all visibility skipped)", usize::from(scene.convex));
    report.count("pairs", n * (n + 1) / 2);
    report.count(
        "pairs taken from their mirror image (skipped)",
        n * n.saturating_sub(1) / 2 - store.counts.computed_twice,
    );
    store.counts.note(report);
    report.count("blocks absent", store.absent_blocks);
}

/// Notes what the rows of a finished matrix say.
pub(crate) fn note_rows(report: &mut Report, store: &Store, closed: Option<&Closed>, tolerance: f64) {
    let blocks = store.writer.blocks();
    report.count("elements", store.areas.len());
    report.count("blocks", blocks.len());
    let stored: u64 = blocks.iter().map(Block::stored).sum();
    report.count("entries stored", stored as usize);
    let sparse = blocks.iter().filter(|block| block.kind() == Ok(BlockKind::Sparse)).count();
    report.count("blocks sparse", sparse);
    let row_sums = store.row_sums();
    report.estimate("tolerance asked", tolerance);
    report.estimate("worst row error", largest(&store.row_errors));
    report.estimate("mean row error", store.row_errors.iter().sum::<f64>() / row_sums.len() as f64);
    report.estimate("largest row sum", largest(&row_sums));
    report.estimate("smallest row sum", row_sums.iter().copied().fold(f64::INFINITY, f64::min));
    if let Some(closed) = closed {
        closed.note(report);
    }
}

/// How a run with this tolerance ended.
pub(crate) fn finish(tolerance: f64, store: &Store) -> Finish {
    let worst = largest(&store.row_errors);
    if worst <= tolerance {
        return Finish::Done;
    }
    Finish::ToleranceMissed(format!(
        "asked for a row error of {tolerance:.1e}, reached {worst:.1e} in the worst row; the matrix is written"
    ))
}

/// Refuses what cannot be a tolerance.
pub fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x > 0.0 && x < 1.0 => Ok(x),
        Ok(x) => Err(format!("{x} is not between 0 and 1")),
        Err(e) => Err(e.to_string()),
    }
}
