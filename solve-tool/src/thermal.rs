//! Heat: grey diffuse surfaces of given temperature, or of given net flux and unknown temperature, in a transparent
//! medium.
//!
//! A surface of temperature T and emissivity eps sends E = eps sigma T^4 of its own and reflects rho = 1 - eps. A surface
//! that gives off the net flux q sends B = q + H whatever its emissivity, as B - H = q: rho = 1 and E = q, below 0 where
//! heat is drawn out. Its temperature follows: q = eps (sigma T^4 - H). Adiabatic (reradiating) surfaces have q = 0.

use crate::channels::Channel;
use crate::error::{Result, SolveError};
use interchange::Error;
use interchange::digest::Digest;
use interchange::error::nearest_name;
use interchange::mesh::Mesh;
use std::path::Path;

/// Stefan and Boltzmann's constant, W m^-2 K^-4 (CODATA 2018, exact to these digits).
pub const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;
/// Columns of the table.
const COLUMNS: [&str; 4] = ["group", "emissivity", "temperature", "flux"];

/// What is given for a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Given {
    /// Temperature, K, and emissivity.
    Temperature(f64, f64),
    /// Net flux that leaves, W m^-2, and the emissivity, where it is given.
    Flux(f64, Option<f64>),
}

/// What is given for every group of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalTable {
    /// In the order of the mesh's groups.
    pub groups: Vec<Given>,
    /// Identity of the file.
    pub digest: Digest,
}

/// Reads the table: header `group,emissivity,temperature,flux`; of the last two exactly one is given in each line.
///
/// # Errors
/// What cannot be read, with its line; groups that are missing, unknown or given twice.
pub fn read(path: &Path, mesh: &Mesh) -> interchange::Result<ThermalTable> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes.as_slice());
    let line_of = |position: Option<&csv::Position>| position.map_or(1, |position| position.line() as usize);
    let header = reader.headers().map_err(|e| Error::scene(path, line_of(e.position()), e.to_string()))?;
    if header != COLUMNS.as_slice() {
        let found = header.iter().collect::<Vec<_>>().join(",");
        let message = format!("header \"{found}\", expected \"{}\"", COLUMNS.join(","));
        return Err(Error::scene(path, 1, message));
    }
    let mut groups: Vec<Option<Given>> = vec![None; mesh.groups.len()];
    for record in reader.records() {
        let record = record.map_err(|e| Error::scene(path, line_of(e.position()), e.to_string()))?;
        let line = line_of(record.position());
        let mistake = |message: String| Error::scene(path, line, message);
        let name = &record[0];
        let Some(group) = mesh.groups.iter().position(|known| known == name) else {
            let near = nearest_name(name, mesh.groups.iter().map(String::as_str));
            let near = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
            return Err(mistake(format!("the mesh has no group {name}{near}")));
        };
        if groups[group].is_some() {
            return Err(mistake(format!("group {name} is given twice")));
        }
        groups[group] = Some(given(&record).map_err(mistake)?);
    }
    let used: Vec<bool> = {
        let mut used = vec![false; mesh.groups.len()];
        mesh.element_ids().for_each(|e| used[mesh.element_group(e).index()] = true);
        used
    };
    if let Some(missing) = (0..groups.len()).find(|&g| used[g] && groups[g].is_none()) {
        let message = format!("group {} is missing: give its temperature or its flux", mesh.groups[missing]);
        return Err(Error::whole(path, message));
    }
    let groups: Vec<Given> =
        groups.into_iter().map(|given| given.unwrap_or(Given::Flux(0.0, None))).collect();
    if !groups.iter().any(|given| matches!(given, Given::Temperature(..))) {
        let message = "no group has a temperature, so none can be found for the others; give at least one";
        return Err(Error::whole(path, message));
    }
    Ok(ThermalTable { groups, digest: Digest::of(&bytes) })
}

fn given(record: &csv::StringRecord) -> std::result::Result<Given, String> {
    let number = |column: usize| -> std::result::Result<Option<f64>, String> {
        let field = &record[column];
        if field.is_empty() {
            return Ok(None);
        }
        let value: Option<f64> = field.parse().ok().filter(|value: &f64| value.is_finite());
        value.map(Some).ok_or_else(|| format!("{} is \"{field}\", expected a number", COLUMNS[column]))
    };
    let (emissivity, temperature, flux) = (number(1)?, number(2)?, number(3)?);
    if emissivity.is_some_and(|e| !(0.0..=1.0).contains(&e)) {
        return Err(format!("emissivity is {}, expected 0 to 1", &record[1]));
    }
    match (temperature, flux) {
        (Some(kelvin), _) if kelvin < 0.0 => {
            Err(format!("temperature is {kelvin}, expected kelvins, at least 0"))
        }
        (Some(kelvin), None) => match emissivity {
            Some(emissivity) => Ok(Given::Temperature(kelvin, emissivity)),
            None => Err("a temperature needs an emissivity".into()),
        },
        (None, Some(flux)) if flux != 0.0 && emissivity.unwrap_or(0.0) == 0.0 => {
            Err("a flux other than 0 needs an emissivity above 0 to leave by".into())
        }
        (None, Some(flux)) => Ok(Given::Flux(flux, emissivity)),
        (Some(_), Some(_)) => Err("temperature and flux are both given, expected one of them".into()),
        (None, None) => Err("neither temperature nor flux is given, expected one of them".into()),
    }
}

impl ThermalTable {
    /// The channel that is solved: all wavelengths together.
    pub fn channel(&self, mesh: &Mesh) -> Channel {
        let mut channel = Channel::default();
        for element in mesh.element_ids() {
            let (reflectance, exitance) = match self.groups[mesh.element_group(element).index()] {
                Given::Temperature(kelvin, emissivity) => {
                    (1.0 - emissivity, emissivity * STEFAN_BOLTZMANN * kelvin.powi(4))
                }
                Given::Flux(flux, _) => (1.0, flux),
            };
            channel.reflectance.push(reflectance);
            channel.exitance.push(exitance);
        }
        channel
    }

    /// Temperature, K, and emissivity of every element, given its irradiance. Without an emissivity the temperature is
    /// that of a black surface, and so is the emissivity told, 1.
    ///
    /// # Errors
    /// A flux that draws more heat out of a group than it can receive.
    pub fn temperatures(&self, mesh: &Mesh, irradiance: &[f64]) -> Result<Vec<[f64; 2]>> {
        let of = |element: interchange::ids::ElementId| {
            let group = mesh.element_group(element).index();
            match self.groups[group] {
                Given::Temperature(kelvin, emissivity) => Ok([kelvin, emissivity]),
                Given::Flux(flux, emissivity) => {
                    let own = emissivity.filter(|&e| e > 0.0).unwrap_or(1.0);
                    let black = irradiance[element.index()] + flux / own;
                    // An irradiance of 0 may come out a rounding below.
                    match black >= -f64::EPSILON * flux.abs() / own {
                        true => Ok([(black.max(0.0) / STEFAN_BOLTZMANN).powf(0.25), own]),
                        false => Err(SolveError::BelowZero { group: mesh.groups[group].clone(), flux }),
                    }
                }
            }
        };
        mesh.element_ids().map(of).collect()
    }
}
