//! Enclosures whose radiosity is known: the values of published and independently computed networks.
#![allow(clippy::unwrap_used)]

mod common;

use common::{CUBE_ADJACENT, CUBE_OPPOSITE, Scene, assert_all_close, grey};
use interchange::matrix::Values;
use solve_tool::bounces::bounce;
use solve_tool::product::Product;
use solve_tool::skips::Skips;
use solve_tool::solve::{Solver, solve};
use solve_tool::system::System;

/// One-patch-per-face cube, ceiling emits 1, uniform reflectance: wall, floor, ceiling.
#[test]
fn cube_with_a_glowing_ceiling() {
    let table = [
        (0.2, 0.048085017357, 0.048044544595, 1.009615385978),
        (0.5, 0.181836268946, 0.181745826108, 1.090909098108),
        (0.8, 0.689681193904, 0.689551070738, 1.551724153645),
        (0.9, 1.525452018512, 1.525310551125, 2.372881374826),
        (0.99, 16.527576099920, 16.527425127722, 17.362270472597),
    ];
    for (rho, wall, floor, ceiling) in table {
        let b = Scene::cube().radiosity(&[rho; 6], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_all_close(&b, &[wall, wall, wall, wall, floor, ceiling], 1e-9);
    }
}

/// Front emits and reflects nothing, left red, right blue, the others 0.8; the red channel.
#[test]
fn goral_like_cube() {
    let (left, right, back, rest) = (0.321817395787, 0.045743811982, 0.321673353271, 0.321775729479);
    // Opposite pairs: left and right, front and back, floor and ceiling.
    let b = Scene::cube().radiosity(&[0.8, 0.1, 0.0, 0.8, 0.8, 0.8], &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert_all_close(&b, &[left, right, 1.0, back, rest, rest], 1e-9);
    let b = Scene::cube().radiosity(&[0.1, 0.8, 0.0, 0.8, 0.8, 0.8], &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    assert_all_close(&b, &[right, left, 1.0, back, rest, rest], 1e-9);
}

/// n x n patches a face, the ceiling emits: face means of wall, floor and ceiling for rho = 0.5, published with these n.
#[test]
fn subdivided_cube_with_a_glowing_ceiling() {
    let table = [
        (2, 0.181836268946, 0.173639114749, 1.099015809466),
        (4, 0.181381216327, 0.171829422310, 1.102645712382),
        (8, 0.181195523706, 0.171373223526, 1.103844681651),
        (16, 0.181133371241, 0.171255694053, 1.104210820983),
    ];
    for (n, wall, floor, ceiling) in table {
        let scene = Scene::cube_grid(n);
        let per_face = n * n;
        let e: Vec<f64> = (0..scene.len()).map(|i| if i / per_face == 5 { 1.0 } else { 0.0 }).collect();
        let solved = scene.solve(&grey(&vec![0.5; scene.len()], &e), Solver::Cg, 1e-13).unwrap();
        let energy = solved.channels[0].energy;
        assert!(energy.defect < 1e-12 && energy.escaped.abs() < 1e-12, "{energy:?}");
        let b = &solved.channels[0].radiosity;
        let mean = |face: usize| b[face * per_face..][..per_face].iter().sum::<f64>() / per_face as f64;
        for (face, want) in [(0, wall), (1, wall), (2, wall), (3, wall), (4, floor), (5, ceiling)] {
            assert!((mean(face) - want).abs() < 1e-9, "n {n}, face {face}: {} for {want}", mean(face));
        }
    }
}

/// Partial sums on the cube, one patch a face: wall, floor, ceiling after 0, 1, 2, 3, 5, 10 bounces.
#[test]
fn bounces_are_partial_sums() {
    let half = [
        (0, 0.0, 0.0, 1.0),
        (1, 0.100021888038, 0.099912447849, 1.0),
        (2, 0.140017507556, 0.139929960196, 1.050000009582),
        (3, 0.161018165060, 0.160927333055, 1.070000006707),
        (5, 0.176628088308, 0.176537639584, 1.085700007186),
        (10, 0.181673508528, 0.181583065690, 1.090746337699),
    ];
    let bright = [
        (1, 0.160035020860, 0.159859916559, 1.0),
        (3, 0.348442499962, 0.348309987398, 1.209920012753),
        (10, 0.618098405381, 0.617968282233, 1.480141366642),
    ];
    let rows = half.map(|row| (0.5, row)).into_iter().chain(bright.map(|row| (0.8, row)));
    for (rho, (bounces, wall, floor, ceiling)) in rows {
        Scene::cube().with_system(|system| {
            let channels = grey(&[rho; 6], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
            let solved = bounce(system, &channels, bounces, &Skips::default());
            assert_eq!(solved.counter("products"), bounces as usize);
            let channel = &solved.channels[1];
            assert_all_close(&channel.radiosity, &[wall, wall, wall, wall, floor, ceiling], 1e-9);
            // What one bounce more would bring is under way: rho to the power of k of all, in a closed room.
            assert!(channel.energy.defect < 1e-12, "{:?}", channel.energy);
            assert!(
                (channel.energy.under_way - rho.powi(bounces as i32)).abs() < 1e-12,
                "{:?}",
                channel.energy
            );
        });
    }
}

#[test]
fn box_with_unequal_areas() {
    let rho = [0.8, 0.3, 0.6, 0.6, 0.5, 0.7];
    let b = Scene::box_1_1_2().radiosity(&rho, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let want =
        [0.186558327450, 0.079169333763, 0.147421942927, 0.147421942927, 0.102863001806, 1.096310112350];
    // The factors are given to 12 digits; errors of 5e-13 in them are amplified by at most 5.
    assert_all_close(&b, &want, 1e-11);
}

#[test]
fn grey_networks() {
    // Infinite parallel plates: B1 = (E1 + r1 E2) / (1 - r1 r2).
    let plates = Scene::new(vec![1.0; 2], |i, j| if i == j { 0.0 } else { 1.0 });
    assert_all_close(&plates.radiosity(&[0.5, 0.5], &[1.0, 0.0]), &[4.0 / 3.0, 2.0 / 3.0], 1e-12);
    assert_all_close(&plates.radiosity(&[0.9, 0.9], &[1.0, 0.0]), &[1.0 / 0.19, 0.9 / 0.19], 1e-11);
    let want = [1.06 / 0.76, (0.2 + 0.8) / 0.76];
    assert_all_close(&plates.radiosity(&[0.3, 0.8], &[1.0, 0.2]), &want, 1e-12);

    // Convex body 1 in enclosure 2: F12 = 1, F21 = A1 / A2, F22 = 1 - A1 / A2.
    let body = |ratio: f64| {
        Scene::new(vec![ratio, 1.0], move |i, j| match (i, j) {
            (0, 0) => 0.0,
            (0, 1) => 1.0,
            (1, 0) => ratio,
            _ => 1.0 - ratio,
        })
    };
    assert_all_close(&body(0.25).radiosity(&[0.5, 0.5], &[1.0, 0.0]), &[10.0 / 9.0, 2.0 / 9.0], 1e-12);
    let want = [1.160714285714, 0.803571428571];
    assert_all_close(&body(0.25).radiosity(&[0.2, 0.9], &[1.0, 0.0]), &want, 1e-11);
    assert_all_close(&body(1.0 / 6.0).radiosity(&[0.5, 0.8], &[1.0, 0.0]), &[1.25, 0.5], 1e-12);
}

/// A furnace: E = 1 and rho everywhere gives B = 1 / (1 - rho), whatever the shape.
#[test]
fn furnace() {
    // Cube factors to 20 digits close to 1 ulp; theirs errors grow by 1 / (1 - rho).
    for rho in [0.2, 0.5, 0.8, 0.9, 0.95, 0.99, 0.999] {
        let b = Scene::cube().radiosity(&[rho; 6], &[1.0; 6]);
        let want: f64 = 1.0 / (1.0 - rho);
        assert_all_close(&b, &[want; 6], 1e-14 * want * want);
    }
    // E = 1 - rho with any rho per face gives B = 1.
    let rho: [f64; 6] = [0.1, 0.99, 0.5, 0.7, 0.0, 0.3];
    assert_all_close(&Scene::cube().radiosity(&rho, &rho.map(|r| 1.0 - r)), &[1.0; 6], 1e-12);
}

/// A floor that reflects everything in a room that does not: finite, and solved.
#[test]
fn one_face_of_reflectance_one_is_solved() {
    let rho = [0.6, 0.1, 0.7, 0.3, 1.0, 0.5];
    let scene = Scene::cube();
    let solved = scene.solve(&grey(&rho, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), Solver::Cg, 1e-12).unwrap();
    let channel = &solved.channels[0];
    assert!(channel.bound <= 1e-12, "bound {:e}", channel.bound);
    // The floor passes on all that it gets.
    assert!((channel.radiosity[4] - channel.irradiance[4]).abs() < 1e-14);
    for i in 0..6 {
        let f = |j: usize| match (i == j, i / 2 == j / 2) {
            (true, _) => 0.0,
            (_, true) => CUBE_OPPOSITE,
            _ => CUBE_ADJACENT,
        };
        let arriving: f64 = (0..6).map(|j| f(j) * channel.radiosity[j]).sum();
        assert!((arriving - channel.irradiance[i]).abs() < 1e-12, "{i}");
    }
}

#[test]
fn energy_is_accounted_for_in_open_and_closed_scenes() {
    for most in [1.0, 0.6] {
        let scene = common::random_scene(40, most, 7);
        let mut next = common::random(3);
        let rho: Vec<f64> = (0..40).map(|_| next()).collect();
        let e: Vec<f64> = (0..40).map(|i| if i < 3 { 1.0 + next() } else { 0.0 }).collect();
        let solved = scene.solve(&grey(&rho, &e), Solver::Cg, 1e-13).unwrap();
        let energy = solved.channels[0].energy;
        assert!(energy.escaped > 0.0 && energy.absorbed > 0.0);
        assert!(energy.defect < 1e-12, "defect {:e}", energy.defect);
    }
    // A closed cube loses nothing: sum of (1 - rho) H A = sum of E A.
    let solved = Scene::cube().solve(&grey(&[0.8; 6], &[1.0; 6]), Solver::Cg, 1e-13).unwrap();
    let energy = solved.channels[2].energy;
    assert!(energy.escaped.abs() < 1e-12 && (energy.absorbed - 6.0).abs() < 6e-12, "{energy:?}");
}

/// Pinney and Bean's L-shaped room as the network of eight surfaces that is published, one of them cooler.
#[test]
fn l_shaped_room_of_eight_surfaces() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/reference/published/viewfactor_cases.json");
    let all: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let case = &all["pinney_bean_L_room"];
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let factors: Vec<Vec<f64>> = case["computed_F"].as_array().unwrap().iter().map(numbers).collect();
    let areas = numbers(&case["areas"]);
    // Both halves are given to eight digits: S is their mean.
    let of = areas.clone();
    let scene = Scene::new(areas, |i, j| 0.5 * (of[i] * factors[i][j] + of[j] * factors[j][i]) / of[i]);
    let heat = &case["heat"];
    let sigma = heat["sigma"].as_f64().unwrap();
    let emissivity = case["emittance"].as_f64().unwrap();
    let e: Vec<f64> = numbers(&heat["T_K"]).iter().map(|t| emissivity * sigma * t.powi(4)).collect();
    let solved = scene.solve(&grey(&[1.0 - emissivity; 8], &e), Solver::Cg, 1e-12).unwrap();
    let (b, h) = (&solved.channels[0].radiosity, &solved.channels[0].irradiance);
    // Factors to 1.2e-6 of differences of up to 57 W m^-2 times eight surfaces; heat is given to 5e-6.
    let received: Vec<f64> = h.iter().zip(b).map(|(h, b)| h - b).collect();
    assert_all_close(&received, &numbers(&heat["computed_q_W_m2"]), 2e-4);
}

/// Every row short by d: light is lost at each reflection, and a furnace is darker by 1 - (1 - rho) / (1 - rho (1 - d)).
/// The report's matrix error, row error times rho / (1 - rho), is that to first order.
#[test]
fn a_furnace_with_short_rows_is_as_dark_as_the_error_budget_says() {
    let table = [
        (1e-4, [(0.5, 1.00e-4), (0.9, 8.99e-4), (0.99, 9.80e-3)]),
        (1e-3, [(0.5, 9.99e-4), (0.9, 8.92e-3), (0.99, 9.01e-2)]),
        (1e-2, [(0.5, 0.0099), (0.9, 0.0826), (0.99, 0.497)]),
    ];
    for (d, rows) in table {
        let mut scene = Scene::cube();
        scene.exchange.iter_mut().flatten().for_each(|s| *s *= 1.0 - d);
        scene.row_errors = vec![d; 6];
        for (rho, want) in rows {
            let solved = scene.solve(&grey(&[rho; 6], &[1.0 - rho; 6]), Solver::Cg, 1e-12).unwrap();
            let (channel, exact) = (&solved.channels[0], 1.0 - (1.0 - rho) / (1.0 - rho * (1.0 - d)));
            let error = 1.0 - channel.radiosity[3];
            assert!((error - exact).abs() < 1e-12 && (error / want - 1.0).abs() < 6e-3, "{d} {rho}: {error}");
            // |(I - K)^-1| is that of the short rows: rho / (1 - rho (1 - d)) times d.
            let stated = channel.matrix_error.relative;
            assert!((stated / (d * rho / (1.0 - rho * (1.0 - d))) - 1.0).abs() < 1e-9, "{d} {rho}: {stated}");
        }
    }
}

/// Entries stored as f32 in a room of reflectance 0.999: what their rounding may do is stated, and no less than it does.
#[test]
fn single_precision_in_a_bright_room_is_stated() {
    let scene = Scene::cube_grid(6);
    let n = scene.len();
    let (blocks, values) = scene.blocks(&[]);
    let stored: Vec<f32> = values.iter().map(|&s| s as f32).collect();
    let product = Product::from_parts(n, &blocks, Values::F32(&stored));
    let system = System::from_parts(product, &scene.areas, &scene.row_errors, f64::from(f32::EPSILON) / 2.0);
    // Rounding of the products, 1e-16 of a radiosity a thousand times the exitance, amplified a thousand times, allows no
    // bound below about 1e-10.
    let solved = solve(&system, &grey(&[0.999; 216], &[0.001; 216]), Solver::Cg, 1e-8).unwrap();
    let channel = &solved.channels[0];
    let off = channel.radiosity.iter().map(|b| (b - 1.0).abs()).sum::<f64>() / n as f64;
    let stated = channel.matrix_error.relative;
    println!("f32: off by {off:.1e}, stated {stated:.1e}");
    assert!(channel.bound <= 1e-8 && off <= stated && stated < 1e-4, "{off:e} {stated:e}");
    assert!(off > 1e-9, "rounding was expected to show: {off:e}");
}

/// A gap so small that nearly all light stays: the error is as its bound says, or there is none.
#[test]
fn nearly_lossless_plates_are_as_exact_as_stated() {
    for loss in [1e-3, 1e-6, 1e-9, 1e-12] {
        let scene = Scene::new(vec![1.0; 2], |i, j| if i == j { 0.0 } else { 1.0 - loss });
        for solver in [Solver::Cg, Solver::Direct, Solver::Gmres] {
            let solved = scene.solve(&grey(&[1.0; 2], &[1.0, 0.0]), solver, 1e-6).unwrap();
            let channel = &solved.channels[0];
            // B1 = 1 / (1 - f^2), B2 = f B1; the factor itself is known to half an ulp.
            let f = 1.0 - loss;
            let exact = 1.0 / ((1.0 - f) * (1.0 + f));
            let off = (channel.radiosity[0] - exact).abs() + (channel.radiosity[1] - f * exact).abs();
            let rounding = 4.0 * f64::EPSILON / loss * exact;
            assert!(
                off <= channel.bound + rounding,
                "{loss:e}, {solver:?}: off {off:e}, bound {:e}",
                channel.bound
            );
        }
    }
}
