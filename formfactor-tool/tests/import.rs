//! Factors out and in again in every format, and what is said of those that are wrong.
#![allow(clippy::unwrap_used)]

#[path = "../../solve-tool/tests/common/room.rs"]
mod room;

use formfactor_tool::closure::Closure;
use formfactor_tool::import::{Reciprocity, Request, Rows, Wishes, run};
use formfactor_tool::options::PrecisionName;
use formfactor_tool::{compare, export};
use interchange::grouping::By;
use interchange::matrix::Matrix;
use interchange::report::Report;
use interchange::tool::Finish;
use room::{ADJACENT, OPPOSITE, Room, factor};
use std::path::{Path, PathBuf};

fn wishes() -> Wishes {
    Wishes {
        by: Rows::Element,
        tolerance: None,
        reciprocity: Reciprocity::Mean,
        precision: PrecisionName::F64,
        closure: Closure::Off,
    }
}

fn request(room: &Room, table: PathBuf, wishes: Wishes) -> Request {
    Request { table, mesh: room.mesh.clone(), output: room.path("in.ff"), wishes }
}

fn imported(
    room: &Room,
    name: &str,
    content: impl AsRef<[u8]>,
    wishes: Wishes,
) -> (Finish, Matrix, serde_json::Value) {
    let table = room.path(name);
    std::fs::write(&table, content).unwrap();
    let request = request(room, table, wishes);
    let finish = run(&request).unwrap();
    let report = std::fs::read_to_string(Report::path_for(&request.output)).unwrap();
    (finish, Matrix::open(&request.output).unwrap(), serde_json::from_str(&report).unwrap())
}

fn refusal(room: &Room, name: &str, content: impl AsRef<[u8]>) -> String {
    let table = room.path(name);
    std::fs::write(&table, content).unwrap();
    format!("{:#}", run(&request(room, table, wishes())).unwrap_err())
}

/// The room's factors as lines of text.
fn lines(factor: impl Fn(usize, usize) -> f64) -> String {
    let line = |i| (0..6).map(|j| factor(i, j).to_string()).collect::<Vec<_>>().join(",") + "\n";
    (0..6).map(line).collect()
}

fn difference(room: &Room, other: &Path) -> f64 {
    compare::Difference::between(&room.matrix, other, None).unwrap().worst_row().1
}

#[test]
fn every_format_comes_back() {
    let room = Room::new([0.5; 3], 0.0);
    for ending in ["csv", "npy", "npz", "mtx", "rmx", "vf"] {
        let table = room.path(&format!("f.{ending}"));
        export::run(&[&room.matrix], &room.mesh, By::Element, None, &table).unwrap();
        let request = request(&room, table, wishes());
        assert_eq!(run(&request).unwrap(), Finish::Done);
        let differs = difference(&room, &request.output);
        // View3D writes six decimals; all others give every bit back.
        let most = if ending == "vf" { 5.0 * 0.5e-6 } else { 0.0 };
        assert!(differs <= most, "{ending}: {differs:e}");
    }
}

#[test]
fn archives_and_matrices_are_what_their_programs_write() {
    let room = Room::new([0.5; 3], 0.0);
    let bytes = |name: &str| {
        let table = room.path(name);
        export::run(&[&room.matrix], &room.mesh, By::Element, None, &table).unwrap();
        std::fs::read(table).unwrap()
    };
    let npz = bytes("f.npz");
    let text = String::from_utf8_lossy(&npz);
    for name in ["indices.npy", "indptr.npy", "format.npy", "shape.npy", "data.npy"] {
        assert_eq!(text.matches(name).count(), 2, "{name}");
    }
    assert_eq!(bytes("f.npz"), npz);
    let rmx = bytes("f.rmx");
    let header = "#?RADIANCE\nSOFTWARE= formfactor-tool export\nNROWS=6\nNCOLS=6\nNCOMP=1\nBigEndian=0\nFORMAT=double\n\n";
    assert!(rmx.starts_with(header.as_bytes()));
    assert_eq!(rmx.len(), header.len() + 36 * 8);
    assert_eq!(rmx[header.len() + 8..][..8], OPPOSITE.to_le_bytes());
    let view3d = String::from_utf8(bytes("f.vf")).unwrap();
    let lines: Vec<&str> = view3d.lines().collect();
    assert_eq!((lines.len(), lines[0].len()), (9, 30));
    assert_eq!(lines[1].split(' ').next(), Some("1.00000e0"));
    assert_eq!(lines[2], "0.000000 0.199825 0.200044 0.200044 0.200044 0.200044");
}

#[test]
fn other_ways_to_write_the_same_are_read() {
    let room = Room::new([0.5; 3], 0.0);
    let same = |name: &str, content: &[u8], most: f64| {
        let (finish, matrix, _) = imported(&room, name, content, wishes());
        assert_eq!(finish, Finish::Done);
        let differs = difference(&room, matrix.path());
        assert!(differs <= most, "{name}: {differs:e}");
    };
    same("plain.csv", lines(factor).as_bytes(), 0.0);
    same("blanks.txt", lines(factor).replace(',', "  ").as_bytes(), 0.0);
    same("semicolons.csv", lines(factor).replace(',', ";").as_bytes(), 0.0);
    let mut symmetric = "%%MatrixMarket matrix coordinate real symmetric\n% note\n6 6 15\n".to_owned();
    (1..6).for_each(|i| (0..i).for_each(|j| symmetric += &format!("{} {} {}\n", i + 1, j + 1, factor(i, j))));
    same("s.mtx", symmetric.as_bytes(), 0.0);
    let mut array = "%%MatrixMarket matrix array real general\n6 6\n".to_owned();
    (0..36).for_each(|k| array += &format!("{}\n", factor(k % 6, k / 6)));
    same("a.mtx", array.as_bytes(), 0.0);
    let ascii: String = (0..36).map(|k| format!("{0}\t{0}\t{0}\n", factor(k / 6, k % 6))).collect();
    same("a.rmx", format!("#?RADIANCE\nNROWS=6\nNCOLS=6\nNCOMP=3\nFORMAT=ascii\n\n{ascii}").as_bytes(), 0.0);
    let floats: Vec<u8> = (0..36).flat_map(|k| (factor(k / 6, k % 6) as f32).to_be_bytes()).collect();
    let header = b"#?RADIANCE\nNROWS=6\nNCOLS=6\nNCOMP=1\nBigEndian=1\nFORMAT=float\n\n";
    same("f.rmx", &[&header[..], &floats].concat(), 6.0 * 1e-8);
    // A chain of programs: what each has written before is shifted to the right, and of two formats the last one holds.
    let doubles: Vec<u8> = (0..36).flat_map(|k| (4.0 * factor(k / 6, k % 6)).to_le_bytes()).collect();
    let header = b"#?RADIANCE\nrmtxop -fd a.rmx\n\tNCOMP=3\nEXPOSURE= 4\nNROWS=6\nNCOLS=6\nNCOMP=1\nFORMAT=float\nBigEndian=0\nFORMAT=double\n\n";
    same("d.rmx", &[&header[..], &doubles].concat(), 0.0);
}

#[test]
fn both_sides_of_a_pair_are_averaged_or_kept_and_it_is_said() {
    let room = Room::new([0.5; 3], 0.0);
    let lopsided = |i, j| if (i, j) == (0, 1) { OPPOSITE + 0.02 } else { factor(i, j) };
    let (_, matrix, report) = imported(&room, "f.csv", lines(lopsided), wishes());
    assert!(matrix.record().symmetric);
    let errors = matrix.row_errors().unwrap();
    // Half of the difference; what row 0 exceeds 1 by is more.
    assert!((errors[1] - 0.01).abs() < 1e-12 && (errors[0] - 0.02).abs() < 1e-12, "{errors:?}");
    assert!((difference(&room, matrix.path()) - 0.01).abs() < 1e-12);
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("1 row sums up to more than 1, most that of element 1: 1.02"), "{warnings}");
    assert!(warnings.contains("the pair of elements 1 and 2"), "{warnings}");

    let keep = Wishes { reciprocity: Reciprocity::Keep, tolerance: Some(1e-3), ..wishes() };
    let (finish, matrix, _) = imported(&room, "f.csv", lines(lopsided), keep);
    assert!(matches!(finish, Finish::ToleranceMissed(_)));
    assert!(!matrix.record().symmetric);
    let table = room.path("out.csv");
    export::run(&[matrix.path()], &room.mesh, By::Element, None, &table).unwrap();
    let text = std::fs::read_to_string(&table).unwrap();
    let cell = |row: usize, column: usize| {
        text.lines().nth(row).unwrap().split(',').nth(column).unwrap().parse::<f64>().unwrap()
    };
    assert_eq!((cell(1, 2), cell(2, 1), cell(1, 3)), (OPPOSITE + 0.02, OPPOSITE, ADJACENT));
}

#[test]
fn factors_by_face_find_their_elements() {
    let room = Room::new([0.5; 3], 0.0);
    // The scene has seven faces; the second was dropped.
    let element = |face: usize| if face == 0 { Some(0) } else { face.checked_sub(1).filter(|&e| e > 0) };
    let by_face = |i: usize, j: usize| element(i).zip(element(j)).map_or(0.0, |(i, j)| factor(i, j));
    let text: String = (0..7)
        .map(|i| (0..7).map(|j| by_face(i, j).to_string()).collect::<Vec<_>>().join(",") + "\n")
        .collect();
    let (_, matrix, report) = imported(&room, "f.csv", text, Wishes { by: Rows::Face, ..wishes() });
    assert_eq!(difference(&room, matrix.path()), 0.0);
    assert_eq!(report["warnings"], serde_json::json!([]));
}

#[test]
fn what_no_factor_can_be_is_refused_by_place() {
    let room = Room::new([0.5; 3], 0.0);
    let fails = |name: &str, content: &[u8], part: &str| {
        let said = refusal(&room, name, content);
        assert!(said.contains(part), "{part:?} is not in: {said}");
    };
    fails("f.csv", b"0,1\n1,0\n", "found 2 rows and 2 columns, expected 6 of each, as the mesh has");
    fails(
        "f.csv",
        lines(|i, j| if (i, j) == (2, 4) { -0.1 } else { factor(i, j) }).as_bytes(),
        "row 3, column 5: found -0.1",
    );
    fails(
        "f.csv",
        lines(|i, j| if (i, j) == (2, 4) { f64::NAN } else { factor(i, j) }).as_bytes(),
        "found NaN",
    );
    fails("f.csv", lines(factor).replace("0,0.2", "0,x").as_bytes(), "found");
    fails("f.mtx", b"%%MatrixMarket matrix coordinate real general\n6 6 1\n7 1 0.5\n", "row 7, column 1");
    fails("f.mtx", b"%%MatrixMarket matrix coordinate real general\n6 6 2\n1 2 0.5\n", "the file ends");
    fails(
        "f.mtx",
        b"%%MatrixMarket matrix coordinate complex general\n6 6 0\n",
        "expected matrix, coordinate",
    );
    fails(
        "f.mtx",
        b"%%MatrixMarket matrix coordinate real general\n4000000000 4000000000 0\n",
        "expected 6 of each",
    );
    fails("f.rmx", b"#?RADIANCE\nNROWS=6\nNCOLS=6\nNCOMP=1\nFORMAT=double\n\nshort", "found 5 bytes");
    fails("f.vf", b"View3D 3.5 0 0 1 6\n", "reflections");
    fails("f.npy", b"\x93NUMPY\x01\0", "not a numpy array");
    fails("f.npz", b"PK\x03\x04", "damaged");
    fails("f.ff", &std::fs::read(&room.matrix).unwrap(), "found neither text nor");
    assert!(!room.path("in.ff").exists());
}
