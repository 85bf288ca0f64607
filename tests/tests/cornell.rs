//! Whole scenes through the real programs, against irradiances computed by other means (`tests/reference/README.md`):
//! group means of the Cornell box by photons, and points of three scenes, among them an exact penumbra.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::Chain;
use tests::table::Table;
use tests::{Tolerance, assert_close, reference, scene};

const CHANNELS: [&str; 3] = ["r", "g", "b"];

/// Share of the published box's power that leaves through its open front, per channel.
const ESCAPED: [f64; 3] = [0.321_507, 0.299_030, 0.272_622];

#[test]
fn group_means_of_the_published_box() {
    // With constant elements the means of faces in deep shadow converge slowest: the front and the left of the short block
    // are 0.9 % off at 2500 elements, 0.5 % at 5000, 0.3 % at 8000.
    let folder = tests::folder();
    let chain = Chain::new(scene("cornell_theory.obj"), folder.path(), 2500).with_tolerances("2e-3", "2e-3");
    chain.solve();

    let (got, want) = (chain.radiosities("group"), Table::read(&reference("cornell_theory.csv")));
    assert_eq!(got.rows.len(), want.rows.len());
    for (row, cells) in want.rows.iter().enumerate() {
        let (group, of_group) = (&cells[0], got.row_of(&cells[0]));
        // The reference rounds areas to 0.01; the floor counts its part under the blocks, which receives nothing.
        let area = want.number(row, "area");
        assert_close(&format!("area of {group}"), got.number(of_group, "area"), area, Tolerance::Rel(1e-6));
        for channel in CHANNELS {
            let mean = want.number(row, &format!("H_{channel}"));
            let allowed = (0.01 * mean).max(3.0 * want.number(row, &format!("se_{channel}")));
            let what = format!("H_{channel} of {group}");
            let got = got.number(of_group, &format!("H_{channel}"));
            assert_close(&what, got, mean, Tolerance::Abs(allowed));
        }
    }
    for (channel, escaped) in ["red", "green", "blue"].iter().zip(ESCAPED) {
        let power = |fate: &str| chain.reported("sol", "estimates", &format!("power {fate} {channel}"));
        let share = power("escaped") / power("emitted");
        assert_close(&format!("escaped, {channel}"), share, escaped, Tolerance::Rel(5e-3));
        let balance = (power("escaped") + power("absorbed")) / power("emitted");
        assert_close(&format!("balance, {channel}"), balance, 1.0, Tolerance::Abs(2e-3));
    }
}

/// Root mean square and mean of H / reference - 1 over points and channels. Points whose reference has a standard error
/// above 2 % are left out; where light is weak the error is relative to 1 % of the channel's mean.
fn errors(chain: &Chain, name: &str) -> (f64, f64) {
    let want = Table::read(&reference(name));
    // The lines lie on a floor and come without normals.
    let normal = |row: usize, axis: &str, up: f64| match want.header.iter().any(|h| h == axis) {
        true => want.number(row, axis),
        false => up,
    };
    let rows = 0..want.rows.len();
    let place = |row: usize| ["x", "y", "z"].map(|axis| want.number(row, axis));
    let points = rows.clone().map(|row| {
        let [x, y, z] = place(row);
        [x, y, z, normal(row, "nx", 0.0), normal(row, "ny", 1.0), normal(row, "nz", 0.0)]
    });
    let got = chain.probe(&points.collect::<Vec<_>>());

    let mut errors = Vec::new();
    for channel in CHANNELS {
        let (irradiance, deviation) = (format!("E_{channel}"), format!("seE_{channel}"));
        let mean =
            rows.clone().map(|row| want.number(row, &irradiance)).sum::<f64>() / want.rows.len() as f64;
        for row in rows.clone() {
            let value = want.number(row, &irradiance);
            let known = !want.header.contains(&deviation) || want.number(row, &deviation) <= 0.02 * value;
            if known {
                let difference = got.number(row, &format!("H_{channel}")) - value;
                errors.push(difference / value.max(0.01 * mean));
            }
        }
    }
    // No test may pass because its points were left out.
    assert!(
        10 * errors.len() > 9 * 3 * want.rows.len(),
        "{} errors of {} points",
        errors.len(),
        want.rows.len()
    );
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / errors.len() as f64;
    (mean(&mut errors.iter().map(|e| e * e)).sqrt(), mean(&mut errors.iter().copied()))
}

#[test]
fn penumbra_lines_are_exact() {
    // The light reflects nothing and the floor sees no other reflector: gathering from one light polygon behind one
    // blocker is exact, whatever the elements are.
    let folder = tests::folder();
    let chain = Chain::new(scene("penumbra.obj"), folder.path(), 300).with_tolerances("1e-6", "1e-6");
    chain.solve();
    let (rms, bias) = errors(&chain, "penumbra_lines.csv");
    assert_close("rms", rms, 0.0, Tolerance::Abs(1e-9));
    assert_close("bias", bias, 0.0, Tolerance::Abs(1e-9));
}

#[test]
fn points_of_the_coloured_cube() {
    let folder = tests::folder();
    let chain = Chain::new(scene("goral_cube.obj"), folder.path(), 1500).with_tolerances("1e-3", "1e-3");
    chain.solve();
    let (rms, bias) = errors(&chain, "goral_cube.csv");
    assert_close("rms", rms, 0.0, Tolerance::Abs(0.01));
    assert_close("bias", bias, 0.0, Tolerance::Abs(0.0025));
}

#[test]
fn points_of_the_box_with_blocks() {
    let folder = tests::folder();
    let chain = Chain::new(scene("cornell_blocks.obj"), folder.path(), 2000).with_tolerances("1e-3", "1e-3");
    chain.solve();
    let (rms, bias) = errors(&chain, "cornell_blocks.csv");
    assert_close("rms", rms, 0.0, Tolerance::Abs(0.02));
    assert_close("bias", bias, 0.0, Tolerance::Abs(0.005));
}
