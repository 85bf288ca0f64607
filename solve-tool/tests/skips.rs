//! Work that is left out: the answer stays, the counter counts, and where nothing can be left out it is zero.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Scene, assert_all_close, channel, grey, random, random_scene};
use solve_tool::channels::Channel;
use solve_tool::skips::{Skip, Skips};
use solve_tool::solve::{Options, Solved, Solver};

const TOLERANCE: f64 = 1e-10;

fn solve(scene: &Scene, channels: &[Channel; 3], solver: Solver, done: &[Skip]) -> Solved {
    let skips = Skips { done: done.to_vec() };
    scene.solve_with(channels, &Options { skips, ..Options::new(solver, TOLERANCE) }).unwrap()
}

/// With and without the work left out: both answers are within the tolerance, which is relative to the emitted power.
#[track_caller]
fn assert_same(scene: &Scene, channels: &[Channel; 3], skip: Skip) -> (Solved, Solved) {
    for solver in [Solver::Cg, Solver::Direct, Solver::Jacobi, Solver::GaussSeidel, Solver::Gmres] {
        let (with, without) = (solve(scene, channels, solver, &[]), solve(scene, channels, solver, &[skip]));
        for ((a, b), given) in with.channels.iter().zip(&without.channels).zip(channels) {
            let emitted: f64 = given.emitted(&scene.areas).max(1e-300);
            let apart: f64 =
                (0..scene.len()).map(|i| scene.areas[i] * (a.radiosity[i] - b.radiosity[i]).abs()).sum();
            assert!(apart <= 2.0 * TOLERANCE * emitted, "{solver:?}, {skip:?}: {:e}", apart / emitted);
        }
    }
    (solve(scene, channels, Solver::Cg, &[]), solve(scene, channels, Solver::Cg, &[skip]))
}

/// Rooms that see nothing of each other.
fn rooms(sizes: &[usize], most: f64) -> Scene {
    let rooms: Vec<Scene> = sizes.iter().zip(1..).map(|(&n, seed)| random_scene(n, most, seed)).collect();
    let n: usize = sizes.iter().sum();
    let mut exchange = vec![vec![0.0; n]; n];
    let (mut areas, mut start) = (Vec::new(), 0);
    for room in rooms {
        for i in 0..room.len() {
            exchange[start + i][start..start + room.len()].copy_from_slice(&room.exchange[i]);
        }
        start += room.len();
        areas.extend(room.areas);
    }
    Scene { row_errors: vec![0.0; n], areas, exchange }
}

#[test]
fn unlit_rooms_are_dark_without_work() {
    let scene = rooms(&[30, 40, 50], 1.0);
    let e: Vec<f64> = (0..120).map(|i| if i == 3 { 1.0 } else { 0.0 }).collect();
    let (with, without) = assert_same(&scene, &grey(&[0.6; 120], &e), Skip::UnlitComponents);
    assert_eq!(with.counter("components"), 3);
    assert_eq!(with.counter("elements no light can reach"), 90);
    assert!(with.counter("entries left out of a step") > 0);
    assert_eq!(with.channels[0].radiosity[30..], [0.0; 90]);
    assert!(with.counter("entries left out of a step") > without.counter("entries left out of a step"));
    // One lit room: nothing.
    let one = rooms(&[40], 1.0);
    let solved = solve(&one, &grey(&[0.6; 40], &[1.0; 40]), Solver::Cg, &[]);
    assert_eq!(solved.counter("elements no light can reach"), 0);
    assert_eq!(solved.counter("entries left out of a step"), 0);
}

#[test]
fn a_room_lit_in_one_channel_only_is_dark_in_the_others() {
    let scene = rooms(&[20, 20], 1.0);
    let only = |element: usize| -> Channel {
        channel(&[0.5; 40], &(0..40).map(|i| if i == element { 1.0 } else { 0.0 }).collect::<Vec<_>>())
    };
    let (with, _) =
        assert_same(&scene, &[only(0), only(25), channel(&[0.5; 40], &[0.0; 40])], Skip::UnlitComponents);
    assert_eq!(with.channels[0].radiosity[20..], [0.0; 20]);
    assert_eq!(with.channels[1].radiosity[..20], [0.0; 20]);
    assert!(with.channels[1].radiosity[20..].iter().all(|&b| b > 0.0));
    assert_eq!(with.counter("dark channels"), 1);
}

#[test]
fn rooms_are_solved_apart() {
    // A bright room and a dark one: apart, the dark one does not wait for the bright one's bound.
    let scene = rooms(&[40, 60], 1.0);
    let rho: Vec<f64> = (0..100).map(|i| if i < 40 { 0.99 } else { 0.1 }).collect();
    let (with, without) = assert_same(&scene, &grey(&rho, &[1.0; 100]), Skip::ComponentsApart);
    assert_eq!((with.counter("parts solved apart"), without.counter("parts solved apart")), (2, 1));
    // The bright room's 1 / (1 - 0.99) does not reach the dark one: rounding, which alone is wrong here, counts less.
    let amplification = |solved: &Solved| solved.channels[0].matrix_error.amplification;
    assert!(amplification(&with) < amplification(&without), "{}", amplification(&with));
    // More rooms than parts: the smallest share one.
    let many = Scene::new(vec![1.0; 160], |i, j| if i != j && i / 2 == j / 2 { 1.0 } else { 0.0 });
    let e: Vec<f64> = (0..160).map(|i| if i % 2 == 0 { 1.0 + i as f64 } else { 0.0 }).collect();
    let solved = solve(&many, &grey(&[0.5; 160], &e), Solver::Cg, &[]);
    assert_eq!((solved.counter("components"), solved.counter("parts solved apart")), (80, 64));
    // B1 = E / (1 - 1/4), B2 = B1 / 2; the bound is relative to all that is emitted, 6400.
    let want: Vec<f64> = (0..160).map(|i| e[i - i % 2] / 0.75 / (1.0 + (i % 2) as f64)).collect();
    assert_all_close(&solved.channels[0].radiosity, &want, 6400.0 * TOLERANCE);
}

#[test]
fn channels_that_differ_by_a_factor_are_solved_once() {
    let scene = random_scene(50, 1.0, 9);
    let mut next = random(4);
    let (rho, e): (Vec<f64>, Vec<f64>) = (0..50).map(|_| (0.8 * next(), next())).unzip();
    let scaled = |factor: f64| channel(&rho, &e.iter().map(|e| factor * e).collect::<Vec<_>>());
    let channels = [scaled(1.0), scaled(0.3), scaled(1.7)];
    let (with, without) = assert_same(&scene, &channels, Skip::EqualChannels);
    assert_eq!((with.counter("distinct channels"), without.counter("distinct channels")), (1, 3));
    for i in 0..50 {
        let [red, green, blue] = [0, 1, 2].map(|c| with.channels[c].radiosity[i]);
        assert!(
            (green - 0.3 * red).abs() < 1e-14 && (blue - 1.7 * red).abs() < 1e-14,
            "{red} {green} {blue}"
        );
    }
    assert!((with.channels[2].energy.emitted - 1.7 * with.channels[0].energy.emitted).abs() < 1e-10);
    assert!(with.channels[2].energy.defect < 1e-9);
    // Another reflectance, or light of another shape, is another channel.
    let mut other = channels.clone();
    other[1].reflectance[7] += 1e-9;
    other[2].exitance[7] *= 1.0 + 1e-12;
    assert_eq!(solve(&scene, &other, Solver::Cg, &[]).counter("distinct channels"), 3);
}

#[test]
fn black_rows_cost_nothing() {
    // The second half reflects nothing, two of them shine: only the first half exchanges light again and again.
    let scene = random_scene(200, 1.0, 13);
    let rho: Vec<f64> = (0..200).map(|i| if i < 100 { 0.9 } else { 0.0 }).collect();
    let e: Vec<f64> = (0..200).map(|i| if i == 150 || i == 151 { 1.0 } else { 0.0 }).collect();
    let (with, without) = assert_same(&scene, &grey(&rho, &e), Skip::BlackRows);
    // Rows 100 to 199 of the stored triangle: 100 * 101 / 2 entries.
    assert_eq!(with.counter("entries left out of a step"), 5050);
    assert_eq!(without.counter("entries left out of a step"), 0);
    assert_eq!(with.counter("rows without reflectance red"), 100);
    assert!(with.channels[0].irradiance[100..].iter().all(|&h| h > 0.0), "black elements are lit too");
    // What is left out was multiplied with 0: the same bits.
    assert_eq!(with.channels[0].irradiance, without.channels[0].irradiance);
    assert_eq!(
        solve(&scene, &grey(&[0.5; 200], &e), Solver::Cg, &[]).counter("entries left out of a step"),
        0
    );
}

#[test]
fn no_more_products_than_the_bound_asks() {
    let scene = Scene::cube_grid(4);
    let e: Vec<f64> = (0..96).map(|i| if i < 4 { 1.0 } else { 0.0 }).collect();
    let channels = grey(&[0.8; 96], &e);
    let products = |tolerance: f64, done: &[Skip]| {
        let skips = Skips { done: done.to_vec() };
        let options = Options { skips, ..Options::new(Solver::Cg, tolerance) };
        let solved = scene.solve_with(&channels, &options).unwrap();
        assert!(solved.channels[0].bound <= tolerance);
        solved.counter("products")
    };
    let needed = [1e-2, 1e-4, 1e-6, 1e-8].map(|tolerance| products(tolerance, &[]));
    assert!(needed.windows(2).all(|pair| pair[0] < pair[1]), "{needed:?}");
    assert!(products(1e-2, &[Skip::EarlyStop]) > needed[3]);
    assert_same(&scene, &channels, Skip::EarlyStop);
}

#[test]
fn the_constant_mode_costs_no_steps() {
    let scene = Scene::cube_grid(4);
    let e: Vec<f64> = (0..96).map(|i| if i < 4 { 1.0 } else { 0.0 }).collect();
    let (with, without) = assert_same(&scene, &grey(&[0.99; 96], &e), Skip::ConstantMode);
    assert!(
        with.counter("products") < without.counter("products"),
        "{:?} {:?}",
        with.counters,
        without.counters
    );
}

#[test]
fn an_older_solution_is_a_start() {
    let scene = Scene::cube_grid(6);
    let n = scene.len();
    let e: Vec<f64> = (0..n).map(|i| if i < 9 { 1.0 } else { 0.0 }).collect();
    let rho: Vec<f64> = (0..n).map(|i| [0.8, 0.3, 0.6, 0.6, 0.5, 0.7][i / 36]).collect();
    let old = solve(&scene, &grey(&rho, &e), Solver::Cg, &[]);
    let start: Vec<[f64; 3]> = old.channels[0].irradiance.iter().map(|&h| [h; 3]).collect();
    let warm = |rho: &[f64], e: &[f64], solver: Solver| {
        let options = Options { start: Some(start.clone()), ..Options::new(solver, TOLERANCE) };
        let warm = scene.solve_with(&grey(rho, e), &options).unwrap();
        let cold = solve(&scene, &grey(rho, e), solver, &[]);
        let emitted: f64 = e.iter().zip(&scene.areas).map(|(e, area)| e * area).sum();
        let apart: f64 = (0..n)
            .map(|i| scene.areas[i] * (warm.channels[0].radiosity[i] - cold.channels[0].radiosity[i]).abs())
            .sum();
        assert!(apart <= 2.0 * TOLERANCE * emitted, "{solver:?}: {:e}", apart / emitted);
        (warm.counter("products"), cold.counter("products"))
    };
    // A lamp of twice the power: nothing is left to do.
    let doubled: Vec<f64> = e.iter().map(|e| 2.0 * e).collect();
    assert_eq!(warm(&rho, &doubled, Solver::Cg).0, 3);
    // One wall a little darker: fewer steps.
    let painted: Vec<f64> =
        rho.iter().enumerate().map(|(i, r)| if i / 36 == 2 { 0.55 } else { *r }).collect();
    for solver in [Solver::Cg, Solver::Jacobi, Solver::GaussSeidel, Solver::Southwell, Solver::Gmres] {
        let (warm, cold) = warm(&painted, &e, solver);
        println!("{solver:?}: {warm} after a start, {cold} without");
        assert!(warm < cold, "{solver:?}: {warm} and {cold}");
    }
}
