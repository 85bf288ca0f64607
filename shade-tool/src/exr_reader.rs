//! Reads pictures back: radiance and layers of any OpenEXR file with channels R, G and B, and what `render` says of its own
//! (camera, digests of the inputs, luminous efficacy), so that a picture is looked at in new ways without being rendered
//! again.

use crate::camera::{Camera, Projection};
use crate::error::{Error, Result};
use crate::exr_file::PROVENANCE;
use crate::info::check_kind;
use crate::layers::{Layer, Values};
use crate::picture::Picture;
use clap::ValueEnum;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{AnyChannels, FlatSamples, Image, Layers};
use glam::DVec3;
use interchange::digest::Digest;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All layers and channels of a picture, as samples of the file's own kind.
pub type StoredImage = Image<Layers<AnyChannels<FlatSamples>>>;

/// Reads everything a picture holds.
pub fn read_all(path: &Path) -> Result<StoredImage> {
    check_kind(path)?;
    let refused = |error: exr::error::Error| Error::Picture { path: path.into(), found: error.to_string() };
    exr::image::read::read_all_flat_layers_from_file(path).map_err(refused)
}

/// A picture with what its file says of it.
#[derive(Debug, Clone)]
pub struct StoredPicture {
    /// The file.
    pub path: PathBuf,
    /// Radiance and layers.
    pub picture: Picture,
    /// Where it was seen from, if `render` wrote it.
    pub camera: Option<Camera>,
    /// Lumens per watt, where the file says so.
    pub efficacy: Option<f64>,
    /// Digest of each input, hexadecimal, by role.
    inputs: BTreeMap<String, String>,
}

impl StoredPicture {
    /// Reads a picture. Layers of other programs are left out.
    pub fn read(path: &Path) -> Result<StoredPicture> {
        let image = read_all(path)?;
        let named = |layer: &exr::prelude::Layer<_>| -> BTreeMap<String, FlatSamples> {
            let channels: &AnyChannels<FlatSamples> = &layer.channel_data;
            let name =
                |c: &exr::prelude::AnyChannel<_>| String::from_utf8_lossy(c.name.as_slice()).into_owned();
            // Channels with fewer samples than pixels are of no use here.
            let full = channels.list.iter().filter(|c| c.sample_data.len() == layer.size.0 * layer.size.1);
            full.map(|c| (name(c), c.sample_data.clone())).collect()
        };
        let found = image.layer_data.iter().find_map(|layer| {
            let channels = named(layer);
            let pixels = triples(&channels, ["R", "G", "B"].map(String::from))?;
            Some((layer, channels, pixels))
        });
        let Some((layer, channels, pixels)) = found else {
            return Err(Error::view(path, "no channels R, G and B", "remake it with shade-tool render"));
        };
        let layers =
            Layer::value_variants().iter().filter_map(|&kind| Some((kind, values(kind, &channels)?)));
        let bounce = |k: usize| triples(&channels, ["R", "G", "B"].map(|c| format!("bounces.{k}.{c}")));
        let picture = Picture {
            width: layer.size.0,
            height: layer.size.1,
            pixels,
            layers: layers.collect(),
            bounces: (0..).map_while(bounce).collect(),
            lamps: Vec::new(),
        };
        let told = layer.attributes.other.iter().find(|(name, _)| name.as_slice() == PROVENANCE.as_bytes());
        let told: Value = match told {
            Some((_, AttributeValue::Text(json))) => {
                serde_json::from_slice(json.as_slice()).unwrap_or_default()
            }
            _ => Value::Null,
        };
        let flags = told["flags"].as_array().cloned().unwrap_or_default();
        let camera = flags.iter().filter_map(Value::as_str).find_map(|flag| flag.strip_prefix("camera "));
        let inputs = told["inputs"].as_object().cloned().unwrap_or_default();
        let digest = |(role, digest): (String, Value)| Some((role, digest.as_str()?.to_owned()));
        Ok(StoredPicture {
            path: path.into(),
            picture,
            camera: camera.and_then(described),
            efficacy: layer.attributes.white_luminance.map(f64::from).filter(|&x| x > 0.0 && x.is_finite()),
            inputs: inputs.into_iter().filter_map(digest).collect(),
        })
    }

    /// A layer, or which flag makes it.
    pub fn layer(&self, layer: Layer) -> Result<&Values> {
        let missing = || {
            let remedy = format!("render it again with --layers {} among others", layer.name());
            Error::view(&self.path, format!("has no layer {}", layer.name()), remedy)
        };
        self.picture.layer(layer).ok_or_else(missing)
    }

    /// Refuses a file that is not the one the picture was made of. Pictures that say nothing are believed.
    pub fn check_input(&self, role: &str, path: &Path, digest: Digest) -> Result<()> {
        match self.inputs.get(role) {
            Some(known) if *known != digest.to_string() => {
                let (first, second) = (self.path.clone(), path.into());
                let detail = format!("the picture was rendered with another {role}");
                let remedy = "give the one it was rendered with, or render it again".into();
                Err(interchange::Error::Mismatch { first, second, detail, remedy }.into())
            }
            _ => Ok(()),
        }
    }
}

fn numbers(samples: &FlatSamples) -> Vec<f64> {
    samples.values_as_f32().map(f64::from).collect()
}

fn triples(channels: &BTreeMap<String, FlatSamples>, names: [String; 3]) -> Option<Vec<[f64; 3]>> {
    let [r, g, b] = names.map(|name| channels.get(&name).map(numbers));
    Some(r?.into_iter().zip(g?).zip(b?).map(|((r, g), b)| [r, g, b]).collect())
}

fn values(layer: Layer, channels: &BTreeMap<String, FlatSamples>) -> Option<Values> {
    let name = |channel: &str| format!("{}.{channel}", layer.name());
    match *layer.channels() {
        [a, b, c] => triples(channels, [a, b, c].map(name)).map(Values::Triples),
        [channel] => Some(match channels.get(&name(channel))? {
            FlatSamples::U32(indices) => Values::Indices(indices.clone()),
            samples => Values::Numbers(numbers(samples)),
        }),
        _ => None,
    }
}

/// The camera that [`Camera::describe`] tells of.
fn described(text: &str) -> Option<Camera> {
    let words: Vec<&str> = text.split(' ').collect();
    let value = |name: &str| words.iter().find_map(|word| word.strip_prefix(name)?.strip_prefix('='));
    let number = |name: &str| value(name)?.parse::<f64>().ok().filter(|x| x.is_finite());
    let vector = |name: &str| {
        let parts: Option<Vec<f64>> = value(name)?.split(',').map(|x| x.parse().ok()).collect();
        <[f64; 3]>::try_from(parts?).ok().map(DVec3::from_array).filter(|v| v.is_finite())
    };
    let (width, height) = value("size")?.split_once('x')?;
    let (forward, up) = (vector("forward")?, vector("up")?);
    Some(Camera {
        eye: vector("eye")?,
        forward,
        right: forward.cross(up),
        up,
        projection: match words[0] {
            "orthographic" => Projection::Orthographic,
            "panorama" => Projection::Panorama,
            _ => Projection::Perspective,
        },
        half: [number("half_width")?, number("half_height")?],
        size: [width.parse().ok()?, height.parse().ok()?],
        framing: words.contains(&"framing"),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::Lens;
    use crate::exr_file::{self, Label, Precision};
    use interchange::provenance::Provenance;

    #[test]
    fn cameras_are_read_as_they_are_described() {
        let eye = DVec3::new(0.1, -2e3, 1.0 / 3.0);
        for lens in [Lens::Vertical(40.0), Lens::Orthographic(3.5), Lens::Panorama] {
            let mut camera = Camera::new(eye, DVec3::ZERO, DVec3::Z, lens, [64, 48]).unwrap();
            camera.framing = lens == Lens::Vertical(40.0);
            let back = described(&camera.describe()).unwrap();
            assert!(back.right.abs_diff_eq(camera.right, 1e-15), "{}", back.right);
            assert_eq!(Camera { right: camera.right, ..back }, camera);
        }
        for text in ["", "eye=1,2,3", "eye=1,2 forward=1,0,0 up=0,0,1 half_width=1 half_height=1 size=8x8"] {
            assert_eq!(described(text), None);
        }
    }

    #[test]
    fn pictures_come_back_with_their_layers_and_what_they_say() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.exr");
        let layers = vec![
            (Layer::Depth, Values::Numbers(vec![1000.5, 3.0])),
            (Layer::Face, Values::Indices(vec![7, u32::MAX])),
            (Layer::Irradiance, Values::Triples(vec![[0.5, 0.25, 2.0]; 2])),
        ];
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[1.0, 0.5, 0.25], [0.0, 4.0, 8.0]],
            layers,
            bounces: vec![vec![[0.5; 3]; 2], vec![[0.25; 3]; 2]],
            lamps: Vec::new(),
        };
        let camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, Lens::Vertical(90.0), [2, 1]).unwrap();
        let provenance = Provenance::new("shade-tool", "9")
            .flag("--samples 2")
            .flag(format!("camera {}", camera.describe()))
            .input("mesh", Digest::of(b"abc"));
        let label =
            Label { provenance: &provenance, camera: Some(&camera), efficacy: 100.0, remarks: String::new() };
        exr_file::write(&path, &picture, Precision::Half, &label).unwrap();
        let stored = StoredPicture::read(&path).unwrap();
        assert_eq!((&stored.picture, stored.efficacy), (&picture, Some(100.0)));
        assert_eq!(stored.camera.as_ref().unwrap().half, camera.half);
        assert!(stored.check_input("mesh", &path, Digest::of(b"abc")).is_ok());
        let error = stored.check_input("mesh", &path, Digest::of(b"abd")).unwrap_err().to_string();
        assert!(error.contains("another mesh"), "{error}");
        let error = stored.layer(Layer::Error).unwrap_err().to_string();
        assert!(error.contains("p.exr") && error.contains("--layers error"), "{error}");
    }
}
