//! A picture in memory: linear RGB radiance and layers beside it, row 0 at the top.

use crate::layers::{Layer, Pixel, Values};

/// Luminance of linear RGB with the primaries of Rec. 709.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// The lamps in a pixel that they cover in part: beside the pixel's mean, what its preview is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampPart {
    /// Number of the pixel.
    pub pixel: usize,
    /// Part of the pixel that is lamp.
    pub share: f64,
    /// What that part adds to the pixel's radiance.
    pub radiance: [f64; 3],
}

/// Shares are sums of some thousand parts of 1: within this of 1 it is the whole.
const WHOLE: f64 = 1e-9;

/// Linear RGB pixels, W m^-2 sr^-1, and what else was asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Row after row from the top, each from the left.
    pub pixels: Vec<[f64; 3]>,
    /// Layers, each as large as the picture, in the order of their names.
    pub layers: Vec<(Layer, Values)>,
    /// Radiance, pixel by pixel, by light reflected at most 0, 1, ... times.
    pub bounces: Vec<Vec<[f64; 3]>>,
    /// Pixels that lamps cover in part, in order. A file does not keep them.
    pub lamps: Vec<LampPart>,
}

impl Picture {
    /// Adds further pixels, in order; layers are the caller's.
    pub fn append(&mut self, pixels: &[Pixel]) {
        let first = self.pixels.len();
        let is_part = |pixel: &Pixel| pixel.lamp_share > 0.0 && pixel.lamp_share < 1.0 - WHOLE;
        let parts = pixels.iter().enumerate().filter(|(_, pixel)| is_part(pixel));
        self.lamps.extend(parts.map(|(k, p)| LampPart {
            pixel: first + k,
            share: p.lamp_share,
            radiance: p.lamp_radiance,
        }));
        self.pixels.extend(pixels.iter().map(|pixel| pixel.radiance));
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> [f64; 3] {
        let sum = self.pixels.iter().fold([0.0; 3], |sum, p| std::array::from_fn(|c| sum[c] + p[c]));
        sum.map(|s: f64| s / self.pixels.len().max(1) as f64)
    }

    /// Largest value of any channel.
    pub fn highest(&self) -> f64 {
        self.pixels.iter().flatten().fold(0.0, |highest: f64, &x| highest.max(x))
    }

    /// Values of a layer, if it was made.
    pub fn layer(&self, layer: Layer) -> Option<&Values> {
        self.layers.iter().find(|(found, _)| *found == layer).map(|(_, values)| values)
    }
}
