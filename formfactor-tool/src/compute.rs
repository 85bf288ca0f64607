//! `compute`: a mesh file in, a matrix file out.

use crate::counts::Counts;
use crate::estimator::Estimator;
use crate::exact::Exact;
use crate::scene::Scene;
use crate::skips::{Skip, Skips};
use crate::store::{self, Assembled};
use crate::tile::Tile;
use crate::traversal::leaf_pairs;
use interchange::atomic_write::refuse_input;
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::tool::{Common, Finish};
use rayon::prelude::*;
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
    /// Skips turned off.
    pub no_skip: Vec<Skip>,
}

/// Computes the matrix of a mesh and writes it with its report.
pub fn run(request: &Request, common: &Common) -> anyhow::Result<Finish> {
    refuse_input(&request.output, [request.mesh.as_path()])?;
    let tolerance = request.tolerance;
    let skips = Skips::without(&request.no_skip);
    let mut report = Report::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    report.flags.push(format!("--tolerance {tolerance}"));
    let (mesh, _, digest) = report.phase("read", || Mesh::read(&request.mesh))?;
    let scene = report.phase("prepare", || Scene::new(&mesh, &skips))?;
    let (pairs, settled) = report.phase("traverse", || leaf_pairs(&scene, &skips));

    let estimator = Exact::new(&scene, tolerance);
    let bar = common.progress("form factors", pairs.len());
    let tiles: Vec<Tile> = report.phase("pairs", || {
        let compute = |pair| {
            let tile = estimator.tile(pair);
            bar.inc(1);
            tile
        };
        pairs.par_iter().map(compute).collect()
    });
    bar.finish_and_clear();

    let mut counts = Counts {
        same_plane: settled.same_plane,
        behind: settled.behind,
        covered: settled.covered,
        ..Counts::default()
    };
    tiles.iter().for_each(|tile| counts.add(&tile.counts));
    let matrix = report.phase("assemble", || store::assemble(&scene, &pairs, &tiles, tolerance));
    note(&mut report, &mesh, &scene, &matrix, &counts, tolerance);
    report.count("tests of occluders against shafts of clusters", settled.shaft_tests);
    report.phase("write", || store::write(&request.output, digest, &matrix, tolerance))?;
    report.write_beside(&request.output)?;
    Ok(finish(tolerance, &matrix))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn note(
    report: &mut Report,
    mesh: &Mesh,
    scene: &Scene,
    matrix: &Assembled,
    counts: &Counts,
    tolerance: f64,
) {
    let n = scene.len();
    report.count("elements", n);
    report.count("occluders", mesh.occluders.len());
    report.count("occluders after merging", scene.occluders.len());
    report.count("pairs", n * (n + 1) / 2);
    counts.note(report);
    report.count("blocks", matrix.blocks.len());
    report.count("blocks absent", matrix.absent_blocks);
    report.estimate("tolerance asked", tolerance);
    report.estimate("worst row error", largest(&matrix.row_errors));
    report.estimate("mean row error", matrix.row_errors.iter().sum::<f64>() / n as f64);
    report.estimate("largest row sum", largest(&matrix.row_sums));
    report.estimate("smallest row sum", matrix.row_sums.iter().copied().fold(f64::INFINITY, f64::min));
}

fn finish(tolerance: f64, matrix: &Assembled) -> Finish {
    let worst = largest(&matrix.row_errors);
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
