//! Bodies of the fuzz targets: any bytes are an input, and a body panics where a promise is broken. `fuzz/` drives them
//! with libFuzzer on a nightly compiler, `tests/tests/fuzz.rs` with seeded changes of good files on stable.

use crate::damage::Dice;
use formfactor_tool::foreign;
use geometry::gather::{Gatherer, Scratch};
use geometry::occluder::Occluder;
use geometry::patch::Patch;
use geometry::plane::{PLANARITY, Plane};
use geometry::{polygon, unoccluded};
use glam::DVec3;
use interchange::materials::MaterialTable;
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::scene::Scene;
use interchange::solution::Solution;
use std::path::Path;

/// Endings of the files a reader is fuzzed with; `obj`, `mtl` and `toml` are read as one scene.
pub const READERS: [&str; 14] =
    ["obj", "mtl", "toml", "mesh", "ff", "sol", "materials", "csv", "npy", "npz", "mtx", "rmx", "vf", "vs3"];

/// Writes `bytes` as `folder/s.ENDING` and reads it; whether it was taken. An error is an answer, a panic is not.
pub fn reader(folder: &Path, ending: &str, bytes: &[u8]) -> bool {
    let path = folder.join("s").with_extension(ending);
    std::fs::write(&path, bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    match ending {
        "obj" | "mtl" | "toml" => Scene::read(&path.with_extension("obj"), &[]).is_ok(),
        "mesh" => Mesh::read(&path).is_ok(),
        "ff" => Matrix::open(&path).is_ok(),
        "sol" => Solution::read(&path).is_ok(),
        "materials" => MaterialTable::read(&path).is_ok(),
        "vs3" | "rad" => interchange::foreign::read_scene(&path).is_ok(),
        _ => foreign::read(&path, 2).is_ok(),
    }
}

/// A number from two bytes: a small grid, so that contacts, common planes and coincidences are frequent, or a fraction.
fn coordinate(bytes: &mut impl Iterator<Item = u8>) -> f64 {
    let (kind, value) = (bytes.next().unwrap_or(0), f64::from(bytes.next().unwrap_or(0) as i8));
    match kind % 8 {
        0..=4 => (value / 32.0).round(),
        5 => value / 32.0,
        6 => value / 32.0 * 1e-9,
        _ => (value / 32.0).round() + value * f64::EPSILON,
    }
}

fn point(bytes: &mut impl Iterator<Item = u8>) -> DVec3 {
    DVec3::new(coordinate(bytes), coordinate(bytes), coordinate(bytes))
}

/// A triangle or a parallelogram.
fn corners(bytes: &mut impl Iterator<Item = u8>) -> Vec<DVec3> {
    let (a, b, c) = (point(bytes), point(bytes), point(bytes));
    if bytes.next().unwrap_or(0).is_multiple_of(2) { vec![a, b, c] } else { vec![a, b, b + c - a, c] }
}

/// Clipping: the two parts of a convex polygon have its area together, and none reaches beyond the plane.
pub fn clipping(bytes: &[u8]) {
    let mut bytes = bytes.iter().copied();
    let (whole, cutter) = (corners(&mut bytes), corners(&mut bytes));
    let Some(plane) = Plane::of_polygon(&cutter) else { return };
    let size = whole.iter().chain(&cutter).map(|p| p.length()).fold(1e-9, f64::max);
    let (mut front, mut back) = (Vec::new(), Vec::new());
    polygon::clip_to_front(&whole, &plane, &mut front);
    polygon::clip_to_front(&whole, &plane.flipped(), &mut back);
    // A new corner lies within a few ulp of the coordinates' size of the plane; 64 leaves room for the plane's own.
    let rounding = 64.0 * f64::EPSILON * size;
    assert!(front.iter().all(|&p| plane.distance(p) >= -rounding), "{whole:?} {plane:?} {front:?}");
    let (parts, area) = (polygon::area(&front) + polygon::area(&back), polygon::area(&whole));
    // Something that lies in the plane is in neither part.
    if whole.iter().any(|&p| plane.distance(p).abs() > rounding) {
        assert!((parts - area).abs() <= 16.0 * rounding * size, "{whole:?} {plane:?}: {parts} of {area}");
    }
}

/// Invariants of form factors of an unoccluded pair: 0 <= F <= 1 both ways, and A_i F_ij = A_j F_ji.
pub fn form_factor_invariants(bytes: &[u8]) {
    let mut bytes = bytes.iter().copied();
    let (Some(p), Some(q)) = (Patch::new(corners(&mut bytes)), Patch::new(corners(&mut bytes))) else {
        return;
    };
    let (one, _) = unoccluded::exchange(&p, &q, 1e-6);
    let (other, _) = unoccluded::exchange(&q, &p, 1e-6);
    let allowed = 1e-6 * p.area.min(q.area) + one.error + other.error;
    for exchange in [one, other] {
        assert!(exchange.value >= 0.0 && exchange.error >= 0.0, "{exchange:?} of {p:?} and {q:?}");
        assert!(exchange.value <= p.area.min(q.area) + allowed, "{exchange:?} of {p:?} and {q:?}");
    }
    assert!((one.value - other.value).abs() <= allowed, "{one:?} and {other:?} of {p:?} and {q:?}");
}

/// Visible parts: 0 <= visible <= whole, a further blocker never lets more be seen, and their order does not matter. Returns
/// by how much a further blocker or another order fails at worst, or nothing where the input is none to judge by that.
pub fn visible_parts(bytes: &[u8]) -> Option<f64> {
    let mut bytes = bytes.iter().copied();
    let (eye, target) = (point(&mut bytes), corners(&mut bytes));
    let normal = point(&mut bytes).try_normalize()?;
    let patch = Patch::new(target.clone())?;
    let mut blockers = Vec::new();
    for _ in 0..bytes.next().unwrap_or(0) % 4 {
        blockers.extend(Occluder::new(corners(&mut bytes)));
    }
    let seen = |blockers: &[Occluder]| {
        let mut sum = 0.0;
        let gatherer = Gatherer::new(blockers.to_vec(), vec![target.clone()]);
        gatherer.factors(eye, normal, &mut Scratch::default(), &mut |_, factor| sum += factor);
        sum
    };
    // A shadow that a polygon reaches into by less than 1e-9 of their sizes (`PLANARITY`) counts as not touching it, so a
    // blocker in nearly the target's plane moves a factor by that over the distance (2e-11 with seed 1998664).
    const ROUNDING: f64 = 10.0 * PLANARITY;
    let factors: Vec<f64> = (0..=blockers.len()).map(|count| seen(&blockers[..count])).collect();
    let said =
        |count: usize| format!("{factors:?} of {target:?} from {eye} {normal} past {:?}", &blockers[..count]);
    for (count, factor) in factors.iter().enumerate() {
        assert!((0.0..=1.0 + ROUNDING).contains(factor), "{}", said(count));
    }
    // Closer than this to a plane, and not on it, either answer holds: contact is a matter of tolerance, and the factor of a
    // target that the eye lies in within rounding (found by seed 423398) is the rounding's.
    let all = blockers.iter().flat_map(|b| &b.corners).chain(&target);
    let size = all.map(|c| (*c - eye).length()).fold(0.0, f64::max);
    let doubtful = |plane: &Plane| {
        let height = plane.distance(eye).abs();
        height != 0.0 && height < 1e-6 * size
    };
    if doubtful(&patch.plane) || blockers.iter().any(|b| doubtful(&b.plane)) {
        return None;
    }
    let mut worst = 0.0f64;
    for count in 1..=blockers.len() {
        let (before, now) = (factors[count - 1], factors[count]);
        assert!(now <= before + ROUNDING, "{}", said(count));
        let turned: Vec<Occluder> = blockers[..count].iter().rev().cloned().collect();
        let other = seen(&turned);
        assert!((now - other).abs() <= ROUNDING, "in turned order {other}: {}", said(count));
        worst = worst.max(now - before).max((now - other).abs());
    }
    Some(worst)
}

/// A good input changed at a few seeded places: bits flipped, bytes set, parts cut out, doubled or swapped for others.
pub fn changed(good: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=dice.below(4) {
        if bytes.is_empty() {
            bytes.push(dice.bits() as u8);
        }
        let at = dice.below(bytes.len());
        let length = dice.below(33.min(bytes.len() - at) + 1);
        match dice.below(7) {
            0 => bytes[at] ^= 1 << dice.below(8),
            1 => bytes[at] = [0, 0xff, 0x7f, 0x80, b'-', b'9', b'\n'][dice.below(7)],
            2 => drop(bytes.drain(at..at + length)),
            3 => {
                let part = bytes[at..at + length].to_vec();
                let to = dice.below(bytes.len());
                bytes.splice(to..to, part);
            }
            4 => bytes.truncate(at),
            5 => {
                const WORDS: [&str; 8] = ["nan", "inf", "1e999", "-0", "4294967296", "-1", "{", "\\\n"];
                bytes.splice(at..at, WORDS[dice.below(8)].bytes());
            }
            _ => {
                let number = [0, 1, u64::MAX, 1 << 31, 1 << 32, 1 << 62][dice.below(6)].to_le_bytes();
                let end = (at + 8).min(bytes.len());
                bytes[at..end].copy_from_slice(&number[..end - at]);
            }
        }
    }
    bytes
}
