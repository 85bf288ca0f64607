//! `mesh-tool info`: what is in a mesh or a material table, on a page a person reads in ten seconds, or as JSON.

use crate::quality::{Quality, smallest_angle};
use crate::sheets;
use geometry::polygon;
use glam::DVec3;
use interchange::Result;
use interchange::counted::counted;
use interchange::digest::Digest;
use interchange::ids::GroupId;
use interchange::materials::MaterialTable;
use interchange::mesh::{FACE_EMITS, Mesh};
use interchange::provenance::Provenance;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

/// Describes the file at `path`.
pub fn describe(path: &Path, as_json: bool) -> Result<String> {
    if is_material_table(path) {
        let (table, provenance, digest) = MaterialTable::read(path)?;
        Ok(if as_json {
            materials_json(&table, &provenance, digest)
        } else {
            materials_page(path, &table, &provenance, digest)
        })
    } else {
        let (mesh, provenance, digest) = Mesh::read(path)?;
        Ok(if as_json {
            mesh_json(&mesh, &provenance, digest)
        } else {
            mesh_page(path, &mesh, &provenance, digest)
        })
    }
}

/// Whether a file is a material table, by its magic; whatever is neither that nor a mesh is refused by the mesh reader, which
/// names what it found.
pub fn is_material_table(path: &Path) -> bool {
    let mut magic = [0; 4];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut magic)).is_ok()
        && &magic[1..] == b"MAT"
}

/// Elements, area and material of one group.
struct Group<'a> {
    name: &'a str,
    faces: usize,
    elements: usize,
    area: f64,
    materials: Vec<&'a str>,
}

fn groups(mesh: &Mesh) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = mesh
        .groups
        .iter()
        .map(|name| Group { name, faces: 0, elements: 0, area: 0.0, materials: Vec::new() })
        .collect();
    for (GroupId(group), material) in mesh.face_groups.iter().zip(&mesh.face_materials) {
        let group = &mut groups[*group as usize];
        let name = mesh.materials[material.index()].as_str();
        group.faces += 1;
        if !group.materials.contains(&name) {
            group.materials.push(name);
        }
    }
    for element in mesh.element_ids() {
        let group = &mut groups[mesh.element_group(element).index()];
        group.elements += 1;
        group.area += polygon::area(&mesh.element_corners(element));
    }
    groups
}

fn lines_by_order(mesh: &Mesh) -> [usize; 3] {
    [0, 1, 2].map(|order| mesh.lines.iter().filter(|line| line.order == order).count())
}

/// How many elements have their smallest angle in each range of degrees.
fn angle_histogram(mesh: &Mesh) -> Vec<(String, usize)> {
    let angle = |e| smallest_angle(&mesh.element_corners(e)).0.to_degrees();
    let angles: Vec<f64> = mesh.element_ids().map(angle).collect();
    let ends = [0.0, 5.0, 15.0, 25.0, 35.0, 45.0, 60.000_001, 180.0];
    let count = |low: f64, high: f64| angles.iter().filter(|&&a| a >= low && a < high).count();
    let counts = ends.windows(2).map(|w| (format!("{:.0}-{:.0}", w[0], w[1]), count(w[0], w[1])));
    counts.filter(|(_, count)| *count > 0).collect()
}

/// How many elements have their longest edge in each power of two of the extent.
fn size_histogram(mesh: &Mesh) -> Vec<(String, usize)> {
    let (low, high) = bounds(mesh);
    let extent = DVec3::from_array(low).distance(DVec3::from_array(high));
    let mut counts = std::collections::BTreeMap::new();
    for element in mesh.element_ids() {
        let corners = mesh.element_corners(element);
        let longest = polygon::edges(&corners).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        *counts.entry((longest / extent).log2().floor().max(-40.0) as i32).or_insert(0) += 1;
    }
    counts.into_iter().rev().map(|(power, count)| (format!("2^{power}"), count)).collect()
}

/// What the report beside the mesh says was repaired.
fn repairs(path: &Path) -> Option<String> {
    let report = std::fs::read(interchange::report::Report::path_for(path)).ok()?;
    let report: Value = serde_json::from_slice(&report).ok()?;
    let counters = report.get("counters")?.as_object()?;
    let parts: Vec<String> = REPAIRS
        .iter()
        .filter_map(|&name| Some((name, counters.get(name)?.as_u64()?)))
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    Some(if parts.is_empty() { "none".into() } else { parts.join(", ") })
}

/// Counters of the report that count repairs.
const REPAIRS: [&str; 9] = [
    "welded vertices",
    "dropped zero area",
    "dropped duplicates",
    "turned over",
    "non-planar faces cut",
    "overlapping faces cut",
    "crossing faces cut",
    "hidden parts",
    "faces merged into regions",
];

fn emitter_count(mesh: &Mesh) -> usize {
    mesh.element_ids().filter(|&e| mesh.face_flags[mesh.element_face(e).index()] & FACE_EMITS != 0).count()
}

/// Lower and upper corner of the vertices.
fn bounds(mesh: &Mesh) -> ([f64; 3], [f64; 3]) {
    let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
    let (low, high) = sheets::bounds(&positions);
    (low.to_array(), high.to_array())
}

fn origin_lines(page: &mut String, provenance: &Provenance, digest: Digest) {
    let flags = if provenance.flags.is_empty() { "no flags".into() } else { provenance.flags.join(" ") };
    let _ = writeln!(page, "made by    {} {}, {flags}", provenance.tool, provenance.version);
    for input in &provenance.inputs {
        let _ = writeln!(page, "from       {} {}", input.role, input.digest.short());
    }
    let _ = writeln!(page, "identity   {}", digest.short());
}

fn mesh_page(path: &Path, mesh: &Mesh, provenance: &Provenance, digest: Digest) -> String {
    let mut page = String::new();
    let quality = Quality::of(mesh);
    let six = mesh.element_nodes.rows().zip(mesh.elements.rows()).all(|(n, c)| n.len() == 2 * c.len());
    let (low, high) = bounds(mesh);
    let _ = writeln!(page, "{}: mesh", path.display());
    origin_lines(&mut page, provenance, digest);
    let _ = writeln!(
        page,
        "elements   {} ({} emit), {}",
        mesh.element_count(),
        emitter_count(mesh),
        if six { "six-node triangles" } else { "faces as given" }
    );
    let _ = writeln!(page, "nodes      {} at {} vertices", mesh.node_vertices.len(), mesh.vertices.len());
    let _ = writeln!(
        page,
        "faces      {} of {} in the scene, {} light",
        mesh.face_count(),
        mesh.input_face_count,
        counted(mesh.occluders.len(), "convex piece blocks", "convex pieces block")
    );
    let [value, slope, curvature] = lines_by_order(mesh);
    let _ = writeln!(
        page,
        "lines      {value} edges where light jumps in value (D0), {slope} in slope (D1), {curvature} in curvature (D2)"
    );
    let _ = writeln!(
        page,
        "clusters   {}, {}",
        mesh.clusters.len(),
        counted(mesh.clusters.iter().filter(|cluster| cluster.is_leaf()).count(), "leaf", "leaves")
    );
    let _ = writeln!(page, "extent     {low:?} to {high:?}");
    let _ = writeln!(
        page,
        "area       {:.6e} of elements, {:.6e} of faces",
        quality.element_area, quality.face_area
    );
    let _ = writeln!(
        page,
        "shape      longest edge {:.4e}, smallest angle {:.1} deg (median {:.1})",
        quality.longest_edge, quality.smallest_angle_deg, quality.median_smallest_angle_deg
    );
    let histogram = |title: &str, counts: &[(String, usize)]| {
        let parts: Vec<String> = counts.iter().map(|(range, count)| format!("{range}: {count}")).collect();
        format!("{title}{}\n", parts.join(", "))
    };
    page += &histogram("angles     smallest, degrees: ", &angle_histogram(mesh));
    page += &poor(
        "narrow",
        quality.narrow,
        ["element below 25 degrees", "elements below 25 degrees"],
        &[
            (quality.narrow_at_given_angles, "where lines or borders meet so"),
            (quality.narrow_in_strips, "in strips between them"),
            (quality.narrow_freely(), "elsewhere"),
        ],
    );
    page += &poor(
        "uneven",
        quality.uneven,
        [
            "pair of neighbours differs in size by more than 2",
            "pairs of neighbours differ in size by more than 2",
        ],
        &[
            (quality.uneven_in_strips, "in strips between lines or borders"),
            (quality.uneven - quality.uneven_in_strips, "elsewhere"),
        ],
    );
    page += &histogram("sizes      longest edge, parts of the extent: ", &size_histogram(mesh));
    let hidden: f64 = mesh.hidden_areas.iter().sum();
    if hidden > 0.0 {
        let _ = writeln!(page, "hidden     {hidden:.6e} of area without elements");
    }
    if let Some(repairs) = repairs(path) {
        let _ = writeln!(page, "repairs    {repairs}");
    }
    let groups = groups(mesh);
    let width = groups.iter().map(|g| g.name.chars().count()).max().unwrap_or(5).clamp(5, 40);
    let _ = writeln!(page, "\n{:<width$}  faces  elements          area  materials", "group");
    const SHOWN: usize = 40;
    for group in groups.iter().take(SHOWN) {
        let _ = writeln!(
            page,
            "{:<width$}  {:>5}  {:>8}  {:>12.5e}  {}",
            group.name,
            group.faces,
            group.elements,
            group.area,
            group.materials.join(" ")
        );
    }
    if groups.len() > SHOWN {
        let _ = writeln!(
            page,
            "... and {} more (--json lists all)",
            counted(groups.len() - SHOWN, "group", "groups")
        );
    }
    page
}

fn materials_page(path: &Path, table: &MaterialTable, provenance: &Provenance, digest: Digest) -> String {
    let mut page = format!("{}: material table\n", path.display());
    origin_lines(&mut page, provenance, digest);
    let width = table.names.iter().map(|name| name.chars().count()).max().unwrap_or(8).clamp(8, 40);
    let triple = |v: [f64; 3]| v.map(|x| format!("{x:.4}")).join(" ");
    let _ = writeln!(page, "\n{:<width$}  sides  {:<22}  radiance", "material", "reflectance");
    for (name, m) in table.names.iter().zip(&table.values) {
        let sides = if m.is_two_sided() { 2 } else { 1 };
        let light = if m.emits() { triple(m.radiance) } else { "-".into() };
        let _ = writeln!(page, "{name:<width$}  {sides:>5}  {:<22}  {light}", triple(m.diffuse));
    }
    page
}

fn origin_json(provenance: &Provenance, digest: Digest) -> Value {
    let inputs: Vec<Value> = provenance
        .inputs
        .iter()
        .map(|input| json!({"role": input.role, "digest": input.digest.to_string()}))
        .collect();
    json!({
        "tool": provenance.tool,
        "version": provenance.version,
        "flags": provenance.flags,
        "inputs": inputs,
        "identity": digest.to_string(),
    })
}

fn mesh_json(mesh: &Mesh, provenance: &Provenance, digest: Digest) -> String {
    let quality = Quality::of(mesh);
    let (low, high) = bounds(mesh);
    let groups: Vec<Value> = groups(mesh)
        .iter()
        .map(|g| {
            json!({"name": g.name, "faces": g.faces, "elements": g.elements, "area": g.area, "materials": g.materials})
        })
        .collect();
    let value = json!({
        "kind": "mesh",
        "provenance": origin_json(provenance, digest),
        "elements": mesh.element_count(),
        "emitting_elements": emitter_count(mesh),
        "vertices": mesh.vertices.len(),
        "nodes": mesh.node_vertices.len(),
        "faces": mesh.face_count(),
        "input_faces": mesh.input_face_count,
        "occluders": mesh.occluders.len(),
        "lines": mesh.lines.len(),
        "lines_by_order": lines_by_order(mesh),
        "angle_histogram_deg": angle_histogram(mesh),
        "size_histogram": size_histogram(mesh),
        "hidden_area": mesh.hidden_areas.iter().sum::<f64>(),
        "occluder_identity": format!("{:016x}", mesh.occluder_identity()),
        "clusters": mesh.clusters.len(),
        "low": low,
        "high": high,
        "element_area": quality.element_area,
        "face_area": quality.face_area,
        "longest_edge": quality.longest_edge,
        "smallest_angle_deg": quality.smallest_angle_deg,
        "median_smallest_angle_deg": quality.median_smallest_angle_deg,
        "narrow_elements": {
            "count": quality.narrow,
            "at_given_angles": quality.narrow_at_given_angles,
            "in_strips": quality.narrow_in_strips,
            "others": quality.narrow_freely(),
        },
        "uneven_neighbours": {
            "count": quality.uneven,
            "in_strips": quality.uneven_in_strips,
            "others": quality.uneven - quality.uneven_in_strips,
        },
        "materials": mesh.materials,
        "groups": groups,
    });
    format!("{value:#}\n")
}

/// A line on elements of a poor kind, with how many of them lie where; nothing where there are none.
fn poor(title: &str, count: usize, what: [&str; 2], places: &[(usize, &str)]) -> String {
    if count == 0 {
        return String::new();
    }
    let places: Vec<String> = places.iter().map(|(count, place)| format!("{count} {place}")).collect();
    format!("{title:<10} {}: {}\n", counted(count, what[0], what[1]), places.join(", "))
}

fn materials_json(table: &MaterialTable, provenance: &Provenance, digest: Digest) -> String {
    let materials: Vec<Value> = table
        .names
        .iter()
        .zip(&table.values)
        .map(|(name, m)| {
            json!({
                "name": name, "diffuse": m.diffuse, "radiance": m.radiance, "specular": m.specular,
                "transmission": m.transmission, "exponent": m.exponent, "refraction": m.refraction,
                "opacity": m.opacity, "roughness": m.roughness, "metalness": m.metalness,
                "two_sided": m.is_two_sided(),
            })
        })
        .collect();
    let value = json!({
        "kind": "materials",
        "provenance": origin_json(provenance, digest),
        "materials": materials,
    });
    format!("{value:#}\n")
}
