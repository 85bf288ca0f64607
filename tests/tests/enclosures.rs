//! Enclosures of one patch for each side, whose radiosities are known: as given, the matrix holds exact factors, so the
//! whole chain must be exact too.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::{Chain, Stage};
use tests::surfaces::{self, Paint, Surface, json, list, number, string};
use tests::{Tolerance, assert_close, run};

/// Radiosity per channel of each surface, in order.
fn radiosities(surfaces: &[Surface]) -> Vec<[f64; 3]> {
    let folder = tests::folder();
    let scene = surfaces::write(folder.path(), surfaces);
    let chain = Chain::as_given(scene, folder.path()).with_tolerances("1e-12", "1e-12");
    chain.compute();
    // 3 will do: the estimate of the factors' rounding, 5e-13, times up to 99 by interreflection is no longer below 1e-12.
    let done = run(&mut chain.command(Stage::Solve));
    assert!(matches!(done.code, Some(0 | 3)), "exit {:?}: {}", done.code, done.stderr);
    let table = chain.radiosities("group");
    let of = |surface: &Surface| {
        ["B_r", "B_g", "B_b"].map(|column| table.number(table.row_of(&surface.name), column))
    };
    surfaces.iter().map(of).collect()
}

/// A room with one paint for each side, in the order z=0, z=c, y=0, y=b, x=0, x=a.
fn room(size: [f64; 3], paints: [Paint; 6]) -> Vec<Surface> {
    surfaces::room(size).into_iter().zip(paints).map(|(side, paint)| side.painted(paint)).collect()
}

#[test]
fn cube_lit_by_its_ceiling() {
    // Reflectance; radiosity of wall, floor and ceiling, solved in extended precision from the closed-form factors.
    let table = [
        (0.2, 0.048085017357, 0.048044544595, 1.009615385978),
        (0.5, 0.181836268946, 0.181745826108, 1.090909098108),
        (0.8, 0.689681193904, 0.689551070738, 1.551724153645),
        (0.9, 1.525452018512, 1.525310551125, 2.372881374826),
        (0.99, 16.527576099920, 16.527425127722, 17.362270472597),
    ];
    for (rho, wall, floor, ceiling) in table {
        let paint = Paint::grey(rho, 0.0);
        let got = radiosities(&room([1.0; 3], [paint, Paint::grey(rho, 1.0), paint, paint, paint, paint]));
        let want = [floor, ceiling, wall, wall, wall, wall];
        for (side, (got, want)) in got.iter().zip(want).enumerate() {
            for got in got {
                assert_close(&format!("rho {rho}, side {side}"), *got, want, Tolerance::Rel(1e-9));
            }
        }
    }
}

#[test]
fn furnace_has_the_same_radiosity_everywhere() {
    // Uniform: B = 1 / (1 - rho), every lost share of a row would show 99 times.
    let got = radiosities(&room([1.0, 2.0, 3.0], [Paint::grey(0.99, 1.0); 6]));
    for got in got.iter().flatten() {
        assert_close("uniform furnace", *got, 100.0, Tolerance::Rel(1e-9));
    }
    // Isothermal: E = 1 - rho gives B = 1 for any reflectances, here different in each channel and side.
    let paint = |rho: f64| {
        let reflectance = [rho, 0.5 * rho, 1.0 - rho];
        Paint { reflectance, emission: reflectance.map(|rho| 1.0 - rho) }
    };
    let got = radiosities(&room([2.0, 0.5, 1.0], [0.1, 0.99, 0.6, 0.3, 0.8, 0.9].map(paint)));
    for got in got.iter().flatten() {
        assert_close("isothermal furnace", *got, 1.0, Tolerance::Rel(1e-9));
    }
}

#[test]
fn coloured_cube_as_first_published() {
    // Goral et al. 1984, one patch for each side: the front emits, left is red and right is blue, the rest is grey.
    let grey = Paint::grey(0.8, 0.0);
    let side = |red: f64, blue: f64| Paint { reflectance: [red, 0.0, blue], emission: [0.0; 3] };
    let got = radiosities(&room(
        [1.0; 3],
        [grey, grey, Paint::grey(0.0, 1.0), grey, side(0.8, 0.1), side(0.1, 0.8)],
    ));
    let grey_side = 0.321775729479;
    let want = [grey_side, grey_side, 1.0, 0.321673353271, 0.321817395787, 0.045743811982];
    for (side, want) in want.into_iter().enumerate() {
        assert_close(&format!("red, side {side}"), got[side][0], want, Tolerance::Rel(1e-9));
        // Blue is red seen in a mirror.
        let mirrored = [0, 1, 2, 3, 5, 4][side];
        assert_close(&format!("blue, side {mirrored}"), got[mirrored][2], want, Tolerance::Rel(1e-9));
    }
}

#[test]
fn parallel_plates_that_see_nothing_else_are_a_network_of_two() {
    // B1 = (E1 + rho1 F E2) / (1 - rho1 rho2 F^2) for two squares with factor F between them, the rest escaping.
    let factor = tests::two_squares::opposed_unit_squares();
    let plates = surfaces::room([1.0; 3]).into_iter().take(2);
    let paints = [Paint::grey(0.3, 1.0), Paint::grey(0.8, 0.2)];
    let got = radiosities(&plates.zip(paints).map(|(plate, paint)| plate.painted(paint)).collect::<Vec<_>>());
    let closed = 1.0 - 0.3 * 0.8 * factor * factor;
    assert_close("first", got[0][0], (1.0 + 0.3 * factor * 0.2) / closed, Tolerance::Rel(1e-9));
    assert_close("second", got[1][0], (0.2 + 0.8 * factor * 1.0) / closed, Tolerance::Rel(1e-9));
}

#[test]
fn exact_networks_of_the_reference() {
    let mut checked = 0;
    for network in list(&json("published/enclosures.json")["networks"]) {
        // Entries about heat state temperatures instead.
        let Some(expected) = network.get("radiosity_one_patch_per_face") else { continue };
        let name = string(&network["id"]);
        let size = [0, 1, 2].map(|axis| number(&network["dims_xyz"][axis]));
        let paint =
            |side| Paint::grey(number(&network["reflectance"][side]), number(&network["emission"][side]));
        let got = radiosities(&room(size, [0, 1, 2, 3, 4, 5].map(paint)));
        for (side, want) in list(expected).iter().enumerate() {
            assert_close(&format!("{name}, side {side}"), got[side][1], number(want), Tolerance::Rel(1e-9));
            checked += 1;
        }
    }
    assert_eq!(checked, 30);
}
