//! Scenes written by the tests themselves: polygons with a name and a paint, as OBJ and MTL.

use serde_json::Value;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A diffuse surface's reflectance and exitance, each per channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Reflectance, 0 to 1.
    pub reflectance: [f64; 3],
    /// Emitted power per area, E, in W m^-2.
    pub emission: [f64; 3],
}

impl Paint {
    /// The same in all channels.
    pub fn grey(reflectance: f64, emission: f64) -> Self {
        Self { reflectance: [reflectance; 3], emission: [emission; 3] }
    }
}

/// A polygon, counter-clockwise seen from its front; its name is its group.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Group.
    pub name: String,
    /// Corners.
    pub corners: Vec<[f64; 3]>,
    /// What it reflects and emits.
    pub paint: Paint,
}

impl Surface {
    /// A surface that reflects half.
    pub fn new(name: &str, corners: impl IntoIterator<Item = [f64; 3]>) -> Self {
        Self { name: name.to_owned(), corners: corners.into_iter().collect(), paint: Paint::grey(0.5, 0.0) }
    }

    /// The same surface with another paint.
    pub fn painted(self, paint: Paint) -> Self {
        Self { paint, ..self }
    }
}

/// Writes `s.obj` and `s.mtl` into `folder`; one face, group and material for each surface, in the given order.
pub fn write(folder: &Path, surfaces: &[Surface]) -> PathBuf {
    let (mut obj, mut mtl) = (String::from("mtllib s.mtl\n"), String::new());
    let mut written = 0;
    for (number, surface) in surfaces.iter().enumerate() {
        let channels = |value: [f64; 3]| value.map(|x| format!("{x:?}")).join(" ");
        // Ke is radiance: a Lambertian surface's exitance divided by pi.
        let radiance = surface.paint.emission.map(|emission| emission / PI);
        writeln!(mtl, "newmtl m{number}\nKd {}", channels(surface.paint.reflectance)).expect("text");
        writeln!(mtl, "Ke {}\n", channels(radiance)).expect("text");
        writeln!(obj, "g {}\nusemtl m{number}", surface.name).expect("text");
        surface.corners.iter().for_each(|&corner| writeln!(obj, "v {}", channels(corner)).expect("text"));
        let indices = (1..=surface.corners.len()).map(|corner| (written + corner).to_string());
        writeln!(obj, "f {}", indices.collect::<Vec<_>>().join(" ")).expect("text");
        written += surface.corners.len();
    }
    let path = folder.join("s.obj");
    std::fs::write(&path, obj).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    std::fs::write(folder.join("s.mtl"), mtl).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    path
}

/// The six sides of a box seen from inside, in the order z=0, z=c, y=0, y=b, x=0, x=a.
pub fn room([a, b, c]: [f64; 3]) -> Vec<Surface> {
    let side = |name: &str, corners: [[f64; 3]; 4]| Surface::new(name, corners);
    vec![
        side("z=0", [[0.0, 0.0, 0.0], [a, 0.0, 0.0], [a, b, 0.0], [0.0, b, 0.0]]),
        side("z=c", [[0.0, b, c], [a, b, c], [a, 0.0, c], [0.0, 0.0, c]]),
        side("y=0", [[0.0, 0.0, 0.0], [0.0, 0.0, c], [a, 0.0, c], [a, 0.0, 0.0]]),
        side("y=b", [[a, b, 0.0], [a, b, c], [0.0, b, c], [0.0, b, 0.0]]),
        side("x=0", [[0.0, 0.0, 0.0], [0.0, b, 0.0], [0.0, b, c], [0.0, 0.0, c]]),
        side("x=a", [[a, 0.0, c], [a, b, c], [a, b, 0.0], [a, 0.0, 0.0]]),
    ]
}

/// A file of the references in JSON.
pub fn json(name: &str) -> Value {
    let path = crate::reference(name);
    serde_json::from_str(&crate::text(&path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The entries of a JSON list.
#[track_caller]
pub fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("a list was expected: {value}"))
}

/// A number, written as such or as a decimal string.
#[track_caller]
pub fn number(value: &Value) -> f64 {
    let number = value.as_f64().or_else(|| value.as_str()?.parse().ok());
    number.unwrap_or_else(|| panic!("a number was expected: {value}"))
}

/// A text.
#[track_caller]
pub fn string(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("a text was expected: {value}"))
}

/// A list of points.
#[track_caller]
pub fn corners(value: &Value) -> Vec<[f64; 3]> {
    let point = |point: &Value| [number(&point[0]), number(&point[1]), number(&point[2])];
    list(value).iter().map(point).collect()
}
