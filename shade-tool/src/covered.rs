//! Which element covers most of a pixel: the one that its indices and its depth are of.

use crate::layers::Pixel;

/// What a pixel's samples see: element as solved, input face, depth and share of the pixel.
#[derive(Debug, Clone, Default)]
pub struct Covered {
    parts: Vec<(u32, u32, f64, f64)>,
}

impl Covered {
    /// Enters a sample.
    pub fn add(&mut self, element: u32, face: u32, depth: f64, share: f64) {
        self.parts.push((element, face, depth, share));
    }

    /// Sets element, face and mean depth of the element with the largest share, of equals the lower one. A pixel that sees nothing is
    /// left as it is.
    pub fn tell(mut self, pixel: &mut Pixel) {
        self.parts.sort_by_key(|&(element, ..)| element);
        let share = |parts: &[(u32, u32, f64, f64)]| parts.iter().map(|&(.., share)| share).sum::<f64>();
        let larger = |a: &[(u32, u32, f64, f64)], b: &[(u32, u32, f64, f64)]| {
            share(a).total_cmp(&share(b)).then(b[0].0.cmp(&a[0].0))
        };
        let Some(most) = self.parts.chunk_by(|a, b| a.0 == b.0).max_by(|a, b| larger(a, b)) else { return };
        (pixel.element, pixel.face) = (most[0].0, most[0].1);
        pixel.depth = most.iter().map(|&(_, _, depth, share)| depth * share).sum::<f64>() / share(most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_share_tells() {
        let mut covered = Covered::default();
        for part in [(7, 2, 1.0, 0.25), (3, 1, 2.0, 0.125), (3, 1, 4.0, 0.375), (9, 3, 5.0, 0.25)] {
            covered.add(part.0, part.1, part.2, part.3);
        }
        let mut pixel = Pixel::default();
        covered.clone().tell(&mut pixel);
        assert_eq!((pixel.element, pixel.face, pixel.depth), (3, 1, 3.5));
        // 7 and 3 share the pixel: the lower number.
        covered.add(7, 2, 1.0, 0.25);
        covered.tell(&mut pixel);
        assert_eq!(pixel.element, 3);
        let before = pixel;
        Covered::default().tell(&mut pixel);
        assert_eq!(pixel, before);
    }
}
