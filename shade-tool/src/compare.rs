//! By how much two pictures differ, where most: OpenEXR channel by channel in its own units, PNG in 255ths.

use crate::error::{Error, Result};
use exr::prelude::FlatSamples;
use interchange::counted::counted;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// First bytes of every PNG file.
const PNG_MAGIC: [u8; 4] = [0x89, b'P', b'N', b'G'];

/// A picture as planes of numbers.
struct Planes {
    size: [usize; 2],
    /// By layer and channel (`layer.channel`), row after row.
    channels: BTreeMap<String, Vec<f64>>,
}

/// How one channel differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name, with its layer where that has one.
    pub name: String,
    /// Root of the mean of the squared differences.
    pub rms: f64,
    /// The same in units of the first picture's mean absolute value; 0 where both are 0.
    pub relative_rms: f64,
    /// Mean of the absolute differences.
    pub mean: f64,
    /// Half of the pixels differ by less, and 99 of 100 by less: edges and lamps, where single pixels are far apart, left out.
    pub within: [f64; 2],
    /// The first of these in units of the first picture's mean absolute value.
    pub relative_median: f64,
    /// Largest absolute difference.
    pub worst: f64,
    /// Column and row of it, from 0, the picture's top left.
    pub at: [usize; 2],
    /// The two values there.
    pub values: [f64; 2],
    /// Pixels where exactly one picture holds a finite number.
    pub not_finite: usize,
}

/// How two pictures differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Width and height.
    pub size: [usize; 2],
    /// What the values are counted in.
    pub unit: &'static str,
    /// Channels that both have.
    pub channels: Vec<Channel>,
    /// Channels that only the first has, and only the second.
    pub alone: [Vec<String>; 2],
}

impl Difference {
    /// Compares two pictures of one size.
    ///
    /// # Errors
    /// A file cannot be read, they differ in kind or size, or have no channel in common.
    pub fn between(first: &Path, second: &Path) -> Result<Self> {
        let (a, b) = (read(first)?, read(second)?);
        let mismatch = |detail: String| {
            let remedy =
                "render both with one camera and size, and compare EXR with EXR or PNG with PNG".into();
            interchange::Error::Mismatch { first: first.into(), second: second.into(), detail, remedy }
        };
        if is_png(first) != is_png(second) {
            return Err(mismatch("one is a PNG, the other an OpenEXR picture".into()).into());
        }
        if a.size != b.size {
            let [[w, h], [v, g]] = [a.size, b.size];
            return Err(mismatch(format!("one has {w} x {h} pixels, the other {v} x {g}")).into());
        }
        let only = |a: &Planes, b: &Planes| -> Vec<String> {
            a.channels.keys().filter(|name| !b.channels.contains_key(*name)).cloned().collect()
        };
        let channels: Vec<Channel> = a
            .channels
            .iter()
            .filter_map(|(name, values)| Some(channel(name, a.size[0], values, b.channels.get(name)?)))
            .collect();
        if channels.is_empty() {
            return Err(mismatch("they have no channel in common".into()).into());
        }
        let unit = if is_png(first) { "255ths" } else { "as stored (radiance: W m^-2 sr^-1)" };
        Ok(Self { size: a.size, unit, channels, alone: [only(&a, &b), only(&b, &a)] })
    }

    /// The largest relative difference (RMS) of any common channel.
    pub fn relative(&self) -> f64 {
        self.channels.iter().map(|c| c.relative_rms).fold(0.0, f64::max)
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut text = format!("compared     {} x {} pixels, {}\n", self.size[0], self.size[1], self.unit);
        for c in &self.channels {
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "{:<12} RMS {:.6e}, {:.3} % of the mean; mean {:.6e}; half within {:.6e} ({:.3} %), 99 % within {:.6e}; worst {:.6e}",
                c.name,
                c.rms,
                100.0 * c.relative_rms,
                c.mean,
                c.within[0],
                100.0 * c.relative_median,
                c.within[1],
                c.worst
            );
            if c.worst > 0.0 {
                let _ = write!(
                    text,
                    " at column {}, row {}: {:.6e} and {:.6e}",
                    c.at[0], c.at[1], c.values[0], c.values[1]
                );
            }
            if c.not_finite > 0 {
                let _ =
                    write!(text, "; {} finite in one alone", counted(c.not_finite, "pixel is", "pixels are"));
            }
            text.push('\n');
        }
        for (names, which) in self.alone.iter().zip(["first", "second"]) {
            if !names.is_empty() {
                let _ = writeln!(text, "{which:<12} alone has {}", names.join(", "));
            }
        }
        text
    }

    /// For scripts.
    pub fn json(&self) -> Value {
        let channels: Vec<Value> = self
            .channels
            .iter()
            .map(|c| {
                json!({
                    "name": c.name, "rms": c.rms, "relative_rms": c.relative_rms, "mean": c.mean, "worst": c.worst,
                    "within": c.within, "relative_median": c.relative_median,
                    "at": c.at, "values": c.values, "not_finite": c.not_finite,
                })
            })
            .collect();
        json!({
            "kind": "picture comparison", "size": self.size, "unit": self.unit, "channels": channels,
            "first_alone": self.alone[0], "second_alone": self.alone[1],
        })
    }
}

fn channel(name: &str, width: usize, first: &[f64], second: &[f64]) -> Channel {
    let (mut squares, mut sum, mut light, mut not_finite) = (0.0, 0.0, 0.0, 0);
    let (mut worst, mut place) = (0.0, 0);
    let mut differences = Vec::with_capacity(first.len());
    for (i, (a, b)) in first.iter().zip(second).enumerate() {
        if !(a.is_finite() && b.is_finite()) {
            not_finite += usize::from(a.is_finite() != b.is_finite());
            continue;
        }
        let difference = (a - b).abs();
        squares += difference * difference;
        sum += difference;
        light += a.abs();
        differences.push(difference);
        if difference > worst {
            (worst, place) = (difference, i);
        }
    }
    let count = differences.len().max(1) as f64;
    differences.sort_unstable_by(f64::total_cmp);
    let within = [0.5, 0.99].map(|share| {
        let at = (share * count) as usize;
        differences.get(at.min(differences.len().saturating_sub(1))).copied().unwrap_or(0.0)
    });
    let rms = (squares / count).sqrt();
    let relative = |x: f64| if x == 0.0 { 0.0 } else { x / (light / count) };
    let values = [first, second].map(|v| v.get(place).copied().unwrap_or(0.0));
    Channel {
        name: name.to_owned(),
        rms,
        relative_rms: relative(rms),
        mean: sum / count,
        within,
        relative_median: relative(within[0]),
        worst,
        at: [place % width.max(1), place / width.max(1)],
        values,
        not_finite,
    }
}

fn is_png(path: &Path) -> bool {
    use std::io::Read;
    let mut first = [0; 4];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut first)).is_ok() && first == PNG_MAGIC
}

fn read(path: &Path) -> Result<Planes> {
    if is_png(path) { png_planes(path) } else { exr_planes(path) }
}

fn exr_planes(path: &Path) -> Result<Planes> {
    let image = crate::exr_reader::read_all(path)?;
    let mut planes = Planes { size: [0, 0], channels: BTreeMap::new() };
    for layer in &image.layer_data {
        planes.size = [layer.size.0, layer.size.1];
        let prefix = layer.attributes.layer_name.as_ref().map(|name| format!("{name}.")).unwrap_or_default();
        for channel in &layer.channel_data.list {
            let values = match &channel.sample_data {
                FlatSamples::F16(v) => v.iter().map(|x| f64::from(x.to_f32())).collect(),
                FlatSamples::F32(v) => v.iter().map(|&x| f64::from(x)).collect(),
                FlatSamples::U32(v) => v.iter().map(|&x| f64::from(x)).collect(),
            };
            planes.channels.insert(format!("{prefix}{}", channel.name), values);
        }
    }
    Ok(planes)
}

fn png_planes(path: &Path) -> Result<Planes> {
    let refused = |error: String| Error::Picture { path: path.into(), found: error };
    let file = std::fs::File::open(path).map_err(|e| interchange::Error::io(path, "open", e))?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|e| refused(e.to_string()))?;
    let length = reader.output_buffer_size().ok_or_else(|| refused("a picture too large to hold".into()))?;
    let mut bytes = vec![0; length];
    let frame = reader.next_frame(&mut bytes).map_err(|e| refused(e.to_string()))?;
    let names: &[&str] = match frame.color_type {
        png::ColorType::Grayscale => &["Y"],
        png::ColorType::GrayscaleAlpha => &["Y", "A"],
        png::ColorType::Rgba => &["R", "G", "B", "A"],
        _ => &["R", "G", "B"],
    };
    let size = [frame.width as usize, frame.height as usize];
    let pixels = &bytes[..size[0] * size[1] * names.len()];
    let plane = |k: usize| pixels.iter().skip(k).step_by(names.len()).map(|&x| f64::from(x)).collect();
    let channels = names.iter().enumerate().map(|(k, name)| ((*name).to_owned(), plane(k))).collect();
    Ok(Planes { size, channels })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn differences_are_placed_and_weighed() {
        let found = channel("R", 2, &[1.0, 2.0, 3.0, f64::INFINITY], &[1.0, 2.0, 0.0, 1.0]);
        assert_eq!((found.worst, found.at, found.values), (3.0, [0, 1], [3.0, 0.0]));
        assert_eq!((found.mean, found.not_finite, found.within), (1.0, 1, [0.0, 3.0]));
        assert!((found.rms - 3f64.sqrt()).abs() < 1e-15);
        assert!((found.relative_rms - 3f64.sqrt() / 2.0).abs() < 1e-15);
        assert_eq!(channel("R", 1, &[0.0], &[0.0]).relative_rms, 0.0);
    }

    fn png(path: &Path, width: u32, bytes: &[u8]) {
        let file = std::fs::File::create(path).unwrap();
        let mut encoder = png::Encoder::new(file, width, bytes.len() as u32 / 3 / width);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(bytes).unwrap();
    }

    #[test]
    fn previews_are_compared_in_255ths_and_other_sizes_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.png", "b.png", "c.png"].map(|name| folder.path().join(name));
        png(&a, 2, &[10, 20, 30, 40, 50, 60]);
        png(&b, 2, &[10, 20, 30, 40, 55, 60]);
        png(&c, 1, &[10, 20, 30]);
        let found = Difference::between(&a, &b).unwrap();
        let green = found.channels.iter().find(|c| c.name == "G").unwrap();
        assert_eq!((green.worst, green.at, green.values), (5.0, [1, 0], [50.0, 55.0]));
        assert!(found.text().contains("worst 5.000000e0 at column 1, row 0"));
        let said = Difference::between(&a, &c).unwrap_err().to_string();
        assert!(said.contains("2 x 1 pixels, the other 1 x 1"), "{said}");
    }
}
