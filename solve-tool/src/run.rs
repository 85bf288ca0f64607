//! `solve-tool solve`: files in, solution and report out.

use crate::account;
use crate::bounces::bounce;
use crate::bounds::{self, Bounded};
use crate::channels::{self, Channel};
use crate::discretisation::{self, ElementResidual, Radiosities};
use crate::error::{Result, SolveError};
use crate::interval::Spread;
use crate::lossless::Lossless;
use crate::skips::Skips;
use crate::snapshot::{self, Plan};
use crate::solve::{Options, Solved, Solver, solve_with};
use crate::start;
use crate::system::System;
use crate::thermal;
use crate::work::Shown;
use interchange::atomic_write::{refuse_input, refuse_stdout};
use interchange::materials_input::load_materials;
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::solution::{Details, Origins, Solution, Summary};
use interchange::tool::Finish;
use std::path::{Path, PathBuf};

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
    /// Temperatures and emissivities in place of materials.
    pub thermal: Option<PathBuf>,
    /// The solution to be written.
    pub output: PathBuf,
    /// Method.
    pub solver: Solver,
    /// Bound on the power-norm error relative to the emitted power, above 0.
    pub tolerance: f64,
    /// Stop after so many bounces instead of solving.
    pub bounces: Option<u32>,
    /// When to write snapshots.
    pub snapshots: Option<Plan>,
    /// An older solution to start from.
    pub start: Option<PathBuf>,
    /// Whether Southwell's relaxation overshoots.
    pub overshooting: bool,
    /// Most steps of the iteration.
    pub most_steps: Option<usize>,
    /// Work that is left out.
    pub skips: Skips,
    /// Whether to bound every radiosity, and how the matrix's errors are spread.
    pub bounds: Option<Spread>,
}

impl SolveRequest {
    /// Flags that change the result.
    fn flags(&self) -> Vec<String> {
        let mut flags = match self.bounces {
            Some(bounces) => vec![format!("--bounces {bounces}")],
            None => {
                vec![format!("--solver {}", self.solver.name()), format!("--tolerance {:e}", self.tolerance)]
            }
        };
        if self.overshooting {
            flags.push("--overshoot".into());
        }
        if let Some(steps) = self.most_steps {
            flags.push(format!("--max-steps {steps}"));
        }
        if let Some(spread) = self.bounds {
            flags.push(format!("--bounds {}", spread.name()));
        }
        flags.extend(self.skips.done.iter().map(|skip| format!("--no-skip {}", skip.name())));
        flags
    }

    fn inputs(&self) -> impl Iterator<Item = &Path> {
        let optional = [&self.materials, &self.thermal, &self.start].map(Option::as_ref);
        let given = self.matrix.iter().chain([&self.mesh]).chain(optional.into_iter().flatten());
        given.map(PathBuf::as_path)
    }
}

/// Solves and writes the solution and its report. Nothing is written where there is no solution.
pub fn run(request: &SolveRequest) -> Result<Finish> {
    refuse_stdout(&request.output)?;
    refuse_input(&request.output, request.inputs())?;
    let mut report = Report::new(TOOL, VERSION);
    let (mesh, _, mesh_digest) = report.phase("read mesh", || Mesh::read(&request.mesh))?;
    let matrix = report.phase("map matrix", || Matrix::open_all(&request.matrix))?;
    matrix.belongs_to(&request.mesh, mesh_digest, mesh.element_count())?;
    let thermal = request.thermal.as_ref().map(|path| thermal::read(path, &mesh)).transpose()?;
    let (channels, materials_digest) = match &thermal {
        Some(table) => (std::array::from_fn(|_| table.channel(&mesh)), table.digest),
        None => {
            let given = request.materials.as_deref();
            let (materials, digest) = load_materials(&request.mesh, given, &mesh.materials)?;
            (channels::of_mesh(&mesh, &materials)?, digest)
        }
    };
    let start = request.start.as_ref();
    let start = start.map(|path| start::read(path, &request.mesh, &mesh, mesh_digest)).transpose()?;

    let mut provenance = Provenance::new(TOOL, VERSION);
    for flag in request.flags() {
        provenance = provenance.flag(flag);
    }
    provenance = provenance
        .input("mesh", mesh_digest)
        .input("matrix", matrix.digest())
        .input(if thermal.is_some() { "thermal" } else { "materials" }, materials_digest);
    if let Some(start) = &start {
        provenance = provenance.input("start", start.digest);
    }
    let origins = Origins { mesh: mesh_digest, matrix: matrix.digest(), materials: materials_digest };

    let system = report.phase("row sums", || System::new(&matrix))?;
    let scene = Scene { request, channels: &channels, system: &system, provenance, origins };
    let solved = report.phase("solve", || scene.solve(start.map(|start| start.irradiance)));
    let mut solved = solved.map_err(|error| name_places(error, &mesh))?;
    let bounded = match request.bounds {
        Some(spread) => {
            let residuals = report.phase("test points", || scene.residuals(&mesh, &solved));
            Some(report.phase("bounds", || bounds::find(&system, &channels, &solved, &residuals, spread)))
        }
        None => None,
    };
    report.phase("sharpen", || scene.sharpen(&mut solved));

    let temperatures =
        thermal.map(|table| table.temperatures(&mesh, &solved.channels[0].irradiance)).transpose()?;
    let details = scene.all_details(bounded.as_ref(), temperatures);
    report.phase("write", || scene.write(&solved, details))?;
    report.flags = request.flags();
    report.flags.push(format!("solved by: {}", solved.method));
    account::fill(&mut report, &solved, &system, &matrix);
    if let Some(bounded) = &bounded {
        account::fill_bounds(&mut report, bounded, &mesh);
    }
    let missed = match request.bounces {
        Some(_) => None,
        None => account::missed(&solved, request.tolerance, matrix.record()),
    };
    report.write_beside(&request.output)?;
    Ok(missed.map_or(Finish::Done, Finish::ToleranceMissed))
}

/// What is solved, and what the files that come of it carry.
struct Scene<'a> {
    request: &'a SolveRequest,
    channels: &'a [Channel; 3],
    system: &'a System<'a>,
    provenance: Provenance,
    origins: Origins,
}

impl Scene<'_> {
    fn solve(&self, start: Option<Vec<[f64; 3]>>) -> Result<Solved> {
        let request = self.request;
        if let Some(bounces) = request.bounces {
            return Ok(bounce(self.system, self.channels, bounces, &request.skips));
        }
        let options = Options {
            solver: request.solver,
            tolerance: request.solver.stops_at(request.tolerance),
            most_steps: request.most_steps,
            overshooting: request.overshooting,
            skips: request.skips.clone(),
            start,
        };
        let Some(plan) = &request.snapshots else {
            return solve_with(self.system, self.channels, &options, None);
        };
        let mut failed = None;
        let mut view = |count: usize, look: &dyn Fn() -> [Shown; 3]| {
            if failed.is_none() && plan.wants(count) {
                failed = self.write_snapshot(count, look()).err();
            }
        };
        let solved = solve_with(self.system, self.channels, &options, Some(&mut view))?;
        failed.map_or(Ok(solved), Err)
    }

    fn write_snapshot(&self, count: usize, shown: [Shown; 3]) -> Result<()> {
        let irradiance = interleave(|c| &shown[c].irradiance);
        let radiosity: Vec<[f64; 3]> = irradiance
            .iter()
            .enumerate()
            .map(|(i, h)| {
                let reflected = |c: usize| self.channels[c].reflectance[i] * h[c];
                std::array::from_fn(|c| self.channels[c].exitance[i] + reflected(c))
            })
            .collect();
        let areas = self.system.areas;
        let power =
            |values: &[f64]| -> f64 { values.iter().zip(areas).map(|(b, area)| b.abs() * area).sum() };
        // What is shown is no solution yet, and the ambient term in it no bound: what is left to be shot is told.
        let left = (0..3).map(|c| power(&shown[c].unshot) / power(&self.channels[c].exitance));
        let achieved = left.filter(|left| left.is_finite()).fold(0.0, f64::max);
        let solver = format!("{}, snapshot after {count}", self.request.solver.name());
        let solution = Solution {
            radiosity,
            irradiance,
            history: Vec::new(),
            summary: Summary { solver, tolerance: self.request.tolerance, achieved },
            details: Details {
                unshot: Some(interleave(|c| &shown[c].unshot)),
                ambient: Some(std::array::from_fn(|c| shown[c].ambient)),
                ..self.details()
            },
        };
        let path = snapshot::path_for(&self.request.output, count);
        refuse_input(&path, self.request.inputs())?;
        let provenance = self.provenance.clone().flag(format!("--snapshots {count}"));
        solution.write(&path, provenance, self.origins)?;
        Ok(())
    }

    fn details(&self) -> Details {
        let exitance = Some(interleave(|c| &self.channels[c].exitance));
        Details { exitance, row_sums: Some(self.system.row_sums.clone()), ..Details::default() }
    }

    /// What is not constant on the elements, at test points.
    fn residuals(&self, mesh: &Mesh, solved: &Solved) -> Vec<ElementResidual> {
        let reflectance = interleave(|c| &self.channels[c].reflectance);
        let exitance = interleave(|c| &self.channels[c].exitance);
        let radiosity = interleave(|c| &solved.channels[c].radiosity);
        let (reflectance, exitance, radiosity) = (&reflectance[..], &exitance[..], &radiosity[..]);
        discretisation::residuals(mesh, Radiosities { reflectance, exitance, radiosity })
    }

    /// Looks closer at the matrix's errors where they are more than was asked.
    fn sharpen(&self, solved: &mut Solved) {
        if self.request.bounces.is_some() {
            return;
        }
        let mut products = 0;
        for c in 0..3 {
            let earlier = (0..c).find(|&earlier| self.channels[earlier] == self.channels[c]);
            if let Some(earlier) = earlier {
                solved.channels[c].matrix_error = solved.channels[earlier].matrix_error;
            } else if solved.channels[c].matrix_error.relative > self.request.tolerance {
                products += bounds::sharpen(self.system, &self.channels[c], &mut solved.channels[c]);
            }
        }
        if products > 0 {
            solved.counters.push(("products for matrix errors".into(), products));
        }
    }

    /// What the solution holds besides.
    fn all_details(&self, bounded: Option<&Bounded>, thermal: Option<Vec<[f64; 2]>>) -> Details {
        let details = Details { thermal, ..self.details() };
        match bounded {
            Some(bounded) => Details {
                bounds: Some([interleave(|c| &bounded.lower[c]), interleave(|c| &bounded.upper[c])]),
                element_errors: Some(bounded.element_errors.clone()),
                error_ranking: Some(bounded.ranking.clone()),
                error_links: Some(bounded.links.clone()),
                ..details
            },
            None => details,
        }
    }

    fn write(&self, solved: &Solved, details: Details) -> Result<()> {
        // A dark channel has no history: its error is 0 throughout.
        let products = solved.channels.iter().map(|c| c.history.len()).max().unwrap_or(0);
        let at = |c: usize, k: usize| solved.channels[c].history.get(k).copied().unwrap_or(0.0);
        let solution = Solution {
            radiosity: interleave(|c| &solved.channels[c].radiosity),
            irradiance: interleave(|c| &solved.channels[c].irradiance),
            history: (0..products).map(|k| std::array::from_fn(|c| at(c, k))).collect(),
            summary: Summary {
                solver: solved.method.clone(),
                tolerance: self.request.tolerance,
                achieved: account::worst_bound(solved),
            },
            details,
        };
        solution.write(&self.request.output, self.provenance.clone(), self.origins)?;
        Ok(())
    }
}

fn interleave<'a>(channel: impl Fn(usize) -> &'a Vec<f64>) -> Vec<[f64; 3]> {
    let (r, g, b) = (channel(0), channel(1), channel(2));
    (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect()
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
