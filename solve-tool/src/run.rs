//! `solve-tool solve`: files in, solution and report out.

use crate::channels::{self, CHANNEL_NAMES};
use crate::error::{Result, SolveError};
use crate::error_budget::shortfall;
use crate::lossless::Lossless;
use crate::solve::{ChannelSolution, Solved, Solver, solve};
use crate::system::System;
use interchange::atomic_write::refuse_input;
use interchange::materials_input::load_materials;
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::solution::{Origins, Solution, Summary};
use interchange::tool::Finish;
use std::path::PathBuf;

/// Name in provenance and reports.
const TOOL: &str = "solve-tool";
/// Version in provenance and reports.
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Names in a message before it says "and n more".
const MOST_NAMES: usize = 8;

/// What `solve` is asked to do.
#[derive(Debug, Clone)]
pub struct SolveRequest {
    /// The exchange matrix, or all its shards.
    pub matrix: Vec<PathBuf>,
    /// The mesh it was computed for.
    pub mesh: PathBuf,
    /// Materials in place of the table beside the mesh.
    pub materials: Option<PathBuf>,
    /// The solution to be written.
    pub output: PathBuf,
    /// Method.
    pub solver: Solver,
    /// Bound on the power-norm error relative to the emitted power, above 0.
    pub tolerance: f64,
}

/// Solves and writes the solution and its report. Nothing is written where there is no solution.
pub fn run(request: &SolveRequest) -> Result<Finish> {
    let given = request.matrix.iter().chain([&request.mesh]).chain(&request.materials);
    refuse_input(&request.output, given.map(PathBuf::as_path))?;
    let mut report = Report::new(TOOL, VERSION);
    let (mesh, _, mesh_digest) = report.phase("read mesh", || Mesh::read(&request.mesh))?;
    let matrix = report.phase("map matrix", || Matrix::open_all(&request.matrix))?;
    matrix.belongs_to(&request.mesh, mesh_digest, mesh.element_count())?;
    refuse_unsupported(&matrix)?;
    let (materials, materials_digest) =
        load_materials(&request.mesh, request.materials.as_deref(), &mesh.materials)?;
    let channels = channels::of_mesh(&mesh, &materials)?;

    let system = report.phase("row sums", || System::new(&matrix))?;
    let solved = report.phase("solve", || solve(&system, &channels, request.solver, request.tolerance));
    let solved = solved.map_err(|error| name_places(error, &mesh))?;

    let solver_name = clap::ValueEnum::to_possible_value(&request.solver);
    let solver_name = solver_name.as_ref().map_or("auto", |value| value.get_name());
    let flags = [format!("--solver {solver_name}"), format!("--tolerance {:e}", request.tolerance)];
    let mut provenance = Provenance::new(TOOL, VERSION);
    for flag in &flags {
        provenance = provenance.flag(flag.as_str());
    }
    let provenance = provenance
        .input("mesh", mesh_digest)
        .input("matrix", matrix.digest())
        .input("materials", materials_digest);
    let origins = Origins { mesh: mesh_digest, matrix: matrix.digest(), materials: materials_digest };
    let solution = to_solution(&solved, request.tolerance);
    report.phase("write", || solution.write(&request.output, provenance, origins))?;

    report.flags = flags.to_vec();
    report.flags.push(format!("solved by: {}", solved.method));
    fill_report(&mut report, &solved, &system, &matrix);
    let missed = missed(&solved, request.tolerance, matrix.record().tolerance);
    report.write_beside(&request.output)?;
    Ok(missed.map_or(Finish::Done, Finish::ToleranceMissed))
}

/// Refuses matrices that are not symmetric: this solver needs symmetric S.
fn refuse_unsupported(matrix: &Matrix) -> Result<()> {
    if matrix.record().symmetric {
        return Ok(());
    }
    let found = "a matrix without its mirror image (not symmetric)".into();
    let remedy = "run formfactor-tool compute on the mesh";
    Err(SolveError::Unsupported { path: matrix.path().display().to_string(), found, remedy })
}

/// Says in the user's words where a lossless component lies.
fn name_places(error: SolveError, mesh: &Mesh) -> SolveError {
    let SolveError::Lossless(lossless) = error else { return error };
    let ids = || lossless.elements.iter().map(|&i| interchange::ids::ElementId::new(i));
    let mut faces: Vec<u32> = ids().map(|e| mesh.face_inputs[mesh.element_face(e).index()] + 1).collect();
    faces.sort_unstable();
    faces.dedup();
    let mut groups: Vec<u32> = ids().map(|e| mesh.element_group(e).0).collect();
    groups.sort_unstable();
    groups.dedup();
    let faces = some(faces.iter().map(u32::to_string));
    let groups = some(groups.iter().map(|&g| mesh.groups[g as usize].clone()));
    let place = format!("faces {faces} (groups {groups})");
    SolveError::Lossless(Lossless { place, ..lossless })
}

fn some(names: impl ExactSizeIterator<Item = String>) -> String {
    let rest = names.len().saturating_sub(MOST_NAMES);
    let shown: Vec<String> = names.take(MOST_NAMES).collect();
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    shown.join(", ") + &more
}

fn to_solution(solved: &Solved, tolerance: f64) -> Solution {
    let [red, green, blue] = &solved.channels;
    let interleave = |values: fn(&ChannelSolution) -> &Vec<f64>| -> Vec<[f64; 3]> {
        let (r, g, b) = (values(red), values(green), values(blue));
        (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect()
    };
    // A dark channel has no history: its error is 0 throughout.
    let products = solved.channels.iter().map(|c| c.history.len()).max().unwrap_or(0);
    let at = |channel: &ChannelSolution, k: usize| channel.history.get(k).copied().unwrap_or(0.0);
    let history = (0..products).map(|k| [at(red, k), at(green, k), at(blue, k)]).collect();
    let summary = Summary { solver: solved.method.clone(), tolerance, achieved: worst_bound(solved) };
    Solution {
        radiosity: interleave(|c| &c.radiosity),
        irradiance: interleave(|c| &c.irradiance),
        history,
        summary,
    }
}

fn worst_bound(solved: &Solved) -> f64 {
    solved.channels.iter().map(|c| c.bound).fold(0.0, f64::max)
}

fn fill_report(report: &mut Report, solved: &Solved, system: &System<'_>, matrix: &Matrix) {
    report.count("elements", system.areas.len());
    report.count("stored entries", system.product.stored_entries());
    for (name, amount) in &solved.counters {
        report.count(name, *amount);
    }
    report.estimate("matrix tolerance asked", matrix.record().tolerance);
    report.estimate("solver bound", worst_bound(solved));
    for (name, channel) in CHANNEL_NAMES.iter().zip(&solved.channels) {
        report.estimate(&format!("solver bound {name}"), channel.bound);
        report.estimate(&format!("row error {name}"), channel.matrix_error.row_error);
        report.estimate(&format!("row error amplification {name}"), channel.matrix_error.amplification);
        report.estimate(&format!("matrix error {name}"), channel.matrix_error.relative);
        report.estimate(&format!("power emitted {name}"), channel.energy.emitted);
        report.estimate(&format!("power absorbed {name}"), channel.energy.absorbed);
        report.estimate(&format!("power escaped {name}"), channel.energy.escaped);
        report.estimate(&format!("energy defect {name}"), channel.energy.defect);
    }
    for warning in &solved.warnings {
        report.warn(warning.as_str());
    }
}

/// Why the asked tolerance does not hold, if it does not: the solver's own bound first, else the matrix's errors.
fn missed(solved: &Solved, tolerance: f64, matrix_tolerance: f64) -> Option<String> {
    let bounds = CHANNEL_NAMES.iter().zip(&solved.channels);
    let worst = bounds.max_by(|a, b| a.1.bound.total_cmp(&b.1.bound)).filter(|(_, c)| c.bound > tolerance);
    if let Some((name, channel)) = worst {
        return Some(format!(
            "the bound on the solver's error stopped falling at {:.1e} in the {name} channel, above the asked \
             {tolerance:e}; the best iterate was written; a larger --tolerance or a smaller formfactor-tool --tolerance \
             helps",
            channel.bound
        ));
    }
    let errors = CHANNEL_NAMES.iter().zip(&solved.channels);
    let (name, channel) =
        errors.max_by(|a, b| a.1.matrix_error.relative.total_cmp(&b.1.matrix_error.relative))?;
    shortfall(&channel.matrix_error, tolerance, matrix_tolerance, name)
}
