//! The reference a scene's runs are held against: the pipeline at a finer error than any that is measured, and how far
//! that itself may be off, from its distance to a run at twice its error and from given independent answers.

use super::errors;
use super::plan::{Case, scene_file};
use super::runner::{case_commands, run_commands};
use crate::table::Table;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A scene's reference.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Beginning of its files.
    pub prefix: PathBuf,
    /// Given points, where there are some.
    pub points: Option<Table>,
    /// Irradiance at them.
    pub irradiance: Vec<[f64; 3]>,
    /// How far points and picture are from those of a run at twice the error.
    pub own_error: [f64; 2],
    /// RMS distance to the given answers, whose own errors are a few parts in ten thousand.
    pub given_error: f64,
}

/// The given answers of a scene.
pub fn given_points(scene: &str) -> Option<Table> {
    let name = if scene == "penumbra" { "penumbra_lines" } else { scene };
    let path = crate::reference(&format!("{name}.csv"));
    path.exists().then(|| Table::read(&path))
}

/// Makes the reference of a scene at `error` in `work`, or takes the one that an earlier call left there for the same
/// programs. Nothing where it takes longer than `budget`.
pub fn make(scene: &str, work: &Path, error: f64, budget: Duration) -> Option<Reference> {
    let kept = work.join("reference");
    std::fs::create_dir_all(&kept).unwrap_or_else(|e| panic!("{}: {e}", kept.display()));
    let fine = keep(scene, work, &kept, error, budget)?;
    let coarse = keep(scene, work, &kept, 2.0 * error, budget)?;
    let points = given_points(scene);
    let probed = |prefix: &Path| points.as_ref().and_then(|p| errors::probe(prefix, p)).unwrap_or_default();
    let irradiance = probed(&fine);
    let given_error = points.as_ref().map_or(f64::NAN, |p| errors::rms(&irradiance, &errors::given(p)));
    let exr = |prefix: &Path| prefix.with_extension("exr");
    let own_error = [errors::rms(&probed(&coarse), &irradiance), errors::picture(&exr(&coarse), &exr(&fine))];
    Some(Reference { prefix: fine, points, irradiance, own_error, given_error })
}

/// The files of one run of the pipeline, made where they are not there.
fn keep(scene: &str, work: &Path, kept: &Path, error: f64, budget: Duration) -> Option<PathBuf> {
    let case = Case { scene: scene.to_owned(), method: "auto", mesh: "discontinuity", error };
    let (prefix, commands) = case_commands(&case, work, "reference-run");
    let folder = kept.join(format!("{scene}_{error}_{}", super::runner::key(&case, &commands, work)));
    let name = prefix.file_name().expect("a name");
    if folder.join(name).with_extension("exr").exists() {
        return Some(folder.join(name));
    }
    let done = run_commands(&prefix, &commands, budget);
    eprintln!("proof: reference of {scene} at {error}: {}", done.state);
    if done.state != "done" {
        return None;
    }
    let _ = std::fs::remove_dir_all(&folder);
    let made = prefix.parent().expect("a folder");
    std::fs::rename(made, &folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    // The matrix is the largest file, and nothing is compared with it.
    let _ = std::fs::remove_file(folder.join(name).with_extension("ff"));
    Some(folder.join(name))
}

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
