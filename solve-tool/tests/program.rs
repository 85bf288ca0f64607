//! The program on files: command lines, exit codes, what it writes and what it refuses.
#![allow(clippy::unwrap_used)]

#[path = "common/room.rs"]
mod room;

use assert_cmd::Command;
use interchange::atomic_write::Partial;
use interchange::matrix::{self, Block, BlockKind, Matrix, MatrixRecord, MatrixWriter, PackedBlock, Values};
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

/// The shards of a matrix, in any order, are as good as the whole; some of them are not.
#[test]
fn shards_are_taken_together_or_refused_by_name() {
    let room = Room::new([0.5, 0.8, 0.9], 1e-9);
    let whole = Matrix::open(&room.matrix).unwrap();
    let parts = [room.path("1.ff"), room.path("2.ff")];
    let views = whole.views().unwrap();
    for (part, path) in parts.iter().enumerate() {
        let record = MatrixRecord { part: part as u32, parts: 2, ..whole.record().clone() };
        let partial = Partial::create(path).unwrap();
        let areas = whole.areas().unwrap();
        let mut writer = MatrixWriter::create(partial, whole.provenance().clone(), record, areas).unwrap();
        let mut sums = [0.0; 6];
        for view in views.iter().skip(part).step_by(2) {
            writer.push(&PackedBlock::copy_of(view)).unwrap();
            view.for_each(|i, j, s| {
                sums[i] += s;
                sums[j] += if i == j { 0.0 } else { s };
            });
        }
        // The areas are 1.
        writer.finish(&[0.5e-9; 6], &sums).unwrap();
    }
    let run = |matrices: &[&Path], output: &Path| {
        let mut command = tool();
        command.arg("solve").args(matrices).arg("--mesh").arg(&room.mesh).arg("-o").arg(output);
        let done = command.output().unwrap();
        (done.status.code().unwrap(), String::from_utf8(done.stderr).unwrap())
    };
    let (one, both) = (room.path("one.sol"), room.path("both.sol"));
    assert_eq!(run(&[&room.matrix], &one), (0, String::new()));
    assert_eq!(run(&[&parts[1], &parts[0]], &both), (0, String::new()));
    let (one, both) = (Solution::read(&one).unwrap().0, Solution::read(&both).unwrap().0);
    for (a, b) in one.radiosity.iter().flatten().zip(both.radiosity.iter().flatten()) {
        assert!((a - b).abs() <= 1e-12 * a, "{a} {b}");
    }
    let (code, message) = run(&[&parts[1]], &room.path("none.sol"));
    assert!(code == 1 && message.contains("2.ff") && message.contains("part 1 is missing"), "{message}");
    assert!(message.contains("formfactor-tool merge") && !room.path("none.sol").exists(), "{message}");
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

fn estimates(room: &Room, name: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(room.path(&format!("{name}.report.json"))).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn every_method_is_there_by_name() {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    let output = room.path("room.sol");
    for solver in ["cg", "jacobi", "gauss-seidel", "southwell", "direct", "gmres"] {
        assert_eq!(solve(&room, &output, &["--solver", solver, "--tolerance", "1e-11"]).0, 0, "{solver}");
        let solution = Solution::read(&output).unwrap().0;
        assert_eq!(solution.summary.solver, solver);
        assert!((solution.radiosity[5][2] - KNOWN[2][2]).abs() < 1e-9, "{solver}");
    }
    assert_eq!(solve(&room, &output, &["--solver", "southwell", "--overshoot"]).0, 0);
    // Too few steps: the best iterate is written, and the exit code says that it is not good enough.
    let (code, message) = solve(&room, &output, &["--solver", "jacobi", "--max-steps", "3"]);
    assert!(code == 3 && message.contains("was still falling when the steps were used up"), "{message}");
    assert!(message.contains("--max-steps"), "{message}");
    let solution = Solution::read(&output).unwrap().0;
    // Closed, 0.9 everywhere: after the last product 0.9^4 is under way, and 1 / (1 - 0.9) times that is missing.
    assert!((solution.summary.achieved - 0.9f64.powi(5) / 0.1).abs() < 1e-9, "{}", solution.summary.achieved);
}

#[test]
fn bounces_are_counted_from_the_emission() {
    let room = Room::new([0.5, 0.8, 0.9], 1e-3);
    let output = room.path("room.sol");
    // Wall, floor and ceiling of the green channel (0.8), known.
    for (bounces, want) in [
        ("0", [0.0, 0.0, 1.0]),
        ("1", [0.160035020860, 0.159859916559, 1.0]),
        ("3", [0.348442499962, 0.348309987398, 1.209920012753]),
    ] {
        // Row errors of 1e-3 do not matter: nothing was asked of the error.
        assert_eq!(solve(&room, &output, &["--bounces", bounces]), (0, String::new()));
        let (solution, provenance, ..) = Solution::read(&output).unwrap();
        for (element, want) in [(0, want[0]), (4, want[1]), (5, want[2])] {
            let got = solution.radiosity[element][1];
            assert!((got - want).abs() < 1e-9, "{bounces} bounces: {got} for {want}");
        }
        assert_eq!(provenance.flags, [format!("--bounces {bounces}")]);
        let report = estimates(&room, "room.sol");
        let estimate = |name: &str| report["estimates"][name].as_f64().unwrap();
        let sum = estimate("power absorbed green") + estimate("power under way green");
        assert!(
            (sum - estimate("power emitted green")).abs() < 1e-12 && estimate("energy defect green") < 1e-12
        );
        // Without what is under way the balance that is shown would not be one.
        let words = text(&room, &["info", "room.sol"]);
        assert_eq!(words.matches("+ under way").count(), 3, "{words}");
    }
}

#[test]
fn snapshots_are_solutions_of_their_own() {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    let output = room.path("room.sol");
    let southwell = ["--solver", "southwell", "--snapshots", "1,4", "--tolerance", "1e-10"];
    assert_eq!(solve(&room, &output, &southwell).0, 0);
    let plain = Solution::read(&output).unwrap().0;
    let (first, provenance, ..) = Solution::read(&room.path("room.000001.sol")).unwrap();
    let fourth = Solution::read(&room.path("room.000004.sol")).unwrap().0;
    assert!(provenance.flags.contains(&"--snapshots 1".to_owned()), "{:?}", provenance.flags);
    assert_eq!(first.summary.solver, "southwell, snapshot after 1");
    // The ceiling has shot: all others have rho F of it, and the ambient term on top.
    let ambient = first.details.ambient.unwrap();
    let unshot = first.details.unshot.as_ref().unwrap();
    for (element, factor) in [(0, room::ADJACENT), (4, room::OPPOSITE)] {
        for (c, rho) in [0.5, 0.8, 0.9].into_iter().enumerate() {
            assert!((unshot[element][c] - rho * factor).abs() < 1e-12);
            assert!((first.radiosity[element][c] - rho * (factor + ambient[c])).abs() < 1e-12);
        }
    }
    // Uniform reflectance: rho of one sixth of the power is left on average, and will be shot 1 / (1 - rho) times.
    assert!((ambient[1] - 0.8 / 6.0 / 0.2).abs() < 1e-12, "{ambient:?}");
    let error = |s: &Solution| (0..6).map(|i| (s.radiosity[i][1] - plain.radiosity[i][1]).abs()).sum::<f64>();
    // A uniform cube: the ambient term is nearly all that is missing.
    assert!(error(&first) < 0.2 && error(&fourth) < 0.2, "{} {}", error(&first), error(&fourth));
    assert!(!room.path("room.000002.sol").exists());

    let other = room.path("steps.sol");
    assert_eq!(solve(&room, &other, &["--solver", "jacobi", "--snapshots", "2", "--max-steps", "6"]).0, 3);
    for count in [2, 4, 6] {
        let solution = Solution::read(&room.path(&format!("steps.{count:06}.sol"))).unwrap().0;
        assert_eq!(solution.details.ambient, Some([0.0; 3]));
    }
    // Two steps of Jacobi are two bounces.
    let two = Solution::read(&room.path("steps.000002.sol")).unwrap().0;
    assert!(
        (two.radiosity[5][0] - 1.050000009582).abs() < 1e-9
            && (two.radiosity[0][0] - 0.140017507556).abs() < 1e-9
    );
    // A picture of the work in progress changes nothing of the work.
    assert_eq!(solve(&room, &other, &["--solver", "southwell", "--tolerance", "1e-10"]).0, 0);
    assert_eq!(Solution::read(&other).unwrap().0, plain);
}

#[test]
fn an_older_solution_of_the_mesh_is_a_start_and_another_is_refused() {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    let (old, output) = (room.path("old.sol"), room.path("room.sol"));
    assert_eq!(solve(&room, &old, &["--tolerance", "1e-10", "--solver", "cg"]).0, 0);
    let start = ["--start", old.to_str().unwrap(), "--tolerance", "1e-10", "--solver", "cg"];
    assert_eq!(solve(&room, &output, &start).0, 0);
    let (solution, provenance, ..) = Solution::read(&output).unwrap();
    assert_eq!(provenance.digest_of("start"), Some(Solution::read(&old).unwrap().3));
    assert!((solution.radiosity[5][2] - KNOWN[2][2]).abs() < 1e-9);
    // The start is the solution.
    assert_eq!(estimates(&room, "room.sol")["counters"]["products"], 3);
    assert_eq!(solve(&room, &old, &start).0, 1, "the start is not written over");

    let (mut foreign, provenance, mut origins, _) = Solution::read(&old).unwrap();
    origins.mesh = interchange::digest::Digest::of(b"another mesh");
    foreign.history.clear();
    foreign.write(&old, provenance, origins).unwrap();
    let (code, message) = solve(&room, &output, &start);
    assert!(
        code == 1 && message.contains("do not belong together") && message.contains("--start"),
        "{message}"
    );
}

#[test]
fn bounds_errors_and_energy_are_exported() {
    let room = Room::new([0.5, 0.8, 0.9], 1e-3);
    let output = room.path("room.sol");
    let (code, message) = solve(&room, &output, &["--bounds", "--tolerance", "1e-2"]);
    assert_eq!(code, 0, "{message}");
    let solution = Solution::read(&output).unwrap().0;
    let [lower, upper] = solution.details.bounds.as_ref().unwrap();
    for i in 0..6 {
        for c in 0..3 {
            let want = KNOWN[[0, 0, 0, 0, 1, 2][i]][c];
            assert!(lower[i][c] <= want && want <= upper[i][c] && upper[i][c] < 1.1 * want, "{i} {c}");
        }
    }
    let report = estimates(&room, "room.sol");
    let estimate = |name: &str| report["estimates"][name].as_f64().unwrap();
    for what in ["matrix", "solver", "discretisation"] {
        for norm in ["power", "sup"] {
            assert!(estimate(&format!("error by {what} green, {norm} norm")) >= 0.0);
        }
    }
    // One patch a face is coarse: that is the largest of the three.
    assert!(
        estimate("error by discretisation green, power norm") > estimate("error by matrix green, power norm")
    );
    let names: Vec<&String> = report["estimates"].as_object().unwrap().keys().collect();
    assert!(names.iter().any(|name| name.starts_with("worst element 01: element ")), "{names:?}");
    assert!(names.iter().any(|name| name.ends_with(" to element 6 of face 7, ceiling")), "{names:?}");

    let export = |quantity: &str, by: &str, more: &[&str]| -> Vec<Vec<String>> {
        let arguments =
            ["export", "room.sol", "--mesh", "room.mesh", "--by", by, "--quantity", quantity, "-o", "t.csv"];
        text(&room, &[&arguments[..], more].concat());
        let table = std::fs::read_to_string(room.path("t.csv")).unwrap();
        table
            .lines()
            .map(|line| line.replace("floor, polished", "floor").split(',').map(str::to_owned).collect())
            .collect()
    };
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    let energy = export("energy", "group", &[]);
    assert_eq!(
        energy[0].join(","),
        "group,area,emitted_r,emitted_g,emitted_b,absorbed_r,absorbed_g,absorbed_b,escaped_r,escaped_g,escaped_b"
    );
    let sum = |column: usize| energy[1..].iter().map(|row| number(&row[column])).sum::<f64>();
    for c in 0..3 {
        let balance = sum(2 + c) - sum(5 + c) - sum(8 + c);
        assert!(balance.abs() < 1e-2 && (sum(2 + c) - 1.0).abs() < 1e-12, "{balance}");
    }
    let lumens = export("energy", "group", &["--units", "photometric"]);
    assert_eq!(lumens[0].join(","), "group,area,emitted_lm,absorbed_lm,escaped_lm");
    assert!((number(&lumens[3][2]) - 179.0).abs() < 1e-9, "one watt of equal-energy white");
    let lux = export("radiosity", "group", &["--units", "photometric", "--efficacy", "100"]);
    assert_eq!(
        lux[0].join(","),
        "group,area,luminance_cd_m2,luminous_exitance_lm_m2,illuminance_lx,efficacy_lm_W"
    );
    let h = &solution.irradiance[4];
    let want = 100.0 * (0.2126 * h[0] + 0.7152 * h[1] + 0.0722 * h[2]);
    assert!((number(&lux[2][4]) - want).abs() < 1e-12 * want);
    assert!((number(&lux[2][2]) * std::f64::consts::PI / number(&lux[2][3]) - 1.0).abs() < 1e-14);

    let errors = export("errors", "element", &[]);
    assert_eq!(errors[0].join(","), "element,area,matrix,solver,discretisation,total");
    let totals: Vec<f64> = errors[1..].iter().map(|row| number(&row[5])).collect();
    assert!(totals.windows(2).all(|pair| pair[0] >= pair[1]), "{totals:?}");
    let ranking = solution.details.error_ranking.as_ref().unwrap();
    assert_eq!(errors[1][0], (ranking[0] + 1).to_string());
    let links = export("links", "group", &[]);
    assert_eq!(links[0].join(","), "first_group,second_group,error");
    assert_eq!(export("bounds", "element", &[])[0].len(), 8);

    // What the solution does not hold is said, with what to do.
    assert_eq!(solve(&room, &output, &["--tolerance", "1e-2"]).0, 0);
    for quantity in ["bounds", "errors", "links", "heat"] {
        let done = tool()
            .current_dir(room.folder.path())
            .args([
                "export",
                "room.sol",
                "--mesh",
                "room.mesh",
                "--by",
                "group",
                "--quantity",
                quantity,
                "-o",
                "u.csv",
            ])
            .output()
            .unwrap();
        let message = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.code() == Some(1) && message.contains("run solve-tool solve --"), "{message}");
    }
    assert!(!room.path("u.csv").exists());
}

/// A matrix that is not symmetric, as an import gives it: the same cube, all entries.
#[test]
fn a_matrix_without_symmetry_goes_through_the_program() {
    let room = Room::new([0.5, 0.8, 0.9], 0.0);
    let matrix = Matrix::open(&room.matrix).unwrap();
    let (record, provenance) = (matrix.record().clone(), matrix.provenance().clone());
    drop(matrix);
    let record = matrix::MatrixRecord { symmetric: false, ..record };
    let blocks = [Block::new(BlockKind::Dense, 0..6, 0..6, 0)];
    let values: Vec<f64> = (0..36).map(|k| room::factor(k / 6, k % 6)).collect();
    matrix::write(&room.matrix, provenance, record, &blocks, Values::F64(&values), &[1.0; 6], &[0.0; 6])
        .unwrap();
    let output = room.path("room.sol");
    assert_eq!(solve(&room, &output, &["--tolerance", "1e-10"]).0, 0);
    let solution = Solution::read(&output).unwrap().0;
    assert_eq!(solution.summary.solver, "gmres (auto: the matrix is not symmetric)");
    assert!((solution.radiosity[5][2] - KNOWN[2][2]).abs() < 1e-9);
    let (code, message) = solve(&room, &output, &["--solver", "cg"]);
    assert!(code == 1 && message.contains("--solver gmres"), "{message}");
}
