//! Numbers as colours: a map whose order is seen, a scale with round ends, and the labelled bar beside the picture.
//!
//! The colours are those of viridis (van der Walt & Smith 2015), by Zucker's polynomials of degree 6, which are within
//! 0.01 of its table: lightness grows evenly all the way, so the order is seen in grey and by the colour-blind, too.

use crate::canvas::{Canvas, GROUND, text_height, text_scale, text_width};

/// Coefficients of the polynomials, constant first, RGB.
const VIRIDIS: [[f64; 3]; 7] = [
    [0.277_727_327_223_417_7, 0.005_407_344_544_966_578, 0.334_099_805_335_306_1],
    [0.105_093_043_108_577_4, 1.404_613_529_898_575, 1.384_590_162_594_685],
    [-0.330_861_828_725_556_3, 0.214_847_559_468_213, 0.095_095_163_028_236_59],
    [-4.634_230_498_983_486, -5.799_100_973_351_585, -19.332_440_956_279_87],
    [6.228_269_936_347_081, 14.179_933_366_805_09, 56.690_552_600_681_05],
    [4.776_384_997_670_288, -13.745_145_377_746_01, -65.353_032_633_372_34],
    [-5.435_455_855_934_631, 4.645_852_612_178_535, 26.312_435_249_583_2],
];
/// Ends of scales, times a power of ten: near enough to each other that at least four fifths of the colours are used.
const ROUND_ENDS: [f64; 11] = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
/// Steps between marks and contours, times a power of ten.
const ROUND_STEPS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// This part of the values may lie beyond the end of a scale: lamps would leave nothing of it to the room.
const BEYOND: f64 = 0.02;
/// A logarithmic scale spans at most this factor by itself.
const MOST_DECADES: f64 = 1e4;
/// Numbers are written out between these, else with an exponent.
const WRITTEN_OUT: std::ops::Range<f64> = 1e-3..1e6;
/// Quotients of round numbers miss whole numbers by rounding.
const ROUNDING: f64 = 1e-9;

/// Colour of a part (0 to 1) of the scale; what is not a number has none.
pub fn colour(part: f64) -> [u8; 3] {
    if part.is_nan() {
        return GROUND;
    }
    let t = part.clamp(0.0, 1.0);
    let value = |c: usize| VIRIDIS.iter().rev().fold(0.0, |sum, coefficients| sum * t + coefficients[c]);
    std::array::from_fn(|c| (255.0 * value(c).clamp(0.0, 1.0) + 0.5) as u8)
}

/// Which number has which colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Where the colours begin; above 0 where logarithmic.
    pub low: f64,
    /// Where they end.
    pub high: f64,
    /// Whether equal factors, instead of equal differences, are equal steps of colour.
    pub logarithmic: bool,
}

impl Scale {
    /// A scale for these values with a round end; from 0, or for a logarithmic one from a power of ten.
    pub fn fitting(values: &[f64], logarithmic: bool) -> Scale {
        let mut known: Vec<f64> = values.iter().copied().filter(|&v| v > 0.0 && v.is_finite()).collect();
        known.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| known.get((part * known.len().saturating_sub(1) as f64) as usize);
        let high = at(1.0 - BEYOND).map_or(1.0, |&high| round_up(high, &ROUND_ENDS));
        let low = match at(BEYOND) {
            Some(&low) if logarithmic => 10f64.powf(low.max(high / MOST_DECADES).log10().floor()),
            None if logarithmic => 0.1,
            _ => 0.0,
        };
        Scale { low: if low < high { low } else { high / 10.0 }, high, logarithmic }
    }

    /// Place of a value on the scale, 0 at its low and 1 at its high end.
    pub fn part(&self, value: f64) -> f64 {
        match self.logarithmic {
            true if value <= 0.0 => f64::NEG_INFINITY,
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// Round numbers on the scale, at most about `most`, both ends included.
    pub fn marks(&self, most: usize) -> Vec<f64> {
        let most = most.max(2) as f64;
        let mut marks = Vec::new();
        if self.logarithmic {
            let decades = (self.high / self.low).log10();
            let digits: &[f64] = if 3.0 * decades <= most { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let stride = (decades / most).ceil().max(1.0) as usize;
            let first = self.low.log10().floor() as i32;
            for power in (first..=self.high.log10().ceil() as i32).step_by(stride) {
                marks.extend(digits.iter().map(|digit| digit * 10f64.powi(power)));
            }
        } else {
            let step = round_up((self.high - self.low) / most, &ROUND_STEPS);
            let first = (self.low / step - ROUNDING).ceil() as i64;
            let last = (self.high / step + ROUNDING).floor() as i64;
            marks.extend((first..=last).map(|k| k as f64 * step));
        }
        marks.retain(|&m| m >= self.low * (1.0 - ROUNDING) && m <= self.high * (1.0 + ROUNDING));
        // The ends are told, and so are the marks that leave them room.
        let near = 0.6 / most;
        marks.retain(|&m| (near..=1.0 - near).contains(&self.part(m)));
        marks.insert(0, self.low);
        marks.push(self.high);
        marks
    }
}

/// The least of `digits` times a power of ten that is not below `x`.
pub fn round_up(x: f64, digits: &[f64]) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    digits.iter().map(|digit| digit * power).find(|&end| end >= x * (1.0 - ROUNDING)).unwrap_or(x)
}

/// A round step that cuts `range` into at least `parts` pieces, or nearly.
pub fn round_step(range: f64, parts: usize) -> f64 {
    round_up(range / parts.max(1) as f64 / 2.0, &ROUND_STEPS)
}

/// A number for people: three digits, without zeros that say nothing.
pub fn label(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let digits = (2.0 - (x.abs() * (1.0 + ROUNDING)).log10().floor()).clamp(0.0, 6.0) as usize;
    if !WRITTEN_OUT.contains(&x.abs()) {
        let text = format!("{x:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", without_zeros(digits));
    }
    without_zeros(&format!("{x:.digits$}")).into()
}

fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// The values in colours, row after row.
pub fn coloured(values: &[f64], width: usize, scale: &Scale) -> Canvas {
    let pixels = values.iter().map(|&value| colour(scale.part(value))).collect();
    Canvas { width, height: values.len() / width.max(1), pixels }
}

/// A picture under a caption.
pub fn captioned(picture: &Canvas, caption: &str) -> Canvas {
    let scale = text_scale(picture.height);
    let (margin, line) = (4 * scale, text_height(scale));
    let width = picture.width.max((text_width(caption, scale) + 2 * margin) as usize);
    let mut canvas = Canvas::new(width, picture.height + (line + 2 * margin) as usize, GROUND);
    canvas.text(caption, margin, margin, scale);
    canvas.paste(picture, 0, line + 2 * margin);
    canvas
}

/// A picture with the bar of its scale to the right; `beyond` says that there are values above its end.
pub fn with_bar(picture: &Canvas, scale: &Scale, beyond: bool) -> Canvas {
    let size = text_scale(picture.height);
    let (margin, line) = (4 * size, text_height(size));
    let (bar, tick) = (12 * size, 3 * size);
    // The bar leaves half a line above and below for the labels of its ends.
    let length = (picture.height as i64 - line - 2 * margin).max(1);
    let marks = scale.marks((length / (2 * line)).clamp(1, 10) as usize);
    let mut labels: Vec<String> = marks.iter().map(|&mark| label(mark)).collect();
    if let Some(last) = labels.last_mut().filter(|_| beyond) {
        last.push('+');
    }
    let widest = labels.iter().map(|text| text_width(text, size)).max().unwrap_or(0);
    let strip = margin + bar + tick + size + widest + margin;
    let mut canvas = Canvas::new(picture.width + strip as usize, picture.height, GROUND);
    canvas.paste(picture, 0, 0);
    let (left, top) = (picture.width as i64 + margin, margin + line / 2);
    for y in 0..length {
        let part = 1.0 - (y as f64 + 0.5) / length as f64;
        canvas.fill(left, top + y, bar, 1, colour(part));
    }
    for (mark, text) in marks.iter().zip(&labels) {
        let y = top + ((1.0 - scale.part(*mark)) * (length - 1) as f64).round() as i64;
        canvas.fill(left + bar, y - size / 2, tick, size, [255; 3]);
        canvas.text(text, left + bar + tick + size, y - 3 * size, size);
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::luminance;

    #[test]
    fn colours_are_those_of_viridis_and_grow_lighter_all_the_way() {
        // Ends and middle of the published table.
        for (part, want) in [(0.0, [68, 1, 84]), (0.5, [33, 145, 140]), (1.0, [253, 231, 37])] {
            let got = colour(part);
            assert!((0..3).all(|c| i32::from(got[c]).abs_diff(want[c]) <= 5), "{got:?} for {want:?}");
        }
        let lightness = |k: u32| luminance(colour(f64::from(k) / 100.0).map(f64::from));
        assert!((0..100).all(|k| lightness(k) < lightness(k + 1)));
        assert_eq!((colour(f64::NAN), colour(9.0), colour(-1.0)), (GROUND, colour(1.0), colour(0.0)));
    }

    #[test]
    fn scales_end_at_round_numbers_and_leave_out_lamps() {
        let mut values: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.231).collect();
        values.extend([1e6; 10]);
        let scale = Scale::fitting(&values, false);
        assert_eq!((scale.low, scale.high), (0.0, 250.0));
        let scale = Scale::fitting(&values, true);
        assert_eq!((scale.low, scale.high), (1.0, 250.0));
        assert!((scale.part(250f64.sqrt()) - 0.5).abs() < 1e-12);
        for nothing in [vec![], vec![0.0; 9], vec![f64::NAN, f64::INFINITY]] {
            let scale = Scale::fitting(&nothing, false);
            assert_eq!((scale.low, scale.high), (0.0, 1.0));
        }
        let even = Scale::fitting(&[100.0; 9], true);
        assert!(even.low < even.high, "{even:?}");
    }

    #[test]
    fn marks_are_round_and_begin_and_end_with_the_scale() {
        let scale = |low, high, logarithmic| Scale { low, high, logarithmic };
        assert_eq!(scale(0.0, 250.0, false).marks(6), [0.0, 50.0, 100.0, 150.0, 200.0, 250.0]);
        assert_eq!(scale(3.0, 8.0, false).marks(5), [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert_eq!(scale(1.0, 1000.0, true).marks(5), [1.0, 10.0, 100.0, 1000.0]);
        let fine = scale(1.0, 20.0, true).marks(6);
        assert_eq!((fine[0], fine[1], fine[fine.len() - 1]), (1.0, 2.0, 20.0));
    }

    #[test]
    fn labels_are_short_and_keep_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (12.0, "12"),
            (149.6, "150"),
            (2000.0, "2000"),
            (0.025, "0.025"),
            (0.1 + 0.2, "0.3"),
            (1e7, "1e7"),
            (2.5e-5, "2.5e-5"),
            (-3.25, "-3.25"),
        ] {
            assert_eq!(label(x), text);
        }
        for (range, parts, step) in [(250.0, 8, 20.0), (1.0, 10, 0.05), (30.0, 10, 2.0)] {
            assert!(
                (round_step(range, parts) / step - 1.0).abs() < 1e-9,
                "{range}: {}",
                round_step(range, parts)
            );
        }
    }

    #[test]
    fn the_bar_has_all_colours_beside_the_picture() {
        let scale = Scale { low: 0.0, high: 2.0, logarithmic: false };
        let picture = coloured(&vec![1.0; 100 * 200], 100, &scale);
        let canvas = with_bar(&captioned(&picture, "x"), &scale, true);
        assert!(canvas.width > 120 && canvas.height > 200);
        // The bar's column from its top to its bottom: every colour of the scale, brightest first.
        let column: Vec<[u8; 3]> =
            (0..canvas.height).map(|y| canvas.pixels[y * canvas.width + 106]).collect();
        let bar: Vec<f64> =
            column.iter().filter(|p| **p != GROUND).map(|p| luminance(p.map(f64::from))).collect();
        assert!(bar.len() > 180 && bar.windows(2).all(|pair| pair[0] >= pair[1]), "{bar:?}");
        assert!(bar[0] > 220.0 && bar[bar.len() - 1] < 25.0);
    }
}
