//! Connected components of the exchange graph: elements between which light can go, directly or by others.
//!
//! A component without an emitter has B = 0 and takes no part in the solve (theory, skip 13).

use crate::product::Product;
use std::ops::ControlFlow;

/// Component of each element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// Number of components.
    pub count: usize,
    /// Component of each element, numbered in order of their first elements.
    pub of_element: Vec<u32>,
}

impl Components {
    /// The components of the graph with an edge wherever S_ij > 0. Reads the matrix only as far as it takes until
    /// everything is connected, which in one room is a few rows.
    pub fn of(product: &Product<'_>) -> Self {
        let mut parent: Vec<u32> = (0..product.element_count() as u32).collect();
        let mut left = parent.len();
        product.for_each_until(|i, j, s| {
            if s > 0.0 {
                let (a, b) = (root(&mut parent, i as u32), root(&mut parent, j as u32));
                if a != b {
                    // The smaller index stays root, so that numbering follows the element order.
                    parent[a.max(b) as usize] = a.min(b);
                    left -= 1;
                }
            }
            if left <= 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let mut number = vec![u32::MAX; parent.len()];
        let mut count = 0;
        let of_element = (0..parent.len() as u32)
            .map(|i| {
                let top = root(&mut parent, i) as usize;
                if number[top] == u32::MAX {
                    number[top] = count;
                    count += 1;
                }
                number[top]
            })
            .collect();
        Self { count: count as usize, of_element }
    }

    /// For each component, whether `is` holds for any of its elements.
    pub fn any(&self, is: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut any = vec![false; self.count];
        for (element, &component) in self.of_element.iter().enumerate() {
            any[component as usize] |= is(element);
        }
        any
    }
}

/// Root of `i`, halving the path on the way.
fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        let above = parent[i as usize];
        parent[i as usize] = parent[above as usize];
        i = above;
    }
    i
}
