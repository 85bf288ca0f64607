//! The error that a matrix states per row against the true one, over all cases of `viewfactors/cases.json`: the truth is
//! within the tolerance asked and not above what is stated. `--nocapture` shows the table.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use std::collections::BTreeMap;
use tests::cases::{Case, cases};
use tests::chain::Chain;
use tests::surfaces::{self, json, list};

const TOLERANCES: [&str; 4] = ["1e-2", "1e-4", "1e-6", "1e-8"];

/// A row of some matrix: the surface that emits, its true error (at least), the stated one.
struct Row {
    surface: String,
    truth: f64,
    stated: f64,
}

/// Per surface the sum of |dF| over its known factors, and what the matrix states for it: the mean over its elements by
/// area, for F of a surface is the mean of theirs.
fn rows(case: &Case, flags: &[&str]) -> Vec<Row> {
    let folder = tests::folder();
    let scene = surfaces::write(folder.path(), &case.surfaces);
    let mut chain = Chain::as_given(scene, folder.path());
    chain.matrix_flags = flags.iter().map(|flag| (*flag).to_owned()).collect();
    chain.compute();
    let table = chain.factors("group");
    let (mesh, ..) = Mesh::read(&chain.path("mesh")).unwrap();
    let matrix = Matrix::open(&chain.path("ff")).unwrap();
    let (areas, errors) = (matrix.areas().unwrap(), matrix.row_errors().unwrap());
    let mut stated: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    for element in mesh.element_ids() {
        let group = mesh.groups[mesh.element_group(element).index()].clone();
        let sums = stated.entry(group).or_default();
        sums.0 += areas[element.index()] * errors[element.index()];
        sums.1 += areas[element.index()];
    }
    let mut truths: BTreeMap<String, f64> = BTreeMap::new();
    for (from, to, want) in &case.expected {
        let difference = (table.number(table.row_of(from), to) - want).abs();
        *truths.entry(from.clone()).or_default() += (difference - case.uncertainty(*want)).max(0.0);
    }
    let row = |(surface, truth): (String, f64)| {
        let (error, area) = stated[&surface];
        Row { surface, truth, stated: error / area }
    };
    truths.into_iter().map(row).collect()
}

/// Over the rows of a kind of case: number, largest truth, largest statement, largest truth over statement.
#[derive(Default)]
struct Worst {
    rows: usize,
    truth: f64,
    stated: f64,
    share: f64,
}

#[test]
fn no_row_is_worse_than_it_says() {
    let reference = json("viewfactors/cases.json");
    let mut worst: BTreeMap<(String, &str), Worst> = BTreeMap::new();
    let mut violations = Vec::new();
    for case in list(&reference["cases"]).iter().filter(|case| case["category"] != "differential-element") {
        for case in cases(case) {
            for tolerance in TOLERANCES {
                let asked: f64 = tolerance.parse().unwrap();
                // Closed scenes are closed by default; what was computed has to hold by itself too.
                let closures: &[&[&str]] =
                    if case.category.starts_with("closed") { &[&[], &["--closure", "off"]] } else { &[&[]] };
                for closure in closures {
                    for row in rows(&case, &[&["--tolerance", tolerance], *closure].concat()) {
                        let Row { surface, truth, stated } = row;
                        let found = worst.entry((case.category.clone(), tolerance)).or_default();
                        found.rows += 1;
                        found.truth = found.truth.max(truth);
                        found.stated = found.stated.max(stated);
                        found.share = found.share.max(if truth > 0.0 { truth / stated } else { 0.0 });
                        if !(truth <= stated && stated <= asked) {
                            violations.push(format!(
                                "{} {}, tolerance {tolerance}, {closure:?}: true {truth:.2e}, stated {stated:.2e}",
                                case.name, surface
                            ));
                        }
                    }
                }
            }
        }
    }
    println!("| cases | tolerance | rows | true, worst | stated, worst | true / stated, worst |");
    for ((category, tolerance), Worst { rows, truth, stated, share }) in &worst {
        println!("| {category} | {tolerance} | {rows} | {truth:.1e} | {stated:.1e} | {share:.2} |");
    }
    assert!(violations.is_empty(), "{} rows:\n{}", violations.len(), violations.join("\n"));
}
