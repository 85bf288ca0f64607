//! 8-bit pictures to look at: pixels, lines, text with a border that is read on any ground, and the PNG file.

use crate::error::{Error, Result};
use interchange::atomic_write::{self, Outcome};
use interchange::font;
use std::path::Path;

/// What surrounds pictures: captions and scales stand on it.
pub const GROUND: [u8; 3] = [32; 3];
/// Colour of text.
const TEXT: [u8; 3] = [255; 3];
/// Colour of the border around text and lines.
pub const BORDER: [u8; 3] = [0; 3];

/// sRGB pixels, row 0 at the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Row after row.
    pub pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// One colour.
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Canvas {
        Canvas { width, height, pixels: vec![colour; width * height] }
    }

    /// Lays `colour` over a pixel, `part` of it (0 to 1); nothing outside.
    pub fn blend(&mut self, x: i64, y: i64, colour: [u8; 3], part: f64) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            let mixed = |below: u8, above: u8| {
                (f64::from(below) + part * (f64::from(above) - f64::from(below)) + 0.5) as u8
            };
            *pixel = std::array::from_fn(|c| mixed(pixel[c], colour[c]));
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, colour: [u8; 3]) {
        for row in y..y + height {
            (x..x + width).for_each(|column| self.blend(column, row, colour, 1.0));
        }
    }

    /// Copies a picture with its upper left corner at `x`, `y`.
    pub fn paste(&mut self, other: &Canvas, x: i64, y: i64) {
        for (k, &colour) in other.pixels.iter().enumerate() {
            self.blend(x + (k % other.width) as i64, y + (k / other.width) as i64, colour, 1.0);
        }
    }

    /// Draws a straight line between two places (pixel centres lie at halves), `width` pixels wide, where `seen` says so
    /// of a pixel. Each pixel is covered by its distance to the line, so that lines have no steps.
    pub fn line(
        &mut self,
        [a, b]: [[f64; 2]; 2],
        width: f64,
        colour: [u8; 3],
        seen: impl Fn(i64, i64) -> bool,
    ) {
        let reach = 0.5 * width + 0.5;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let squared = dx * dx + dy * dy;
        // Along the longer axis every row or column is visited once, across it only what the line can reach.
        let steep = dy.abs() > dx.abs();
        let (main, cross) = if steep { (1, 0) } else { (0, 1) };
        let slope = if steep { dx / dy } else { dy / dx };
        let slope = if slope.is_finite() { slope } else { 0.0 };
        let side = if steep { self.height } else { self.width } as f64;
        let (low, high) = (a[main].min(b[main]) - reach, a[main].max(b[main]) + reach);
        if !(low.is_finite() && high.is_finite()) {
            return;
        }
        for along in low.max(0.0).floor() as i64..=high.min(side).floor() as i64 {
            let middle = a[cross] + slope * (along as f64 + 0.5 - a[main]);
            let across = reach * (1.0 + slope.abs());
            for beside in (middle - across).floor() as i64..=(middle + across).floor() as i64 {
                let (x, y) = if steep { (beside, along) } else { (along, beside) };
                let (px, py) = (x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]);
                let at = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
                let part = (reach - (px - at * dx).hypot(py - at * dy)).clamp(0.0, 1.0);
                if part > 0.0 && seen(x, y) {
                    self.blend(x, y, colour, part);
                }
            }
        }
    }

    /// Writes text with its upper left corner at `x`, `y`, each cell `scale` pixels wide, white with a dark border.
    pub fn text(&mut self, text: &str, x: i64, y: i64, scale: i64) {
        let cells: Vec<(i64, i64)> = (0..font::LINE * font::width(text))
            .map(|k| (k % font::width(text), k / font::width(text)))
            .filter(|&(column, row)| font::inked(text, column, row))
            .map(|(column, row)| (x + scale * column as i64, y + scale * row as i64))
            .collect();
        for &(x, y) in &cells {
            self.fill(x - 1, y - 1, scale + 2, scale + 2, BORDER);
        }
        for &(x, y) in &cells {
            self.fill(x, y, scale, scale, TEXT);
        }
    }

    /// Writes a PNG; an identical file is left alone.
    pub fn write(&self, path: &Path) -> Result<Outcome> {
        let outcome = atomic_write::write(path, |out| {
            let mut encoder = png::Encoder::new(out, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            let mut writer = encoder.write_header()?;
            writer.write_image_data(self.pixels.as_flattened())?;
            Ok(writer.finish()?)
        });
        outcome.map_err(Error::from)
    }
}

/// Pixels to a letter's cell, such that text is read beside a picture of that height.
pub fn text_scale(height: usize) -> i64 {
    (height as i64 / 320).max(1)
}

/// Width of a text in pixels.
pub fn text_width(text: &str, scale: i64) -> i64 {
    scale * font::width(text) as i64
}

/// Height of a line of text in pixels.
pub fn text_height(scale: i64) -> i64 {
    scale * font::LINE as i64
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn text_is_white_with_a_border_and_clipped() {
        let mut canvas = Canvas::new(20, 9, [128; 3]);
        canvas.text("1", 1, 1, 1);
        assert_eq!((canvas.pixels[20 + 3], canvas.pixels[3]), (TEXT, BORDER));
        canvas.text("88", 15, 5, 3);
        canvas.paste(&Canvas::new(2, 1, [9; 3]), 19, 0);
        assert_eq!(canvas.pixels[19], [9; 3]);
    }

    /// However a line lies, it covers its length times its width, and nothing twice.
    #[test]
    fn lines_cover_their_length_times_their_width() {
        for end in [[90.0, 20.0], [20.0, 90.0], [80.0, 80.0], [90.0, 33.0], [31.0, 88.0]] {
            for width in [1.0, 3.0] {
                let mut canvas = Canvas::new(110, 110, [0; 3]);
                canvas.line([[20.0, 20.0], end], width, [255; 3], |_, _| true);
                let covered: f64 = canvas.pixels.iter().map(|p| f64::from(p[0]) / 255.0).sum();
                let want = width * ((end[0] - 20.0).hypot(end[1] - 20.0));
                // Round ends add up to (width + 1)^2 pi / 4; distances of a pixel's middle stand for its area.
                assert!(covered > 0.97 * want && covered < 1.08 * want + 13.0, "{end:?}: {covered} {want}");
            }
        }
    }

    #[test]
    fn lines_keep_to_what_is_seen_and_to_the_picture() {
        let mut canvas = Canvas::new(10, 10, [0; 3]);
        canvas.line([[-1e9, 5.0], [1e9, 5.5]], 1.0, [200; 3], |x, _| x < 4);
        let row = &canvas.pixels[50..60];
        assert!(row[3][0] > 100 && row[4][0] == 0, "{row:?}");
        canvas.line([[f64::NAN, 5.0], [1.0, f64::INFINITY]], 1.0, [200; 3], |_, _| true);
    }

    #[test]
    fn png_opens_with_its_size_and_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.png");
        let canvas = Canvas { width: 3, height: 1, pixels: vec![[1, 2, 3], [4, 5, 6], [7, 8, 9]] };
        canvas.write(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.width, frame.height), (3, 1));
        assert_eq!(bytes, [1, 2, 3, 4, 5, 6, 7, 8, 9]);
        assert_eq!(canvas.write(&path).unwrap(), Outcome::Unchanged);
    }
}
