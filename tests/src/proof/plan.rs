//! Which cases are run, in which order, with which flags.
//!
//! What the pipeline does by default comes first, on all scenes at all errors, then the other methods and meshes; in both,
//! coarse errors of all scenes before finer ones. A run that is stopped early has the default measured, and of the rest
//! everything a little. Along a curve (scene, method, mesh) the cost is foretold from the last case: halving the error is taken
//! to cost four times as much; a case foretold or seen to exceed the budget is recorded as not run, and so are all finer ones.

use super::boxes;
use std::path::{Path, PathBuf};

/// Asked errors.
pub const ERRORS: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
/// Scenes with surfaces and a camera: the whole pipeline. The slowest is last.
pub const SCENES: [&str; 5] = ["cornell_empty", "goral_cube", "penumbra", "cornell_blocks", "room"];
/// Scenes with occlusion and several bounces of light, on which waste is judged.
pub const OCCLUDED: [&str; 2] = ["cornell_blocks", "room"];
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

    /// Whether this is what the pipeline does when only `ERROR` is given.
    pub fn by_default(&self) -> bool {
        self.method == "auto" && matches!(self.mesh, "discontinuity" | "given")
    }

    /// Seconds on the clock the case may take where one of a small scene may take `base`. The room's 566 faces need as many
    /// elements at 0.1 as others at 0.01: its default runs get twenty times as much, those of the mesh nearest to that eight times.
    pub fn budget_s(&self, base: f64) -> f64 {
        match (self.scene.as_str(), self.method, self.mesh) {
            ("room", "auto", "discontinuity") => 20.0 * base,
            ("room", "auto", "adaptive") => 8.0 * base,
            _ => base,
        }
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
    let mut cases: Vec<Case> = Vec::new();
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
    // A stable sort: the order by errors stays.
    cases.sort_by_key(|case| !case.by_default());
    cases
}

/// The error at which the pipeline makes the reference of a scene: half the least that is measured. The room would take half an
/// hour at that; it gets the finest that leaves the whole its 40 minutes.
pub fn reference_error(scene: &str) -> f64 {
    if scene == "room" { 0.005 } else { 0.001 }
}

/// Radiance above which a pixel sees a lamp.
pub fn lamp(scene: &str) -> f64 {
    if scene == "room" { 4.0 } else { 1.5 }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_comes_first_on_all_scenes_then_coarse_before_fine() {
        let cases = cases(&scenes(), &ERRORS);
        let default = scenes().len() * ERRORS.len();
        assert!(cases[..default].iter().all(Case::by_default));
        assert!(!cases[default..].iter().any(Case::by_default));
        for part in [&cases[..default], &cases[default..]] {
            assert!(part.windows(2).all(|pair| pair[0].error >= pair[1].error));
        }
        assert_eq!(cases.len(), 5 * 7 * 6 + 9 * 5 * 6);
    }

    #[test]
    fn only_the_room_has_more_than_the_budget() {
        for case in cases(&scenes(), &ERRORS) {
            let more = case.scene == "room" && case.method == "auto" && case.mesh != "uniform";
            assert_eq!(case.budget_s(15.0) > 15.0, more, "{case:?}");
        }
    }
}
