//! Planes unfolded into one: each is turned about an edge it shares with its neighbour until both lie side by side, as the
//! six squares of a cube become a cross. Where a plane would come to lie over others, it starts an island of its own.
//!
//! The hinges form a spanning forest over the planes: breadth-first, the largest first. Every edge that is no hinge is cut.

use glam::DVec2;
use std::collections::{HashMap, HashSet, VecDeque};

/// Planes that lie over each other by less than this part of the largest only touch: motions round in the last digits.
const TOUCH: f64 = 1e-7;
/// What lies where is looked up in a grid of so many cells along the largest plane.
const CELLS: f64 = 64.0;

/// A plane to be unfolded, in its own coordinates, seen from its front.
#[derive(Debug, Clone, Default)]
pub struct Flat {
    /// Convex polygons, counter-clockwise.
    pub polygons: Vec<Vec<DVec2>>,
    /// The same corners as vertices that planes share.
    pub vertices: Vec<Vec<u32>>,
}

impl Flat {
    fn area(&self) -> f64 {
        let of = |ring: &Vec<DVec2>| {
            (2..ring.len()).map(|k| (ring[k - 1] - ring[0]).perp_dot(ring[k] - ring[0])).sum::<f64>()
        };
        self.polygons.iter().map(of).sum::<f64>() / 2.0
    }

    /// Edges with nothing of this plane beyond, from corner to corner, and where they are.
    fn border(&self) -> Vec<((u32, u32), [DVec2; 2])> {
        let edges = || {
            self.vertices.iter().zip(&self.polygons).flat_map(|(ids, ring)| {
                let n = ids.len();
                (0..n).map(move |k| ((ids[k], ids[(k + 1) % n]), [ring[k], ring[(k + 1) % n]]))
            })
        };
        let all: HashSet<(u32, u32)> = edges().map(|(ids, _)| ids).collect();
        edges().filter(|((a, b), _)| !all.contains(&(*b, *a))).collect()
    }
}

/// A turn and a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    turn: DVec2,
    shift: DVec2,
}

impl Motion {
    /// Leaves all where it is.
    pub const NONE: Motion = Motion { turn: DVec2::X, shift: DVec2::ZERO };

    /// Where a point gets.
    pub fn of(&self, point: DVec2) -> DVec2 {
        self.turn.rotate(point) + self.shift
    }

    /// The motion that takes one segment onto another of its length.
    fn between([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Motion {
        let (from, to) = ((b - a).normalize_or(DVec2::X), (d - c).normalize_or(DVec2::X));
        let turn = DVec2::new(from.dot(to), from.perp_dot(to)).normalize_or(DVec2::X);
        // About the middle, so that both ends are as far off where lengths differ by rounding.
        Motion { turn, shift: 0.5 * (c + d) - turn.rotate(0.5 * (a + b)) }
    }
}

/// Planes side by side: number and motion of each.
pub type Island = Vec<(usize, Motion)>;

/// Unfolds planes into islands, those with the largest planes first.
pub fn unfold(planes: &[Flat]) -> Vec<Island> {
    // Rounded, so that the last digits do not choose between equal planes.
    let areas: Vec<f64> = planes.iter().map(Flat::area).collect();
    let largest = areas.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let areas: Vec<f64> = areas.iter().map(|area| (area / largest / TOUCH).round()).collect();
    let mut order: Vec<usize> = (0..planes.len()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let hinges = hinges(planes, &order);
    let size = planes
        .iter()
        .flat_map(|p| p.polygons.iter().flatten())
        .map(|p| p.abs().max_element())
        .fold(0.0, f64::max);

    let (mut islands, mut placed) = (Vec::new(), vec![false; planes.len()]);
    for &first in &order {
        if placed[first] {
            continue;
        }
        let mut ground = Ground::new(size);
        let mut island = Island::new();
        let mut open = VecDeque::from([(first, Motion::NONE)]);
        while let Some((plane, motion)) = open.pop_front() {
            let polygons: Vec<Vec<DVec2>> = planes[plane]
                .polygons
                .iter()
                .map(|ring| ring.iter().map(|&p| motion.of(p)).collect())
                .collect();
            if placed[plane] || ground.is_taken(&polygons) {
                continue;
            }
            placed[plane] = true;
            island.push((plane, motion));
            polygons.into_iter().for_each(|polygon| ground.take(polygon));
            for hinge in &hinges[plane] {
                let here = hinge.here.map(|p| motion.of(p));
                open.push_back((hinge.plane, Motion::between(hinge.there, here)));
            }
        }
        islands.push(island);
    }
    islands
}

/// A plane beside an edge, and the edge in its coordinates.
type Side = (usize, [DVec2; 2]);

/// An edge that another plane shares, in the coordinates of both.
#[derive(Debug, Clone, Copy)]
struct Hinge {
    plane: usize,
    here: [DVec2; 2],
    there: [DVec2; 2],
}

/// The hinges of each plane, those to the largest planes first: of all edges two planes share the longest. Only where the
/// edge runs the other way in the other plane: else both fronts would come to lie over each other.
fn hinges(planes: &[Flat], order: &[usize]) -> Vec<Vec<Hinge>> {
    let mut rank = vec![0; planes.len()];
    order.iter().enumerate().for_each(|(k, &plane)| rank[plane] = k);
    let borders: Vec<_> = planes.iter().map(Flat::border).collect();
    let mut beyond: HashMap<(u32, u32), Vec<Side>> = HashMap::new();
    for (plane, border) in borders.iter().enumerate() {
        border.iter().for_each(|&(ids, ends)| beyond.entry(ids).or_default().push((plane, ends)));
    }
    let of_plane = |plane: usize| {
        let mut longest: HashMap<usize, Hinge> = HashMap::new();
        for &((a, b), here) in &borders[plane] {
            for &(other, [from, to]) in beyond.get(&(b, a)).into_iter().flatten().filter(|(o, _)| *o != plane)
            {
                let hinge = Hinge { plane: other, here, there: [to, from] };
                let known = longest.entry(other).or_insert(hinge);
                if here[0].distance(here[1]) > known.here[0].distance(known.here[1]) {
                    *known = hinge;
                }
            }
        }
        let mut hinges: Vec<Hinge> = longest.into_values().collect();
        hinges.sort_by_key(|hinge| rank[hinge.plane]);
        hinges
    };
    (0..planes.len()).map(of_plane).collect()
}

/// What lies where on an island.
struct Ground {
    cell: f64,
    touch: f64,
    polygons: Vec<Vec<DVec2>>,
    cells: HashMap<(i64, i64), Vec<usize>>,
}

impl Ground {
    fn new(size: f64) -> Self {
        let cell = (size / CELLS).max(f64::MIN_POSITIVE);
        Ground { cell, touch: TOUCH * size, polygons: Vec::new(), cells: HashMap::new() }
    }

    fn cells_of(&self, ring: &[DVec2]) -> impl Iterator<Item = (i64, i64)> + use<> {
        let low = ring.iter().copied().fold(DVec2::INFINITY, DVec2::min) / self.cell;
        let high = ring.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) / self.cell;
        let rows = low.y.floor() as i64..=high.y.floor() as i64;
        (low.x.floor() as i64..=high.x.floor() as i64).flat_map(move |x| rows.clone().map(move |y| (x, y)))
    }

    fn take(&mut self, ring: Vec<DVec2>) {
        for cell in self.cells_of(&ring) {
            self.cells.entry(cell).or_default().push(self.polygons.len());
        }
        self.polygons.push(ring);
    }

    fn is_taken(&self, polygons: &[Vec<DVec2>]) -> bool {
        polygons.iter().any(|ring| {
            let near = self.cells_of(ring).filter_map(|cell| self.cells.get(&cell)).flatten();
            near.into_iter().any(|&other| overlap(ring, &self.polygons[other], self.touch))
        })
    }
}

/// Whether two convex polygons lie over each other by more than `touch`: then no edge of either parts them.
fn overlap(a: &[DVec2], b: &[DVec2], touch: f64) -> bool {
    let parts = |ring: &[DVec2], other: &[DVec2]| {
        (0..ring.len()).any(|k| {
            let (from, to) = (ring[k], ring[(k + 1) % ring.len()]);
            let inward = (to - from).perp().normalize_or_zero();
            inward != DVec2::ZERO && other.iter().all(|&p| inward.dot(p - from) <= touch)
        })
    };
    !parts(a, b) && !parts(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The squares of a cube seen from within, as rings of its corners (bits: x, y, z), flattened along two edges.
    fn cube() -> Vec<Flat> {
        let rings = [[0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6]];
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        rings.map(|ring| Flat { polygons: vec![square.to_vec()], vertices: vec![ring.to_vec()] }).to_vec()
    }

    #[test]
    fn a_cube_unfolds_to_a_cross() {
        let planes = cube();
        let islands = unfold(&planes);
        assert_eq!((islands.len(), islands[0].len()), (1, 6));
        let placed: Vec<Vec<DVec2>> = islands[0]
            .iter()
            .map(|(plane, motion)| planes[*plane].polygons[0].iter().map(|&p| motion.of(p)).collect())
            .collect();
        for (k, a) in placed.iter().enumerate() {
            assert!(placed[..k].iter().all(|b| !overlap(a, b, 1e-9)));
        }
        // Five hinges: edges of two squares that lie on each other with their vertices.
        let mut at: HashMap<(u32, u32), Vec<[DVec2; 2]>> = HashMap::new();
        for ((plane, _), ring) in islands[0].iter().zip(&placed) {
            let ids = &planes[*plane].vertices[0];
            for k in 0..4 {
                let (a, b) = (ids[k], ids[(k + 1) % 4]);
                let ends = if a < b { [ring[k], ring[(k + 1) % 4]] } else { [ring[(k + 1) % 4], ring[k]] };
                at.entry((a.min(b), a.max(b))).or_default().push(ends);
            }
        }
        let on_each_other = |ends: &&Vec<[DVec2; 2]>| (0..2).all(|k| ends[0][k].distance(ends[1][k]) < 1e-14);
        assert_eq!(at.len(), 12);
        assert_eq!(at.values().filter(on_each_other).count(), 5);
        // Around the first square lie four, the last beyond one of them: 3 wide and 4 long.
        let low = placed.iter().flatten().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = placed.iter().flatten().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let extent = high - low;
        assert!((extent.min_element() - 3.0).abs() < 1e-14 && (extent.max_element() - 4.0).abs() < 1e-14);
    }

    #[test]
    fn what_would_lie_over_others_is_an_island_of_its_own() {
        // Five squares around one corner: the fourth comes to lie beside the first, the fifth over it.
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
        let fan = |k: u32| Flat {
            polygons: vec![square.to_vec()],
            vertices: vec![vec![0, 1 + k, 10 + k, 1 + (k + 1) % 5]],
        };
        let islands = unfold(&(0..5).map(fan).collect::<Vec<_>>());
        assert_eq!(islands.iter().map(Vec::len).collect::<Vec<_>>(), [4, 1]);
    }
}
