//! Elements as small as interpolation of the direct light asks for: where the interpolant over an element's nodes misses
//! the exact irradiance by more than the tolerance, the element is divided; where it does not, it stays.

use crate::light::Light;
use crate::meshed::{Drawing, Triangles};
use crate::triangulation::Trouble;
use geometry::gather::Scratch;
use geometry::polygon;
use glam::DVec3;
use interchange::report::Report;
use interchange::tool::{STEPS_OF_FALL, progress, show_fall};
use rayon::prelude::*;
use std::collections::HashMap;

/// Places where interpolant and light are compared, as weights of the corners: the centroid, near the corners, near
/// the quarters of the edges.
const TESTS: [[f64; 3]; 7] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.7, 0.15, 0.15],
    [0.15, 0.7, 0.15],
    [0.15, 0.15, 0.7],
    [0.48, 0.26, 0.26],
    [0.26, 0.48, 0.26],
    [0.26, 0.26, 0.48],
];
/// Nodes take the limit from inside their element: they are moved by this part of the way to its centroid.
const INSIDE: f64 = 1e-6;
/// No edge is halved to less than this part of the scene's diagonal: beside an emitter that touches a face, light has
/// no bounded slope, and no mesh would do.
pub const SHORTEST: f64 = 1.0 / 2048.0;
/// Rounds end here at the latest: each halves edges.
const ROUNDS: usize = 60;
/// Triangles that one divided triangle adds at first guess.
const ADDED: f64 = 4.5;
/// One round uses up at most this part of the room left.
const HASTE: f64 = 0.12;
/// Of a triangle only the longest edge is halved, and what is as long but for rounding (Rivara 1984): triangles follow
/// light that changes one way only. Halving all long edges took 1.3 times the error for as many nodes.
const LONG: f64 = 0.999;
/// A budget is used up when this part of it is.
const ENOUGH: f64 = 0.97;

/// Name of the estimate in the report.
pub const INTERPOLATION_ERROR: &str = "largest interpolation error of direct light";

/// How fine.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    /// Largest distance of interpolant and light, as part of the mean light (weighted with the light itself).
    pub tolerance: f64,
    /// Most elements.
    pub most: f64,
    /// Linear over three nodes in place of quadratic over six.
    pub linear: bool,
    /// The scene's diagonal.
    pub diagonal: f64,
}

/// Light on one triangle: nodes, then test places.
type Samples = [f64; 6 + TESTS.len()];

/// A triangle's corners, as bits.
type Key = [[u64; 3]; 3];

/// Divides triangles until the tolerance is met everywhere or the budget is used up; returns the largest error left, as
/// part of the mean light.
pub fn refine(
    light: &Light,
    drawings: &[Drawing],
    meshes: &mut [Triangles],
    wish: Wish,
    report: &mut Report,
) -> Result<f64, (usize, Trouble)> {
    let mut known: HashMap<Key, Samples> = HashMap::new();
    let (mut added, mut divided, mut rounds) = (ADDED, 0, 0);
    let (bar, mut first_worst) = (progress("elements", STEPS_OF_FALL), None);
    let mut worst;
    let mut given_up: std::collections::HashSet<Key> = std::collections::HashSet::new();
    loop {
        let places: Vec<(usize, usize)> = meshes
            .iter()
            .enumerate()
            .flat_map(|(layer, mesh)| mesh.elements().map(move |(t, _)| (layer, t)))
            .collect();
        let corners: Vec<[DVec3; 3]> =
            meshes.iter().flat_map(|mesh| mesh.elements().map(|(_, corners)| corners)).collect();
        let samples: Vec<Samples> = corners
            .par_iter()
            .zip(&places)
            .map_init(Scratch::default, |scratch, (corners, &(layer, _))| {
                let new = || samples(light, corners, drawings[layer].normal(), scratch);
                known.get(&key(corners)).copied().unwrap_or_else(new)
            })
            .collect();
        known = corners.iter().map(key).zip(samples.iter().copied()).collect();
        let (mut power, mut squares) = (0.0, 0.0);
        for (corners, samples) in corners.iter().zip(&samples) {
            let (area, centre) = (polygon::area(corners), samples[6]);
            power += area * centre;
            squares += area * centre * centre;
        }
        let mean = if power > 0.0 { squares / power } else { 1.0 };
        let errors: Vec<Missed> = samples.iter().map(|s| missed(s, wish.linear)).collect();
        worst = errors.iter().map(|missed| missed.most / mean).fold(0.0, f64::max);
        show_fall(&bar, *first_worst.get_or_insert(worst), worst, wish.tolerance);
        let room = wish.most - corners.len() as f64;
        let mut order: Vec<usize> = (0..errors.len())
            .filter(|&k| errors[k].most / mean > wish.tolerance && !given_up.contains(&key(&corners[k])))
            .collect();
        if order.is_empty() || room <= (1.0 - ENOUGH) * wish.most || rounds == ROUNDS {
            break;
        }
        // The order of their parts of the root mean square error.
        let rank: Vec<f64> = corners
            .iter()
            .zip(&errors)
            .map(|(corners, missed)| missed.squares * polygon::area(corners))
            .collect();
        order.sort_by(|&a, &b| rank[b].total_cmp(&rank[a]).then(a.cmp(&b)));
        order.truncate(((HASTE * room / added).ceil() as usize).max(1));
        let mut marked: Vec<Vec<usize>> = vec![Vec::new(); meshes.len()];
        for &k in &order {
            marked[places[k].0].push(places[k].1);
            given_up.insert(key(&corners[k]));
        }
        rounds += 1;
        divided += order.len();
        let shortest = SHORTEST * wish.diagonal;
        meshes.par_iter_mut().zip(drawings).zip(&marked).enumerate().try_for_each(
            |(layer, ((mesh, drawing), marked))| match marked.is_empty() {
                true => Ok(()),
                false => drawing.halve(mesh, marked, LONG, shortest).map(|_| ()).map_err(|t| (layer, t)),
            },
        )?;
        let end: usize = meshes.iter().map(Triangles::count).sum();
        added = (end.saturating_sub(corners.len()) as f64 / order.len() as f64).max(1.0);
    }
    report.count("rounds of refinement for interpolation", rounds);
    report.count("triangles divided for interpolation", divided);
    report.estimate(INTERPOLATION_ERROR, worst);
    Ok(worst)
}

fn samples(light: &Light, corners: &[DVec3; 3], normal: DVec3, scratch: &mut Scratch) -> Samples {
    let [a, b, c] = *corners;
    let centre = (a + b + c) / 3.0;
    let nodes = [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    std::array::from_fn(|k| {
        let point = match nodes.get(k) {
            Some(node) => node.lerp(centre, INSIDE),
            None => {
                let [u, v, w] = TESTS[k - nodes.len()];
                u * a + v * b + w * c
            }
        };
        light.at(point, normal, scratch)
    })
}

/// Value at a place of a triangle from the values at its nodes (corners, then middles of the edges).
pub fn interpolated(nodes: &[f64; 6], [u, v, w]: [f64; 3], linear: bool) -> f64 {
    if linear {
        return u * nodes[0] + v * nodes[1] + w * nodes[2];
    }
    u * (2.0 * u - 1.0) * nodes[0]
        + v * (2.0 * v - 1.0) * nodes[1]
        + w * (2.0 * w - 1.0) * nodes[2]
        + 4.0 * (u * v * nodes[3] + v * w * nodes[4] + w * u * nodes[5])
}

/// What interpolation over one triangle misses at the test places.
struct Missed {
    most: f64,
    squares: f64,
}

fn missed(samples: &Samples, linear: bool) -> Missed {
    let nodes: [f64; 6] = std::array::from_fn(|k| samples[k]);
    let miss = |k: usize| (interpolated(&nodes, TESTS[k], linear) - samples[6 + k]).abs();
    let most = (0..TESTS.len()).map(miss).fold(0.0, f64::max);
    Missed { most, squares: (0..TESTS.len()).map(|k| miss(k) * miss(k)).sum() }
}

fn key(corners: &[DVec3; 3]) -> Key {
    corners.map(|corner| corner.to_array().map(f64::to_bits))
}
