//! View factors through the real programs against published and independently computed ones, which
//! `tests/reference/README.md` lists; each pair within the tolerance that the programs were asked for.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
use tests::cases::{cases, surfaces_of};
use tests::chain::Chain;
use tests::surfaces::{self, Paint, Surface, corners, json, list, number, string};
use tests::table::Table;
use tests::{Tolerance, assert_close, reference};

/// The factors between surfaces, by group.
fn factors(surfaces: &[Surface], tolerance: &str) -> Table {
    let folder = tests::folder();
    let scene = surfaces::write(folder.path(), surfaces);
    let chain = Chain::as_given(scene, folder.path()).with_tolerances(tolerance, tolerance);
    chain.compute();
    chain.factors("group")
}

#[track_caller]
fn factor(table: &Table, from: &str, to: &str) -> f64 {
    table.number(table.row_of(from), to)
}

/// The factor from a point to a surface: irradiance there when the surface's exitance is 1.
fn factor_from_point(case: &Value) -> f64 {
    let lit = surfaces_of(&case["surfaces"]).into_iter().map(|s| s.painted(Paint::grey(0.0, 1.0)));
    let folder = tests::folder();
    let scene = surfaces::write(folder.path(), &lit.collect::<Vec<_>>());
    let chain = Chain::as_given(scene, folder.path());
    chain.solve();
    let element = |key: &str| [0, 1, 2].map(|axis| number(&case["element"][key][axis]));
    let ([x, y, z], [nx, ny, nz]) = (element("point"), element("normal"));
    chain.probe(&[[x, y, z, nx, ny, nz]]).number(0, "H_r")
}

#[test]
fn independently_computed_factors() {
    let reference = json("viewfactors/cases.json");
    let (mut read, mut compared) = (0, 0);
    for case in list(&reference["cases"]) {
        read += 1;
        let category = string(&case["category"]);
        if category == "differential-element" {
            let want = number(&case["expected"][0]["F"]);
            let got = factor_from_point(case);
            assert_close(string(&case["id"]), got, want, Tolerance::Rel(1.1e-7));
            compared += 1;
            continue;
        }
        // A tolerance of 1e-8 bounds rows absolutely, and ten times that relatively where nothing is in between; the
        // tenth on top is the reference's rounding.
        let blocked = ["obstructed-pair", "closed-enclosure-with-obstruction"].contains(&category);
        let tolerance = if blocked { Tolerance::Abs(1e-6) } else { Tolerance::Rel(1.1e-7) };
        for case in cases(case) {
            let table = factors(&case.surfaces, "1e-8");
            for (from, to, want) in case.expected {
                let what = format!("{}: {from} to {to}", case.name);
                assert_close(&what, factor(&table, &from, &to), want, tolerance);
                compared += 1;
            }
        }
    }
    // 338 in the file, where each of the two pairs of discs counts once and has four polygons to stand for it.
    assert_eq!((read, compared), (60, 338 + 2 * 3));
}

#[test]
fn rectangles_in_closed_form() {
    // Many pairs in one scene would shade one another: each pair is a scene of its own.
    let want = Table::read(&reference("published/formfactors_rect.csv"));
    for row in 0..want.rows.len() {
        let [a, b, c] = ["a", "b", "c"].map(|side| want.number(row, side));
        // z=0 against z=c, or against the side x=0 with which it shares an edge of length c.
        let (sides, to) = match want.rows[row][0].split(' ').next().unwrap() {
            "parallel" => (surfaces::room([a, b, c]), "z=c"),
            _ => (surfaces::room([a, c, b]), "x=0"),
        };
        let pair: Vec<Surface> = sides.into_iter().filter(|s| s.name == "z=0" || s.name == to).collect();
        let what = want.rows[row].join(" ");
        let got = factor(&factors(&pair, "1e-10"), "z=0", to);
        assert_close(&what, got, want.number(row, "F12"), Tolerance::Rel(1e-9));
    }
}

/// Every factor of a published matrix within 1e-5 and its own uncertainty; `names` are the groups of its rows.
#[track_caller]
fn assert_matrix(what: &str, got: &Table, names: &[String], want: &Value, uncertainty: f64) {
    for (i, row) in list(want).iter().enumerate() {
        assert_eq!(list(row).len(), names.len());
        for (j, want) in list(row).iter().enumerate() {
            let pair = format!("{what}: {} to {}", names[i], names[j]);
            let got = factor(got, &names[i], &names[j]);
            assert_close(&pair, got, number(want), Tolerance::Abs(1e-5 + uncertainty));
        }
    }
}

fn numbered(count: usize) -> Vec<String> {
    (1..=count).map(|k| format!("s{k}")).collect()
}

#[test]
fn rooms_with_things_in_them() {
    // A plate with two faces in a cube (FACET), and two cubes of three sizes in a room (Walton's box345).
    let published = json("published/viewfactor_cases.json");
    for name in ["facet3d", "box345_unit", "box345_large", "box345_small"] {
        let case = &published[name];
        let polygons = list(&case["surfaces"]);
        let names = numbered(polygons.len());
        let named = polygons.iter().zip(&names);
        let surfaces: Vec<Surface> = named.map(|(p, name)| Surface::new(name, corners(p))).collect();
        let table = factors(&surfaces, "1e-6");
        assert_matrix(name, &table, &names, &case["F"], number(&case["uncertainty"]));
    }
}

#[test]
fn l_shaped_room() {
    // Pinney and Bean 1988. Floor and ceiling are cut into three pieces each and are one surface for the matrix.
    let case = &json("published/viewfactor_cases.json")["pinney_bean_L_room"];
    let surface_of = [1, 2, 3, 4, 5, 6, 7, 8, 7, 7, 8, 8];
    let pieces = list(&case["surfaces_before_combination"]);
    assert_eq!(pieces.len(), surface_of.len());
    let named = pieces.iter().zip(surface_of);
    let surfaces: Vec<Surface> = named.map(|(p, k)| Surface::new(&format!("s{k}"), corners(p))).collect();
    let table = factors(&surfaces, "1e-6");
    assert_matrix("L", &table, &numbered(8), &case["computed_F"], number(&case["uncertainty"]));
}

#[test]
fn squares_with_a_square_between() {
    // Unit squares at distance 1; a square of half the side hides a corner midway.
    let case = &json("published/viewfactor_cases.json")["square_obstruction"];
    let mut surfaces: Vec<Surface> = surfaces::room([1.0; 3]).into_iter().take(2).collect();
    let open = factor(&factors(&surfaces, "1e-8"), "z=0", "z=c");
    assert_close("nothing between", open, number(&case["F12_unobstructed"]), Tolerance::Rel(1e-9));
    let hides = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.5], [0.0, 0.5, 0.5]];
    surfaces.push(Surface::new("between", hides));
    let hidden = factor(&factors(&surfaces, "1e-8"), "z=0", "z=c");
    assert_close("square between", hidden, number(&case["F12"]), Tolerance::Abs(1e-7));
}

#[test]
fn irregular_room() {
    // 25 surfaces that hide one another, known to about 1e-4: the reference's own last refinement changed that much.
    let case = &json("published/view3d_suite.json")["irregular_room"];
    let polygons = list(&case["quads_ccw_from_front"]);
    let mut surfaces = Vec::new();
    for (group, members) in list(&case["groups"]).iter().enumerate() {
        let name = format!("s{}", group + 1);
        let members = list(members).iter().map(|k| k.as_u64().unwrap() as usize);
        surfaces.extend(members.map(|k| Surface::new(&name, corners(&polygons[k]))));
    }
    let table = factors(&surfaces, "1e-6");
    let groups = numbered(list(&case["groups"]).len());
    assert_matrix("irregular", &table, &groups, &case["computed_F"], number(&case["level_change"]));
}
