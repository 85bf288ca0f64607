//! `compute`: a mesh file in, a matrix file out.

use crate::tile::{self, Counts, Leaf, Scene, Tile};
use anyhow::Context;
use geometry::merge::merged_occluders;
use geometry::pair::Accuracy;
use geometry::patch::Patch;
use geometry::sides::SideBits;
use glam::DVec3;
use interchange::atomic_write::refuse_input;
use interchange::digest::Digest;
use interchange::ids::ElementId;
use interchange::matrix::{self, Block, BlockKind, MatrixRecord, Precision, Values};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::tool::{Common, Finish};
use rayon::prelude::*;
use std::path::PathBuf;

/// Tolerances of at least this are stored as f32: its rounding, 6e-8 of an entry, stays below.
const F32_TOLERANCE: f64 = 1e-6;
/// Relative rounding of an entry stored as f32.
const F32_ROUNDING: f64 = 0.5 * f32::EPSILON as f64;
/// Share of a row's error given to unoccluded pairs: their factors add up to at most 1.
const UNOCCLUDED_SHARE: f64 = 0.5;
/// Unoccluded pairs are never asked less: they cost little, and in bright closed rooms what their rows miss of 1 counts
/// 1 / (1 - rho) times.
const UNOCCLUDED_LOOSEST: f64 = 2e-3;
/// Share given to occluded pairs, relative to their factors without blockers, which add up to about 2 at most in rooms.
const OCCLUDED_SHARE: f64 = 0.25;
/// Most visible parts for one pair: a pair of whole walls behind a box needs some 10^5 for 12 digits.
const MOST_EVALUATIONS: usize = 400_000;

/// What `compute` is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Mesh file.
    pub mesh: PathBuf,
    /// Matrix file to write.
    pub output: PathBuf,
    /// Bound on the estimated sum over j of |error of F_ij| in any row.
    pub tolerance: f64,
}

/// Computes the matrix of a mesh and writes it with its report.
pub fn run(request: &Request, common: &Common) -> anyhow::Result<Finish> {
    refuse_input(&request.output, [request.mesh.as_path()])?;
    let mut report = Report::new("formfactor-tool", env!("CARGO_PKG_VERSION"));
    report.flags.push(format!("--tolerance {}", request.tolerance));
    let (mesh, _, digest) = report.phase("read", || Mesh::read(&request.mesh))?;
    let scene = report.phase("prepare", || prepare(&mesh))?;
    let leaves: Vec<Leaf> = mesh
        .clusters
        .iter()
        .filter(|c| c.is_leaf())
        .map(|c| Leaf::new(&scene, c.start as usize..c.end as usize))
        .collect();

    let accuracy = Accuracy {
        unoccluded: (UNOCCLUDED_SHARE * request.tolerance).min(UNOCCLUDED_LOOSEST),
        occluded: OCCLUDED_SHARE * request.tolerance,
        // Over a row these shares add up to one more factor of 1.
        least_factor: 1.0 / scene.patches.len() as f64,
        most_evaluations: MOST_EVALUATIONS,
    };
    let pairs: Vec<(usize, usize)> =
        (0..leaves.len()).flat_map(|a| (a..leaves.len()).map(move |b| (a, b))).collect();
    let bar = common.progress("form factors", pairs.len());
    let tiles: Vec<Tile> = report.phase("pairs", || {
        let compute = |&(a, b): &(usize, usize)| {
            let tile = tile::compute(&scene, &leaves[a], &leaves[b], accuracy);
            bar.inc(1);
            tile
        };
        pairs.par_iter().map(compute).collect()
    });
    bar.finish_and_clear();

    let matrix = assemble(&scene, &leaves, &pairs, &tiles, request.tolerance);
    note(&mut report, &mesh, scene.occluders.len(), &matrix, &tiles, request.tolerance);
    report.phase("write", || write(request, digest, &matrix))?;
    report.write_beside(&request.output)?;
    Ok(finish(request.tolerance, &matrix))
}

fn prepare(mesh: &Mesh) -> anyhow::Result<Scene> {
    let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
    let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
    let occluders = merged_occluders(pieces, &positions);
    let patches = mesh
        .element_ids()
        .map(|e| {
            Patch::new(mesh.element_corners(e))
                .with_context(|| format!("element {} has no area: rebuild the mesh", e.0))
        })
        .collect::<anyhow::Result<Vec<Patch>>>()?;
    let sides =
        patches.par_iter().map(|p| SideBits::of_patch(&p.corners, &p.plane, p.radius, &occluders)).collect();
    let faces = mesh.element_ids().map(|e: ElementId| mesh.element_face(e).0).collect();
    Ok(Scene { patches, faces, sides, occluders })
}

/// The matrix before it is stored.
#[derive(Debug)]
struct Assembled {
    blocks: Vec<Block>,
    values: Vec<f64>,
    areas: Vec<f64>,
    row_errors: Vec<f64>,
    row_sums: Vec<f64>,
    precision: Precision,
    absent_blocks: usize,
}

fn assemble(
    scene: &Scene,
    leaves: &[Leaf],
    pairs: &[(usize, usize)],
    tiles: &[Tile],
    tolerance: f64,
) -> Assembled {
    let count = scene.patches.len();
    let areas: Vec<f64> = scene.patches.iter().map(|p| p.area).collect();
    let precision = if tolerance >= F32_TOLERANCE { Precision::F32 } else { Precision::F64 };
    let rounding = if precision == Precision::F32 { F32_ROUNDING } else { 0.0 };
    let (mut blocks, mut values, mut absent_blocks) = (Vec::new(), Vec::new(), 0);
    let (mut row_errors, mut row_sums) = (vec![0.0; count], vec![0.0; count]);
    for (&(a, b), tile) in pairs.iter().zip(tiles) {
        if tile.entries.iter().all(|e| e.value == 0.0 && e.error == 0.0) {
            absent_blocks += 1;
            continue;
        }
        let (rows, columns) = (&leaves[a].range, &leaves[b].range);
        let kind = if a == b { BlockKind::Triangle } else { BlockKind::Dense };
        let (row_range, column_range) =
            (rows.start as u32..rows.end as u32, columns.start as u32..columns.end as u32);
        blocks.push(Block::new(kind, row_range, column_range, values.len() as u64));
        let mut entries = tile.entries.iter();
        for i in rows.clone() {
            let first = if a == b { i } else { columns.start };
            for (j, entry) in (first..columns.end).zip(entries.by_ref()) {
                values.push(entry.value);
                let error = entry.error + rounding * entry.value;
                row_errors[i] += error / areas[i];
                row_sums[i] += entry.value / areas[i];
                if i != j {
                    row_errors[j] += error / areas[j];
                    row_sums[j] += entry.value / areas[j];
                }
            }
        }
    }
    Assembled { blocks, values, areas, row_errors, row_sums, precision, absent_blocks }
}

fn write(request: &Request, mesh: Digest, matrix: &Assembled) -> interchange::Result<()> {
    let provenance = Provenance::new("formfactor-tool", env!("CARGO_PKG_VERSION"))
        .flag(format!("--tolerance {}", request.tolerance))
        .input("mesh", mesh);
    let record = MatrixRecord {
        elements: matrix.areas.len() as u32,
        mesh,
        precision: matrix.precision,
        symmetric: true,
        extended: false,
        tolerance: request.tolerance,
        part: 0,
        parts: 1,
    };
    let write = |values: Values<'_>| {
        matrix::write(
            &request.output,
            provenance,
            record,
            &matrix.blocks,
            values,
            &matrix.areas,
            &matrix.row_errors,
        )
    };
    match matrix.precision {
        Precision::F64 => write(Values::F64(&matrix.values)),
        Precision::F32 => {
            let rounded: Vec<f32> = matrix.values.iter().map(|&x| x as f32).collect();
            write(Values::F32(&rounded))
        }
    }
    .map(|_| ())
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn note(
    report: &mut Report,
    mesh: &Mesh,
    occluders: usize,
    matrix: &Assembled,
    tiles: &[Tile],
    tolerance: f64,
) {
    let mut counts = Counts::default();
    tiles.iter().for_each(|tile| counts.add(&tile.counts));
    let n = mesh.element_count();
    report.count("elements", n);
    report.count("occluders", mesh.occluders.len());
    report.count("occluders after merging", occluders);
    report.count("pairs", n * (n + 1) / 2);
    report.count("pairs of one face (skipped)", counts.same_face);
    report.count("pairs facing away (skipped)", counts.invisible);
    report.count("pairs fully blocked (skipped)", counts.fully_blocked);
    let rules = ["one point", "few points", "several points", "many points", "contour"];
    for (name, number) in rules.iter().zip(counts.unoccluded) {
        report.count(&format!("pairs unoccluded, {name}"), number);
    }
    report.count("pairs partly occluded", counts.occluded);
    report.count("pairs partly occluded, out of evaluations", counts.exhausted);
    report.count("visible parts computed", counts.visible_parts);
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
