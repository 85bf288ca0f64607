//! What a picture holds: size, channels with their ranges, attributes.

use crate::error::{Error, Result};
use crate::exr_reader::read_all;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::FlatSamples;
use interchange::tables::number;
use serde_json::{Value, json};
use std::io::Read;
use std::path::Path;

/// First bytes of every OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// Which tool tells about files of the other stages.
const OTHER_STAGES: [(&str, &str); 4] =
    [("mesh", "mesh-tool"), ("materials", "mesh-tool"), ("ff", "formfactor-tool"), ("sol", "solve-tool")];

/// A picture file.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureInfo {
    /// Width and height of each layer, with its name and its channels.
    pub layers: Vec<LayerInfo>,
    /// Name and value of each attribute of the file, sorted by name.
    pub attributes: Vec<(String, String)>,
}

/// A layer of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerInfo {
    /// Name, often none.
    pub name: Option<String>,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Channels in alphabetical order.
    pub channels: Vec<ChannelInfo>,
}

/// A channel of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelInfo {
    /// Name.
    pub name: String,
    /// `half`, `float` or `uint`.
    pub precision: &'static str,
    /// Lowest, highest and mean of the finite values; NaN where there are none.
    pub range: [f64; 3],
    /// Number of values that are infinite or not a number.
    pub not_finite: usize,
}

/// Reads the picture; files of other stages are refused by the name of the tool that shows them.
pub fn read(path: &Path) -> Result<PictureInfo> {
    let image = read_all(path)?;
    let refused = |error: exr::error::Error| Error::Picture { path: path.into(), found: error.to_string() };
    let meta = MetaData::read_from_file(path, false).map_err(refused)?;
    let layers = image.layer_data.iter().map(|layer| LayerInfo {
        name: layer.attributes.layer_name.as_ref().map(utf8),
        size: [layer.size.0, layer.size.1],
        channels: layer
            .channel_data
            .list
            .iter()
            .map(|channel| {
                let precision = match channel.sample_data {
                    FlatSamples::F16(_) => "half",
                    FlatSamples::F32(_) => "float",
                    FlatSamples::U32(_) => "uint",
                };
                let values = channel.sample_data.values_as_f32().map(f64::from);
                channel_info(utf8(&channel.name), precision, values)
            })
            .collect(),
    });
    let mut attributes: Vec<(String, String)> = meta
        .headers
        .iter()
        .flat_map(|header| header.all_named_attributes())
        .filter(|(_, value)| !matches!(value, AttributeValue::ChannelList(_)))
        .map(|(name, value)| (String::from_utf8_lossy(name).into_owned(), shown(&value)))
        .collect();
    attributes.sort();
    attributes.dedup();
    Ok(PictureInfo { layers: layers.collect(), attributes })
}

/// Refuses what is no OpenEXR picture; a file of another stage by the name of the tool that shows it.
pub fn check_kind(path: &Path) -> Result<()> {
    let mut file = std::fs::File::open(path).map_err(|e| interchange::Error::io(path, "open", e))?;
    let mut first = [0; 4];
    let is_picture = file.read_exact(&mut first).is_ok() && first == MAGIC;
    if is_picture {
        return Ok(());
    }
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let stage = OTHER_STAGES.iter().find(|(name, _)| *name == ending);
    let message = match stage {
        Some((_, tool)) => format!("not an OpenEXR picture; {tool} info {} shows it", path.display()),
        None => "not an OpenEXR picture: its first four bytes are other ones".into(),
    };
    Err(interchange::Error::whole(path, message).into())
}

fn channel_info(name: String, precision: &'static str, values: impl Iterator<Item = f64>) -> ChannelInfo {
    let (mut low, mut high, mut sum, mut finite, mut not_finite) =
        (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0, 0);
    for value in values {
        if value.is_finite() {
            (low, high, sum, finite) = (low.min(value), high.max(value), sum + value, finite + 1);
        } else {
            not_finite += 1;
        }
    }
    let range = if finite > 0 { [low, high, sum / finite as f64] } else { [f64::NAN; 3] };
    ChannelInfo { name, precision, range, not_finite }
}

fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn shown(value: &AttributeValue) -> String {
    match value {
        AttributeValue::Text(text) => utf8(text),
        AttributeValue::F32(x) => number(f64::from(*x)),
        AttributeValue::F64(x) => number(*x),
        AttributeValue::I32(x) => x.to_string(),
        other => format!("{other:?}"),
    }
}

impl PictureInfo {
    /// For people.
    pub fn text(&self) -> String {
        let mut text = String::from("picture (OpenEXR)\n");
        for layer in &self.layers {
            let name = layer.name.as_ref().map(|name| format!(" {name}")).unwrap_or_default();
            text += &format!("layer{name}: {} x {} pixels\n", layer.size[0], layer.size[1]);
            for channel in &layer.channels {
                let [low, high, mean] = channel.range;
                text += &format!(
                    "  {} {}: {low:.6} to {high:.6}, mean {mean:.6}, {} not finite\n",
                    channel.name, channel.precision, channel.not_finite
                );
            }
        }
        text += "attributes:\n";
        self.attributes.iter().fold(text, |text, (name, value)| text + &format!("  {name}: {value}\n"))
    }

    /// For programs.
    pub fn json(&self) -> Value {
        let channel = |channel: &ChannelInfo| {
            json!({
                "name": channel.name, "precision": channel.precision, "not_finite": channel.not_finite,
                "min": channel.range[0], "max": channel.range[1], "mean": channel.range[2],
            })
        };
        let layers: Vec<Value> = self
            .layers
            .iter()
            .map(|layer| {
                let channels: Vec<Value> = layer.channels.iter().map(channel).collect();
                json!({ "name": layer.name, "width": layer.size[0], "height": layer.size[1], "channels": channels })
            })
            .collect();
        let attributes: serde_json::Map<String, Value> =
            self.attributes.iter().map(|(name, value)| (name.clone(), value.clone().into())).collect();
        json!({ "kind": "picture", "layers": layers, "attributes": attributes })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::exr_file::{self, Precision};
    use crate::picture::Picture;
    use interchange::provenance::Provenance;

    fn label(provenance: &Provenance) -> exr_file::Label<'_> {
        exr_file::Label { provenance, camera: None, efficacy: 179.0, remarks: String::new() }
    }

    #[test]
    fn picture_tells_size_ranges_and_provenance() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.exr");
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[0.0, 0.5, 1.0], [2.0, 0.25, 1e9]],
            ..Picture::default()
        };
        let provenance = Provenance::new("shade-tool", "1.2").flag("--samples 4");
        exr_file::write(&path, &picture, Precision::Half, &label(&provenance)).unwrap();
        let info = read(&path).unwrap();
        assert_eq!(info.layers[0].size, [2, 1]);
        let names: Vec<&str> = info.layers[0].channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["B", "G", "R"]);
        assert_eq!(info.layers[0].channels[0].not_finite, 1);
        assert_eq!(info.layers[0].channels[1].range, [0.25, 0.5, 0.375]);
        let json = info.json();
        assert_eq!(json["layers"][0]["channels"][2]["max"], 2.0);
        assert!(json["attributes"]["provenance"].as_str().unwrap().contains("--samples 4"));
        assert!(info.text().contains("software: shade-tool 1.2"), "{}", info.text());
        assert!(info.text().contains("G half: 0.250000 to 0.500000, mean 0.375000"));
    }

    #[test]
    fn other_files_are_refused_with_the_tool_that_shows_them() {
        let folder = tempfile::tempdir().unwrap();
        for (name, word) in [("s.sol", "solve-tool info"), ("s.exr", "not an OpenEXR picture")] {
            let path = folder.path().join(name);
            std::fs::write(&path, b"something").unwrap();
            assert!(read(&path).unwrap_err().to_string().contains(word));
        }
        let path = folder.path().join("cut.exr");
        let picture =
            Picture { width: 9, height: 40, pixels: vec![[1.0, 2.0, 0.1]; 360], ..Picture::default() };
        exr_file::write(&path, &picture, Precision::Float, &label(&Provenance::new("t", "1"))).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [4, 5, 100, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(matches!(read(&path), Err(Error::Picture { .. })), "cut to {length} bytes");
        }
    }
}
