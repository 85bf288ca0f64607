//! Pictures of a matrix: a pixel is what its entry says, and a row lies on the scene.
#![allow(clippy::unwrap_used)]

#[path = "../../solve-tool/tests/common/room.rs"]
mod room;

use formfactor_tool::picture::{matrix, row, scale::Scale};
use interchange::matrix::Matrix;
use room::{ADJACENT, OPPOSITE, Room};

#[test]
fn pixels_are_the_entries_in_cluster_order() {
    let room = Room::new([0.5; 3], 0.0);
    let picture = matrix::picture(&Matrix::open(&room.matrix).unwrap()).unwrap();
    // Six elements on 1020 pixels: 170 each, behind a margin of 16 and 32. Borders of blocks are looked past.
    let at = |i: usize, j: usize| picture.get(16 + 170 * j + 85, 32 + 170 * i + 85);
    let scale = Scale::of([OPPOSITE, ADJACENT].into_iter());
    assert_eq!(scale, Scale { low: -1, high: 0 });
    for i in 0..6 {
        for j in 0..6 {
            let want = match (i == j, i / 2 == j / 2) {
                // The triangles store the diagonal.
                (true, _) => [0; 3],
                (_, true) => scale.colour(OPPOSITE),
                _ => scale.colour(ADJACENT),
            };
            assert_eq!(at(i, j), want, "({i}, {j})");
        }
    }
    // The first block is a triangle of four elements, the one to its right is dense.
    assert_eq!((picture.get(16, 300), picture.get(16 + 4 * 170, 300)), ([255, 90, 90], [255; 3]));
}

#[test]
fn a_row_is_painted_in_every_format() {
    let room = Room::new([0.5; 3], 0.0);
    let request = row::Request { mesh: &room.mesh, element: 1, from: row::FROM };
    for name in ["r.png", "r.ply", "r.vtu", "r.glb", "r.obj", "r.rad"] {
        row::draw(&[&room.matrix], &request, &room.path(name)).unwrap();
        assert!(std::fs::metadata(room.path(name)).unwrap().len() > 300, "{name}");
    }
    let text = std::fs::read_to_string(room.path("r.ply")).unwrap();
    let last = text.lines().last().unwrap();
    // Element 6 (the ceiling) sees element 1 as a neighbour does.
    assert!(last.ends_with(&format!(" {ADJACENT} {ADJACENT}")), "{last}");
    // The chosen element is red, as sRGB bytes.
    let first = text.lines().skip_while(|line| *line != "end_header").nth(1).unwrap();
    assert!(first.ends_with(" 230 30 40"), "{first}");
    let fails = |element: u32, name: &str, part: &str| {
        let request = row::Request { element, ..request.clone() };
        let said = row::draw(&[&room.matrix], &request, &room.path(name)).unwrap_err().to_string();
        assert!(said.contains(part), "{said}");
    };
    fails(7, "r.png", "there is no element 7");
    fails(1, "r.stl", "must end in .png, .ply");
    let meant = format!("did you mean {}?", room.path("r.vtu").display());
    fails(1, "r.vtk", &meant);
    fails(1, "r.vs3", "must end in .png, .ply");
}

#[test]
fn directions_are_three_numbers() {
    assert_eq!(row::parse_direction("1, 0,-2.5"), Ok([1.0, 0.0, -2.5]));
    for bad in ["", "1,2", "1,2,3,4", "0,0,0", "a,b,c", "1,2,inf"] {
        assert!(row::parse_direction(bad).is_err(), "{bad}");
    }
}
