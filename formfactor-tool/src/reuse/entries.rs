//! Entries of a mapped matrix by their two elements. Its blocks are pairs of leaf clusters of its mesh, so the block of a pair
//! is found by two leaves.

use super::source::Refusal;
use interchange::matrix::{BlockView, Matrix};
use interchange::mesh::Mesh;
use std::collections::HashMap;

/// The blocks of a matrix by the leaves they lie between.
#[derive(Debug)]
pub(super) struct Entries<'m> {
    views: Vec<BlockView<'m>>,
    /// Leaf of each element.
    leaves: Vec<u32>,
    /// Number of the block between two leaves, the earlier one first.
    blocks: HashMap<(u32, u32), usize>,
}

/// The block that was looked into last: neighbours mostly lie in one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    leaves: (u32, u32),
    block: Option<usize>,
}

impl<'m> Entries<'m> {
    /// Of a symmetric matrix and its mesh. The inner error says that its blocks are no pairs of leaves.
    pub fn new(matrix: &'m Matrix, mesh: &Mesh) -> interchange::Result<Result<Self, Refusal>> {
        let mut leaves = vec![0; mesh.element_count()];
        let mut starts = HashMap::new();
        for (leaf, cluster) in mesh.clusters.iter().filter(|cluster| cluster.is_leaf()).enumerate() {
            leaves[cluster.start as usize..cluster.end as usize].fill(leaf as u32);
            starts.insert((cluster.start, cluster.end - cluster.start), leaf as u32);
        }
        let views = matrix.views()?;
        let mut blocks = HashMap::with_capacity(views.len());
        for (k, view) in views.iter().enumerate() {
            let block = &view.block;
            let rows = starts.get(&(block.row_start, block.rows));
            let columns = starts.get(&(block.column_start, block.columns));
            match rows.zip(columns) {
                Some((&rows, &columns)) => blocks.insert((rows, columns), k),
                None => return Ok(Err(Refusal::Blocks)),
            };
        }
        Ok(Ok(Self { views, leaves, blocks }))
    }

    /// Where a search begins.
    pub fn start(&self) -> Near {
        Near { leaves: (u32::MAX, u32::MAX), block: None }
    }

    /// The entry of two elements of the old mesh, in any order.
    pub fn get(&self, i: u32, j: u32, near: &mut Near) -> f64 {
        let (i, j) = (i.min(j) as usize, i.max(j) as usize);
        let leaves = (self.leaves[i], self.leaves[j]);
        if near.leaves != leaves {
            *near = Near { leaves, block: self.blocks.get(&leaves).copied() };
        }
        near.block.map_or(0.0, |k| self.views[k].entry(i, j))
    }
}
