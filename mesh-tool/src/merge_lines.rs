//! Lines of one emitter that lie on one straight line of a face are merged: several wedges in one plane leave the same
//! line (a square over a square: 32 wedges, 8 lines).

use crate::discontinuity::DrawnLine;
use glam::DVec3;
use std::collections::BTreeMap;

/// Lengths are compared in steps of this many weld tolerances.
const STEP: f64 = 1024.0;

/// A span on a straight line, with its order.
type Span = (f64, f64, u32);

/// Segments of one straight line of one emitter on one side of a face.
struct Straight {
    origin: DVec3,
    direction: DVec3,
    /// Spans, each with its own ends, so that no end is moved.
    spans: Vec<(Span, [DVec3; 2])>,
}

/// Merges lines: where several overlap, the lowest order holds.
pub fn merged_lines(lines: Vec<DrawnLine>, tolerance: f64) -> Vec<DrawnLine> {
    let mut surfaces: BTreeMap<(u32, u32, u32), Vec<DrawnLine>> = BTreeMap::new();
    for line in lines {
        surfaces.entry((line.face, line.side, line.source)).or_default().push(line);
    }
    let mut merged = Vec::new();
    for ((face, side, source), mut lines) in surfaces {
        // Long lines fix a direction best; in steps, so that rounding does not choose between equal ones.
        let steps =
            |line: &DrawnLine| (line.ends[0].distance(line.ends[1]) / (STEP * tolerance)).round() as u64;
        lines.sort_by_key(|line| std::cmp::Reverse(steps(line)));
        let mut straights: Vec<Straight> = Vec::new();
        for line in lines {
            let same = straights.iter_mut().find(|straight| {
                line.ends.iter().all(|&end| {
                    let offset = end - straight.origin;
                    (offset - offset.dot(straight.direction) * straight.direction).length() <= 4.0 * tolerance
                })
            });
            let straight = match same {
                Some(straight) => straight,
                None => {
                    let direction = (line.ends[1] - line.ends[0]).normalize();
                    straights.push(Straight { origin: line.ends[0], direction, spans: Vec::new() });
                    let last = straights.len() - 1;
                    &mut straights[last]
                }
            };
            let at = line.ends.map(|end| (end - straight.origin).dot(straight.direction));
            let (span, ends) = if at[0] <= at[1] {
                ((at[0], at[1], line.order), line.ends)
            } else {
                ((at[1], at[0], line.order), [line.ends[1], line.ends[0]])
            };
            straight.spans.push((span, ends));
        }
        for straight in &straights {
            for (ends, order) in united(straight, tolerance) {
                merged.push(DrawnLine { face, side, ends, order, source });
            }
        }
    }
    merged
}

/// The union of the spans, in pieces of one order.
fn united(straight: &Straight, tolerance: f64) -> Vec<([DVec3; 2], u32)> {
    let mut stops: Vec<(f64, DVec3)> = straight
        .spans
        .iter()
        .flat_map(|((low, high, _), ends)| [(*low, ends[0]), (*high, ends[1])])
        .collect();
    stops.sort_by(|a, b| a.0.total_cmp(&b.0));
    stops.dedup_by(|later, first| later.0 - first.0 <= 2.0 * tolerance);
    let mut pieces: Vec<([DVec3; 2], u32)> = Vec::new();
    let mut reached = f64::NEG_INFINITY;
    for ends in stops.windows(2) {
        let middle = 0.5 * (ends[0].0 + ends[1].0);
        let over = straight.spans.iter().filter(|((low, high, _), _)| *low <= middle && middle <= *high);
        let Some(order) = over.map(|((_, _, order), _)| *order).min() else { continue };
        match pieces.last_mut() {
            Some((last, same)) if *same == order && reached == ends[0].0 => last[1] = ends[1].1,
            _ => pieces.push(([ends[0].1, ends[1].1], order)),
        }
        reached = ends[1].0;
    }
    pieces
}
