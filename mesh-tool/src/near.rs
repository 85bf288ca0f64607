//! Lines of light that pass each other, a border or a corner more closely than elements can follow: they are led through
//! what is there (snap rounding in the sense of Hobby 1999, with the points of the scene in place of pixels).
//!
//! A kink at a distance d from the nearest edge of an element of size h is interpolated with d / h of the error of one that
//! no edge follows. So little is lost by moving a line by a small part of h, while two lines so close together would force
//! slivers, or many elements as small as their distance. Only lines of light move; borders and contacts stay.
//!
//! The strongest lines are drawn first. Each is led through the points within the distance, the nearest first; then it
//! crosses what remains. Afterwards any two points, and any point and an edge that does not end in it, are at least the
//! distance apart, except where borders are closer or edges meet at a small angle.

use crate::frame::{nearest_on_segment, turn};
use crate::planar::{Contact, Edge, PlanarGraph, Point};
use glam::DVec2;
use std::collections::HashMap;

/// Cells along a unit of the frame, at most: lines are looked up in a grid.
const CELLS: f64 = 128.0;
/// Lengths are compared in this part of a unit of the frame, so that rounding does not choose between equal ones.
const STEP: f64 = 1.0 / 1_048_576.0;

/// A line to be drawn.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Its ends.
    pub ends: [Point; 2],
    /// What it says.
    pub contact: Contact,
}

/// Draws lines through a graph whose edges touch only at their ends, keeping the `distance` (in units of the frame).
/// Returns the number of lines that are gone: shorter than the distance, or along edges that were there.
pub fn draw(graph: &mut PlanarGraph, mut lines: Vec<Wanted>, distance: f64) -> usize {
    let length = |line: &Wanted| (line.ends[0].uv.distance(line.ends[1].uv) / STEP).round() as u64;
    lines.sort_by_key(|line| (line.contact.order, std::cmp::Reverse(length(line))));
    let mut drawing = Near::new(graph, distance);
    lines.into_iter().filter(|line| !drawing.line(line)).count()
}

/// A graph and where its points and edges are.
struct Near<'a> {
    graph: &'a mut PlanarGraph,
    distance: f64,
    cell: f64,
    points: HashMap<(i32, i32), Vec<u32>>,
    edges: HashMap<(i32, i32), Vec<u32>>,
    /// The edge between two points.
    between: HashMap<(u32, u32), usize>,
}

impl<'a> Near<'a> {
    fn new(graph: &'a mut PlanarGraph, distance: f64) -> Self {
        let cell = distance.max(1.0 / CELLS);
        let (points, edges, between) = (HashMap::new(), HashMap::new(), HashMap::new());
        let mut near = Near { graph, distance, cell, points, edges, between };
        (0..near.graph.points.len() as u32).for_each(|point| near.file_point(point));
        (0..near.graph.edges.len()).for_each(|edge| near.file_edge(edge));
        near
    }

    fn uv(&self, point: u32) -> DVec2 {
        self.graph.points[point as usize].uv
    }

    fn ends(&self, edge: usize) -> [u32; 2] {
        [self.graph.edges[edge].from, self.graph.edges[edge].to]
    }

    fn file_point(&mut self, point: u32) {
        let at = (self.uv(point) / self.cell).floor();
        self.points.entry((at.x as i32, at.y as i32)).or_default().push(point);
    }

    fn file_edge(&mut self, edge: usize) {
        let [from, to] = self.ends(edge);
        self.between.insert((from.min(to), from.max(to)), edge);
        for cell in cells([from, to].map(|p| self.uv(p)), 0.0, self.cell) {
            self.edges.entry(cell).or_default().push(edge as u32);
        }
    }

    /// Points, or edges, filed in cells that a segment passes within the distance; in rising order.
    fn filed(&self, by_cell: &HashMap<(i32, i32), Vec<u32>>, ends: [DVec2; 2]) -> Vec<u32> {
        let near = cells(ends, self.distance, self.cell).filter_map(|cell| by_cell.get(&cell));
        let mut found: Vec<u32> = near.flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Draws a line; `false` where nothing new is to be seen of it.
    fn line(&mut self, line: &Wanted) -> bool {
        let [from, to] = line.ends.map(|end| self.stop(end));
        let mut stops = vec![from];
        if from != to {
            stops.extend(self.led(from, to));
        }
        let mut new = false;
        for ends in stops.windows(2) {
            let known = self.between.get(&(ends[0].min(ends[1]), ends[0].max(ends[1])));
            match known.map(|&edge| &mut self.graph.edges[edge]) {
                Some(edge) if edge.contacts.contains(&line.contact) => {}
                Some(edge) => edge.contacts.push(line.contact),
                None => new |= self.cross(ends[0], ends[1], line.contact),
            }
        }
        new
    }

    /// The point where a line ends: one within the distance, else one on an edge within it, else its own.
    fn stop(&mut self, end: Point) -> u32 {
        let at = [end.uv, end.uv];
        let points = self.filed(&self.points, at).into_iter();
        let nearest = points.map(|p| (self.uv(p).distance(end.uv), p)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, point)) = nearest.filter(|&(away, _)| away <= self.distance) {
            return point;
        }
        let feet = self.filed(&self.edges, at).into_iter().map(|edge| {
            let [a, b] = self.ends(edge as usize).map(|p| self.uv(p));
            (nearest_on_segment(a, b, end.uv), edge as usize)
        });
        let nearest = feet.min_by(|a, b| a.0.1.total_cmp(&b.0.1));
        match nearest.filter(|((_, away), _)| *away <= self.distance) {
            Some(((along, _), edge)) => self.split(edge, along),
            None => {
                let point = self.graph.point(end);
                self.file_point(point);
                point
            }
        }
    }

    /// Splits an edge; where that would be within the distance of one of its ends, that end is the point.
    fn split(&mut self, edge: usize, along: f64) -> u32 {
        let point = self.graph.along(edge, along);
        let ends = self.ends(edge);
        let nearest = if along < 0.5 { ends[0] } else { ends[1] };
        if self.uv(nearest).distance(point.uv) <= self.distance {
            return nearest;
        }
        self.part(edge, point)
    }

    /// Splits an edge at a point.
    fn part(&mut self, edge: usize, point: Point) -> u32 {
        let [from, to] = self.ends(edge);
        self.between.remove(&(from.min(to), from.max(to)));
        let middle = self.graph.point(point);
        self.file_point(middle);
        self.graph.lead_through(edge, &[middle]);
        // Its own half is found in the cells of the whole.
        self.between.insert((from.min(middle), from.max(middle)), edge);
        self.file_edge(self.graph.edges.len() - 1);
        middle
    }

    /// The stops of a line after `from`: it is led through the points within the distance, the nearest first.
    fn led(&self, from: u32, to: u32) -> Vec<u32> {
        // No point is a stop twice, so that this ends.
        let (mut used, mut stops, mut open) = (vec![from, to], Vec::new(), vec![(from, to)]);
        while let Some((from, to)) = open.pop() {
            let [a, b] = [from, to].map(|p| self.uv(p));
            let beside = self.filed(&self.points, [a, b]).into_iter().filter(|p| !used.contains(p));
            let nearest = beside
                .map(|point| (nearest_on_segment(a, b, self.uv(point)), point))
                .filter(|((along, away), _)| *away <= self.distance && *along > 0.0 && *along < 1.0)
                .min_by(|a, b| a.0.1.total_cmp(&b.0.1));
            match nearest {
                Some((_, point)) => {
                    used.push(point);
                    open.extend([(point, to), (from, point)]);
                }
                None => stops.push(to),
            }
        }
        stops
    }

    /// Draws a piece of a line, splitting the edges it crosses.
    fn cross(&mut self, from: u32, to: u32, contact: Contact) -> bool {
        let [a, b] = [from, to].map(|p| self.uv(p));
        let mut crossings: Vec<(f64, f64, usize)> = self
            .filed(&self.edges, [a, b])
            .into_iter()
            .filter_map(|edge| {
                let ends = self.ends(edge as usize);
                if ends.contains(&from) || ends.contains(&to) {
                    return None;
                }
                let [c, d] = ends.map(|p| self.uv(p));
                let (side_a, side_b) = (turn(c, d, a), turn(c, d, b));
                let (side_c, side_d) = (turn(a, b, c), turn(a, b, d));
                let cross = (side_a > 0.0) != (side_b > 0.0) && (side_c > 0.0) != (side_d > 0.0);
                cross.then(|| (side_a / (side_a - side_b), side_c / (side_c - side_d), edge as usize))
            })
            .collect();
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut at = from;
        for (_, along, edge) in crossings {
            let point = self.graph.along(edge, along);
            let middle = self.part(edge, point);
            self.piece(at, middle, contact);
            at = middle;
        }
        self.piece(at, to, contact);
        true
    }

    fn piece(&mut self, from: u32, to: u32, contact: Contact) {
        self.graph.edges.push(Edge { from, to, borders: Vec::new(), contacts: vec![contact] });
        self.file_edge(self.graph.edges.len() - 1);
    }
}

/// Cells of a grid that a segment passes within a margin.
fn cells([a, b]: [DVec2; 2], margin: f64, cell: f64) -> impl Iterator<Item = (i32, i32)> {
    let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
    let columns = ((a.x - margin) / cell).floor() as i32..=((b.x + margin) / cell).floor() as i32;
    let slope = (b.y - a.y) / (b.x - a.x);
    columns.flat_map(move |column| {
        // The part of the segment that can be near a point of this column.
        let height = |x: f64| if b.x > a.x { a.y + slope * (x.clamp(a.x, b.x) - a.x) } else { a.y };
        let (left, right) = (f64::from(column) * cell - margin, f64::from(column + 1) * cell + margin);
        let (low, high) = if b.x > a.x {
            (height(left).min(height(right)), height(left).max(height(right)))
        } else {
            (a.y.min(b.y), a.y.max(b.y))
        };
        let rows = ((low - margin) / cell).floor() as i32..=((high + margin) / cell).floor() as i32;
        rows.map(move |row| (column, row))
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::planar::Border;

    fn point(x: f64, y: f64) -> Point {
        Point { uv: DVec2::new(x, y), position: glam::DVec3::new(x, y, 0.0), place: None }
    }

    /// A square of side 1 with lines in it, and how many were gone.
    fn square(lines: &[[(f64, f64); 2]], distance: f64) -> (PlanarGraph, usize) {
        let mut graph = PlanarGraph::default();
        let ring = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| graph.point(point(x, y)));
        graph.ring(&ring, Border { sheet: 0, forward: true });
        let wanted = |(k, ends): (usize, &[(f64, f64); 2])| Wanted {
            ends: ends.map(|(x, y)| point(x, y)),
            contact: Contact { sheet: 0, source: k as u32, order: 1 },
        };
        let gone = draw(&mut graph, lines.iter().enumerate().map(wanted).collect(), distance);
        (graph.arrange(1e-9).unwrap().0, gone)
    }

    #[test]
    fn lines_beside_borders_and_each_other_are_one_with_them() {
        // Along the lower border, along each other, and from the corner of nothing into nothing.
        let lines = [
            [(0.1, 0.004), (0.8, 0.004)],
            [(0.0, 0.5), (1.0, 0.5)],
            [(0.002, 0.505), (0.999, 0.495)],
            [(0.3, 0.7), (0.304, 0.703)],
        ];
        let (graph, gone) = square(&lines, 0.01);
        assert_eq!(gone, 3);
        // Two points of the first line, two of the second, one of the last.
        assert_eq!(graph.points.len(), 4 + 2 + 2 + 1);
        let two = graph.edges.iter().filter(|edge| edge.contacts.len() == 2);
        assert_eq!(two.count(), 1);
    }

    #[test]
    fn a_star_of_lines_has_one_middle() {
        let lines: Vec<_> = (0..12)
            .map(|k| {
                let (sine, cosine) = (f64::from(k) * 0.26 + 0.1).sin_cos();
                let off = 0.003 * f64::from(k % 5 - 2);
                [0.4, -0.4].map(|r| (0.5 + r * cosine + off, 0.5 + r * sine))
            })
            .collect();
        let (graph, gone) = square(&lines, 0.02);
        assert_eq!(gone, 0);
        let near = |p: &&Point| p.uv.distance(DVec2::splat(0.5)) < 0.1;
        assert_eq!(graph.points.iter().filter(near).count(), 1);
        // Without the distance there are many.
        let (graph, _) = square(&lines, 1e-9);
        assert!(graph.points.iter().filter(near).count() > 20);
    }
}
