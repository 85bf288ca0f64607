//! Light by how often it was reflected: layers of a picture out of bounce-limited solutions.
//!
//! A solution after j reflections, gathered once more, lights the picture with j + 1: the partial sums of Neumann's series.
//! So the solutions after 0 to k - 1 reflections give the layers `bounces.1` to `bounces.k`, with all the care that the
//! picture itself has, and `bounces.0` shows the lamps alone.

use crate::command_line::SceneArguments;
use crate::error::{Error, Result};
use crate::facets::Drawn;
use crate::lit_scene::LitScene;
use interchange::report::Report;
use interchange::solution::Solution;
use std::path::{Path, PathBuf};

/// The scene in the dark but for its lamps, then with the light of each solution; solutions come in order of their bounces.
pub fn scenes(
    solutions: &[PathBuf],
    arguments: &SceneArguments,
    drawn: Drawn,
    report: &mut Report,
) -> Result<Vec<LitScene>> {
    let mut scenes = Vec::new();
    for (bounces, path) in solutions.iter().enumerate() {
        check(path, bounces)?;
        let materials = arguments.materials.as_deref();
        if bounces == 0 {
            let mut dark = LitScene::read(path, &arguments.mesh, materials, drawn, report)?;
            dark.radiosity.iter_mut().for_each(|b| *b = [0.0; 3]);
            scenes.push(dark);
        }
        scenes.push(LitScene::read(path, &arguments.mesh, materials, drawn, report)?);
    }
    Ok(scenes)
}

/// Refuses a solution that is not the one after so many bounces.
fn check(path: &Path, bounces: usize) -> Result<()> {
    let solver = Solution::read(path)?.0.summary.solver;
    if solver == format!("partial sum of {bounces} bounces") {
        return Ok(());
    }
    Err(Error::Bounces {
        path: path.into(),
        found: format!("is a solution by: {solver}"),
        remedy: format!("give the one by solve-tool solve --bounces {bounces} in this place"),
    })
}
