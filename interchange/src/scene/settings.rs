//! `NAME.toml` beside `NAME.obj`: cameras, two-sided materials, units. Every mistake is told with its line.

use super::camera_check;
use super::statement::{decode, shown};
use crate::error::{Error, Result, nearest_name};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// Keys the file may hold.
const KEYS: [&str; 4] = ["camera", "two_sided", "units", "medium"];

/// Keys of a camera, as [`CameraSettings`] has them.
const CAMERA_KEYS: [&str; 10] = [
    "name",
    "eye",
    "look_at",
    "up",
    "resolution",
    "focal_length",
    "film",
    "fov_deg",
    "projection",
    "view_height",
];

/// Units of length that `units` may name.
const UNITS: [&str; 9] = ["m", "km", "dm", "cm", "mm", "um", "in", "ft", "yd"];

/// How a camera turns places of the picture into rays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProjectionSettings {
    /// Through a pinhole.
    #[default]
    Perspective,
    /// Parallel rays.
    Orthographic,
    /// All directions, longitude by latitude.
    Equirectangular,
}

/// A camera as the toml describes it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Name, where there are several.
    pub name: Option<String>,
    /// Place of the eye.
    pub eye: [f64; 3],
    /// Point in the middle of the picture; not the eye.
    pub look_at: [f64; 3],
    /// Direction that is up in the picture; need not be perpendicular to the view, but not parallel to it.
    pub up: [f64; 3],
    /// Width and height in pixels, each 1 to 65536.
    pub resolution: [u32; 2],
    /// Focal length, in the unit of `film`, greater than 0.
    pub focal_length: Option<f64>,
    /// Width and height of the film, in the unit of `focal_length`, greater than 0.
    pub film: Option<[f64; 2]>,
    /// Vertical field of view in degrees, between 0 and 180, instead of focal length and film.
    pub fov_deg: Option<f64>,
    /// Projection; a pinhole where absent.
    #[serde(default)]
    pub projection: ProjectionSettings,
    /// Height of an orthographic picture in the scene's unit, greater than 0.
    pub view_height: Option<f64>,
}

/// Contents of the toml.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// Cameras, in file order; names unique where there are several.
    pub cameras: Vec<CameraSettings>,
    /// Materials whose both sides emit, reflect and receive.
    pub two_sided: Vec<String>,
    /// Unit of length; metres where absent.
    pub units: Option<String>,
}

impl Settings {
    /// Reads a settings file. Whether `two_sided` names materials that exist is for the scene to say.
    pub fn read(path: &Path) -> Result<Settings> {
        Located::read(path).map(|located| located.settings)
    }
}

/// Settings, and where they stand.
#[derive(Debug, Default)]
pub(super) struct Located {
    /// The settings.
    pub settings: Settings,
    /// Line of each entry of `two_sided`.
    pub two_sided_lines: Vec<usize>,
}

impl Located {
    /// Reads a settings file.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
        Self::parse(path, decode(path, &bytes)?)
    }

    /// Reads `text`, the contents of `path`.
    fn parse(path: &Path, text: &str) -> Result<Self> {
        let line_ends = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(at, _)| at);
        let source = Source { path, line_ends: line_ends.collect() };
        let table = DeTable::parse(text).map_err(|e| source.error_of(&e, 0))?.into_inner();
        let mut located = Self::default();
        for (key, value) in table {
            let line = source.line(key.span().start);
            match key.get_ref().as_ref() {
                "camera" => located.settings.cameras = source.cameras(value)?,
                "two_sided" => {
                    let names: Vec<Spanned<String>> = source.value(value)?;
                    located.two_sided_lines =
                        names.iter().map(|name| source.line(name.span().start)).collect();
                    located.settings.two_sided = names.into_iter().map(Spanned::into_inner).collect();
                }
                "units" => located.settings.units = Some(source.units(value)?),
                "medium" => {
                    let message =
                        "[medium] is not supported yet; remove it to compute the scene in clear air";
                    return Err(source.error(line, message));
                }
                other => {
                    let remedy = match nearest_name(other, KEYS.into_iter()) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => "expected camera, two_sided or units".to_owned(),
                    };
                    return Err(source.error(line, format!("unknown key `{}`; {remedy}", shown(other))));
                }
            }
        }
        Ok(located)
    }
}

/// The file, for lines and messages.
struct Source<'p> {
    path: &'p Path,
    /// Places of the line feeds.
    line_ends: Vec<usize>,
}

impl Source<'_> {
    /// Line, from 1, of the byte `at`.
    fn line(&self, at: usize) -> usize {
        1 + self.line_ends.partition_point(|&end| end < at)
    }

    fn error(&self, line: usize, message: impl Into<String>) -> Error {
        Error::scene(self.path, line, message)
    }

    /// What the toml reader found wrong; `around` is where to look if it does not say.
    fn error_of(&self, error: &toml::de::Error, around: usize) -> Error {
        let line = self.line(error.span().map_or(around, |span| span.start));
        self.error(line, error.message().replace('\n', ", "))
    }

    fn value<'t, T: Deserialize<'t>>(&self, value: Spanned<DeValue<'t>>) -> Result<T> {
        let around = value.span().start;
        T::deserialize(ValueDeserializer::from(value)).map_err(|e| self.error_of(&e, around))
    }

    fn units(&self, value: Spanned<DeValue<'_>>) -> Result<String> {
        let line = self.line(value.span().start);
        let units: String = self.value(value)?;
        if !UNITS.contains(&units.as_str()) {
            let message =
                format!("units `{}` are not known; expected one of {}", shown(&units), UNITS.join(", "));
            return Err(self.error(line, message));
        }
        Ok(units)
    }

    /// `[camera]` or every `[[camera]]`.
    fn cameras(&self, value: Spanned<DeValue<'_>>) -> Result<Vec<CameraSettings>> {
        let span = value.span();
        let tables: Vec<Spanned<DeValue<'_>>> = match value.into_inner() {
            DeValue::Array(tables) => tables.into_iter().collect(),
            single => vec![Spanned::new(span, single)],
        };
        let several = tables.len() > 1;
        let mut cameras = Vec::with_capacity(tables.len());
        let mut lines_of_names: HashMap<String, usize> = HashMap::new();
        for table in tables {
            let at = Place { lines: self.lines_of_keys(&table), head: self.line(table.span().start) };
            if let Some((line, found, near)) = at.misspelt() {
                let message = format!("unknown key `{}` of a camera; did you mean `{near}`?", shown(found));
                return Err(self.error(line, message));
            }
            let camera: CameraSettings = self.value(table)?;
            camera_check::check(&camera).map_err(|(key, message)| self.error(at.line(key), message))?;
            if several {
                let Some(name) = camera.name.clone() else {
                    return Err(self.error(at.head, "there are several cameras; each needs a name"));
                };
                let line = at.line("name");
                if let Some(first) = lines_of_names.insert(name.clone(), line) {
                    let message =
                        format!("camera name `{}` is taken (line {first}); choose another", shown(&name));
                    return Err(self.error(line, message));
                }
            }
            cameras.push(camera);
        }
        Ok(cameras)
    }

    /// Lines of the keys of a table.
    fn lines_of_keys(&self, table: &Spanned<DeValue<'_>>) -> Vec<(String, usize)> {
        let table = table.get_ref().as_table();
        let keys = table.into_iter().flat_map(|table| table.keys());
        keys.map(|key| (key.get_ref().to_string(), self.line(key.span().start))).collect()
    }
}

/// Lines of a camera.
struct Place {
    lines: Vec<(String, usize)>,
    head: usize,
}

impl Place {
    /// Line of `key`, or of the table's head if it is missing.
    fn line(&self, key: &str) -> usize {
        self.lines.iter().find(|(name, _)| name == key).map_or(self.head, |(_, line)| *line)
    }

    /// The first key that is none of a camera but near one: its line, itself, and that one.
    fn misspelt(&self) -> Option<(usize, &str, &'static str)> {
        let unknown = self.lines.iter().filter(|(name, _)| !CAMERA_KEYS.contains(&name.as_str()));
        let mut near = unknown.filter_map(|(name, line)| {
            nearest_name(name, CAMERA_KEYS.into_iter()).map(|near| (*line, name.as_str(), near))
        });
        near.next()
    }
}

#[cfg(test)]
mod tests;
