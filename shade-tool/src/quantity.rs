//! What false colours and contours measure: one number in every pixel.

use crate::error::Result;
use crate::exr_reader::StoredPicture;
use crate::layers::{Layer, NOTHING, Values};
use crate::picture::luminance;

/// What is measured. The three channels are weighted like luminance; photometric units are lumens instead of watts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Quantity {
    /// Luminance of what is seen, cd/m²
    Luminance,
    /// Illuminance of the surface that is seen, lx
    Illuminance,
    /// Radiance of what is seen, W/(m² sr)
    Radiance,
    /// Irradiance of the surface that is seen, W/m²
    Irradiance,
}

/// A number in every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Width in pixels.
    pub width: usize,
    /// One value per pixel, not a number where nothing is seen or known.
    pub values: Vec<f64>,
    /// What they are, with the unit.
    pub caption: String,
}

impl Quantity {
    /// The quantity in every pixel of a picture; `efficacy` in lm/W. Irradiance and illuminance need the layer `irradiance`.
    pub fn map(self, stored: &StoredPicture, efficacy: f64) -> Result<Map> {
        let picture = &stored.picture;
        let (factor, caption) = match self {
            Quantity::Luminance => (efficacy, format!("luminance, cd/m² ({efficacy} lm/W)")),
            Quantity::Illuminance => (efficacy, format!("illuminance, lx ({efficacy} lm/W)")),
            Quantity::Radiance => (1.0, "radiance, W/(m² sr)".into()),
            Quantity::Irradiance => (1.0, "irradiance, W/m²".into()),
        };
        let source = match self {
            Quantity::Luminance | Quantity::Radiance => &picture.pixels,
            Quantity::Illuminance | Quantity::Irradiance => match stored.layer(Layer::Irradiance)? {
                Values::Triples(irradiance) => irradiance,
                _ => &picture.pixels,
            },
        };
        // Background is known where an index was stored.
        let seen = picture.layer(Layer::Face).or_else(|| picture.layer(Layer::Element));
        let is_nothing = |k: usize| matches!(seen, Some(Values::Indices(seen)) if seen[k] == NOTHING);
        // A lamp that reflects nothing shines without irradiance having been asked for: 0 stands for unknown there.
        let is_unknown = |k: usize, rgb: [f64; 3]| {
            let of_surface = matches!(self, Quantity::Illuminance | Quantity::Irradiance);
            of_surface && rgb == [0.0; 3] && picture.pixels[k] != [0.0; 3]
        };
        let value = |(k, &rgb): (usize, &[f64; 3])| {
            if is_nothing(k) || is_unknown(k, rgb) { f64::NAN } else { factor * luminance(rgb) }
        };
        let values = source.iter().enumerate().map(value).collect();
        Ok(Map { width: picture.width, values, caption })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::picture::Picture;
    use crate::test_scenes::stored;

    #[test]
    fn irradiance_of_lamps_is_unknown_and_that_of_shadows_is_none() {
        let layers = vec![(Layer::Irradiance, Values::Triples(vec![[0.0; 3]; 2]))];
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[17.0, 12.0, 4.0], [0.0; 3]],
            layers,
            ..Picture::default()
        };
        let map = Quantity::Irradiance.map(&stored(&picture), 1.0).unwrap();
        assert!(map.values[0].is_nan() && map.values[1] == 0.0, "{:?}", map.values);
        assert!(Quantity::Radiance.map(&stored(&picture), 1.0).unwrap().values[0] > 10.0);
    }

    #[test]
    fn quantities_are_weighted_scaled_and_left_out_where_nothing_is() {
        let layers = vec![
            (Layer::Face, Values::Indices(vec![3, NOTHING])),
            (Layer::Irradiance, Values::Triples(vec![[1.0, 1.0, 1.0], [0.0; 3]])),
        ];
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[0.0, 1.0, 0.0], [1.0; 3]],
            layers,
            ..Picture::default()
        };
        let whole = stored(&picture);
        for (quantity, want, unit) in [
            (Quantity::Radiance, 0.7152, "W/(m² sr)"),
            (Quantity::Luminance, 71.52, "cd/m² (100 lm/W)"),
            (Quantity::Irradiance, 1.0, "W/m²"),
            (Quantity::Illuminance, 100.0, "lx (100 lm/W)"),
        ] {
            let map = quantity.map(&whole, 100.0).unwrap();
            assert!((map.values[0] - want).abs() < 1e-6 * want, "{quantity:?}: {}", map.values[0]);
            assert!(map.values[1].is_nan() && map.caption.ends_with(unit), "{}", map.caption);
        }
        let bare = Picture { layers: Vec::new(), ..picture };
        let error = Quantity::Illuminance.map(&stored(&bare), 1.0).unwrap_err().to_string();
        assert!(error.contains("--layers irradiance"), "{error}");
    }
}
