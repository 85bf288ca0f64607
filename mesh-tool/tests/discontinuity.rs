//! Discontinuity lines of scenes whose lines are known exactly: all found, none extra, orders right.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use geometry::gather::{Gatherer, Scratch};
use geometry::occluder::Occluder;
use glam::DVec3;
use interchange::report::Report;
use interchange::scene::Scene;
use mesh_tool::build::convex_pieces_of_faces;
use mesh_tool::clean::clean;
use mesh_tool::discontinuity::{Drawing, DrawnLine, Order};
use mesh_tool::steps::{Off, Skip};

/// Floor z = 0, [-9, 9]^2, looking up; face 0.
const FLOOR: &str = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nusemtl white\nf -4 -3 -2 -1\n";

fn polygon_text(material: &str, corners: &[(f64, f64, f64)]) -> String {
    let mut text = String::new();
    for (x, y, z) in corners {
        text += &format!("v {x:?} {y:?} {z:?}\n");
    }
    text += &format!("usemtl {material}\nf");
    for k in 0..corners.len() {
        text += &format!(" -{}", corners.len() - k);
    }
    text + "\n"
}

fn drawn_with(scene: &Scene, order: Order, skips: Off<Skip>, eee: bool) -> (Vec<DrawnLine>, Report) {
    let mut report = Report::new("mesh-tool", "test");
    let cleaned = clean(scene, &Off::default(), &mut report).unwrap();
    let pieces = convex_pieces_of_faces(scene, &cleaned).unwrap();
    let emits = |&face: &u32| cleaned.faces[face as usize].emits;
    let sources = (0..cleaned.faces.len() as u32).filter(emits).collect();
    let drawing = Drawing { scene: &cleaned, pieces: &pieces, sources, order, skips: &skips, eee };
    (drawing.lines(&mut report), report)
}

fn drawn(scene: &Scene) -> (Vec<DrawnLine>, Report) {
    drawn_with(scene, Order::D2, Off::default(), false)
}

type Line = ((f64, f64), (f64, f64));

/// Asserts that the lines on `face` are exactly the expected ones, in any order and direction.
fn assert_lines(lines: &[DrawnLine], face: u32, order: u32, expected: &[Line]) {
    let found: Vec<&DrawnLine> = lines.iter().filter(|l| l.face == face && l.order == order).collect();
    for &((ax, ay), (bx, by)) in expected {
        let (a, b) = (DVec3::new(ax, ay, 0.0), DVec3::new(bx, by, 0.0));
        let near = |p: DVec3, q: DVec3| p.distance(q) < 1e-12;
        let is = |line: &&&DrawnLine| {
            let [p, q] = line.ends;
            (near(p, a) && near(q, b)) || (near(p, b) && near(q, a))
        };
        assert_eq!(found.iter().filter(is).count(), 1, "{a} to {b} among {found:#?}");
    }
    assert_eq!(found.len(), expected.len(), "{found:#?}");
}

fn occluder() -> String {
    polygon_text("white", &[(-1.0, -1.0, 2.0), (1.0, -1.0, 2.0), (1.0, 1.0, 2.0), (-1.0, 1.0, 2.0)])
}

/// S1: light [-.5, .5]^2 at z = 4, occluder [-1, 1]^2 at z = 2.
fn aligned_squares() -> String {
    let light = [(-0.5, -0.5, 4.0), (-0.5, 0.5, 4.0), (0.5, 0.5, 4.0), (0.5, -0.5, 4.0)];
    format!("{FLOOR}{}{}", polygon_text("lamp", &light), occluder())
}

#[test]
fn aligned_squares_have_eight_slope_lines() {
    let (lines, report) = drawn(&scene_of(&aligned_squares()));
    let mut expected: Vec<Line> = Vec::new();
    for at in [-2.5, -1.5, 1.5, 2.5] {
        expected.push(((at, -2.5), (at, 2.5)));
        expected.push(((-2.5, at), (2.5, at)));
    }
    assert_lines(&lines, 0, 1, &expected);
    assert_eq!(lines.len(), 8);
    assert_eq!(report.counters["wedge segments"], 32);
    assert_eq!(report.counters["skipped: segments merged into others"], 24);
}

/// S2: the light turned by 45 degrees.
#[test]
fn turned_light_has_28_curvature_lines() {
    let light = [(0.6, 0.0, 4.0), (0.0, -0.6, 4.0), (-0.6, 0.0, 4.0), (0.0, 0.6, 4.0)];
    let scene = scene_of(&format!("{FLOOR}{}{}", polygon_text("lamp", &light), occluder()));
    let (lines, _) = drawn(&scene);
    let mut expected: Vec<Line> = Vec::new();
    for sign in [-1.0, 1.0] {
        for (at, to) in [(1.4, 2.0), (2.6, 2.0), (2.0, 2.6)] {
            expected.push(((sign * at, -to), (sign * at, to)));
            expected.push(((-to, sign * at), (to, sign * at)));
        }
        for other in [-1.0, 1.0] {
            let diamond =
                [(1.4, 2.0), (2.0, 1.4), (2.6, 2.0), (2.0, 2.6)].map(|(x, y)| (sign * x, other * y));
            expected.extend((0..4).map(|k| (diamond[k], diamond[(k + 1) % 4])));
        }
    }
    assert_eq!(expected.len(), 28);
    assert_lines(&lines, 0, 2, &expected);
    assert_eq!(lines.len(), 28);
    let (linear, report) = drawn_with(&scene, Order::D1, Off::default(), false);
    assert_eq!(linear, []);
    assert_eq!(report.counters["skipped: lines of a higher order than asked"], 28);
}

/// S3: a wall on the floor.
#[test]
fn wall_on_the_floor_has_slope_lines_and_lines_from_its_feet() {
    let wall = [(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, -1.0, 1.0)];
    let light = [(1.5, -0.5, 4.0), (1.5, 0.5, 4.0), (2.5, 0.5, 4.0), (2.5, -0.5, 4.0)];
    let text = format!("{FLOOR}{}{}", polygon_text("lamp", &light), polygon_text("white", &wall));
    let (lines, _) = drawn(&scene_of(&text));
    let sixth = 1.0 / 6.0;
    let slope: Vec<Line> = vec![
        ((-0.5, -1.0 - 3.0 * sixth), (-0.5, 1.0 + 3.0 * sixth)),
        ((-5.0 * sixth, -1.0 - 3.0 * sixth), (-5.0 * sixth, 1.0 + 3.0 * sixth)),
    ];
    assert_lines(&lines, 0, 1, &slope);
    let mut curvature: Vec<Line> = Vec::new();
    for sign in [-1.0, 1.0] {
        for x in [-0.5, -5.0 * sixth] {
            for y in [1.0 + sixth, 1.0 + 3.0 * sixth] {
                curvature.push(((0.0, sign), (x, sign * y)));
            }
        }
    }
    // Where the top corner passes an edge of the light across the wall; see the next test.
    for y in [1.0 + sixth, 1.0 + 3.0 * sixth] {
        curvature.extend([-1.0, 1.0].map(|sign| ((-0.5, sign * y), (-5.0 * sixth, sign * y))));
    }
    assert_lines(&lines, 0, 2, &curvature);
    assert!(lines.iter().all(|line| line.face == 0), "{lines:#?}");
    // The floor's contact, and nothing else anywhere.
    let (mesh, _) = made(&scene_of(&text), elements(500));
    let contact: f64 = mesh
        .lines
        .iter()
        .filter(|line| line.order == 0 && line.face.0 == 0)
        .map(|line| mesh.position(line.from).distance(mesh.position(line.to)))
        .sum();
    assert!((contact - 2.0).abs() < 1e-12, "{contact}");
}

/// The four lines of S3 between the images of the top corner: slopes are continuous there, curvature is not.
#[test]
fn curvature_jumps_where_the_top_corner_passes_an_edge_of_the_light() {
    let wall = [(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, -1.0, 1.0)];
    let light = [(1.5, 0.5, 4.0), (2.5, 0.5, 4.0), (2.5, -0.5, 4.0), (1.5, -0.5, 4.0)];
    let corners = |given: &[(f64, f64, f64)]| -> Vec<DVec3> {
        given.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect()
    };
    let wall = Occluder::new(corners(&wall)).unwrap();
    let gatherer = Gatherer::new(vec![wall], vec![corners(&light)]);
    let mut scratch = Scratch::default();
    let mut seen = |y: f64| {
        let mut sum = 0.0;
        let visit = &mut |_, factor| sum += factor;
        gatherer.factors(DVec3::new(-0.7, y, 0.0), DVec3::Z, &mut scratch, visit);
        sum
    };
    // One-sided second differences, of second order.
    let h = 1e-3;
    for y in [7.0 / 6.0, 1.5] {
        let mut side = |h: f64| {
            let f: Vec<f64> = (0..4).map(|k| seen(y + f64::from(k) * h)).collect();
            let slope = (-11.0 * f[0] + 18.0 * f[1] - 9.0 * f[2] + 2.0 * f[3]) / (6.0 * h);
            (slope, (2.0 * f[0] - 5.0 * f[1] + 4.0 * f[2] - f[3]) / (h * h))
        };
        let ((slope_below, below), (slope_above, above)) = (side(-h), side(h));
        assert!((slope_above - slope_below).abs() < 1e-5, "{slope_below} {slope_above}");
        assert!((above - below).abs() > 1e-2, "{below} {above}");
    }
}

/// S4: three skew edges leave a hyperbola on the floor.
#[test]
fn three_skew_edges_leave_the_known_hyperbola() {
    let light = [(-1.0, 0.0, 4.0), (-1.0, 1.0, 4.0), (1.0, 1.0, 4.0), (1.0, 0.0, 4.0)];
    let first = [(0.0, -0.5, 2.75), (0.0, 0.5, 3.25), (-3.0, 0.5, 3.25), (-3.0, -0.5, 2.75)];
    let second = [(-0.7, -1.0, 2.0), (1.3, 1.0, 2.0), (4.3, -2.0, 2.0), (2.3, -4.0, 2.0)];
    let text = format!(
        "{FLOOR}{}{}{}",
        polygon_text("lamp", &light),
        polygon_text("white", &first),
        polygon_text("white", &second)
    );
    let (lines, report) = drawn_with(&scene_of(&text), Order::D2, Off::default(), true);
    assert!(report.counters["curves of three edges"] > 0);
    let points =
        [(0.340100251, -0.380952381), (0.9, 0.0), (1.482957393, 0.421052632), (2.097979798, 0.888888889)];
    for (x, y) in points {
        let point = DVec3::new(x, y, 0.0);
        let distance = lines
            .iter()
            .filter(|line| line.face == 0 && line.order == 2)
            .map(|line| {
                let [a, b] = line.ends;
                let t = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                point.distance(a.lerp(b, t))
            })
            .fold(f64::INFINITY, f64::min);
        // A thousandth of the scene, whose diagonal is 25.8.
        assert!(distance < 0.0258, "{point}: {distance}");
    }
    let (without, _) = drawn(&scene_of(&text));
    assert!(without.len() < lines.len());
}

#[test]
fn convex_room_has_no_lines_and_sweeps_no_wedge() {
    let (lines, report) = drawn(&read("goral_cube.obj"));
    assert_eq!((lines.len(), report.counters["wedges swept"]), (0, 0));
    let pairs = report.counters["emitter-receiver pairs"];
    assert_eq!(report.counters["skipped: pairs with nothing between"], pairs);
    let without = Off::new(vec![Skip::Shaft]);
    assert_eq!(drawn_with(&read("goral_cube.obj"), Order::D2, without, false).0, []);
}

/// Light by several lamps of unequal reach above boxes: every skip changes only what it says.
fn lamps_and_boxes() -> String {
    let lamp = |x: f64, y: f64, half: f64| {
        polygon_text(
            "lamp",
            &[
                (x - half, y - half, 4.0),
                (x - half, y + half, 4.0),
                (x + half, y + half, 4.0),
                (x + half, y - half, 4.0),
            ],
        )
    };
    let mut text = format!("{FLOOR}{}{}", lamp(0.3, 0.2, 0.5), lamp(7.9, 8.1, 0.002));
    let mut first = text.matches("v ").count() + 1;
    text += "usemtl white\n";
    for (x, y) in [(-2.0, -1.0), (1.5, 0.7), (2.1, -2.3)] {
        text += &box_text([x, y, 0.4], [x + 0.73, y + 0.91, 1.3], true, first);
        first += 8;
    }
    text
}

#[test]
fn skips_leave_out_only_what_does_not_matter() {
    let scene = scene_of(&lamps_and_boxes());
    let (lines, report) = drawn(&scene);
    for name in [
        "skipped: wedges that are no silhouette",
        "skipped: pairs with weak light",
        "skipped: pairs with nothing between",
    ] {
        assert!(report.counters[name] > 0, "{name}: {:?}", report.counters);
    }
    // Edges that are no silhouette leave nothing that is not there already, nor do empty shafts.
    for skip in [Skip::Silhouette, Skip::Shaft] {
        let (all, _) = drawn_with(&scene, Order::D2, Off::new(vec![skip]), false);
        let near = |a: &DrawnLine, b: &DrawnLine| {
            let along = |p: DVec3| {
                let [q, r] = b.ends;
                let t = ((p - q).dot(r - q) / (r - q).length_squared()).clamp(0.0, 1.0);
                p.distance(q.lerp(r, t)) < 1e-9
            };
            a.face == b.face && a.source == b.source && a.ends.into_iter().all(along)
        };
        for line in &all {
            assert!(lines.iter().any(|known| near(line, known)), "{skip:?}: {line:?}");
        }
    }
    // The small lamp's lines, where the large one outshines it, are the weak ones.
    let (all, _) = drawn_with(&scene, Order::D2, Off::new(vec![Skip::Weak]), false);
    assert!(all.len() > lines.len());
    let extra = all.iter().filter(|line| !lines.contains(line));
    assert!(extra.clone().all(|line| line.source == 2), "{:#?}", extra.collect::<Vec<_>>());
    // Not merged, the segments are as many as the wedges leave.
    let (all, report) = drawn_with(&scene, Order::D2, Off::new(vec![Skip::Merge]), false);
    assert_eq!(all.len() as u64, report.counters["wedge segments"]);
    // A room of black lamps only in a convex box: nothing to skip but everything.
    let (_, report) = drawn(&scene_of(&aligned_squares()));
    assert_eq!(report.counters["skipped: pairs with weak light"], 0);
}

/// Every segment of the reference that carries light lies on our lines.
#[test]
fn penumbra_lines_of_the_reference_are_covered() {
    let (lines, _) = drawn(&read("penumbra.obj"));
    let text = std::fs::read_to_string(scene_path("../reference/penumbra_discontinuities.csv")).unwrap();
    let (mut covered, mut dark) = (0, 0);
    for row in text.lines().filter(|row| row.starts_with("VE") || row.starts_with("EV")) {
        let numbers: Vec<f64> = row.split(',').skip(4).map(|x| x.parse().unwrap()).collect();
        let [a, b] = [0, 2].map(|k| DVec3::new(numbers[k], 0.0, numbers[k + 1]));
        // Along a segment, every place is on some line.
        let on_line = (0..=20).all(|k| {
            let p = a.lerp(b, f64::from(k) / 20.0);
            lines.iter().filter(|line| line.face == 0).any(|line| {
                let [q, r] = line.ends;
                let t = ((p - q).dot(r - q) / (r - q).length_squared()).clamp(0.0, 1.0);
                p.distance(q.lerp(r, t)) < 1e-9
            })
        });
        covered += usize::from(on_line);
        dark += usize::from(!on_line);
    }
    assert_eq!((covered, dark), (32, 0));
}

/// Three edges parallel to one plane leave a straight line.
#[test]
fn three_edges_parallel_to_a_plane_leave_a_straight_line() {
    let light = [(-1.0, 0.0, 4.0), (-1.0, 1.0, 4.0), (1.0, 1.0, 4.0), (1.0, 0.0, 4.0)];
    let first = [(0.0, -0.5, 3.0), (0.0, 0.5, 3.0), (-3.0, 0.5, 3.0), (-3.0, -0.5, 3.0)];
    let second = [(-0.7, -1.0, 2.0), (1.3, 1.0, 2.0), (4.3, -2.0, 2.0), (2.3, -4.0, 2.0)];
    let text = format!(
        "{FLOOR}{}{}{}",
        polygon_text("lamp", &light),
        polygon_text("white", &first),
        polygon_text("white", &second)
    );
    let scene = scene_of(&text);
    let (without, _) = drawn(&scene);
    let (lines, report) = drawn_with(&scene, Order::D2, Off::default(), true);
    assert!(report.counters["curves of three edges"] > 0);
    // Straight curves are one chord each, or lie on lines that are there already.
    let extra = lines.len() - without.len().min(lines.len());
    assert!(extra as u64 <= report.counters["curves of three edges"], "{extra}");
}
