//! Contours of a map over pixels: marching squares (Lorensen & Cline 1987 in the plane) over the pixels' middles, chained
//! into lines.

use std::collections::BTreeMap;

/// A line along which the map has one value. Places are in pixels; the middle of the first pixel is 0.5, 0.5.
pub type Contour = Vec<[f64; 2]>;

/// A side of the grid of pixel middles, from pixel `k` to the right (`false`) or down (`true`).
type Side = (usize, bool);

/// The contours of one level. Only squares of four pixels that `together` accepts (their numbers) take part, and no value
/// among them may be infinite or not a number. Closed contours end where they begin.
pub fn contours(
    values: &[f64],
    width: usize,
    level: f64,
    together: impl Fn([usize; 4]) -> bool,
) -> Vec<Contour> {
    // Each square gives none, one or two pieces from side to side.
    let mut neighbours: BTreeMap<Side, Vec<Side>> = BTreeMap::new();
    let height = values.len() / width.max(1);
    for y in 0..height.saturating_sub(1) {
        for x in 0..width.saturating_sub(1) {
            let k = y * width + x;
            // Around the square: upper left, upper right, lower right, lower left.
            let corners = [k, k + 1, k + width + 1, k + width];
            if corners.iter().any(|&c| !values[c].is_finite()) || !together(corners) {
                continue;
            }
            let sides: [Side; 4] = [(k, false), (k + 1, true), (k + width, false), (k, true)];
            let above = corners.map(|c| values[c] >= level);
            let crossed: Vec<Side> =
                (0..4).filter(|&s| above[s] != above[(s + 1) % 4]).map(|s| sides[s]).collect();
            let mut join = |a: Side, b: Side| {
                neighbours.entry(a).or_default().push(b);
                neighbours.entry(b).or_default().push(a);
            };
            match crossed[..] {
                [a, b] => join(a, b),
                [a, b, c, d] => {
                    // A saddle: the middle's value says which corners hang together.
                    let middle = corners.iter().map(|&c| values[c]).sum::<f64>() / 4.0 >= level;
                    if middle == above[0] {
                        join(a, b);
                        join(c, d);
                    } else {
                        join(a, d);
                        join(b, c);
                    }
                }
                _ => {}
            }
        }
    }
    let place = |&(k, down): &Side| {
        let other = if down { k + width } else { k + 1 };
        let part = ((level - values[k]) / (values[other] - values[k])).clamp(0.0, 1.0);
        let (x, y) = ((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        if down { [x, y + part] } else { [x + part, y] }
    };

    // Open contours from their ends first, then the closed ones.
    let ends: Vec<Side> =
        neighbours.iter().filter(|(_, others)| others.len() == 1).map(|(&side, _)| side).collect();
    let all: Vec<Side> = neighbours.keys().copied().collect();
    let mut lines = Vec::new();
    for start in ends.into_iter().chain(all) {
        let mut line = Vec::new();
        let mut at = start;
        // Each piece is walked along once.
        while let Some(next) = neighbours.get_mut(&at).and_then(Vec::pop) {
            if line.is_empty() {
                line.push(place(&at));
            }
            if let Some(back) = neighbours.get_mut(&next)
                && let Some(found) = back.iter().position(|&side| side == at)
            {
                back.swap_remove(found);
            }
            line.push(place(&next));
            at = next;
        }
        if !line.is_empty() {
            lines.push(line);
        }
    }
    lines
}

/// Length of a line in pixels.
pub fn length(line: &[[f64; 2]]) -> f64 {
    line.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: usize, height: usize, value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        (0..width * height).map(|k| value((k % width) as f64 + 0.5, (k / width) as f64 + 0.5)).collect()
    }

    #[test]
    fn contour_of_a_ramp_is_a_straight_line_at_its_place() {
        let values = map(40, 30, |x, y| 2.0 * x + y);
        let found = contours(&values, 40, 50.0, |_| true);
        assert_eq!(found.len(), 1);
        assert!(found[0].iter().all(|[x, y]| (2.0 * x + y - 50.0).abs() < 1e-9), "{found:?}");
        // From (24.75, 0.5) to (10.25, 29.5).
        assert!((length(&found[0]) - 14.5f64.hypot(29.0)).abs() < 1e-9, "{}", length(&found[0]));
    }

    #[test]
    fn contour_of_a_hill_is_one_closed_circle() {
        let values = map(60, 60, |x, y| -(x - 30.0).hypot(y - 30.0));
        let found = contours(&values, 60, -20.0, |_| true);
        assert_eq!((found.len(), found[0].first()), (1, found[0].last()));
        // A polygon with corners on the circle, to a pixel's curvature.
        assert!((length(&found[0]) / (40.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn contours_end_at_borders_and_at_what_is_not_known() {
        let mut values = map(40, 9, |_, y| y);
        values[4 * 40 + 20] = f64::NAN;
        let found = contours(&values, 40, 4.7, |_| true);
        assert_eq!(found.len(), 2);
        let found = contours(&map(40, 9, |_, y| y), 40, 4.7, |corners| !corners.contains(&(4 * 40 + 10)));
        assert_eq!(found.len(), 2);
        let total: f64 = found.iter().map(|line| length(line)).sum();
        assert!((total - 37.0).abs() < 1e-9, "39 squares but two: {total}");
    }

    /// Equal values, and a saddle in the middle of a chequer, neither loop for ever nor are left out.
    #[test]
    fn saddles_and_plateaus_end() {
        let chequer = map(8, 8, |x, y| f64::from((x as u32 + y as u32) % 2));
        let pieces: usize = contours(&chequer, 8, 0.5, |_| true).iter().map(|line| line.len() - 1).sum();
        assert_eq!(pieces, 2 * 49);
        assert_eq!(contours(&[1.0; 64], 8, 1.0, |_| true), Vec::<Contour>::new());
    }
}
