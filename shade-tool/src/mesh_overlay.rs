//! The mesh over a picture: edges of elements, and discontinuity lines coloured by order, hidden where the scene hides them.
//!
//! A line is drawn where the pixel, or one beside it, sees the side of the face that the line lies on: one ray through
//! each pixel's middle decides.

use crate::camera::Camera;
use crate::canvas::{Canvas, GROUND, text_height, text_scale, text_width};
use crate::visible::{Seen, VisibleSurface};
use glam::DVec3;
use interchange::ids::VertexId;
use interchange::mesh::Mesh;
use rayon::prelude::*;

/// Colour of edges of elements.
const EDGE: [u8; 3] = [30; 3];
/// How much of an edge's pixels it covers at most: the picture shines through.
const EDGE_WIDTH: f64 = 0.6;
/// Colours of lines by order, and what is discontinuous there.
const ORDERS: [([u8; 3], &str); 3] =
    [([255, 50, 60], "D0 value"), ([255, 170, 0], "D1 slope"), ([60, 190, 255], "D2 curvature")];
/// Lines that a panorama bends, or that pass the eye, are cut into so many pieces.
const PIECES: u32 = 32;
/// Halvings that find where a line passes the eye: to 1e-9 of a piece.
const HALVINGS: usize = 30;

/// Side of a face that a pixel sees: face and side in one number.
type FaceSide = u32;

/// Draws the mesh over a picture seen with that camera, with a legend below.
pub fn mesh_overlay(background: &Canvas, mesh: &Mesh, camera: &Camera) -> Canvas {
    let mut canvas = background.clone();
    let seen = seen_sides(mesh, camera);
    let scale = text_scale(canvas.height) as f64;

    // Edges of elements, each once for a side of a face.
    let mut edges: Vec<(FaceSide, VertexId, VertexId)> = Vec::new();
    for (k, corners) in mesh.elements.rows().enumerate() {
        let side = 2 * mesh.element_faces[k].0 + mesh.element_sides[k];
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            edges.push((side, a.min(b), a.max(b)));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    for &(side, a, b) in &edges {
        let ends = [a, b].map(|vertex| mesh.position(vertex));
        draw(&mut canvas, camera, &seen, |s| s == side, ends, (EDGE_WIDTH * scale, EDGE));
    }

    // Lines of low order over those of high order.
    for order in (0..ORDERS.len()).rev() {
        for line in mesh.lines.iter().filter(|line| (line.order as usize).min(ORDERS.len() - 1) == order) {
            let ends = [line.from, line.to].map(|vertex| mesh.position(vertex));
            draw(&mut canvas, camera, &seen, |s| s / 2 == line.face.0, ends, (1.2 * scale, ORDERS[order].0));
        }
    }
    with_legend(&canvas, mesh)
}

/// Side of a face that the middle of each pixel sees.
fn seen_sides(mesh: &Mesh, camera: &Camera) -> Vec<Option<FaceSide>> {
    let surface = VisibleSurface::of_mesh(mesh);
    let width = camera.size[0] as usize;
    (0..width * camera.size[1] as usize)
        .into_par_iter()
        .map(|k| match surface.seen(camera, (k % width) as f64 + 0.5, (k / width) as f64 + 0.5) {
            Seen::Surface(element, ..) => {
                Some(2 * mesh.element_face(element).0 + mesh.element_sides[element.index()])
            }
            _ => None,
        })
        .collect()
}

/// Draws a straight line of space where its face is seen.
fn draw(
    canvas: &mut Canvas,
    camera: &Camera,
    seen: &[Option<FaceSide>],
    on: impl Fn(FaceSide) -> bool,
    [from, to]: [DVec3; 2],
    (width, colour): (f64, [u8; 3]),
) {
    let size = camera.size.map(i64::from);
    let visible = |x: i64, y: i64| {
        let at = |x: i64, y: i64| {
            let inside = (0..size[0]).contains(&x) && (0..size[1]).contains(&y);
            inside.then(|| seen[(y * size[0] + x) as usize]).flatten()
        };
        (-1..=1).any(|dy| (-1..=1).any(|dx| at(x + dx, y + dy).is_some_and(&on)))
    };
    let place = |t: f64| camera.place_of(from.lerp(to, t)).map(|(place, _)| place);
    // What is straight and wholly before the eye needs no pieces, whose ends would cover pixels twice.
    let straight = !camera.wraps() && place(0.0).is_some() && place(1.0).is_some();
    let pieces = if straight { 1 } else { PIECES };
    for k in 0..pieces {
        let [start, end] = [k, k + 1].map(|k| f64::from(k) / f64::from(pieces));
        let piece = match (place(start), place(end)) {
            (Some(a), Some(b)) => Some([a, b]),
            (Some(a), None) => place(last_before(start, end, place)).map(|b| [a, b]),
            (None, Some(b)) => place(last_before(end, start, place)).map(|a| [a, b]),
            (None, None) => None,
        };
        // A panorama's line that leaves at one border and comes back at the other is two lines.
        let Some([a, b]) =
            piece.filter(|[a, b]| (a[0] - b[0]).abs() < 0.5 * size[0] as f64 || !camera.wraps())
        else {
            continue;
        };
        canvas.line([a, b], width, colour, visible);
    }
}

/// The last parameter from `good` on towards `bad` that has a place.
fn last_before(mut good: f64, mut bad: f64, place: impl Fn(f64) -> Option<[f64; 2]>) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if place(middle).is_some() {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// A strip below that says what the colours are, and how many of each there are.
fn with_legend(picture: &Canvas, mesh: &Mesh) -> Canvas {
    let scale = text_scale(picture.height);
    let (margin, line) = (4 * scale, text_height(scale));
    let mut entries = vec![([120; 3], format!("{} elements", mesh.element_count()))];
    for (order, (colour, name)) in ORDERS.iter().enumerate() {
        let count = mesh.lines.iter().filter(|l| (l.order as usize).min(ORDERS.len() - 1) == order).count();
        entries.push((*colour, format!("{count} {name}")));
    }
    let entry_width = |text: &str| line + margin + text_width(text, scale) + 2 * margin;
    // Rows of entries, as many as fit side by side.
    let (mut x, mut row, mut places) = (margin, 0, Vec::new());
    for (_, text) in &entries {
        if x > margin && x + entry_width(text) > picture.width as i64 {
            (x, row) = (margin, row + 1);
        }
        places.push((x, row));
        x += entry_width(text);
    }
    let right = places.iter().zip(&entries).map(|(&(x, _), (_, text))| x + entry_width(text)).max();
    let width = picture.width.max(right.unwrap_or(0) as usize);
    let top = picture.height as i64 + margin;
    let mut canvas = Canvas::new(width, (top + (row + 1) * (line + margin)) as usize, GROUND);
    canvas.paste(picture, 0, 0);
    for ((x, row), (colour, text)) in places.into_iter().zip(&entries) {
        let y = top + row * (line + margin);
        canvas.fill(x, y, 7 * scale, 7 * scale, *colour);
        canvas.text(text, x + line + margin / 2, y, scale);
    }
    canvas
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::Lens;
    use crate::test_scenes::{add_parallelogram, empty_mesh};
    use interchange::ids::FaceId;
    use interchange::mesh::Line;

    /// A square of 2 x 2 elements, half of it behind another one, with a line across.
    fn scene() -> (Mesh, Camera) {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 2, 0);
        add_parallelogram(&mut mesh, DVec3::new(0.1, -1.5, 0.5), 3.0 * DVec3::X, 3.0 * DVec3::Y, 1, 0);
        let (from, to) = (VertexId::new(3), VertexId::new(5));
        mesh.lines.push(Line { from, to, face: FaceId(0), order: 1, source: FaceId(1) });
        let eye = DVec3::new(0.0, 0.0, 5.0);
        let camera = Camera::new(eye, DVec3::ZERO, DVec3::Y, Lens::Orthographic(2.2), [110, 110]).unwrap();
        (mesh, camera)
    }

    #[test]
    fn lines_are_drawn_in_their_colour_and_hidden_behind_other_faces() {
        let (mesh, camera) = scene();
        let drawn = mesh_overlay(&Canvas::new(110, 110, [200; 3]), &mesh, &camera);
        let at = |x: usize, y: usize| drawn.pixels[y * drawn.width + x];
        // The line of order 1 runs along y = 0 from x = -1, pixel 5, to 1; from x = 0.1, pixel 60, it is hidden.
        let orange = |p: [u8; 3]| p[0] > 200 && p[2] < 150;
        assert!(orange(at(20, 54)) || orange(at(20, 55)), "{:?} {:?}", at(20, 54), at(20, 55));
        assert!((64..105).all(|x| at(x, 54) == [200; 3] && at(x, 55) == [200; 3]));
        // The edge between two elements at x = 0, and the square's own border at x = -1.
        assert!(at(54, 30)[0].min(at(55, 30)[0]) < 180 && at(4, 30)[0].min(at(5, 30)[0]) < 180);
        assert_eq!(at(30, 30), [200; 3]);
        assert!(drawn.height > 120, "the legend is below");
    }

    /// Edges that begin behind the eye are drawn as far as they are before it.
    #[test]
    fn edges_past_the_eye_are_cut() {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::new(-0.5, 0.0, -50.0), 100.0 * DVec3::Z, DVec3::X, 1, 0);
        let eye = DVec3::new(0.0, 1.0, 0.0);
        let camera =
            Camera::new(eye, DVec3::new(0.0, 0.0, 1.0), DVec3::Y, Lens::Vertical(90.0), [60, 60]).unwrap();
        let drawn = mesh_overlay(&Canvas::new(60, 60, [200; 3]), &mesh, &camera);
        // Straight below the eye, at the picture's bottom, the edges x = -0.5 and 0.5 lie half a unit off at distance 1.4.
        let dark = (0..60).filter(|&x| drawn.pixels[58 * drawn.width + x][0] < 180).count();
        assert!((2..=6).contains(&dark), "{dark}");
    }
}
