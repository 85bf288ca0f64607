//! Factors as colours: a logarithmic scale over whole decades, dark to bright, and its legend.

use super::canvas::{Canvas, INK};
use interchange::font;

/// Most decades that are told apart; smaller factors have the darkest colour.
const MOST_DECADES: i32 = 6;
/// Colours at equal steps from the smallest to the largest factor: brightness rises evenly, and hue changes besides, so that
/// neither a grey print nor a colour-blind eye loses the order.
const RAMP: [[u8; 3]; 6] =
    [[48, 18, 59], [59, 66, 145], [33, 121, 142], [49, 172, 117], [158, 211, 62], [252, 230, 60]];
/// Width of the legend's bar.
const BAR: usize = 24;
/// Space between bar, ticks and text.
const GAP: usize = 6;

/// A logarithmic scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    /// Power of ten of the darkest colour.
    pub low: i32,
    /// Power of ten of the brightest.
    pub high: i32,
}

impl Scale {
    /// The scale for some factors: whole decades that hold the largest and, as far as six reach, the smallest above 0.
    pub fn of(factors: impl Iterator<Item = f64>) -> Self {
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        factors.filter(|f| *f > 0.0).for_each(|f| (least, most) = (least.min(f), most.max(f)));
        if most == 0.0 {
            return Self { low: -1, high: 0 };
        }
        let high = most.log10().ceil() as i32;
        let low = (least.log10().floor() as i32).clamp(high - MOST_DECADES, high - 1);
        Self { low, high }
    }

    /// Where a factor above 0 lies, 0 to 1.
    pub fn place(&self, factor: f64) -> f64 {
        let span = f64::from(self.high - self.low);
        ((factor.log10() - f64::from(self.low)) / span).clamp(0.0, 1.0)
    }

    /// Its colour.
    pub fn colour(&self, factor: f64) -> [u8; 3] {
        ramp(self.place(factor))
    }

    /// Draws the bar with its decades; its upper left corner and its height in pixels.
    pub fn draw(&self, canvas: &mut Canvas, x: usize, y: usize, height: usize) {
        for row in 0..height {
            let place = 1.0 - (row as f64 + 0.5) / height as f64;
            canvas.fill(x, y + row, BAR, 1, ramp(place));
        }
        canvas.frame(x, y, BAR, height, INK);
        for power in self.low..=self.high {
            let place = f64::from(self.high - power) / f64::from(self.high - self.low);
            let row = y + (place * (height - 1) as f64).round() as usize;
            canvas.fill(x + BAR, row, GAP, 1, INK);
            let label = match power {
                0 => "1".to_owned(),
                _ => format!("1e{power}"),
            };
            canvas.text(x + BAR + 2 * GAP, row.saturating_sub(font::HEIGHT / 2), 1, &label);
        }
    }
}

fn ramp(place: f64) -> [u8; 3] {
    let at = place * (RAMP.len() - 1) as f64;
    let step = (at as usize).min(RAMP.len() - 2);
    let part = at - step as f64;
    std::array::from_fn(|c| {
        let (a, b) = (f64::from(RAMP[step][c]), f64::from(RAMP[step + 1][c]));
        (a + part * (b - a)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_the_factors() {
        assert_eq!(Scale::of([0.2, 3e-4, 0.0].into_iter()), Scale { low: -4, high: 0 });
        assert_eq!(Scale::of([1e-20, 0.5].into_iter()), Scale { low: -6, high: 0 });
        assert_eq!(Scale::of([0.1].into_iter()), Scale { low: -2, high: -1 });
        assert_eq!(Scale::of(std::iter::empty()), Scale { low: -1, high: 0 });
        let scale = Scale { low: -4, high: 0 };
        assert_eq!((scale.place(1e-2), scale.place(1e-9), scale.place(2.0)), (0.5, 0.0, 1.0));
        assert_eq!((scale.colour(1e-9), scale.colour(1.0)), (RAMP[0], RAMP[5]));
    }

    /// Brightness rises with the factor, everywhere.
    #[test]
    fn brighter_is_more() {
        let luminance =
            |[r, g, b]: [u8; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        let steps: Vec<f64> = (0..=100).map(|k| luminance(ramp(f64::from(k) / 100.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
