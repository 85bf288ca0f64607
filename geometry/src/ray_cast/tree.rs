//! Bounding volume hierarchy: binary, built top-down by the surface area heuristic over binned box centres
//! (Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"), boxes in f64.

use glam::DVec3;
use std::ops::Range;

/// Number of bins per axis: more changes the cost of the tree by less than a per cent.
const BINS: usize = 16;
/// Cost of testing one polygon, in tests of a pair of boxes.
const PIECE_COST: f64 = 1.5;
/// No leaf holds more, unless all its boxes have one centre.
const LARGEST_LEAF: usize = 8;
/// Below this depth ranges are halved instead of split by cost, so that the depth is at most 32 + 32 and a fixed stack holds.
const BALANCED_BELOW: usize = 32;
const STACK: usize = 72;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    low: DVec3,
    high: DVec3,
}

impl Extent {
    pub(super) const EMPTY: Extent =
        Extent { low: DVec3::splat(f64::INFINITY), high: DVec3::splat(f64::NEG_INFINITY) };

    pub(super) fn with(self, point: DVec3) -> Extent {
        Extent { low: self.low.min(point), high: self.high.max(point) }
    }

    pub(super) fn padded(self, padding: f64) -> Extent {
        Extent { low: self.low - padding, high: self.high + padding }
    }

    pub(super) fn diagonal(&self) -> f64 {
        if self.low.x <= self.high.x { (self.high - self.low).length() } else { 0.0 }
    }

    fn union(self, other: &Extent) -> Extent {
        Extent { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn centre(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Half the surface; 0 where empty.
    fn half_area(&self) -> f64 {
        let size = (self.high - self.low).max(DVec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    fn overlaps(&self, other: &Extent) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// Where the ray is within the box, if it is for some parameter in [0, limit].
    fn entry(&self, origin: DVec3, inverse: DVec3, limit: f64) -> Option<f64> {
        // A ray parallel to a slab gives infinities of either sign within it; on its very face NaN, which `min` and `max`
        // drop: padded boxes have no content there.
        let (low, high) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        let enter = low.x.min(high.x).max(low.y.min(high.y)).max(low.z.min(high.z)).max(0.0);
        let leave = low.x.max(high.x).min(low.y.max(high.y)).min(low.z.max(high.z)).min(limit);
        // Three roundings on either side (Ize 2013, "Robust BVH Ray Traversal").
        (enter <= leave * (1.0 + 8.0 * f64::EPSILON)).then_some(enter)
    }
}

/// A node of the tree: the boxes of its two children, tested together.
#[derive(Debug, Clone, Copy)]
struct Node {
    extents: [Extent; 2],
    children: [Child; 2],
}

#[derive(Debug, Clone, Copy)]
enum Child {
    Node(u32),
    /// Slots of a leaf's content.
    Leaf(u32, u32),
}

/// The hierarchy over slots: places in an order of the content that the tree chose.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// None where there is no content.
    root: Option<(Extent, Child)>,
}

impl Tree {
    /// Tree over the boxes, and the index of the box in each slot.
    pub(super) fn new(extents: &[Extent]) -> (Tree, Vec<u32>) {
        let mut order: Vec<u32> = (0..extents.len() as u32).collect();
        let mut tree = Tree::default();
        if !extents.is_empty() {
            tree.root = Some(tree.build(extents, &mut order, 0, 0));
        }
        (tree, order)
    }

    fn build(
        &mut self,
        extents: &[Extent],
        order: &mut [u32],
        first: usize,
        depth: usize,
    ) -> (Extent, Child) {
        let whole = order.iter().fold(Extent::EMPTY, |whole, &i| whole.union(&extents[i as usize]));
        let split = if depth < BALANCED_BELOW {
            partition_by_cost(extents, order, whole.half_area())
        } else {
            (order.len() > LARGEST_LEAF).then_some(order.len() / 2)
        };
        let Some(split) = split else {
            return (whole, Child::Leaf(first as u32, (first + order.len()) as u32));
        };
        let node = self.nodes.len();
        let leaf = (Extent::EMPTY, Child::Leaf(0, 0));
        self.nodes.push(Node { extents: [leaf.0; 2], children: [leaf.1; 2] });
        let (left, right) = order.split_at_mut(split);
        let left = self.build(extents, left, first, depth + 1);
        let right = self.build(extents, right, first + split, depth + 1);
        self.nodes[node] = Node { extents: [left.0, right.0], children: [left.1, right.1] };
        (whole, Child::Node(node as u32))
    }

    /// Calls `visit` with the slots of every leaf whose box the ray meets up to the limit, nearer boxes first. `visit`
    /// may lower the limit, and ends the visit by returning false.
    pub(super) fn visit_along(
        &self,
        origin: DVec3,
        direction: DVec3,
        mut limit: f64,
        mut visit: impl FnMut(Range<usize>, &mut f64) -> bool,
    ) {
        let inverse = 1.0 / direction;
        let Some((extent, root)) = self.root else { return };
        let Some(entry) = extent.entry(origin, inverse, limit) else { return };
        let mut stack = [(0.0, Child::Leaf(0, 0)); STACK];
        let mut height = 1;
        stack[0] = (entry, root);
        while height > 0 {
            height -= 1;
            let (entry, child) = stack[height];
            if entry > limit {
                continue;
            }
            match child {
                Child::Leaf(start, end) => {
                    if !visit(start as usize..end as usize, &mut limit) {
                        return;
                    }
                }
                Child::Node(node) => {
                    let node = &self.nodes[node as usize];
                    let entries = node.extents.map(|extent| extent.entry(origin, inverse, limit));
                    let far_first = match entries {
                        [Some(left), Some(right)] if left <= right => [1, 0],
                        _ => [0, 1],
                    };
                    for side in far_first {
                        if let Some(entry) = entries[side] {
                            debug_assert!(height < STACK, "stack of {STACK} at height {height}");
                            stack[height] = (entry, node.children[side]);
                            height += 1;
                        }
                    }
                }
            }
        }
    }

    /// Calls `visit` with the slots of every leaf whose box overlaps the region.
    pub(super) fn visit_region(&self, region: &Extent, mut visit: impl FnMut(Range<usize>)) {
        let Some((extent, root)) = self.root else { return };
        let mut stack = if extent.overlaps(region) { vec![root] } else { Vec::new() };
        while let Some(child) = stack.pop() {
            match child {
                Child::Leaf(start, end) => visit(start as usize..end as usize),
                Child::Node(node) => {
                    let node = &self.nodes[node as usize];
                    let overlapping = (0..2).filter(|&side| node.extents[side].overlaps(region));
                    stack.extend(overlapping.map(|side| node.children[side]));
                }
            }
        }
    }
}

/// Reorders `order` into two parts at the split of lowest cost and returns its place; `None` where a leaf is cheaper.
fn partition_by_cost(extents: &[Extent], order: &mut [u32], half_area: f64) -> Option<usize> {
    let centres = order.iter().fold(Extent::EMPTY, |centres, &i| centres.with(extents[i as usize].centre()));
    let bin_of = |axis: usize, i: u32| {
        let (low, high) = (centres.low[axis], centres.high[axis]);
        let place = (extents[i as usize].centre()[axis] - low) / (high - low);
        ((place * BINS as f64) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| centres.high[axis] > centres.low[axis]) {
        let mut bins = [(0usize, Extent::EMPTY); BINS];
        for &i in order.iter() {
            let bin = &mut bins[bin_of(axis, i)];
            *bin = (bin.0 + 1, bin.1.union(&extents[i as usize]));
        }
        let merged = |bins: &[(usize, Extent)]| {
            bins.iter().fold((0, Extent::EMPTY), |sum, bin| (sum.0 + bin.0, sum.1.union(&bin.1)))
        };
        for split in 1..BINS {
            let (left, right) = (merged(&bins[..split]), merged(&bins[split..]));
            let cost = left.0 as f64 * left.1.half_area() + right.0 as f64 * right.1.half_area();
            if left.0 > 0 && right.0 > 0 && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, split));
            }
        }
    }
    // Equal centres on every axis: no split helps.
    let (cost, axis, split) = best?;
    let split_cost = half_area + PIECE_COST * cost;
    let leaf_cost = PIECE_COST * order.len() as f64 * half_area;
    if order.len() <= LARGEST_LEAF && leaf_cost <= split_cost {
        return None;
    }
    // Stable, so that the order is the same everywhere.
    order.sort_by_key(|&i| bin_of(axis, i) >= split);
    Some(order.partition_point(|&i| bin_of(axis, i) < split))
}
