//! Radiance to what a screen shows: exposure, a tone curve, the encoding of sRGB.
//!
//! Automatic exposure takes the logarithmic mean of luminance to 0.18, middle grey (Reinhard, Stark, Shirley & Ferwerda
//! 2002, eq. 1 and 2).
//!
//! Curves, on each channel apart, so that highlights lose their colour little by little as on film (the same curve on
//! luminance alone keeps the hue until a channel reaches 1, and draws a border there):
//! - `reinhard`: their eq. 4, x (1 + x / W^2) / (1 + x), with W the value of the brightest channels, at least 1 (where it
//!   is the identity); so a picture without highlights stays as it is.
//! - `filmic`: with a toe and a shoulder, the rational fit of Narkowicz 2015 to the film curve of the Academy Color Encoding
//!   System, scaled so that middle grey stays middle grey: more contrast, deeper shadows.
//! - `linear`: radiance as it is, cut at white. Twice the light is twice the value, for comparing.
//!
//! A pixel that a lamp covers in part shows the mean of lamp and surroundings as each appears on the screen, weighted by what each covers: a lamp is
//! many times brighter than white, and the mean of radiance would be white from a few percent of lamp on, its border stepped. That
//! needs [`Picture::lamps`], which a rendered picture has and a stored one does not: views of a file show mean radiance.

use crate::canvas::Canvas;
use crate::picture::{LampPart, Picture, luminance};
use std::str::FromStr;

/// Where the logarithmic mean goes: middle grey.
const KEY: f64 = 0.18;
/// This part of the lit pixels may be brighter than what becomes white.
const BRIGHTER_THAN_WHITE: f64 = 0.01;
/// Pixels darker than this part of the mean do not count for the exposure: a few nearly black ones, whose logarithm is
/// large, would brighten all others.
const TOO_DARK: f64 = 1e-4;
/// Exposures beyond 2^100 and 2^-100 are slips of the pen.
const MOST_STOPS: f64 = 100.0;
/// Solution of f(KEY x) = KEY for the fit f that [`Curve::Filmic`] uses.
const FILMIC_SCALE: f64 = 0.723_170_8;

/// How bright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// So many powers of two above radiance 1 being white.
    Stops(f64),
    /// So many powers of two above middle grey being the picture's logarithmic mean.
    Automatic(f64),
}

impl FromStr for Exposure {
    type Err = String;

    /// `auto`, `auto+1`, `auto-0.5`, or stops.
    fn from_str(text: &str) -> Result<Exposure, String> {
        let stops = |text: &str| {
            let stops = text.parse().ok().filter(|x: &f64| x.abs() <= MOST_STOPS);
            stops.ok_or("expected auto, auto+1, auto-0.5, or a number of stops of at most 100".to_string())
        };
        match text.strip_prefix("auto") {
            Some("") => Ok(Exposure::Automatic(0.0)),
            Some(more) if more.starts_with(['+', '-']) => stops(more).map(Exposure::Automatic),
            Some(_) => stops("").map(Exposure::Stops),
            None => stops(text).map(Exposure::Stops),
        }
    }
}

/// How exposed radiance becomes the brightness of a screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Curve {
    /// Highlights compressed, the rest nearly as it is
    Reinhard,
    /// With a toe and a shoulder, as film: more contrast
    Filmic,
    /// As it is, cut at white
    Linear,
}

impl Curve {
    /// Brightness of an exposed radiance, not yet cut at 1; `white` is what `reinhard` makes white.
    fn value(self, x: f64, white: f64) -> f64 {
        match self {
            Curve::Reinhard => x * (1.0 + x / (white * white)) / (1.0 + x),
            Curve::Filmic => {
                let x = FILMIC_SCALE * x;
                x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
            }
            Curve::Linear => x,
        }
    }
}

/// Flags of everything that shows radiance.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct ToneArguments {
    /// Powers of two above radiance 1 being white; auto (the default) makes the picture's mean middle grey, auto+1 is twice as bright
    #[arg(long, value_name = "STOPS|auto", allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,
    /// How radiance becomes brightness (default: reinhard)
    #[arg(long, value_name = "CURVE")]
    pub curve: Option<Curve>,
}

/// Exposure and curve ready for pixels: fitted to one picture, good for all that shall be compared with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Factor on radiance; 0 where the picture is black.
    pub factor: f64,
    white: f64,
    curve: Curve,
}

impl ToneArguments {
    /// Whether any flag was given.
    pub fn given(&self) -> bool {
        self.exposure.is_some() || self.curve.is_some()
    }

    /// Exposure and curve for a picture.
    pub fn fitted(&self, picture: &Picture) -> Tone {
        let exposure = self.exposure.unwrap_or(Exposure::Automatic(0.0));
        Tone::new(picture, exposure, self.curve.unwrap_or(Curve::Reinhard))
    }
}

impl Tone {
    /// Fitted to a picture.
    pub fn new(picture: &Picture, exposure: Exposure, curve: Curve) -> Tone {
        let factor = match exposure {
            Exposure::Stops(stops) => stops.exp2(),
            Exposure::Automatic(stops) => {
                let pixels = picture.pixels.iter().map(|&p| (luminance(p), 1.0));
                automatic_factor(pixels).map_or(0.0, |factor| stops.exp2() * factor)
            }
        };
        let mut highest: Vec<f64> = picture.pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
        highest.retain(|&x| x > 0.0 && x.is_finite());
        highest.sort_unstable_by(f64::total_cmp);
        let brightest = highest.get(((1.0 - BRIGHTER_THAN_WHITE) * highest.len() as f64) as usize);
        Tone { factor, white: (factor * brightest.unwrap_or(&0.0)).max(1.0), curve }
    }

    /// A radiance as it appears on a screen.
    pub fn displayed(&self, radiance: [f64; 3]) -> [u8; 3] {
        encoded(self.light(radiance))
    }

    /// Light of a screen for a radiance, 0 black and 1 white.
    fn light(&self, radiance: [f64; 3]) -> [f64; 3] {
        radiance.map(|x| match self.factor * x {
            x if x.is_finite() => self.curve.value(x, self.white).clamp(0.0, 1.0),
            x if x > 0.0 => 1.0,
            _ => 0.0,
        })
    }

    /// A pixel with lamps in it as it appears on a screen: what is lamp and what is not, each by itself.
    fn displayed_apart(&self, whole: [f64; 3], lamp: &LampPart) -> [u8; 3] {
        let other = 1.0 - lamp.share;
        let at_lamp = self.light(lamp.radiance.map(|x| x / lamp.share));
        // Rounding may leave a little less than nothing.
        let beside: [f64; 3] = std::array::from_fn(|c| ((whole[c] - lamp.radiance[c]) / other).max(0.0));
        let beside = self.light(beside);
        encoded(std::array::from_fn(|c| lamp.share * at_lamp[c] + other * beside[c]))
    }

    /// A picture as it appears on a screen.
    pub fn shown(&self, picture: &Picture) -> Canvas {
        let mut pixels: Vec<[u8; 3]> = picture.pixels.iter().map(|&pixel| self.displayed(pixel)).collect();
        for lamp in &picture.lamps {
            if let (Some(shown), Some(&whole)) = (pixels.get_mut(lamp.pixel), picture.pixels.get(lamp.pixel))
            {
                *shown = self.displayed_apart(whole, lamp);
            }
        }
        Canvas { width: picture.width, height: picture.height, pixels }
    }
}

/// Factor on radiance that makes the logarithmic mean of what is lit middle grey. `parts`: luminances with the pixels or
/// the area that each counts for.
pub fn automatic_factor(parts: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let mut lit: Vec<(f64, f64)> = parts.filter(|&(l, _)| l > 0.0 && l.is_finite()).collect();
    let mean_of = |lit: &[(f64, f64)], value: fn(f64) -> f64| {
        lit.iter().map(|&(l, weight)| weight * value(l)).sum::<f64>()
            / lit.iter().map(|&(_, weight)| weight).sum::<f64>()
    };
    let mean = mean_of(&lit, |l| l);
    lit.retain(|&(l, _)| l > TOO_DARK * mean);
    (!lit.is_empty()).then(|| KEY / mean_of(&lit, f64::ln).exp())
}

/// Light of a screen to 8 bits.
fn encoded(light: [f64; 3]) -> [u8; 3] {
    light.map(|x| (255.0 * srgb(x) + 0.5) as u8)
}

/// Encoding of IEC 61966-2-1.
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const CURVES: [Curve; 3] = [Curve::Reinhard, Curve::Filmic, Curve::Linear];

    fn grey(values: &[f64]) -> Picture {
        Picture {
            width: values.len(),
            height: 1,
            pixels: values.iter().map(|&x| [x; 3]).collect(),
            ..Picture::default()
        }
    }

    fn shown(picture: &Picture, exposure: &str, curve: Curve) -> Vec<[u8; 3]> {
        Tone::new(picture, exposure.parse().unwrap(), curve).shown(picture).pixels
    }

    #[test]
    fn even_grey_becomes_middle_grey_whatever_its_radiance_and_the_curve() {
        // 0.18 in sRGB is 0.4614, 117.6 of 255.
        for radiance in [1e-9, 0.2, 1e7] {
            for curve in CURVES {
                assert_eq!(shown(&grey(&[radiance; 5]), "auto", curve)[0], [118; 3], "{curve:?}");
            }
        }
        // 0.36 in sRGB is 0.6350, 161.9.
        assert_eq!(shown(&grey(&[1.0; 5]), "auto+1", Curve::Reinhard)[0], [162; 3]);
    }

    #[test]
    fn stops_are_absolute_and_double_the_light() {
        let picture = grey(&[0.25, 0.5, 1.0, 2.0]);
        let by_stop = |stops: &str| shown(&picture, stops, Curve::Linear);
        // 0.5 in sRGB is 0.7354, 187.5; 0.25 is 0.5371, 137.0.
        assert_eq!(by_stop("0"), [[137; 3], [188; 3], [255; 3], [255; 3]]);
        assert_eq!(by_stop("1")[0], by_stop("0")[1]);
        assert_eq!(by_stop("-1")[2], by_stop("0")[1]);
    }

    #[test]
    fn exposures_are_read_and_slips_refused() {
        for (text, want) in [
            ("auto", Exposure::Automatic(0.0)),
            ("auto+1.5", Exposure::Automatic(1.5)),
            ("auto-2", Exposure::Automatic(-2.0)),
            ("-3", Exposure::Stops(-3.0)),
            ("+0.5", Exposure::Stops(0.5)),
        ] {
            assert_eq!(text.parse(), Ok(want), "{text}");
        }
        for text in ["", "automatic", "auto1", "auto+", "inf", "NaN", "101", "auto-101", "1 stop"] {
            assert!(text.parse::<Exposure>().is_err(), "{text}");
        }
    }

    #[test]
    fn black_stays_black_and_brighter_stays_brighter() {
        let values: Vec<f64> = (0..1000).map(|i| 1e-3 * 1.01f64.powi(i)).chain([0.0]).collect();
        for curve in CURVES {
            assert_eq!(shown(&grey(&[0.0; 4]), "auto", curve), vec![[0; 3]; 4]);
            let mapped = shown(&grey(&values), "auto", curve);
            assert!(mapped.windows(2).take(998).all(|pair| pair[0][0] <= pair[1][0]), "{curve:?}");
            assert_eq!((mapped[999], mapped[1000]), ([255; 3], [0; 3]), "{curve:?}");
        }
        assert_eq!(
            shown(&grey(&[f64::INFINITY, f64::NAN, 1.0]), "0", Curve::Filmic)[..2],
            [[255; 3], [0; 3]]
        );
    }

    #[test]
    fn middle_grey_stays_on_every_curve() {
        for curve in CURVES {
            // Reinhard's is the identity where 1 is white.
            assert!((curve.value(KEY, 1.0) - KEY).abs() < 1e-7, "{curve:?}: {}", curve.value(KEY, 1.0));
        }
    }

    #[test]
    fn filmic_has_more_contrast_around_middle_grey() {
        let picture = grey(&[0.09, 0.36]);
        let [dark, bright] = shown(&picture, "0", Curve::Filmic)[..] else { unreachable!() };
        let [dark_before, bright_before] = shown(&picture, "0", Curve::Reinhard)[..] else { unreachable!() };
        assert!(dark[0] < dark_before[0] && bright[0] - dark[0] > bright_before[0] - dark_before[0]);
    }

    /// A quarter of the pixel is lamp, twenty times brighter than white, the rest a wall at 0.1. The mean of radiance is white; the mean of what
    /// is shown is 0.25 + 0.75 * 0.1 = 0.325, in sRGB 0.6055, 154.4 of 255.
    #[test]
    fn partly_covered_by_a_lamp_is_between_lamp_and_wall() {
        let mut picture = grey(&[0.1, 0.25 * 20.0 + 0.75 * 0.1, 20.0]);
        assert_eq!(shown(&picture, "0", Curve::Linear), [[89; 3], [255; 3], [255; 3]]);
        picture.lamps = vec![LampPart { pixel: 1, share: 0.25, radiance: [0.25 * 20.0; 3] }];
        assert_eq!(shown(&picture, "0", Curve::Linear), [[89; 3], [154; 3], [255; 3]]);
        // A lamp no brighter than the wall leaves the pixel as it is, on any curve.
        let mut even = grey(&[0.1; 3]);
        even.lamps = vec![LampPart { pixel: 1, share: 0.25, radiance: [0.025; 3] }];
        for curve in CURVES {
            let pixels = shown(&even, "0", curve);
            assert_eq!(pixels[1], pixels[0], "{curve:?}");
        }
    }

    #[test]
    fn saturated_highlight_pales_and_keeps_its_order_of_channels() {
        let mut picture = grey(&[0.1; 500]);
        picture.pixels[0] = [30.0, 20.0, 1.0];
        picture.pixels[1] = [0.2, 0.02, 0.01];
        let mapped = shown(&picture, "auto", Curve::Reinhard);
        assert_eq!(mapped[0][..2], [255; 2]);
        assert!(mapped[0][2] > 150, "{:?}", mapped[0]);
        assert!(mapped[1][0] > mapped[1][1] && mapped[1][1] > mapped[1][2]);
    }
}
