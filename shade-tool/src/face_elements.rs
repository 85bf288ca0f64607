//! Which element of a face contains a point: a grid in the face's plane, about one element to a cell.

use geometry::plane::Plane;
use glam::{DVec2, DVec3};
use interchange::ids::{ElementId, FaceId};
use interchange::mesh::Mesh;
use interchange::ragged::Ragged;

/// Elements are entered into cells that come within this part of the face's size of their bounding rectangle, so that
/// rounding of a point or a corner does not lead to an empty cell.
const CELL_MARGIN: f64 = 1e-9;

/// The elements of all faces, findable by place.
#[derive(Debug)]
pub struct FaceElements {
    /// One per face and side: face 0 front, face 0 back, face 1 front ...
    sides: Vec<Option<FaceSide>>,
    /// Corners of each element in its face side's plane, counter-clockwise.
    corners: Vec<Vec<DVec2>>,
    /// Of each element, a point of each edge's line and its unit direction.
    lines: Vec<Vec<(DVec2, DVec2)>>,
}

/// One side of a face: a frame in its plane and a grid of cells.
#[derive(Debug)]
struct FaceSide {
    origin: DVec3,
    axes: [DVec3; 2],
    low: DVec2,
    cells_per_length: DVec2,
    columns: usize,
    rows: usize,
    /// Elements of each cell, row by row.
    cells: Ragged<u32>,
}

impl FaceElements {
    /// Enters all elements of the mesh.
    pub fn new(mesh: &Mesh) -> FaceElements {
        let mut elements = vec![Vec::new(); 2 * mesh.face_count()];
        for element in mesh.element_ids() {
            let side = mesh.element_sides[element.index()] as usize;
            elements[2 * mesh.element_face(element).index() + side].push(element);
        }
        let mut corners = vec![Vec::new(); mesh.element_count()];
        let sides = elements.iter().enumerate().map(|(side, elements)| {
            let plane = Plane::of_polygon(&mesh.face_corners(FaceId::new(side / 2)))?;
            let (u, v) = plane.axes();
            // Seen from the back the plane's axes are exchanged, so that corners run counter-clockwise there too.
            let axes = if side % 2 == 0 { [u, v] } else { [v, u] };
            for &element in elements {
                let in_plane = |p: DVec3| DVec2::from_array(axes.map(|axis| axis.dot(p - plane.origin)));
                corners[element.index()] = mesh.element_corners(element).into_iter().map(in_plane).collect();
            }
            FaceSide::new(plane.origin, axes, elements, &corners)
        });
        let sides = sides.collect();
        let lines = corners.iter().map(|corners| lines(corners)).collect();
        FaceElements { sides, corners, lines }
    }

    /// The element of that side of the face (0 front, 1 back) which contains the point, and its place in the plane. Of
    /// several, as happens on their borders, the one that the point lies deepest in; outside all, the nearest in that
    /// sense. `None` where the side has no elements.
    pub fn at(&self, face: FaceId, side: usize, point: DVec3) -> Option<(ElementId, DVec2)> {
        let side = self.sides[2 * face.index() + side].as_ref()?;
        let place = side.place(point);
        let deepest = |candidates: &mut dyn Iterator<Item = u32>| {
            let mut best: Option<(f64, u32)> = None;
            for element in candidates {
                let depth = depth(&self.lines[element as usize], place);
                if best.is_none_or(|(deepest, _)| depth > deepest) {
                    best = Some((depth, element));
                }
            }
            best.map(|(_, element)| ElementId(element))
        };
        // A cell is empty only where the point lies outside the face by more than rounding.
        let found = deepest(&mut side.cells.row(side.cell(place)).iter().copied())
            .or_else(|| deepest(&mut side.cells.values().iter().copied()));
        found.map(|element| (element, place))
    }

    /// Corners of an element in the plane in which [`FaceElements::at`] gives places, counter-clockwise.
    pub fn corners(&self, element: ElementId) -> &[DVec2] {
        &self.corners[element.index()]
    }
}

/// A point of each edge's line and its unit direction.
fn lines(corners: &[DVec2]) -> Vec<(DVec2, DVec2)> {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges.map(|(&a, &b)| (a, (b - a).normalize_or_zero())).collect()
}

/// Least signed distance from the lines of the edges: positive within the polygon.
fn depth(lines: &[(DVec2, DVec2)], point: DVec2) -> f64 {
    let distance = |&(start, along): &(DVec2, DVec2)| along.perp_dot(point - start);
    lines.iter().map(distance).fold(f64::INFINITY, f64::min)
}

impl FaceSide {
    fn new(
        origin: DVec3,
        axes: [DVec3; 2],
        elements: &[ElementId],
        corners: &[Vec<DVec2>],
    ) -> Option<FaceSide> {
        let rectangle = |element: &ElementId| {
            let empty = (DVec2::splat(f64::INFINITY), DVec2::splat(f64::NEG_INFINITY));
            corners[element.index()].iter().fold(empty, |(low, high), &p| (low.min(p), high.max(p)))
        };
        let (low, high) = elements.iter().map(rectangle).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let size = high - low;
        // As many cells as elements, as square as the face allows.
        let count = elements.len() as f64;
        let columns = (count * size.x / size.y).sqrt().ceil().clamp(1.0, count) as usize;
        let rows = (count / columns as f64).ceil().max(1.0) as usize;
        let cells_per_length = DVec2::new(columns as f64 / size.x, rows as f64 / size.y);
        let mut side =
            FaceSide { origin, axes, low, cells_per_length, columns, rows, cells: Ragged::default() };
        let mut cells = vec![Vec::new(); columns * rows];
        let margin = DVec2::splat(CELL_MARGIN * size.length());
        for element in elements {
            let (low, high) = rectangle(element);
            let ([first_column, first_row], [last_column, last_row]) =
                (side.column_and_row(low - margin), side.column_and_row(high + margin));
            for row in first_row..=last_row {
                for column in first_column..=last_column {
                    cells[row * columns + column].push(element.0);
                }
            }
        }
        side.cells = cells.into_iter().collect();
        Some(side)
    }

    fn place(&self, point: DVec3) -> DVec2 {
        DVec2::from_array(self.axes.map(|axis| axis.dot(point - self.origin)))
    }

    fn column_and_row(&self, place: DVec2) -> [usize; 2] {
        let scaled = (place - self.low) * self.cells_per_length;
        // The cast holds negative numbers at 0.
        [(scaled.x as usize).min(self.columns - 1), (scaled.y as usize).min(self.rows - 1)]
    }

    fn cell(&self, place: DVec2) -> usize {
        let [column, row] = self.column_and_row(place);
        row * self.columns + column
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh};
    use interchange::mesh::FACE_TWO_SIDED;

    #[test]
    fn every_element_contains_its_own_inner_points() {
        for n in [1, 2, 7] {
            let mesh = cube(n).mesh;
            let finder = FaceElements::new(&mesh);
            for element in mesh.element_ids() {
                let corners = mesh.element_corners(element);
                let centre = geometry::polygon::centroid(&corners);
                for corner in corners {
                    let point = centre.lerp(corner, 0.999);
                    let (found, place) = finder.at(mesh.element_face(element), 0, point).unwrap();
                    assert_eq!(found, element);
                    assert!(depth(&lines(finder.corners(element)), place) > 0.0);
                }
            }
        }
    }

    #[test]
    fn back_of_a_two_sided_face_has_its_own_elements() {
        let mut mesh = empty_mesh();
        add_parallelogram(
            &mut mesh,
            DVec3::ZERO,
            2.0 * DVec3::X,
            DVec3::new(0.5, 1.0, 0.0),
            3,
            FACE_TWO_SIDED,
        );
        let finder = FaceElements::new(&mesh);
        let point = DVec3::new(0.3, 0.1, 0.0);
        let (front, _) = finder.at(FaceId(0), 0, point).unwrap();
        let (back, place) = finder.at(FaceId(0), 1, point).unwrap();
        assert_eq!((front.0, back.0), (0, 9));
        assert!(depth(&lines(finder.corners(back)), place) > 0.0, "back corners run clockwise");
        assert!(finder.at(FaceId(0), 0, DVec3::new(-1.0, 5.0, 0.0)).is_some());
    }

    #[test]
    fn one_sided_face_has_no_back() {
        let mesh = cube(1).mesh;
        assert!(FaceElements::new(&mesh).at(FaceId(0), 1, DVec3::ZERO).is_none());
    }
}
