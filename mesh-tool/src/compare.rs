//! `mesh-tool compare`: what two meshes share and by how much they differ, in the scene's units of length and area.
//!
//! Elements are the same when their corners are to the last bit and their material is (`Mesh::element_identities`). Where
//! both meshes connect their vertices alike, the largest distance between a vertex and its counterpart is told as well.

use anyhow::bail;
use geometry::polygon;
use glam::DVec3;
use interchange::counted::counted;
use interchange::error::Result;
use interchange::mesh::Mesh;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::Path;

/// One of the two meshes.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Number of elements.
    pub elements: usize,
    /// Area of all elements.
    pub area: f64,
    /// Elements that the other does not have.
    pub own: usize,
    /// Their area.
    pub own_area: f64,
    /// Length of the longest edge.
    pub longest_edge: f64,
    /// Discontinuity lines by order.
    pub lines: [usize; 3],
}

/// How two meshes differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Both.
    pub sides: [Side; 2],
    /// Groups that differ in area or number of elements: areas, then numbers; a group that one lacks has none there.
    pub groups: BTreeMap<String, ([f64; 2], [usize; 2])>,
    /// Largest distance between vertices of equal number, with that number from 1; `None` where the elements connect other
    /// vertices.
    pub moved: Option<(f64, usize)>,
    /// Whether the same faces block light.
    pub same_occluders: bool,
}

impl Difference {
    /// Compares two meshes.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn between(first: &Path, second: &Path) -> Result<Self> {
        let meshes = [Mesh::read(first)?.0, Mesh::read(second)?.0];
        let identities = meshes.each_ref().map(Mesh::element_identities);
        let areas = meshes.each_ref().map(|mesh| -> Vec<f64> {
            mesh.element_ids().map(|e| polygon::area(&mesh.element_corners(e))).collect()
        });
        let side = |k: usize| {
            let mesh = &meshes[k];
            let mut others: HashMap<u64, usize> = HashMap::new();
            identities[1 - k].iter().for_each(|&id| *others.entry(id).or_default() += 1);
            let (mut own, mut own_area) = (0, 0.0);
            for (id, area) in identities[k].iter().zip(&areas[k]) {
                match others.get_mut(id).filter(|left| **left > 0) {
                    Some(left) => *left -= 1,
                    None => (own, own_area) = (own + 1, own_area + area),
                }
            }
            let edge =
                |e| polygon::edges(&mesh.element_corners(e)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
            Side {
                elements: mesh.element_count(),
                area: areas[k].iter().sum(),
                own,
                own_area,
                longest_edge: mesh.element_ids().map(edge).fold(0.0, f64::max),
                lines: [0, 1, 2].map(|order| mesh.lines.iter().filter(|line| line.order == order).count()),
            }
        };
        let mut groups: BTreeMap<String, ([f64; 2], [usize; 2])> = BTreeMap::new();
        for k in 0..2 {
            for element in meshes[k].element_ids() {
                let name = &meshes[k].groups[meshes[k].element_group(element).index()];
                let (area, count) = groups.entry(name.clone()).or_default();
                area[k] += areas[k][element.index()];
                count[k] += 1;
            }
        }
        groups.retain(|_, (area, count)| area[0] != area[1] || count[0] != count[1]);
        let [a, b] = &meshes;
        let alike = a.elements == b.elements && a.vertices.len() == b.vertices.len();
        let distance = |(p, q): (&[f64; 3], &[f64; 3])| DVec3::from_array(*p).distance(DVec3::from_array(*q));
        let moved = alike.then(|| {
            let larger =
                |best: (f64, usize), (i, d): (usize, f64)| if d > best.0 { (d, i + 1) } else { best };
            a.vertices.iter().zip(&b.vertices).map(distance).enumerate().fold((0.0, 1), larger)
        });
        Ok(Self {
            sides: [side(0), side(1)],
            groups,
            moved,
            same_occluders: a.occluder_identity() == b.occluder_identity(),
        })
    }

    /// The larger share of either mesh's area that lies in elements that the other does not have.
    pub fn share(&self) -> f64 {
        self.sides.iter().map(|side| side.own_area / side.area).fold(0.0, f64::max)
    }

    /// Refuses a share of the area in other elements above `most`.
    ///
    /// # Errors
    /// Says both numbers.
    pub fn check(&self, most: Option<f64>) -> anyhow::Result<()> {
        match most {
            Some(most) if self.share() > most => {
                bail!(
                    "{:.3e} of the area is in elements that only one mesh has, above --max {most:e}",
                    self.share()
                )
            }
            _ => Ok(()),
        }
    }

    /// The comparison on one page, or as JSON.
    pub fn describe(&self, as_json: bool) -> String {
        if as_json {
            let side = |s: &Side| {
                json!({
                    "elements": s.elements, "area": s.area, "own_elements": s.own, "own_area": s.own_area,
                    "longest_edge": s.longest_edge, "lines_by_order": s.lines,
                })
            };
            let groups: BTreeMap<&String, Value> = self
                .groups
                .iter()
                .map(|(name, (areas, counts))| (name, json!({ "areas": areas, "elements": counts })))
                .collect();
            let data = json!({
                "kind": "mesh comparison", "first": side(&self.sides[0]), "second": side(&self.sides[1]),
                "groups_that_differ": groups, "same_occluders": self.same_occluders,
                "moved": self.moved.map(|(distance, vertex)| json!({ "distance": distance, "vertex": vertex })),
            });
            return format!("{data:#}\n");
        }
        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<12} {value}");
        };
        for (name, s) in ["first", "second"].iter().zip(&self.sides) {
            line(
                name,
                format!(
                    "{} of area {:.6e}; {} of them ({:.3} % of the area) the other does not have",
                    counted(s.elements, "element", "elements"),
                    s.area,
                    s.own,
                    100.0 * s.own_area / s.area
                ),
            );
            let [value, slope, curvature] = s.lines;
            let lines = format!("{value} lines where value jumps, {slope} slope, {curvature} curvature");
            line("", format!("longest edge {:.6e}; {lines}", s.longest_edge));
        }
        line("blocks light", if self.same_occluders { "the same" } else { "not the same" }.into());
        match self.moved {
            Some((0.0, _)) => line("vertices", "all at the same places, connected alike".into()),
            Some((distance, vertex)) => {
                line(
                    "vertices",
                    format!("connected alike, moved by up to {distance:.6e}, most vertex {vertex}"),
                );
            }
            None => line("vertices", "connected otherwise".into()),
        }
        for (name, (areas, counts)) in &self.groups {
            let relative = (areas[0] - areas[1]).abs() / areas[0].max(areas[1]);
            line(
                "group",
                format!(
                    "{name}: {} and {} elements, areas {:.6e} and {:.6e} ({relative:.1e} apart)",
                    counts[0], counts[1], areas[0], areas[1]
                ),
            );
        }
        text
    }
}
