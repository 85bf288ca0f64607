//! Thermal enclosures through the real programs: prescribed temperatures, adiabatic and heated surfaces, against exact
//! networks and a published room.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::Chain;
use tests::surfaces::{self, Surface, corners, json, list, number};
use tests::table::Table;
use tests::{Run, Tolerance, assert_close, run, tool};

/// What a line of the thermal table gives: emissivity, temperature or flux.
enum Given {
    Kelvin(f64, f64),
    Flux(f64, f64),
}

/// The heat table of surfaces whose groups are `given`.
fn heat(surfaces: &[Surface], given: &[(&str, Given)], tolerance: &str) -> (Table, tempfile::TempDir) {
    let folder = tests::folder();
    let scene = surfaces::write(folder.path(), surfaces);
    let chain = Chain::as_given(scene, folder.path()).with_tolerances(tolerance, "1e-9");
    chain.compute();
    let mut text = "group,emissivity,temperature,flux\n".to_owned();
    for (group, given) in given {
        text += &match given {
            Given::Kelvin(emissivity, kelvin) => format!("{group},{emissivity},{kelvin},\n"),
            Given::Flux(emissivity, flux) => format!("{group},{emissivity},,{flux}\n"),
        };
    }
    let table = folder.path().join("t.csv");
    std::fs::write(&table, text).unwrap();
    let mut solve = tool("solve-tool");
    solve
        .arg("solve")
        .arg(chain.path("ff"))
        .arg("--mesh")
        .arg(chain.path("mesh"))
        .arg("--thermal")
        .arg(table);
    let done = run(solve.args(["--tolerance", "1e-9", "-o"]).arg(chain.path("sol")));
    assert!(matches!(done.code, Some(0 | 3)), "{}", done.stderr);
    let output = folder.path().join("heat.csv");
    let mut export = tool("solve-tool");
    export.arg("export").arg(chain.path("sol")).arg("--mesh").arg(chain.path("mesh"));
    run(export.args(["--by", "group", "--quantity", "heat", "-o"]).arg(&output)).expect_code(0);
    (Table::read(&output), folder)
}

fn network(id: &str) -> serde_json::Value {
    let all = json("published/enclosures.json");
    list(&all["networks"]).iter().find(|network| network["id"] == id).expect("the network").clone()
}

const SIDES: [&str; 6] = ["z=0", "z=c", "y=0", "y=b", "x=0", "x=a"];

#[test]
fn cube_of_six_temperatures() {
    let network = network("heat-cube");
    let given: Vec<(&str, Given)> = SIDES
        .iter()
        .enumerate()
        .map(|(k, side)| {
            (*side, Given::Kelvin(number(&network["emissivity"][k]), number(&network["T_K"][k])))
        })
        .collect();
    let (table, _folder) = heat(&surfaces::room([1.0; 3]), &given, "1e-12");
    let mut sum = 0.0;
    for (k, side) in SIDES.iter().enumerate() {
        let got = table.number(table.row_of(side), "net_heat");
        assert_close(side, got, number(&network["net_heat_leaving_W"][k]), Tolerance::Rel(1e-9));
        let kelvin = table.number(table.row_of(side), "temperature");
        assert_close(side, kelvin, number(&network["T_K"][k]), Tolerance::Rel(1e-12));
        sum += got;
    }
    assert_close("heat in all", sum, 0.0, Tolerance::Abs(1e-6));
}

#[test]
fn plates_in_black_and_in_insulated_surroundings() {
    let plates = |sides: fn() -> Given| -> Vec<(&str, Given)> {
        let mut given = vec![("z=0", Given::Kelvin(0.8, 1000.0)), ("z=c", Given::Kelvin(0.5, 600.0))];
        given.extend(SIDES[2..].iter().map(|side| (*side, sides())));
        given
    };
    let room = surfaces::room([1.0; 3]);
    let of = |table: &Table, sides: &[&str], column: &str| -> f64 {
        sides.iter().map(|side| table.number(table.row_of(side), column)).sum()
    };
    let black = network("heat-3-surface");
    let (table, _folder) = heat(&room, &plates(|| Given::Kelvin(1.0, 300.0)), "1e-12");
    for (sides, want) in
        [&SIDES[..1], &SIDES[1..2], &SIDES[2..]].iter().zip(list(&black["net_heat_leaving_W"]))
    {
        assert_close("black", of(&table, sides, "net_heat"), number(want), Tolerance::Rel(1e-9));
    }
    let insulated = network("heat-3-surface-reradiating");
    let want = number(&insulated["net_heat_1_to_2_W"]);
    let (table, _folder) = heat(&room, &plates(|| Given::Flux(0.3, 0.0)), "1e-12");
    assert_close("from", of(&table, &SIDES[..1], "net_heat"), want, Tolerance::Rel(1e-9));
    assert_close("to", of(&table, &SIDES[1..2], "net_heat"), -want, Tolerance::Rel(1e-9));
    for side in &SIDES[2..] {
        assert_close("insulated", of(&table, &[side], "net_heat"), 0.0, Tolerance::Abs(1e-9));
        let kelvin = of(&table, &[side], "temperature");
        assert!(600.0 < kelvin && kelvin < 1000.0, "{side}: {kelvin}");
    }
}

/// A prescribed flux and the temperature that goes with it are two ways to say the same.
#[test]
fn a_flux_gives_the_temperature_that_gives_the_flux() {
    let room = surfaces::room([1.0, 2.0, 1.5]);
    let others = || -> Vec<(&str, Given)> {
        vec![
            ("z=0", Given::Kelvin(0.9, 300.0)),
            ("y=0", Given::Kelvin(0.3, 350.0)),
            ("y=b", Given::Kelvin(1.0, 280.0)),
            ("x=0", Given::Flux(0.5, -100.0)),
            ("x=a", Given::Flux(0.7, 0.0)),
        ]
    };
    let with = |last: Given| {
        let mut given = others();
        given.push(("z=c", last));
        heat(&room, &given, "1e-10").0
    };
    let first = with(Given::Flux(0.6, 500.0));
    let row = first.row_of("z=c");
    assert_close("flux", first.number(row, "net_flux"), 500.0, Tolerance::Rel(1e-12));
    let second = with(Given::Kelvin(0.6, first.number(row, "temperature")));
    for side in SIDES {
        for column in ["temperature", "net_flux"] {
            let (a, b) =
                (first.number(first.row_of(side), column), second.number(second.row_of(side), column));
            assert_close(&format!("{side}, {column}"), b, a, Tolerance::Abs(1e-6));
        }
    }
}

/// Pinney and Bean's L-shaped room with one cooler wall. The published constant of Stefan and Boltzmann differs in the
/// fifth digit; heat is proportional to it.
#[test]
fn l_shaped_room_with_a_cool_wall() {
    let case = &json("published/viewfactor_cases.json")["pinney_bean_L_room"];
    let surface_of = [1, 2, 3, 4, 5, 6, 7, 8, 7, 7, 8, 8];
    let named = list(&case["surfaces_before_combination"]).iter().zip(surface_of);
    let surfaces: Vec<Surface> = named.map(|(p, k)| Surface::new(&format!("s{k}"), corners(p))).collect();
    let names: Vec<String> = (1..=8).map(|k| format!("s{k}")).collect();
    let emittance = number(&case["emittance"]);
    let given: Vec<(&str, Given)> = names
        .iter()
        .zip(list(&case["heat"]["T_K"]))
        .map(|(name, kelvin)| (name.as_str(), Given::Kelvin(emittance, number(kelvin))))
        .collect();
    let (table, _folder) = heat(&surfaces, &given, "1e-8");
    let scale = 5.670374419e-8 / number(&case["heat"]["sigma"]);
    for (k, name) in names.iter().enumerate() {
        // Published: net received. One radiosity for each of floor and ceiling there, three pieces each here.
        let got = -table.number(table.row_of(name), "net_flux");
        let want = scale * number(&case["heat"]["computed_q_W_m2"][k]);
        println!("{name}: {got:.5}, published {want:.5}");
        assert_close(name, got, want, Tolerance::Abs(L_ROOM));
    }
}
/// W m^-2, of up to 47: floor and ceiling are one surface each there and three pieces here, with a radiosity of their
/// own. As the published network, to its digits, the room is a test of solve-tool.
const L_ROOM: f64 = 0.25;

#[test]
fn mistakes_in_the_table_name_their_line() {
    let folder = tests::folder();
    let chain = Chain::as_given(surfaces::write(folder.path(), &surfaces::room([1.0; 3])), folder.path());
    chain.compute();
    let solve = |text: &str| -> Run {
        let table = folder.path().join("t.csv");
        std::fs::write(&table, text).unwrap();
        let mut solve = tool("solve-tool");
        solve.arg("solve").arg(chain.path("ff")).arg("--mesh").arg(chain.path("mesh"));
        run(solve.arg("--thermal").arg(table).arg("-o").arg(folder.path().join("bad.sol")))
    };
    let head = "group,emissivity,temperature,flux\n";
    let rest = "z=c,1,300,\ny=0,1,300,\ny=b,1,300,\nx=0,1,300,\nx=a,1,300,\n";
    for (text, said) in [
        ("group,T\n".to_owned(), "t.csv:1: header \"group,T\""),
        (format!("{head}{rest}"), "group z=0 is missing"),
        (format!("{head}{rest}z=0,1,300,0\n"), "t.csv:7: temperature and flux are both given"),
        (format!("{head}{rest}z=0,1,,\n"), "t.csv:7: neither temperature nor flux"),
        (format!("{head}{rest}z=0,1.5,300,\n"), "t.csv:7: emissivity is 1.5"),
        (format!("{head}{rest}z=0,1,-3,\n"), "t.csv:7: temperature is -3"),
        (format!("{head}{rest}z=0,1,warm,\n"), "t.csv:7: temperature is \"warm\""),
        (format!("{head}{rest}z=0,,300,\n"), "t.csv:7: a temperature needs an emissivity"),
        (format!("{head}{rest}z=0,,,5\n"), "t.csv:7: a flux other than 0 needs an emissivity"),
        (format!("{head}{rest}z=9,1,300,\n"), "t.csv:7: the mesh has no group z=9; did you mean z="),
        (format!("{head}{rest}z=c,1,300,\n"), "t.csv:7: group z=c is given twice"),
        (
            format!("{head}{rest}z=0,1,,-1e9\n"),
            "group z=0: its net flux of -1000000000 W m^-2 draws more heat",
        ),
        (format!("{head}{}z=0,1,,5\n", rest.replace("1,300,", "1,,5")), "no group has a temperature"),
    ] {
        tests::chain::assert_refused(
            &solve(&text),
            std::path::Path::new(if said.contains("draws") { "z=0" } else { "t.csv" }),
        );
        solve(&text).expect_said(said);
    }
    assert!(!folder.path().join("bad.sol").exists());
}
