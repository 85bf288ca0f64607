//! Pictures as OpenEXR: linear RGB radiance with the primaries of Rec. 709 and layers by name (`albedo.R`), ZIP in blocks of 16
//! rows, half or float; depth is always float, and indices are integers.
//! The same picture gives the same bytes: no date, and never more than one attribute beyond the standard ones (the
//! library keeps those in a hash map, whose order changes from run to run).

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::layers::{Layer as PictureLayer, Values};
use crate::picture::Picture;
use exr::image::write::WritableImage;
use exr::meta::attribute::{AttributeValue, Chromaticities, LineOrder, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, Vec2, f16,
};
use interchange::atomic_write::{self, Outcome};
use interchange::provenance::Provenance;
use std::path::Path;

/// Name of the attribute with the provenance as JSON.
pub const PROVENANCE: &str = "provenance";
/// What the pixels mean.
const COMMENTS: &str = "linear RGB radiance, W m^-2 sr^-1, plain box filter, row 0 at the top";
/// Numbers of the standard's default: Rec. 709 primaries, D65.
const REC_709: [(f32, f32); 4] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: relative error 5e-4, up to 65504.
    Half,
    /// 32 bits.
    Float,
}

/// A picture whose brightest value is below this many of the smallest numbers of full precision is too dark for its
/// precision: a thousandth of the brightest, which an eye still sees, loses digits.
const DARK: f64 = 1000.0;

/// How a picture fits a precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// All values that matter keep their digits.
    Good,
    /// So many values become infinite.
    TooBright(usize),
    /// Visible values lose digits, or vanish.
    TooDark,
}

/// How the picture fits the precision.
pub fn fit(picture: &Picture, precision: Precision) -> Fit {
    let (largest, smallest) = match precision {
        Precision::Half => (f16::MAX.to_f64(), f16::MIN_POSITIVE.to_f64()),
        Precision::Float => (f64::from(f32::MAX), f64::from(f32::MIN_POSITIVE)),
    };
    let too_large = picture.pixels.iter().flatten().filter(|&&x| x > largest).count();
    let highest = picture.highest();
    match too_large {
        0 if highest > 0.0 && highest < DARK * smallest => Fit::TooDark,
        0 => Fit::Good,
        _ => Fit::TooBright(too_large),
    }
}

/// What a file says of its picture.
#[derive(Debug)]
pub struct Label<'a> {
    /// What made it of what.
    pub provenance: &'a Provenance,
    /// Where it was seen from.
    pub camera: Option<&'a Camera>,
    /// Luminous efficacy, lm W^-1: white luminance is that of RGB 1, 1, 1.
    pub efficacy: f64,
    /// Result-dependent remarks, such as the achieved error.
    pub remarks: String,
}

/// Writes the picture; an identical file is left alone.
pub fn write(path: &Path, picture: &Picture, precision: Precision, label: &Label<'_>) -> Result<Outcome> {
    let provenance = label.provenance;
    let stored = |values: &mut dyn Iterator<Item = f64>, precision: Precision| match precision {
        Precision::Half => FlatSamples::F16(values.map(f16::from_f64).collect()),
        Precision::Float => FlatSamples::F32(values.map(|x| x as f32).collect()),
    };
    let mut list = Vec::new();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        list.push(AnyChannel::new(text(name), stored(&mut picture.pixels.iter().map(|p| p[c]), precision)));
    }
    for (k, pixels) in picture.bounces.iter().enumerate() {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let name = text(&format!("bounces.{k}.{name}"));
            list.push(AnyChannel::new(name, stored(&mut pixels.iter().map(|p| p[c]), precision)));
        }
    }
    for (layer, values) in &picture.layers {
        // A half has 11 bits: depths of a millimetre in two metres.
        let precision = if *layer == PictureLayer::Depth { Precision::Float } else { precision };
        for (c, channel) in layer.channels().iter().enumerate() {
            let samples = match values {
                Values::Triples(values) => stored(&mut values.iter().map(|v| v[c]), precision),
                Values::Numbers(values) => stored(&mut values.iter().copied(), precision),
                Values::Indices(values) => FlatSamples::U32(values.clone()),
            };
            list.push(AnyChannel::new(text(&format!("{}.{channel}", layer.name())), samples));
        }
    }
    let channels = AnyChannels::sort(list.into_iter().collect());
    let mut attributes = LayerAttributes {
        software_name: Some(text(&format!("{} {}", provenance.tool, provenance.version))),
        comments: Some(text(&format!("{COMMENTS}{}", label.remarks))),
        white_luminance: Some(label.efficacy as f32),
        world_to_camera: label.camera.map(|camera| flat(camera.world_to_camera())),
        world_to_normalized_device: label.camera.and_then(Camera::world_to_ndc).map(flat),
        ..LayerAttributes::default()
    };
    attributes.other.insert(text(PROVENANCE), AttributeValue::Text(text(&provenance_json(provenance))));
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = Vec2(picture.width, picture.height);
    let mut image = Image::from_layer(Layer::new(size, attributes, encoding, channels));
    let [red, green, blue, white] = REC_709.map(|(x, y)| Vec2(x, y));
    image.attributes.chromaticities = Some(Chromaticities { red, green, blue, white });
    let outcome = atomic_write::write(path, |out| {
        image.write().non_parallel().to_buffered(out).map_err(|error| match error {
            exr::error::Error::Io(error) => error,
            other => std::io::Error::other(other.to_string()),
        })
    });
    outcome.map_err(Error::from)
}

/// Row by row, as files hold matrices.
fn flat(matrix: [[f64; 4]; 4]) -> [f32; 16] {
    std::array::from_fn(|k| matrix[k / 4][k % 4] as f32)
}

/// UTF-8 bytes as they are; the library itself would take Latin letters only.
fn text(utf8: &str) -> Text {
    Text::from_slice_unchecked(utf8.as_bytes())
}

/// Provenance as one line of JSON, digests in hexadecimal.
pub fn provenance_json(provenance: &Provenance) -> String {
    let inputs: serde_json::Map<String, serde_json::Value> =
        provenance.inputs.iter().map(|input| (input.role.clone(), input.digest.to_string().into())).collect();
    serde_json::json!({
        "tool": provenance.tool,
        "version": provenance.version,
        "flags": provenance.flags,
        "inputs": inputs,
    })
    .to_string()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use interchange::digest::Digest;

    fn picture() -> Picture {
        let pixels =
            (0..20 * 37).map(|i| [f64::from(i), 0.1 * f64::from(i), 1.0 / (1.0 + f64::from(i))]).collect();
        Picture { width: 37, height: 20, pixels, ..Picture::default() }
    }

    fn provenance() -> Provenance {
        Provenance::new("shade-tool", "9.9").flag("--samples 2").flag("ü").input("mesh", Digest::of(b"abc"))
    }

    fn label(provenance: &Provenance) -> Label<'_> {
        Label { provenance, camera: None, efficacy: 179.0, remarks: String::new() }
    }

    #[test]
    fn layers_and_camera_come_back_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.exr");
        let mut picture = picture();
        let count = picture.pixels.len();
        picture.layers = vec![
            (PictureLayer::Albedo, Values::Triples(vec![[0.5, 0.25, 0.125]; count])),
            (PictureLayer::Depth, Values::Numbers(vec![1000.5; count])),
            (PictureLayer::Element, Values::Indices((0..count as u32).collect())),
        ];
        let (eye, at) = (glam::DVec3::ZERO, glam::DVec3::Z);
        let camera =
            Camera::new(eye, at, glam::DVec3::Y, crate::camera::Lens::Vertical(90.0), [37, 20]).unwrap();
        let provenance = provenance();
        let label = Label { camera: Some(&camera), ..label(&provenance) };
        write(&path, &picture, Precision::Half, &label).unwrap();
        let read = exr::image::read::read_all_flat_layers_from_file(&path).unwrap();
        let layer = &read.layer_data[0];
        let channel = |name: &str| {
            let found = layer.channel_data.list.iter().find(|c| c.name == text(name)).unwrap();
            found.sample_data.clone()
        };
        assert_eq!(channel("albedo.B").values_as_f32().next(), Some(0.125));
        assert!(matches!(channel("depth.Z"), FlatSamples::F32(values) if values[3] == 1000.5));
        assert!(matches!(channel("element.id"), FlatSamples::U32(values) if values[9] == 9));
        assert_eq!(layer.attributes.white_luminance, Some(179.0));
        let to_camera = layer.attributes.world_to_camera.unwrap();
        // Looking along +z with y up, right is -x.
        assert_eq!((to_camera[0], to_camera[5], to_camera[10], to_camera[15]), (-1.0, 1.0, -1.0, 1.0));
        assert!(layer.attributes.world_to_normalized_device.is_some());
    }

    #[test]
    fn pixels_and_attributes_come_back_in_both_precisions() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.exr");
        for (precision, tolerance) in [(Precision::Half, 5e-4), (Precision::Float, 6e-8)] {
            write(&path, &picture(), precision, &label(&provenance())).unwrap();
            let read = exr::image::read::read_all_flat_layers_from_file(&path).unwrap();
            assert_eq!(read.attributes.chromaticities.unwrap().red, Vec2(0.64, 0.33));
            let layer = &read.layer_data[0];
            assert_eq!((layer.size, layer.channel_data.list.len()), (Vec2(37, 20), 3));
            for (k, c) in [(0, 2), (1, 1), (2, 0)] {
                let values: Vec<f32> = layer.channel_data.list[k].sample_data.values_as_f32().collect();
                for (got, want) in values.iter().zip(picture().pixels.iter().map(|p| p[c])) {
                    assert!((f64::from(*got) - want).abs() <= tolerance * want, "{got}, want {want}");
                }
            }
            let attribute = &layer.attributes.other[&text(PROVENANCE)];
            let AttributeValue::Text(json) = attribute else { unreachable!("{attribute:?}") };
            let json: serde_json::Value = serde_json::from_slice(json.as_slice()).unwrap();
            assert_eq!(json["flags"][1], "ü");
            assert!(json["inputs"]["mesh"].as_str().unwrap().starts_with("ba7816bf"));
            assert_eq!(layer.attributes.capture_date, None);
        }
    }

    #[test]
    fn same_picture_gives_the_same_bytes_and_leaves_the_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (one, two) = (folder.path().join("1.exr"), folder.path().join("2.exr"));
        write(&one, &picture(), Precision::Half, &label(&provenance())).unwrap();
        write(&two, &picture(), Precision::Half, &label(&provenance())).unwrap();
        assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&two).unwrap());
        assert_eq!(
            write(&one, &picture(), Precision::Half, &label(&provenance())).unwrap(),
            Outcome::Unchanged
        );
    }

    #[test]
    fn pictures_too_bright_or_too_dark_for_halves_are_noticed() {
        for (pixel, half) in [
            ([7e4, 1e-6, 8e4], Fit::TooBright(2)),
            ([0.05, 0.01, 0.0], Fit::TooDark),
            ([0.1, 1e-6, 0.0], Fit::Good),
            ([0.0, 0.0, 0.0], Fit::Good),
        ] {
            let picture = Picture { width: 1, height: 1, pixels: vec![pixel], ..Picture::default() };
            assert_eq!(fit(&picture, Precision::Half), half, "{pixel:?}");
            assert_eq!(fit(&picture, Precision::Float), Fit::Good, "{pixel:?}");
        }
    }
}
