//! Meshed scenes: conforming, of the asked size, with lines where light jumps.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::{FaceId, NodeId};
use interchange::mesh::{Line, Mesh};
use interchange::provenance::Provenance;
use mesh_tool::Options;
use mesh_tool::discontinuity::Order;
use mesh_tool::steps::{Off, Skip};
use std::collections::{HashMap, HashSet};

fn group_face(mesh: &Mesh, name: &str) -> FaceId {
    let group = mesh.groups.iter().position(|g| g == name).unwrap();
    FaceId::new(mesh.face_groups.iter().position(|g| g.index() == group).unwrap())
}

#[test]
fn cornell_box_is_covered_conforming_and_well_shaped() {
    let (mesh, report) = made(&read("cornell_blocks.obj"), elements(3000));
    let count = mesh.element_count() as f64;
    assert!((count / 3000.0 - 1.0).abs() < 0.15, "{count} elements");
    assert_areas(&mesh, 1e-12);
    assert!(assert_conforming(&mesh) > 4000);
    assert!(report.estimates["median smallest angle deg"] > 43.0);
    for order in [Order::D1, Order::D2] {
        let lines = Options { discontinuity: Some(order), ..elements(3000) };
        let (_, report) = made(&read("cornell_blocks.obj"), lines);
        assert_eq!(report.counters["elements below 25 deg"], 0);
        assert_eq!(report.counters["neighbours of more than twice the size"], 0);
        assert!(report.estimates["smallest angle deg"] > 24.999_999);
    }
    assert!(mesh.element_nodes.rows().all(|nodes| nodes.len() == 6));
    // Published vertices are kept to the last bit.
    for vertex in read("cornell_blocks.obj").vertices {
        assert!(mesh.vertices.contains(&vertex), "{vertex:?}");
    }
    // Ceiling and lamp do not overlap: 310915.2 less 13650 remain of the ceiling's rectangle.
    let ceiling: f64 = areas(&mesh)
        .iter()
        .filter(|((face, _), _)| mesh.groups[mesh.face_groups[face.index()].index()] == "ceiling")
        .map(|(_, area)| area)
        .sum();
    assert!((ceiling - 297_265.2).abs() < 1e-6, "{ceiling}");
}

/// Legs 4 cm wide cannot be wide triangles in 6000 elements (43,000 would do): what is narrow is mostly in strips.
#[test]
fn lines_of_a_furnished_room_add_few_narrow_elements() {
    let narrow = |order: Order| {
        let options = Options { discontinuity: Some(order), ..elements(6000) };
        let (mesh, report) = made(&read("room.obj"), options);
        let count = mesh.element_count() as f64;
        assert!((count / 6000.0 - 1.0).abs() <= 0.1, "{count} elements");
        let free = report.counters["elements below 25 deg that no line or border forces"];
        (report.counters["elements below 25 deg"] as f64, free)
    };
    let ((without, _), (with, free)) = (narrow(Order::D0), narrow(Order::D1));
    // Measured 2025 and 2343, of these 292 neither in strips nor at given angles.
    assert!(with < 1.2 * without, "{without} {with}");
    assert!(free < 350, "{free}");
}

/// A length is no budget: beside small elements there is nothing more than twice as large, whatever forces them to be small.
#[test]
fn neighbours_in_a_furnished_room_differ_in_size_by_a_factor_two_at_most() {
    let options = Options { max_edge: Some(0.3), ..Options::default() };
    let (mesh, report) = made(&read("room.obj"), options);
    assert_eq!(report.counters["neighbours of more than twice the size"], 0);
    // 85581 before they were graded.
    assert!(mesh.element_count() < 86_500, "{}", mesh.element_count());
}

/// Four posts, 4 cm wide and ten times as high, on a floor under a lamp.
const POSTS: usize = 4;

fn posts() -> interchange::scene::Scene {
    let mut text = String::from("usemtl white\nv 0 0 0\nv 5 0 0\nv 5 5 0\nv 0 5 0\nf 1 2 3 4\n");
    text += "v 2 2 3\nv 2 3 3\nv 3 3 3\nv 3 2 3\nusemtl lamp\nf 5 6 7 8\nusemtl white\n";
    for post in 0..POSTS {
        let low = [1.31 + 0.57 * post as f64, 1.17 + 0.43 * post as f64, 0.0];
        let size = [0.04, 0.04, 0.42];
        for corner in 0..8 {
            let [x, y, z] =
                [0, 1, 2].map(|axis| low[axis] + if corner >> axis & 1 == 1 { size[axis] } else { 0.0 });
            text += &format!("v {x} {y} {z}\n");
        }
        for ring in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            let [a, b, c, d] = ring.map(|corner| 9 + 8 * post + corner);
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    scene_of(&text)
}

/// A number of elements is a budget, but where it allows even sizes they are even; where it does not, that is counted.
#[test]
fn neighbours_differ_by_a_factor_two_at_most_where_the_number_of_elements_allows() {
    const SKIPPED: &str = "skipped: even sizes, which take more than the number of elements";
    let uneven = "neighbours of more than twice the size";
    // One pair was uneven, and dividing it takes two elements.
    let (mesh, report) = made(&posts(), elements(1000));
    assert_eq!((report.counters[uneven], report.counters[SKIPPED]), (0, 0));
    assert!((900..=1100).contains(&mesh.element_count()), "{}", mesh.element_count());
    // 198 elements, of which 14 would have to be divided, and then 250 in all.
    let (mesh, report) = made(&posts(), elements(200));
    assert!(report.counters[uneven] > 0 && report.counters[SKIPPED] == 1);
    assert!((180..=220).contains(&mesh.element_count()), "{}", mesh.element_count());
    let options = Options { no_skip: Off::new(vec![Skip::Grading]), ..elements(200) };
    let (_, report) = made(&posts(), options);
    assert_eq!(report.counters[uneven], 0);
}

#[test]
fn floor_is_parted_along_the_feet_of_the_blocks() {
    let (mesh, report) = made(&read("cornell_blocks.obj"), elements(2000));
    let floor = group_face(&mesh, "floor");
    assert_eq!(report.counters["contact lines"], 8);
    let lines: Vec<Line> = mesh.lines.iter().copied().filter(|line| line.order == 0).collect();
    assert!(lines.iter().all(|line| line.face == floor));
    // The lines are as long as the feet, and every side wall of a block is the source of some.
    let scene = read("cornell_blocks.obj");
    let foot = |a: usize, b: usize| {
        DVec3::from_array(scene.vertices[a - 1]).distance(DVec3::from_array(scene.vertices[b - 1]))
    };
    let feet: f64 = [(17, 18), (19, 17), (20, 19), (18, 20), (25, 28), (26, 25), (27, 26), (28, 27)]
        .iter()
        .map(|&(a, b)| foot(a, b))
        .sum();
    let length: f64 =
        lines.iter().map(|line| mesh.position(line.from).distance(mesh.position(line.to))).sum();
    assert!((length - feet).abs() < 1e-12 * feet, "{length} against {feet}");
    assert_eq!(lines.iter().map(|line| line.source).collect::<HashSet<_>>().len(), 8);
    // Each line is the border of the floor's elements: what lies under the blocks has none.
    let mut uses: HashMap<[u32; 2], Vec<[NodeId; 3]>> = HashMap::new();
    for element in mesh.element_ids().filter(|&e| mesh.element_face(e) == floor) {
        let (ring, nodes) = (mesh.elements.row(element.index()), mesh.element_nodes.row(element.index()));
        for k in 0..3 {
            let mut key = [ring[k].0, ring[(k + 1) % 3].0];
            let mut ends = [nodes[k], nodes[(k + 1) % 3], nodes[3 + k]];
            if key[0] > key[1] {
                key.swap(0, 1);
                ends.swap(0, 1);
            }
            uses.entry(key).or_default().push(ends);
        }
    }
    for line in &lines {
        let [a, b] = [&line.from, &line.to].map(|v| v.0);
        assert_eq!(uses[&[a.min(b), a.max(b)]].len(), 1);
    }
    let under = mesh.hidden_areas[floor.index()];
    let blocks: f64 = mesh
        .element_ids()
        .filter(|&e| {
            let top = mesh.element_corners(e)[0].y;
            mesh.element_corners(e).iter().all(|c| c.y == top) && (top == 165.0 || top == 330.0)
        })
        .map(|e| polygon::area(&mesh.element_corners(e)))
        .sum();
    assert!((under - blocks).abs() < 1e-9 * blocks, "{under} under blocks of {blocks}");
    // Any other inner edge of the floor shares its three nodes.
    let lines: HashSet<[u32; 2]> =
        lines.iter().map(|l| [l.from.0.min(l.to.0), l.from.0.max(l.to.0)]).collect();
    for (edge, sides) in uses.iter().filter(|(edge, sides)| sides.len() == 2 && !lines.contains(*edge)) {
        assert_eq!(sides[0], sides[1], "edge {edge:?}");
    }
}

#[test]
fn no_edge_is_longer_than_asked() {
    for (name, length) in
        [("cornell_blocks.obj", 60.0), ("goral_cube.obj", 0.17), ("stress/stress_intersect.obj", 0.1)]
    {
        let (mesh, report) = made(&read(name), max_edge(length));
        // Positions in space are rounded once more than the coordinates in the plane that are compared.
        let longest = report.estimates["longest edge"];
        assert!(longest <= length * (1.0 + 1e-12), "{name}: {longest}");
        assert_areas(&mesh, 1e-12);
        assert_conforming(&mesh);
    }
}

#[test]
fn finer_of_the_two_sizes_wins() {
    let scene = read("goral_cube.obj");
    let count = |elements, max_edge| {
        made(&scene, mesh_tool::Options { elements, max_edge, ..given() }).0.element_count() as f64
    };
    let fine = count(None, Some(0.1));
    assert_eq!(count(Some(100), Some(0.1)), fine);
    assert!((count(Some(3000), Some(0.9)) / 3000.0 - 1.0).abs() < 0.15);
}

#[test]
fn asked_number_of_elements_is_met() {
    for name in [
        "cornell_empty.obj",
        "goral_cube.obj",
        "penumbra.obj",
        "stress/stress_tvertex.obj",
        "stress/stress_intersect.obj",
    ] {
        for wanted in [300, 1000, 4000] {
            let count = made(&read(name), elements(wanted)).0.element_count();
            assert!((count as f64 / f64::from(wanted) - 1.0).abs() < 0.15, "{name}: {count} for {wanted}");
        }
    }
}

#[test]
fn faces_of_one_plane_conform_although_they_were_given_with_t_vertices() {
    let (mesh, _) = made(&read("stress/stress_tvertex.obj"), elements(1200));
    assert_areas(&mesh, 1e-12);
    assert_conforming(&mesh);
    // One floor of seven faces: every place of it has one node, no seam.
    let floor: Vec<_> =
        mesh.element_ids().filter(|&e| mesh.element_corners(e).iter().all(|c| c.y == 0.0)).collect();
    let pairs: HashSet<_> = floor
        .iter()
        .flat_map(|e| mesh.element_nodes.row(e.index()).iter().map(|n| (*n, mesh.node_vertices[n.index()])))
        .collect();
    let places: HashSet<_> = pairs.iter().map(|(_, vertex)| *vertex).collect();
    assert_eq!(pairs.len(), places.len());
}

#[test]
fn overlapping_floor_is_meshed_once() {
    let (mesh, report) = made(&read("stress/stress_coplanar.obj"), elements(1000));
    assert!((report.estimates["area of elements"] - 6.0).abs() < 1e-12);
    assert_eq!(report.counters["overlapping faces cut"], 1);
    assert_conforming(&mesh);
}

#[test]
fn slivers_stay_slivers_and_cost_nothing() {
    let (mesh, _) = made(&read("stress/stress_sliver.obj"), elements(1000));
    assert_areas(&mesh, 1e-9);
    assert_conforming(&mesh);
    let thin = mesh.element_ids().filter(|&e| polygon::area(&mesh.element_corners(e)) < 1e-6).count();
    assert!(thin < 60, "{thin}");
}

/// Area of all elements of a scene as given.
fn read_area(scene: &interchange::scene::Scene) -> f64 {
    let (mesh, _) = made(scene, given());
    mesh.element_ids().map(|e| polygon::area(&mesh.element_corners(e))).sum()
}

#[test]
fn scene_in_another_unit_has_the_same_elements() {
    for name in ["cornell_blocks.obj", "stress/stress_intersect.obj"] {
        let scene = read(name);
        // About as long as 1500 equal elements' edges.
        let length = (3.0 * read_area(&scene) / 1500.0).sqrt();
        let of_order = |order, options| Options { discontinuity: Some(order), ..options };
        let asked: [&dyn Fn(f64) -> Options; 3] = [
            &|factor| of_order(Order::D1, max_edge(length * factor)),
            &|_| of_order(Order::D1, elements(1500)),
            &|_| of_order(Order::D2, elements(1500)),
        ];
        for (k, options) in asked.iter().enumerate() {
            let (mesh, _) = made(&scene, options(1.0));
            // No power of two: all coordinates are rounded anew.
            for factor in [1e-6, 3.7e-3, 1e6] {
                let (other, _) = made(&scaled(&scene, factor), options(factor));
                assert!(other.elements == mesh.elements, "{name}, options {k}, x {factor}");
                assert_eq!(other.element_nodes, mesh.element_nodes);
                assert_eq!(other.lines, mesh.lines);
                assert_eq!(other.clusters, mesh.clusters);
            }
        }
    }
}

#[test]
fn same_bytes_for_any_number_of_threads() {
    let scene = read("stress/stress_intersect.obj");
    let folder = tempfile::tempdir().unwrap();
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mesh = pool.install(|| made(&scene, elements(1500)).0);
        let path = folder.path().join(format!("{threads}.mesh"));
        mesh.write(&path, Provenance::new("t", "t")).unwrap();
        std::fs::read(path).unwrap()
    };
    let one = bytes(1);
    assert!([2, 3, 7].into_iter().all(|threads| bytes(threads) == one));
}

#[test]
fn two_sided_plate_on_the_floor_parts_it_and_has_equal_sides() {
    let plate = "v 1 0 2\nv 3 0 2\nv 3 1 2\nv 1 1 2\nusemtl both\nf 5 6 7 8\n";
    let (mesh, _) = made(&scene_of(&(floor_text(0.0, 4.0) + plate)), elements(600));
    assert_areas(&mesh, 1e-12);
    assert_conforming(&mesh);
    let rings = |side: u32| -> HashSet<Vec<u32>> {
        (0..mesh.element_count())
            .filter(|&e| mesh.element_faces[e].0 == 1 && mesh.element_sides[e] == side)
            .map(|e| {
                let mut ring: Vec<u32> = mesh.elements.row(e).iter().map(|v| v.0).collect();
                if side == 1 {
                    ring.reverse();
                }
                let least = (0..3).min_by_key(|&k| ring[k]).unwrap();
                ring.rotate_left(least);
                ring
            })
            .collect()
    };
    assert_eq!(rings(0), rings(1));
    // Along the plate's foot both sides have their own nodes, at its two ends one.
    let nodes_at = |x: f64| {
        let on_floor = mesh.element_ids().filter(|&e| mesh.element_face(e) == FaceId(0));
        let nodes: HashSet<NodeId> =
            on_floor.flat_map(|e| mesh.element_nodes.row(e.index()).to_vec()).collect();
        let at = |n: &&NodeId| {
            mesh.position(mesh.node_vertices[n.index()]).distance(DVec3::new(x, 0.0, 2.0)) < 1e-12
        };
        nodes.iter().filter(at).count()
    };
    let length: f64 =
        mesh.lines.iter().map(|line| mesh.position(line.from).distance(mesh.position(line.to))).sum();
    assert!((length - 2.0).abs() < 1e-12);
    assert_eq!((nodes_at(1.0), nodes_at(2.0), nodes_at(3.0)), (1, 2, 1));
}

#[test]
fn wall_that_touches_only_the_back_draws_no_line() {
    let below = "v 1 0 2\nv 3 0 2\nv 3 -1 2\nv 1 -1 2\nusemtl white\nf 5 6 7 8\n";
    let (mesh, report) = made(&scene_of(&(floor_text(0.0, 4.0) + below)), elements(200));
    assert_eq!((mesh.lines.len(), report.counters["contact lines"]), (0, 0));
}
