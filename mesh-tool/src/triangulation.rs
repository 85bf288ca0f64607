//! Constrained Delaunay triangulation of a planar graph (spade), and which sheets each triangle lies in.
//!
//! Membership is topological: starting outside, the winding number of a sheet changes by one wherever one of its
//! border edges is crossed. No point-in-polygon test can fall on the wrong side of a sliver that way.

use crate::hidden::HIDDEN;
use crate::planar::{Border, PlanarGraph};
use glam::DVec2;
use interchange::Error;
use interchange::scene::Scene;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::HashMap;

/// Coordinates of order one are rounded to this grid before spade sees them: then a scene in another unit, whose
/// coordinates differ in the last digits, has the same triangles. It is 60 times finer than the weld tolerance.
const GRID: f64 = 68_719_476_736.0; // 2^36
/// Points at least this far apart, in units of the frame, and as far from each other's edges keep their sides when they
/// are rounded to the grid: four of its steps.
pub const RESOLUTION: f64 = 4.0 / GRID;
/// A shear that lets the four corners of a square prefer one diagonal; far above the rounding to the grid.
const SHEAR: f64 = 1.0 / 65_536.0;

/// Why a plane could not be triangulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// Edges kept crossing each other although they were split.
    Tangled,
    /// Points fell together.
    Crowded,
    /// spade refused a coordinate.
    Coordinate,
}

impl Trouble {
    /// As an error that names the face.
    pub fn at(self, scene: &Scene, line: usize) -> Error {
        let reason = match self {
            Trouble::Tangled => "borders in its plane cross each other too closely to be told apart",
            Trouble::Crowded => "corners in its plane lie too close together to be told apart",
            Trouble::Coordinate => "its coordinates cannot be represented",
        };
        Error::scene(
            &scene.path,
            line,
            format!("the face cannot be triangulated: {reason}; simplify the faces around it"),
        )
    }
}

/// A triangle, counter-clockwise in the frame. Edge k runs from corner k to corner k + 1.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Points of the graph.
    pub corners: [u32; 3],
    /// Triangle beyond each edge.
    pub neighbours: [Option<u32>; 3],
    /// Edge of the graph that each edge is.
    pub constraints: [Option<u32>; 3],
    /// Index into the regions.
    pub region: u32,
}

/// The triangles of a planar graph.
#[derive(Debug, Clone)]
pub struct Triangulation {
    /// Triangles of the convex hull of all points.
    pub triangles: Vec<Triangle>,
    /// Winding number of each sheet that is not zero, per region.
    regions: Vec<Vec<(u32, i32)>>,
}

impl Triangulation {
    /// Triangulates `graph`, whose edges may touch only at their ends.
    pub fn new(graph: &PlanarGraph) -> Result<Triangulation, Trouble> {
        let vertices: Vec<Point2<f64>> = graph.points.iter().map(|point| key(point.uv)).collect();
        let edges: Vec<[usize; 2]> = graph.edges.iter().map(|e| [e.from as usize, e.to as usize]).collect();
        let mut conflicts = 0;
        let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(vertices, edges, |_| {
            conflicts += 1;
        })
        .map_err(|_| Trouble::Coordinate)?;
        // spade drops points that fall together, which would shift the numbers of all later ones.
        if cdt.num_vertices() != graph.points.len() {
            return Err(Trouble::Crowded);
        }
        if conflicts > 0 || cdt.num_constraints() != graph.edges.len() {
            return Err(Trouble::Tangled);
        }
        let constraint: HashMap<(u32, u32), u32> = graph
            .edges
            .iter()
            .enumerate()
            .flat_map(|(k, edge)| [((edge.from, edge.to), k as u32), ((edge.to, edge.from), k as u32)])
            .collect();
        // spade counts its outer face as number 0.
        let triangles: Vec<Triangle> = cdt
            .inner_faces()
            .map(|face| {
                let edges = face.adjacent_edges();
                let corners = edges.map(|edge| edge.from().index() as u32);
                let neighbours =
                    edges.map(|edge| edge.rev().face().as_inner().map(|face| face.index() as u32 - 1));
                let constraints =
                    [0, 1, 2].map(|k| constraint.get(&(corners[k], corners[(k + 1) % 3])).copied());
                Triangle { corners, neighbours, constraints, region: 0 }
            })
            .collect();
        // An edge that runs through a point becomes two constraints, of which one may be an edge, too: then the counts
        // agree, but the border has a gap.
        let mut found = vec![false; graph.edges.len()];
        let constraints = triangles.iter().flat_map(|triangle| triangle.constraints);
        constraints.flatten().for_each(|edge| found[edge as usize] = true);
        if !triangles.is_empty() && found.contains(&false) {
            return Err(Trouble::Tangled);
        }
        let mut triangulation = Triangulation { triangles, regions: Vec::new() };
        triangulation.flood(graph);
        Ok(triangulation)
    }

    /// How often the border of `sheet` runs around triangle `triangle`.
    pub fn winding(&self, triangle: usize, sheet: u32) -> i32 {
        self.sheets(triangle).find(|&(s, _)| s == sheet).map_or(0, |(_, winding)| winding)
    }

    /// The sheets a triangle lies in, with their winding numbers, in rising order.
    pub fn sheets(&self, triangle: usize) -> impl Iterator<Item = (u32, i32)> + '_ {
        self.regions[self.triangles[triangle].region as usize].iter().copied()
    }

    /// Whether a triangle lies in some sheet and is not hidden.
    pub fn is_lit(&self, triangle: usize) -> bool {
        let held = || self.sheets(triangle).filter(|&(_, winding)| winding > 0);
        held().next().is_some() && held().all(|(sheet, _)| sheet != HIDDEN)
    }

    /// Finds the winding numbers of all triangles from the outside in.
    fn flood(&mut self, graph: &PlanarGraph) {
        self.regions = vec![Vec::new()];
        let mut known = vec![false; self.triangles.len()];
        let mut interned: HashMap<Vec<(u32, i32)>, u32> = HashMap::from([(Vec::new(), 0)]);
        let mut open = Vec::new();
        // Enter at the hull: what lies beyond it is in no sheet.
        for start in 0..self.triangles.len() {
            let hull = self.triangles[start].neighbours.iter().position(Option::is_none);
            let Some(edge) = hull.filter(|_| !known[start]) else { continue };
            self.enter(graph, start, edge, 0, &mut interned);
            known[start] = true;
            open.push(start);
            while let Some(from) = open.pop() {
                let Triangle { corners, neighbours, region, .. } = self.triangles[from];
                for k in 0..3 {
                    let Some(next) = neighbours[k].map(|n| n as usize).filter(|&n| !known[n]) else {
                        continue;
                    };
                    let shared = self.triangles[next].corners.iter().position(|&c| c == corners[(k + 1) % 3]);
                    self.enter(graph, next, shared.unwrap_or(0), region, &mut interned);
                    known[next] = true;
                    open.push(next);
                }
            }
        }
    }

    /// Sets the region of `triangle`, entered through its edge `edge` from `outside`.
    fn enter(
        &mut self,
        graph: &PlanarGraph,
        triangle: usize,
        edge: usize,
        outside: u32,
        interned: &mut HashMap<Vec<(u32, i32)>, u32>,
    ) {
        let Triangle { corners, constraints, .. } = self.triangles[triangle];
        let borders: &[Border] =
            constraints[edge].map_or(&[], |constraint| &graph.edges[constraint as usize].borders);
        let mut region = outside;
        if let (Some(constraint), false) = (constraints[edge], borders.is_empty()) {
            let forward = graph.edges[constraint as usize].from == corners[edge];
            let mut windings = self.regions[outside as usize].clone();
            for border in borders {
                // The inside of a border lies on its left, as the triangle does on that of its own edge.
                let step = if border.forward == forward { 1 } else { -1 };
                match windings.binary_search_by_key(&border.sheet, |w| w.0) {
                    Ok(k) => windings[k].1 += step,
                    Err(k) => windings.insert(k, (border.sheet, step)),
                }
            }
            windings.retain(|w| w.1 != 0);
            region = *interned.entry(windings).or_insert_with_key(|windings| {
                self.regions.push(windings.clone());
                self.regions.len() as u32 - 1
            });
        }
        self.triangles[triangle].region = region;
    }
}

/// Where the triangulation puts a point: points with equal places cannot be told apart.
pub fn grid_place(uv: DVec2) -> [u64; 2] {
    let Point2 { x, y } = key(uv);
    // Adding zero makes one of the two zeros.
    [x + 0.0, y + 0.0].map(f64::to_bits)
}

/// What spade sees of a point.
fn key(uv: DVec2) -> Point2<f64> {
    let round = |x: f64| (x * GRID).round() / GRID;
    Point2::new(round(uv.x + SHEAR * uv.y), round(uv.y))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::planar::Point;

    fn square(graph: &mut PlanarGraph, low: f64, high: f64, sheet: u32) {
        let corners = [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| {
            let uv = DVec2::new(x, y);
            graph.point(Point { uv, position: uv.extend(0.0), place: None })
        });
        graph.ring(&corners, Border { sheet, forward: true });
    }

    /// Three points in a row, an edge from the first to the last and one from the middle to the last.
    #[test]
    fn edge_through_a_point_is_tangled_although_constraints_are_as_many_as_edges() {
        let mut graph = PlanarGraph::default();
        square(&mut graph, 0.0, 1.0, 0);
        let middle = DVec2::new(0.5, 0.0);
        let middle = graph.point(Point { uv: middle, position: middle.extend(0.0), place: None });
        graph.border(middle, 1, Border { sheet: 1, forward: true });
        assert_eq!(graph.triangulate().unwrap_err(), Trouble::Tangled);
    }

    #[test]
    fn nested_squares_wind_once_and_twice() {
        let mut graph = PlanarGraph::default();
        square(&mut graph, 0.0, 1.0, 0);
        square(&mut graph, 0.25, 0.5, 1);
        let (graph, triangulation) = graph.arrange(1e-9).unwrap();
        let area = |sheets: &[(u32, i32)]| -> f64 {
            (0..triangulation.triangles.len())
                .filter(|&t| triangulation.sheets(t).collect::<Vec<_>>() == sheets)
                .map(|t| {
                    let [a, b, c] = triangulation.triangles[t].corners.map(|p| graph.points[p as usize].uv);
                    0.5 * (b - a).perp_dot(c - a)
                })
                .sum()
        };
        assert!((area(&[(0, 1)]) - 0.9375).abs() < 1e-15);
        assert!((area(&[(0, 1), (1, 1)]) - 0.0625).abs() < 1e-15);
    }
}
