//! Every skip: with it turned off the matrix stays the same, to the bit or within the stated errors; its counter is at its
//! maximum where it must be and zero where it must be.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use assert_cmd::Command;
use common::{clustered, divided, inward_cube, mesh_of, room_with_box};
use interchange::ids::VertexId;
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::ragged::Ragged;
use std::collections::BTreeMap;

type Polygons = Vec<Vec<[f64; 3]>>;

/// All names of `--no-skip`.
const SKIPS: [&str; 12] = [
    "same-plane",
    "behind",
    "behind-clusters",
    "convex-enclosure",
    "empty-shaft",
    "covered",
    "inherited-blockers",
    "reciprocity",
    "zero-blocks",
    "equal-poses",
    "far-rules",
    "point-views",
];

/// A computed matrix with its report.
struct Computed {
    /// S, all of it.
    entries: Vec<Vec<f64>>,
    areas: Vec<f64>,
    row_errors: Vec<f64>,
    counters: BTreeMap<String, u64>,
    /// Rows and columns of the stored blocks.
    blocks: Vec<[std::ops::Range<u32>; 2]>,
}

impl Computed {
    fn new(mesh: &Mesh, flags: &[&str]) -> Computed {
        let folder = tempfile::tempdir().unwrap();
        let (path, output) = (folder.path().join("s.mesh"), folder.path().join("s.ff"));
        mesh.write(&path, Provenance::new("test", "1")).unwrap();
        let mut command = Command::cargo_bin("formfactor-tool").unwrap();
        command.arg("compute").arg(&path).arg("-o").arg(&output);
        command.args(["--closure", "off"]).args(flags).assert().success();
        let matrix = Matrix::open(&output).unwrap();
        let n = matrix.element_count();
        let mut entries = vec![vec![0.0; n]; n];
        matrix
            .for_each(|i, j, value| {
                entries[i][j] = value;
                entries[j][i] = value;
            })
            .unwrap();
        let range = |start: u32, count: u32| start..start + count;
        let views = matrix.views().unwrap();
        let blocks = views.iter().map(|view| &view.block);
        let text = std::fs::read_to_string(folder.path().join("s.ff.report.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        Computed {
            entries,
            areas: matrix.areas().unwrap().to_vec(),
            row_errors: matrix.row_errors().unwrap().to_vec(),
            counters: serde_json::from_value(report["counters"].clone()).unwrap(),
            blocks: blocks.map(|b| [range(b.row_start, b.rows), range(b.column_start, b.columns)]).collect(),
        }
    }

    #[track_caller]
    fn count(&self, name: &str) -> u64 {
        *self.counters.get(name).unwrap_or_else(|| panic!("no counter {name:?} in {:#?}", self.counters))
    }

    fn has_the_bits_of(&self, other: &Computed) -> bool {
        let bits = |m: &Computed| m.entries.iter().flatten().map(|s| s.to_bits()).collect::<Vec<_>>();
        bits(self) == bits(other)
    }

    /// Panics where a row differs by more than both state.
    #[track_caller]
    fn assert_agrees(&self, other: &Computed, what: &str) {
        for (i, (a, b)) in self.entries.iter().zip(&other.entries).enumerate() {
            let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / self.areas[i];
            let stated = self.row_errors[i] + other.row_errors[i];
            assert!(difference <= stated, "{what}: row {i} differs by {difference:e}, both state {stated:e}");
        }
    }
}

fn moved(polygons: Polygons, scale: f64, shift: [f64; 3]) -> Polygons {
    let place = |v: [f64; 3]| [0, 1, 2].map(|k| scale * v[k] + shift[k]);
    polygons.into_iter().map(|polygon| polygon.into_iter().map(place).collect()).collect()
}

/// Faces cut into `parts` x `parts` elements each, `leaf` of them to a cluster; the faces block.
fn cut(faces: &Polygons, parts: usize, leaf: usize) -> Mesh {
    let mut mesh = clustered(&divided(faces, parts), leaf as u32);
    let first = mesh.vertices.len();
    mesh.vertices.extend(faces.iter().flatten());
    mesh.occluders = Ragged::default();
    mesh.occluder_faces.truncate(faces.len());
    let mut corner = first;
    for face in faces {
        mesh.occluders.push((corner..corner + face.len()).map(VertexId::new));
        corner += face.len();
    }
    mesh
}

/// A cube seen from inside: convex. Clusters are its walls.
fn cube(parts: usize) -> Mesh {
    cut(&inward_cube(0.0, 1.0), parts, parts * parts)
}

/// A room with a box: clusters are the faces.
fn furnished(parts: usize) -> Mesh {
    cut(&room_with_box(), parts, parts * parts)
}

/// The box alone, seen from outside.
fn outward_box(parts: usize) -> Mesh {
    cut(&room_with_box().split_off(6), parts, parts * parts)
}

/// Two closed rooms side by side, the second one smaller, no door between. The first 6 x 4 elements are the first room's.
fn two_rooms() -> Mesh {
    let second = moved(inward_cube(0.0, 1.0), 0.5, [1.25, 0.25, 0.25]);
    cut(&[inward_cube(0.0, 1.0), second].concat(), 2, 4)
}
const FIRST_ROOM: u32 = 24;

/// A sphere of triangles seen from outside: an octahedron's faces cut into 4^cuts, corners on the sphere.
fn sphere(cuts: usize) -> Mesh {
    let mut triangles: Polygons = (0..8)
        .map(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let mut corners = vec![[sign(0), 0.0, 0.0], [0.0, sign(1), 0.0], [0.0, 0.0, sign(2)]];
            if sign(0) * sign(1) * sign(2) < 0.0 {
                corners.reverse();
            }
            corners
        })
        .collect();
    let middle = |a: [f64; 3], b: [f64; 3]| {
        let sum = [0, 1, 2].map(|k| a[k] + b[k]);
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum.map(|x| x / length)
    };
    for _ in 0..cuts {
        let cut = |t: &Vec<[f64; 3]>| {
            let (a, b, c) = (middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0]));
            [vec![t[0], a, c], vec![a, t[1], b], vec![c, b, t[2]], vec![a, b, c]]
        };
        triangles = triangles.iter().flat_map(cut).collect();
    }
    mesh_of(&triangles)
}

/// Two unit squares face to face.
fn two_plates() -> Mesh {
    mesh_of(&inward_cube(0.0, 1.0)[..2])
}

/// Each skip off alone on each scene: the same to the bit where nothing partly occluded is computed and no cheaper rule
/// serves, within the stated errors everywhere.
#[test]
fn the_matrix_stays_with_any_skip_off() {
    let scenes = [
        ("cube", cube(3), true),
        ("mixed clusters", cut(&inward_cube(0.0, 1.0), 3, 7), true),
        ("outward box", outward_box(2), true),
        ("sphere", sphere(1), true),
        ("two rooms", two_rooms(), true),
        ("furnished", furnished(2), false),
        ("furnished, mixed clusters", cut(&room_with_box(), 2, 5), false),
    ];
    for (name, mesh, nothing_partial) in scenes {
        let all = Computed::new(&mesh, &["--tolerance", "1e-5", "--precision", "f64"]);
        assert_eq!(all.count("pairs partly occluded") == 0, nothing_partial, "{name}");
        for skip in SKIPS {
            let flags = ["--tolerance", "1e-5", "--precision", "f64", "--no-skip", skip];
            let without = Computed::new(&mesh, &flags);
            let what = format!("{name} without {skip}");
            without.assert_agrees(&all, &what);
            // These serve other rules or the other way round. Shares of a row's tolerance depend on what is known of its pairs.
            let other_rule = ["far-rules", "empty-shaft", "reciprocity"].contains(&skip)
                || (!nothing_partial && ["covered", "behind", "same-plane"].contains(&skip));
            assert!(other_rule || without.has_the_bits_of(&all), "{what}: other bits");
        }
    }
}

#[test]
fn pairs_of_one_plane() {
    // One sixth of a cube's pairs, the diagonal included; of a tessellated sphere each element with itself alone.
    let (n, parts) = (6 * 16u64, 16u64);
    let on = Computed::new(&cube(4), &[]);
    assert_eq!(on.count("pairs of one plane (skipped)"), 6 * parts * (parts + 1) / 2);
    assert_eq!(on.count("pairs"), n * (n + 1) / 2);
    let off = Computed::new(&cube(4), &["--no-skip", "same-plane"]);
    assert_eq!(off.count("pairs of one plane (skipped)"), 0);
    let sphere = Computed::new(&sphere(1), &[]);
    assert_eq!(sphere.count("pairs of one plane (skipped)"), 32);
}

#[test]
fn pairs_facing_away() {
    // All pairs of a sphere from outside; none of a cube from inside.
    let outside = Computed::new(&sphere(2), &[]);
    let n = 128;
    assert_eq!(outside.count("pairs facing away (skipped)"), n * (n - 1) / 2);
    assert_eq!((outside.count("entries stored"), outside.count("blocks")), (0, 0));
    assert_eq!(Computed::new(&cube(2), &[]).count("pairs facing away (skipped)"), 0);
}

#[test]
fn clusters_facing_away() {
    // All pairs of faces of a box from outside go as whole blocks; none of a cube from inside.
    let whole = "pairs facing away, by whole clusters";
    let outside = Computed::new(&outward_box(3), &[]);
    assert_eq!(outside.count(whole), 15 * 81);
    assert_eq!(outside.count("tiles"), 0);
    let off = Computed::new(&outward_box(3), &["--no-skip", "behind-clusters"]);
    assert_eq!((off.count(whole), off.count("tiles")), (0, 15));
    assert_eq!(off.count("pairs facing away (skipped)"), 15 * 81);
    assert_eq!(Computed::new(&cube(3), &[]).count(whole), 0);
}

const EMPTY: &str = "pairs with an empty shaft (visibility skipped)";

#[test]
fn convex_enclosures_need_no_visibility() {
    let is_convex = "convex enclosure (all visibility skipped)";
    let (tests, bodies) = ("tests of occluders against shafts of clusters", "bodies that block");
    let on = Computed::new(&cube(3), &[]);
    assert_eq!((on.count(is_convex), on.count(tests), on.count(bodies)), (1, 0, 0));
    assert_eq!(on.count("visible parts computed"), 0);
    let off = Computed::new(&cube(3), &["--no-skip", "convex-enclosure"]);
    assert!(off.count(is_convex) == 0 && off.count(tests) > 0 && off.count(bodies) == 6);

    // A floating square ends it, but concerns those pairs alone that have it between them.
    let mut polygons = divided(&inward_cube(0.0, 1.0), 3);
    polygons.push(vec![[0.4, 0.4, 0.5], [0.6, 0.4, 0.5], [0.6, 0.6, 0.5], [0.4, 0.6, 0.5]]);
    let floating = Computed::new(&clustered(&polygons, 9), &[]);
    assert_eq!(floating.count(is_convex), 0);
    assert!(floating.count("visible parts computed") > 0);
    assert!(floating.count("pairs partly occluded") > 0);
    assert!(floating.count(EMPTY) > 0);
}

#[test]
fn empty_shafts() {
    // All pairs of different walls of a cube, also where the other proof (convexity) is not asked.
    let pairs = 15 * 81;
    assert_eq!(Computed::new(&cube(3), &[]).count(EMPTY), pairs);
    assert_eq!(Computed::new(&cube(3), &["--no-skip", "convex-enclosure"]).count(EMPTY), pairs);
    let off = Computed::new(&cube(3), &["--no-skip", "empty-shaft"]);
    assert_eq!((off.count(EMPTY), off.count("pairs partly occluded")), (0, pairs));
    assert_eq!(Computed::new(&outward_box(3), &[]).count(EMPTY), 0);
}

#[test]
fn rooms_without_a_door() {
    let covered = "pairs fully blocked (skipped)";
    let on = Computed::new(&two_rooms(), &[]);
    let between = 24 * 24;
    // What is not behind a wall faces away.
    let away = on.count("pairs facing away (skipped)");
    assert_eq!(on.count(covered) + away, between);
    assert!(on.count(covered) > 0 && on.count("pairs partly occluded") == 0);
    let spans = |block: &[std::ops::Range<u32>; 2]| block[0].start < FIRST_ROOM && block[1].end > FIRST_ROOM;
    assert!(!on.blocks.iter().any(spans), "{:?}", on.blocks);
    assert_eq!(on.blocks.len(), 2 * 15);

    let off = Computed::new(&two_rooms(), &["--no-skip", "covered"]);
    assert_eq!(off.count(covered), 0);
    // Looked at pair by pair, some turn out to face away after all.
    let looked_at = off.count("pairs partly occluded") + off.count("pairs facing away (skipped)");
    assert_eq!(looked_at, between);
    assert!(off.count("pairs partly occluded") > between / 2);
    assert_eq!(Computed::new(&cube(2), &[]).count(covered), 0);
}

#[test]
fn inherited_blockers() {
    let tests = "tests of occluders against shafts of clusters";
    let spared = "tests of occluders against shafts of clusters (skipped)";
    let on = Computed::new(&furnished(3), &[]);
    let off = Computed::new(&furnished(3), &["--no-skip", "inherited-blockers"]);
    assert!(on.count(spared) > 0);
    assert_eq!(off.count(spared), 0);
    assert_eq!(on.count(tests) + on.count(spared), off.count(tests));
    assert_eq!(Computed::new(&cube(3), &[]).count(spared), 0);
}

#[test]
fn reciprocity() {
    let (mirrored, twice) =
        ("pairs taken from their mirror image (skipped)", "pairs computed from both sides");
    let n = 12 * 4;
    let on = Computed::new(&furnished(2), &[]);
    assert_eq!((on.count(mirrored), on.count(twice)), (n * (n - 1) / 2, 0));
    // Only the half is stored.
    assert!(on.count("entries stored") <= n * (n + 1) / 2);
    let off = Computed::new(&furnished(2), &["--no-skip", "reciprocity"]);
    assert!(off.count(twice) > 0);
    assert_eq!(off.count(mirrored) + off.count(twice), n * (n - 1) / 2);
    let one = mesh_of(&inward_cube(0.0, 1.0)[..1]);
    assert_eq!(Computed::new(&one, &[]).count(mirrored), 0);
}

#[test]
fn zeros_are_not_stored() {
    // Of a sphere from outside nothing is stored; of two plates that see each other all is.
    let outside = Computed::new(&sphere(1), &[]);
    assert_eq!((outside.count("entries stored"), outside.count("blocks absent")), (0, 1));
    let off = Computed::new(&sphere(1), &["--no-skip", "zero-blocks"]);
    assert_eq!((off.count("entries stored"), off.count("blocks absent")), (32 * 33 / 2, 0));
    // A chain of leaves of mixed planes holds zeros beside other entries: those blocks become sparse.
    let mixed = cut(&room_with_box(), 2, 5);
    let [on, off] = [&[][..], &["--no-skip", "zero-blocks"]].map(|flags| Computed::new(&mixed, flags));
    assert!(on.count("entries stored") < off.count("entries stored"));
    assert!(off.count("blocks sparse") == 0);
    assert_eq!(Computed::new(&two_plates(), &[]).count("blocks absent"), 0);
}

#[test]
fn equal_poses() {
    let (distinct, spared) = ("different poses of near pairs", "near pairs of a pose met before (skipped)");
    let on = Computed::new(&cube(8), &["--tolerance", "1e-6"]);
    assert!(on.count(spared) > 5 * on.count(distinct), "{} {}", on.count(spared), on.count(distinct));
    let off = Computed::new(&cube(8), &["--tolerance", "1e-6", "--no-skip", "equal-poses"]);
    assert_eq!((off.count(spared), off.count(distinct)), (0, 0));
    assert!(on.has_the_bits_of(&off));
    let plates = Computed::new(&two_plates(), &[]);
    assert_eq!((plates.count(spared), plates.count(distinct)), (0, 1));
}

#[test]
fn far_rules() {
    let contour = "pairs unoccluded, contour";
    let far = ["one point", "few points", "several points", "many points", "by whole clusters"];
    let far =
        |c: &Computed| -> u64 { far.map(|rule| c.count(&format!("pairs unoccluded, {rule}"))).iter().sum() };
    let loose = ["--tolerance", "1e-2", "--precision", "f64"];
    let on = Computed::new(&cube(8), &loose);
    let off = Computed::new(&cube(8), &[&loose[..], &["--no-skip", "far-rules"]].concat());
    let pairs = 15 * 64 * 64;
    assert_eq!(far(&on) + on.count(contour), pairs);
    assert!(far(&on) > pairs / 2, "{}", far(&on));
    assert_eq!((far(&off), off.count(contour)), (0, pairs));
    off.assert_agrees(&on, "cube without far rules");
    // Squares of one size at that distance touch or nearly so.
    let near = Computed::new(&two_plates(), &[]);
    assert_eq!((far(&near), near.count(contour)), (0, 1));
}

/// At a loose tolerance points serve most pairs past the box, in fewer looks; the matrix agrees with one of a two-hundredth of the tolerance.
#[test]
fn point_views() {
    let (by_points, adaptive) = ("pairs past blockers, by points of both sides", "pairs partly occluded");
    let loose = ["--tolerance", "1e-1", "--precision", "f64"];
    let on = Computed::new(&furnished(10), &loose);
    let off = Computed::new(&furnished(10), &[&loose[..], &["--no-skip", "point-views"]].concat());
    assert!(on.count(by_points) > 2 * on.count(adaptive), "{} {}", on.count(by_points), on.count(adaptive));
    assert_eq!(off.count(by_points), 0);
    assert!(on.count("visible parts computed") < off.count("visible parts computed"));
    let tight = Computed::new(&furnished(10), &["--tolerance", "5e-4", "--precision", "f64"]);
    assert_eq!(tight.count(by_points), 0);
    off.assert_agrees(&on, "points against none");
    tight.assert_agrees(&on, "points against a tight tolerance");
}
