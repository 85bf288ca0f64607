//! The program on files: command lines, exit codes, what it writes and what it refuses.
#![allow(clippy::unwrap_used)]

#[path = "common/room.rs"]
mod room;

use assert_cmd::Command;
use interchange::matrix::{self, Block, BlockKind, Matrix, Values};
use interchange::solution::Solution;
use room::Room;
use std::path::Path;

fn tool() -> Command {
    Command::new(env!("CARGO_BIN_EXE_solve-tool"))
}

/// Runs `solve` in the room; exit code and stderr.
fn solve(room: &Room, output: &Path, more: &[&str]) -> (i32, String) {
    let mut command = tool();
    command.arg("solve").arg(&room.matrix).arg("--mesh").arg(&room.mesh).arg("-o").arg(output).args(more);
    let done = command.output().unwrap();
    (done.status.code().unwrap(), String::from_utf8(done.stderr).unwrap())
}

fn text(room: &Room, arguments: &[&str]) -> String {
    let done = tool().current_dir(room.folder.path()).args(arguments).output().unwrap();
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

/// Wall, floor and ceiling of the cube under a ceiling of E = 1, for reflectances 0.5, 0.8 and 0.9.
const KNOWN: [[f64; 3]; 3] = [
    [0.181836268946, 0.689681193904, 1.525452018512],
    [0.181745826108, 0.689551070738, 1.525310551125],
    [1.090909098108, 1.551724153645, 2.372881374826],
];

#[test]
fn solves_exports_and_describes_the_cube() {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    for solver in ["auto", "cg", "direct"] {
        let output = room.path("room.sol");
        assert_eq!(solve(&room, &output, &["--solver", solver, "--tolerance", "1e-12"]), (0, String::new()));
        let (solution, provenance, ..) = Solution::read(&output).unwrap();
        for (element, row) in [(0, 0), (1, 0), (2, 0), (3, 0), (4, 1), (5, 2)] {
            for c in 0..3 {
                let (got, want) = (solution.radiosity[element][c], KNOWN[row][c]);
                assert!((got - want).abs() < 1e-9, "{solver}, {element}: got {got}, want {want}");
                let rho = [0.5, 0.8, 0.9][c];
                let emitted = if element == 5 { 1.0 } else { 0.0 };
                assert!((emitted + rho * solution.irradiance[element][c] - got).abs() < 1e-14);
            }
        }
        assert!(
            solution.summary.achieved <= 1e-12
                && solution.summary.solver.starts_with(if solver == "cg" { "cg" } else { "direct" })
        );
        assert_eq!(provenance.flags, [format!("--solver {solver}"), "--tolerance 1e-12".into()]);
        let last = solution.history.last().unwrap();
        assert_eq!(last.iter().copied().fold(0.0, f64::max), solution.summary.achieved);
    }

    text(&room, &["export", "room.sol", "--mesh", "room.mesh", "--by", "group", "-o", "b.csv"]);
    let table = std::fs::read_to_string(room.path("b.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "group,area,B_r,B_g,B_b,H_r,H_g,H_b");
    assert!(lines[1].starts_with("walls,4,0.18183626894"), "{table}");
    assert!(lines[2].starts_with("\"floor, polished\",1,0.1817458261"), "{table}");
    assert!(lines[3].starts_with("ceiling,1,1.090909098"), "{table}");

    // Seven faces in the scene, one of which was dropped; six elements.
    text(&room, &["export", "room.sol", "--mesh", "room.mesh", "--by", "face", "-o", "f.csv"]);
    let table = std::fs::read_to_string(room.path("f.csv")).unwrap();
    assert_eq!(table.lines().count(), 8);
    assert_eq!(table.lines().nth(2).unwrap(), "2,0,0,0,0,0,0,0");
    text(&room, &["export", "room.sol", "--mesh", "room.mesh", "--by", "element", "-o", "b.npy"]);
    let npy = std::fs::read(room.path("b.npy")).unwrap();
    assert!(npy.starts_with(b"\x93NUMPY"));
    let number = |k: usize| f64::from_le_bytes(npy[npy.len() - 8 * (42 - k)..][..8].try_into().unwrap());
    assert_eq!(number(0), 1.0);
    assert!((number(36) - KNOWN[2][0]).abs() < 1e-9);

    let words = text(&room, &["info", "room.sol"]);
    assert!(
        words.contains("direct") && words.contains("escaped") && words.contains("elements     6"),
        "{words}"
    );
    let json: serde_json::Value =
        serde_json::from_str(&text(&room, &["info", "room.sol", "--json"])).unwrap();
    assert_eq!(json["elements"], 6);
    let estimates = &json["report"]["estimates"];
    assert!((estimates["power absorbed red"].as_f64().unwrap() - 1.0).abs() < 1e-12);
    assert!(estimates["energy defect blue"].as_f64().unwrap() < 1e-12);
}

#[test]
fn other_materials_need_no_new_matrix() {
    let room = Room::new([0.5; 3], 0.0);
    let other = room.path("other.materials");
    room.paint(&other, [0.9; 3]);
    let output = room.path("room.sol");
    let given = ["--materials", other.to_str().unwrap(), "--tolerance", "1e-10"];
    assert_eq!(solve(&room, &output, &given).0, 0);
    assert!((Solution::read(&output).unwrap().0.radiosity[0][1] - KNOWN[0][2]).abs() < 1e-9);

    let mtl = room.path("other.mtl");
    std::fs::write(&mtl, "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamq\nKd 0 0 0\n").unwrap();
    let (code, message) = solve(&room, &output, &["--materials", mtl.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(message.contains("material lamp") && message.contains("nearest name: lamq"), "{message}");
}

#[test]
fn a_matrix_that_is_not_good_enough_ends_with_3_and_names_the_tolerance_it_would_need() {
    let room = Room::new([0.5, 0.9, 0.5], 1e-4);
    let output = room.path("room.sol");
    let (code, message) = solve(&room, &output, &[]);
    // Row errors of 1e-4 times rho / (1 - rho) = 9 are more than 1e-6; 1.1e-7 would do.
    assert_eq!(code, 3, "{message}");
    assert!(message.contains("formfactor-tool compute --tolerance 1e-7,"), "{message}");
    assert!(message.contains("by 9.0e-4 in the green channel"), "{message}");
    assert!(Solution::read(&output).is_ok());
    assert_eq!(solve(&room, &output, &["--tolerance", "1e-3"]).0, 0);
}

#[test]
fn a_lossless_room_is_refused_by_face_and_group_and_nothing_is_written() {
    let room = Room::new([0.5, 1.0, 0.5], 1e-9);
    let output = room.path("room.sol");
    let (code, message) = solve(&room, &output, &[]);
    assert_eq!(code, 1);
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.starts_with("solve-tool: error: no finite solution"), "{message}");
    assert!(message.contains("faces 1, 3, 4, 5, 6, 7 (groups walls, floor, polished, ceiling)"), "{message}");
    assert!(message.contains("green") && message.contains("Kd below 1"), "{message}");
    assert!(!output.exists());
}

#[test]
fn bad_usage_ends_with_2() {
    let room = Room::new([0.5; 3], 0.0);
    let output = room.path("room.sol");
    for bad in [
        ["--tolerance", "0"],
        ["--tolerance", "nan"],
        ["--tolerance", "-1"],
        ["--tolerance", "inf"],
        ["--solver", "montecarlo"],
        ["--bounces", "-1"],
        ["--bounces", "few"],
        ["--snapshots", "0"],
        ["--snapshots", "1,,2"],
        ["--max-steps", "0"],
        ["--no-skip", "everything"],
        ["--overshoot", "--solver=cg"],
        ["--bounces=1", "--solver=cg"],
        ["--bounces=1", "--start=a.sol"],
        ["--threads", "0"],
    ] {
        assert_eq!(solve(&room, &output, &bad).0, 2, "{bad:?}");
    }
    assert!(!output.exists());
    assert_eq!(tool().arg("compare").output().unwrap().status.code(), Some(2));
}

#[test]
fn foreign_cut_and_damaged_files_are_refused() {
    let room = Room::new([0.5; 3], 0.0);
    let output = room.path("room.sol");

    // A mesh that is not the matrix's own.
    let own = std::fs::read(&room.mesh).unwrap();
    let mut mesh = room::mesh();
    mesh.vertices[0][0] = -0.5;
    mesh.write(&room.mesh, interchange::provenance::Provenance::new("test", "1")).unwrap();
    let (code, message) = solve(&room, &output, &[]);
    assert!(code == 1 && message.contains("do not belong together"), "{message}");
    std::fs::write(&room.mesh, own).unwrap();

    // Every cut, and every flipped byte but the minor version's.
    let good = std::fs::read(&room.matrix).unwrap();
    for at in (0..good.len()).step_by(97) {
        std::fs::write(&room.matrix, &good[..at]).unwrap();
        assert_eq!(solve(&room, &output, &[]).0, 1, "cut at {at}");
        let mut flipped = good.clone();
        flipped[at] ^= 0x10;
        std::fs::write(&room.matrix, flipped).unwrap();
        assert_eq!(solve(&room, &output, &[]).0, 1, "flipped at {at}");
    }
    std::fs::write(&room.matrix, &good).unwrap();

    // Not a number, with all checksums right.
    let matrix = Matrix::open(&room.matrix).unwrap();
    let (record, provenance) = (matrix.record().clone(), matrix.provenance().clone());
    drop(matrix);
    let blocks = [Block::new(BlockKind::Triangle, 0..6, 0..6, 0)];
    let values = [f64::NAN; 21];
    matrix::write(&room.matrix, provenance, record, &blocks, Values::F64(&values), &[1.0; 6], &[0.0; 6])
        .unwrap();
    let (code, message) = solve(&room, &output, &[]);
    assert!(code == 1 && message.contains("NaN"), "{message}");

    // A solution given as a matrix, and a matrix that is not there.
    assert!(!output.exists());
    std::fs::remove_file(&room.matrix).unwrap();
    let (code, message) = solve(&room, &output, &[]);
    assert!(code == 1 && message.contains("room.ff"), "{message}");
}

/// The same bytes for any number of threads, and a second run leaves the file alone.
#[test]
fn output_depends_on_files_and_flags_only() {
    let room = Room::new([0.3, 0.6, 0.9], 0.0);
    let output = room.path("room.sol");
    assert_eq!(solve(&room, &output, &["--threads", "1", "--solver", "cg"]).0, 0);
    let (bytes, time) =
        (std::fs::read(&output).unwrap(), std::fs::metadata(&output).unwrap().modified().unwrap());
    assert_eq!(solve(&room, &output, &["--threads", "3", "--solver", "cg", "--quiet"]).0, 0);
    assert_eq!(std::fs::read(&output).unwrap(), bytes);
    assert_eq!(std::fs::metadata(&output).unwrap().modified().unwrap(), time);
}
