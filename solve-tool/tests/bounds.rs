//! Lower and upper bounds hold and are as narrow as is known; terms of error and who causes them.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Scene, assert_all_close, channel, cube_patches, grey, random, random_scene};
use interchange::matrix::Values;
use solve_tool::bound::{Amplification, perturbed};
use solve_tool::bounds::{self, Bounded, sharpen};
use solve_tool::channels::Channel;
use solve_tool::discretisation::{ElementResidual, Radiosities, TestPoint, residuals_at};
use solve_tool::interval::Spread;
use solve_tool::product::Product;
use solve_tool::solve::{Solver, solve};
use solve_tool::system::System;

fn bounded(scene: &Scene, channels: &[Channel; 3], tolerance: f64, spread: Spread) -> Bounded {
    scene.with_system(|system| {
        let solved = solve(system, channels, Solver::Cg, tolerance).unwrap();
        bounds::find(system, channels, &solved, &[], spread)
    })
}

/// Interval matrices F (1 - d) and F (1 + d) on the cube under a glowing ceiling: known bounds of the floor.
#[test]
fn proportional_bounds_are_those_of_interval_matrices() {
    let table = [
        (0.5, 0.01, 0.178308223, 0.185249855),
        (0.8, 0.01, 0.657302094, 0.724470445),
        (0.9, 0.01, 1.387480877, 1.690360059),
        (0.9, 0.05, 1.006987615, 2.890012171),
    ];
    for (rho, d, lower, upper) in table {
        let scene = Scene { row_errors: vec![d; 6], ..Scene::cube() };
        let channels = grey(&[rho; 6], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let found = bounded(&scene, &channels, 1e-13, Spread::Proportional);
        // The bounds are 1e-7 of their distance wider than the intervals' own.
        let margin = 2e-7 * (upper - lower) + 1e-9;
        let (got_lower, got_upper) = (found.lower[0][4], found.upper[0][4]);
        assert!((got_lower - lower).abs() < margin && got_lower <= lower + 1e-9, "{rho}, {d}: {got_lower}");
        assert!((got_upper - upper).abs() < margin && got_upper >= upper - 1e-9, "{rho}, {d}: {got_upper}");
    }
}

#[test]
fn an_upper_bound_that_cannot_be_is_infinite_never_negative() {
    // rho (1 + d) >= 1.
    for (rho, d) in [(0.9, 0.12), (0.99, 0.02), (0.999, 0.5)] {
        let scene = Scene { row_errors: vec![d; 6], ..Scene::cube() };
        let channels = grey(&[rho; 6], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        for spread in [Spread::Rows, Spread::Proportional] {
            let found = bounded(&scene, &channels, 1e-9, spread);
            assert_eq!(found.upper[0], [f64::INFINITY; 6], "rho {rho}, d {d}, {spread:?}");
            // The lower ones are still numbers, and nothing sends less than it emits.
            assert!(found.lower[0].iter().all(|&b| b >= 0.0 && b.is_finite()), "{:?}", found.lower[0]);
        }
    }
}

/// Arvo, Torrance & Smits's bound for perturbed reflectances, in the sup norm: known values on the cube.
#[test]
fn a_perturbed_reflectance_changes_no_more_than_the_bound() {
    for (rho, change, bound) in [(0.5, 0.00707800, 0.00742189), (0.9, 0.18542439, 0.18832741)] {
        let e = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let of = |rho: f64| Scene::cube().radiosity(&[rho; 6], &e);
        let (before, after) = (of(rho), of(rho + 0.01));
        let moved = (0..6).map(|i| (after[i] - before[i]).abs()).fold(0.0, f64::max);
        // H = (B - E) / rho.
        let brightest = (0..6).map(|i| (before[i] - e[i]) / rho).fold(0.0, f64::max);
        let allowed = perturbed(rho, 0.01, 0.01 * brightest);
        assert!((moved - change).abs() < 5e-9, "rho {rho}: moved {moved}");
        assert!((allowed - bound).abs() < 5e-9 && moved <= allowed, "rho {rho}: bound {allowed}");
    }
    assert_eq!(perturbed(0.99, 0.02, 0.1), f64::INFINITY);
}

/// In a closed room of one reflectance with a residual of one sign the power norm's bound is an equality.
#[test]
fn the_solvers_bound_is_an_equality_in_a_furnace() {
    let scene = Scene::cube_grid(4);
    let rho = vec![0.7; 96];
    let e: Vec<f64> = (0..96).map(|i| if i < 4 { 1.0 } else { 0.0 }).collect();
    let exact = scene.radiosity(&rho, &e);
    scene.with_system(|system| {
        let seen = system.product.apply(&[&rho]).swap_remove(0);
        let factor = Amplification::from_norm(system.areas, &rho, &seen).factor;
        let mut b = e.clone();
        for step in 1..6 {
            let next: Vec<f64> = {
                let h = system.product.apply(&[&b]).swap_remove(0);
                (0..96).map(|i| e[i] + rho[i] * h[i] / system.areas[i]).collect()
            };
            let power =
                |f: &dyn Fn(usize) -> f64| -> f64 { (0..96).map(|i| system.areas[i] * f(i).abs()).sum() };
            let bound = factor * power(&|i| next[i] - b[i]);
            let error = power(&|i| exact[i] - b[i]);
            assert!((bound - error).abs() < 1e-10 * error, "step {step}: bound {bound}, error {error}");
            b = next;
        }
    });
}

/// Changes the entries of S, keeping it symmetric and at least 0, by amounts with known row sums.
fn perturb(scene: &Scene, size: f64, concentrated: bool, seed: u64) -> (Scene, Vec<f64>) {
    let mut next = random(seed);
    let n = scene.len();
    let mut exchange = scene.exchange.clone();
    for (i, j) in (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))) {
        // Everywhere a little, or in few entries much.
        let off = if concentrated && next() < 0.9 { 0.0 } else { size * (2.0 * next() - 1.0) };
        let entry = (exchange[i][j] * (1.0 + off)).max(0.0);
        exchange[i][j] = entry;
        exchange[j][i] = entry;
    }
    let errors = (0..n)
        .map(|i| (0..n).map(|j| (exchange[i][j] - scene.exchange[i][j]).abs()).sum::<f64>() / scene.areas[i])
        .collect();
    (Scene { exchange, ..scene.clone() }, errors)
}

/// 200 scenes whose matrix is off by a known amount: the true radiosity lies between the bounds in every element of
/// every one, however loosely the system was solved.
#[test]
fn the_truth_lies_between_the_bounds_in_200_random_scenes() {
    let (mut elements, mut infinite) = (0, 0);
    let mut ratios: Vec<f64> = Vec::new();
    for seed in 0..200u64 {
        let mut next = random(1000 + seed);
        let n = 5 + (next() * 40.0) as usize;
        let truth = random_scene(n, 0.4 + 0.6 * next(), seed);
        let size = 10f64.powf(-4.0 * next());
        let (wrong, errors) = perturb(&truth, 0.5 * size, seed % 2 == 0, seed);
        let wrong = Scene { row_errors: errors, ..wrong };
        let rho: Vec<f64> = (0..n).map(|_| if next() < 0.15 { 0.0 } else { 0.95 * next() }).collect();
        let e: Vec<f64> = (0..n).map(|i| if i == 0 || next() < 0.1 { 10.0 * next() } else { 0.0 }).collect();
        let exact = truth.radiosity(&rho, &e);
        let tolerance = 10f64.powf(-1.0 - 8.0 * next());
        let channels = grey(&rho, &e);
        let solved = wrong.solve(&channels, Solver::Cg, tolerance).unwrap();
        let found = wrong.with_system(|system| bounds::find(system, &channels, &solved, &[], Spread::Rows));
        for (i, exact) in exact.iter().enumerate() {
            let (lower, upper) = (found.lower[0][i], found.upper[0][i]);
            assert!(
                lower <= *exact && *exact <= upper,
                "scene {seed}, element {i}: {lower} <= {} <= {upper}",
                *exact
            );
            elements += 1;
            infinite += usize::from(upper.is_infinite());
        }
        // Bound and truth in the power norm.
        let b = &solved.channels[0].radiosity;
        let power = |f: &dyn Fn(usize) -> f64| -> f64 { (0..n).map(|i| truth.areas[i] * f(i)).sum() };
        let off = power(&|i| (b[i] - exact[i]).abs());
        let bound = power(&|i| (found.upper[0][i] - b[i]).max(b[i] - found.lower[0][i]));
        assert!(off <= bound);
        if bound.is_finite() && off > 0.0 {
            ratios.push(bound / off);
        }
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "{elements} elements, {infinite} without upper bound; bound / true error in the power norm: least {:.2}, median \
         {:.2}, largest {:.2}",
        ratios[0],
        ratios[ratios.len() / 2],
        ratios[ratios.len() - 1]
    );
    assert!(infinite * 20 < elements, "{infinite} of {elements}");
    assert!(ratios[ratios.len() / 2] < 30.0, "median {}", ratios[ratios.len() / 2]);
}

/// A matrix without symmetry has bounds too, the budget of a row filled with the brightest element alone.
#[test]
fn bounds_hold_without_symmetry() {
    let scene = random_scene(25, 0.9, 3);
    let mut next = random(5);
    let skew: Vec<f64> = (0..25).map(|_| 0.8 + 0.2 * next()).collect();
    let wrong: Vec<f64> = (0..25).map(|_| 1.0 + 0.01 * (2.0 * next() - 1.0)).collect();
    let entries = |factor: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        (0..625).map(|k| scene.exchange[k / 25][k % 25] * skew[k / 25] * factor(k / 25, k % 25)).collect()
    };
    let blocks = [interchange::matrix::Block::new(interchange::matrix::BlockKind::Dense, 0..25, 0..25, 0)];
    let system_of = |values: &[f64], errors: &[f64], use_it: &mut dyn FnMut(&System<'_>)| {
        let product = Product::from_blocks(25, false, &blocks, Values::F64(values));
        use_it(&System::from_parts(product, &scene.areas, errors, 0.0));
    };
    let channels = grey(&[0.7; 25], &[1.0; 25]);
    let mut exact = Vec::new();
    system_of(&entries(&|_, _| 1.0), &[0.0; 25], &mut |system| {
        exact.clone_from(&solve(system, &channels, Solver::Gmres, 1e-13).unwrap().channels[0].radiosity);
    });
    system_of(&entries(&|i, j| if (i + j) % 2 == 0 { wrong[i] } else { 1.0 }), &[0.011; 25], &mut |system| {
        let solved = solve(system, &channels, Solver::Auto, 1e-6).unwrap();
        let found = bounds::find(system, &channels, &solved, &[], Spread::Rows);
        for (i, &exact) in exact.iter().enumerate() {
            assert!(found.lower[0][i] <= exact && exact <= found.upper[0][i], "{i}");
            assert!(found.upper[0][i] < 1.2 * found.lower[0][i], "{i}");
        }
    });
}

/// Errors of the matrix as importance and the rows see them, against the norms' answer: never more, and where the
/// bright surface is small much less.
#[test]
fn importance_sharpens_the_matrix_error() {
    // One bright element among many dark ones, which all shine: few of the errors can lie where they are amplified.
    let n = 40;
    let truth = random_scene(n, 1.0, 17);
    let (wrong, errors) = perturb(&truth, 1e-3, false, 6);
    let wrong = Scene { row_errors: errors, ..wrong };
    let rho: Vec<f64> = (0..n).map(|i| if i == 3 { 0.99 } else { 0.1 }).collect();
    let e = vec![1.0; n];
    let channels = grey(&rho, &e);
    let exact = truth.radiosity(&rho, &e);
    wrong.with_system(|system| {
        let solved = solve(system, &channels, Solver::Cg, 1e-12).unwrap();
        let mut sharper = solved.channels[0].clone();
        assert!(sharpen(system, &channels[0], &mut sharper) < 20);
        let (plain, sharp) = (solved.channels[0].matrix_error, sharper.matrix_error);
        let b = &solved.channels[0].radiosity;
        let power = |f: &dyn Fn(usize) -> f64| -> f64 { (0..n).map(|i| truth.areas[i] * f(i)).sum() };
        let true_error = power(&|i| (b[i] - exact[i]).abs()) / power(&|i| exact[i]);
        println!(
            "true {true_error:.2e}, by importance {:.2e}, by norms {:.2e}",
            sharp.relative, plain.relative
        );
        assert!(true_error < sharp.relative && sharp.relative < 0.5 * plain.relative);
        assert!((sharp.amplification * sharp.row_error / sharp.relative - 1.0).abs() < 1e-12);
    });
}

/// Discretisation residual of the cube at rho = 0.5, sampled at 0.05, 0.5 and 0.95 of the floor's and a wall's elements:
/// known values. The mean halves with the size; the largest does not fall.
#[test]
fn discretisation_residuals_are_as_known() {
    let places = [0.05, 0.5, 0.95];
    for (n, sup, mean) in [(2, 0.0855, 0.0242), (4, 0.0665, 0.0133), (8, 0.0576, 0.0070)] {
        let scene = Scene::cube_grid(n);
        let per_face = n * n;
        let e: Vec<f64> = (0..scene.len()).map(|i| if i / per_face == 5 { 1.0 } else { 0.0 }).collect();
        let b = scene.radiosity(&vec![0.5; scene.len()], &e);
        let points = |corners: &[glam::DVec3]| -> Vec<TestPoint> {
            let (u, v) = (corners[1] - corners[0], corners[3] - corners[0]);
            let at = |s: f64, t: f64| TestPoint { position: corners[0] + s * u + t * v, weight: 1.0 / 9.0 };
            places.iter().flat_map(|&s| places.iter().map(move |&t| (s, t))).map(|(s, t)| at(s, t)).collect()
        };
        let elements = cube_patches(n).into_iter().map(|patch| patch.corners).collect();
        let thrice = |values: &[f64]| -> Vec<[f64; 3]> { values.iter().map(|&x| [x; 3]).collect() };
        let (rho, exitance, radiosity) = (thrice(&vec![0.5; b.len()]), thrice(&e), thrice(&b));
        let of = Radiosities { reflectance: &rho, exitance: &exitance, radiosity: &radiosity };
        let found = residuals_at(elements, Vec::new(), points, of);
        // Floor z=0 is face 4, the wall x=0 face 0.
        let sampled = found[..per_face].iter().chain(&found[4 * per_face..5 * per_face]);
        let sampled: Vec<&ElementResidual> = sampled.collect();
        let largest = sampled.iter().map(|r| r.largest[1]).fold(0.0, f64::max);
        let average = sampled.iter().map(|r| r.power[1]).sum::<f64>() / sampled.len() as f64;
        println!("n {n}: sup {largest:.4} (known {sup}), mean {average:.4} (known {mean})");
        assert!((largest - sup).abs() < 1e-4 && (average - mean).abs() < 1e-4, "n {n}: {largest} {average}");
    }
}

/// Who causes the error: the row that is off, and the link between bright and important.
#[test]
fn the_ranking_names_the_cause() {
    let mut scene = Scene::cube_grid(2);
    scene.row_errors[9] = 1e-3;
    scene.row_errors[17] = 1e-4;
    let e: Vec<f64> = (0..24).map(|i| if i >= 20 { 1.0 } else { 0.0 }).collect();
    let channels = [channel(&[0.5; 24], &e), channel(&[0.5; 24], &[0.0; 24]), channel(&[0.3; 24], &e)];
    let residuals: Vec<ElementResidual> = (0..24)
        .map(|i| ElementResidual { power: [if i == 4 { 1e-6 } else { 0.0 }; 3], largest: [0.0; 3] })
        .collect();
    let found = scene.with_system(|system| {
        let solved = solve(system, &channels, Solver::Cg, 1e-13).unwrap();
        bounds::find(system, &channels, &solved, &residuals, Spread::Rows)
    });
    assert_eq!(found.ranking[..2], [9, 17]);
    let mut all = found.ranking.clone();
    all.sort_unstable();
    assert_eq!(all, (0..24).collect::<Vec<u32>>());
    // Importance is 1 / (1 - rho) in a closed room of one reflectance: 2 and 1 / 0.7.
    let sampled = found.element_errors[4][2];
    assert!((sampled - 1e-6 * (2.0 + 1.0 / 0.7)).abs() < 0.02e-6, "{sampled:e}");
    assert!(found.element_errors[5][2] == 0.0);
    let links = &found.links;
    assert!(links.windows(2).all(|pair| pair[0].error >= pair[1].error) && links.len() <= 276);
    // An entry is known twice, so it is as good as the better of its two rows.
    assert_eq!((links[0].first, links[0].second), (9, 17));
    let terms = found.terms[1];
    assert_eq!((terms.matrix.power, terms.solver.power, terms.discretisation.sup), (0.0, 0.0, 0.0));
    assert_all_close(&found.upper[1], &[0.0; 24], 0.0);
}
