//! One row painted onto the scene: how well every element sees a given one.
//!
//! Painted is F(j -> i), the share of what leaves element j that arrives at the chosen element i: it does not depend on how
//! large j is, so that neighbours of different size have alike colours, where F(i -> j) would show the mesh.

use super::canvas::{Canvas, INK};
use super::scale::Scale;
use glam::DVec3;
use interchange::atomic_write::refuse_input;
use interchange::error::{Error, Result, meant_ending};
use interchange::font;
use interchange::foreign::{self, Field, Format, Surface};
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use std::path::Path;

/// Width and height of the scene's part of a picture.
const SIDE: usize = 900;
/// Space around it.
const MARGIN: usize = 16;
/// Width of the legend.
const LEGEND: usize = 90;
/// The chosen element.
const CHOSEN: [u8; 3] = [230, 30, 40];
/// Elements that do not see it.
const UNSEEN: [u8; 3] = [70; 3];
/// Light from the eye, so that planes are told apart: this part of a colour stays where the surface is seen from its edge.
const LEAST_SHADE: f64 = 0.75;

/// Direction to the eye where none is asked for: above, right, in front.
pub const FROM: [f64; 3] = [1.0, 1.0, 2.0];

/// Value of `--from`.
///
/// # Errors
/// What was expected.
pub fn parse_direction(text: &str) -> std::result::Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|x| x.trim().parse().ok()).collect();
    let found = <[f64; 3]>::try_from(numbers).ok();
    let usable = |d: &[f64; 3]| d.iter().all(|x| x.is_finite()) && d.iter().any(|x| *x != 0.0);
    found.filter(usable).ok_or_else(|| "expected three numbers, not all 0, such as 1,1,2".into())
}

/// What to paint.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// Mesh of the matrix.
    pub mesh: &'a Path,
    /// Element, from 1.
    pub element: u32,
    /// Direction from the scene to the eye, for a picture; not zero.
    pub from: [f64; 3],
}

/// Paints a row: `.png` shows it, and every format of geometry holds it as colours and as the field `F`.
///
/// # Errors
/// The files do not belong together, there is no such element, or the output cannot be written.
pub fn draw(paths: &[impl AsRef<Path>], request: &Request<'_>, output: &Path) -> Result<()> {
    refuse_input(output, paths.iter().map(AsRef::as_ref).chain([request.mesh]))?;
    let png = output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if !png && Format::of(output).is_none_or(|format| format == Format::Vs3) {
        return Err(Error::whole(
            output,
            format!(
                "the name must end in .png, .ply, .vtu, .glb, .obj or .rad, which says the format{}",
                meant_ending(output, ["png", "ply", "vtu", "glb", "obj", "rad"])
            ),
        ));
    }
    let (mesh, _, digest) = Mesh::read(request.mesh)?;
    let matrix = Matrix::open_all(paths)?;
    matrix.belongs_to(request.mesh, digest, mesh.element_count())?;
    let count = mesh.element_count();
    if !(1..=count).contains(&(request.element as usize)) {
        let message = format!("there is no element {}: they count from 1 to {count}", request.element);
        return Err(Error::whole(matrix.path(), message));
    }
    let painted = Painted::new(&matrix, &mesh, request.element as usize - 1)?;
    if png {
        return painted.picture(&mesh, DVec3::from_array(request.from)).write(output).map(|_| ());
    }
    foreign::write(output, &painted.surface(&mesh), None).map(|_| ())
}

struct Painted {
    element: usize,
    /// F(i -> j) and F(j -> i) for every element j.
    factors: [Vec<f64>; 2],
    colours: Vec<[u8; 3]>,
    scale: Scale,
}

impl Painted {
    fn new(matrix: &Matrix, mesh: &Mesh, element: usize) -> Result<Self> {
        let areas = matrix.areas()?;
        let mut factors = [vec![0.0; mesh.element_count()], vec![0.0; mesh.element_count()]];
        for entry in matrix.row(element)? {
            factors[0][entry.column] = entry.value / areas[element];
            factors[1][entry.column] = entry.value / areas[entry.column];
        }
        let scale = Scale::of(factors[1].iter().copied());
        let colour = |(j, &f): (usize, &f64)| match f {
            _ if j == element => CHOSEN,
            f if f > 0.0 => scale.colour(f),
            _ => UNSEEN,
        };
        let colours = factors[1].iter().enumerate().map(colour).collect();
        Ok(Self { element, factors, colours, scale })
    }

    /// The elements with points of their own, as each has one colour.
    fn surface(&self, mesh: &Mesh) -> Surface {
        let mut surface = Surface::of_mesh(mesh, None);
        let polygons: Vec<Vec<u32>> = surface.polygons.rows().map(<[u32]>::to_vec).collect();
        let shared = std::mem::take(&mut surface.points);
        let mut colours = Vec::new();
        let mut next = 0;
        surface.polygons = polygons
            .iter()
            .zip(&self.colours)
            .map(|(polygon, colour)| {
                surface.points.extend(polygon.iter().map(|&point| shared[point as usize]));
                colours.extend(polygon.iter().map(|_| colour.map(linear)));
                next += polygon.len() as u32;
                (next - polygon.len() as u32..next).collect()
            })
            .collect();
        surface.radiances = Some(self.colours.iter().map(|colour| colour.map(linear)).collect());
        surface.colours = Some(colours);
        surface.polygon_fields.push(Field::scalars("F", self.factors[0].clone()));
        surface.polygon_fields.push(Field::scalars("F_back", self.factors[1].clone()));
        surface
            .comments
            .push(format!("F: from element {} to each; F_back: from each to it", self.element + 1));
        surface.comments.push(format!("colours: F_back from 1e{} to 1e{}", self.scale.low, self.scale.high));
        surface
    }

    /// Orthographic, seen from a direction; what shows its back is not drawn, so that rooms are looked into.
    fn picture(&self, mesh: &Mesh, from: DVec3) -> Canvas {
        let view = from.normalize_or(DVec3::Z);
        let up = if view.y.abs() < 0.99 { DVec3::Y } else { DVec3::NEG_Z };
        let right = up.cross(view).normalize();
        let up = view.cross(right);
        let flat = |p: DVec3| DVec3::new(p.dot(right), p.dot(up), p.dot(view));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for element in mesh.element_ids() {
            for corner in mesh.element_corners(element) {
                (low, high) = (low.min(flat(corner)), high.max(flat(corner)));
            }
        }
        let extent = (high - low).truncate().max_element();
        let scale = if extent > 0.0 { SIDE as f64 / extent } else { 1.0 };
        let offset = 0.5 * (DVec3::splat(extent) - (high - low));
        // Columns to the right, rows down, depth towards the eye.
        let place = |p: DVec3| {
            let p = flat(p) - low + offset;
            DVec3::new(scale * p.x, SIDE as f64 - scale * p.y, p.z)
        };
        let mut canvas = Canvas::new(SIDE + LEGEND + 3 * MARGIN, SIDE + 3 * MARGIN);
        let mut depths = vec![f64::NEG_INFINITY; SIDE * SIDE];
        for element in mesh.element_ids() {
            let corners = mesh.element_corners(element);
            let cross: DVec3 = (1..corners.len() - 1)
                .map(|k| (corners[k] - corners[0]).cross(corners[k + 1] - corners[0]))
                .sum();
            let facing = cross.normalize_or_zero().dot(view);
            if facing <= 0.0 {
                continue;
            }
            let shade = LEAST_SHADE + (1.0 - LEAST_SHADE) * facing;
            let colour = self.colours[element.index()].map(|x| (f64::from(x) * shade).round() as u8);
            let places: Vec<DVec3> = corners.into_iter().map(place).collect();
            for k in 1..places.len() - 1 {
                triangle([places[0], places[k], places[k + 1]], |x, y, depth| {
                    if depth > depths[y * SIDE + x] {
                        depths[y * SIDE + x] = depth;
                        canvas.set(MARGIN + x, 2 * MARGIN + y, colour);
                    }
                });
            }
        }
        let title = format!("F(each -> element {}, red), dark grey: not seen", self.element + 1);
        canvas.text(MARGIN, MARGIN / 2, 1, &title);
        canvas.frame(MARGIN - 1, 2 * MARGIN - 1, SIDE + 2, SIDE + 2, INK);
        self.scale.draw(&mut canvas, SIDE + 2 * MARGIN, 2 * MARGIN + font::LINE, 300);
        canvas
    }
}

/// Calls `visit(x, y, depth)` for the pixels of the square whose centres lie in a triangle.
fn triangle(corners: [DVec3; 3], mut visit: impl FnMut(usize, usize, f64)) {
    let [a, b, c] = corners;
    let twice_area = (b - a).truncate().perp_dot((c - a).truncate());
    if twice_area == 0.0 {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let range = |from: f64, to: f64| from.floor().max(0.0) as usize..(to.ceil().max(0.0) as usize).min(SIDE);
    for y in range(low.y, high.y) {
        for x in range(low.x, high.x) {
            let p = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            // Shares of the three corners, by the areas opposite to them.
            let part = |q: DVec3, r: DVec3| (q.truncate() - p).perp_dot(r.truncate() - p) / twice_area;
            let (u, v, w) = (part(b, c), part(c, a), part(a, b));
            if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                visit(x, y, u * a.z + v * b.z + w * c.z);
            }
        }
    }
}

/// Linear value of an sRGB byte (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let x = f64::from(byte) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}
