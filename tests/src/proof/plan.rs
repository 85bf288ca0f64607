//! Which cases are run, in which order, with which flags.
//!
//! Coarse errors of all scenes come first, so a run that is stopped early has measured everything a little. Along a
//! curve (scene, method, mesh) the cost is foretold from the last case: halving the error is taken to cost four times
//! as much; a case foretold or seen to exceed the budget is recorded as not run, and so are all finer ones.

use super::boxes;
use std::path::{Path, PathBuf};

/// Asked errors.
pub const ERRORS: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
/// Scenes with surfaces and a camera: the whole pipeline. The slowest is last.
pub const SCENES: [&str; 5] = ["cornell_empty", "goral_cube", "penumbra", "cornell_blocks", "room"];
/// Methods of form factors.
pub const METHODS: [&str; 5] = ["auto", "contour", "area", "hemicube", "rays"];
/// Kinds of mesh; methods other than `auto` are measured on the last.
pub const MESHES: [&str; 3] = ["uniform", "adaptive", "discontinuity"];

/// One point of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// A scene of [`SCENES`], or `boxK-N`: K blockers, N quads along an edge.
    pub scene: String,
    /// Form-factor method.
    pub method: &'static str,
    /// Kind of mesh, or `given`.
    pub mesh: &'static str,
    /// Asked error.
    pub error: f64,
}

impl Case {
    /// Names the curve this case is a point of.
    pub fn curve(&self) -> (String, &'static str, &'static str) {
        (self.scene.clone(), self.method, self.mesh)
    }

    /// Whether only mesh and matrix are made, and the error is that of rows.
    pub fn matrix_only(&self) -> bool {
        self.mesh == "given"
    }

    /// Flags of formfactor-tool besides those of the pipeline. Cells and rays are chosen so that the classical
    /// methods' own noise is of the order of the error: a hemicube's is inversely as its cells along an edge, that of
    /// stratified rays falls at least as one over the root of their number.
    pub fn matrix_flags(&self) -> String {
        match self.method {
            "auto" => String::new(),
            "hemicube" => format!("--method hemicube --resolution {}", hemicube_cells(self.error)),
            "rays" => format!("--method rays --rays {}", rays(self.error)),
            other => format!("--method {other}"),
        }
    }

    /// Flags of mesh-tool; a uniform mesh gets edges that give about as many triangles as the pipeline asks for.
    pub fn mesh_flags(&self, area: f64, elements: f64) -> String {
        match self.mesh {
            // An equilateral triangle's area is 0.433 edge^2; the mesher's median edge is about 0.7 of its longest.
            "uniform" => {
                format!("--max-edge {:.6} --discontinuity off", (area / elements / 0.433).sqrt() / 0.7)
            }
            "adaptive" => "--discontinuity d0".to_owned(),
            _ => String::new(),
        }
    }
}

/// Even, so that the cube's axis lies between cells.
fn hemicube_cells(error: f64) -> usize {
    2 * ((2.0 / error).round() as usize).clamp(10, 500)
}

fn rays(error: f64) -> usize {
    ((4.0 / (error * error)) as usize).clamp(400, 1_000_000)
}

/// All cases in the order they are run.
pub fn cases(scenes: &[String], errors: &[f64]) -> Vec<Case> {
    let mut cases = Vec::new();
    for &error in errors {
        for scene in scenes {
            let case = |method, mesh| Case { scene: scene.clone(), method, mesh, error };
            if scene.starts_with("box") {
                cases.extend(METHODS.map(|method| case(method, "given")));
            } else {
                cases.extend(MESHES.map(|mesh| case("auto", mesh)));
                cases.extend(METHODS[1..].iter().map(|method| case(method, "discontinuity")));
            }
        }
    }
    cases
}

/// Names of all scenes, the slowest last.
pub fn scenes() -> Vec<String> {
    let boxes = boxes::BLOCKERS.iter().flat_map(|k| boxes::SIZES.map(|n| format!("box{k}-{n}")));
    let (room, others) = SCENES.split_last().expect("scenes");
    others.iter().map(|&s| s.to_owned()).chain(boxes).chain([(*room).to_owned()]).collect()
}

/// The scene's file; boxes are written into `folder`.
pub fn scene_file(scene: &str, folder: &Path) -> PathBuf {
    let Some((blockers, n)) = scene.strip_prefix("box").and_then(|rest| rest.split_once('-')) else {
        return crate::scene(&format!("{scene}.obj"));
    };
    let folder = folder.join(scene);
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let number = |text: &str| text.parse().unwrap_or_else(|e| panic!("{scene}: {e}"));
    boxes::scene(&folder, number(blockers), number(n))
}

/// Seconds the next case of a curve will take, from the last one's.
pub fn foretold_s(last_s: f64, last_error: f64, error: f64) -> f64 {
    last_s * (last_error / error).powi(2)
}
