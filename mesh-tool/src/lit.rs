//! Elements spent where light changes: triangles that a constant describes badly are made smaller, round by round.
//!
//! The element means of a solution smear light over an element. So the indicator of a triangle is the mean distance
//! of its light from the mean, relative to the light there (a point in the dark counts as one in the light), times a
//! power of its area. Of all indicators the largest that make up a fixed part of the sum are refined (Doerfler 1996).

use crate::light::{Irradiance, Light, Lit};
use crate::meshed::{Drawing, Triangles};
use crate::triangulation::Trouble;
use geometry::gather::Scratch;
use geometry::polygon;
use glam::DVec3;
use interchange::report::Report;
use interchange::tool::{STEPS_OF_FALL, progress, show_fall};
use rayon::prelude::*;
use std::collections::HashMap;

/// Part of the sum of the indicators that one round refines.
const PART: f64 = 0.4;
/// Triangles that one refined triangle adds at first guess: three of its own, and its neighbours' share. After each
/// round the number measured is used.
const ADDED: f64 = 4.5;
/// One round uses up at most this part of the room left, or what is missing to the last few: later ones know better.
const HASTE: f64 = 0.5;
/// Rounds end here at the latest.
const ROUNDS: usize = 30;
/// No more rounds when this part of the wished count is there: steps would be too small to matter.
const ENOUGH: f64 = 0.97;
/// No edge is halved to less than this part of that of as many equal triangles.
pub const SHORTEST: f64 = 1.0 / 64.0;
/// Of a triangle to be made smaller all edges at least this part of the longest are halved: a strip stays one wide.
pub const LONG: f64 = 0.6;
/// Light below this part of the scene's mean counts like it.
const DARK: f64 = 0.05;
/// Power of the area: below 1, for what counts is also how deep light is smeared, not only over how much area.
const AREA_POWER: f64 = 0.75;
/// Light that bounces so often is in the first estimate.
const BOUNCES: usize = 2;
/// Indicators are rounded to this many bits, so that rounding does not choose between equal ones.
const BITS: u32 = 20;

type Key = [u64; 9];

/// Makes the triangles of `meshes` smaller where light changes, until there are about `wanted`. `spacing` is that of
/// as many equal triangles. Errors name the layer.
pub fn refine(
    light: &Light,
    drawings: &[Drawing],
    meshes: &mut [Triangles],
    wanted: f64,
    spacing: f64,
    report: &mut Report,
) -> Result<(), (usize, Trouble)> {
    let mut known: HashMap<Key, Irradiance> = HashMap::new();
    let (mut refined, mut points, mut before, mut rounds) = (0, 0, None, 0);
    let (bar, mut first_room) = (progress("elements", STEPS_OF_FALL), None);
    let mut added = ADDED;
    let mut after;
    let mut blocked: std::collections::HashSet<Key> = std::collections::HashSet::new();
    loop {
        let places: Vec<(usize, usize)> = meshes
            .iter()
            .enumerate()
            .flat_map(|(layer, mesh)| mesh.elements().map(move |(t, _)| (layer, t)))
            .collect();
        let triangles: Vec<Lit> = meshes
            .iter()
            .zip(drawings)
            .flat_map(|(mesh, drawing)| mesh.elements().map(|(_, corners)| lit(drawing, corners)))
            .collect();
        let new = triangles.iter().filter(|lit| !known.contains_key(&key(&lit.corners))).count();
        points += new * crate::light::POINTS;
        let irradiance = shine(light, &triangles, &known);
        known = triangles.iter().zip(&irradiance).map(|(lit, &light)| (key(&lit.corners), light)).collect();

        let areas: Vec<f64> = triangles.iter().map(|lit| polygon::area(&lit.corners)).collect();
        let whole: f64 = areas.iter().sum();
        let mean =
            areas.iter().zip(&irradiance).map(|(area, light)| area * light.mean()).sum::<f64>() / whole;
        let indicators: Vec<f64> = areas
            .iter()
            .zip(&irradiance)
            .map(|(area, light)| {
                let relative = light.deviation() / (light.mean() + DARK * mean).max(f64::MIN_POSITIVE);
                rounded((area / whole).powf(AREA_POWER) * relative)
            })
            .collect();
        let deviation = areas.iter().zip(&irradiance).map(|(area, light)| area * light.deviation());
        after = deviation.sum::<f64>() / (whole * mean).max(f64::MIN_POSITIVE);
        before.get_or_insert(after);
        let room = wanted - triangles.len() as f64;
        show_fall(&bar, *first_room.get_or_insert(room), room, (1.0 - ENOUGH) * wanted);
        if room <= (1.0 - ENOUGH) * wanted || rounds == ROUNDS {
            break;
        }

        // Mark the largest, as many as there is room for.
        let mut order: Vec<usize> = (0..triangles.len())
            .filter(|&k| indicators[k] > 0.0 && !blocked.contains(&key(&triangles[k].corners)))
            .collect();
        order.sort_by(|&i, &j| indicators[j].total_cmp(&indicators[i]).then(i.cmp(&j)));
        let sum: f64 = order.iter().map(|&k| indicators[k]).sum();
        let mut marked: Vec<Vec<usize>> = vec![Vec::new(); meshes.len()];
        let (mut part, mut count) = (0.0, 0u32);
        for k in order {
            if part >= PART * sum || f64::from(count) * added >= HASTE * room {
                break;
            }
            part += indicators[k];
            count += 1;
            marked[places[k].0].push(places[k].1);
            blocked.insert(key(&triangles[k].corners));
        }
        if count == 0 {
            break;
        }
        refined += count as usize;
        let start = triangles.len();
        rounds += 1;
        meshes.par_iter_mut().zip(drawings).zip(&marked).enumerate().try_for_each(
            |(layer, ((mesh, drawing), marked))| {
                if marked.is_empty() {
                    return Ok(());
                }
                drawing
                    .halve(mesh, marked, LONG, SHORTEST * spacing)
                    .map_err(|trouble| (layer, trouble))
                    .map(|_| ())
            },
        )?;
        let end: usize = meshes.iter().map(Triangles::count).sum();
        added = (end.saturating_sub(start) as f64 / f64::from(count)).max(1.0);
    }
    report.count("rounds of refinement for light", rounds);
    report.count("triangles refined for light", refined);
    report.count("points of direct light", points);
    report.estimate("deviation of light within elements before", before.unwrap_or(0.0));
    report.estimate("deviation of light within elements", after);
    Ok(())
}

/// Light on all triangles; computed for those that are not known yet.
fn shine(light: &Light, triangles: &[Lit], known: &HashMap<Key, Irradiance>) -> Vec<Irradiance> {
    let old: Vec<Option<Irradiance>> =
        triangles.iter().map(|lit| known.get(&key(&lit.corners)).copied()).collect();
    let mut irradiance: Vec<Irradiance> = triangles
        .par_iter()
        .zip(&old)
        .map_init(Scratch::default, |scratch, (lit, old)| {
            let new = || Irradiance { direct: light.direct(lit, scratch), ..Irradiance::default() };
            old.unwrap_or_else(new)
        })
        .collect();
    let bounces = if known.is_empty() { BOUNCES } else { 1 };
    for _ in 0..bounces {
        let radiosity: Vec<f64> = irradiance.iter().map(Irradiance::mean).collect();
        let indirect = light.indirect(triangles, &radiosity, |k| old[k].is_none());
        for (irradiance, indirect) in irradiance.iter_mut().zip(indirect) {
            irradiance.indirect = indirect.unwrap_or(irradiance.indirect);
        }
    }
    irradiance
}

fn lit(drawing: &Drawing, corners: [DVec3; 3]) -> Lit {
    let layer = drawing.layer();
    let normal = layer.frame.plane.normal;
    let [a, b, c] = corners;
    if layer.reversed { Lit { corners: [a, c, b], normal: -normal } } else { Lit { corners, normal } }
}

fn key(corners: &[DVec3; 3]) -> Key {
    let mut bits = [0; 9];
    for (bits, value) in bits.iter_mut().zip(corners.iter().flat_map(|c| c.to_array())) {
        *bits = value.to_bits();
    }
    bits
}

fn rounded(value: f64) -> f64 {
    let unit = 1u64 << (f64::MANTISSA_DIGITS - 1 - BITS);
    f64::from_bits((value.to_bits() + unit / 2) / unit * unit)
}
