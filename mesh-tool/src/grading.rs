//! Grading of all planes together: each is graded, then planes are made to meet, which splits edges, until both hold.

use crate::conform;
use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use crate::search::count;
use crate::triangulation::Trouble;
use rayon::prelude::*;

/// Rounds end here at the latest. Edges that several planes share are halved in the same places, so that few are needed.
const ROUNDS: usize = 12;

/// Grades sizes, if that leaves no more than `most` triangles: a number of elements is a budget, and light comes first. Otherwise all
/// stays as it is. Errors name the layer; says whether all is graded.
pub fn grade_within(
    drawings: &[Drawing],
    meshes: &mut Vec<Triangles>,
    shortest: f64,
    places: Option<&Places>,
    most: f64,
) -> Result<bool, (usize, Trouble)> {
    // Every triangle that is too large takes one more at least.
    let uneven = |meshes: &[Triangles]| meshes.iter().map(Triangles::uneven).sum::<usize>();
    let needed = uneven(meshes);
    if needed == 0 || (count(meshes) + needed) as f64 > most {
        return Ok(needed == 0);
    }
    let mut graded = meshes.clone();
    grade(drawings, &mut graded, Some(shortest), places)?;
    let fits = count(&graded) as f64 <= most;
    let all = fits && uneven(&graded) == 0;
    if fits {
        *meshes = graded;
    }
    Ok(all)
}

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
