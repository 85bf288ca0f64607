//! Every fuzz body over seeded inputs, on stable. FUZZ_SECONDS=600 lets each go on that long (`make -f pipeline.mk fuzz
//! T=600`); without it each runs a fixed number of inputs. A failure prints the seed and the bytes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use geometry::plane::PLANARITY;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use tests::chain::Chain;
use tests::damage::Dice;
use tests::fuzz::{READERS, changed, clipping, form_factor_invariants, reader, visible_parts};
use tests::{run, tool, two_squares};

/// Inputs of each geometric body where no time is asked for.
const SHORT: u64 = 50_000;

/// Inputs of each reader: files cost more.
const SHORT_FILES: u64 = 120;

/// Feeds a body with the inputs of seeds 0, 1, 2 and so on.
#[track_caller]
fn drive(name: &str, short: u64, input: impl Fn(&mut Dice) -> Vec<u8>, body: impl Fn(&[u8])) {
    let seconds =
        std::env::var("FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).map(Duration::from_secs_f64);
    let start = Instant::now();
    let mut seed = 0;
    while seconds.map_or(seed < short, |limit| start.elapsed() < limit) {
        let bytes = input(&mut Dice::new(seed));
        let done = catch_unwind(AssertUnwindSafe(|| body(&bytes)));
        assert!(done.is_ok(), "{name}: seed {seed}: {}", bytes.escape_ascii());
        seed += 1;
    }
    println!("fuzz: {name}: {seed} inputs in {:.0} s", start.elapsed().as_secs_f64());
}

/// Good files of all kinds in a folder, named `s.*`.
fn good_files(folder: &Path) {
    for ending in ["obj", "mtl", "toml"] {
        let from = tests::scene(&format!("cornell_blocks.{ending}"));
        let text = tests::text(&from).replace("cornell_blocks.mtl", "s.mtl");
        std::fs::write(folder.join("s").with_extension(ending), text).unwrap();
    }
    let files = two_squares::write(folder);
    for (from, ending) in files.all().into_iter().zip(["mesh", "materials", "ff", "sol"]) {
        std::fs::copy(from, folder.join("s").with_extension(ending)).unwrap();
    }
    for ending in ["csv", "npy", "npz", "mtx", "rmx", "vf"] {
        let mut export = tool("formfactor-tool");
        export
            .arg("export")
            .arg(&files.matrix)
            .arg("--mesh")
            .arg(&files.mesh)
            .args(["--by", "element", "-o"]);
        run(export.arg(folder.join("s").with_extension(ending))).expect_code(0);
    }
    std::fs::write(folder.join("s.vs3"), VIEW3D).unwrap();
}

/// View3D's lines of every kind, in both formats.
const VIEW3D: &str = "T all kinds ! of lines\nC encl=1, emit=0\nF 3\n! vertices\nV 1 0 0 0\nV 2 4 0 0\nV 3 4 4 0\nV 4 0 4 0\n\
    V 5 1 1 0\nV 6 2 1 0\nV 7 2 2 0\nV 8 1 2 0\nS 1 1 2 3 4 0 0 .9 base\nS 2 5 6 7 0 1 0 .5 window\nS 3 4 3 2 1 0 0 .9 ceiling\n\
    S 4 5 7 8 0 1 2 .5 more\nF 3a\nS 5 R 0 0 .9 wall\n4 4 0 180 90 4 3\nS 6 T 5 0 .5 gable\n4 4 0 180 90\n1 1 2 1 1 2\n\
    N 7 Q 1 0 .9 gap\n3 3 0 0 180 0 0 .5 0 .5 .5 0 .5\nM 8 R 5 0 .9 mask\n8 4 1 0 90 1 1\nO 9 R\n9 9 0 30 40 1 1\nE\n";

#[test]
fn readers_answer_any_bytes() {
    let folder = tests::folder();
    good_files(folder.path());
    for ending in READERS {
        let path = folder.path().join("s").with_extension(ending);
        let good = tests::bytes(&path);
        assert!(reader(folder.path(), ending, &good), "the good {ending} is refused");
        drive(
            ending,
            SHORT_FILES,
            |dice| changed(&good, dice),
            |bytes| {
                let _ = reader(folder.path(), ending, bytes);
            },
        );
        std::fs::write(path, good).unwrap();
    }
}

/// Bytes of a seeded length.
fn noise(dice: &mut Dice) -> Vec<u8> {
    let length = dice.below(64);
    (0..length).map(|_| dice.bits() as u8).collect()
}

#[test]
fn clipping_keeps_its_promises() {
    drive("clipping", SHORT, noise, clipping);
}

#[test]
fn form_factors_keep_their_invariants() {
    drive("form_factor_invariants", SHORT, noise, form_factor_invariants);
}

/// Bytes enough for an eye, a target and up to three blockers.
fn scenery(dice: &mut Dice) -> Vec<u8> {
    (0..16 + dice.below(112)).map(|_| dice.bits() as u8).collect()
}

#[test]
fn visible_parts_keep_their_promises() {
    drive("visible_parts", SHORT, scenery, |bytes| {
        let _ = visible_parts(bytes);
    });
}

/// The eye is 6e-15 above the plane of the target and within it: what it sees is rounding's choice, but never more than all.
#[test]
fn a_target_the_eye_lies_in_within_rounding_is_not_judged() {
    assert_eq!(visible_parts(&scenery(&mut Dice::new(423_398))), None);
}

/// The last blocker lies within 4e-9 of the target's plane, where contact is a matter of tolerance: a shadow that reaches into
/// a part by less than `PLANARITY` of their sizes counts as not touching it.
#[test]
fn order_of_blockers_matters_by_the_tolerance_of_contact_at_most() {
    // What is lost so is a strip as long as the target, 7.1, and 1e-9 of that wide, at a distance of at least 4.0.
    let most = PLANARITY * 50.0 / (std::f64::consts::PI * 16.25);
    let worst = visible_parts(&scenery(&mut Dice::new(1_998_664)));
    assert!(worst.is_some_and(|worst| worst <= most), "{worst:?} of {most:e}");
}

/// Blockers only take away: each factor with a screen in the room is at most the one without, and rows sum to 1 at most.
#[test]
fn blocked_factors_are_no_larger() {
    let folder = tests::folder();
    let mut dice = Dice::new(7);
    for _ in 0..6 {
        let mut at = || 0.2 + 0.6 * dice.below(1000) as f64 / 1000.0;
        let (a, b, c) = ([at(), at(), at()], [at(), at(), at()], [at(), at(), at()]);
        let screen = tests::surfaces::Surface::new("screen", [a, b, c]);
        let mut surfaces = tests::surfaces::room([1.0; 3]);
        let factors = |surfaces: &[tests::surfaces::Surface]| {
            let file = tests::surfaces::write(folder.path(), surfaces);
            let chain = Chain::as_given(file, folder.path()).with_tolerances("1e-4", "1e-3");
            chain.compute();
            let table = chain.factors("face");
            let cells = |row: &Vec<String>| row[row.len() - table.rows.len()..].to_vec();
            table
                .rows
                .iter()
                .map(|r| cells(r).iter().map(|c| c.parse().unwrap()).collect())
                .collect::<Vec<Vec<f64>>>()
        };
        let open = factors(&surfaces);
        surfaces.push(screen);
        let blocked = factors(&surfaces);
        for (i, row) in open.iter().enumerate() {
            assert!(blocked[i].iter().sum::<f64>() <= 1.0 + 1e-4, "{a:?} {b:?} {c:?}: row {i}");
            // Each of the two is within the tolerance.
            assert!(row.iter().zip(&blocked[i]).all(|(f, g)| *g <= f + 2e-4), "{a:?} {b:?} {c:?}: row {i}");
        }
    }
}

/// A patch seen edge-on within rounding: the one-point rule gave -5e-34.
#[test]
fn a_patch_seen_edge_on_has_no_negative_factor() {
    form_factor_invariants(b"V\x9b\xef\x9f\xa3\xf9\xf5\xe5u\x02\x19>\xa7*v\x9f\xdee\x82yJkLX\\\xceX\x85");
}
