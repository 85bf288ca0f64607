//! Pixels, rectangles and text, and the PNG file they become.

use interchange::atomic_write::{self, Outcome};
use interchange::error::{Error, Result, meant_ending};
use interchange::font;
use std::path::Path;

/// What surrounds pictures.
pub const GROUND: [u8; 3] = [255; 3];
/// Text and frames.
pub const INK: [u8; 3] = [20; 3];

/// sRGB pixels, row 0 at the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// Nothing but ground.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![GROUND; width * height] }
    }

    /// Colour of a pixel within the picture.
    pub fn get(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// Sets a pixel; nothing outside.
    pub fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = colour;
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        (y..y + height).for_each(|row| (x..x + width).for_each(|column| self.set(column, row, colour)));
    }

    /// Draws the border of a rectangle, one pixel wide and within it.
    pub fn frame(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        if width == 0 || height == 0 {
            return;
        }
        self.fill(x, y, width, 1, colour);
        self.fill(x, y + height - 1, width, 1, colour);
        self.fill(x, y, 1, height, colour);
        self.fill(x + width - 1, y, 1, height, colour);
    }

    /// Writes a line of text, its upper left corner at a pixel, each of its cells `zoom` pixels wide.
    pub fn text(&mut self, x: usize, y: usize, zoom: usize, text: &str) {
        for row in 0..font::LINE {
            for column in 0..font::width(text) {
                if font::inked(text, column, row) {
                    self.fill(x + zoom * column, y + zoom * row, zoom, zoom, INK);
                }
            }
        }
    }

    /// Writes the picture; an identical file is left alone.
    ///
    /// # Errors
    /// The name does not end in `.png`, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<Outcome> {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("png")) {
            let meant = meant_ending(path, ["png"]);
            return Err(Error::whole(path, format!("expected a name ending in .png{meant}")));
        }
        let failed = |e: png::EncodingError| std::io::Error::other(e.to_string());
        atomic_write::write(path, |out| {
            let mut encoder = png::Encoder::new(out, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            let mut writer = encoder.write_header().map_err(failed)?;
            writer.write_image_data(self.pixels.as_flattened()).map_err(failed)?;
            writer.finish().map_err(failed)
        })
    }
}
