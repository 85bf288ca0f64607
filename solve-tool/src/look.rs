//! `solve-tool info --element` and `--group`: what a solution says of one element or of one group, with the errors that the
//! file knows.

use crate::channels::CHANNEL_NAMES;
use anyhow::bail;
use interchange::counted::counted;
use interchange::error::{Error, nearest_name};
use interchange::grouping::{By, Grouping};
use interchange::ids::ElementId;
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;

/// What to look at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Look {
    /// An element, from 1.
    Element(u32),
    /// A group, by name.
    Group(String),
}

/// A quantity by channel, or one number.
type Numbers = Vec<f64>;

/// Tells what was asked for, for people or as JSON. Groups, and names of elements, need the mesh.
///
/// # Errors
/// A file cannot be read, they do not belong together, or there is no such element or group.
pub fn describe(path: &Path, mesh_path: Option<&Path>, look: &Look, as_json: bool) -> anyhow::Result<String> {
    let (solution, provenance, origins, _) = Solution::read(path)?;
    let mesh = match mesh_path {
        None => None,
        Some(mesh_path) => {
            let (mesh, _, digest) = Mesh::read(mesh_path)?;
            Solution::belongs_to(path, &origins, mesh_path, digest)?;
            Some(mesh)
        }
    };
    let made_by = format!("{} {} {}", provenance.tool, provenance.version, provenance.flags.join(" "));
    let (kind, title, elements, hidden) = match look {
        Look::Element(number) => {
            let count = solution.radiosity.len();
            if !(1..=count).contains(&(*number as usize)) {
                let message = format!("there is no element {number}: they count from 1 to {count}");
                return Err(Error::whole(path, message).into());
            }
            let place = mesh.as_ref().map_or_else(String::new, |mesh| {
                let element = ElementId(number - 1);
                let group = &mesh.groups[mesh.element_group(element).index()];
                format!(" {group}, face {}", mesh.element_input(element) + 1)
            });
            ("element", format!("{number}{place}"), vec![*number as usize - 1], 0.0)
        }
        Look::Group(name) => {
            let Some(mesh) = &mesh else { bail!("--group needs --mesh: the solution alone knows no groups") };
            let Some(key) = mesh.groups.iter().position(|group| group == name) else {
                let near = nearest_name(name, mesh.groups.iter().map(String::as_str));
                let near = near.map_or_else(
                    || format!("the groups are {}", mesh.groups.join(", ")),
                    |n| format!("did you mean {n}?"),
                );
                bail!("no group is named {name}; {near}")
            };
            let grouping = Grouping::new(mesh, By::Group);
            let of = &grouping.key_of_element;
            let elements = (0..of.len()).filter(|&i| of[i] as usize == key).collect();
            ("group", name.clone(), elements, grouping.hidden_areas[key])
        }
    };
    let area_of = |i: usize| {
        mesh.as_ref().map(|mesh| geometry::polygon::area(&mesh.element_corners(ElementId::new(i))))
    };
    let areas: Vec<f64> = elements.iter().map(|&i| area_of(i).unwrap_or(1.0)).collect();
    let total = hidden + areas.iter().sum::<f64>();
    let quantities = quantities(&solution, &elements, &areas, total);
    let summary = &solution.summary;
    if as_json {
        let mut data = Map::new();
        data.insert("kind".into(), json!(kind));
        data.insert(kind.into(), json!(title));
        data.insert("elements".into(), json!(elements.len()));
        data.insert("area".into(), mesh.as_ref().map_or(Value::Null, |_| json!(total)));
        quantities.iter().for_each(|(name, _, numbers)| {
            data.insert((*name).into(), json!(numbers));
        });
        data.insert("solver".into(), json!(summary.solver));
        data.insert("bound".into(), json!(summary.achieved));
        data.insert("made_by".into(), json!(made_by));
        return Ok(format!("{:#}\n", Value::Object(data)));
    }
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<14} {value}");
    };
    line(kind, title);
    if mesh.is_some() {
        line(
            "area",
            format!(
                "{total:.6e}, {hidden:.6e} of it hidden and dark, the rest in {}",
                counted(elements.len(), "element", "elements")
            ),
        );
    }
    for (name, unit, numbers) in &quantities {
        let named = |(value, channel): (&f64, &&str)| format!("{value:.6e} {channel}");
        let shown = match numbers.len() {
            3 => numbers.iter().zip(&CHANNEL_NAMES).map(named).collect::<Vec<_>>().join(", "),
            _ => numbers.iter().map(|x| format!("{x:.6e}")).collect::<Vec<_>>().join(", "),
        };
        line(name, format!("{shown} {unit}"));
    }
    line("solver", format!("{}, bound {:.2e} of the emitted power", summary.solver, summary.achieved));
    line("made by", made_by);
    Ok(text)
}

/// Name, unit and numbers of all that the solution holds: means over the total area, hidden parts included as tables do, and
/// sums of what is counted in watts.
fn quantities(
    solution: &Solution,
    elements: &[usize],
    areas: &[f64],
    total: f64,
) -> Vec<(&'static str, &'static str, Numbers)> {
    let mean = |values: &dyn Fn(usize) -> f64| {
        // A group of which nothing is left is dark.
        let sum: f64 = elements.iter().zip(areas).map(|(&i, area)| area * values(i)).sum();
        if total > 0.0 { sum / total } else { 0.0 }
    };
    let colours = |values: &[[f64; 3]]| -> Numbers { (0..3).map(|c| mean(&|i| values[i][c])).collect() };
    let details = &solution.details;
    let mut found =
        vec![("B", "W m^-2", colours(&solution.radiosity)), ("H", "W m^-2", colours(&solution.irradiance))];
    if let Some(exitance) = &details.exitance {
        found.push(("E", "W m^-2", colours(exitance)));
    }
    if let Some([lower, upper]) = &details.bounds {
        found.push(("B at least", "W m^-2", colours(lower)));
        found.push(("B at most", "W m^-2", colours(upper)));
    }
    if let Some(errors) = &details.element_errors {
        for (k, name) in ["error matrix", "error solver", "error element"].into_iter().enumerate() {
            found.push((name, "W", vec![elements.iter().map(|&i| errors[i][k]).sum()]));
        }
    }
    if let Some(sums) = &details.row_sums {
        let kept: f64 = elements.iter().zip(areas).map(|(&i, area)| area * sums[i]).sum();
        let visible: f64 = areas.iter().sum();
        let escapes = if visible > 0.0 { 1.0 - kept / visible } else { 0.0 };
        found.push(("escapes", "of what leaves", vec![escapes]));
    }
    if let Some(thermal) = &details.thermal {
        found.push((
            "temperature",
            "K, of the mean emissive power",
            vec![mean(&|i| thermal[i][0].powi(4)).powf(0.25)],
        ));
        found.push(("emissivity", "", vec![mean(&|i| thermal[i][1])]));
    }
    found
}
