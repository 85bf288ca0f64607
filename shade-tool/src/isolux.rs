//! Isolux: contours of a quantity over a picture, each labelled with its value. Contours run within faces only: where one
//! face ends and another begins, what lies between two pixels is no light.

use crate::canvas::{BORDER, Canvas, text_height, text_scale, text_width};
use crate::colour_scale::label;
use crate::contours::{Contour, contours, length};
use crate::layers::NOTHING;
use crate::quantity::Map;

/// Colour of contours.
const CONTOUR: [u8; 3] = [255, 225, 60];
/// Every so manieth contour is drawn thicker, as on maps.
const THICK_EVERY: usize = 5;
/// Where contours would lie closer than this, in widths of their line, only every fifth is drawn, or every twenty-fifth.
const CLOSEST: f64 = 3.0;
/// Contours shorter than this, in letters of their label's height, are noise of the interpolation and are not drawn.
const SHORTEST: f64 = 1.0;
/// A contour is labelled where it is so many labels long, and again after so many.
const LABEL_EVERY: f64 = 3.5;
const LONG_ENOUGH: f64 = 1.6;

/// A label to be written, with its middle.
#[derive(Debug)]
struct Place {
    text: String,
    x: i64,
    y: i64,
}

/// Draws the contours of these levels over a picture; even steps are thinned where they would touch. `faces` are
/// numbers of the faces that pixels see.
pub fn isolux(background: &Canvas, map: &Map, faces: &[u32], levels: &[f64], even: bool) -> Canvas {
    let mut canvas = background.clone();
    let scale = text_scale(canvas.height);
    let values = &map.values;
    let pure = pure_pixels(faces, map.width);
    let together = |corners: [usize; 4]| corners.iter().all(|&c| pure[c] && faces[c] == faces[corners[0]]);
    let lines: Vec<(usize, Vec<Contour>)> = levels
        .iter()
        .enumerate()
        .map(|(k, &level)| {
            let lines = contours(values, map.width, level, together);
            let step = if even { distance_to_next(levels, k) } else { f64::INFINITY };
            let drawn = |place: [f64; 2]| {
                let spacing = step / steepness(map, place);
                let mut every = 1;
                while spacing * (every as f64) < CLOSEST * scale as f64 && every < THICK_EVERY.pow(3) {
                    every *= THICK_EVERY;
                }
                (k + 1) % every == 0
            };
            let mut lines: Vec<Contour> = lines.iter().flat_map(|line| parts(line, drawn)).collect();
            lines.retain(|line| length(line) >= SHORTEST * text_height(scale) as f64);
            (k, lines)
        })
        .collect();

    // Borders of all first, so that none hides another contour.
    for (border, extra) in [(true, 1.6), (false, 0.0)] {
        let colour = if border { BORDER } else { CONTOUR };
        for (k, lines) in &lines {
            let thick = if (k + 1) % THICK_EVERY == 0 { 1.8 } else { 1.0 };
            for pair in lines.iter().flat_map(|line| line.windows(2)) {
                canvas.line([pair[0], pair[1]], scale as f64 * thick + extra, colour, |_, _| true);
            }
        }
    }
    let mut labels: Vec<Place> = Vec::new();
    for (k, lines) in lines.iter().rev() {
        let text = label(levels[*k]);
        for line in lines {
            place_labels(line, &text, scale, [canvas.width, canvas.height], &mut labels);
        }
    }
    for Place { text, x, y } in &labels {
        canvas.text(text, x - text_width(text, scale) / 2, y - 3 * scale, scale);
    }
    canvas
}

/// From a level to the next one, or for the last from the one before; for a single one without end.
fn distance_to_next(levels: &[f64], k: usize) -> f64 {
    let pair = if k + 1 < levels.len() { levels.get(k..k + 2) } else { levels.get(k.wrapping_sub(1)..k + 1) };
    pair.map_or(f64::INFINITY, |pair| pair[1] - pair[0])
}

/// How much the map changes from pixel to pixel at a place.
fn steepness(map: &Map, [x, y]: [f64; 2]) -> f64 {
    let height = map.values.len() / map.width.max(1);
    let cell = |v: f64, size: usize| ((v - 0.5).max(0.0) as usize).min(size.saturating_sub(2));
    let k = cell(y, height) * map.width + cell(x, map.width);
    let at = |k: usize| map.values.get(k).copied().unwrap_or(f64::NAN);
    let [a, b, c, d] = [k, k + 1, k + map.width, k + map.width + 1].map(at);
    let slope = (0.5 * (b + d - a - c)).hypot(0.5 * (c + d - a - b));
    if slope.is_finite() { slope } else { 0.0 }
}

/// The parts of a line whose places are drawn.
fn parts(line: &Contour, drawn: impl Fn([f64; 2]) -> bool) -> Vec<Contour> {
    let mut parts = vec![Vec::new()];
    for &place in line {
        match (drawn(place), parts.last_mut()) {
            (true, Some(part)) => part.push(place),
            _ => parts.push(Vec::new()),
        }
    }
    parts.retain(|part: &Contour| part.len() > 1);
    parts
}

/// Pixels whose four neighbours see the same face: those at a border are mixtures of two.
fn pure_pixels(faces: &[u32], width: usize) -> Vec<bool> {
    let same =
        |k: usize, other: Option<usize>| other.and_then(|o| faces.get(o)).is_none_or(|&f| f == faces[k]);
    (0..faces.len())
        .map(|k| {
            let column = k % width;
            faces[k] != NOTHING
                && same(k, (column > 0).then(|| k - 1))
                && same(k, (column + 1 < width).then_some(k + 1))
                && same(k, k.checked_sub(width))
                && same(k, Some(k + width))
        })
        .collect()
}

/// Chooses places for labels along a line, clear of the picture's border and of other labels.
fn place_labels(line: &Contour, text: &str, scale: i64, size: [usize; 2], labels: &mut Vec<Place>) {
    let (wide, high) = (text_width(text, scale), text_height(scale));
    let total = length(line);
    if total < LONG_ENOUGH * wide as f64 {
        return;
    }
    let between = LABEL_EVERY * wide as f64 + 60.0 * scale as f64;
    // The first where the line is half gone, or half the distance from its beginning.
    let mut next = (0.5 * total).min(0.5 * between);
    let mut gone = 0.0;
    for pair in line.windows(2) {
        gone += length(pair);
        if gone < next {
            continue;
        }
        let [x, y] = pair[1].map(|v| v as i64);
        let inside = x - wide / 2 > scale
            && x + wide / 2 + scale < size[0] as i64
            && y - high / 2 > scale
            && y + high / 2 + scale < size[1] as i64;
        let hides = |other: &Place| {
            let reach = (wide + text_width(&other.text, scale)) / 2 + 3 * scale;
            (other.x - x).abs() < reach && (other.y - y).abs() < high + 2 * scale
        };
        if inside && !labels.iter().any(hides) {
            labels.push(Place { text: text.into(), x, y });
            next = gone + between;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two faces side by side with the same ramp and a jump between them: each has its contours at their places, the jump
    /// has none.
    #[test]
    fn contours_run_where_a_level_is_crossed_on_one_face() {
        let (width, height) = (80, 40);
        let value = |x: usize| (x as f64 + 0.5) / 8.0 + if x >= 40 { 7.0 } else { 0.0 };
        let values = (0..width * height).map(|k| value(k % width)).collect();
        let faces: Vec<u32> = (0..width * height).map(|k| u32::from(k % width >= 40)).collect();
        let map = Map { width, values, caption: "x".into() };
        let ground = Canvas::new(width, height, [10; 3]);
        let drawn = isolux(&ground, &map, &faces, &[1.0, 3.0, 8.5, 14.0], false);
        let row = &drawn.pixels[2 * width..3 * width];
        let yellow: Vec<usize> = (0..width).filter(|&x| row[x][0] > 120).collect();
        // 1 at x = 8, 3 at 24, 14 at 56; 8.5 lies in the jump at 40. Contours of 1 pixel share two there.
        assert!(yellow.iter().all(|x| [7, 8, 23, 24, 55, 56].contains(x)) && yellow.len() == 6, "{yellow:?}");
    }

    /// Values that grow a hundred times faster on the right half: there only few contours are left, on the left all.
    #[test]
    fn contours_are_thinned_where_they_would_touch() {
        let (width, height) = (120, 40);
        let value = |x: usize| if x < 60 { x as f64 / 10.0 } else { 6.0 + (x - 60) as f64 * 10.0 };
        let values = (0..width * height).map(|k| value(k % width)).collect();
        let map = Map { width, values, caption: "x".into() };
        let levels: Vec<f64> = (1..600).map(|k| f64::from(k) - 0.55).collect();
        let drawn =
            isolux(&Canvas::new(width, height, [10; 3]), &map, &vec![0; width * height], &levels, true);
        let yellow = |columns: std::ops::Range<usize>| {
            columns.filter(|&x| drawn.pixels[2 * width + x][0] > 120).count()
        };
        assert!(yellow(0..58) >= 5, "{}", yellow(0..58));
        // Ten contours a pixel: every 125th is drawn, four in sixty pixels, thick.
        assert!((4..=16).contains(&yellow(62..120)), "{}", yellow(62..120));
    }

    #[test]
    fn labels_keep_clear_of_each_other_and_of_the_border() {
        let line: Contour = (0..2000).map(|k| [f64::from(k) * 0.2, 50.0]).collect();
        let mut labels = Vec::new();
        place_labels(&line, "100", 1, [400, 100], &mut labels);
        assert!((3..8).contains(&labels.len()), "{labels:?}");
        let before = labels.len();
        place_labels(&line, "100", 1, [400, 100], &mut labels);
        for (k, a) in labels.iter().enumerate() {
            assert!(a.x > 9 && a.x < 391);
            assert!(labels[..k].iter().all(|b| (a.x - b.x).abs() >= 21 || (a.y - b.y).abs() >= 11));
        }
        assert!(labels.len() >= before);
        place_labels(&vec![[1.0, 50.0], [8.0, 50.0]], "100", 1, [400, 100], &mut labels);
    }
}
