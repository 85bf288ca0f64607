//! The rows of the table, kept in a CSV as they come: a run that was stopped goes on behind the last one. A row counts
//! as known where programs, scene and flags are the same.

use super::measure::Cost;
use std::path::Path;

/// Columns of the CSV.
pub const HEADER: &str = "key,commit,scene,method,mesh,asked,state,elements,mesh_cpu_s,mesh_wall_s,ff_cpu_s,ff_wall_s,\
sol_cpu_s,sol_wall_s,exr_cpu_s,exr_wall_s,peak_bytes,mesh_bytes,ff_bytes,sol_bytes,exr_bytes,points_error,\
points_given_error,picture_error,row_error_mean,row_error_worst,surfaces_error";

/// A measured case, or one that was not run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Digest of programs, scene and flags.
    pub key: String,
    /// Commit of the sources.
    pub commit: String,
    /// Scene.
    pub scene: String,
    /// Form-factor method.
    pub method: String,
    /// Kind of mesh.
    pub mesh: String,
    /// Asked error.
    pub asked: f64,
    /// `done`, or why not.
    pub state: String,
    /// Elements.
    pub elements: u64,
    /// Cost of mesh, matrix, solution and picture.
    pub costs: [Cost; 4],
    /// RMS relative error at the points against our reference, against the given one, of the picture; mean and worst
    /// row error of the matrix; RMS relative error of pixels away from lamps. NaN where it does not apply.
    pub errors: [f64; 6],
}

impl Row {
    /// CPU seconds of all stages.
    pub fn cpu_s(&self) -> f64 {
        self.costs.iter().map(|cost| cost.cpu_s).sum()
    }

    /// The error its curve is drawn over: that of pixels away from lamps, the points' where there is no picture, or the rows' mean.
    pub fn main_error(&self) -> f64 {
        [5, 0, 3].into_iter().map(|i| self.errors[i]).find(|e| e.is_finite()).unwrap_or(f64::NAN)
    }

    fn cells(&self) -> Vec<String> {
        let mut cells: Vec<String> =
            [&self.key, &self.commit, &self.scene, &self.method, &self.mesh].map(Clone::clone).to_vec();
        cells.extend([self.asked.to_string(), self.state.clone(), self.elements.to_string()]);
        cells.extend(self.costs.iter().flat_map(|c| [format!("{:.3}", c.cpu_s), format!("{:.3}", c.wall_s)]));
        cells.push(self.costs.iter().map(|c| c.peak_bytes).max().unwrap_or(0).to_string());
        cells.extend(self.costs.iter().map(|c| c.file_bytes.to_string()));
        cells.extend(self.errors.map(|e| if e.is_finite() { format!("{e:.4e}") } else { String::new() }));
        cells
    }

    fn from_cells(cells: &csv::StringRecord) -> Option<Self> {
        let text = |i: usize| cells.get(i).map(str::to_owned);
        let number = |i: usize| cells.get(i).map(|cell| cell.parse::<f64>().unwrap_or(f64::NAN));
        let mut costs = [Cost::default(); 4];
        for (i, cost) in costs.iter_mut().enumerate() {
            (cost.cpu_s, cost.wall_s) = (number(8 + 2 * i)?, number(9 + 2 * i)?);
            (cost.peak_bytes, cost.file_bytes) = (number(16)? as u64, number(17 + i)? as u64);
        }
        let mut errors = [f64::NAN; 6];
        for (i, error) in errors.iter_mut().enumerate() {
            *error = number(21 + i)?;
        }
        let (key, commit, scene) = (text(0)?, text(1)?, text(2)?);
        let (method, mesh, asked) = (text(3)?, text(4)?, number(5)?);
        let (state, elements) = (text(6)?, number(7)? as u64);
        Some(Self { key, commit, scene, method, mesh, asked, state, elements, costs, errors })
    }
}

/// The rows of a CSV; none where it does not exist. A last line cut short by a kill is left out.
pub fn read(path: &Path) -> Vec<Row> {
    let Ok(mut reader) = csv::ReaderBuilder::new().flexible(true).from_path(path) else { return Vec::new() };
    reader.records().flatten().filter_map(|cells| Row::from_cells(&cells)).collect()
}

/// Writes all rows anew, through a file beside it: what was there before is kept until the new table is whole.
pub fn write(path: &Path, rows: &[Row]) {
    let mut text = format!("{HEADER}\n");
    rows.iter().for_each(|row| text += &format!("{}\n", row.cells().join(",")));
    let beside = path.with_extension("csv.new");
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    written.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_a_cut_line_does_not() {
        let folder = crate::folder();
        let path = folder.path().join("rows.csv");
        let row = Row {
            key: "k".into(),
            scene: "s".into(),
            asked: 0.02,
            state: "done".into(),
            costs: [Cost { cpu_s: 1.5, wall_s: 0.75, peak_bytes: 7, file_bytes: 9 }; 4],
            errors: [0.5, 0.25, 0.125, 0.0625, 1.0, 2.0],
            ..Row::default()
        };
        write(&path, &[row.clone(), row.clone()]);
        assert_eq!(read(&path), [row.clone(), row.clone()]);
        let text = crate::text(&path);
        std::fs::write(&path, &text[..text.len() - 40]).unwrap();
        assert_eq!(read(&path), [row]);
    }
}
