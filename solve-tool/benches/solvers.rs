//! Every method on the same scenes: products (or sweeps of as many shots as elements), seconds, true error and proved
//! bound, both in the power norm relative to the emitted power: `cargo bench -p solve-tool --bench solvers`.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Scene, grey};
use solve_tool::solve::{Options, Solver};
use std::time::Instant;

const TOLERANCE: f64 = 1e-6;
/// What takes longer is not waited for.
const MOST_STEPS: usize = 2000;

fn main() {
    let cube = Scene::cube_grid(8);
    let lit_cube: Vec<f64> =
        (0..384).map(|i| if [27, 28, 35, 36].map(|k| 320 + k).contains(&i) { 1.0 } else { 0.0 }).collect();
    let (rooms, open_rooms) = (Scene::two_rooms(8, 1), Scene::two_rooms(8, 3));
    let four_lit =
        |scene: &Scene| (0..scene.len()).map(|i| if i < 4 { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let (lit_rooms, lit_open_rooms) = (four_lit(&rooms), four_lit(&open_rooms));
    println!(
        "tolerance {TOLERANCE:e}, at most {MOST_STEPS} steps; error and bound relative to the emitted power"
    );
    for (name, scene, e) in [
        ("cube", &cube, &lit_cube),
        ("two rooms, a 64th of the wall between them open", &rooms, &lit_rooms),
        ("two rooms, a seventh of the wall between them open", &open_rooms, &lit_open_rooms),
    ] {
        println!("\n{name}, {} elements", scene.len());
        println!("rho     method              products  seconds   true error  bound     end");
        for rho in [0.2, 0.5, 0.8, 0.9, 0.99, 0.999] {
            table(scene, &vec![rho; scene.len()], e, &format!("{rho}"));
        }
        let mixed: Vec<f64> = (0..scene.len()).map(|i| [0.1, 0.6, 0.9][i * 12 / scene.len() % 3]).collect();
        table(scene, &mixed, e, "mixed");
    }
}

fn table(scene: &Scene, rho: &[f64], e: &[f64], name: &str) {
    let channels = grey(rho, e);
    let power = |b: &dyn Fn(usize) -> f64| -> f64 { (0..rho.len()).map(|i| scene.areas[i] * b(i)).sum() };
    let emitted = power(&|i| e[i]);
    let exact = scene.solve(&channels, Solver::Direct, 1e-13).unwrap().channels[0].radiosity.clone();
    let methods = [
        ("cg", Solver::Cg, false),
        ("gmres", Solver::Gmres, false),
        ("direct", Solver::Direct, false),
        ("jacobi", Solver::Jacobi, false),
        ("gauss-seidel", Solver::GaussSeidel, false),
        ("southwell", Solver::Southwell, false),
        ("southwell overshoot", Solver::Southwell, true),
    ];
    for (method, solver, overshooting) in methods {
        let options =
            Options { overshooting, most_steps: Some(MOST_STEPS), ..Options::new(solver, TOLERANCE) };
        let start = Instant::now();
        let solved = scene.solve_with(&channels, &options).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let channel = &solved.channels[0];
        let error = power(&|i| (channel.radiosity[i] - exact[i]).abs()) / emitted;
        let products = solved.counter("products") + solved.counter("products for bounds");
        println!(
            "{name:6}  {method:19} {products:8}  {seconds:8.5}  {error:10.2e}  {:.2e}  {:?}",
            channel.bound, channel.end
        );
    }
}
