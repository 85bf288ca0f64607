#![allow(clippy::unwrap_used)]
use super::*;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn scanned(text: &str) -> Scan {
    scan(Path::new("s.obj"), text).unwrap()
}

/// The message of a refusal, without the file's name.
fn refusal(text: &str) -> String {
    let message = scan(Path::new("s.obj"), text).unwrap_err().to_string();
    message.strip_prefix("s.obj:").unwrap().to_owned()
}

/// The message of a refusal of a square followed by `lines`, the first of which is line 5.
fn refusal_after_square(lines: &str) -> String {
    refusal(&format!("{SQUARE}{lines}"))
}

#[test]
fn normalised_text_holds_coordinates_and_absolute_indices_alone() {
    let text = "mtllib a.mtl\nv 1e-3 +2 .5 0.5 # tip\nv\t0 0 0 1 0 0\nvt 0 0\nvn 0 0 1\nv 1 0 0\n\
                o box\ns off\nusemtl red\nf 1/1/1 2//1 -1/1\nl 1 2\np 1\n";
    let scan = scanned(text);
    assert_eq!(scan.normalised, "v 1e-3 +2 .5\nv 0 0 0\nv 1 0 0\nf 1 2 3\n");
    assert_eq!(scan.faces, [FaceAttributes { group: 0, material: 0, corner_count: 3, line: 10 }]);
    assert_eq!((scan.groups, scan.materials), (vec!["box".to_owned()], vec!["red".to_owned()]));
    assert_eq!(scan.libraries, [("a.mtl".to_owned(), 1)]);
    assert_eq!(scan.warnings, ["s.obj:2: a vertex has a weight other than 1; weights are ignored"]);
}

#[test]
fn continued_face_lines() {
    let scan = scanned(&format!("{SQUARE}f 1 2 \\\n  3 \\\r\n4\nf 1/ \\\n2 3\n"));
    assert_eq!(scan.corners, [0, 1, 2, 3, 0, 1, 2]);
    assert_eq!(scan.faces.iter().map(|f| f.line).collect::<Vec<_>>(), [5, 8]);
}

#[test]
fn group_split_by_material_change_stays_one_group() {
    let face = "f 1 2 3\n";
    let text = format!("{SQUARE}g a\nusemtl x\n{face}usemtl y\n{face}g b\n{face}o a\n{face}");
    let scan = scanned(&text);
    assert_eq!(scan.groups, ["a", "b"]);
    assert_eq!(scan.faces.iter().map(|f| f.group).collect::<Vec<_>>(), [0, 0, 1, 0]);
    assert_eq!(scan.faces.iter().map(|f| f.material).collect::<Vec<_>>(), [0, 1, 1, 1]);
}

#[test]
fn names_are_the_whole_trimmed_rest_and_groups_without_faces_are_not_listed() {
    let text =
        format!("{SQUARE}f 1 2 3\ng empty\ng \t left  wall #2 \nusemtl  wet paint \nf 1 2 3\ng\nf 1 2 3");
    let scan = scanned(&text);
    assert_eq!(scan.groups, [NONE, "left  wall #2"]);
    assert_eq!(scan.faces.iter().map(|f| f.group).collect::<Vec<_>>(), [0, 1, 0]);
    assert_eq!(scan.materials, [NONE, "wet paint"]);
    let expected = "s.obj:5: faces before any usemtl (1) are black and dark: they get the material (none)";
    assert_eq!(scan.warnings, [expected]);
}

#[test]
fn relative_indices_count_back_and_absolute_ones_may_look_ahead() {
    let scan = scanned("v 0 0 0\nv 1 0 0\nf 1 2 4\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -4 -3 -1");
    assert_eq!(scan.corners, [0, 1, 3, 0, 1, 2, 0, 1, 3]);
}

#[test]
fn coordinates_that_are_no_finite_numbers_are_refused_with_their_line() {
    let nan = "2: vertex 2: y is NaN; coordinates must be finite numbers";
    assert_eq!(refusal("v 0 0 0\nv 0.2 nan 0.2\nf 1 2 1"), nan);
    assert_eq!(refusal("\n\nv 0 0 -inf"), "3: vertex 1: z is -inf; coordinates must be finite numbers");
    assert_eq!(refusal("v 1e999 0 0"), "1: vertex 1: x is inf; coordinates must be finite numbers");
    assert_eq!(refusal("# a\nv 0 1,5 0"), "2: vertex 1: `1,5` is not a number");
    assert_eq!(refusal("v 0 0 1.#QNAN"), "1: vertex 1: `1.#QNAN` is not a number");
    assert_eq!(refusal("v 0 0 0 x"), "1: vertex 1: `x` is not a number");
    assert!(refusal("v 0 0 2e75").starts_with("1: vertex 1: z is 2e75; coordinates must stay below 1.8e75"));
}

#[test]
fn too_few_or_too_many_coordinates_are_refused_with_their_line() {
    for (count, numbers) in [(0, ""), (2, "1 2"), (5, "1 2 3 4 5"), (8, "1 2 3 4 5 6 7 8")] {
        let message = refusal(&format!("# head\nv {numbers}\n"));
        assert!(
            message.starts_with(&format!("2: vertex 1: found {count} numbers, expected x y z")),
            "{message}"
        );
    }
}

#[test]
fn indices_that_name_no_vertex_are_refused_with_their_line() {
    let corner = "corner 3 of the face: vertex";
    let zero = refusal_after_square("f 1 2 3\nf 1 2 0");
    assert_eq!(zero, format!("6: {corner} 0 does not exist; OBJ counts from 1"));
    let beyond = refusal_after_square("f 1 2 5");
    assert_eq!(beyond, format!("5: {corner} 5 is out of range; the file has 4 vertices"));
    let before = refusal_after_square("f -1 -4 -5\nv 0 0 1");
    assert_eq!(before, format!("5: {corner} -5 is out of range; only 4 vertices stand before this line"));
    let far = refusal_after_square("f 1 2 4294967297");
    assert_eq!(far, format!("5: {corner} 4294967297 is out of range; a scene may have 2147483648 vertices"));
    let last = refusal_after_square("f 1 2 4294967296");
    assert_eq!(last, format!("5: {corner} 4294967296 is out of range; the file has 4 vertices"));
}

#[test]
fn malformed_corners_are_refused_with_their_line() {
    for word in ["x", "/1", "1/2/3/4", "1/a", "1//b", "1.0", "99999999999999999999", "-"] {
        let message = refusal_after_square(&format!("f 1 2 {word}"));
        let expected = format!("5: corner 3 of the face: found `{word}`, expected v, v/vt, v//vn or v/vt/vn");
        assert_eq!(message, expected);
    }
}

#[test]
fn faces_of_fewer_than_three_corners_are_refused_with_their_line() {
    for (count, corners) in [(0, ""), (1, "1"), (2, "1 2")] {
        let message = refusal_after_square(&format!("f 1 2 3\n\nf {corners}"));
        assert_eq!(
            message,
            format!("7: face with {count} corners, expected at least 3; complete or remove it")
        );
    }
}

#[test]
fn statements_without_a_name_are_refused_with_their_line() {
    assert!(refusal_after_square("usemtl").starts_with("5: usemtl without a name"));
    assert!(refusal_after_square("mtllib").starts_with("5: mtllib without a file name"));
}

#[test]
fn an_empty_scene_says_so() {
    let empty = "the scene is empty: no faces";
    assert!(refusal("").starts_with(&format!(" {empty} (0 vertices")));
    assert!(refusal_after_square("l 1 2").starts_with(&format!(" {empty} (4 vertices")));
}

#[test]
fn unknown_keywords_are_told_once_and_their_number_is_limited() {
    let scan = scanned(&format!("{SQUARE}usemtl a\nf 1 2 3\nF 1 2 3\nwobble\nF 2 3 4\ncurv 1\ncurv 2"));
    assert_eq!(
        scan.warnings,
        [
            "s.obj:7: unknown statement `F`; it and others like it are ignored",
            "s.obj:8: unknown statement `wobble`; it and others like it are ignored",
            "s.obj:10: `curv` is not supported and ignored; convert free-form surfaces to polygons",
        ]
    );
    let soup: String = (0..1000).map(|i| format!("word{i}\n")).collect();
    let scan = scanned(&format!("{SQUARE}usemtl a\nf 1 2 3\n{soup}"));
    assert_eq!(scan.warnings.len(), 9);
    assert_eq!(scan.warnings[8], "s.obj: 992 further lines with unknown statements are ignored");
}

#[test]
fn counts_beyond_the_limit_are_refused() {
    let path = Path::new("s.obj");
    let scanner = Scanner::new(path);
    assert!(scanner.limit(9, "vertices", MOST).is_ok());
    let message = scanner.limit(9, "vertices", MOST + 1).unwrap_err().to_string();
    assert_eq!(message, "s.obj:9: more than 2147483648 vertices; split the scene into smaller files");
}
