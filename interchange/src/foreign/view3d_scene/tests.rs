//! Whole files, and what is wrong with others.
#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use crate::foreign::surface::tests::two_polygons;

fn parsed(text: &str) -> Result<(Surface, Vec<String>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.vs3");
    std::fs::write(&path, text).unwrap();
    read(&path)
}

/// Found by fuzzing: a blank of two bytes before the letter.
#[test]
fn titles_stand_behind_blanks_of_any_alphabet() {
    let lines = "\u{a0}T a room\nT\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 0 0 0.5 floor\nE\n";
    let (found, _) = parsed(lines).unwrap();
    assert_eq!(found.comments, ["a room", ""]);
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.vs3");
    let mut surface = two_polygons();
    surface.materials[0].1.diffuse = [0.25; 3];
    crate::foreign::view3d::write(&path, &surface).unwrap();
    let (found, said) = read(&path).unwrap();
    assert_eq!(said, Vec::<String>::new());
    assert_eq!((&found.points, &found.polygons), (&surface.points, &surface.polygons));
    assert_eq!(found.groups, ["the_floor", "flap"]);
    assert_eq!(found.materials[0].1.diffuse, [0.25; 3]);
    assert_eq!(found.comments, ["made by a test"]);
}

/// A file with everything that may stand in one: comments, commas, an obstruction, a combined surface.
#[test]
fn combined_surfaces_join_their_group() {
    let (found, said) = parsed(
        "T two halves ! and more\n/ comment\nC encl=1, emit=1\nF 3\nV 1 0. 0. 0.\nV 2 1. 0. 0.\nV 3,1.,1.,0.\nV 4 0. 1. 0.\n\
         S 1 1 2 3 0 0 0 0.9 half ! the first\nS 2 1 3 4 0 0 1 0.9 other\nO 3 4 3 2 1\nEnd of data\nS 4 9\n",
    )
    .unwrap();
    assert_eq!(found.groups, ["half", "obstruction"]);
    assert_eq!(found.polygon_groups, [0, 0, 1]);
    assert_eq!(found.polygons.row(2), [3, 2, 1, 0]);
    assert!((found.materials[0].1.diffuse[0] - 0.1).abs() < 1e-15);
    assert_eq!(said.len(), 2);
}

#[test]
fn mistakes_are_named_with_their_line() {
    let fails = |text: &str, part: &str| {
        let error = parsed(text).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    fails("F 4\n", ":1: found format 4, expected 3 or 3a");
    fails("F 3\nV 2 0 0 0\n", ":2: found number 2, expected 1");
    fails("V 1 0 x 0\n", ":1: found x");
    fails("V 1 0 0 0\nS 1 1 1 2 0 0 0 .9 a\n", ":2: found vertex 2 of 1");
    fails("V 1 0 0 0\nS 1 1 1 1 0 1 0 .9 a\n", ":2: found base 1, expected another");
    fails("V 1 0 0 0\nS 1 1 1 1 0 0 0 9 a\n", ":2: found 9");
    fails("V 1 0 0 0\nN 1 1 1 1 0 0 0 .9 a\n", ":2: found base 0");
    fails("F 3a\nS 1 X 0 0 .9 a\n", ":2: found shape X, expected R, T or Q");
    fails("F 3a\nS 1 R 0 0 .9 a\n0 0 0 0 90 1 y\n", ":3: found y");
    fails("F 3a\nS 1 R 0 0 .9 a\n0 0 0 0 90\n", ":2: the file ends");
    fails("V 1 0 0 0\nE\n", "no surface");
}

/// A unit square that looks up, with smaller ones on it as asked for.
fn with_a_base(surfaces: &str) -> Result<(Surface, Vec<String>)> {
    parsed(&format!(
        "F 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\n\
         V 5 .25 .25 0\nV 6 .5 .25 0\nV 7 .5 .5 0\nV 8 .25 .5 0\n\
         S 1 1 2 3 4 0 0 .9 base\n{surfaces}\nE\n"
    ))
}

/// Area and normal of every group's polygons, added up, and its lowest point.
fn areas(surface: &Surface) -> Vec<(&str, DVec3, f64)> {
    let of = |group: u32| {
        let rows = surface.polygons.rows().zip(&surface.polygon_groups).filter(|row| *row.1 == group);
        let ring = |row: &[u32]| row.iter().map(|&p| DVec3::from_array(surface.points[p as usize])).collect();
        let rings: Vec<Ring> = rows.map(|(row, _)| ring(row)).collect();
        let low = rings.iter().flatten().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        (rings.iter().map(|ring| cut::area_vector(ring)).sum::<DVec3>(), low)
    };
    let groups = surface.groups.iter().zip(0..);
    groups.map(|(name, group)| (name.as_str(), of(group).0, of(group).1)).collect()
}

#[test]
fn bases_are_cut_around_their_subsurfaces() {
    let (found, said) = with_a_base("S 2 5 6 7 8 1 0 .5 window").unwrap();
    assert_eq!(areas(&found), [("base", 0.9375 * DVec3::Z, 0.0), ("window", 0.0625 * DVec3::Z, 0.0)]);
    assert_eq!(said, Vec::<String>::new());
    // A base may be a subsurface itself, and come later where it is an obstruction.
    let text = "S 2 5 6 7 0 3 0 .5 pane\nO 3 5 6 7 8";
    let (found, said) = with_a_base(text).unwrap();
    let expected = [
        ("base", DVec3::Z, 0.0),
        ("pane", 0.03125 * DVec3::Z, 0.0),
        ("obstruction", 0.03125 * DVec3::Z, 0.0),
    ];
    assert_eq!(areas(&found), expected);
    assert_eq!(said, ["1 obstruction turned black, with rows of their own in the matrix"]);
}

#[test]
fn null_surfaces_turn_black_and_masks_stand_off() {
    let (found, said) = with_a_base("N 2 8 7 6 5 1 0 .9 gap").unwrap();
    let expected = [("base", 0.9375 * DVec3::Z, 0.0), ("obstruction", 0.0625 * DVec3::Z, 0.0)];
    assert_eq!((areas(&found), said.len()), (expected.to_vec(), 1));
    let (found, said) = with_a_base("M 2 8 7 6 5 1 0 .9 mask").unwrap();
    let size = 0.125f64.sqrt();
    let [(_, base, _), (_, mask, low)] = areas(&found)[..] else { panic!("{found:?}") };
    assert_eq!((base, mask, said.len()), (DVec3::Z, -0.0625 * DVec3::Z, 1));
    assert!((low - MASK_GAP * size).abs() < 1e-18, "{low}");
    // Those that look the wrong way, and those that are no parts.
    let fails = |surfaces: &str, part: &str| {
        let error = with_a_base(surfaces).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    fails("N 2 5 6 7 8 1 0 .9 gap", "surface 2 does not face as it must towards its base, surface 1");
    fails("S 2 5 6 7 8 1 0 .9 a\nS 3 5 6 7 8 1 0 .9 b", ":12: surface 3 does not lie within what is left of");
}

/// The same L-shaped room in both formats: 3a says each surface by place, azimuth, tilt and shape.
#[test]
fn shapes_are_placed() {
    let text = "t room\nc encl=1\nf 3A ! by shapes\n\
        S 1 R 0 0 .9 south ! looks to +y\n 2 0 0   0 90\n 2 3\n\
        S 2 t 0 0 .9 floor\n 0 0 0 180 0\n 0 0 2 0\n! between\n 2 1\n\
        O 3 Q\n 2 1 3 0 180  0 0 2 0 2 1 0 1\nE\n";
    let (found, _) = parsed(text).unwrap();
    let expected =
        [("south", 6.0 * DVec3::Y, 0.0), ("floor", DVec3::Z, 0.0), ("obstruction", -2.0 * DVec3::Z, 3.0)];
    assert_eq!(areas(&found), expected);
    assert_eq!(found.comments, ["room"]);
    assert_eq!(found.points[found.polygons.row(2)[2] as usize], [0.0, 2.0, 3.0]);
}
