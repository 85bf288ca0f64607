//! `export` and `info` on the files of a cube whose factors are known.
#![allow(clippy::unwrap_used)]

#[path = "../../solve-tool/tests/common/room.rs"]
mod room;

use formfactor_tool::{export, info};
use interchange::grouping::By;
use interchange::matrix::{self, Block, BlockKind, Matrix, Values};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use room::{ADJACENT, OPPOSITE, Room, factor};

fn exported(room: &Room, by: By, name: &str) -> Vec<u8> {
    let output = room.path(name);
    export::run(&[&room.matrix], &room.mesh, by, None, &output).unwrap();
    std::fs::read(output).unwrap()
}

fn text(room: &Room, by: By, name: &str) -> String {
    String::from_utf8(exported(room, by, name)).unwrap()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split(',').map(|cell| cell.parse().unwrap()).collect()
}

fn assert_close(got: f64, want: f64) {
    assert!((got - want).abs() < 1e-15, "got {got}, want {want}");
}

#[test]
fn groups_are_summed_and_named() {
    let room = Room::new([0.5; 3], 0.0);
    let table = text(&room, By::Group, "f.csv");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0], "group,walls,\"floor, polished\",ceiling");
    // Four walls: of what one emits, three others get their share, floor and ceiling the rest.
    let walls = numbers(lines[1].strip_prefix("walls,").unwrap());
    assert_close(walls[0], OPPOSITE + 2.0 * ADJACENT);
    assert_close(walls[1], ADJACENT);
    let floor = numbers(lines[2].strip_prefix("\"floor, polished\",").unwrap());
    assert_close(floor[0], 4.0 * ADJACENT);
    assert_eq!((floor[1], floor[2]), (0.0, OPPOSITE));
}

#[test]
fn faces_are_numbered_as_in_the_scene_and_dropped_ones_are_zero() {
    let room = Room::new([0.5; 3], 0.0);
    let table = text(&room, By::Face, "f.csv");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "face,1,2,3,4,5,6,7");
    assert_eq!(lines[2], "2,0,0,0,0,0,0,0");
    // Face 1 is element 0, face 3 element 1 (opposite), face 4 element 2.
    assert_eq!(numbers(lines[1])[1..5], [0.0, 0.0, OPPOSITE, ADJACENT]);
}

#[test]
fn elements_as_npy_and_matrix_market() {
    let room = Room::new([0.5; 3], 0.0);
    let npy = exported(&room, By::Element, "f.npy");
    let header = String::from_utf8_lossy(&npy[10..128]).into_owned();
    assert!(header.contains("'<f8'") && header.contains("(6, 6"), "{header}");
    let entry = |k: usize| f64::from_le_bytes(npy[npy.len() - 8 * (36 - k)..][..8].try_into().unwrap());
    (0..36).for_each(|k| assert_eq!(entry(k), factor(k / 6, k % 6)));

    let table = text(&room, By::Element, "f.mtx");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "%%MatrixMarket matrix coordinate real general");
    let size: Vec<usize> = lines[2].split_whitespace().map(|n| n.parse().unwrap()).collect();
    assert_eq!(size, [6, 6, 30]);
    assert_eq!(lines.len(), 3 + 30);
    for line in &lines[3..] {
        let cells: Vec<&str> = line.split(' ').collect();
        let index = |k: usize| cells[k].parse::<usize>().unwrap() - 1;
        assert_eq!(cells[2].parse::<f64>().unwrap(), factor(index(0), index(1)));
    }
}

/// Elements of different areas, and both sides of a two-sided face: F(i -> j) is the sum of S over the sum of A.
#[test]
fn both_sides_of_a_face_are_summed() {
    let room = Room::new([0.5; 3], 0.0);
    // The floor's face gets a second element, its back; elements 4 and 5 now belong to face 4.
    let mut mesh = room::mesh();
    mesh.element_faces[5] = interchange::ids::FaceId(4);
    mesh.element_sides[5] = 1;
    mesh.write(&room.mesh, Provenance::new("test", "1")).unwrap();
    let digest = Mesh::read(&room.mesh).unwrap().2;
    let old = Matrix::open(&room.matrix).unwrap();
    let record = matrix::MatrixRecord { mesh: digest, ..old.record().clone() };
    drop(old);
    let areas = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0];
    let mut values = [0.0f64; 21];
    values[4] = 0.1; // (0, 4)
    values[5] = 0.3; // (0, 5)
    values[19] = 0.0; // (4, 5)
    let blocks = [Block::new(BlockKind::Triangle, 0..6, 0..6, 0)];
    let provenance = Provenance::new("test", "1");
    matrix::write(&room.matrix, provenance, record, &blocks, Values::F64(&values), &areas, &[0.0; 6])
        .unwrap();
    let table = text(&room, By::Group, "f.csv");
    let lines: Vec<&str> = table.lines().collect();
    let walls = numbers(lines[1].strip_prefix("walls,").unwrap());
    assert_close(walls[1], 0.4 / 4.0);
    let floor = numbers(lines[2].strip_prefix("\"floor, polished\",").unwrap());
    assert_close(floor[0], 0.4 / 4.0);
    // The ceiling's face has lost its element.
    assert_eq!(lines[3], "ceiling,0,0,0");
}

#[test]
fn a_foreign_mesh_and_an_unknown_ending_are_refused() {
    let room = Room::new([0.5; 3], 0.0);
    let refusal = |name: &str| {
        export::run(&[&room.matrix], &room.mesh, By::Group, None, &room.path(name)).unwrap_err().to_string()
    };
    assert!(refusal("f.txt").contains(".csv, .npy, .npz, .mtx, .rmx, .vf"));
    let meant = refusal("f.npi");
    assert!(meant.contains(&format!("did you mean {}?", room.path("f.npy").display())), "{meant}");
    let mut mesh = room::mesh();
    mesh.vertices[0][0] = -0.5;
    mesh.write(&room.mesh, Provenance::new("test", "1")).unwrap();
    assert!(refusal("f.csv").contains("do not belong together"));
    assert!(!room.path("f.csv").exists());
}

#[test]
fn info_shows_size_row_sums_and_errors() {
    let room = Room::new([0.5; 3], 1e-9);
    let words = info::describe(&[&room.matrix], false, true).unwrap();
    for part in ["elements     6", "21 entries (f64) in 3 blocks", "closed", "1e-4 asked", "1.000000e-9"] {
        assert!(words.contains(part), "{part}:\n{words}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&info::describe(&[&room.matrix], true, true).unwrap()).unwrap();
    assert_eq!((json["elements"].as_u64(), json["blocks"].as_u64()), (Some(6), Some(3)));
    assert_eq!(json["stored_entries"], 21);
    assert_eq!(json["absent_share"], 0.0);
    assert!((json["row_sums"]["mean"].as_f64().unwrap() - 1.0).abs() < 1e-14);
    assert_eq!(json["report"], serde_json::Value::Null);
}
