//! Degenerate and extreme scenes: each row of the table has a number it must meet. `make -f pipeline.mk stress` prints
//! the table; with STRESS_INTO=FILE.md it is kept there.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::{Chain, Stage};
use tests::proof::boxes;
use tests::proof::errors::{given, rms};
use tests::stress::{
    Row, TOLERANCE, factors, graded_cube, opposed, opposed_faces, plates, shifted, shifted_exchange, table,
    wedge,
};
use tests::surfaces::{Paint, Surface, room, write};
use tests::table::Table;
use tests::{run, tool};

const BOUND: &str = "the matrix tolerance bounds a row's error, so each factor's";

/// Error of F between the first two faces; infinite where a tool refuses.
fn error(surfaces: &[Surface], build: &[&str], compute: &[&str], want: f64) -> f64 {
    match factors(surfaces, build, compute) {
        Ok(f) if f.len() >= 2 => (f[0][1] - want).abs(),
        Ok(_) => f64::INFINITY,
        Err(said) => {
            eprintln!("stress: {said}");
            f64::INFINITY
        }
    }
}

/// Gaps down to 1e-12 of the side, strips up to 1e7 times as long as wide.
fn gaps_and_strips() -> Vec<Row> {
    let mut rows = Vec::new();
    for power in 1..=12 {
        let gap = 10f64.powi(-power);
        // Corners within 1e-9 of the diagonal (1.4e-9 here) are one corner: such faces touch, with no air between.
        let (want, limit, reason) = match power {
            ..=8 => (opposed(1.0, 1.0, gap), TOLERANCE, BOUND),
            _ => (
                0.0,
                0.0,
                "below the welding distance, 1e-9 of the diagonal: the faces touch, F = 0 (README, Limitations)",
            ),
        };
        let got = error(&opposed_faces(1.0, 1.0, gap), &[], &[], want);
        rows.push(Row::new(format!("opposed unit squares, gap 1e-{power}"), got, limit, reason));
    }
    // Neither welded nor taken for one plane: the air between the faces counts, however thin.
    let apart = ["--no-skip", "same-plane", "--no-skip", "behind", "--no-skip", "behind-clusters"];
    for power in 9..=12 {
        let gap = 10f64.powi(-power);
        let want = opposed(1.0, 1.0, gap);
        let got = error(&opposed_faces(1.0, 1.0, gap), &["--no-clean", "weld"], &apart, want);
        let case = format!("opposed unit squares, gap 1e-{power}, without weld and same-plane skips");
        rows.push(Row::new(case, got, TOLERANCE, BOUND));
    }
    for power in 1..=7 {
        let width = 10f64.powi(-power);
        let got = error(&opposed_faces(1.0, width, width), &[], &[], opposed(1.0, width, width));
        rows.push(Row::new(format!("strips of aspect 1e{power} at their width"), got, TOLERANCE, BOUND));
    }
    rows
}

/// Pairs that touch at a corner or along a part of an edge, long plates with a common edge, graded slivers.
fn contacts() -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, shift) in [("along half an edge", 0.5), ("at a corner", 1.0), ("along a thousandth", 0.999)] {
        let got = error(&shifted(shift), &[], &[], shifted_exchange(shift));
        rows.push(Row::new(format!("perpendicular squares that touch {name}"), got, TOLERANCE, BOUND));
    }
    let length = 1e5;
    for (name, angle) in [("60 degrees", std::f64::consts::FRAC_PI_3), ("1e-3", 1e-3)] {
        let got = error(&plates(angle, length), &[], &[], 1.0 - (angle / 2.0).sin());
        let reason = "1 - sin(angle / 2) of endless plates; each end loses less than a width; the tolerance";
        rows.push(Row::new(
            format!("plates 1e5 long, {name} between them"),
            got,
            2.0 / length + TOLERANCE,
            reason,
        ));
    }
    let case = "row sums of a cube of 600 cells graded to 1e-3 (slivers)";
    rows.push(Row::new(case, graded_cube_error(&[]), TOLERANCE, BOUND));
    let worst = graded_cube_error(&["--no-skip", "far-rules"]);
    let case = "row sums of a cube of 600 cells graded to 1e-3 (slivers), without far rules";
    // Where far rules are off, the contour of slivers that meet at a corner is to 2.3e-5, and says so (exit 3).
    rows.push(Row::new(case, worst, 3e-5, "the error the matrix states for its worst row, 2.3e-5"));
    rows
}

/// Largest distance of a row sum from 1 in a cube graded towards three of its edges.
fn graded_cube_error(compute: &[&str]) -> f64 {
    let off = |row: &Vec<f64>| (row.iter().sum::<f64>() - 1.0).abs();
    factors(&graded_cube(10), &[], compute).map_or(f64::INFINITY, |f| f.iter().map(off).fold(0.0, f64::max))
}

/// Slivers that meet end to end at a corner: the kernel is singular there, however far apart their centres are.
#[test]
fn slivers_end_to_end_around_an_edge_keep_the_tolerance() {
    let worst = graded_cube_error(&[]);
    assert!(worst <= TOLERANCE, "{worst}");
}

/// Edge-sharing squares from nearly closed to nearly flat.
fn wedges() -> Vec<Row> {
    // Hottel & Sarofim's perpendicular squares with a common edge, 13 digits.
    let right = 0.200_043_776_075_4;
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut rows = vec![
        Row::new("wedge of 90 degrees", error(&wedge(quarter), &[], &[], right), TOLERANCE, BOUND),
        Row::new(
            "wedge of 90 degrees, hemicube of 51 cells",
            error(&wedge(quarter), &[], &["--method", "hemicube", "--resolution", "51"], right),
            0.06 * right,
            "the centre's factor is 4.95 % below the mean; 1 % for cells",
        ),
    ];
    for tilt in [1e-3, 1e-6, 1e-9, 1e-12] {
        let got = error(&wedge(std::f64::consts::PI - tilt), &[], &[], 0.0);
        rows.push(Row::new(
            format!("nearly flat wedge, tilt {tilt:e}"),
            got,
            tilt,
            "long plates: 1 - cos(tilt / 2), below the tilt; never negative",
        ));
    }
    for angle in [1e-1, 1e-3] {
        let sum = factors(&wedge(angle), &[], &[]).map_or(f64::INFINITY, |f| f[0].iter().sum());
        let above = (sum - 1.0).max(0.0);
        rows.push(Row::new(format!("row sum above 1, wedge of {angle:e}"), above, TOLERANCE, BOUND));
    }
    rows
}

/// Sizes and places: the factors are those of the unit squares.
fn scales_and_offsets() -> Vec<Row> {
    let plain = factors(&opposed_faces(1.0, 1.0, 1.0), &[], &[]).unwrap()[0][1];
    let mut rows = Vec::new();
    for power in (-9..=9).step_by(3) {
        let s = 10f64.powi(power);
        let got = error(&opposed_faces(s, s, s), &[], &[], plain);
        rows.push(Row::new(format!("scale 1e{power}"), got, 1e-12, "ratios of lengths only, some ulp each"));
    }
    let mut moved = opposed_faces(1.0, 1.0, 1.0);
    moved.iter_mut().flat_map(|s| &mut s.corners).flatten().for_each(|x| *x += 1e6);
    let got = error(&moved, &[], &[], plain);
    rows.push(Row::new("offset 1e6", got, 1e-9, "half an ulp of 1e6 is 6e-11; a few of them"));
    rows
}

/// Closed rooms whose surfaces all emit 1 and reflect rho: B = 1 / (1 - rho).
fn furnaces() -> Vec<Row> {
    let furnace = |name: &str, surfaces: Vec<Surface>, rho: f64, tolerance: &str| {
        let folder = tests::folder();
        let surfaces: Vec<Surface> = surfaces.into_iter().map(|s| s.painted(Paint::grey(rho, 1.0))).collect();
        let mut chain = Chain::as_given(write(folder.path(), &surfaces), folder.path());
        chain.matrix_flags = ["--tolerance", tolerance, "--precision", "f64"].map(str::to_owned).to_vec();
        for stage in [Stage::Build, Stage::Compute, Stage::Solve] {
            let done = run(&mut chain.command(stage));
            if !matches!(done.code, Some(0 | 3)) {
                eprintln!("stress: {name}: {}", done.stderr);
                return f64::INFINITY;
            }
        }
        let table = chain.radiosities("element");
        let off = |row: usize| (table.number(row, "B_r") * (1.0 - rho) - 1.0).abs();
        (0..table.rows.len()).map(off).fold(0.0, f64::max)
    };
    let mut rows = Vec::new();
    for (name, loss) in [("0.9", 0.1), ("0.999", 1e-3), ("1 - 1e-6", 1e-6), ("1 - 1e-9", 1e-9)] {
        let got = furnace(name, room([1.0, 2.0, 3.0]), 1.0 - loss, "1e-6");
        let limit = 1e-6 + 64.0 * f64::EPSILON / loss;
        let reason = "the solver's tolerance, and 64 ulp of a closed row times 1 / (1 - rho)";
        rows.push(Row::new(format!("furnace of reflectance {name}"), got, limit, reason));
    }
    let quads = boxes::quads(0, 20).into_iter().map(|quad| Surface::new("q", quad)).collect();
    let got = furnace("emitters", quads, 0.5, "1e-3");
    rows.push(Row::new("2400 emitters", got, 2e-3, "row errors times 1 / (1 - rho)"));
    rows
}

/// A room of faces that reflect `rho` and emit `1 - rho` each: B = 1 whatever the reflectances are.
fn grey_room(folder: &std::path::Path, rho: [f64; 6], matrix: &[&str], solve: &[&str]) -> Chain {
    let sides = room([1.0, 2.0, 3.0]).into_iter().zip(rho);
    let surfaces: Vec<Surface> = sides.map(|(side, rho)| side.painted(Paint::grey(rho, 1.0 - rho))).collect();
    let mut chain = Chain::as_given(write(folder, &surfaces), folder);
    chain.mesh_flags = ["--max-edge", "0.5"].map(str::to_owned).to_vec();
    chain.matrix_flags = matrix.iter().map(|&flag| flag.to_owned()).collect();
    chain.solve_flags = solve.iter().map(|&flag| flag.to_owned()).collect();
    chain
}

/// Largest and mean error of B against 1, and the exit code of the solver; infinite where a stage fails.
fn grey_error(chain: &Chain) -> (f64, f64, Option<i32>) {
    let mut code = None;
    for stage in [Stage::Build, Stage::Compute, Stage::Solve] {
        let done = run(&mut chain.command(stage));
        code = done.code;
        if !matches!(done.code, Some(0 | 3)) {
            eprintln!("stress: {stage:?}: {}", done.stderr);
            return (f64::INFINITY, f64::INFINITY, code);
        }
    }
    let table = chain.radiosities("element");
    let errors: Vec<f64> = (0..table.rows.len()).map(|row| (table.number(row, "B_r") - 1.0).abs()).collect();
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    (errors.into_iter().fold(0.0, f64::max), mean, code)
}

/// A matrix with nothing symmetric about it, whose answer is known: face i sees 1/2 of face i + 1, 1/4 of i + 2, and so on to
/// 1/128 of i + 7 and i + 8, so that rows sum to 1 exactly; B is chosen, and E = B - rho F B. The error of B is that of power
/// over emitted power, which the solver bounds by its tolerance.
fn one_way_round(solver: &str) -> f64 {
    let cells: Vec<Surface> = boxes::quads(0, 3).into_iter().map(|quad| Surface::new("cell", quad)).collect();
    let count = cells.len();
    let factor = |i: usize, j: usize| match (j + count - i) % count {
        k @ 1..=7 => 0.5f64.powi(k as i32),
        8 => 0.5f64.powi(7),
        _ => 0.0,
    };
    let (radiosity, rho) = (|i: usize| 5.0 + (i % 4) as f64, |i: usize| 0.25 * (i % 4) as f64);
    let seen = |i: usize| -> f64 { (0..count).map(|j| factor(i, j) * radiosity(j)).sum() };
    let emission = |i: usize| radiosity(i) - rho(i) * seen(i);
    let surfaces: Vec<Surface> = cells
        .iter()
        .enumerate()
        .map(|(i, cell)| cell.clone().painted(Paint::grey(rho(i), emission(i))))
        .collect();
    let folder = tests::folder();
    let mut chain = Chain::as_given(write(folder.path(), &surfaces), folder.path());
    chain.solve_flags = ["--solver", solver, "--tolerance", "1e-8"].map(str::to_owned).to_vec();
    let row = |i: usize| (0..count).map(|j| factor(i, j).to_string()).collect::<Vec<_>>().join(",") + "\n";
    let factors = folder.path().join("f.csv");
    std::fs::write(&factors, (0..count).map(row).collect::<String>()).unwrap();
    let mut import = tool("formfactor-tool");
    import.arg("import").arg(&factors).arg("--mesh").arg(chain.path("mesh")).arg("-o").arg(chain.path("ff"));
    import.args(["--by", "face", "--reciprocity", "keep"]);
    for mut command in [chain.command(Stage::Build), import, chain.command(Stage::Solve)] {
        let done = run(&mut command);
        // No light behaves so: the matrix states what it lacks in reciprocity as its error, and the solver ends with 3 for that.
        if !matches!(done.code, Some(0 | 3)) {
            eprintln!("stress: {solver}: {}", done.stderr);
            return f64::INFINITY;
        }
    }
    let bound = chain.reported("sol", "estimates", "solver bound");
    assert!(bound <= 1e-8, "{solver}: {bound:e}");
    let table = chain.radiosities("face");
    assert_eq!(table.rows.len(), count);
    // Cells are rectangles along the axes.
    let side = |from: [f64; 3], to: [f64; 3]| (0..3).map(|k| (to[k] - from[k]).abs()).sum::<f64>();
    let area = |i: usize| {
        let corners = &cells[i].corners;
        side(corners[0], corners[1]) * side(corners[1], corners[2])
    };
    let off = |i: usize| area(i) * (table.number(i, "B_r") - radiosity(i)).abs();
    let emitted: f64 = (0..count).map(|i| area(i) * emission(i)).sum();
    (0..count).map(off).sum::<f64>() / emitted
}

/// Guards of the solvers, short numbers, files between stages, threads.
fn solvers_and_files() -> Vec<Row> {
    const MIXED: [f64; 6] = [0.0, 0.3, 0.6, 0.9, 0.99, 0.5];
    const MATRIX: [&str; 4] = ["--tolerance", "1e-6", "--precision", "f64"];
    let mut rows = Vec::new();
    for solver in ["cg", "jacobi", "gauss-seidel", "southwell", "direct", "gmres"] {
        let folder = tests::folder();
        let chain = grey_room(folder.path(), MIXED, &MATRIX, &["--solver", solver, "--tolerance", "1e-8"]);
        let (worst, _, _) = grey_error(&chain);
        let reason =
            "B = 1 exactly; the largest of 88 elements for a mean of 1e-8, emitters of 1e-2 among them";
        rows.push(Row::new(format!("{solver}, one side black, others to 0.99"), worst, 1e-5, reason));
    }
    for solver in ["gmres", "jacobi", "gauss-seidel", "southwell"] {
        rows.push(Row::new(
            format!("{solver}, 54 faces that see one way round: A F is not symmetric"),
            one_way_round(solver),
            1e-8,
            "E = B - rho F B for a chosen B; power of the error over emitted power, the solver's tolerance",
        ));
    }
    let folder = tests::folder();
    let capped = grey_room(folder.path(), [0.9; 6], &MATRIX, &["--solver", "jacobi", "--max-steps", "3"]);
    let (_, mean, code) = grey_error(&capped);
    let bound = if code == Some(3) { capped.reported("sol", "estimates", "solver bound") } else { f64::NAN };
    // The elements are squares of one size; the bound is relative to the emitted power, 0.1 of an area.
    let above = (mean / 0.1 - bound).max(0.0);
    let above = if bound.is_nan() { f64::INFINITY } else { above };
    let reason = "exit 3, and the error is within the bound it states; 1e-6 in the rows times 1 / (1 - rho)";
    rows.push(Row::new("Jacobi stopped after 3 steps: error above its bound", above, 1e-5, reason));
    let folder = tests::folder();
    let (worst, _, code) =
        grey_error(&grey_room(folder.path(), [0.9; 6], &MATRIX, &["--solver", "cg", "--tolerance", "1e-30"]));
    let worst = if code == Some(3) { worst } else { f64::INFINITY };
    rows.push(Row::new(
        "cg asked for 1e-30: ends with exit 3",
        worst,
        1e-12,
        "64 ulp of a row times 1 / (1 - rho), 5 times",
    ));
    let folder = tests::folder();
    let short = ["--tolerance", "1e-6", "--precision", "f32"];
    let (worst, _, _) = grey_error(&grey_room(folder.path(), [0.99; 6], &short, &["--tolerance", "1e-8"]));
    rows.push(Row::new(
        "f32 entries, reflectance 0.99",
        worst,
        6e-6,
        "half an f32 ulp, 6e-8, of a row summed in f64, times 1 / (1 - rho)",
    ));
    rows.extend(files());
    rows
}

/// Files between the stages: what comes back is what was written, and nothing else is taken for it.
fn files() -> Vec<Row> {
    let mut rows = Vec::new();
    let folder = tests::folder();
    let matrix = ["--tolerance", "1e-4", "--precision", "f64"];
    let chain = grey_room(folder.path(), [0.5; 6], &matrix, &["--tolerance", "1e-2"]);
    chain.solve();
    let yes = |wrong: bool| f64::from(u8::from(wrong));
    for ending in ["npz", "mtx", "csv"] {
        let (table, again) = (folder.path().join("x").with_extension(ending), folder.path().join("again.ff"));
        let mesh = chain.path("mesh");
        let mut export = tool("formfactor-tool");
        export.arg("export").arg(chain.path("ff")).arg("--mesh").arg(&mesh).args(["--by", "element", "-o"]);
        let out = run(export.arg(&table));
        let mut import = tool("formfactor-tool");
        import.arg("import").arg(&table).arg("--mesh").arg(&mesh).arg("-o").arg(&again);
        let back = run(import.args(["--tolerance", "1e-3"]));
        let mut compare = tool("formfactor-tool");
        let same = run(compare.arg("compare").arg(chain.path("ff")).arg(&again).args(["--max", "1e-14"]));
        let wrong = [out, back, same].into_iter().find(|done| done.code != Some(0));
        wrong.iter().for_each(|done| eprintln!("stress: {ending}: {}", done.stderr));
        let reason = "no difference above 1e-14: 17 digits, or the bits";
        rows.push(Row::new(
            format!("matrix out to {ending} and in again: differs"),
            yes(wrong.is_some()),
            0.0,
            reason,
        ));
    }
    let (good, mut taken) = (tests::bytes(&chain.path("ff")), 0);
    for (_, bad) in tests::damage::flips(&good, 32, 14) {
        std::fs::write(chain.path("ff"), bad).unwrap();
        taken += usize::from(matches!(
            run(&mut chain.command_to(Stage::Solve, &folder.path().join("no.sol"))).code,
            Some(0 | 3)
        ));
    }
    std::fs::write(chain.path("ff"), good).unwrap();
    rows.push(Row::new(
        "32 matrices with one bit flipped: taken by the solver",
        taken as f64,
        0.0,
        "checksums",
    ));
    for stage in [Stage::Build, Stage::Compute, Stage::Solve] {
        let path = chain.path(stage.output());
        let bytes = |threads: &str| {
            run(chain.command(stage).args(["--threads", threads]));
            tests::bytes(&path)
        };
        let differing = yes(bytes("1") != bytes("3"));
        rows.push(Row::new(
            format!("{} with 1 and 3 threads: differs", stage.output()),
            differing,
            0.0,
            "byte for byte",
        ));
    }
    rows
}

/// Very few elements, many at one place, points at a wall's foot.
fn few_and_many() -> Vec<Row> {
    let mut rows = Vec::new();
    let one = vec![opposed_faces(1.0, 1.0, 1.0).remove(0).painted(Paint::grey(0.5, 1.0))];
    let folder = tests::folder();
    let chain = Chain::as_given(write(folder.path(), &one), folder.path());
    chain.solve();
    let lone = (chain.radiosities("element").number(0, "B_r") - 1.0).abs();
    rows.push(Row::new("one element: B = E", lone, 1e-15, "pi times E / pi, rounded twice"));
    let mut crowd = opposed_faces(1.0, 1.0, 1.0);
    let copies = (0..199).map(|_| crowd[0].clone()).collect::<Vec<_>>();
    crowd.extend(copies);
    let got = error(&crowd, &[], &[], tests::two_squares::FORM_FACTOR);
    rows.push(Row::new("200 coincident faces", got, TOLERANCE, BOUND));

    let mut corner = wedge(std::f64::consts::FRAC_PI_2);
    corner[1].paint = Paint::grey(0.0, 1.0);
    let folder = tests::folder();
    let chain = Chain::as_given(write(folder.path(), &corner), folder.path()).with_tolerances("1e-6", "1e-6");
    chain.solve();
    for power in [3, 6, 9] {
        let d = 10f64.powi(-power);
        let probed = chain.probe(&[[d, 0.5, 0.0, 0.0, 0.0, 1.0]]).number(0, "H_r");
        let limit = 2.0 * d + 1e-6;
        let reason = "the limit is 1/2; a wall of height 1 misses d / 2, its ends less; 1e-6 for the light";
        rows.push(Row::new(
            format!("point 1e-{power} from a wall's foot"),
            (probed - 0.5).abs(),
            limit,
            reason,
        ));
    }
    rows
}

/// Eyes where no eye should be: every pixel is a number.
fn eyes() -> Vec<Row> {
    let folder = tests::folder();
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder.path(), 200);
    chain.run_all();
    let eyes = [
        ("in the floor", "278,0,280", "278,300,500"),
        ("on a vertex", "130,165,65", "278,300,500"),
        ("inside a block", "185,80,170", "278,300,500"),
        ("in a block's top", "185,165,170", "278,200,500"),
    ];
    let mut rows = Vec::new();
    for (name, eye, at) in eyes {
        let mut command = chain.command(Stage::Render);
        let done = run(command.args(["--eye", eye, "--look-at", at]));
        let exr = chain.path("exr");
        let compared = run(tool("shade-tool").arg("compare").arg(&exr).arg(&exr).arg("--json"));
        let json: serde_json::Value = serde_json::from_str(&compared.stdout).unwrap_or_default();
        let not_finite = json["channels"].as_array().map_or(f64::INFINITY, |channels| {
            channels.iter().map(|c| c["not_finite"].as_f64().unwrap_or(f64::INFINITY)).sum()
        });
        let bad = if matches!(done.code, Some(0 | 3)) { not_finite } else { f64::INFINITY };
        rows.push(Row::new(format!("eye {name}: pixels that are no number"), bad, 0.0, "none may be"));
    }
    rows
}

/// The scenes of tests/scenes/stress: refused by name, or right.
fn folder_scenes() -> Vec<Row> {
    const REFUSED: [&str; 3] = ["stress_nan", "stress_rho_gt1", "furnace_100"];
    let mut names: Vec<String> = std::fs::read_dir(tests::scene("stress"))
        .unwrap()
        .filter_map(|e| Some(e.unwrap().file_name().to_str()?.strip_suffix(".obj")?.to_owned()))
        .collect();
    names.sort();
    let mut rows = Vec::new();
    for name in names {
        let folder = tests::folder();
        let chain = Chain::new(tests::scene(&format!("stress/{name}.obj")), folder.path(), 900);
        let stages = [Stage::Build, Stage::Compute, Stage::Solve];
        let failed =
            stages.into_iter().map(|s| run(&mut chain.command(s))).find(|d| !matches!(d.code, Some(0 | 3)));
        if REFUSED.contains(&name.as_str()) {
            let clear = failed.is_some_and(|d| d.code == Some(1) && d.stderr.contains(": error: "));
            let left = clear && !chain.path("sol").exists();
            rows.push(Row::new(
                format!("{name}: refused"),
                f64::from(u8::from(!left)),
                0.0,
                "one clear message",
            ));
            continue;
        }
        if let Some(done) = failed {
            eprintln!("stress: {name}: {}", done.stderr);
            rows.push(Row::new(name, f64::INFINITY, 0.05, "must be computed"));
            continue;
        }
        rows.push(scene_row(&name, &chain));
    }
    rows
}

/// The irradiance of a scene of the folder against its answers.
fn scene_row(name: &str, chain: &Chain) -> Row {
    let own = tests::reference(&format!("stress/{name}.csv"));
    let points = if own.exists() {
        Table::read(&own)
    } else {
        Table::read(&tests::reference("stress/stress_ref.csv"))
    };
    let scale = if name.contains("tiny") {
        1e-6
    } else if name.contains("huge") {
        1e6
    } else {
        1.0
    };
    let extra = tests::scene(&format!("stress/{name}.extra.json"));
    let exact = extra.exists().then(|| {
        let json: serde_json::Value = serde_json::from_str(&tests::text(&extra)).unwrap();
        json["exact_irradiance_E"][0].as_f64().unwrap()
    });
    let place = |row: usize| {
        let at = ["x", "y", "z"].map(|c| points.number(row, c) * scale);
        let normal = ["nx", "ny", "nz"].map(|c| points.number(row, c));
        [at[0], at[1], at[2], normal[0], normal[1], normal[2]]
    };
    let places: Vec<[f64; 6]> = (0..points.rows.len()).map(place).collect();
    let table = chain.probe(&places);
    let got: Vec<[f64; 3]> =
        (0..places.len()).map(|row| ["H_r", "H_g", "H_b"].map(|c| table.number(row, c))).collect();
    if name.contains("nolight") {
        let most = got.iter().flatten().fold(0.0, |most: f64, h| most.max(h.abs()));
        return Row::new(format!("{name}: largest irradiance"), most, 0.0, "no light, no irradiance");
    }
    match exact {
        // The furnaces' answer holds where the room is seen; points inside their block see nothing.
        Some(exact) => {
            let seen: Vec<[f64; 3]> = got.into_iter().filter(|h| h[0] > 0.0).collect();
            let reason = "exact answer; 1e-3 in the matrix's rows times 1 / (1 - rho), closed";
            Row::new(
                format!("{name}: rms over points"),
                rms(&seen, &vec![[exact; 3]; seen.len()]),
                0.02,
                reason,
            )
        }
        None => {
            let reason = "900 elements: a twentieth; the answers' own error is far less";
            Row::new(format!("{name}: rms over points"), rms(&got, &given(&points)), 0.05, reason)
        }
    }
}

#[test]
fn every_row_meets_its_number() {
    let parts: [fn() -> Vec<Row>; 9] = [
        gaps_and_strips,
        contacts,
        wedges,
        scales_and_offsets,
        furnaces,
        solvers_and_files,
        few_and_many,
        eyes,
        folder_scenes,
    ];
    let rows: Vec<Row> = parts.into_iter().flat_map(|part| part()).collect();
    println!("{}", table(&rows));
    if let Some(path) = std::env::var_os("STRESS_INTO") {
        tests::proof::table::put(path.as_ref(), "stress", &table(&rows));
    }
    let missed: Vec<&Row> = rows.iter().filter(|row| !row.met()).collect();
    assert!(missed.is_empty(), "{missed:#?}");
}
