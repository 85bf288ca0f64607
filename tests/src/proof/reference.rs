//! The reference a scene's runs are held against: the pipeline at a finer error than any that is measured, and how far
//! that itself may be off, from its distance to a run at twice its error and from given independent answers. Both runs are what the
//! pipeline does by default, so they are rows of the table as well.

use super::errors;
use super::plan::{self, Case, scene_file};
use super::record::{self, Row};
use super::runner::{Outcome, case_commands, run_commands};
use crate::table::Table;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A scene's reference.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Beginning of its files.
    pub prefix: PathBuf,
    /// Irradiance at the given points, where there are some; NaN where those are not sure enough to be compared with.
    pub irradiance: Vec<[f64; 3]>,
    /// How far points, picture and pixels away from lamps are from those of a run at twice the error.
    pub own_error: [f64; 3],
    /// RMS distance to the given answers.
    pub given_error: f64,
    /// What the standard errors of those alone would make of it.
    pub given_noise: f64,
    /// How far pixels away from lamps are from the given picture, whose noise, the second number, is taken off.
    pub given_picture: Option<[f64; 2]>,
    /// The run itself and the one at twice its error, with these.
    pub runs: [(f64, Outcome); 2],
}

impl Reference {
    /// The run at `error`, where it is one of the reference's own two.
    pub fn run_at(&self, error: f64) -> Option<&Outcome> {
        self.runs.iter().find(|(own, _)| (own / error - 1.0).abs() < 1e-9).map(|(_, run)| run)
    }
}

/// The given answers of a scene.
pub fn given_points(scene: &str) -> Option<Table> {
    let name = if scene == "penumbra" { "penumbra_lines" } else { scene };
    let path = crate::reference(&format!("{name}.csv"));
    path.exists().then(|| Table::read(&path))
}

/// The given picture of a scene, path traced, and the RMS relative standard error of its pixels.
fn given_picture(scene: &str) -> Option<(PathBuf, f64)> {
    let noise = match scene {
        "cornell_empty" => 0.0313,
        "goral_cube" => 0.0474,
        "cornell_blocks" => 0.0221,
        "room" => 0.0238,
        _ => return None,
    };
    Some((crate::reference(&format!("{scene}.exr")), noise))
}

/// Makes the reference of a scene at `error` in `work`, or takes the one that an earlier call left there for the same
/// programs. Nothing where one of its two runs takes longer than `budget`.
pub fn make(scene: &str, work: &Path, error: f64, budget: Duration) -> Option<Reference> {
    let kept = work.join("reference");
    std::fs::create_dir_all(&kept).unwrap_or_else(|e| panic!("{}: {e}", kept.display()));
    // The cheaper one first: where that fails, so would the other.
    let coarse = keep(scene, work, &kept, 2.0 * error, budget)?;
    let fine = keep(scene, work, &kept, error, budget)?;
    let points = given_points(scene);
    let probed = |prefix: &Path| points.as_ref().and_then(|p| errors::probe(prefix, p)).unwrap_or_default();
    let mut irradiance = probed(&fine.prefix);
    let given_error = points.as_ref().map_or(f64::NAN, |p| errors::rms(&irradiance, &errors::given(p)));
    for (own, given) in irradiance.iter_mut().zip(points.as_ref().map(errors::given).unwrap_or_default()) {
        *own = std::array::from_fn(|c| if given[c].is_finite() { own[c] } else { f64::NAN });
    }
    let given_noise = points.as_ref().map_or(f64::NAN, errors::given_noise);
    let exr = |run: &Outcome| run.prefix.with_extension("exr");
    let own_error = [
        errors::rms(&probed(&coarse.prefix), &irradiance),
        errors::picture(&exr(&coarse), &exr(&fine)),
        errors::surfaces(&exr(&coarse), &exr(&fine), plan::lamp(scene)),
    ];
    let given_picture = given_picture(scene).map(|(path, noise)| {
        let error = errors::surfaces(&exr(&fine), &path, plan::lamp(scene));
        [(error * error - noise * noise).max(0.0).sqrt(), noise]
    });
    let (prefix, runs) = (fine.prefix.clone(), [(error, fine), (2.0 * error, coarse)]);
    Some(Reference { prefix, irradiance, own_error, given_error, given_noise, given_picture, runs })
}

/// One run of the pipeline with what it cost, made where it is not there.
fn keep(scene: &str, work: &Path, kept: &Path, error: f64, budget: Duration) -> Option<Outcome> {
    let case = Case { scene: scene.to_owned(), method: "auto", mesh: "discontinuity", error };
    let (prefix, commands) = case_commands(&case, work, "reference-run");
    let folder = kept.join(format!("{scene}_{error}_{}", super::runner::key(&case, &commands, work)));
    let kept_prefix = folder.join(prefix.file_name().expect("a name"));
    if let (true, Some(row)) =
        (kept_prefix.with_extension("exr").exists(), record::read(&folder.join(COST)).pop())
    {
        let Row { state, costs, elements, .. } = row;
        return Some(Outcome { state, costs, elements, prefix: kept_prefix });
    }
    let done = run_commands(&prefix, &commands, budget);
    let (cpu, wall) = done.costs.iter().fold((0.0, 0.0), |(cpu, wall), c| (cpu + c.cpu_s, wall + c.wall_s));
    println!("reference of {scene} at {error}: {}, {cpu:.0} CPU s, {wall:.0} s on the clock", done.state);
    if done.state != "done" {
        return None;
    }
    let _ = std::fs::remove_dir_all(&folder);
    let made = prefix.parent().expect("a folder");
    let (state, costs, elements) = (done.state.clone(), done.costs, done.elements);
    record::write(
        &made.join(COST),
        &[Row { scene: scene.to_owned(), asked: error, state, costs, elements, ..Row::default() }],
    );
    // The matrix is the largest file, and nothing is compared with it.
    let _ = std::fs::remove_file(prefix.with_extension("ff"));
    std::fs::rename(made, &folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    Some(Outcome { prefix: kept_prefix, ..done })
}

/// Name of the file beside a kept run that says what it cost.
const COST: &str = "cost.csv";

/// The matrix of a box at `tolerance` (its quads are the elements).
pub fn matrix(scene: &str, work: &Path, tolerance: f64) -> PathBuf {
    let file = scene_file(scene, work);
    let (mesh, matrix) = (file.with_extension("mesh"), file.with_extension("ff"));
    let mut build = crate::tool("mesh-tool");
    crate::run(build.arg("build").arg(&file).arg("-o").arg(&mesh)).expect_code(0);
    let mut compute = crate::tool("formfactor-tool");
    compute.arg("compute").arg(&mesh).arg("-o").arg(&matrix).args(["--closure", "off", "--tolerance"]);
    let done = crate::run(compute.arg(format!("{tolerance:e}")));
    assert!(matches!(done.code, Some(0 | 3)), "{}", done.stderr);
    matrix
}
