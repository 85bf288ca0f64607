//! What must hold for any scene: proved bounds, agreement of methods, the same bits however it is computed.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Scene, assert_all_close, channel, grey, random, random_scene};
use interchange::matrix::{BlockKind, PackedBlock, Precision, Values};
use proptest::prelude::*;
use solve_tool::bound::{Amplification, Proof};
use solve_tool::bounds;
use solve_tool::components::Components;
use solve_tool::error::SolveError;
use solve_tool::interval::Spread;
use solve_tool::product::Product;
use solve_tool::solve::{Solver, solve};

/// A few glowing elements, random reflectances up to `brightest`, some black.
fn random_channel(n: usize, brightest: f64, seed: u64) -> solve_tool::channels::Channel {
    let mut next = random(seed);
    let rho: Vec<f64> = (0..n).map(|_| if next() < 0.2 { 0.0 } else { brightest * next() }).collect();
    let e: Vec<f64> = (0..n).map(|_| if next() < 0.2 { next() } else { 0.0 }).collect();
    channel(&rho, &e)
}

/// In the power norm the bound |r| / (1 - rho) is an equality where rho is uniform, the scene closed and the residual
/// of one sign: after k Jacobi steps the error of the cube at rho = 0.5 is 0.5, 0.25, 0.125 of the emitted power.
#[test]
fn bound_is_sharp_for_jacobi_iterates_of_the_cube() {
    Scene::cube().with_system(|system| {
        let (rho, e) = ([0.5; 6], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let exact = Scene::cube().radiosity(&rho, &e);
        let seen = system.product.apply(&[&rho]).swap_remove(0);
        let amplification = Amplification::from_norm(system.areas, &rho, &seen);
        assert!((amplification.factor - 2.0).abs() < 1e-14, "{amplification:?}");
        let step = |b: &[f64]| -> Vec<f64> {
            let h = system.product.apply(&[b]).swap_remove(0);
            (0..6).map(|i| e[i] + rho[i] * h[i]).collect()
        };
        let mut b = e.to_vec();
        for (k, sup) in [(1, 9.090910e-2), (2, 4.181876e-2), (3, 2.090909e-2)] {
            b = step(&b);
            let residual: f64 = step(&b).iter().zip(&b).map(|(next, now)| (next - now).abs()).sum();
            let error: f64 = exact.iter().zip(&b).map(|(exact, now)| (exact - now).abs()).sum();
            let bound = amplification.factor * residual;
            assert!((bound - error).abs() < 1e-12, "step {k}: bound {bound}, error {error}");
            assert!((error - 0.5f64.powi(k)).abs() < 1e-12, "step {k}: error {error}");
            let worst = exact.iter().zip(&b).map(|(exact, now)| (exact - now).abs()).fold(0.0, f64::max);
            assert!((worst - sup).abs() < 5e-9, "step {k}: sup error {worst}");
        }
    });
}

/// Where an element sees nothing but reflectance 1 the norm proves nothing, and importance has to.
#[test]
fn importance_bounds_what_the_norm_cannot() {
    // A chain 0 - 1 - 2 - 3: 0 and 1 see only white ones, 3 absorbs half.
    let scene = Scene::new(vec![1.0; 4], |i, j| match (i.min(j), i.max(j)) {
        (0, 1) => 0.5,
        (1, 2) | (2, 3) => 0.5,
        (0, 0) | (3, 3) => 0.5,
        _ => 0.0,
    });
    let rho = [1.0, 1.0, 1.0, 0.5];
    scene.with_system(|system| {
        let seen = system.product.apply(&[&rho]).swap_remove(0);
        assert_eq!(Amplification::from_norm(system.areas, &rho, &seen).proof, Proof::None);
        let (found, _) = Amplification::find(&system.product, system.areas, &rho, &seen);
        assert_eq!(found.proof, Proof::Importance);
        // The exact importance, by plain iteration of z = 1 + F (rho z).
        let mut z = [1.0; 4];
        for _ in 0..2000 {
            let fed: Vec<f64> = z.iter().zip(&rho).map(|(z, rho)| z * rho).collect();
            let h = system.product.apply(&[&fed]).swap_remove(0);
            z = std::array::from_fn(|i| 1.0 + h[i]);
        }
        let exact = z.iter().copied().fold(0.0, f64::max);
        assert!(found.factor >= exact && found.factor < 1.25 * exact, "{found:?} for {exact}");
    });
    let e = [1.0, 0.0, 0.0, 0.0];
    let solved = scene.solve(&grey(&rho, &e), Solver::Cg, 1e-10).unwrap();
    assert!(solved.channels[0].bound <= 1e-10 && solved.warnings.is_empty());
    assert_all_close(&solved.channels[0].radiosity, &scene.radiosity(&rho, &e), 1e-9);
}

#[test]
fn lossless_lit_components_are_refused_and_others_are_not() {
    let cube = Scene::cube();
    let lit = [1.0; 6];
    let refused = cube.solve(&grey(&[1.0; 6], &lit), Solver::Auto, 1e-6).unwrap_err();
    assert!(matches!(&refused, SolveError::Lossless(l) if l.elements.len() == 6), "{refused}");
    // One channel is enough.
    let one = [channel(&[0.5; 6], &lit), channel(&[1.0; 6], &lit), channel(&[0.5; 6], &lit)];
    assert!(cube.solve(&one, Solver::Auto, 1e-6).unwrap_err().to_string().contains("green"));
    // Without light there is nothing that could not leave.
    let dark = [channel(&[0.5; 6], &lit), channel(&[1.0; 6], &[0.0; 6]), channel(&[0.5; 6], &lit)];
    assert_eq!(cube.solve(&dark, Solver::Auto, 1e-6).unwrap().channels[1].radiosity, [0.0; 6]);

    // An opening beyond the rows' error lets the light out; one within the error might not be there.
    let mut open = Scene::new(vec![1.0; 2], |i, j| if i == j { 0.0 } else { 0.999 });
    assert!(open.solve(&grey(&[1.0; 2], &[1.0, 0.0]), Solver::Cg, 1e-6).is_ok());
    open.row_errors = vec![2e-3; 2];
    assert!(open.solve(&grey(&[1.0; 2], &[1.0, 0.0]), Solver::Cg, 1e-6).is_err());
}

#[test]
fn two_rooms_one_light_one_lossless_and_dark() {
    // Elements 0-1 and 2-3 see each other in pairs.
    let rooms = Scene::new(vec![1.0; 4], |i, j| if i != j && i / 2 == j / 2 { 1.0 } else { 0.0 });
    rooms.with_system(|system| {
        let components = Components::of(&system.product);
        assert_eq!(components.of_element, [0, 0, 1, 1]);
    });
    for solver in [Solver::Cg, Solver::Direct] {
        let solved = rooms.solve(&grey(&[0.5, 0.5, 1.0, 1.0], &[1.0, 0.0, 0.0, 0.0]), solver, 1e-12).unwrap();
        assert_all_close(&solved.channels[0].radiosity, &[4.0 / 3.0, 2.0 / 3.0, 0.0, 0.0], 1e-12);
        assert_eq!(&solved.channels[0].radiosity[2..], [0.0, 0.0]);
    }
}

#[test]
fn no_light_is_exactly_zero_without_a_product() {
    let solved = Scene::cube().solve(&grey(&[1.0; 6], &[0.0; 6]), Solver::Auto, 1e-6).unwrap();
    for channel in &solved.channels {
        assert_eq!((&channel.radiosity[..], &channel.irradiance[..]), (&[0.0; 6][..], &[0.0; 6][..]));
        assert!(channel.history.is_empty() && channel.bound == 0.0);
    }
    assert!(!solved.counters.iter().any(|(name, _)| name == "products"));
}

/// A matrix whose rows exceed 1 by more than the surfaces absorb has no positive solution.
#[test]
fn rows_that_create_light_are_named() {
    let scene = Scene::new(vec![1.0; 2], |i, j| if i == j { 0.0 } else { 1.1 });
    for solver in [Solver::Cg, Solver::Direct] {
        let error = scene.solve(&grey(&[0.95; 2], &[1.0, 0.0]), solver, 1e-6).unwrap_err();
        assert!(matches!(error, SolveError::NotPositiveDefinite { channel: "red" }), "{error}");
    }
}

/// Reflectances too small to divide by, and powers of any size, are nothing special.
#[test]
fn extreme_reflectances_and_scales_are_solved() {
    let rho = [1e-310, 1e-200, 0.5, 0.5, 0.5, 0.5];
    for (area, light) in [(1e-12, 1.0), (1e12, 1e100), (1.0, 1e-100)] {
        let mut scene = Scene::cube();
        scene.areas = vec![area; 6];
        scene.exchange.iter_mut().flatten().for_each(|s| *s *= area);
        let lit = scene.radiosity(&rho, &[0.0, 0.0, 0.0, 0.0, 0.0, light]);
        let plain = Scene::cube().radiosity(&rho, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let scaled: Vec<f64> = lit.iter().map(|b| b / light).collect();
        assert_all_close(&scaled, &plain, 1e-14);
    }
}

/// Iterates of conjugate gradients swing about the truth: down a passage they come out below 0. Raised to 0 they are
/// nearer to the truth in every element, so the bound stands, and no radiosity is below its lower bound.
#[test]
fn irradiances_are_never_below_0() {
    // Elements in a row, each between two others, the first of which glows.
    let n = 40;
    let scene = Scene::new(vec![1.0; n], |i, j| if i.abs_diff(j) == 1 { 0.5 } else { 0.0 });
    let e: Vec<f64> = (0..n).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
    let emitted: f64 = e.iter().zip(&scene.areas).map(|(e, area)| e * area).sum();
    let mut raised = 0;
    for brightest in [0.2, 0.5, 0.8] {
        let rho: Vec<f64> = (0..n).map(|i| if i % 5 == 3 { 0.3 * brightest } else { brightest }).collect();
        let exact = scene.radiosity(&rho, &e);
        for tolerance in [0.3, 0.1, 0.03, 0.01, 1e-3, 1e-9] {
            let solved = scene.solve(&grey(&rho, &e), Solver::Cg, tolerance).unwrap();
            let counted = solved.counter("irradiances raised to 0");
            println!("rho {brightest}, tolerance {tolerance}: {counted} raised");
            raised += counted;
            let channel = &solved.channels[0];
            let error = |i: usize| channel.radiosity[i] - exact[i];
            let wrong: f64 = (0..n).map(|i| scene.areas[i] * error(i).abs()).sum();
            assert!(wrong <= channel.bound * emitted + 1e-12, "{wrong} > {}", channel.bound * emitted);
            assert!(channel.irradiance.iter().all(|&h| h >= 0.0));
            assert!((0..n).all(|i| channel.radiosity[i] >= e[i]));
            let bounded =
                scene.with_system(|system| bounds::find(system, &grey(&rho, &e), &solved, &[], Spread::Rows));
            for (i, b) in channel.radiosity.iter().enumerate() {
                let (lower, upper) = (bounded.lower[0][i], bounded.upper[0][i]);
                assert!(lower <= *b && *b <= upper, "{i}: {b} outside [{lower}, {upper}]");
                let truth = exact[i];
                assert!(lower <= truth + 1e-12 && truth <= upper + 1e-12, "{i}: {truth}");
            }
        }
    }
    assert!(raised > 0, "no iterate was below 0: the test shows nothing");

    // Where light is drawn out, below 0 is an answer like any other.
    let sink: Vec<f64> = e.iter().map(|e| -e).collect();
    let drawn = scene.solve(&grey(&vec![0.5; n], &sink), Solver::Cg, 0.01).unwrap();
    assert_eq!(drawn.counter("irradiances raised to 0"), 0);
    assert!(drawn.channels[0].irradiance.iter().any(|&h| h < 0.0));
}

#[test]
fn channels_do_not_touch_each_other() {
    let scene = random_scene(300, 1.0, 11);
    let three: [_; 3] = std::array::from_fn(|c| random_channel(300, [0.3, 0.99, 0.8][c], c as u64));
    for solver in [Solver::Cg, Solver::Direct] {
        let together = scene.solve(&three, solver, 1e-9).unwrap();
        for (c, one) in three.iter().enumerate() {
            let alone = scene.solve(&std::array::from_fn(|_| one.clone()), solver, 1e-9).unwrap();
            assert_eq!(alone.channels[0].radiosity, together.channels[c].radiosity, "channel {c}");
            assert_eq!(alone.channels[0].irradiance, together.channels[c].irradiance, "channel {c}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    // Large enough for several tasks of several blocks.
    let scene = random_scene(1200, 1.0, 5);
    let (blocks, values) = scene.blocks(&[1, 7, 300, 303, 900]);
    let values: Vec<f32> = values.iter().map(|&v| v as f32).collect();
    let channels: [_; 3] = std::array::from_fn(|c| random_channel(1200, 0.9, 40 + c as u64));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let product = Product::from_parts(1200, &blocks, Values::F32(&values));
            let errors = vec![0.0; 1200];
            let system = solve_tool::system::System::from_parts(product, &scene.areas, &errors, 0.0);
            solve(&system, &channels, Solver::Cg, 1e-9).unwrap()
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(7));
}

/// The product against the definition, for every way of cutting the matrix into blocks.
#[test]
fn product_is_the_definition_for_any_blocks() {
    let scene = random_scene(67, 1.0, 2);
    let mut next = random(9);
    let x: Vec<Vec<f64>> = (0..5).map(|_| (0..67).map(|_| next() - 0.5).collect()).collect();
    for cuts in [vec![], vec![1], vec![3, 4, 5, 37], (1..67).collect::<Vec<_>>(), vec![64, 66]] {
        let (blocks, values) = scene.blocks(&cuts);
        let product = Product::from_parts(67, &blocks, Values::F64(&values));
        for count in 1..=5 {
            let given: Vec<&[f64]> = x[..count].iter().map(Vec::as_slice).collect();
            for (x, y) in given.iter().zip(product.apply(&given)) {
                let want: Vec<f64> =
                    scene.exchange.iter().map(|row| row.iter().zip(*x).map(|(s, x)| s * x).sum()).collect();
                assert_all_close(&y, &want, 1e-13);
            }
        }
    }
}

/// Blocks that leave out their zeros, from one file or from two.
#[test]
fn product_of_sparse_blocks_is_the_definition() {
    let scene = random_scene(67, 1.0, 3);
    let kept = |i: usize, j: usize| (i * 31 + j * 31 + i * j).is_multiple_of(7);
    let s = |i: usize, j: usize| if kept(i, j) { scene.exchange[i][j] } else { 0.0 };
    let mut next = random(10);
    let x: Vec<f64> = (0..67).map(|_| next() - 0.5).collect();
    let want: Vec<f64> = (0..67).map(|i| (0..67).map(|j| s(i, j) * x[j]).sum()).collect();
    let ranges = [0..20, 20..50, 50..67];
    let mut packed = Vec::new();
    for (k, rows) in ranges.iter().enumerate() {
        for columns in &ranges[k..] {
            let triangle = rows == columns;
            let entries: Vec<f64> = rows
                .clone()
                .flat_map(|i| columns.clone().map(move |j| (i, j)))
                .filter(|&(i, j)| !triangle || j >= i)
                .map(|(i, j)| s(i as usize, j as usize))
                .collect();
            let (rows, columns) = (rows.clone(), columns.clone());
            packed.push(PackedBlock::new(rows, columns, triangle, &entries, Precision::F64, true));
        }
    }
    let sparse = packed.iter().filter(|p| p.block.kind() == Ok(BlockKind::Sparse)).count();
    assert_eq!(sparse, packed.len(), "a seventh of the entries");
    let product = Product::from_views(67, packed.iter().map(PackedBlock::view).collect());
    assert_all_close(&product.apply(&[&x])[0], &want, 1e-13);

    // Methods that take rows and columns one by one, and products that leave out black rows, see the same matrix.
    let errors = vec![0.0; 67];
    let system = solve_tool::system::System::from_parts(product, &scene.areas, &errors, 0.0);
    let channels = std::array::from_fn(|c| random_channel(67, 0.9, 60 + c as u64));
    let exact = solve(&system, &channels, Solver::Direct, 1e-13).unwrap();
    for solver in [Solver::Cg, Solver::Jacobi, Solver::GaussSeidel, Solver::Southwell, Solver::Gmres] {
        let solved = solve(&system, &channels, solver, 1e-12).unwrap();
        for (got, want) in solved.channels.iter().zip(&exact.channels) {
            assert_all_close(&got.radiosity, &want.radiosity, 1e-9);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// The proved bound holds against the solution by factorisation, and both methods agree.
    #[test]
    fn bounds_hold_and_methods_agree(
        n in 1usize..40, seed in 0u64..1 << 32, most in 0.3f64..1.0, brightest in 0.1f64..1.0, digits in 1i32..10,
    ) {
        let scene = random_scene(n, most, seed);
        let one = random_channel(n, brightest, seed ^ 77);
        let channels = std::array::from_fn(|_| one.clone());
        let tolerance = 10f64.powi(-digits);
        let rough = scene.solve(&channels, Solver::Cg, tolerance).unwrap();
        let exact = scene.solve(&channels, Solver::Direct, 1e-14).unwrap();
        let (rough, exact) = (&rough.channels[0], &exact.channels[0]);
        let emitted = one.emitted(&scene.areas);
        let error: f64 = (0..n).map(|i| scene.areas[i] * (rough.radiosity[i] - exact.radiosity[i]).abs()).sum();
        prop_assert!(rough.bound <= tolerance, "bound {:e} for {tolerance:e}", rough.bound);
        // The reference itself is exact to rounding, amplified by at most 1 / (1 - most * brightest).
        prop_assert!(error <= (rough.bound + 1e-12) * emitted, "error {error:e}, bound {:e}", rough.bound * emitted);
        prop_assert!(rough.radiosity.iter().all(|b| b.is_finite()));
    }
}
