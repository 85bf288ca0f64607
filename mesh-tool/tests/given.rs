//! Elements as given: nothing is cut that need not be.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::polygon;
use interchange::ids::{ElementId, FaceId};

#[test]
fn cube_keeps_its_six_faces_with_their_corners_in_order() {
    let scene = read("goral_cube.obj");
    let (mesh, _) = made(&scene, given());
    assert_eq!(mesh.element_count(), 6);
    assert_eq!((mesh.face_count(), mesh.occluders.len(), mesh.lines.len()), (6, 6, 0));
    for element in mesh.element_ids() {
        let face = mesh.element_face(element);
        let input = &scene.faces[mesh.face_inputs[face.index()] as usize];
        let corners: Vec<[f64; 3]> = input.corners.iter().map(|&c| scene.vertices[c as usize]).collect();
        let got: Vec<[f64; 3]> =
            mesh.element_corners(element).into_iter().map(|corner| corner.to_array()).collect();
        assert_eq!(got, corners);
        assert_eq!(mesh.element_nodes.row(element.index()).len(), 4);
    }
}

#[test]
fn cornell_box_stays_whole_but_for_its_bent_wall() {
    let (mesh, report) = made(&read("cornell_blocks.obj"), given());
    assert_eq!(mesh.element_count(), 20);
    assert_areas(&mesh, 1e-14);
    assert_eq!(report.counters["non-planar faces cut"], 1);
    let red = mesh.materials.iter().position(|name| name == "red").unwrap() as u32;
    assert_eq!(mesh.face_materials.iter().filter(|m| m.0 == red).count(), 2);
    // Each corner of the wall lies 3.2 units off the plane of the other three; its side is 554.
    let deviation = report.estimates["largest plane deviation"];
    assert!((5.5e-3..6.1e-3).contains(&deviation), "{deviation}");
}

#[test]
fn coplanar_floor_given_twice_and_overlapped_counts_once() {
    let (mesh, report) = made(&read("stress/stress_coplanar.obj"), given());
    assert_eq!(report.counters["dropped duplicates"], 1);
    assert_eq!(report.counters["overlapping faces cut"], 1);
    // The sub-rectangle lies wholly in the floor, which was given first: it keeps no element.
    assert_eq!((mesh.element_count(), mesh.face_count()), (6, 7));
    assert!((report.estimates["area of elements"] - 6.0).abs() < 1e-14);
}

#[test]
fn emitter_in_a_ceiling_wins_and_the_ceiling_is_cut_around_it() {
    let ceiling = "v 0 2 0\nv 4 2 0\nv 4 2 4\nv 0 2 4\nusemtl white\nf 1 2 3 4\n";
    let lamp = "v 1 2 1\nv 3 2 1\nv 3 2 2\nv 1 2 2\nusemtl lamp\nf 5 6 7 8\n";
    let (mesh, report) = made(&scene_of(&format!("{ceiling}{lamp}")), given());
    let areas = areas(&mesh);
    assert!((areas[&(FaceId(0), 0)] - 14.0).abs() < 1e-13);
    assert!((areas[&(FaceId(1), 0)] - 2.0).abs() < 1e-14);
    assert_eq!(report.counters["overlapping faces cut"], 1);
    // At most two pieces per reflex corner and one more, besides the lamp; the least possible are four.
    assert!((5..=10).contains(&mesh.element_count()), "{}", mesh.element_count());
}

#[test]
fn duplicates_of_one_orientation_go_and_of_opposite_orientation_stay() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let turned = format!("{corners}usemtl white\nf 1 2 3 4\nf 3 4 1 2\nf 4 3 2 1\n");
    let (mesh, report) = made(&scene_of(&turned), given());
    assert_eq!((mesh.element_count(), report.counters["dropped duplicates"]), (2, 1));
    let lamp_second = format!("{corners}usemtl white\nf 1 2 3 4\nusemtl lamp\nf 2 3 4 1\nf 3 4 1 2\n");
    let (mesh, report) = made(&scene_of(&lamp_second), given());
    assert_eq!((mesh.element_count(), mesh.face_inputs[0]), (1, 1));
    assert_eq!(report.counters["dropped duplicates"], 2);
    assert!(
        report.warnings.iter().any(|w| w.contains("emitter") && w.contains("s.obj:10")),
        "{:?}",
        report.warnings
    );
}

#[test]
fn boxes_through_each_other_and_through_the_floor_are_cut_and_keep_their_area() {
    let (mesh, report) = made(&read("stress/stress_intersect.obj"), given());
    assert_areas(&mesh, 1e-13);
    // The floor, four sides of the first box, its right side pierced by the second, and the second's four sides.
    assert_eq!(report.counters["crossing faces cut"], 9);
    // No element is crossed by another face in its interior: the cut floor has one element inside the box.
    let inside = mesh.element_ids().filter(|&e| {
        let c = polygon::centroid(&mesh.element_corners(e));
        c.y.abs() < 1e-12 && (0.2..0.55).contains(&c.x) && (0.3..0.6).contains(&c.z)
    });
    let area: f64 = inside.map(|e| polygon::area(&mesh.element_corners(e))).sum();
    assert!((area - 0.35 * 0.3).abs() < 1e-14, "{area}");
}

#[test]
fn blocks_that_only_stand_on_the_floor_do_not_cut_it() {
    let text = floor_text(0.0, 4.0) + &box_text([1.0, 0.0, 1.0], [2.0, 1.0, 2.0], true, 5);
    let (mesh, _) = made(&scene_of(&text), given());
    assert_eq!(mesh.element_count(), 7);
}

#[test]
fn two_sided_face_gives_two_elements_with_reversed_corners_and_blocks_once() {
    let (mesh, _) = made(&scene_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl both\nf 1 2 3 4\n"), given());
    assert_eq!((mesh.element_count(), mesh.occluders.len()), (2, 1));
    let [front, back] = [0, 1].map(|side| {
        let index = mesh.element_sides.iter().position(|&s| s == side).unwrap();
        mesh.elements.row(index).to_vec()
    });
    assert_eq!(back, front.iter().rev().copied().collect::<Vec<_>>());
    let shared = mesh.element_nodes.row(0).iter().any(|n| mesh.element_nodes.row(1).contains(n));
    assert!(!shared, "nodes of the two sides differ");
    assert_eq!(mesh.element_face(ElementId(0)), mesh.element_face(ElementId(1)));
}

#[test]
fn two_sided_sheet_given_once_per_side_counts_each_side_once() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl both\nf 1 2 3 4\nf 4 3 2 1\n";
    for options in [given(), elements(100)] {
        let (mesh, report) = made(&scene_of(text), options);
        assert!((report.estimates["area of elements"] - 2.0).abs() < 1e-13);
        // The fronts win over the backs.
        assert!(mesh.element_sides.iter().all(|&side| side == 0));
    }
}

#[test]
fn concave_and_holed_faces_fall_into_convex_pieces() {
    let ell = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nusemtl white\nf 1 2 3 4 5 6\n";
    let (mesh, _) = made(&scene_of(ell), given());
    assert!(mesh.element_count() <= 3 && mesh.element_count() == mesh.occluders.len());
    assert_eq!(mesh.face_count(), 1);
    assert_areas(&mesh, 1e-15);
    let holed = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nusemtl white\nf 1 2 3 4 1 5 6 7 8 5\n";
    let (mesh, report) = made(&scene_of(holed), given());
    assert!((report.estimates["area of elements"] - 8.0).abs() < 1e-14);
    assert!(mesh.element_count() <= 9);
}

#[test]
fn polygon_that_crosses_itself_is_refused_with_its_line() {
    let message = refused(&scene_of("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nusemtl white\nf 1 2 3 4\n"));
    assert!(message.contains("s.obj:7") && message.contains("crosses itself"), "{message}");
    let message = refused(&scene_of("v 1 1 1\nv 2 2 2\nv 3 3 3\nusemtl white\nf 1 2 3\n"));
    assert!(message.contains("no face with area"), "{message}");
}

#[test]
fn zero_area_faces_are_dropped_and_counted() {
    let (mesh, report) = made(&read("stress/stress_zeroarea.obj"), given());
    assert_eq!((mesh.element_count(), report.counters["dropped zero area"]), (6, 3));
    assert_eq!((mesh.face_count(), mesh.input_face_count), (6, 9));
    assert_eq!(report.warnings.len(), 1);
}

#[test]
fn scene_in_another_unit_or_place_has_the_same_elements() {
    for name in ["cornell_blocks.obj", "stress/stress_intersect.obj", "stress/stress_coplanar.obj"] {
        let scene = read(name);
        let (mesh, _) = made(&scene, given());
        for factor in [1e-6, 1e6] {
            let (other, _) = made(&scaled(&scene, factor), given());
            assert_eq!(other.elements, mesh.elements, "{name} x {factor}");
            assert_eq!(other.element_nodes, mesh.element_nodes);
        }
    }
}
