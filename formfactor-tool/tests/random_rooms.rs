//! Closed rooms with random blocks, standing on the floor and touching each other, and random plates that may cross: what
//! must hold of any matrix. Seeded: the same rooms in every run.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use assert_cmd::Command;
use common::{clustered, inward_cube};
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn unit_vector(&mut self) -> [f64; 3] {
        loop {
            let v = [0; 3].map(|_| self.between(-1.0, 1.0));
            let length = dot(v, v).sqrt();
            if (0.1..1.0).contains(&length) {
                return v.map(|x| x / length);
            }
        }
    }

    /// A unit vector and another one at right angles to it.
    fn axes(&mut self) -> [[f64; 3]; 2] {
        let u = self.unit_vector();
        loop {
            let w = cross(u, self.unit_vector());
            let length = dot(w, w).sqrt();
            if length > 0.1 {
                return [u, w.map(|x| x / length)];
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

type Polygon = Vec<[f64; 3]>;

/// A room with what stands and floats in it.
struct Room {
    polygons: Vec<Polygon>,
    /// How many of them block: the rest are the backs of plates, which block once.
    blocking: usize,
    /// Per polygon the share of its area that lies on another one, face to face, and sees nothing.
    covered: Vec<f64>,
    /// Elements per leaf cluster.
    leaf: u32,
}

/// A block with its fronts outward.
fn block(low: [f64; 3], high: [f64; 3]) -> Vec<Polygon> {
    let place = |v: [f64; 3]| [0, 1, 2].map(|k| if v[k] == 0.0 { low[k] } else { high[k] });
    let outward = |polygon: Polygon| polygon.into_iter().rev().map(place).collect();
    inward_cube(0.0, 1.0).into_iter().map(outward).collect()
}

fn room(random: &mut Random) -> Room {
    let mut polygons = inward_cube(0.0, 1.0);
    // A block on the floor; another one on top of it, or beside it on the floor, touching.
    let low = [random.between(0.1, 0.3), random.between(0.1, 0.5), 0.0];
    let high = [random.between(0.4, 0.6), low[1] + random.between(0.1, 0.4), random.between(0.1, 0.35)];
    polygons.extend(block(low, high));
    if random.bits().is_multiple_of(2) {
        let inside = |random: &mut Random, k: usize, from: f64, to: f64| {
            random.between(low[k] + from * (high[k] - low[k]), low[k] + to * (high[k] - low[k]))
        };
        let base = [inside(random, 0, 0.1, 0.4), inside(random, 1, 0.1, 0.4), high[2]];
        let top = [inside(random, 0, 0.6, 0.9), inside(random, 1, 0.6, 0.9), random.between(0.4, 0.45)];
        polygons.extend(block(base, top));
    } else {
        let base = [high[0], random.between(0.05, high[1] - 0.05), 0.0];
        let far = [
            high[0] + random.between(0.1, 0.3),
            high[1] + random.between(0.01, 0.1),
            random.between(0.1, 0.45),
        ];
        polygons.extend(block(base, far));
    }
    let covered = covered(&polygons);

    // Plates above the blocks: rectangles and triangles, which may cross each other.
    let plates = 1 + random.bits() as usize % 3;
    for _ in 0..plates {
        let centre = [random.between(0.3, 0.7), random.between(0.3, 0.7), random.between(0.65, 0.8)];
        let (axes, half) = (random.axes(), [random.between(0.03, 0.12), random.between(0.05, 0.12)]);
        let corner = |a: f64, b: f64| {
            [0, 1, 2].map(|k| centre[k] + a * half[0] * axes[0][k] + b * half[1] * axes[1][k])
        };
        let mut plate = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        plate.truncate(3 + random.bits() as usize % 2);
        polygons.push(plate);
    }
    let blocking = polygons.len();
    let backs: Vec<Polygon> =
        polygons[blocking - plates..].iter().map(|p| p.iter().rev().copied().collect()).collect();
    polygons.extend(backs);
    let covered = (0..polygons.len()).map(|k| covered.get(k).copied().unwrap_or(0.0)).collect();
    Room { polygons, blocking, covered, leaf: 4 + random.bits() as u32 % 30 }
}

/// Shares of axis-aligned rectangles that others of their plane lie on.
fn covered(rectangles: &[Polygon]) -> Vec<f64> {
    let bounds = |polygon: &Polygon, axis: usize| {
        let values = polygon.iter().map(|c| c[axis]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let share = |polygon: &Polygon| -> f64 {
        let flat = (0..3).find(|&axis| bounds(polygon, axis).0 == bounds(polygon, axis).1).unwrap();
        let others = rectangles.iter().filter(|&other| !std::ptr::eq(other, polygon));
        let in_plane = others.filter(|other| bounds(other, flat) == bounds(polygon, flat));
        let overlap = |other: &Polygon| -> f64 {
            let axes = (0..3).filter(|&axis| axis != flat);
            axes.map(|axis| {
                let ((a, b), (c, d)) = (bounds(polygon, axis), bounds(other, axis));
                (b.min(d) - a.max(c)).max(0.0) / (b - a)
            })
            .product()
        };
        in_plane.map(overlap).sum()
    };
    rectangles.iter().map(share).collect()
}

impl Room {
    fn mesh(&self, place: impl Fn([f64; 3]) -> [f64; 3], blocks: bool) -> Mesh {
        let polygons: Vec<Polygon> =
            self.polygons.iter().map(|polygon| polygon.iter().map(|&v| place(v)).collect()).collect();
        let mut mesh = clustered(&polygons, self.leaf);
        let all = std::mem::take(&mut mesh.occluders);
        mesh.occluder_faces.truncate(if blocks { self.blocking } else { 0 });
        for k in 0..mesh.occluder_faces.len() {
            mesh.occluders.push(all.row(k).iter().copied());
        }
        mesh
    }
}

struct Computed {
    /// F, all of it.
    factors: Vec<Vec<f64>>,
    row_errors: Vec<f64>,
    areas: Vec<f64>,
    bytes: Vec<u8>,
}

fn compute(mesh: &Mesh, flags: &[&str]) -> Computed {
    let folder = tempfile::tempdir().unwrap();
    let (path, output) = (folder.path().join("s.mesh"), folder.path().join("s.ff"));
    mesh.write(&path, Provenance::new("test", "1")).unwrap();
    let mut command = Command::cargo_bin("formfactor-tool").unwrap();
    command.arg("compute").arg(&path).arg("-o").arg(&output);
    command.args(["--closure", "off"]).args(flags).assert().success();
    let matrix = Matrix::open(&output).unwrap();
    let n = matrix.element_count();
    let areas = matrix.areas().unwrap().to_vec();
    let mut factors = vec![vec![0.0; n]; n];
    matrix
        .for_each(|i, j, s| {
            factors[i][j] = s / areas[i];
            factors[j][i] = s / areas[j];
        })
        .unwrap();
    let row_errors = matrix.row_errors().unwrap().to_vec();
    Computed { factors, row_errors, areas, bytes: std::fs::read(&output).unwrap() }
}

/// What is wrong with a matrix beside another one of the same room.
fn differences(what: &str, a: &Computed, b: &Computed, found: &mut Vec<String>) {
    for (i, (row, other)) in a.factors.iter().zip(&b.factors).enumerate() {
        let difference: f64 = row.iter().zip(other).map(|(a, b)| (a - b).abs()).sum();
        let stated = a.row_errors[i] + b.row_errors[i];
        if difference.is_nan() || difference > stated {
            found.push(format!("{what}: row {i} differs by {difference:.2e}, both state {stated:.2e}"));
        }
    }
}

/// What is wrong with the matrices of one room.
fn check(room: &Room, tolerance: &str, random: &mut Random, found: &mut Vec<String>) {
    let flags = ["--tolerance", tolerance];
    let as_is = |v: [f64; 3]| v;
    let mesh = room.mesh(as_is, true);
    let [one, seven] =
        ["1", "7"].map(|threads| compute(&mesh, &[&flags[..], &["--threads", threads]].concat()));
    if one.bytes != seven.bytes {
        found.push("1 and 7 threads: other bytes".into());
    }

    // Whole hemispheres, as far as they are not covered, are seen.
    for (i, row) in one.factors.iter().enumerate() {
        let (sum, want) = (row.iter().sum::<f64>(), 1.0 - room.covered[i]);
        if sum.is_nan() || (sum - want).abs() > one.row_errors[i] {
            let missed = sum - want;
            found.push(format!(
                "row {i} of {} misses {want} by {missed:.2e}, states {:.2e}",
                row.len(),
                one.row_errors[i]
            ));
        }
        row.iter()
            .filter(|f| f.is_nan() || **f < 0.0)
            .for_each(|f| found.push(format!("row {i}: F = {f:e}")));
    }

    // Blockers take away. An entry's error is in two rows.
    let unblocked = compute(&room.mesh(as_is, false), &flags);
    for (i, (with, without)) in one.factors.iter().zip(&unblocked.factors).enumerate() {
        for (j, (with, without)) in with.iter().zip(without).enumerate() {
            let of_row = |c: &Computed| c.row_errors[i].min(c.row_errors[j] * c.areas[j] / c.areas[i]);
            if with.is_nan() || *with > without + of_row(&one) + of_row(&unblocked) {
                found.push(format!("entry {i}, {j}: {with:e} blocked, {without:e} unblocked"));
            }
        }
    }

    for scale in [1e-6, 1e6] {
        let scaled = compute(&room.mesh(|v| v.map(|x| scale * x), true), &flags);
        differences(&format!("unit of length {scale:e}"), &one, &scaled, found);
    }
    let [u, v] = random.axes();
    let w = cross(u, v);
    let turned = compute(&room.mesh(|p| [dot(u, p), dot(v, p), dot(w, p)], true), &flags);
    differences("turned", &one, &turned, found);
}

#[test]
fn rooms_with_blocks_and_plates() {
    let mut wrong = Vec::new();
    for seed in 0..12 {
        let random = &mut Random(seed);
        let room = room(random);
        let tolerance = ["1e-2", "1e-3", "1e-4", "1e-5"][seed as usize % 4];
        let mut found = Vec::new();
        check(&room, tolerance, random, &mut found);
        wrong.extend(found.iter().map(|text| format!("room {seed}, tolerance {tolerance}: {text}")));
    }
    assert!(wrong.is_empty(), "{} findings:\n{}", wrong.len(), wrong.join("\n"));
}
