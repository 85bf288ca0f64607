//! `info` of a matrix reads no entries unless it is asked to verify them; then it finds what is wrong.
#![allow(clippy::unwrap_used)]

#[path = "../../solve-tool/tests/common/room.rs"]
mod room;

use assert_cmd::Command;
use interchange::atomic_write::Partial;
use interchange::matrix::{Matrix, MatrixWriter, PackedBlock};
use room::Room;
use serde_json::Value;
use std::path::Path;

fn info(matrix: &Path, flags: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("formfactor-tool"));
    command.arg("info").arg(matrix).args(flags).assert()
}

fn text(matrix: &Path, flags: &[&str]) -> String {
    String::from_utf8(info(matrix, flags).success().get_output().stdout.clone()).unwrap()
}

fn json(matrix: &Path) -> Value {
    serde_json::from_str(&text(matrix, &["--json"])).unwrap()
}

/// Fails with exit 1 and says `part`.
fn refuses(matrix: &Path, flags: &[&str], part: &str) {
    let failed = info(matrix, flags).code(1);
    let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
    assert!(said.contains(part), "{part:?} is not in: {said}");
}

/// The matrix of the room as the program computes it.
fn computed() -> Room {
    let room = Room::new([0.5; 3], 0.0);
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("formfactor-tool"));
    command.arg("compute").arg(&room.mesh).arg("-o").arg(&room.matrix).args(["--tolerance", "1e-6"]);
    command.assert().success();
    room
}

/// Changes the first entry that is not zero; its highest byte, too, where it shall be no number.
fn damage(matrix: &Path, no_number: bool) {
    let entry = {
        let mut entry = None;
        Matrix::open(matrix).unwrap().for_each(|_, _, s| entry = entry.or((s > 0.0).then_some(s))).unwrap();
        (entry.unwrap() as f32).to_le_bytes()
    };
    let mut bytes = std::fs::read(matrix).unwrap();
    let at = bytes.windows(4).position(|window| window == entry).unwrap();
    bytes[at] ^= 1;
    if no_number {
        bytes[at + 2..at + 4].fill(0xff);
    }
    std::fs::write(matrix, bytes).unwrap();
}

#[test]
fn a_flipped_bit_in_the_entries_is_found_by_verify_alone() {
    let room = computed();
    let before = text(&room.matrix, &[]);
    assert!(before.contains("not the entries, which --verify reads"), "{before}");
    assert!(text(&room.matrix, &["--verify"]).contains("verified     all of it"));
    damage(&room.matrix, false);
    assert_eq!(text(&room.matrix, &[]), before);
    assert_eq!(json(&room.matrix)["verified"], false);
    assert!(text(&room.matrix, &["--row", "1"]).contains("not the entries"));
    for flags in [&["--verify"][..], &["--verify", "--row", "1"], &["--verify", "--pair", "1", "2"]] {
        refuses(&room.matrix, flags, "section values: found checksum");
    }
}

#[test]
fn what_is_no_number_is_not_shown_as_one() {
    let room = computed();
    damage(&room.matrix, true);
    refuses(&room.matrix, &["--row", "1"], "finite entries of at least 0");
}

/// Header, blocks and rows are read in any case: no other bit can be flipped unseen.
#[test]
fn all_but_the_entries_is_verified_in_any_case() {
    let room = computed();
    let good = std::fs::read(&room.matrix).unwrap();
    let bad = room.path("bad.ff");
    let seen = |at: usize| {
        let mut flipped = good.clone();
        flipped[at] ^= 0x10;
        std::fs::write(&bad, flipped).unwrap();
        Matrix::glance_part(&bad).is_err()
    };
    let unseen = (0..good.len()).filter(|&at| !seen(at)).count();
    // The minor version, and the entries.
    let entries = Matrix::open(&room.matrix).unwrap().stored_entries().unwrap();
    assert_eq!(unseen, 2 + 4 * entries);
}

#[test]
fn the_page_has_the_row_sums_of_the_entries() {
    let room = computed();
    let page = json(&room.matrix);
    let sums = Matrix::open(&room.matrix).unwrap().row_sums().unwrap();
    let least = sums.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((page["row_sums"]["least"].as_f64().unwrap() - least).abs() < 1e-15);
    assert_eq!(page["closed"], true);
}

/// Files of other programs may lack the row sums, or state wrong ones.
#[test]
fn row_sums_that_are_missing_or_wrong_are_told() {
    let room = Room::new([0.5; 3], 0.0);
    assert!(text(&room.matrix, &[]).contains("not in the file; --verify adds them up"));
    assert_eq!(json(&room.matrix)["row_sums"], Value::Null);
    assert!(text(&room.matrix, &["--verify"]).contains("closed: every row sum"));

    let old = Matrix::open(&room.matrix).unwrap();
    let forged = |name: &str, sums: &[f64; 6]| {
        let path = room.path(name);
        let (partial, areas) = (Partial::create(&path).unwrap(), old.areas().unwrap());
        let mut writer =
            MatrixWriter::create(partial, old.provenance().clone(), old.record().clone(), areas).unwrap();
        old.views().unwrap().iter().for_each(|view| writer.push(&PackedBlock::copy_of(view)).unwrap());
        writer.finish(&[0.0; 6], sums).unwrap();
        path
    };
    text(&forged("right.ff", &[1.0; 6]), &["--verify"]);
    let wrong = forged("wrong.ff", &[1.0, 1.0, 1.0 + 1e-12, 1.0, 1.0, 1.0]);
    text(&wrong, &[]);
    refuses(&wrong, &["--verify"], "row_sums: found 1.000000000001e0 at 2");
    refuses(&forged("negative.ff", &[1.0, -1.0, 1.0, 1.0, 1.0, 1.0]), &[], "row_sums: found -1 at 1");
}
