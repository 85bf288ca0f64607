//! Refinement and smoothing of a triangulated layer.
//!
//! Bad triangles get their circumcentre as a new point, or, where an edge of the graph stands between, that edge is
//! halved (Ruppert 1995, Chew 1993). Two things differ from spade's own refinement, which therefore is not used: no
//! edge is halved below a part of the wished spacing, so that slivers of the scene cannot make the count explode;
//! and points are added in batches between which the free points are smoothed, which gives rounder triangles for
//! the same count.

use crate::frame::turn;
use crate::planar::{PlanarGraph, Point};
use crate::triangulation::{Triangle, Triangulation, Trouble};
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;

mod edits;
mod grade;

/// Triangles with a smaller angle are refined, in degrees. Ruppert's bound for termination is 20.7; the floor on the
/// edge length ends the rest.
const SMALLEST_ANGLE: f64 = 25.0;
/// The longest edges of neighbours differ by no more than this factor, above the floor.
const GRADING: f64 = 2.0;
/// Rounds of adding points; each settles most of what the one before left.
const ROUNDS: usize = 12;
/// Rounds of smoothing before and after.
const SMOOTHING: usize = 5;
/// Halving ends after as many rounds as the longest edge can be halved, plus slack.
const LENGTH_ROUNDS: usize = 60;

/// What is wished.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Length of most edges, in units of the frame.
    pub spacing: f64,
    /// No edge may be longer, in units of the frame.
    pub max_edge: f64,
    /// No edge is halved, and no point put closer to another, below this part of the spacing.
    pub floor: f64,
}

/// A graph with points that may move.
#[derive(Debug, Clone)]
pub struct Refinement {
    /// Points and edges.
    pub graph: PlanarGraph,
    /// Whether each point may move: it is on no edge.
    pub free: Vec<bool>,
    /// Wished length of the edges around each point, in units of the frame.
    sizes: Vec<f64>,
    target: Target,
}

/// A change that improves a triangle.
#[derive(Debug, Clone, Copy)]
enum Change {
    Halve(u32),
    Add(DVec2),
}

impl Refinement {
    /// Starts from a graph whose edges are short enough, with free points at `seeds`.
    pub fn new(mut graph: PlanarGraph, seeds: &[DVec2], target: Target) -> Self {
        let mut free = vec![false; graph.points.len()];
        for &uv in seeds {
            add_free(&mut graph, uv);
            free.push(true);
        }
        let sizes = vec![target.spacing; graph.points.len()];
        Self { graph, free, sizes, target }
    }

    /// Smooths and refines. Returns the last triangulation.
    pub fn run(&mut self) -> Result<Triangulation, Trouble> {
        for _ in 0..SMOOTHING {
            let triangulation = self.graph.triangulate()?;
            self.smooth(&triangulation, 0);
        }
        let limit = self.graph.points.len() * 4 + 256;
        let mut triangulation = self.graph.triangulate()?;
        for _ in 0..ROUNDS {
            let changes = self.wished_changes(&triangulation);
            if changes.is_empty() || self.graph.points.len() > limit {
                break;
            }
            self.apply(&changes);
            triangulation = self.graph.triangulate()?;
            self.smooth(&triangulation, 0);
            triangulation = self.graph.triangulate()?;
        }
        self.shorten(triangulation)
    }

    /// Halves the edges of the `marked` triangles that are at least the part `long` of their longest, in units of the
    /// frame down to `shortest`, and widens the small angles that this leaves around them. `None` where nothing can be
    /// halved.
    pub fn halve_triangles(
        &mut self,
        triangulation: &Triangulation,
        marked: &[usize],
        long: f64,
        shortest: f64,
    ) -> Result<Option<Triangulation>, Trouble> {
        let (mut seen, mut changes) = (BTreeSet::new(), Vec::new());
        for &t in marked {
            let triangle = &triangulation.triangles[t];
            let longest = self.shape(triangle).longest;
            for k in 0..3 {
                let (a, b) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
                let length = self.uv(a).distance(self.uv(b));
                if length >= (long * longest).max(2.0 * shortest) && seen.insert((a.min(b), a.max(b))) {
                    changes.push((self.middle(triangle, k), 0.5 * length));
                }
            }
        }
        if changes.is_empty() {
            return Ok(None);
        }
        let first_new = self.graph.points.len();
        self.apply(&changes);
        self.widen(first_new).map(Some)
    }

    /// Widens small angles, moving only points from number `first_new` on.
    fn widen(&mut self, first_new: usize) -> Result<Triangulation, Trouble> {
        let mut triangulation = self.graph.triangulate()?;
        for _ in 0..ROUNDS {
            self.smooth(&triangulation, first_new);
            triangulation = self.graph.triangulate()?;
            let changes = self.wished_changes(&triangulation);
            if changes.is_empty() {
                break;
            }
            self.apply(&changes);
            triangulation = self.graph.triangulate()?;
        }
        self.shorten(triangulation)
    }

    /// Halves edges until none is longer than it may be.
    fn shorten(&mut self, mut triangulation: Triangulation) -> Result<Triangulation, Trouble> {
        for _ in 0..LENGTH_ROUNDS {
            let changes = self.halvings(&triangulation);
            if changes.is_empty() {
                break;
            }
            self.apply(&changes);
            triangulation = self.graph.triangulate()?;
        }
        Ok(triangulation)
    }

    fn uv(&self, point: u32) -> DVec2 {
        self.graph.points[point as usize].uv
    }

    /// Moves every free point to the mean of the centroids of the triangles around it, weighted by their areas
    /// (a step towards a centroidal triangulation), unless a triangle would turn over. No point can leave the
    /// triangles around it, so none crosses an edge of the graph. Points before `first` stay.
    fn smooth(&mut self, triangulation: &Triangulation, first: usize) {
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); self.graph.points.len()];
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            for corner in triangle.corners {
                if self.free[corner as usize] && corner as usize >= first {
                    around[corner as usize].push(t as u32);
                }
            }
        }
        let moved: Vec<Option<DVec2>> = around
            .iter()
            .enumerate()
            .map(|(point, star)| {
                let corners = |t: &u32| triangulation.triangles[*t as usize].corners;
                let (mut moment, mut area) = (DVec2::ZERO, 0.0);
                for t in star {
                    let [a, b, c] = corners(t).map(|p| self.uv(p));
                    let weight = turn(a, b, c);
                    moment += weight * (a + b + c) / 3.0;
                    area += weight;
                }
                let wished = (area > 0.0).then(|| moment / area)?;
                let stays = star.iter().all(|t| {
                    let [a, b, c] = corners(t).map(|p| if p as usize == point { wished } else { self.uv(p) });
                    turn(a, b, c) > 0.0
                });
                stays.then_some(wished)
            })
            .collect();
        for (point, moved) in self.graph.points.iter_mut().zip(moved) {
            point.uv = moved.unwrap_or(point.uv);
        }
    }

    /// Changes for triangles with too small angles or too long edges: the worst first, and none so close to another
    /// that both would serve the same place.
    fn wished_changes(&self, triangulation: &Triangulation) -> Vec<(Change, f64)> {
        let mut wishes = Vec::new();
        for (t, triangle) in triangulation.triangles.iter().enumerate() {
            if !triangulation.is_lit(t) {
                continue;
            }
            let shape = self.shape(triangle);
            let size = triangle.corners.iter().map(|&p| self.sizes[p as usize]).fold(0.0, f64::max);
            let floor = self.target.floor * size;
            // A strip thinner than this would need edges below the floor; halving its sides would be in vain.
            let in_strip = shape.height < floor * SMALLEST_ANGLE.to_radians().sin()
                && triangle.corners.iter().all(|&corner| !self.free[corner as usize]);
            if shape.longest > self.target.max_edge {
                let change = self.middle(triangle, shape.longest_edge);
                wishes.push((0.0, (change, size), 0.5 * shape.longest));
            } else if shape.longest > GRADING * self.smallest_neighbour(triangulation, triangle)
                && shape.longest >= 2.0 * floor
                && !in_strip
            {
                let change = self.middle(triangle, shape.longest_edge);
                wishes.push((SMALLEST_ANGLE.to_radians(), (change, size), 0.5 * shape.longest));
            } else if shape.smallest_angle < SMALLEST_ANGLE.to_radians()
                && !shape.given_angle
                && !in_strip
                && let Some((change, clearance)) = self.better_point(triangulation, t, floor)
            {
                wishes.push((shape.smallest_angle, (change, size), clearance));
            }
        }
        wishes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut taken: Vec<(DVec2, f64)> = Vec::new();
        let mut changes = Vec::new();
        for (_, change, clearance) in wishes {
            let at = match change.0 {
                Change::Add(uv) => uv,
                Change::Halve(edge) => {
                    let edge = &self.graph.edges[edge as usize];
                    0.5 * (self.uv(edge.from) + self.uv(edge.to))
                }
            };
            if taken.iter().all(|&(other, distance)| other.distance(at) > 0.7 * clearance.max(distance)) {
                taken.push((at, clearance));
                changes.push(change);
            }
        }
        changes
    }

    /// The least longest edge of the neighbours of a triangle.
    fn smallest_neighbour(&self, triangulation: &Triangulation, triangle: &Triangle) -> f64 {
        let beside = triangle.neighbours.into_iter().flatten().map(|n| n as usize);
        beside
            .filter(|&n| triangulation.is_lit(n))
            .map(|n| self.shape(&triangulation.triangles[n]).longest)
            .fold(f64::INFINITY, f64::min)
    }

    /// The point that improves a triangle with a small angle, and its distance from the points around it.
    fn better_point(
        &self,
        triangulation: &Triangulation,
        triangle: usize,
        floor: f64,
    ) -> Option<(Change, f64)> {
        let [a, b, c] = triangulation.triangles[triangle].corners.map(|p| self.uv(p));
        let centre = circumcentre(a, b, c)?;
        let halve = |edge: u32| {
            let ends = &self.graph.edges[edge as usize];
            let length = self.uv(ends.from).distance(self.uv(ends.to));
            (length >= 2.0 * floor).then_some((Change::Halve(edge), 0.5 * length))
        };
        // Walk towards the centre; an edge of the graph in the way is halved instead.
        let mut at = triangle;
        for _ in 0..triangulation.triangles.len() {
            let Triangle { corners, neighbours, constraints, .. } = triangulation.triangles[at];
            let beyond =
                (0..3).find(|&k| turn(self.uv(corners[k]), self.uv(corners[(k + 1) % 3]), centre) < 0.0);
            let Some(k) = beyond else {
                let encroached = (0..3).find_map(|k| {
                    let ends = [corners[k], corners[(k + 1) % 3]].map(|p| self.uv(p) - centre);
                    constraints[k].filter(|_| ends[0].dot(ends[1]) <= 0.0)
                });
                if let Some(edge) = encroached {
                    return halve(edge);
                }
                let clearance =
                    corners.iter().map(|&p| self.uv(p).distance(centre)).fold(f64::INFINITY, f64::min);
                return (clearance >= floor).then_some((Change::Add(centre), clearance));
            };
            if let Some(edge) = constraints[k] {
                return halve(edge);
            }
            at = neighbours[k]? as usize;
        }
        None
    }

    /// Points in the middle of edges that are too long; only of edges that are the longest of each triangle beside
    /// them, so that no triangle is split twice in one round and the longest of all is always among them.
    fn halvings(&self, triangulation: &Triangulation) -> Vec<(Change, f64)> {
        let inside = |t: u32| triangulation.is_lit(t as usize);
        let mut changes = Vec::new();
        for (t, triangle) in triangulation.triangles.iter().enumerate().filter(|(t, _)| inside(*t as u32)) {
            let shape = self.shape(triangle);
            if shape.longest <= self.target.max_edge {
                continue;
            }
            let k = shape.longest_edge;
            let other = triangle.neighbours[k].filter(|&n| inside(n));
            let own = other.is_none_or(|n| {
                let other = self.shape(&triangulation.triangles[n as usize]);
                other.longest <= shape.longest
                    && (other.longest < shape.longest || t < n as usize || {
                        // Of two equal longest edges in the neighbour, this triangle must not wait for ever.
                        let shared = triangulation.triangles[n as usize].neighbours[other.longest_edge];
                        shared != Some(t as u32)
                    })
            });
            if own {
                changes.push((self.middle(triangle, k), self.target.spacing));
            }
        }
        let mut seen = std::collections::HashSet::new();
        changes.retain(|(change, _)| match change {
            Change::Halve(edge) => seen.insert(*edge),
            Change::Add(_) => true,
        });
        changes
    }

    /// The middle of an edge of a triangle.
    fn middle(&self, triangle: &Triangle, k: usize) -> Change {
        match triangle.constraints[k] {
            Some(edge) => Change::Halve(edge),
            None => {
                Change::Add(0.5 * (self.uv(triangle.corners[k]) + self.uv(triangle.corners[(k + 1) % 3])))
            }
        }
    }

    /// Makes changes, each with the size at its new point.
    fn apply(&mut self, changes: &[(Change, f64)]) {
        for &(change, size) in changes {
            self.sizes.push(size);
            match change {
                Change::Halve(edge) => {
                    self.graph.halve(edge as usize);
                    self.free.push(false);
                }
                Change::Add(uv) => {
                    add_free(&mut self.graph, uv);
                    self.free.push(true);
                }
            }
        }
    }

    fn shape(&self, triangle: &Triangle) -> Shape {
        let corners = triangle.corners.map(|p| self.uv(p));
        let lengths = [0, 1, 2].map(|k| corners[k].distance(corners[(k + 1) % 3]));
        let longest_edge = (0..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
        let angle = |k: usize| {
            let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
            a.perp_dot(b).atan2(a.dot(b))
        };
        let angles = [angle(0), angle(1), angle(2)];
        let smallest = (0..3).fold(0, |best, k| if angles[k] < angles[best] { k } else { best });
        Shape {
            longest: lengths[longest_edge],
            longest_edge,
            height: turn(corners[0], corners[1], corners[2]) / lengths[longest_edge],
            smallest_angle: angles[smallest],
            given_angle: triangle.constraints[smallest].is_some()
                && triangle.constraints[(smallest + 2) % 3].is_some(),
        }
    }
}

/// What decides about a triangle.
struct Shape {
    longest: f64,
    longest_edge: usize,
    /// Height over the longest edge.
    height: f64,
    smallest_angle: f64,
    /// Both edges at the smallest angle are edges of the graph: it cannot be widened.
    given_angle: bool,
}

/// Adds a free point; its position in space is set when it has stopped moving.
fn add_free(graph: &mut PlanarGraph, uv: DVec2) {
    graph.point(Point { uv, position: DVec3::ZERO, place: None });
}

fn circumcentre(a: DVec2, b: DVec2, c: DVec2) -> Option<DVec2> {
    let (ab, ac) = (b - a, c - a);
    let twice = 2.0 * ab.perp_dot(ac);
    let offset = DVec2::new(
        ac.y * ab.length_squared() - ab.y * ac.length_squared(),
        ab.x * ac.length_squared() - ac.x * ab.length_squared(),
    ) / twice;
    offset.is_finite().then(|| a + offset)
}
