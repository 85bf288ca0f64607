//! Soups: boxes and slivers that cross, touch, contain and nearly coincide with each other, at any scale. Whatever they
//! are, there is no failure, no area is lost or counted twice, elements meet, and each lies in its face.
//!
//! `cargo test -p mesh-tool --test soups --release -- --ignored` runs ten thousand of them.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use glam::DVec3;
use interchange::scene::Scene;
use proptest::prelude::*;

/// One thing in the soup: a box or a sliver, and how it stands to the one before.
#[derive(Debug, Clone)]
struct Thing {
    low: [f64; 3],
    size: [f64; 3],
    relation: u8,
    bottom: bool,
    lamp: bool,
    tilt: f64,
}

fn any_thing() -> impl Strategy<Value = Thing> {
    let place = || prop::array::uniform3(-1.0..1.0f64);
    let extent = || prop_oneof![4 => 0.1..1.2f64, 1 => 1e-6..1e-3f64];
    (place(), prop::array::uniform3(extent()), 0..7u8, any::<bool>(), 0..8u8, -1.0..1.0f64).prop_map(
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

/// Puts things into one scene above, on and through a floor.
fn soup(things: &[Thing], turn: f64, power: i32) -> Scene {
    let mut text = floor_text(-2.0, 3.0);
    let mut before = ([0.0; 3], [0.5; 3]);
    let mut vertices = 4;
    for thing in things {
        let (mut low, mut size) = (thing.low, thing.size);
        match thing.relation {
            // On the floor; on top of, inside, beside, and a hair off the one before.
            0 => low[1] = 0.0,
            1 => low = [before.0[0] + 0.1 * size[0], before.0[1] + before.1[1], before.0[2]],
            2 => {
                low = [0, 1, 2].map(|k| before.0[k] + 0.25 * before.1[k]);
                size = before.1.map(|x| 0.5 * x);
            }
            3 => low = [before.0[0] + before.1[0], before.0[1], before.0[2]],
            4 => (low, size) = (before.0.map(|x| x + 1e-11 * thing.tilt), before.1),
            _ => {}
        }
        let high = [0, 1, 2].map(|k| low[k] + size[k]);
        text += if thing.lamp { "usemtl lamp\n" } else { "usemtl white\n" };
        if thing.relation == 5 {
            // A sliver, nearly in the plane of the floor.
            let h = 1e-7 * thing.tilt;
            text += &format!(
                "v {:?} 0 {:?}\nv {:?} {h:?} {:?}\nv {:?} 0 {:?}\nf -3 -2 -1\n",
                low[0],
                low[2],
                high[0],
                low[2] + 1e-4,
                low[0] + 0.3,
                high[2]
            );
            vertices += 3;
        } else {
            text += &box_text(low, high, thing.bottom, vertices + 1);
            vertices += 8;
        }
        before = (low, size);
    }
    let mut scene = scene_of(&text);
    let rotation = glam::DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.2).normalize(), turn);
    for vertex in &mut scene.vertices {
        *vertex = (10f64.powi(power) * (rotation * DVec3::from_array(*vertex))).to_array();
    }
    scene
}

fn assert_survives(things: &[Thing], turn: f64, power: i32) {
    let scene = soup(things, turn, power);
    for options in [given(), elements(150)] {
        // Convexity, planarity and "every element inside its face" are checked there.
        let (_, report) = made(&scene, options);
        // Faces too close to be told apart stay as they are, and overlap.
        let tangled = ["planes not merged", "overlapping faces cut"];
        if tangled.iter().all(|name| report.counters.get(*name).copied().unwrap_or(0) == 0) {
            let shown = report.estimates["area of elements"];
            let hidden = report.estimates["hidden area"];
            let faces = report.estimates["area of faces"];
            assert!(((shown + hidden) / faces - 1.0).abs() < 1e-9, "{shown} + {hidden} of {faces}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn soups_survive(
        things in prop::collection::vec(any_thing(), 1..6),
        turn in prop_oneof![Just(0.0), 0.0..6.0f64],
        power in -6..=6i32,
    ) {
        assert_survives(&things, turn, power);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "ten thousand scenes take minutes"]
    fn ten_thousand_soups_survive(
        things in prop::collection::vec(any_thing(), 1..6),
        turn in prop_oneof![Just(0.0), 0.0..6.0f64],
        power in -6..=6i32,
    ) {
        assert_survives(&things, turn, power);
    }
}
