//! What the page's 3-D view knows: convex polygons with their values as little-endian arrays in base64, and a small JSON
//! record with names, camera and scales. Numbers are f32: seven digits, more than the page shows.

use super::input::Input;
use crate::camera::{Camera, Projection};
use crate::colour_scale::{Scale, colour, label};
use crate::picture::luminance;
use crate::tone::automatic_factor;
use glam::DVec3;
use interchange::foreign::{Surface, base64};
use interchange::ids::FaceId;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;

/// Beyond this the view shows whole faces with their mean values: 24 MB of page, and what a telephone still turns.
pub const MOST_ELEMENTS: usize = 250_000;
/// Share of the area that is no brighter than the white of the view: lamps are a few percent of a room.
const SHARE_BELOW_WHITE: f64 = 0.98;
/// Labels on a scale.
const MARKS: usize = 6;
/// Steps of the table of colours.
const COLOURS: u32 = 256;

/// Of one side of a face: the sums of A B, of A H and of A.
type Sums = ([f64; 3], [f64; 3], f64);

/// What is drawn.
#[derive(Debug)]
pub struct Drawn {
    surface: Surface,
    /// Element of each polygon, from 1; empty where polygons are pieces of faces.
    elements: Vec<u32>,
    faces: Vec<u32>,
    areas: Vec<f64>,
    radiosity: Vec<[f64; 3]>,
    irradiance: Vec<[f64; 3]>,
    /// Half the distance between the bounds of each radiosity; may be infinite.
    errors: Option<Vec<[f64; 3]>>,
}

impl Drawn {
    /// The elements, or where there are more than `most` of them the convex pieces of the faces with area-weighted means.
    pub fn new(input: &Input, most: usize) -> Self {
        if input.mesh.element_count() <= most { Self::elements(input) } else { Self::faces(input) }
    }

    /// Whether each polygon is an element.
    pub fn is_by_element(&self) -> bool {
        !self.elements.is_empty()
    }

    /// Whether errors of the elements are known.
    pub fn has_errors(&self) -> bool {
        self.errors.is_some()
    }

    fn elements(input: &Input) -> Self {
        let mesh = &input.mesh;
        Self {
            surface: Surface::of_mesh(mesh, None),
            elements: (1..=mesh.element_count() as u32).collect(),
            faces: mesh.element_ids().map(|e| mesh.element_input(e) + 1).collect(),
            areas: input.areas.clone(),
            radiosity: input.solution.radiosity.clone(),
            irradiance: input.solution.irradiance.clone(),
            errors: input.half_bounds.clone(),
        }
    }

    fn faces(input: &Input) -> Self {
        let mesh = &input.mesh;
        // Sums over the elements of each side of each face.
        let mut sums: BTreeMap<(u32, u32), Sums> = BTreeMap::new();
        for element in mesh.element_ids() {
            let (i, side) = (element.index(), mesh.element_sides[element.index()]);
            let sum = sums.entry((mesh.element_face(element).0, side)).or_default();
            let area = input.areas[i];
            for c in 0..3 {
                sum.0[c] += area * input.solution.radiosity[i][c];
                sum.1[c] += area * input.solution.irradiance[i][c];
            }
            sum.2 += area;
        }
        let mut surface = Surface { points: mesh.vertices.clone(), ..Surface::default() };
        let (mut faces, mut areas, mut radiosity, mut irradiance) = (vec![], vec![], vec![], vec![]);
        for (piece, &FaceId(face)) in mesh.occluder_faces.iter().enumerate() {
            let area = geometry::polygon::area(&mesh.occluder_corners(piece));
            for (&(_, side), (b, h, weight)) in sums.range((face, 0)..=(face, 1)) {
                let corners = mesh.occluders.row(piece).iter().map(|v| v.0);
                match side {
                    0 => surface.polygons.push(corners),
                    _ => surface.polygons.push(corners.rev()),
                }
                surface.polygon_groups.push(mesh.face_groups[face as usize].0);
                surface.polygon_materials.push(mesh.face_materials[face as usize].0);
                faces.push(mesh.face_inputs[face as usize] + 1);
                areas.push(area);
                radiosity.push(b.map(|x| x / weight));
                irradiance.push(h.map(|x| x / weight));
            }
        }
        Self { surface, elements: Vec::new(), faces, areas, radiosity, irradiance, errors: None }
    }

    /// The arrays and the record as `<script>` elements that hold data.
    pub fn scripts(&self, input: &Input) -> String {
        let (low, high) = input.bounds();
        let centre = 0.5 * (low + high);
        let places: Vec<f32> = self
            .surface
            .points
            .iter()
            .flat_map(|&p| (DVec3::from_array(p) - centre).to_array())
            .map(|x| x as f32)
            .collect();
        let single = |values: &[[f64; 3]]| values.iter().flatten().map(|&x| x as f32).collect::<Vec<f32>>();
        let areas: Vec<f32> = self.areas.iter().map(|&x| x as f32).collect();
        let mut html = String::new();
        let mut add = |name: &str, text: String| {
            let _ = writeln!(html, "<script type=\"text/plain\" id=\"data-{name}\">{text}</script>");
        };
        add("points", packed(&places, f32::to_le_bytes));
        add("starts", packed(self.surface.polygons.starts(), u32::to_le_bytes));
        add("corners", packed(self.surface.polygons.values(), u32::to_le_bytes));
        add("elements", packed(&self.elements, u32::to_le_bytes));
        add("faces", packed(&self.faces, u32::to_le_bytes));
        add("groups", packed(&self.surface.polygon_groups, u32::to_le_bytes));
        add("materials", packed(&self.surface.polygon_materials, u32::to_le_bytes));
        add("areas", packed(&areas, f32::to_le_bytes));
        add("radiosity", packed(&single(&self.radiosity), f32::to_le_bytes));
        add("irradiance", packed(&single(&self.irradiance), f32::to_le_bytes));
        if let Some(errors) = &self.errors {
            add("errors", packed(&single(errors), f32::to_le_bytes));
        }
        let record = self.record(input, centre, (high - low).length() / 2.0).to_string();
        // Inside a script only "</script" and "<!--" could end it: no "<" is left.
        let record = record.replace('<', "\\u003c");
        let _ = writeln!(html, "<script type=\"application/json\" id=\"data-record\">{record}</script>");
        html
    }

    fn record(&self, input: &Input, centre: DVec3, radius: f64) -> Value {
        let radiances: Vec<[f64; 3]> = self.radiosity.iter().map(|b| b.map(|x| x / PI)).collect();
        let brightness = radiances.iter().map(|&l| luminance(l)).zip(self.areas.iter().copied());
        let irradiance: Vec<f64> = self.irradiance.iter().map(|&h| luminance(h)).collect();
        let mut paints = vec![paint("irradiance", "irradiance H, W m⁻²", &irradiance)];
        if let Some(errors) = &self.errors {
            let errors: Vec<f64> = errors.iter().map(|&e| luminance(e)).collect();
            paints.push(paint("errors", "bound on the error of B, ± W m⁻²", &errors));
        }
        let weights: [f64; 3] =
            std::array::from_fn(|c| luminance(std::array::from_fn(|k| f64::from(u8::from(k == c)))));
        json!({
            "centre": centre.to_array(),
            "radius": radius,
            "unit": input.unit,
            "efficacy": input.efficacy,
            "gain": automatic_factor(brightness).unwrap_or(0.0),
            "white": Surface::white(&radiances, &self.areas, SHARE_BELOW_WHITE),
            "luminance": weights,
            "groups": input.mesh.groups,
            "materials": input.mesh.materials,
            "colours": (0..COLOURS).map(|k| colour(f64::from(k) / f64::from(COLOURS - 1))).collect::<Vec<_>>(),
            "paints": paints,
            "camera": camera(&input.camera, centre),
        })
    }
}

/// A quantity shown in false colours: its name, its title and its scale.
fn paint(name: &str, title: &str, values: &[f64]) -> Value {
    let scale = Scale::fitting(values, false);
    let beyond = values.iter().any(|&v| v > scale.high);
    let marks: Vec<Value> = scale
        .marks(MARKS)
        .into_iter()
        .map(|mark| {
            let more = if beyond && mark == scale.high { "+" } else { "" };
            json!([scale.part(mark), format!("{}{more}", label(mark))])
        })
        .collect();
    json!({ "name": name, "title": title, "low": scale.low, "high": scale.high, "marks": marks })
}

/// Where the view begins: the picture's own camera, in coordinates from the middle of the scene.
fn camera(camera: &Camera, centre: DVec3) -> Value {
    let half_height = match camera.projection {
        Projection::Perspective => Some(camera.half[1]),
        Projection::Orthographic | Projection::Panorama => None,
    };
    json!({
        "eye": (camera.eye - centre).to_array(),
        "forward": camera.forward.to_array(),
        "up": camera.up.to_array(),
        "half_height": half_height,
    })
}

fn packed<T: Copy, const N: usize>(values: &[T], bytes: impl Fn(T) -> [u8; N]) -> String {
    base64::encode(&values.iter().flat_map(|&value| bytes(value)).collect::<Vec<u8>>())
}
