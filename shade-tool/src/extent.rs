//! How far facets reach across the picture.

use crate::pixel_samples::RowSamples;
use crate::visible::Seen;

/// The part of the picture in which a facet is seen.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    low: [u32; 2],
    high: [u32; 2],
}

impl Default for Extent {
    fn default() -> Extent {
        Extent { low: [u32::MAX; 2], high: [0; 2] }
    }
}

impl Extent {
    /// Whether anything of it is seen.
    pub fn is_seen(&self) -> bool {
        self.low[0] <= self.high[0]
    }

    /// Pixels from end to end, along rows or columns. A chair's leg is long, however few pixels it covers.
    pub fn pixels(&self) -> f64 {
        f64::from((0..2).fold(0, |most, c| most.max(self.high[c] - self.low[c])) + 1)
    }
}

/// Extends the facets by the samples of row `row` of the picture.
pub fn extend(extents: &mut [Extent], samples: &RowSamples, row: usize) {
    for (column, samples) in samples.pixels().enumerate() {
        let place = [column as u32, row as u32];
        for sample in samples {
            if let Seen::Surface(element, ..) = sample.seen {
                let Extent { low, high } = &mut extents[element.index()];
                (*low, *high) = ([0, 1].map(|c| low[c].min(place[c])), [0, 1].map(|c| high[c].max(place[c])));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::{Camera, Lens};
    use crate::pixel_samples::{PixelSampler, Sampling};
    use crate::test_scenes::{add_parallelogram, empty_mesh, lit};
    use crate::visible::VisibleSurface;
    use glam::DVec3;

    /// A square of 2 x 2 elements in the middle of the picture, two pixels to a unit: each reaches over four pixels.
    #[test]
    fn facets_reach_from_their_first_to_their_last_pixel() {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::ZERO, 4.0 * DVec3::X, 4.0 * DVec3::Y, 2, 0);
        add_parallelogram(&mut mesh, 50.0 * DVec3::X, DVec3::X, DVec3::Y, 1, 0);
        let scene = lit(mesh);
        let surface = VisibleSurface::new(&scene);
        let middle = DVec3::new(2.0, 2.0, 0.0);
        let camera =
            Camera::new(middle + DVec3::Z, middle, DVec3::Y, Lens::Orthographic(8.0), [16, 16]).unwrap();
        let sampler = PixelSampler::new(&surface, &camera, Sampling { each: 2, in_cell: 1, at_lamps: 1 });
        let mut extents = [Extent::default(); 5];
        (0..16).for_each(|row| extend(&mut extents, &sampler.row(row, 0..16), row));
        assert_eq!(extents.map(|extent| extent.is_seen()), [true, true, true, true, false]);
        assert_eq!(extents[..4].iter().map(Extent::pixels).collect::<Vec<_>>(), [4.0; 4]);
    }
}
