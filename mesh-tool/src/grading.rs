//! Grading of all planes together: each is graded, then planes are made to meet, which splits edges, until both hold.

use crate::conform;
use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use crate::triangulation::Trouble;
use rayon::prelude::*;

/// Rounds end here at the latest. Edges that several planes share are halved in the same places, so that few are needed.
const ROUNDS: usize = 12;

/// Makes planes meet, if `places` are given, and grades all: no edge is halved to less than `shortest`, in units of length.
/// Where that is `None`, sizes stay as they are. Errors name the layer; returns how many planes could not be made to meet.
pub fn grade(
    drawings: &[Drawing],
    meshes: &mut [Triangles],
    shortest: Option<f64>,
    places: Option<&Places>,
) -> Result<usize, (usize, Trouble)> {
    let meet = |meshes: &mut [Triangles]| places.map_or(0, |places| conform::meet(drawings, meshes, places));
    let mut tangled = meet(meshes);
    let Some(shortest) = shortest else { return Ok(tangled) };
    for _ in 0..ROUNDS {
        let layers = meshes.par_iter_mut().zip(drawings).enumerate();
        let graded: Vec<bool> = layers
            .map(|(layer, (mesh, drawing))| drawing.grade(mesh, shortest).map_err(|trouble| (layer, trouble)))
            .collect::<Result<_, _>>()?;
        if !graded.contains(&true) {
            break;
        }
        tangled = meet(meshes);
    }
    Ok(tangled)
}
