//! `solve-tool export`: what a solution says of elements, faces or groups, as tables.

use interchange::Error;
use interchange::atomic_write::refuse_input;
use interchange::grouping::{By, Grouping};
use interchange::mesh::Mesh;
use interchange::solution::Solution;
use interchange::tables::{TableFormat, number, write_csv, write_npy};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a table tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Quantity {
    /// Area, mean radiosity B and irradiance H
    Radiosity,
    /// Power emitted, absorbed and escaped
    Energy,
    /// Mean lower and upper bound of the radiosity (solve --bounds)
    Bounds,
    /// What errors of matrix, solver and elements cost, the worst first (solve --bounds)
    Errors,
    /// The links whose errors cost most (solve --bounds)
    Links,
    /// Temperature, net flux and net heat (solve --thermal)
    Heat,
}

/// Units of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Units {
    /// Watts per channel
    Radiometric,
    /// Lumens, lux and cd m^-2: Rec. 709 luminance of the channels times the luminous efficacy
    Photometric,
}

/// What `export` is asked to do.
#[derive(Debug, Clone)]
pub struct ExportRequest {
    /// The solution.
    pub solution: PathBuf,
    /// The mesh it was computed on.
    pub mesh: PathBuf,
    /// What a row stands for.
    pub by: By,
    /// What it tells.
    pub quantity: Quantity,
    /// In which units.
    pub units: Units,
    /// Luminous efficacy of the light, lm/W.
    pub efficacy: f64,
    /// `.csv`, or `.npy` with the same columns but the key.
    pub output: PathBuf,
}

/// A table: keys, columns, rows.
struct Rows {
    header: Vec<String>,
    keys: Vec<String>,
    rows: Vec<Vec<f64>>,
}

/// Writes the table.
///
/// Means run over all elements under a key, both sides of two-sided faces included: `area` is then twice the face's.
/// Hidden parts count with radiosity and irradiance 0; temperature and emissivity are those of what is seen. Keys of faces that were dropped have area 0 and zeros.
pub fn run(request: &ExportRequest) -> interchange::Result<()> {
    let allowed = match request.quantity {
        Quantity::Links => &[TableFormat::Csv][..],
        _ => &[TableFormat::Csv, TableFormat::Npy],
    };
    let output = &request.output;
    let format = TableFormat::of(output, allowed)?;
    refuse_input(output, [request.solution.as_path(), request.mesh.as_path()])?;
    let (mesh, _, mesh_digest) = Mesh::read(&request.mesh)?;
    let (solution, _, origins, _) = Solution::read(&request.solution)?;
    Solution::belongs_to(&request.solution, &origins, &request.mesh, mesh_digest)?;
    let grouping = Grouping::new(&mesh, request.by);
    let areas = mesh.element_ids().map(|e| geometry::polygon::area(&mesh.element_corners(e))).collect();
    let table = Table { request, solution, grouping, areas };
    if request.quantity == Quantity::Links {
        return table.write_links();
    }
    let Rows { header, keys, rows } = table.rows()?;
    match format {
        TableFormat::Npy => {
            write_npy(output, header.len() - 1, rows.len(), rows.iter().flatten().copied())?;
        }
        _ => {
            let lines = keys
                .into_iter()
                .zip(&rows)
                .map(|(key, row)| std::iter::once(key).chain(row.iter().map(|&x| number(x))).collect());
            write_csv(output, &header, lines)?;
        }
    }
    Ok(())
}

/// Luminance weights of linear RGB with the primaries of Rec. 709.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

struct Table<'a> {
    request: &'a ExportRequest,
    solution: Solution,
    grouping: Grouping,
    areas: Vec<f64>,
}

impl Table<'_> {
    fn rows(&self) -> interchange::Result<Rows> {
        let photometric = self.request.units == Units::Photometric;
        let (columns, mut columns_of): (Vec<String>, Vec<Vec<f64>>) = match self.request.quantity {
            Quantity::Radiosity if photometric => self.luminances(),
            Quantity::Radiosity => self.radiosities(),
            Quantity::Energy => self.energies(photometric)?,
            Quantity::Bounds => self.bounds()?,
            Quantity::Errors => self.errors()?,
            Quantity::Heat => self.heat()?,
            Quantity::Links => Default::default(),
        };
        columns_of.insert(0, self.total_areas());
        let mut header = vec![self.grouping.title.to_owned(), "area".to_owned()];
        header.extend(columns);
        let row = |key: usize| -> Vec<f64> { columns_of.iter().map(|column| column[key]).collect() };
        let mut order: Vec<usize> = (0..self.grouping.len()).collect();
        if self.request.quantity == Quantity::Errors {
            let last = columns_of.len() - 1;
            order.sort_by(|&a, &b| columns_of[last][b].total_cmp(&columns_of[last][a]).then(a.cmp(&b)));
        }
        let keys = order.iter().map(|&key| self.grouping.labels[key].clone()).collect();
        Ok(Rows { header, keys, rows: order.into_iter().map(row).collect() })
    }

    /// Areas of the keys. Hidden parts have no elements and are dark, but they are part of the face.
    fn total_areas(&self) -> Vec<f64> {
        let mut total = self.grouping.sums(|i| self.areas[i]);
        total.iter_mut().zip(&self.grouping.hidden_areas).for_each(|(area, hidden)| *area += hidden);
        total
    }

    /// Area-weighted means of a value of the elements.
    fn means(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let total = self.total_areas();
        let sums = self.grouping.sums(|i| self.areas[i] * value(i));
        sums.iter().zip(total).map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect()
    }

    /// Area-weighted means over what has elements: of properties of a surface, which its hidden parts share.
    fn means_seen(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let seen = self.grouping.sums(|i| self.areas[i]);
        let sums = self.grouping.sums(|i| self.areas[i] * value(i));
        sums.iter().zip(seen).map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect()
    }

    /// Luminance-weighted sum of the channels times the efficacy.
    fn luminous(&self, channels: [f64; 3]) -> f64 {
        let weighted: f64 = channels.iter().zip(LUMINANCE).map(|(x, weight)| weight * x).sum();
        self.request.efficacy * weighted
    }

    fn radiosities(&self) -> (Vec<String>, Vec<Vec<f64>>) {
        let columns = ["B_r", "B_g", "B_b", "H_r", "H_g", "H_b"].map(str::to_owned).to_vec();
        let of = |values: &[[f64; 3]], c: usize| self.means(|i| values[i][c]);
        let (b, h) = (&self.solution.radiosity, &self.solution.irradiance);
        (columns, (0..3).map(|c| of(b, c)).chain((0..3).map(|c| of(h, c))).collect())
    }

    fn luminances(&self) -> (Vec<String>, Vec<Vec<f64>>) {
        let columns = ["luminance_cd_m2", "luminous_exitance_lm_m2", "illuminance_lx", "efficacy_lm_W"];
        let (b, h) = (&self.solution.radiosity, &self.solution.irradiance);
        let exitance = self.means(|i| self.luminous(b[i]));
        let luminance = exitance.iter().map(|m| m / std::f64::consts::PI).collect();
        let illuminance = self.means(|i| self.luminous(h[i]));
        let efficacy = vec![self.request.efficacy; self.grouping.len()];
        (columns.map(str::to_owned).to_vec(), vec![luminance, exitance, illuminance, efficacy])
    }

    fn energies(&self, photometric: bool) -> interchange::Result<(Vec<String>, Vec<Vec<f64>>)> {
        let remedy = "run solve-tool solve again: this version keeps what the balance needs";
        let exitance = self.part(self.solution.details.exitance.as_ref(), "exitance", remedy)?;
        let row_sums = self.part(self.solution.details.row_sums.as_ref(), "row sums", remedy)?;
        let (b, h) = (&self.solution.radiosity, &self.solution.irradiance);
        let emitted = |i: usize, c: usize| exitance[i][c];
        // rho H = B - E.
        let absorbed = |i: usize, c: usize| h[i][c] - b[i][c] + exitance[i][c];
        let escaped = |i: usize, c: usize| b[i][c] * (1.0 - row_sums[i]);
        let terms: [(&str, Term<'_>); 3] =
            [("emitted", &emitted), ("absorbed", &absorbed), ("escaped", &escaped)];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for (name, term) in terms {
            if photometric {
                columns.push(format!("{name}_lm"));
                let of = |i: usize| self.areas[i] * self.luminous([0, 1, 2].map(|c| term(i, c)));
                values.push(self.grouping.sums(of));
                continue;
            }
            for (c, letter) in ["r", "g", "b"].iter().enumerate() {
                columns.push(format!("{name}_{letter}"));
                values.push(self.grouping.sums(|i| self.areas[i] * term(i, c)));
            }
        }
        Ok((columns, values))
    }

    fn bounds(&self) -> interchange::Result<(Vec<String>, Vec<Vec<f64>>)> {
        let [lower, upper] = self.part(self.solution.details.bounds.as_ref(), "bounds", BOUNDS_REMEDY)?;
        let names = ["lower_r", "lower_g", "lower_b", "upper_r", "upper_g", "upper_b"];
        let of = |values: &[[f64; 3]], c: usize| self.means(|i| values[i][c]);
        let values = (0..3).map(|c| of(lower, c)).chain((0..3).map(|c| of(upper, c))).collect();
        Ok((names.map(str::to_owned).to_vec(), values))
    }

    fn errors(&self) -> interchange::Result<(Vec<String>, Vec<Vec<f64>>)> {
        let errors = self.part(self.solution.details.element_errors.as_ref(), "errors", BOUNDS_REMEDY)?;
        let names = ["matrix", "solver", "discretisation", "total"].map(str::to_owned).to_vec();
        let mut values: Vec<Vec<f64>> = (0..3).map(|term| self.grouping.sums(|i| errors[i][term])).collect();
        values.push(self.grouping.sums(|i| errors[i].iter().sum()));
        Ok((names, values))
    }

    fn heat(&self) -> interchange::Result<(Vec<String>, Vec<Vec<f64>>)> {
        let remedy = "run solve-tool solve --thermal";
        let thermal = self.part(self.solution.details.thermal.as_ref(), "temperatures", remedy)?;
        let names = ["emissivity", "temperature", "net_flux", "net_heat"].map(str::to_owned).to_vec();
        let net = |i: usize| self.solution.radiosity[i][0] - self.solution.irradiance[i][0];
        // The temperature of the mean emissive power.
        let temperature = self.means_seen(|i| thermal[i][0].powi(4)).iter().map(|t| t.powf(0.25)).collect();
        let heat = self.grouping.sums(|i| self.areas[i] * net(i));
        Ok((names, vec![self.means_seen(|i| thermal[i][1]), temperature, self.means(net), heat]))
    }

    /// Links between keys: those between elements, added up.
    fn write_links(&self) -> interchange::Result<()> {
        let links = self.part(self.solution.details.error_links.as_ref(), "links", BOUNDS_REMEDY)?;
        let mut sums: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for link in links {
            let keys = [link.first, link.second].map(|i| self.grouping.key_of_element[i as usize]);
            *sums.entry((keys[0].min(keys[1]), keys[0].max(keys[1]))).or_default() += link.error;
        }
        let mut sums: Vec<((u32, u32), f64)> = sums.into_iter().collect();
        sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let title = self.grouping.title;
        let header = [format!("first_{title}"), format!("second_{title}"), "error".to_owned()];
        let lines = sums.into_iter().map(|((first, second), error)| {
            let label = |key: u32| self.grouping.labels[key as usize].clone();
            vec![label(first), label(second), number(error)]
        });
        write_csv(&self.request.output, &header, lines)?;
        Ok(())
    }

    fn part<'b, T>(&self, part: Option<&'b T>, name: &str, remedy: &str) -> interchange::Result<&'b T> {
        part.ok_or_else(|| {
            Error::whole(&self.request.solution, format!("the solution holds no {name}; {remedy}"))
        })
    }
}

/// A power per area of an element's channel.
type Term<'a> = &'a dyn Fn(usize, usize) -> f64;

/// What to do about a solution without them.
const BOUNDS_REMEDY: &str = "run solve-tool solve --bounds";
