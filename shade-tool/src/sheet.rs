//! `sheet`: a contact sheet of pictures that belong together, such as those after 0, 1, 3 and all bounces, all shown with
//! the exposure and curve of the last one, so that what differs is the light.

use crate::canvas::{Canvas, GROUND, text_height, text_scale, text_width};
use crate::error::{Error, Result};
use crate::exr_reader::StoredPicture;
use crate::flag_values::ends_in;
use crate::picture::{Picture, luminance};
use crate::tone::ToneArguments;
use crate::view::tell_exposure;
use crate::{TOOL, VERSION};
use interchange::report::Report;
use std::path::PathBuf;

/// Pictures side by side where no other number is asked for.
const COLUMNS: usize = 4;
/// Largest side of a sheet in pixels.
const LARGEST_SIDE: usize = 1 << 16;

/// Flags of `sheet`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples: the solutions after 0, 1 and 2 bounces, gathered once more, give the light after 0 to 3 bounces:
  solve-tool solve s.ff --mesh s.mesh -o 0.sol --bounces 0   (and 1 and 2)
  shade-tool render s.sol --mesh s.mesh -o s.exr --bounces 0.sol,1.sol,2.sol
  shade-tool sheet s.exr -o bounces.png --bounces 0,1,3
Models beside each other, and snapshots of progressive refinement (solve-tool solve --solver southwell --snapshots
1,10,100) as they are, with their ambient term (shade-tool render --interpolation constant):
  shade-tool sheet flat.exr phong.exr s.exr -o models.png --labels flat,phong,radiosity
  shade-tool sheet 1.exr 10.exr 100.exr s.exr -o shots.png --labels \"1 shot,10 shots,100 shots,converged\""
)]
pub struct SheetArguments {
    /// Pictures by render, the one that the others are compared with last
    #[arg(value_name = "S.EXR", required = true)]
    pub pictures: Vec<PathBuf>,
    /// Sheet to write
    #[arg(short, long, value_name = "SHEET.PNG", value_parser = ends_in("png"))]
    pub output: PathBuf,
    /// Show these layers bounces.N of the last picture before it
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    pub bounces: Vec<u32>,
    /// What stands above the pictures (default: their files' names)
    #[arg(long, value_name = "TEXTS", value_delimiter = ',')]
    pub labels: Vec<String>,
    /// Pictures side by side (default: up to 4)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub columns: Option<u32>,
    /// Exposure and curve of all pictures; automatic for the last one.
    #[command(flatten)]
    pub tone: ToneArguments,
}

impl SheetArguments {
    /// Bad usage that single flags do not show.
    pub fn usage(&self) -> std::result::Result<(), String> {
        match (self.labels.len(), self.pictures.len() + self.bounces.len()) {
            (0, _) => Ok(()),
            (labels, pictures) if labels == pictures => Ok(()),
            (labels, pictures) => Err(format!("--labels gives {labels} texts for {pictures} pictures")),
        }
    }

    /// Makes the sheet and its report.
    pub fn run(&self) -> Result<()> {
        let mut report = Report::new(TOOL, VERSION);
        let mut stored: Vec<StoredPicture> =
            self.pictures.iter().map(|path| StoredPicture::read(path)).collect::<Result<_>>()?;
        let Some(last) = stored.pop() else { return Ok(()) };
        let tone = self.tone.fitted(&last.picture);
        tell_exposure(&tone, &mut report);
        let stem = |one: &StoredPicture| {
            one.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
        };
        let mut shown: Vec<(String, Picture)> =
            stored.into_iter().map(|one| (stem(&one), one.picture)).collect();
        for &bounces in &self.bounces {
            let name = if bounces == 1 { "1 bounce".into() } else { format!("{bounces} bounces") };
            shown.push((name, after(&last, bounces)?));
        }
        let mut cells = Vec::new();
        for (k, (name, picture)) in shown.iter().enumerate() {
            let off = difference(picture, &last.picture);
            if let Some(off) = off {
                report.estimate(&format!("relative_rms_{k}"), off);
            }
            let below = off.map(|off| format!("{} off", percent(off))).unwrap_or_default();
            cells.push(Cell { picture: tone.shown(picture), lines: [name.clone(), below] });
        }
        cells.push(Cell { picture: tone.shown(&last.picture), lines: [stem(&last), String::new()] });
        for (cell, label) in cells.iter_mut().zip(&self.labels) {
            cell.lines[0].clone_from(label);
        }
        let columns = self.columns.map_or(COLUMNS, |n| n as usize).min(cells.len());
        let canvas = laid_out(&cells, columns).ok_or_else(|| {
            let found = format!("with the others is more than {LARGEST_SIDE} pixels wide or high");
            Error::view(&last.path, found, "render smaller, or give another number of --columns")
        })?;
        report.count("pictures", cells.len());
        canvas.write(&self.output)?;
        Ok(report.write_beside(&self.output)?)
    }
}

/// The light of a picture after so many bounces.
fn after(stored: &StoredPicture, bounces: u32) -> Result<Picture> {
    let Picture { width, height, bounces: all, .. } = &stored.picture;
    let pixels = all.get(bounces as usize).ok_or_else(|| {
        let found = format!("has no layer bounces.{bounces}");
        Error::view(&stored.path, found, "render it with --bounces, a solution for each bounce")
    })?;
    Ok(Picture { width: *width, height: *height, pixels: pixels.clone(), ..Picture::default() })
}

/// A picture of the sheet with what stands above it.
struct Cell {
    picture: Canvas,
    lines: [String; 2],
}

/// Root of the mean squared difference of luminance, as part of the reference's mean; `None` for other sizes or a black
/// reference.
fn difference(picture: &Picture, reference: &Picture) -> Option<f64> {
    let same_size = (picture.width, picture.height) == (reference.width, reference.height);
    let mean = luminance(reference.mean());
    let squares = picture.pixels.iter().zip(&reference.pixels);
    let sum: f64 = squares.map(|(&a, &b)| (luminance(a) - luminance(b)).powi(2)).sum();
    let off = (sum / reference.pixels.len().max(1) as f64).sqrt() / mean;
    (same_size && off.is_finite()).then_some(off)
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    let digits = if percent < 9.95 { 1 } else { 0 };
    format!("{percent:.digits$} %")
}

/// Cells in rows, each as wide and high as the largest.
fn laid_out(cells: &[Cell], columns: usize) -> Option<Canvas> {
    let height = cells.iter().map(|cell| cell.picture.height).max()?;
    let scale = text_scale(height);
    let (margin, line) = (4 * scale, text_height(scale));
    let widths = |cell: &Cell| {
        let texts = cell.lines.iter().map(|text| text_width(text, scale));
        texts.fold(cell.picture.width as i64, i64::max)
    };
    let width = cells.iter().map(widths).max()? + margin;
    let head = 2 * line + 2 * margin;
    let step = head + height as i64;
    let size = [margin + columns as i64 * width, cells.len().div_ceil(columns.max(1)) as i64 * step + margin];
    if size.iter().any(|&side| side > LARGEST_SIDE as i64) {
        return None;
    }
    let mut canvas = Canvas::new(size[0] as usize, size[1] as usize, GROUND);
    for (k, cell) in cells.iter().enumerate() {
        let (x, y) = (margin + (k % columns) as i64 * width, (k / columns) as i64 * step);
        canvas.text(&cell.lines[0], x, y + margin, scale);
        canvas.text(&cell.lines[1], x, y + margin + line, scale);
        canvas.paste(&cell.picture, x, y + head);
    }
    Some(canvas)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn grey(width: usize, value: f64) -> Picture {
        Picture { width, height: 4, pixels: vec![[value; 3]; 4 * width], ..Picture::default() }
    }

    #[test]
    fn differences_are_relative_to_the_last_and_need_one_size() {
        assert!((difference(&grey(5, 0.9), &grey(5, 1.2)).unwrap() - 0.25).abs() < 1e-12);
        assert_eq!(difference(&grey(5, 1.0), &grey(6, 1.0)), None);
        assert_eq!(difference(&grey(5, 1.0), &grey(5, 0.0)), None);
        assert_eq!((percent(0.25), percent(0.0123)), ("25 %".into(), "1.2 %".into()));
    }

    #[test]
    fn cells_stand_in_rows_and_sheets_have_a_largest_size() {
        let cell = |value: u8| Cell {
            picture: Canvas::new(30, 20, [value; 3]),
            lines: [String::from("a"), String::new()],
        };
        let cells: Vec<Cell> = [100, 150, 200].map(cell).into();
        let sheet = laid_out(&cells, 2).unwrap();
        // Rows of 4 + 9 + 9 + 4 + 20, columns of 30 + 4.
        assert_eq!((sheet.width, sheet.height), (72, 96));
        let at = |x: usize, y: usize| sheet.pixels[y * sheet.width + x][0];
        assert_eq!((at(4, 26), at(38, 26), at(4, 72), at(38, 72)), (100, 150, 200, GROUND[0]));
        let wide = Cell { picture: Canvas::new(LARGEST_SIDE, 1, [0; 3]), lines: Default::default() };
        assert!(laid_out(&[wide], 1).is_none());
    }
}
