//! The program on meshes built in code: closed-form factors, closure, storage, determinism, refusals.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use assert_cmd::Command;
use common::{inward_cube, mesh_of, room_with_box};
use interchange::matrix::{Matrix, Precision};
use interchange::provenance::Provenance;
use std::path::{Path, PathBuf};

fn compute(
    folder: &Path,
    polygons: &[Vec<[f64; 3]>],
    flags: &[&str],
) -> (PathBuf, assert_cmd::assert::Assert) {
    let (mesh, matrix) = (folder.join("s.mesh"), folder.join("s.ff"));
    mesh_of(polygons).write(&mesh, Provenance::new("test", "1")).unwrap();
    let mut command = Command::cargo_bin("formfactor-tool").unwrap();
    let run = command.arg("compute").arg(&mesh).arg("-o").arg(&matrix).args(flags).assert();
    (matrix, run)
}

fn entries(path: &Path) -> Vec<Vec<f64>> {
    let matrix = Matrix::open(path).unwrap();
    let n = matrix.element_count();
    let mut s = vec![vec![0.0; n]; n];
    matrix
        .for_each(|i, j, value| {
            s[i][j] = value;
            s[j][i] = value;
        })
        .unwrap();
    s
}

#[test]
fn unit_cube_has_its_closed_form_factors() {
    let folder = tempfile::tempdir().unwrap();
    let (matrix, run) = compute(folder.path(), &inward_cube(0.0, 1.0), &["--tolerance", "1e-12"]);
    run.success();
    assert_eq!(Matrix::open(&matrix).unwrap().record().precision, Precision::F64);
    for (i, row) in entries(&matrix).iter().enumerate() {
        for (j, &s) in row.iter().enumerate() {
            let want = match (i == j, i / 2 == j / 2) {
                (true, _) => 0.0,
                (_, true) => 0.199_824_895_698_387_38,
                _ => 0.200_043_776_075_403_15,
            };
            assert!((s - want).abs() < 1e-14, "S({i}, {j}) = {s}, want {want}");
        }
    }
}

#[test]
fn room_with_a_box_closes_and_has_the_known_factors() {
    let folder = tempfile::tempdir().unwrap();
    let (path, run) = compute(folder.path(), &room_with_box(), &["--tolerance", "1e-6"]);
    run.success();
    let matrix = Matrix::open(&path).unwrap();
    let (sums, errors) = (matrix.row_sums().unwrap(), matrix.row_errors().unwrap());
    for (i, (sum, error)) in sums.iter().zip(errors).enumerate() {
        assert!((sum - 1.0).abs() <= *error && *error <= 1e-6, "row {i}: sum {sum}, estimated error {error}");
    }
    let s = entries(&path);
    // Floor to ceiling and floor to wall behind the box, known to 1e-11.
    assert!((s[0][1] - 0.074_616_485_962_67).abs() < 1e-6, "{}", s[0][1]);
    assert!((s[0][2] - 0.168_845_878_509_3).abs() < 1e-6, "{}", s[0][2]);
}

#[test]
fn the_matrix_does_not_depend_on_threads_or_scale() {
    let folder = tempfile::tempdir().unwrap();
    let bytes: Vec<Vec<u8>> = ["1", "2", "7"]
        .iter()
        .map(|threads| {
            let (matrix, run) = compute(folder.path(), &room_with_box(), &["--threads", threads]);
            run.success();
            std::fs::read(matrix).unwrap()
        })
        .collect();
    assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2]);

    // Roundings differ between scales and may steer the adaptive cuts, so entries agree to the tolerance, not to the bit.
    let unit = entries(&compute(folder.path(), &room_with_box(), &["--tolerance", "1e-6"]).0);
    for scale in [1e-6, 1e6] {
        let scaled: Vec<Vec<[f64; 3]>> = room_with_box()
            .into_iter()
            .map(|face| face.into_iter().map(|v| v.map(|x| x * scale)).collect())
            .collect();
        let (matrix, run) = compute(folder.path(), &scaled, &["--tolerance", "1e-6"]);
        run.success();
        for (row, unit_row) in entries(&matrix).iter().zip(&unit) {
            for (s, want) in row.iter().zip(unit_row) {
                assert!((s / (scale * scale) - want).abs() <= 1e-6, "{s} {want}");
            }
        }
    }
}

#[test]
fn entries_are_f32_at_loose_and_f64_at_tight_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    for (tolerance, precision) in [("1e-6", Precision::F32), ("9e-7", Precision::F64)] {
        let (matrix, run) = compute(folder.path(), &inward_cube(0.0, 1.0), &["--tolerance", tolerance]);
        run.success();
        assert_eq!(Matrix::open(&matrix).unwrap().record().precision, precision);
    }
}

#[test]
fn convex_rooms_need_no_visibility_and_boxes_outside_see_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let counter = |name: &str| -> u64 {
        let text = std::fs::read_to_string(folder.path().join("s.ff.report.json")).unwrap();
        let line = text.lines().find(|l| l.contains(&format!("\"{name}\""))).unwrap().to_owned();
        line.rsplit(':').next().unwrap().trim().trim_end_matches(',').parse().unwrap()
    };
    compute(folder.path(), &inward_cube(0.0, 1.0), &[]).1.success();
    assert_eq!(counter("visible parts computed"), 0);
    assert_eq!(counter("pairs unoccluded, contour"), 15);
    let outward: Vec<_> = room_with_box().split_off(6);
    let (matrix, run) = compute(folder.path(), &outward, &[]);
    run.success();
    assert_eq!(counter("pairs facing away (skipped)"), 15);
    assert!(Matrix::open(&matrix).unwrap().block_count().unwrap() == 0);
}

#[test]
fn bad_usage_exits_2_and_bad_files_exit_1_with_their_name() {
    let folder = tempfile::tempdir().unwrap();
    for tolerance in ["0", "-1", "nan", "2", "x"] {
        compute(folder.path(), &inward_cube(0.0, 1.0), &["--tolerance", tolerance]).1.code(2);
    }
    compute(folder.path(), &inward_cube(0.0, 1.0), &["--method", "hemicube"]).1.code(2);
    let run =
        Command::cargo_bin("formfactor-tool").unwrap().args(["compute", "none.mesh", "-o", "x.ff"]).assert();
    let output = run.code(1).get_output().clone();
    assert!(String::from_utf8(output.stderr).unwrap().contains("none.mesh"));
}
