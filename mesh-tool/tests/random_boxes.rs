//! Random boxes standing on a floor, crossing it and each other: no failure, no area lost or counted twice.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::plane::Plane;
use geometry::polygon;
use glam::DVec3;
use interchange::mesh::Mesh;
use interchange::scene::Scene;
use mesh_tool::Options;
use mesh_tool::steps::{Off, Step};
use proptest::prelude::*;

fn scene_text(boxes: &[([f64; 3], [f64; 3])], bottoms: bool) -> String {
    let mut text = floor_text(-2.0, 3.0);
    for (k, &(low, size)) in boxes.iter().enumerate() {
        let high = [0, 1, 2].map(|axis| low[axis] + size[axis]);
        text += &box_text(low, high, bottoms, 5 + 8 * k);
    }
    text
}

fn any_box() -> impl Strategy<Value = ([f64; 3], [f64; 3])> {
    let stands = prop_oneof![Just(0.0), -0.5..0.5f64];
    ((-1.0..1.0f64, stands, -1.0..1.0f64), (0.01..1.5f64, 0.6..1.5f64, 0.01..1.5f64))
        .prop_map(|((x, y, z), (a, b, c))| ([x, y, z], [a, b, c]))
}

/// Boxes on a coarse grid: most faces coincide, touch or overlap.
fn any_grid_box() -> impl Strategy<Value = ([f64; 3], [f64; 3])> {
    let step = |range: std::ops::Range<i32>| range.prop_map(|k| f64::from(k) * 0.1);
    ((step(-9..9), step(-3..3), step(-9..9)), (step(1..12), step(1..12), step(1..12)))
        .prop_map(|((x, y, z), (a, b, c))| ([x, y, z], [a, b, c]))
}

/// Asserts that every place of a face side is held by exactly one element among those in its plane that look the same way.
fn assert_held_once(mesh: &Mesh, scene: &Scene, scale: f64) {
    let planes = planes(mesh);
    for face in &scene.faces {
        let corners: Vec<DVec3> =
            face.corners.iter().map(|&v| DVec3::from_array(scene.vertices[v as usize])).collect();
        let plane = Plane::of_polygon(&corners).unwrap();
        for (s, t) in [(0.31, 0.42), (0.113, 0.871), (0.777, 0.0917), (0.5057, 0.6113)] {
            let point = corners[0] + s * (corners[1] - corners[0]) + t * (corners[3] - corners[0]);
            let (mut held, mut near_edge) = (0, false);
            for elements in &planes {
                let first = mesh.element_corners(elements[0]);
                let own = Plane::of_polygon(&first).unwrap();
                if own.normal.dot(plane.normal) < 0.999 || own.distance(point).abs() > 1e-8 * scale {
                    continue;
                }
                for &element in elements {
                    let corners = mesh.element_corners(element);
                    let depth = polygon::edges(&corners)
                        .map(|(a, b)| (b - a).normalize().cross(point - a).dot(plane.normal))
                        .fold(f64::INFINITY, f64::min);
                    near_edge |= depth.abs() < 1e-7 * scale;
                    held += usize::from(depth > 0.0);
                }
            }
            assert!(near_edge || held == 1, "{:?} at {point:?}: held by {held} elements", face.corners);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn boxes_anywhere_keep_their_area(boxes in prop::collection::vec(any_box(), 1..6), power in -6..=6i32) {
        let scene = scaled(&scene_of(&scene_text(&boxes, false)), 10f64.powi(power));
        for options in [given(), elements(700)] {
            let (mesh, report) = made(&scene, options);
            assert_areas(&mesh, 1e-9);
            let shown = report.estimates["area of elements"];
            let hidden = report.estimates.get("hidden area").copied().unwrap_or(0.0);
            prop_assert!(((shown + hidden) / report.estimates["area of faces"] - 1.0).abs() < 1e-9);
            if mesh.element_nodes.row(0).len() == 6 {
                assert_conforming(&mesh);
            }
        }
    }

    #[test]
    fn boxes_on_a_grid_are_held_once_everywhere(boxes in prop::collection::vec(any_grid_box(), 1..6), power in -6..=6i32) {
        let scale = 10f64.powi(power);
        let scene = scaled(&scene_of(&scene_text(&boxes, true)), scale);
        let all = Options { no_clean: Off::new(vec![Step::Hidden]), ..elements(500) };
        for options in [given(), all] {
            let (mesh, _) = made(&scene, options);
            assert_held_once(&mesh, &scene, scale);
            if mesh.element_nodes.row(0).len() == 6 {
                assert_conforming(&mesh);
            }
        }
    }

    #[test]
    fn turned_boxes_keep_their_area(boxes in prop::collection::vec(any_box(), 1..5), axis in (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), angle in 0.1..3.0f64) {
        let mut scene = scene_of(&scene_text(&boxes, false));
        let axis = DVec3::new(axis.0, axis.1, axis.2 + 1.5).normalize();
        let turn = glam::DQuat::from_axis_angle(axis, angle);
        let shift = DVec3::new(100.0, -30.0, 7.0);
        for vertex in &mut scene.vertices {
            *vertex = (shift + turn * DVec3::from_array(*vertex)).to_array();
        }
        for options in [given(), elements(400)] {
            assert_areas(&made(&scene, options).0, 1e-9);
        }
    }

    #[test]
    fn nearly_coinciding_boxes_never_fail(
        boxes in prop::collection::vec(any_grid_box(), 2..6),
        seed in 0..1000u64,
        power in 5..=14i32,
    ) {
        let mut scene = scene_of(&scene_text(&boxes, true));
        let mut state = seed;
        let mut jitter = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            10f64.powi(-power) * ((state >> 33) as f64 / f64::from(1u32 << 30) - 1.0)
        };
        for vertex in &mut scene.vertices {
            *vertex = vertex.map(|x| x + jitter());
        }
        for options in [given(), elements(300)] {
            made(&scene, options);
        }
    }
}
