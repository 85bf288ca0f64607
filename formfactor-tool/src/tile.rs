//! One rectangle of the matrix: all pairs of two leaf clusters. What can block any of them is decided once for all.

use geometry::contour::Exchange;
use geometry::occluder::{Occluder, separated};
use geometry::pair::{self, Accuracy, Class};
use geometry::patch::Patch;
use geometry::sides::SideBits;
use geometry::unoccluded::Rule;
use geometry::visible::Scratch;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The scene as the matrix sees it.
#[derive(Debug)]
pub struct Scene {
    /// Elements, in cluster order.
    pub patches: Vec<Patch>,
    /// Face of each element.
    pub faces: Vec<u32>,
    /// Side facts of each element against each occluder.
    pub sides: Vec<SideBits>,
    /// Convex blocking polygons.
    pub occluders: Vec<Occluder>,
}

/// A leaf cluster: a range of elements with what holds for all of them.
#[derive(Debug)]
pub struct Leaf {
    /// Its elements.
    pub range: Range<usize>,
    /// Side facts all of them share.
    pub sides: SideBits,
    /// Corners of the bounding box.
    pub bounds: [DVec3; 8],
}

impl Leaf {
    /// Collects the facts of a range of elements, which must not be empty.
    pub fn new(scene: &Scene, range: Range<usize>) -> Leaf {
        let sides = range
            .clone()
            .skip(1)
            .fold(scene.sides[range.start].clone(), |all, i| all.common(&scene.sides[i]));
        let corners = range.clone().flat_map(|i| scene.patches[i].corners.iter().copied());
        let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.fold(ends, |(low, high), c| (low.min(c), high.max(c)));
        let pick = |k: usize, bit: usize| if k >> bit & 1 == 0 { low[bit] } else { high[bit] };
        let bounds = std::array::from_fn(|k| DVec3::new(pick(k, 0), pick(k, 1), pick(k, 2)));
        Leaf { range, sides, bounds }
    }
}

/// How many pairs each class had, and what the occluded ones cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pairs of elements of one face.
    pub same_face: usize,
    /// Pairs that face away from each other.
    pub invisible: usize,
    /// Pairs that one blocker covers.
    pub fully_blocked: usize,
    /// Unoccluded pairs by rule: one point, few, several, many, contour.
    pub unoccluded: [usize; 5],
    /// Partly occluded pairs.
    pub occluded: usize,
    /// Visible parts computed for them.
    pub visible_parts: usize,
    /// Occluded pairs whose evaluations ran out.
    pub exhausted: usize,
}

impl Counts {
    fn add_class(&mut self, class: Class) {
        match class {
            Class::Invisible => self.invisible += 1,
            Class::FullyBlocked => self.fully_blocked += 1,
            Class::Unoccluded(rule) => match rule {
                Rule::Invisible => self.invisible += 1,
                Rule::Centre => self.unoccluded[0] += 1,
                Rule::Low => self.unoccluded[1] += 1,
                Rule::Middle => self.unoccluded[2] += 1,
                Rule::Product => self.unoccluded[3] += 1,
                Rule::Contour => self.unoccluded[4] += 1,
            },
            Class::Occluded(effort) => {
                self.occluded += 1;
                self.visible_parts += effort.evaluations;
                self.exhausted += usize::from(effort.exhausted);
            }
        }
    }

    /// Adds what another tile counted.
    pub fn add(&mut self, other: &Counts) {
        self.same_face += other.same_face;
        self.invisible += other.invisible;
        self.fully_blocked += other.fully_blocked;
        for (sum, n) in self.unoccluded.iter_mut().zip(other.unoccluded) {
            *sum += n;
        }
        self.occluded += other.occluded;
        self.visible_parts += other.visible_parts;
        self.exhausted += other.exhausted;
    }
}

/// One row of a tile: an entry per column, from the diagonal on where the tile stands on it.
#[derive(Debug)]
struct Row {
    entries: Vec<Exchange>,
    counts: Counts,
}

/// A computed tile.
#[derive(Debug)]
pub struct Tile {
    /// Entries row after row; in a tile on the diagonal only the upper triangle with the diagonal.
    pub entries: Vec<Exchange>,
    /// Classes of its pairs.
    pub counts: Counts,
}

/// Computes all pairs of two leaves, `a` not after `b` in cluster order.
pub fn compute(scene: &Scene, a: &Leaf, b: &Leaf, accuracy: Accuracy) -> Tile {
    let candidates = possible_blockers(scene, a, b);
    let diagonal = a.range == b.range;
    let rows: Vec<Row> = a
        .range
        .clone()
        .into_par_iter()
        .map_init(
            || (Vec::new(), Scratch::default()),
            |(blockers, scratch), i| {
                let columns = if diagonal { i..b.range.end } else { b.range.clone() };
                let mut row = Row { entries: Vec::with_capacity(columns.len()), counts: Counts::default() };
                for j in columns {
                    row.entries.push(entry(
                        scene,
                        i,
                        j,
                        &candidates,
                        accuracy,
                        blockers,
                        scratch,
                        &mut row.counts,
                    ));
                }
                row
            },
        )
        .collect();
    let mut tile = Tile { entries: Vec::new(), counts: Counts::default() };
    for row in rows {
        tile.entries.extend_from_slice(&row.entries);
        tile.counts.add(&row.counts);
    }
    tile
}

/// Occluders that may stand between some element of `a` and some element of `b`.
fn possible_blockers(scene: &Scene, a: &Leaf, b: &Leaf) -> Vec<usize> {
    let shaft: Vec<DVec3> = a.bounds.iter().chain(&b.bounds).copied().collect();
    let mut candidates = Vec::new();
    a.sides.for_each_candidate(&b.sides, scene.occluders.len(), |k| {
        if !separated(&shaft, &scene.occluders[k].corners) {
            candidates.push(k);
        }
    });
    candidates
}

#[allow(clippy::too_many_arguments)] // the pair, what may block it, and the caller's working memory
fn entry<'a>(
    scene: &'a Scene,
    i: usize,
    j: usize,
    candidates: &[usize],
    accuracy: Accuracy,
    blockers: &mut Vec<&'a Occluder>,
    scratch: &mut Scratch,
    counts: &mut Counts,
) -> Exchange {
    if scene.faces[i] == scene.faces[j] {
        counts.same_face += 1;
        return Exchange::NONE;
    }
    let between = candidates
        .iter()
        .filter(|&&k| scene.sides[i].may_block(&scene.sides[j], k))
        .map(|&k| &scene.occluders[k]);
    let (found, class) =
        pair::exchange(&scene.patches[i], &scene.patches[j], between, accuracy, blockers, scratch);
    counts.add_class(class);
    found
}
