//! View3D input (`.vs3`, NIST): vertices and surfaces of three or four corners, front counter-clockwise as ours.
//!
//! A polygon of more corners becomes several surfaces that View3D combines (`cmb`), so that its output has one row for
//! each polygon of ours. The emittance is 1 less the mean of the diffuse reflectances.

use super::{Surface, word};
use crate::atomic_write::{self, Outcome};
use crate::error::Result;
use crate::tables::number;
use std::path::Path;

/// Emittances that View3D takes without changing them.
const EMITTANCES: [f64; 2] = [0.001, 0.999];

/// Writes a surface; an identical file is left alone.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, surface: &Surface) -> Result<Outcome> {
    atomic_write::write(path, |out| {
        let title = surface.comments.first().map_or("surfaces", String::as_str);
        writeln!(out, "T {}\nC encl=0 emit=0 out=0\nF 3", title.replace(['\n', '\r'], " "))?;
        for (i, point) in surface.points.iter().enumerate() {
            writeln!(out, "V {} {}", i + 1, point.map(number).join(" "))?;
        }
        let mut count = 0;
        for (i, polygon) in surface.polygons.rows().enumerate() {
            let name = word(&surface.groups[surface.polygon_groups[i] as usize]);
            let (_, material) = &surface.materials[surface.polygon_materials[i] as usize];
            let mean = material.diffuse.iter().sum::<f64>() / 3.0;
            let emittance = (1.0 - mean).clamp(EMITTANCES[0], EMITTANCES[1]);
            let mut first = 0;
            for piece in pieces(polygon) {
                count += 1;
                let [a, b, c, d] = piece;
                writeln!(out, "S {count} {a} {b} {c} {d} 0 {first} {emittance:.6} {name}")?;
                if first == 0 {
                    first = count;
                }
            }
        }
        writeln!(out, "E")
    })
}

/// A polygon as quadrilaterals and at most one triangle, whose fourth corner is 0; corners count from 1.
fn pieces(polygon: &[u32]) -> Vec<[u32; 4]> {
    let corner = |k: usize| polygon.get(k).map_or(0, |point| point + 1);
    (1..polygon.len() - 1).step_by(2).map(|k| [corner(0), corner(k), corner(k + 1), corner(k + 2)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_are_cut_into_what_view3d_knows() {
        assert_eq!(pieces(&[4, 5, 6]), [[5, 6, 7, 0]]);
        assert_eq!(pieces(&[0, 1, 2, 3]), [[1, 2, 3, 4]]);
        assert_eq!(pieces(&[0, 1, 2, 3, 4]), [[1, 2, 3, 4], [1, 4, 5, 0]]);
        assert_eq!(pieces(&[0, 1, 2, 3, 4, 5]), [[1, 2, 3, 4], [1, 4, 5, 6]]);
    }
}
