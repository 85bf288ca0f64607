//! `solve-tool export`: radiosity and irradiance as tables, area-weighted means per element, face or group.

use interchange::atomic_write::refuse_input;
use interchange::grouping::{By, Grouping};
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use interchange::tables::{TableFormat, number, write_csv, write_npy};
use std::path::Path;

/// Columns after the key, in CSV and npy alike.
const COLUMNS: [&str; 7] = ["area", "B_r", "B_g", "B_b", "H_r", "H_g", "H_b"];

/// Writes the table to `output` (`.csv`, or `.npy` with the same columns but the key).
///
/// Means run over all elements under a key, both sides of two-sided faces included: `area` is then twice the face's.
/// Hidden parts count with radiosity and irradiance 0. Keys of faces that were dropped have area 0 and zeros.
pub fn run(solution_path: &Path, mesh_path: &Path, by: By, output: &Path) -> interchange::Result<()> {
    let format = TableFormat::of(output, &[TableFormat::Csv, TableFormat::Npy])?;
    refuse_input(output, [solution_path, mesh_path])?;
    let (mesh, _, mesh_digest) = Mesh::read(mesh_path)?;
    let (solution, _, origins, _) = Solution::read(solution_path)?;
    Solution::belongs_to(solution_path, &origins, mesh_path, mesh_digest)?;
    let grouping = Grouping::new(&mesh, by);
    let rows = means(&mesh, &solution, &grouping);
    match format {
        TableFormat::Npy => {
            write_npy(output, COLUMNS.len(), rows.len(), rows.iter().flatten().copied())?;
        }
        _ => {
            let header: Vec<String> =
                std::iter::once(grouping.title).chain(COLUMNS).map(str::to_owned).collect();
            let lines = grouping.labels.iter().zip(&rows).map(|(label, row)| {
                std::iter::once(label.clone()).chain(row.iter().map(|&x| number(x))).collect()
            });
            write_csv(output, &header, lines)?;
        }
    }
    Ok(())
}

/// Area and mean B and H of each key.
fn means(mesh: &Mesh, solution: &Solution, grouping: &Grouping) -> Vec<[f64; 7]> {
    let areas: Vec<f64> =
        mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
    let mut total = grouping.sums(|i| areas[i]);
    // Hidden parts have no elements and are dark, but they are part of the face.
    total.iter_mut().zip(&grouping.hidden_areas).for_each(|(area, hidden)| *area += hidden);
    let mut rows: Vec<[f64; 7]> = total.iter().map(|&area| [area, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    for c in 0..3 {
        let radiosity = grouping.sums(|i| areas[i] * solution.radiosity[i][c]);
        let irradiance = grouping.sums(|i| areas[i] * solution.irradiance[i][c]);
        for (key, row) in rows.iter_mut().enumerate().filter(|(key, _)| total[*key] > 0.0) {
            row[1 + c] = radiosity[key] / total[key];
            row[4 + c] = irradiance[key] / total[key];
        }
    }
    rows
}
