//! Cleaning: each step repairs what it is for, counts it, and can be switched off.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::polygon;
use glam::DVec3;
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::scene::Scene;
use mesh_tool::Options;
use mesh_tool::steps::{Off, Step};

fn without(step: Step, options: Options) -> Options {
    Options { no_clean: Off::new(vec![step]), ..options }
}

/// Signed volume of the faces, positive where they look outward.
fn volume(mesh: &Mesh) -> f64 {
    mesh.element_ids()
        .map(|e| {
            let corners = mesh.element_corners(e);
            corners[0].dot(polygon::vector_area(&corners)) / 3.0
        })
        .sum()
}

/// A unit cube, with the faces of these numbers turned inside out.
fn cube(turned: &[usize]) -> Scene {
    let mut scene = scene_of(&format!("usemtl white\n{}", box_text([0.0; 3], [1.0; 3], true, 1)));
    turned.iter().for_each(|&face| scene.faces[face].corners.reverse());
    scene
}

#[test]
fn outward_cube_with_turned_faces_comes_out_outward() {
    for turned in [&[][..], &[0], &[5], &[1, 4], &[0, 1, 2], &[0, 2, 4]] {
        for options in [given(), elements(100)] {
            let (mesh, report) = made(&cube(turned), options);
            assert!((volume(&mesh) - 1.0).abs() < 1e-12, "{turned:?}: {}", volume(&mesh));
            assert_eq!(report.counters["turned over"] as usize, turned.len());
            assert_eq!(report.warnings.len(), usize::from(!turned.is_empty()), "{:?}", report.warnings);
        }
    }
    // Switched off, the faces stay as they were given.
    let (mesh, report) = made(&cube(&[0]), without(Step::Orient, given()));
    assert!(volume(&mesh) < 0.9);
    assert_eq!(report.counters["turned over"], 0);
}

#[test]
fn consistent_patches_are_never_turned() {
    // A room, and a single sheet that looks any way.
    let (mesh, report) = made(&cube(&[0, 1, 2, 3, 4, 5]), given());
    assert!((volume(&mesh) + 1.0).abs() < 1e-12);
    assert_eq!(report.counters["turned over"], 0);
    for name in ["cornell_blocks.obj", "cornell_empty.obj", "room.obj", "goral_cube.obj", "penumbra.obj"] {
        let (_, report) = made(&read(name), given());
        assert_eq!(report.counters["turned over"], 0, "{name}");
    }
}

#[test]
fn edges_of_three_faces_and_moebius_strips_turn_nothing() {
    let fin = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 -1 0\nv 1 -1 0\nv 0 0 1\nv 1 0 1\nusemtl white\n\
               f 1 2 3 4\nf 1 2 6 5\nf 1 2 8 7\n";
    assert_eq!(made(&scene_of(fin), given()).1.counters["turned over"], 0);
    let mut strip = String::new();
    let n = 8;
    for k in 0..n {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
        let tilt = 0.5 * angle;
        for side in [-0.3, 0.3] {
            let radius = 1.0 + side * tilt.cos();
            strip += &format!("v {} {} {}\n", radius * angle.cos(), radius * angle.sin(), side * tilt.sin());
        }
    }
    strip += "usemtl white\n";
    for k in 0..n {
        let [a, b] = [2 * k + 1, 2 * k + 2];
        let [c, d] = if k + 1 < n { [a + 2, b + 2] } else { [2, 1] };
        strip += &format!("f {a} {c} {b}\nf {c} {d} {b}\n");
    }
    let (_, report) = made(&scene_of(&strip), given());
    assert_eq!((report.counters["turned over"], report.counters["patches without orientation"]), (0, 1));
}

#[test]
fn hidden_parts_have_no_elements_and_keep_their_area() {
    // A block with and without a bottom on a floor: what it stands on and what it stands with are hidden.
    for (bottom, parts) in [(false, 1), (true, 2)] {
        let block = box_text([1.0, 0.0, 1.0], [2.0, 1.0, 2.0], bottom, 5);
        let text = floor_text(0.0, 4.0) + &block;
        let (mesh, report) = made(&scene_of(&text), elements(400));
        assert_eq!(report.counters["hidden parts"], parts);
        let hidden: f64 = mesh.hidden_areas.iter().sum();
        assert!((hidden - parts as f64).abs() < 1e-12, "{hidden}");
        assert_areas(&mesh, 1e-12);
        let (mesh, report) = made(&scene_of(&text), without(Step::Hidden, elements(400)));
        assert!(mesh.hidden_areas.is_empty() && report.counters["hidden parts"] == 0);
    }
    // A sheet given from both sides encloses nothing; a lamp in a closed box lights it; a box within a box is dark.
    let plate = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nusemtl white\nf 1 2 3 4\nf 4 3 2 1\n";
    assert_eq!(made(&scene_of(plate), elements(50)).1.counters["hidden parts"], 0);
    let outer = box_text([0.0; 3], [3.0; 3], true, 1);
    let lamp = format!("usemtl white\n{outer}usemtl lamp\n{}", box_text([1.0; 3], [2.0; 3], true, 9));
    assert_eq!(made(&scene_of(&lamp), elements(200)).1.counters["hidden parts"], 0);
    let dark = lamp.replace("lamp", "grey");
    let (mesh, report) = made(&scene_of(&dark), elements(200));
    assert_eq!(report.counters["hidden parts"], 6);
    assert!((mesh.hidden_areas.iter().sum::<f64>() - 6.0).abs() < 1e-12);
}

#[test]
fn exports_count_hidden_parts() {
    use interchange::grouping::{By, Grouping};
    let text = floor_text(0.0, 4.0) + &box_text([1.0, 0.0, 1.0], [2.0, 1.0, 2.0], false, 5);
    let (mesh, _) = made(&scene_of(&text), elements(400));
    let grouping = Grouping::new(&mesh, By::Face);
    let areas = grouping.sums(|e| polygon::area(&mesh.element_corners(interchange::ids::ElementId::new(e))));
    assert!((areas[0] + grouping.hidden_areas[0] - 16.0).abs() < 1e-12);
    assert!((grouping.hidden_areas[0] - 1.0).abs() < 1e-12);
}

#[test]
fn each_step_can_be_switched_off() {
    let report = |name: &str, options: Options| made(&read(name), options).1;
    // Duplicates and overlaps of the coplanar floor.
    let coplanar = "stress/stress_coplanar.obj";
    assert_eq!(report(coplanar, given()).counters["dropped duplicates"], 1);
    assert_eq!(report(coplanar, without(Step::Duplicates, given())).counters["dropped duplicates"], 0);
    let overlapping = report(coplanar, without(Step::Overlap, given()));
    assert!(overlapping.estimates["area of elements"] > 6.1);
    // Crossing boxes.
    let crossing = "stress/stress_intersect.obj";
    assert_eq!(report(crossing, without(Step::Cross, given())).counters["crossing faces cut"], 0);
    // Faces without area are refused where they may not be dropped.
    let flat = read("stress/stress_zeroarea.obj");
    let options = without(Step::ZeroArea, given());
    let error = mesh_tool::build(&flat, &options, &mut Report::new("mesh-tool", "test")).unwrap_err();
    assert!(error.to_string().contains("without area"), "{error}");
    // Corners a hair apart are one, or not.
    let split = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 1 0 1e-12\nv 1 1 1e-12\nv 2 0 0\nv 2 1 0\nv 0 1 0\nusemtl white\nf 1 2 3 8\nf 4 6 7 5\n";
    let welded = made(&scene_of(split), given()).1;
    assert_eq!(welded.counters["welded vertices"], 2);
    assert_eq!(made(&scene_of(split), without(Step::Weld, given())).1.counters["welded vertices"], 0);
    // Coplanar neighbours.
    let tiles = "stress/stress_tvertex.obj";
    assert!(report(tiles, elements(300)).counters["faces merged into regions"] > 0);
    assert!(
        !report(tiles, without(Step::Regions, elements(300)))
            .counters
            .contains_key("faces merged into regions")
    );
    let apart = report(tiles, without(Step::Meet, elements(600)));
    assert!((apart.estimates["area of elements"] / apart.estimates["area of faces"] - 1.0).abs() < 1e-12);
}

#[test]
fn emitter_that_loses_its_place_is_named() {
    let lamps = "v 0 2 0\nv 4 2 0\nv 4 2 4\nv 0 2 4\nv 1 2 1\nv 3 2 1\nv 3 2 2\nv 1 2 2\nusemtl lamp\ng big\nf 1 2 3 4\ng small\nf 5 6 7 8\n";
    for options in [given(), elements(100)] {
        let (_, report) = made(&scene_of(lamps), options);
        assert_eq!(report.warnings.len(), 1, "{:?}", report.warnings);
        assert!(report.warnings[0].contains("emitter (group small)"), "{:?}", report.warnings);
    }
}

/// Merged floor with the lamp of another material in it: one region with a hole.
#[test]
fn region_with_a_hole_is_one_face() {
    let mut text = String::from("usemtl white\n");
    for k in 0..4 {
        for l in 0..4 {
            let (x, y) = (f64::from(k), f64::from(l));
            text += &format!(
                "v {x} {y} 0\nv {} {y} 0\nv {} {} 0\nv {x} {} 0\nf -4 -3 -2 -1\n",
                x + 1.0,
                x + 1.0,
                y + 1.0,
                y + 1.0
            );
        }
    }
    text += "v 1.5 1.5 0\nv 2.5 1.5 0\nv 2.5 2.5 0\nv 1.5 2.5 0\nusemtl lamp\nf -4 -3 -2 -1\n";
    let (mesh, report) = made(&scene_of(&text), elements(200));
    assert_eq!((mesh.face_count(), report.counters["faces merged into regions"]), (2, 15));
    assert_areas(&mesh, 1e-12);
    assert_conforming(&mesh);
    let total: f64 = areas(&mesh).values().sum();
    assert!((total - 16.0).abs() < 1e-12, "{total}");
    // Elements belong to the tile that holds their middle.
    let inputs: std::collections::HashSet<u32> = mesh.element_inputs.iter().copied().collect();
    assert!(inputs.len() >= 16, "{inputs:?}");
}

#[test]
fn elements_of_different_planes_meet_edge_to_edge() {
    for name in ["cornell_blocks.obj", "stress/stress_intersect.obj", "stress/stress_tvertex.obj"] {
        let (mesh, report) = made(&read(name), elements(1500));
        assert_eq!(report.counters.get("planes that do not meet others everywhere").copied().unwrap_or(0), 0);
        let used: std::collections::BTreeSet<_> = mesh.elements.values().iter().copied().collect();
        let all: Vec<DVec3> = used.iter().map(|&v| mesh.position(v)).collect();
        let size = polygon::diameter(&all);
        for element in mesh.element_ids() {
            for (a, b) in polygon::edges(&mesh.element_corners(element)) {
                let (length, along) = (a.distance(b), (b - a).normalize());
                for &v in &all {
                    let t = (v - a).dot(along);
                    let inside = t > 1e-7 * size && t < length - 1e-7 * size;
                    assert!(!inside || v.distance(a + t * along) > 1e-9 * size, "{name}: {v} in {a} {b}");
                }
            }
        }
    }
}

#[test]
fn scenes_warn_of_nothing_that_is_not_so() {
    for name in ["room.obj", "penumbra.obj", "goral_cube.obj", "cornell_empty.obj"] {
        let (_, report) = made(&read(name), elements(3000));
        let others: Vec<_> = report
            .warnings
            .iter()
            .filter(|w| !w.contains("not planar") && !w.contains("need at least"))
            .collect();
        assert!(others.is_empty(), "{name}: {others:?}");
    }
}
