//! A tree of boxes over polygons: which of them may reach a region of space.

use crate::sheets::bounds;
use glam::DVec3;

/// Leaves hold at most this many polygons.
const LEAF: usize = 6;

/// A tree of bounding boxes.
#[derive(Debug)]
pub struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Range of the order for a leaf; children are the next node and `second` otherwise.
    start: u32,
    end: u32,
    second: u32,
}

impl BoxTree {
    /// A tree over polygons by their corners.
    pub fn new(polygons: &[Vec<DVec3>]) -> BoxTree {
        let boxes: Vec<(DVec3, DVec3)> = polygons.iter().map(|corners| bounds(corners)).collect();
        let mut tree = BoxTree { nodes: Vec::new(), order: (0..polygons.len() as u32).collect() };
        if !polygons.is_empty() {
            tree.split(&boxes, 0, polygons.len());
        }
        tree
    }

    fn split(&mut self, boxes: &[(DVec3, DVec3)], start: usize, end: usize) {
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let union = |(low, high): (DVec3, DVec3), &k: &u32| {
            let (l, h) = boxes[k as usize];
            (low.min(l), high.max(h))
        };
        let (low, high) = self.order[start..end].iter().fold(empty, union);
        let own = self.nodes.len();
        self.nodes.push(Node { low, high, start: start as u32, end: end as u32, second: 0 });
        if end - start <= LEAF {
            return;
        }
        let axis = (high - low).max_position();
        let middle = |k: u32| boxes[k as usize].0[axis] + boxes[k as usize].1[axis];
        self.order[start..end].sort_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        let half = start + (end - start) / 2;
        self.split(boxes, start, half);
        self.nodes[own].second = self.nodes.len() as u32;
        self.split(boxes, half, end);
    }

    /// Calls `visit` for every polygon whose box, or a box around it, `reaches` does not refuse. Boxes are given as
    /// centre and half size.
    pub fn visit(&self, reaches: impl Fn(DVec3, DVec3) -> bool, mut visit: impl FnMut(u32)) {
        let mut open = if self.nodes.is_empty() { Vec::new() } else { vec![0u32] };
        while let Some(node) = open.pop() {
            let Node { low, high, start, end, second } = self.nodes[node as usize];
            if !reaches(0.5 * (low + high), 0.5 * (high - low)) {
                continue;
            }
            if second == 0 {
                self.order[start as usize..end as usize].iter().for_each(|&k| visit(k));
            } else {
                open.push(second);
                open.push(node + 1);
            }
        }
    }
}
