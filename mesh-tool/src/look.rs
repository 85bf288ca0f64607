//! `mesh-tool info --element` and `--group`: one element with its corners, or one group with its measures.

use geometry::polygon;
use interchange::counted::counted;
use interchange::error::{Error, Result, nearest_name};
use interchange::ids::{ElementId, GroupId};
use interchange::mesh::{FACE_EMITS, Mesh};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// What to look at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Look {
    /// An element, from 1.
    Element(u32),
    /// A group, by name.
    Group(String),
}

/// Tells what was asked for, for people or as JSON.
///
/// # Errors
/// The mesh cannot be read, or there is no such element or group.
pub fn describe(path: &Path, look: &Look, as_json: bool) -> Result<String> {
    let (mesh, _, _) = Mesh::read(path)?;
    match look {
        Look::Element(number) => element(path, &mesh, *number, as_json),
        Look::Group(name) => group(path, &mesh, name, as_json),
    }
}

fn element(path: &Path, mesh: &Mesh, number: u32, as_json: bool) -> Result<String> {
    let count = mesh.element_count();
    if !(1..=count).contains(&(number as usize)) {
        let message = format!("there is no element {number}: they count from 1 to {count}");
        return Err(Error::whole(path, message));
    }
    let id = ElementId(number - 1);
    let (face, corners) = (mesh.element_face(id), mesh.element_corners(id));
    let group = &mesh.groups[mesh.element_group(id).index()];
    let material = &mesh.materials[mesh.element_material(id).index()];
    let emits = mesh.face_flags[face.index()] & FACE_EMITS != 0;
    let side = mesh.element_sides[id.index()];
    let area = polygon::area(&corners);
    let longest = polygon::edges(&corners).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
    // Elements with a node in common touch it without a jump of light between.
    let nodes = mesh.element_nodes.row(id.index());
    let shares = |other: &ElementId| {
        *other != id && mesh.element_nodes.row(other.index()).iter().any(|node| nodes.contains(node))
    };
    let neighbours: Vec<u32> = mesh.element_ids().filter(shares).map(|other| other.0 + 1).collect();
    let places: Vec<[f64; 3]> = corners.iter().map(|corner| corner.to_array()).collect();
    if as_json {
        let data = json!({
            "kind": "element", "element": number, "group": group, "face": mesh.element_input(id) + 1, "material": material,
            "emits": emits, "side": side, "area": area, "longest_edge": longest, "corners": places,
            "neighbours": neighbours,
        });
        return Ok(format!("{data:#}\n"));
    }
    let mut text = String::new();
    // Writing to a string cannot fail.
    let back = if side == 1 { ", back" } else { "" };
    let _ = writeln!(text, "element    {number}: group {group}, face {}{back}", mesh.element_input(id) + 1);
    let _ = writeln!(text, "material   {material}{}", if emits { ", emits" } else { "" });
    let _ = writeln!(text, "area       {area:.6e}, longest edge {longest:.6e}");
    for [x, y, z] in places {
        let _ = writeln!(text, "corner     {x} {y} {z}");
    }
    let listed: Vec<String> = neighbours.iter().map(u32::to_string).collect();
    let _ = writeln!(text, "neighbours {} (share a node: no jump of light between)", listed.join(" "));
    Ok(text)
}

fn group(path: &Path, mesh: &Mesh, name: &str, as_json: bool) -> Result<String> {
    let Some(number) = mesh.groups.iter().position(|group| group == name) else {
        let near = nearest_name(name, mesh.groups.iter().map(String::as_str));
        let near = near.map_or_else(
            || format!("the groups are {}", mesh.groups.join(", ")),
            |near| format!("did you mean {near}?"),
        );
        return Err(Error::whole(path, format!("no group is named {name}; {near}")));
    };
    let of = |e: &ElementId| mesh.element_group(*e) == GroupId(number as u32);
    let elements: Vec<u32> = mesh.element_ids().filter(of).map(|e| e.0 + 1).collect();
    let areas = elements.iter().map(|&e| polygon::area(&mesh.element_corners(ElementId(e - 1))));
    let (mut least, mut largest, mut total) = (f64::INFINITY, 0.0f64, 0.0);
    areas.for_each(|area| (least, largest, total) = (least.min(area), largest.max(area), total + area));
    let in_group = |&(&of, _): &(&GroupId, &f64)| of == GroupId(number as u32);
    let hidden: f64 =
        mesh.face_groups.iter().zip(&mesh.hidden_areas).filter(in_group).map(|(_, area)| area).sum();
    let mut materials: Vec<&str> = elements
        .iter()
        .map(|&e| mesh.materials[mesh.element_material(ElementId(e - 1)).index()].as_str())
        .collect();
    materials.sort_unstable();
    materials.dedup();
    let mut faces: Vec<u32> = elements.iter().map(|&e| mesh.element_input(ElementId(e - 1)) + 1).collect();
    faces.sort_unstable();
    faces.dedup();
    if as_json {
        let data = json!({
            "kind": "group", "group": name, "elements": elements, "faces": faces, "materials": materials, "area": total, "hidden_area": hidden,
            "smallest_element": least.is_finite().then_some(least), "largest_element": largest,
        });
        return Ok(format!("{data:#}\n"));
    }
    let mut text = format!(
        "group      {name}: {} on {}\n",
        counted(elements.len(), "element", "elements"),
        counted(faces.len(), "face", "faces")
    );
    if !elements.is_empty() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "area       {total:.6e}, elements from {least:.6e} to {largest:.6e}");
        if hidden > 0.0 {
            let _ = writeln!(
                text,
                "hidden     {hidden:.6e} besides, dark and without elements; part of the group in means"
            );
        }
        let _ = writeln!(text, "materials  {}", materials.join(", "));
    }
    Ok(text)
}
