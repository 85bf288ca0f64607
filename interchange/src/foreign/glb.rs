//! glTF 2.0 in one binary file (`.glb`): a node with a mesh per group, a primitive per material, polygons as triangles.
//!
//! With colours the surface shows itself (`COLOR_0`, linear, and `KHR_materials_unlit`), and fields of the points go along
//! as attributes whose names begin with an underscore, as the specification asks of what it does not define. Without, each
//! material keeps its diffuse reflectance and emission (`KHR_materials_emissive_strength`). Coordinates stay as they are;
//! glTF takes them for metres with Y upwards.

use super::{Field, Surface, Values};
use crate::atomic_write::{self, Outcome};
use crate::error::{Error, Result};
use crate::materials::Material;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Codes of the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;

/// Writes a surface; an identical file is left alone.
///
/// # Errors
/// The file cannot be written, or would be longer than the 4 GiB that the format can hold.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    let mut file = Glb::default();
    let (mut nodes, mut meshes) = (Vec::new(), Vec::new());
    for (name, primitives) in parts(surface) {
        let primitives: Vec<Value> = primitives
            .iter()
            .map(|(&material, polygons)| file.primitive(surface, material, polygons))
            .collect();
        nodes.push(json!({ "name": name, "mesh": meshes.len() }));
        meshes.push(json!({ "name": name, "primitives": primitives }));
    }
    let lit = surface.colours.is_none();
    let materials: Vec<Value> = match lit {
        true => surface.materials.iter().map(|(name, material)| lit_material(name, material)).collect(),
        false => vec![json!({
            "name": "radiosity", "doubleSided": true, "extensions": { "KHR_materials_unlit": {} },
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        })],
    };
    let used = match lit {
        false => vec!["KHR_materials_unlit"],
        true if surface.materials.iter().any(|(_, m)| m.emits()) => vec!["KHR_materials_emissive_strength"],
        true => Vec::new(),
    };
    let mut document = json!({
        "asset": { "version": "2.0", "generator": "radiosity", "extras": { "comments": surface.comments } },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{ "byteLength": file.bytes.len() }],
    });
    if !used.is_empty() {
        document["extensionsUsed"] = json!(used);
    }
    let mut text = document.to_string();
    // Chunks end at multiples of four: text with spaces, numbers with zeros (they are all of four bytes).
    text.extend(std::iter::repeat_n(' ', text.len().next_multiple_of(4) - text.len()));
    let length = 12 + 8 + text.len() + 8 + file.bytes.len();
    let whole = u32::try_from(length)
        .map_err(|_| Error::whole(path, "glTF holds 4 GiB at most; export a part, or as .vtu or .ply"))?;
    atomic_write::write(path, |out| {
        out.write_all(b"glTF")?;
        for word in [2, whole, text.len() as u32, JSON_CHUNK] {
            out.write_all(&u32::to_le_bytes(word))?;
        }
        out.write_all(text.as_bytes())?;
        out.write_all(&(file.bytes.len() as u32).to_le_bytes())?;
        out.write_all(&BINARY_CHUNK.to_le_bytes())?;
        out.write_all(&file.bytes)
    })
}

/// Polygons by material, by group; groups without polygons are left out. With colours there is one material.
fn parts(surface: &Surface) -> Vec<(&str, BTreeMap<u32, Vec<usize>>)> {
    let mut parts: Vec<(&str, BTreeMap<u32, Vec<usize>>)> =
        surface.groups.iter().map(|name| (name.as_str(), BTreeMap::new())).collect();
    for polygon in 0..surface.polygons.len() {
        let material = if surface.colours.is_some() { 0 } else { surface.polygon_materials[polygon] };
        let (_, primitives) = &mut parts[surface.polygon_groups[polygon] as usize];
        primitives.entry(material).or_default().push(polygon);
    }
    parts.retain(|(_, primitives)| !primitives.is_empty());
    parts
}

fn lit_material(name: &str, material: &Material) -> Value {
    let [r, g, b] = material.diffuse;
    let strongest = material.radiance.iter().copied().fold(0.0, f64::max);
    let mut value = json!({
        "name": name,
        "doubleSided": material.is_two_sided(),
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 },
    });
    if material.emits() {
        value["emissiveFactor"] = json!(material.radiance.map(|x| x / strongest));
        value["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strongest } });
    }
    value
}

/// What is written so far.
#[derive(Default)]
struct Glb {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Glb {
    fn primitive(&mut self, surface: &Surface, material: u32, polygons: &[usize]) -> Value {
        // Only the points that are used, numbered anew.
        let mut number_of_point = BTreeMap::new();
        let mut points: Vec<u32> = Vec::new();
        let mut corners: Vec<u32> = Vec::new();
        for triangle in polygons.iter().flat_map(|&polygon| surface.triangles(polygon)) {
            corners.extend(triangle.map(|point| {
                *number_of_point.entry(point).or_insert_with(|| {
                    points.push(point);
                    points.len() as u32 - 1
                })
            }));
        }
        let places: Vec<f32> =
            points.iter().flat_map(|&p| surface.points[p as usize].map(|x| x as f32)).collect();
        let mut attributes = json!({ "POSITION": self.floats(&places, 3) });
        // Readers take the box of a primitive from here.
        let last = self.accessors.len() - 1;
        let bound = |least: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..3).map(|c| places.iter().skip(c).step_by(3).copied().fold(least, pick)).collect()
        };
        self.accessors[last]["min"] = json!(bound(f32::INFINITY, f32::min));
        self.accessors[last]["max"] = json!(bound(f32::NEG_INFINITY, f32::max));
        if let Some(colours) = &surface.colours {
            let colours: Vec<f32> =
                points.iter().flat_map(|&p| colours[p as usize].map(|x| x as f32)).collect();
            attributes["COLOR_0"] = json!(self.floats(&colours, 3));
        }
        for field in &surface.point_fields {
            let name = format!("_{}", field.name.to_uppercase());
            attributes[name] = json!(self.floats(&values(field, &points), field.components));
        }
        let indices = self.numbers(&corners);
        json!({ "attributes": attributes, "indices": indices, "material": material, "mode": 4 })
    }

    fn floats(&mut self, values: &[f32], components: usize) -> usize {
        let kind = if components == 3 { "VEC3" } else { "SCALAR" };
        self.append(bytemuck::cast_slice(values), ARRAY_BUFFER, FLOAT, kind, values.len() / components)
    }

    fn numbers(&mut self, values: &[u32]) -> usize {
        self.append(bytemuck::cast_slice(values), ELEMENT_ARRAY_BUFFER, UNSIGNED_INT, "SCALAR", values.len())
    }

    fn append(&mut self, bytes: &[u8], target: u32, component: u32, kind: &str, count: usize) -> usize {
        let view = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(), "target": target,
        });
        self.bytes.extend_from_slice(bytes);
        self.accessors.push(json!({
            "bufferView": self.views.len(), "componentType": component, "count": count, "type": kind,
        }));
        self.views.push(view);
        self.accessors.len() - 1
    }
}

/// A field at some of the points, as glTF can hold it.
fn values(field: &Field, points: &[u32]) -> Vec<f32> {
    let of = |k: usize| match &field.values {
        Values::F64(all) => all[k] as f32,
        Values::U32(all) => all[k] as f32,
    };
    let components = field.components;
    points.iter().flat_map(|&p| (0..components).map(move |c| of(p as usize * components + c))).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::foreign::surface::tests::two_polygons;

    fn written(surface: &Surface) -> (Value, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.glb");
        write(&path, surface).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let text = word(12);
        assert_eq!((&bytes[16..20], text % 4), (&b"JSON"[..], 0));
        assert_eq!((&bytes[24 + text..28 + text], word(20 + text) + 28 + text), (&b"BIN\0"[..], bytes.len()));
        (serde_json::from_slice(&bytes[20..20 + text]).unwrap(), bytes[28 + text..].to_vec())
    }

    #[test]
    fn groups_are_nodes_with_their_own_points() {
        let mut surface = two_polygons();
        surface.colours = Some(vec![[0.25; 3]; 5]);
        let (document, bytes) = written(&surface);
        assert_eq!(document["nodes"][1]["name"], "flap");
        assert_eq!(document["extensionsUsed"], json!(["KHR_materials_unlit"]));
        let primitive = &document["meshes"][1]["primitives"][0];
        let accessor = &document["accessors"][primitive["attributes"]["POSITION"].as_u64().unwrap() as usize];
        assert_eq!((accessor["count"].as_u64(), accessor["max"][0].as_f64()), (Some(3), Some(1.0)));
        let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let at = view["byteOffset"].as_u64().unwrap() as usize;
        // The triangle 1, 0, 4: its third point is 4.
        let float = |k: usize| f32::from_le_bytes(bytes[at + 4 * k..][..4].try_into().unwrap());
        assert_eq!((float(0), float(6), float(8)), (1.0, 0.5, 1.0 / 3.0));
        assert!(primitive["attributes"]["_HEIGHT"].is_u64() && primitive["attributes"]["COLOR_0"].is_u64());
        assert_eq!(document["buffers"][0]["byteLength"], bytes.len());
    }

    #[test]
    fn without_colours_materials_are_kept() {
        let (document, _) = written(&two_polygons());
        assert_eq!(
            document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"],
            json!([0.5, 0.25, 0.125, 1.0])
        );
        assert_eq!(
            document["materials"][1]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"],
            3.0
        );
        assert_eq!(document["meshes"][1]["primitives"][0]["material"], 1);
    }
}
