//! View3D's scenes with all that the formats know, to factors by group, against closed forms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::Chain;
use tests::table::Table;
use tests::{Tolerance, assert_close, run, tool};

/// Between opposite and between adjacent faces of a cube (Howell's catalogue, C-11 and C-14).
const OPPOSITE: f64 = 0.199_824_895_698_387_46;
const ADJACENT: f64 = 0.25 * (1.0 - OPPOSITE);

/// The unit cube in format 3a, seen from inside.
const CUBE: &str = "T a cube ! by place, azimuth, tilt and shape\nC encl=1 list=2\nF 3a\n\
    S 1 R 0 0 .9 floor\n 0 0 0 180 0  1 1\n\
    S 2 Q 0 0 .9 ceiling\n 1 0 1 0 180\n 0 0 1 0 1 1 0 1\n\
    S 3 R 0 0 .9 south\n 1 0 0 0 90  1 1\nS 4 R 0 0 .9 north\n 0 1 0 180 90  1 1\n\
    S 5 R 0 0 .9 west\n 0 0 0 90 90  1 1\n\
    S 6 T 0 0 .9 east\n 1 1 0 270 90\n 0 0 1 0 1 1\nS 7 T 0 6 .9 other\n 1 1 0 270 90\n 0 0 1 1 0 1 ! combines\n";

/// Factors by group of the cube with more surfaces in it, and what reading it says.
fn factors(more: &str) -> (Table, String) {
    let folder = tests::folder();
    let [from, scene] = ["s.vs3", "s.obj"].map(|name| folder.path().join(name));
    std::fs::write(&from, format!("{CUBE}{more}End of data\n")).unwrap();
    let said = run(tool("mesh-tool").arg("import").arg(&from).arg("-o").arg(&scene)).expect_code(0).stderr;
    let chain = Chain::as_given(scene, folder.path()).with_tolerances("1e-6", "1e-3");
    chain.compute();
    (chain.factors("group"), said)
}

fn close(table: &Table, from: &str, to: &str, want: f64, tolerance: f64) {
    let got = table.number(table.row_of(from), to);
    assert_close(&format!("F({from} -> {to})"), got, want, Tolerance::Abs(tolerance));
}

#[test]
fn subsurfaces_null_surfaces_and_combined_ones() {
    // Half of the ceiling is a skylight of its own, half of a wall is taken out.
    let (table, said) =
        factors("S 8 R 2 0 .5 skylight\n 1 0 1 0 180  .5 1\nN 9 R 3 0 .9 gap\n 0 0 0 180 90  .5 1\n");
    assert!(said.contains("1 null surface turned black"), "{said}");
    for (to, want) in [
        ("ceiling", 0.5 * OPPOSITE),
        ("skylight", 0.5 * OPPOSITE),
        ("south", 0.5 * ADJACENT),
        ("obstruction", 0.5 * ADJACENT),
        ("north", ADJACENT),
        ("east", ADJACENT),
    ] {
        close(&table, "floor", to, want, 1e-6);
    }
    close(&table, "skylight", "floor", OPPOSITE, 1e-6);
    close(&table, "east", "west", OPPOSITE, 1e-6);
    close(&table, "ceiling", "skylight", 0.0, 0.0);
}

#[test]
fn a_mask_sees_its_base_alone() {
    let (table, said) = factors("M 8 R 1 0 .9 mask\n .5 0 0 0 180  .5 .5\n");
    assert!(said.contains("1 mask moved off the base"), "{said}");
    // The air under the mask is 1e-6 of its size high.
    close(&table, "mask", "floor", 1.0, 1e-5);
    close(&table, "floor", "mask", 0.25, 1e-5);
    // A quarter of the floor sees the mask in place of the ceiling, by symmetry as every quarter does.
    close(&table, "ceiling", "floor", 0.75 * OPPOSITE, 1e-5);
    close(&table, "ceiling", "mask", 0.0, 0.0);
}
