//! Reading View3D input (`.vs3`, formats 3 and 3a): a scene of polygons, named and grouped as View3D reports them.
//!
//! The kinds of lines: `T` title, `C` control, `F` format, `V` vertex, `S` surface, `O` obstruction, `M` mask, `N` null
//! surface, `E` end; `!` and `/` begin comments. A surface that is combined with another joins its group. Base surfaces are
//! cut around what lies in them ("View3D User Manual", 3.3, "Surface Types").

mod cut;
mod placed;
mod records;
#[cfg(test)]
mod tests;

use super::Surface;
use crate::counted::counted;
use crate::error::{Error, Result};
use crate::materials::Material;
use crate::tables::number;
use cut::{Cut, Ring};
use glam::DVec3;
use records::{Kind, Records};
use std::collections::HashMap;
use std::path::Path;

/// Group and material of what only blocks light.
const OBSTRUCTION: &str = "obstruction";
/// A mask stands so far before its base, in units of its size: View3D has no air between them and makes its factor to the
/// base 1, which this changes by some 4e-6.
const MASK_GAP: f64 = 1e-6;

/// Reads a scene, with what was left out or changed.
///
/// # Errors
/// The line of the first thing that cannot be read or taken over.
pub fn read(path: &Path) -> Result<(Surface, Vec<String>)> {
    let text = crate::scene::read_text(path)?;
    let records = Records::read(path, &text)?;
    if records.list.is_empty() {
        return Err(Error::whole(path, "no surface is in this file"));
    }
    let rings = rings(path, &records)?;
    let mut said = Vec::new();
    if records.with_reflections {
        said.push(
            "emit=1 asks View3D for factors with reflections in them; the matrix holds those without".into(),
        );
    }
    let mut say = |kind, one: &str, many: &str, became: &str| {
        let count = records.list.iter().filter(|record| record.kind == kind).count();
        if count > 0 {
            said.push(format!("{} {became}", counted(count, one, many)));
        }
    };
    let black = "turned black, with rows of their own in the matrix";
    say(Kind::Obstruction, "obstruction", "obstructions", black);
    say(Kind::Null, "null surface", "null surfaces", black);
    say(Kind::Mask, "mask", "masks", "moved off the base by 1e-6 of its size: there is air between");
    Ok((surface(records, rings), said))
}

/// The polygons of every record: its own, or the pieces of it that are left around others.
fn rings(path: &Path, records: &Records) -> Result<Vec<Vec<Ring>>> {
    let own: Vec<Ring> = records.list.iter().map(|record| records.ring(record)).collect();
    let mut rings: Vec<Vec<Ring>> = own.iter().map(|ring| vec![ring.clone()]).collect();
    for (i, record) in records.list.iter().enumerate().filter(|(_, record)| record.base > 0) {
        let base = record.base - 1;
        let wrong = |what: &str| {
            let message = format!("surface {} {what} its base, surface {}", i + 1, record.base);
            Err(Error::scene(path, record.line, message))
        };
        let Some(base_ring) = own.get(base).filter(|_| base != i) else {
            let message = format!("found base {}, expected another surface of this file", record.base);
            return Err(Error::scene(path, record.line, message));
        };
        // Masks and null surfaces look at their base, subsurfaces where it looks.
        let facing = matches!(record.kind, Kind::Mask | Kind::Null);
        let sub: Ring = if facing { own[i].iter().rev().copied().collect() } else { own[i].clone() };
        if let Some(fault) = cut::fault(base_ring, &sub) {
            return wrong(fault);
        }
        let Some(Cut { mut around, under }) = Cut::new(&rings[base], &sub) else {
            return wrong("does not lie within what is left of");
        };
        match record.kind {
            Kind::Mask => {
                // The base goes on under a mask, and sees nothing else there.
                around.extend(under);
                let away = cut::area_vector(&sub).normalize_or_zero() * (MASK_GAP * cut::size(&sub));
                rings[i] = vec![own[i].iter().map(|corner| *corner + away).collect()];
            }
            Kind::Null => rings[i] = vec![sub],
            Kind::Surface | Kind::Obstruction => {}
        }
        rings[base] = around;
    }
    Ok(rings)
}

/// All polygons with their groups and materials.
fn surface(records: Records, rings: Vec<Vec<Ring>>) -> Surface {
    let mut points = Points::new(records.points);
    let mut surface = Surface { comments: records.titles, ..Surface::default() };
    let mut group_of_record: Vec<u32> = Vec::with_capacity(records.list.len());
    for (record, rings) in records.list.iter().zip(rings) {
        let black = matches!(record.kind, Kind::Obstruction | Kind::Null);
        let group = match record.combined {
            _ if black => OBSTRUCTION.to_owned(),
            0 => record.name.clone(),
            first => surface.groups[group_of_record[first - 1] as usize].clone(),
        };
        let material = if black {
            (OBSTRUCTION.to_owned(), Material::default())
        } else {
            let diffuse = [1.0 - record.emittance; 3];
            (format!("emittance_{}", number(record.emittance)), Material { diffuse, ..Material::default() })
        };
        let group = position_or_push(&mut surface.groups, group);
        let material = position_or_push(&mut surface.materials, material);
        group_of_record.push(group);
        for ring in rings {
            surface.polygons.push(ring.into_iter().map(|corner| points.number(corner)).collect::<Vec<u32>>());
            surface.polygon_groups.push(group);
            surface.polygon_materials.push(material);
        }
    }
    surface.points = points.list;
    surface
}

/// Points with their numbers: equal places are one.
struct Points {
    list: Vec<[f64; 3]>,
    numbers: HashMap<[u64; 3], u32>,
}

impl Points {
    fn new(list: Vec<[f64; 3]>) -> Self {
        let mut numbers = HashMap::new();
        for (place, number) in list.iter().zip(0..) {
            numbers.entry(place.map(f64::to_bits)).or_insert(number);
        }
        Self { list, numbers }
    }

    fn number(&mut self, corner: DVec3) -> u32 {
        let place = corner.to_array();
        *self.numbers.entry(place.map(f64::to_bits)).or_insert_with(|| {
            self.list.push(place);
            self.list.len() as u32 - 1
        })
    }
}

fn position_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    let found = list.iter().position(|known| *known == item).unwrap_or(list.len());
    if found == list.len() {
        list.push(item);
    }
    found as u32
}
