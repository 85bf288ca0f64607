//! What lines are worth: error of interpolating direct light, against uniform grids with as many nodes.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::gather::{Gatherer, Scratch};
use geometry::occluder::Occluder;
use geometry::polygon;
use glam::DVec3;
use interchange::mesh::Mesh;
use mesh_tool::Options;
use mesh_tool::adaptive::interpolated;
use mesh_tool::discontinuity::Order;

/// A horizontal floor, a lamp above it and one square between.
struct Shadow {
    text: String,
    up: DVec3,
    gatherer: Gatherer,
    floor: [f64; 2],
}

impl Shadow {
    /// S1: the floor is not commensurate with the lines.
    fn aligned_squares() -> Shadow {
        let square = |half: f64, z: f64| {
            [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| DVec3::new(x, y, z))
        };
        let (mut light, occluder) = (square(0.5, 4.0).to_vec(), square(1.0, 2.0).to_vec());
        // The occluder looks down: what falls on it does not compete for elements.
        light.reverse();
        let floor = [-4.13, 4.29];
        let [a, b] = floor;
        let mut text =
            format!("v {a} {a} 0\nv {b} {a} 0\nv {b} {b} 0\nv {a} {b} 0\nusemtl white\nf 1 2 3 4\n");
        let down: Vec<DVec3> = occluder.iter().rev().copied().collect();
        for (material, corners) in [("lamp", &light), ("white", &down)] {
            for c in corners {
                text += &format!("v {:?} {:?} {:?}\n", c.x, c.y, c.z);
            }
            text += &format!("usemtl {material}\nf -4 -3 -2 -1\n");
        }
        let gatherer = Gatherer::new(vec![Occluder::new(occluder).unwrap()], vec![light]);
        Shadow { text, up: DVec3::Z, gatherer, floor }
    }

    /// `penumbra.obj`: the lines lie closer together.
    fn penumbra() -> Shadow {
        let square = |half: f64, y: f64| {
            [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, z)| DVec3::new(x, y, z))
        };
        let text = std::fs::read_to_string(scene_path("penumbra.obj")).unwrap();
        let text = text.replace("mtllib penumbra.mtl", "").replace("usemtl light", "usemtl lamp");
        let text = text.replace("usemtl floor", "usemtl white").replace("usemtl black", "usemtl grey");
        let occluder = Occluder::new(square(0.4, 1.0).to_vec()).unwrap();
        let gatherer = Gatherer::new(vec![occluder], vec![square(0.5, 2.0).to_vec()]);
        Shadow { text, up: DVec3::Y, gatherer, floor: [-3.0, 3.0] }
    }

    fn at(&self, point: DVec3, scratch: &mut Scratch) -> f64 {
        let mut sum = 0.0;
        self.gatherer.factors(point, self.up, scratch, &mut |_, factor| sum += factor);
        sum
    }

    /// RMS and largest error over triangles, relative to the brightest place.
    fn error(&self, triangles: &[[DVec3; 3]], linear: bool) -> (f64, f64) {
        let scratch = &mut Scratch::default();
        let (mut squares, mut whole, mut most, mut peak) = (0.0, 0.0, 0.0f64, 0.0f64);
        for &[a, b, c] in triangles {
            let nodes = [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)].map(|p| self.at(p, scratch));
            let area = polygon::area(&[a, b, c]);
            const STEPS: usize = 7;
            for i in 0..STEPS {
                for j in 0..STEPS - i {
                    let [u, v] = [i, j].map(|k| (k as f64 + 1.0 / 3.0) / STEPS as f64);
                    let w = 1.0 - u - v;
                    let light = self.at(u * a + v * b + w * c, scratch);
                    let error = (interpolated(&nodes, [u, v, w], linear) - light).abs();
                    squares += area * error * error;
                    whole += area;
                    most = most.max(error);
                    peak = peak.max(light);
                }
            }
        }
        ((squares / whole).sqrt() / peak, most / peak)
    }

    /// A uniform grid of the floor with `cells` a side, in the z = 0 plane.
    fn grid(&self, cells: usize) -> Vec<[DVec3; 3]> {
        let [low, high] = self.floor;
        let at = |i: usize, j: usize| {
            let place = |k: usize| low + (high - low) * k as f64 / cells as f64;
            let flat = DVec3::new(place(i), place(j), 0.0);
            if self.up == DVec3::Z { flat } else { DVec3::new(flat.x, 0.0, -flat.y) }
        };
        (0..cells * cells)
            .flat_map(|k| {
                let (i, j) = (k / cells, k % cells);
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }
}

/// Elements of the first face, and the number of its nodes.
fn floor_of(mesh: &Mesh) -> (Vec<[DVec3; 3]>, usize) {
    let own: Vec<_> = mesh.element_ids().filter(|&e| mesh.element_face(e).0 == 0).collect();
    let triangles = own.iter().map(|&e| mesh.element_corners(e).try_into().unwrap()).collect();
    let mut nodes: Vec<_> =
        own.iter().flat_map(|e| mesh.element_nodes.row(e.index()).iter().copied()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    (triangles, nodes.len())
}

#[test]
fn aligned_squares_at_equal_nodes_are_many_times_better_with_lines() {
    let shadow = Shadow::aligned_squares();
    // About 1100 nodes: 2 nodes an element for six-node triangles, half a node for three-node ones.
    let quadratic = Options { tolerance: Some(1e-9), discontinuity: Some(Order::D2), ..elements(560) };
    let (mesh, _) = made(&scene_of(&shadow.text), quadratic);
    let (triangles, nodes) = floor_of(&mesh);
    let (rms, most) = shadow.error(&triangles, false);
    let (uniform_rms, uniform_most) = shadow.error(&shadow.grid(16), false);
    let linear =
        Options { tolerance: Some(1e-9), discontinuity: Some(Order::D1), linear: true, ..elements(2150) };
    let (mesh, _) = made(&scene_of(&shadow.text), linear);
    let (triangles, linear_nodes) = floor_of(&mesh);
    let (linear_rms, _) = shadow.error(&triangles, true);
    let (grid_rms, _) = shadow.error(&shadow.grid(32), true);
    assert!(nodes <= 1150, "{nodes}");
    // Measured 41 and 70 times.
    assert!(40.0 * rms < uniform_rms, "{rms} against {uniform_rms}");
    assert!(40.0 * most < uniform_most, "{most} against {uniform_most}");
    assert!(linear_nodes <= 1150, "{linear_nodes}");
    assert!(2.0 * linear_rms < grid_rms, "{linear_rms} against {grid_rms}");
}

#[test]
fn penumbra_at_equal_nodes_is_many_times_better_with_lines() {
    let shadow = Shadow::penumbra();
    let options = Options { tolerance: Some(1e-9), discontinuity: Some(Order::D2), ..elements(545) };
    let (mesh, _) = made(&scene_of(&shadow.text), options);
    let (triangles, nodes) = floor_of(&mesh);
    let (rms, most) = shadow.error(&triangles, false);
    let (uniform_rms, uniform_most) = shadow.error(&shadow.grid(16), false);
    assert!(nodes <= 1150, "{nodes}");
    assert!(15.0 * rms < uniform_rms, "{nodes} nodes: {rms} against {uniform_rms}");
    assert!(30.0 * most < uniform_most, "{nodes} nodes: {most} against {uniform_most}");
}

/// Evenly lit places stay coarse, the tolerance is met where it can be, and finer tolerances take more elements.
#[test]
fn tolerance_is_met_with_no_more_elements_than_it_takes() {
    let count = |tolerance: f64| {
        let options = Options { tolerance: Some(tolerance), ..given() };
        let (mesh, report) = made(&read("penumbra.obj"), options);
        assert!(report.estimates["largest interpolation error of direct light"] <= tolerance);
        mesh.element_count()
    };
    let (coarse, fine) = (count(0.1), count(0.01));
    assert!(coarse < fine && fine < 1000, "{coarse} {fine}");
}

/// Table for BENCHMARKING.md: error of the quadratic interpolant of direct light on the floor, relative to the brightest
/// place, for the ways of making elements.
#[test]
#[ignore = "prints a table"]
fn interpolation_error_per_element() {
    let ways = [
        ("adaptive", Some(1e-9), Order::Off),
        ("lines d1", None, Order::D1),
        ("lines d2", None, Order::D2),
        ("both, d1", Some(1e-9), Order::D1),
        ("both, d2", Some(1e-9), Order::D2),
    ];
    for (name, shadow) in [("S1", Shadow::aligned_squares()), ("penumbra", Shadow::penumbra())] {
        for cells in [8, 12, 16, 24] {
            let (rms, most) = shadow.error(&shadow.grid(cells), false);
            println!("{name} | uniform | {} | {rms:.1e} | {most:.1e}", (2 * cells + 1).pow(2));
        }
        for (way, tolerance, order) in ways {
            for count in [140, 310, 550, 1250] {
                let lines = Options { tolerance, discontinuity: Some(order), ..elements(count) };
                // Equal elements along the lines, about as many.
                let even = max_edge(1.9 * (shadow.floor[1] - shadow.floor[0]) / f64::from(count).sqrt());
                let even = Options { discontinuity: Some(order), ..even };
                let options = if tolerance.is_some() { lines } else { even };
                let (triangles, nodes) = floor_of(&made(&scene_of(&shadow.text), options).0);
                let (rms, most) = shadow.error(&triangles, false);
                println!("{name} | {way} | {nodes} | {rms:.1e} | {most:.1e}");
            }
        }
    }
}
