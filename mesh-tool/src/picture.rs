//! `mesh-tool picture`: the elements of all planes, unfolded, seen from where they look, with the discontinuity lines
//! coloured by order: red where the value jumps, orange the slope, blue the curvature.

use crate::unfold::{Flat, Island, Motion, unfold};
use geometry::plane::{PLANARITY, Plane};
use geometry::polygon;
use glam::{DVec2, DVec3};
use interchange::error::meant_ending;
use interchange::ids::FaceId;
use interchange::mesh::Mesh;
use interchange::{Error, Result};
use std::fmt::Write as _;
use std::path::Path;

/// Width of the picture, pixels or units of the SVG.
const WIDTH: f64 = 1600.0;
/// Space around each island of planes.
const MARGIN: f64 = 12.0;
/// Colours: background, edges of elements, lines of order 0, 1, 2.
const COLOURS: [[u8; 3]; 5] =
    [[255, 255, 255], [170, 170, 170], [215, 25, 28], [253, 141, 20], [44, 90, 200]];
/// The picture is at most this many times as high as wide; islands are drawn smaller by steps until they fit.
const TALLEST: f64 = 1.25;
const SMALLER: f64 = 0.9;
/// Largest and smallest size of captions; a letter is about half as wide as high.
const LETTERS: [f64; 2] = [11.0, 2.0];
const LETTER_WIDTH: f64 = 0.55;
/// Normals of one plane agree to this, like the layers of meshing.
const SAME_DIRECTION: f64 = 1e-4;

/// A straight stroke.
#[derive(Debug, Clone, Copy)]
struct Stroke {
    ends: [DVec2; 2],
    colour: usize,
}

/// Elements and lines of one plane, in its own coordinates.
#[derive(Debug)]
struct Sheet {
    plane: Plane,
    size: f64,
    name: String,
    strokes: Vec<Stroke>,
    flat: Flat,
}

/// A drawing: strokes in a frame `WIDTH` wide, captions.
#[derive(Debug)]
pub struct Picture {
    strokes: Vec<Stroke>,
    captions: Vec<Caption>,
    height: f64,
}

/// The number and group of a plane, in its middle.
#[derive(Debug)]
struct Caption {
    middle: DVec2,
    size: f64,
    text: String,
}

impl Caption {
    fn within(low: DVec2, high: DVec2, text: String) -> Caption {
        let widest = (high.x - low.x) / (LETTER_WIDTH * text.chars().count() as f64);
        let size = widest.min(high.y - low.y).clamp(LETTERS[1], LETTERS[0]);
        Caption { middle: 0.5 * (low + high), size, text }
    }
}

/// Lower and upper corner of points.
fn bounds_of(points: impl Iterator<Item = DVec2>) -> [DVec2; 2] {
    points.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

fn bounds(island: &Island, sheets: &[Sheet]) -> [DVec2; 2] {
    let of = |(plane, motion): &(usize, Motion)| {
        let motion = *motion;
        sheets[*plane].flat.polygons.iter().flatten().map(move |&p| motion.of(p))
    };
    bounds_of(island.iter().flat_map(of))
}

/// Islands from left to right at one scale, a new row where the width is used up: scale, corner of each, height of all.
fn shelves(extents: &[DVec2], widest: f64) -> (f64, Vec<DVec2>, f64) {
    let mut scale = (WIDTH - 2.0 * MARGIN) / widest;
    loop {
        let (mut at, mut row, mut corners) = (DVec2::splat(MARGIN), 0.0f64, Vec::new());
        for extent in extents.iter().map(|&extent| scale * extent) {
            if at.x > MARGIN && at.x + extent.x + MARGIN > WIDTH {
                at = DVec2::new(MARGIN, at.y + row + MARGIN);
                row = 0.0;
            }
            corners.push(at);
            at.x += extent.x + MARGIN;
            row = row.max(extent.y);
        }
        let height = at.y + row + MARGIN;
        // Many islands need their margins at least.
        let least = 4.0 * MARGIN * MARGIN * extents.len() as f64 / WIDTH;
        if height <= (TALLEST * WIDTH).max(least) {
            return (scale, corners, height);
        }
        scale *= SMALLER;
    }
}

impl Picture {
    /// Draws the planes of a mesh, or only the one with number `only` (from 1, as the captions count).
    pub fn new(mesh: &Mesh, only: Option<usize>) -> Option<Picture> {
        let sheets = sheets(mesh);
        let islands: Vec<Island> = match only {
            Some(number) => vec![vec![(number.checked_sub(1).filter(|&k| k < sheets.len())?, Motion::NONE)]],
            None => unfold(&sheets.iter().map(|sheet| sheet.flat.clone()).collect::<Vec<_>>()),
        };
        let bounds: Vec<[DVec2; 2]> = islands.iter().map(|island| bounds(island, &sheets)).collect();
        let widest = bounds.iter().map(|[low, high]| (high - low).max_element()).fold(0.0, f64::max);
        if islands.is_empty() || widest <= 0.0 {
            return None;
        }
        let extents: Vec<DVec2> = bounds.iter().map(|[low, high]| high - low).collect();
        let (scale, corners, height) = shelves(&extents, widest);
        let mut picture = Picture { strokes: Vec::new(), captions: Vec::new(), height };
        for ((island, [low, high]), corner) in islands.iter().zip(bounds).zip(corners) {
            for (number, motion) in island {
                let sheet = &sheets[*number];
                let place = |p: DVec2| {
                    let p = motion.of(p);
                    corner + scale * DVec2::new(p.x - low.x, high.y - p.y)
                };
                let strokes = sheet.strokes.iter();
                picture.strokes.extend(strokes.map(|s| Stroke { ends: s.ends.map(place), colour: s.colour }));
                let text = format!("{} {}", number + 1, sheet.name);
                let [left, right] = bounds_of(sheet.flat.polygons.iter().flatten().map(|&p| place(p)));
                picture.captions.push(Caption::within(left, right, text));
            }
        }
        // Lines over edges.
        picture.strokes.sort_by_key(|stroke| if stroke.colour == 1 { 0 } else { 5 - stroke.colour });
        Some(picture)
    }

    /// As SVG.
    pub fn svg(&self) -> String {
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {0:.0}\" width=\"{WIDTH}\" height=\"{0:.0}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            self.height
        );
        for colour in [1, 4, 3, 2] {
            let [r, g, b] = COLOURS[colour];
            let width = if colour == 1 { 0.5 } else { 1.5 };
            let _ = writeln!(
                text,
                "<path fill=\"none\" stroke=\"rgb({r},{g},{b})\" stroke-width=\"{width}\" d=\""
            );
            for Stroke { ends: [a, b], .. } in self.strokes.iter().filter(|s| s.colour == colour) {
                let _ = writeln!(text, "M{:.2} {:.2}L{:.2} {:.2}", a.x, a.y, b.x, b.y);
            }
            text += "\"/>\n";
        }
        for Caption { middle, size, text: caption } in &self.captions {
            let safe = caption.replace('&', "&amp;").replace('<', "&lt;");
            let _ = writeln!(
                text,
                "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"{size:.1}\" font-family=\"sans-serif\" text-anchor=\"middle\" \
                 dominant-baseline=\"middle\">{safe}</text>",
                middle.x, middle.y
            );
        }
        text + "</svg>\n"
    }

    /// As RGB pixels, row by row, with width and height. Captions are in the SVG only.
    pub fn pixels(&self) -> (u32, u32, Vec<u8>) {
        let (width, height) = (WIDTH as u32, self.height.ceil() as u32);
        let mut pixels = vec![255u8; 3 * width as usize * height as usize];
        for Stroke { ends: [a, b], colour } in &self.strokes {
            let steps = (*b - *a).abs().max_element().ceil().max(1.0);
            for k in 0..=steps as usize {
                let p = a.lerp(*b, k as f64 / steps).floor();
                if p.x >= 0.0 && p.y >= 0.0 && p.x < WIDTH && p.y < f64::from(height) {
                    let at = 3 * (p.y as usize * width as usize + p.x as usize);
                    pixels[at..at + 3].copy_from_slice(&COLOURS[*colour]);
                }
            }
        }
        (width, height, pixels)
    }
}

fn sheets(mesh: &Mesh) -> Vec<Sheet> {
    let mut sheets: Vec<Sheet> = Vec::new();
    let mut sheet_of_face: Vec<[Option<usize>; 2]> = vec![[None; 2]; mesh.face_count()];
    for element in mesh.element_ids() {
        let (face, side) = (mesh.element_face(element), mesh.element_sides[element.index()] as usize);
        let corners = mesh.element_corners(element);
        let sheet = *sheet_of_face[face.index()][side]
            .get_or_insert_with(|| sheet_for(mesh, face, side, &mut sheets));
        let flat: Vec<DVec2> = corners.iter().map(|&p| sheets[sheet].flatten(p)).collect();
        for (k, &a) in flat.iter().enumerate() {
            sheets[sheet].stroke(a, flat[(k + 1) % flat.len()], 1);
        }
        sheets[sheet].flat.polygons.push(flat);
        sheets[sheet].flat.vertices.push(mesh.elements.row(element.index()).iter().map(|v| v.0).collect());
    }
    for line in &mesh.lines {
        let ends = [line.from, line.to].map(|v| mesh.position(v));
        for sheet in sheet_of_face[line.face.index()].into_iter().flatten() {
            let [a, b] = ends.map(|p| sheets[sheet].flatten(p));
            sheets[sheet].stroke(a, b, 2 + line.order as usize);
        }
    }
    sheets
}

/// The sheet of the plane of a face side, a new one where there is none yet.
fn sheet_for(mesh: &Mesh, face: FaceId, side: usize, sheets: &mut Vec<Sheet>) -> usize {
    let corners = mesh.face_corners(face);
    let size = polygon::diameter(&corners);
    let front = Plane::of_polygon(&corners).unwrap_or(Plane { normal: DVec3::Z, origin: DVec3::ZERO });
    let plane = if side == 0 { front } else { front.flipped() };
    let same = |sheet: &Sheet| {
        sheet.plane.normal.distance(plane.normal) <= SAME_DIRECTION
            && corners.iter().all(|&c| sheet.plane.distance(c).abs() <= 4.0 * PLANARITY * (size + sheet.size))
    };
    if let Some(known) = sheets.iter().position(same) {
        return known;
    }
    let name = mesh.groups[mesh.face_groups[face.index()].index()].clone();
    sheets.push(Sheet { plane, size, name, strokes: Vec::new(), flat: Flat::default() });
    sheets.len() - 1
}

impl Sheet {
    fn flatten(&self, point: DVec3) -> DVec2 {
        // Upright where the plane is: the second axis points up, or away where the plane is level.
        let normal = self.plane.normal;
        let up = if normal.y.abs() < 0.9 { DVec3::Y } else { DVec3::NEG_Z };
        let x = up.cross(normal).normalize();
        let offset = point - self.plane.origin;
        DVec2::new(offset.dot(x), offset.dot(normal.cross(x)))
    }

    fn stroke(&mut self, a: DVec2, b: DVec2, colour: usize) {
        self.strokes.push(Stroke { ends: [a, b], colour });
    }
}

/// Draws the mesh at `path` to an `.svg` or `.png`.
pub fn draw(path: &Path, output: &Path, only: Option<usize>) -> Result<()> {
    interchange::atomic_write::refuse_input(output, [path])?;
    let (mesh, _, _) = Mesh::read(path)?;
    let picture = Picture::new(&mesh, only).ok_or_else(|| {
        Error::whole(path, "there is no plane of this number; mesh-tool picture without --plane numbers them")
    })?;
    let ending = output.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let bytes = match ending.to_ascii_lowercase().as_str() {
        "svg" => picture.svg().into_bytes(),
        "png" => {
            let (width, height, pixels) = picture.pixels();
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, width, height);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels));
            written
                .map_err(|error| Error::whole(output, format!("the picture cannot be encoded: {error}")))?;
            bytes
        }
        _ => {
            return Err({
                let meant = meant_ending(output, ["svg", "png"]);
                Error::whole(output, format!("expected a name ending in .svg or .png{meant}"))
            });
        }
    };
    interchange::atomic_write::write_bytes(output, &bytes).map(|_| ())
}
