//! Random soups: whatever boxes and slivers do to each other, at any scale, there is no failure, no area is lost or counted
//! twice, elements meet, and each lies in its face.
//!
//! `cargo test -p mesh-tool --test soups --release -- --ignored --nocapture` makes ten thousand of them, a thousand of
//! each of ten seeds.
#![allow(clippy::unwrap_used)]

mod common;
use common::soup::{RELATIONS, Soup, Thing};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

fn any_thing() -> impl Strategy<Value = Thing> {
    let place = || prop::array::uniform3(-1.0..1.0f64);
    let extent = || prop_oneof![4 => 0.1..1.2f64, 1 => 1e-6..1e-3f64];
    let relation = prop::sample::select(RELATIONS.to_vec());
    (place(), prop::array::uniform3(extent()), relation, any::<bool>(), 0..8u8, -1.0..1.0f64).prop_map(
        |(low, size, relation, bottom, lamp, tilt)| Thing {
            low,
            size,
            relation,
            bottom,
            lamp: lamp == 0,
            tilt,
        },
    )
}

fn any_soup() -> impl Strategy<Value = Soup> {
    let turn = prop_oneof![Just(0.0), 0.0..6.0f64];
    (prop::collection::vec(any_thing(), 1..6), turn, -6..=6i32).prop_map(|(things, turn, power)| Soup {
        things,
        turn,
        power,
    })
}

/// The first fault that a thousand soups of a seed (or as many as `cases`) show, shrunk.
fn tried(seed: u8, cases: u32) -> Result<(), String> {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let outcome = TestRunner::new_with_rng(config, random).run(&any_soup(), |soup| {
        let faults = soup.faults();
        prop_assert!(faults.is_empty(), "{faults:#?}");
        Ok(())
    });
    outcome.map_err(|fault| format!("seed {seed}: {fault}"))
}

#[test]
fn soups_survive() {
    assert_eq!(tried(0, 60), Ok(()));
}

#[test]
#[ignore = "ten thousand scenes take minutes"]
fn ten_thousand_soups_survive() {
    let faults: Vec<String> = (1..=10).filter_map(|seed| tried(seed, 1000).err()).collect();
    assert!(faults.is_empty(), "{} of 10 seeds:\n{}", faults.len(), faults.join("\n"));
}

/// Faults by kind, of many soups, the first of each kind shrunk.
#[test]
#[ignore = "for looking"]
fn survey() {
    use proptest::strategy::ValueTree;
    std::panic::set_hook(Box::new(|_| {}));
    let count: u32 = std::env::var("SOUPS").map_or(1000, |n| n.parse().unwrap());
    let seed: u8 = std::env::var("SEED").map_or(1, |n| n.parse().unwrap());
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let mut runner = TestRunner::new_with_rng(ProptestConfig::default(), random);
    let mut kinds = std::collections::BTreeMap::<String, usize>::new();
    let kind = |fault: &str| fault.splitn(3, ':').take(2).collect::<Vec<&str>>().join(":");
    for k in 0..count {
        let mut tree = any_soup().new_tree(&mut runner).unwrap();
        for fault in tree.current().faults() {
            let own = kind(&fault);
            let n = kinds.entry(own.clone()).or_default();
            *n += 1;
            let n = *n;
            println!("{k}: {}", &fault[..fault.len().min(300)]);
            if n <= 4 {
                let fails = |soup: &Soup| soup.faults().iter().any(|fault| kind(fault) == own);
                let mut least = tree.current();
                let mut tries = 0;
                while tries < 300 && tree.simplify() {
                    tries += 1;
                    if fails(&tree.current()) {
                        least = tree.current();
                        continue;
                    }
                    while tries < 300 && tree.complicate() {
                        tries += 1;
                        if fails(&tree.current()) {
                            least = tree.current();
                            break;
                        }
                    }
                }
                println!("  least: {least:?}\n  {:?}", least.faults());
                break;
            }
        }
    }
    println!("{count}: {kinds:#?}");
}
