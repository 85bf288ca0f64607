//! How far facets reach across the picture.

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

/// Extends the facets by samples, `per_pixel` in a row, of a picture so many pixels wide from row `top` on.
pub fn extend(extents: &mut [Extent], seen: &[Seen], per_pixel: usize, (width, top): (usize, usize)) {
    for (pixel, seen) in seen.chunks(per_pixel).enumerate() {
        let place = [(pixel % width) as u32, (top + pixel / width) as u32];
        for sample in seen {
            if let Seen::Surface(element, ..) = sample {
                let Extent { low, high } = &mut extents[element.index()];
                (*low, *high) = ([0, 1].map(|c| low[c].min(place[c])), [0, 1].map(|c| high[c].max(place[c])));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use interchange::ids::ElementId;

    /// Two samples a pixel, three pixels wide: a facet along a diagonal, one in a single pixel, one that is not seen.
    #[test]
    fn facets_reach_from_their_first_to_their_last_pixel() {
        let seen = |element: usize| Seen::Surface(ElementId::new(element), DVec2::ZERO, 1.0);
        let none = Seen::Background;
        let first = [none, seen(0), none, none, seen(1), seen(1)];
        let second = [none, none, seen(0), none, none, none];
        let mut extents = [Extent::default(); 3];
        extend(&mut extents, &first, 2, (3, 4));
        extend(&mut extents, &second, 2, (3, 6));
        assert_eq!(extents.map(|extent| extent.is_seen()), [true, true, false]);
        assert_eq!([extents[0].pixels(), extents[1].pixels()], [3.0, 1.0]);
    }
}
