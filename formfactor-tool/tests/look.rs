//! `info --row`, `--pair`, `--group`: the numbers of the file, by element and by name.
#![allow(clippy::unwrap_used)]

#[path = "../../solve-tool/tests/common/room.rs"]
mod room;

use assert_cmd::Command;
use room::{ADJACENT, OPPOSITE, Room};
use serde_json::Value;

fn tool(room: &Room, flags: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("formfactor-tool"));
    command.arg("info").arg(&room.matrix).args(flags).arg("--mesh").arg(&room.mesh).assert()
}

fn json(room: &Room, flags: &[&str]) -> Value {
    let output = tool(room, &[flags, &["--json"]].concat()).success();
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

fn close(value: &Value, want: f64) {
    let got = value.as_f64().unwrap();
    assert!((got - want).abs() < 1e-15, "got {got}, want {want}");
}

#[test]
fn a_row_lists_what_the_element_sees() {
    let room = Room::new([0.5; 3], 1e-5);
    let row = json(&room, &["--row", "2"]);
    assert_eq!((row["element"].as_u64(), row["factors"].as_array().unwrap().len()), (Some(2), 5));
    assert_eq!(row["factors"][0][0], 1);
    close(&row["factors"][0][1], OPPOSITE);
    close(&row["factors"][4][1], ADJACENT);
    close(&row["row_sum"], OPPOSITE + 4.0 * ADJACENT);
    close(&row["row_error"], 1e-5);
    let said = tool(&room, &["--row", "6"]).success();
    let text = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    for part in [
        "element      6 ceiling, face 7",
        "sees         5 of 6",
        "to floor, polished",
        "error at most 1.000e-5",
    ] {
        assert!(text.contains(part), "{part}:\n{text}");
    }
}

#[test]
fn a_pair_and_two_groups_have_both_directions() {
    let room = Room::new([0.5; 3], 1e-5);
    let pair = json(&room, &["--pair", "1", "5"]);
    close(&pair["first"]["factor"], ADJACENT);
    close(&pair["second"]["factor"], ADJACENT);
    assert_eq!(pair["stored"], "dense block, f64");
    let itself = json(&room, &["--pair", "3", "3"]);
    close(&itself["first"]["factor"], 0.0);
    let groups = json(&room, &["--group", "walls", "ceiling"]);
    close(&groups["first"]["factor"], ADJACENT);
    close(&groups["second"]["factor"], 4.0 * ADJACENT);
    close(&groups["first"]["error"], 1e-5);
}

#[test]
fn slips_are_named() {
    let room = Room::new([0.5; 3], 0.0);
    let fails = |flags: &[&str], code: i32, part: &str| {
        let failed = tool(&room, flags).code(code);
        let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(said.contains(part), "{part:?} is not in: {said}");
    };
    fails(&["--row", "7"], 1, "there is no element 7: they count from 1 to 6");
    fails(&["--row", "0"], 1, "there is no element 0");
    fails(&["--group", "wals", "ceiling"], 1, "did you mean walls?");
    fails(&["--row", "1", "--pair", "1", "2"], 2, "cannot be used with");
    fails(&["--pair", "1"], 2, "2 values required");
}
