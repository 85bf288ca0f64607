//! Preview of a picture as 8-bit sRGB PNG.
//!
//! Exposure: the logarithmic mean of luminance goes to 0.18, middle grey. Curve: the extended operator of Reinhard,
//! Stark, Shirley & Ferwerda 2002, eq. 4, x (1 + x / W^2) / (1 + x), on each channel apart, with W the value of the
//! brightest channels, at least 1 (where it is the identity); so a picture without highlights stays as it is, and
//! highlights lose their colour little by little, as on film. The same curve on luminance alone keeps the hue until a channel
//! reaches 1, and draws a border there.

use crate::error::{Error, Result};
use crate::picture::{Picture, luminance};
use interchange::atomic_write::{self, Outcome};
use std::path::Path;

/// Where the logarithmic mean goes: middle grey.
const KEY: f64 = 0.18;
/// This part of the lit pixels may be brighter than what becomes white.
const BRIGHTER_THAN_WHITE: f64 = 0.01;
/// Pixels darker than this part of the mean do not count for the exposure: a few nearly black ones, whose logarithm is
/// large, would brighten all others.
const TOO_DARK: f64 = 1e-4;

/// Writes the preview, brighter by `stops` powers of two; an identical file is left alone.
pub fn write(path: &Path, picture: &Picture, stops: f64) -> Result<Outcome> {
    let bytes: Vec<u8> = tone_mapped(picture, stops).into_iter().flatten().collect();
    let outcome = atomic_write::write(path, |out| {
        let mut encoder = png::Encoder::new(out, picture.width as u32, picture.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&bytes)?;
        Ok(writer.finish()?)
    });
    outcome.map_err(Error::from)
}

/// The pixels as they appear in the preview.
pub fn tone_mapped(picture: &Picture, stops: f64) -> Vec<[u8; 3]> {
    let Some((exposure, white)) = exposure_and_white(picture, stops) else {
        return vec![[0; 3]; picture.pixels.len()];
    };
    picture.pixels.iter().map(|&pixel| displayed(pixel.map(|x| exposure * x), white)).collect()
}

/// Factor on radiance and exposed value of white; `None` for a black picture.
fn exposure_and_white(picture: &Picture, stops: f64) -> Option<(f64, f64)> {
    let mut lit: Vec<f64> =
        picture.pixels.iter().map(|&p| luminance(p)).filter(|&l| l > 0.0 && l.is_finite()).collect();
    let mean = lit.iter().sum::<f64>() / lit.len() as f64;
    lit.retain(|&l| l > TOO_DARK * mean);
    lit.sort_unstable_by(f64::total_cmp);
    let mean_logarithm = lit.iter().map(|l| l.ln()).sum::<f64>() / lit.len() as f64;
    let exposure = stops.exp2() * KEY / mean_logarithm.exp();
    let mut highest: Vec<f64> = picture.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    highest.retain(|&x| x > 0.0 && x.is_finite());
    highest.sort_unstable_by(f64::total_cmp);
    let brightest = highest.get(((1.0 - BRIGHTER_THAN_WHITE) * highest.len() as f64) as usize)?;
    Some((exposure, (exposure * brightest).max(1.0)))
}

/// Exposed radiance as sRGB bytes.
fn displayed(exposed: [f64; 3], white: f64) -> [u8; 3] {
    let curve = |x: f64| (x * (1.0 + x / (white * white)) / (1.0 + x)).min(1.0);
    exposed.map(|x| (255.0 * srgb(curve(x)) + 0.5) as u8)
}

/// Encoding of IEC 61966-2-1.
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn grey(values: &[f64]) -> Picture {
        Picture {
            width: values.len(),
            height: 1,
            pixels: values.iter().map(|&x| [x; 3]).collect(),
            ..Picture::default()
        }
    }

    #[test]
    fn even_grey_becomes_middle_grey_whatever_its_radiance() {
        // 0.18 in sRGB is 0.4614, 117.6 of 255.
        for radiance in [1e-9, 0.2, 1e7] {
            assert_eq!(tone_mapped(&grey(&[radiance; 5]), 0.0)[0], [118; 3]);
        }
        assert_eq!(tone_mapped(&grey(&[1.0; 5]), 1.0)[0], [162; 3]);
    }

    #[test]
    fn black_stays_black_and_brighter_stays_brighter() {
        assert_eq!(tone_mapped(&grey(&[0.0; 4]), 0.0), vec![[0; 3]; 4]);
        let values: Vec<f64> = (0..1000).map(|i| 1e-3 * 1.01f64.powi(i)).chain([0.0]).collect();
        let mapped = tone_mapped(&grey(&values), 0.0);
        assert!(mapped.windows(2).take(998).all(|pair| pair[0][0] <= pair[1][0]));
        assert_eq!((mapped[999], mapped[1000]), ([255; 3], [0; 3]));
    }

    #[test]
    fn saturated_highlight_pales_and_keeps_its_order_of_channels() {
        let mut picture = grey(&[0.1; 500]);
        picture.pixels[0] = [30.0, 20.0, 1.0];
        picture.pixels[1] = [0.2, 0.02, 0.01];
        let mapped = tone_mapped(&picture, 0.0);
        assert_eq!(mapped[0][..2], [255; 2]);
        assert!(mapped[0][2] > 150, "{:?}", mapped[0]);
        assert!(mapped[1][0] > mapped[1][1] && mapped[1][1] > mapped[1][2]);
    }

    #[test]
    fn png_opens_with_its_size_and_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.png");
        let picture = grey(&[0.1, 0.2, 0.4]);
        write(&path, &picture, 0.0).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()))
            .read_info()
            .unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.width, frame.height), (3, 1));
        let want: Vec<u8> = tone_mapped(&picture, 0.0).into_iter().flatten().collect();
        assert_eq!(bytes, want);
        assert_eq!(write(&path, &picture, 0.0).unwrap(), Outcome::Unchanged);
    }
}
