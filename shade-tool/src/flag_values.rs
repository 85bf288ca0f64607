//! Values of flags: ways to interpolate, and what a text must be to be a vector, a size, an angle or the name of a file.

use crate::judge::Scheme;
use clap::ValueEnum;
use glam::DVec3;
use interchange::atomic_write::is_stdout;
use interchange::error::meant_ending;
use interchange::tool::positive;
use std::path::{Path, PathBuf};

/// Largest picture side: 2^16 pixels, beyond any display or print.
const LARGEST_SIDE: u32 = 1 << 16;
/// Largest picture: 2^28 pixels, 6 GB while it is made.
const LARGEST_PICTURE: u64 = 1 << 28;

/// How light is interpolated over elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Interpolation {
    /// By the tolerance: quadratic from 0.005 on, gather below
    Auto,
    /// The solution's own value all over each element
    Constant,
    /// Between gathered corners, cut where that is not good enough
    Linear,
    /// Between gathered corners and middles of edges, cut where that is not good enough
    Quadratic,
    /// Quadratic where that is good, gathered at every sample elsewhere
    Gather,
}

/// Tolerance from which on `auto` interpolates. Linear interpolation is never chosen: on the Cornell box it takes longer
/// and is farther off at 0.01, 0.02 and 0.05.
const AUTO_QUADRATIC: f64 = 0.005;

impl Interpolation {
    /// The scheme at a tolerance; `None` for constant elements.
    pub fn scheme(self, tolerance: f64) -> Option<Scheme> {
        match self {
            Interpolation::Constant => None,
            Interpolation::Linear => Some(Scheme::Linear),
            Interpolation::Quadratic => Some(Scheme::Quadratic),
            Interpolation::Gather => Some(Scheme::Gather),
            Interpolation::Auto if tolerance >= AUTO_QUADRATIC => Some(Scheme::Quadratic),
            Interpolation::Auto => Some(Scheme::Gather),
        }
    }
}

/// The name of a file with that ending.
pub fn ends_in(ending: &'static str) -> impl Fn(&str) -> Result<PathBuf, String> + Clone {
    move |text| {
        let path = PathBuf::from(text);
        let found = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if found.as_deref() == Some(ending) {
            Ok(path)
        } else {
            Err(format!("the name must end in .{ending}{}", meant_ending(&path, [ending])))
        }
    }
}

/// The name of a table: one of two endings, or `-` for standard output.
pub fn table(endings: [&'static str; 2]) -> impl Fn(&str) -> Result<PathBuf, String> + Clone {
    move |text| {
        let path = Path::new(text);
        if is_stdout(path) {
            return Ok(path.into());
        }
        let fits = endings.iter().find_map(|ending| ends_in(ending)(text).ok());
        fits.ok_or_else(|| {
            let meant = meant_ending(path, endings);
            format!("the name must end in .{} or .{}{meant}", endings[0], endings[1])
        })
    }
}

/// So many finite numbers with commas.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    values
        .and_then(|values| values.try_into().ok())
        .ok_or_else(|| format!("expected {N} finite numbers with commas"))
}

/// Three numbers.
pub fn vector(text: &str) -> Result<DVec3, String> {
    numbers(text).map(DVec3::from_array)
}

/// Width and height of a film.
pub fn film(text: &str) -> Result<[f64; 2], String> {
    let film = numbers(text)?;
    if film.iter().all(|&x| x > 0.0) { Ok(film) } else { Err("expected two numbers above 0".into()) }
}

/// Degrees of a field of view.
pub fn angle(text: &str) -> Result<f64, String> {
    let degrees = positive(text)?;
    if degrees < 180.0 { Ok(degrees) } else { Err("expected an angle below 180 degrees".into()) }
}

/// Width and height of a picture in pixels.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let sides: [u32; 2] = sides.ok_or("expected WIDTHxHEIGHT, such as 640x480")?;
    let fits = sides.iter().all(|side| (1..=LARGEST_SIDE).contains(side));
    let pixels = u64::from(sides[0]) * u64::from(sides[1]);
    if fits && pixels <= LARGEST_PICTURE {
        Ok(sides)
    } else {
        Err(format!("expected sides of 1 to {LARGEST_SIDE} and at most {LARGEST_PICTURE} pixels"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_vectors_and_angles_are_checked() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert!(["", "640", "0x1", "1x-1", "65537x1", "65536x65536"].iter().all(|text| size(text).is_err()));
        assert_eq!(vector("1,-2e3, 0.5"), Ok(DVec3::new(1.0, -2e3, 0.5)));
        assert!(["1,2", "1,2,3,4", "1,2,NaN", "1,2,inf", "a,b,c"].iter().all(|text| vector(text).is_err()));
        assert!(angle("180").is_err() && angle("0").is_err() && angle("40").is_ok());
    }
}
