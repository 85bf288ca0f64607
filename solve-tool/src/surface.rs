//! `solve-tool export` to geometry: the elements with what the solution says of them, for viewers and other programs.
//!
//! Fields of the polygons are the solution's own numbers. Those of the points are means over the elements that share a
//! point, weighted by area; points are not shared across lines where light jumps. Where exact values at points are asked
//! for, `shade-tool probe` gathers them.

use interchange::Error;
use interchange::atomic_write::refuse_input;
use interchange::foreign::{self, Field, Format, Surface};
use interchange::materials::MaterialTable;
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use std::f64::consts::PI;
use std::path::Path;

/// Share of the area that shows darker than white, unless a radiance is asked for: lamps are small and much brighter.
const DARKER_THAN_WHITE: f64 = 0.98;

/// Writes the elements of `mesh` with radiosity B and irradiance H (W m^-2), and what else the solution holds, in the format
/// asked for, or else that the name of `output` asks for. `white`: the radiance, W m^-2 sr^-1, that shows as white.
///
/// # Errors
/// The files do not belong together, the format holds no solution, or the output cannot be written.
pub fn write(
    solution_path: &Path,
    mesh_path: &Path,
    white: Option<f64>,
    output: &Path,
    format: Option<Format>,
) -> interchange::Result<()> {
    if Format::asked_or(output, format)? == Format::Vs3 {
        return Err(Error::whole(
            output,
            "View3D's format holds no solution; mesh-tool export writes its geometry",
        ));
    }
    let table = mesh_path.with_extension("materials");
    refuse_input(output, [solution_path, mesh_path, table.as_path()])?;
    let (mesh, _, mesh_digest) = Mesh::read(mesh_path)?;
    let (solution, _, origins, digest) = Solution::read(solution_path)?;
    Solution::belongs_to(solution_path, &origins, mesh_path, mesh_digest)?;
    let materials = if table.exists() { Some(MaterialTable::read(&table)?.0) } else { None };
    let mut surface = Surface::of_mesh(&mesh, materials.as_ref());
    let areas: Vec<f64> =
        mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
    fill(&mut surface, &solution, &areas, white);
    surface.comments.insert(0, format!("solution {} on mesh {}", digest.short(), mesh_digest.short()));
    foreign::write(output, &surface, format).map(|_| ())
}

fn fill(surface: &mut Surface, solution: &Solution, areas: &[f64], white: Option<f64>) {
    let (b, h) = (&solution.radiosity, &solution.irradiance);
    let radiances: Vec<[f64; 3]> = b.iter().map(|b| b.map(|x| x / PI)).collect();
    let white = white.unwrap_or_else(|| Surface::white(&radiances, areas, DARKER_THAN_WHITE));
    let [b_points, h_points] = [b, h].map(|values| surface.at_points(values, areas));
    let shown: Vec<[f64; 3]> = b_points.iter().map(|b| b.map(|x| x / PI)).collect();
    surface.colours = Some(Surface::shown(&shown, white));
    surface.radiances = Some(radiances);
    surface.point_fields = vec![Field::colours("B", &b_points), Field::colours("H", &h_points)];

    let details = &solution.details;
    let fields = &mut surface.polygon_fields;
    fields.push(Field::scalars("area", areas.to_vec()));
    fields.extend([Field::colours("B", b), Field::colours("H", h)]);
    fields.extend(details.exitance.as_ref().map(|e| Field::colours("E", e)));
    if let Some([lower, upper]) = &details.bounds {
        fields.extend([Field::colours("B_lower", lower), Field::colours("B_upper", upper)]);
    }
    if let Some(errors) = &details.element_errors {
        for (k, name) in ["error_matrix", "error_solver", "error_element"].iter().enumerate() {
            fields.push(Field::scalars(name, errors.iter().map(|e| e[k]).collect()));
        }
    }
    fields.extend(details.row_sums.as_ref().map(|sums| Field::scalars("row_sum", sums.clone())));
    if let Some(thermal) = &details.thermal {
        for (k, name) in ["temperature", "emissivity"].iter().enumerate() {
            fields.push(Field::scalars(name, thermal.iter().map(|t| t[k]).collect()));
        }
    }
    surface.comments.push("B radiosity, H irradiance, E exitance, W m^-2; channels red, green, blue".into());
    surface
        .comments
        .push(format!("colours: radiance B / pi; {white:.6e} W m^-2 sr^-1 and more show as white"));
}
