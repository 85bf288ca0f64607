//! What lies under a block has no elements: it keeps its area in tables, sends and receives nothing, and has its face's
//! temperature.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::Chain;
use tests::table::Table;
use tests::{Tolerance, assert_close, run, scene, tool};

/// The floor of the published box with what lies under its two blocks, to 0.01.
const FLOOR: f64 = 308_231.04;

fn export(chain: &Chain, quantity: &str) -> Table {
    let output = chain.path(&format!("{quantity}.csv"));
    let mut export = tool("solve-tool");
    export.arg("export").arg(chain.path("sol")).arg("--mesh").arg(chain.path("mesh"));
    run(export.args(["--by", "group", "--quantity", quantity, "-o"]).arg(&output)).expect_code(0);
    Table::read(&output)
}

#[test]
fn powers_and_temperatures_of_a_floor_under_blocks() {
    let folder = tests::folder();
    let chain = Chain::new(scene("cornell_blocks.obj"), folder.path(), 300).with_tolerances("1e-3", "5e-3");
    chain.solve();
    assert!(chain.reported("mesh", "estimates", "hidden area") > 40_000.0);
    let (means, energy) = (export(&chain, "radiosity"), export(&chain, "energy"));
    let floor = means.row_of("floor");
    assert_close(
        "area",
        energy.number(energy.row_of("floor"), "area"),
        means.number(floor, "area"),
        Tolerance::Rel(1e-12),
    );
    assert_close("area of the floor", means.number(floor, "area"), FLOOR, Tolerance::Abs(0.01));
    for (channel, name) in [("r", "red"), ("g", "green"), ("b", "blue")] {
        // Of every group: what it absorbs is area (H - B + E), all three by the same area.
        for (row, cells) in means.rows.iter().enumerate() {
            let own = energy.row_of(&cells[0]);
            let mean = |letter: &str| means.number(row, &format!("{letter}_{channel}"));
            let power = |what: &str| energy.number(own, &format!("{what}_{channel}"));
            let expected = means.number(row, "area") * (mean("H") - mean("B")) + power("emitted");
            let what = format!("{} absorbs, {name}", cells[0]);
            let whole = chain.reported("sol", "estimates", &format!("power emitted {name}"));
            assert_close(&what, power("absorbed"), expected, Tolerance::Abs(1e-9 * whole));
        }
        // And all groups together what the solver reports.
        for fate in ["emitted", "absorbed", "escaped"] {
            let column = format!("{fate}_{channel}");
            let sum: f64 = (0..energy.rows.len()).map(|row| energy.number(row, &column)).sum();
            let reported = chain.reported("sol", "estimates", &format!("power {fate} {name}"));
            assert_close(&column, sum, reported, Tolerance::Rel(1e-9));
        }
    }

    // At one temperature everywhere the floor has it, too, all of it.
    let groups: Vec<&String> = means.rows.iter().map(|cells| &cells[0]).collect();
    let lines: String = groups.iter().map(|group| format!("{group},0.8,300,\n")).collect();
    let table = folder.path().join("t.csv");
    std::fs::write(&table, format!("group,emissivity,temperature,flux\n{lines}")).unwrap();
    let mut solve = tool("solve-tool");
    solve
        .arg("solve")
        .arg(chain.path("ff"))
        .arg("--mesh")
        .arg(chain.path("mesh"))
        .arg("--thermal")
        .arg(table);
    run(solve.args(["--tolerance", "1e-6", "-o"]).arg(chain.path("sol")));
    let heat = export(&chain, "heat");
    for group in groups {
        let row = heat.row_of(group);
        assert_close(group, heat.number(row, "temperature"), 300.0, Tolerance::Rel(1e-9));
        assert_close(group, heat.number(row, "emissivity"), 0.8, Tolerance::Rel(1e-12));
        let flux = heat.number(row, "net_flux") * heat.number(row, "area");
        assert_close(group, heat.number(row, "net_heat"), flux, Tolerance::Rel(1e-9));
    }
}
