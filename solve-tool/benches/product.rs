//! Rate of the matrix product in bytes of stored matrix per second: `cargo bench -p solve-tool`.
//!
//! Each stored entry is used for both halves of S, so a dense kernel that reads all of S would have to run at twice
//! the rate to be as fast.
#![allow(missing_docs)]

use divan::Bencher;
use divan::counter::BytesCount;
use interchange::matrix::{Block, BlockKind, Values};
use solve_tool::product::Product;

fn main() {
    divan::main();
}

const ELEMENTS: usize = 6000;

/// Blocks of `side` rows and columns over the upper triangle.
fn blocks(side: usize) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut offset = 0;
    let range = |start: usize| start as u32..(start + side).min(ELEMENTS) as u32;
    for row in (0..ELEMENTS).step_by(side) {
        for column in (row..ELEMENTS).step_by(side) {
            let kind = if row == column { BlockKind::Triangle } else { BlockKind::Dense };
            let block = Block::new(kind, range(row), range(column), offset);
            offset += block.stored();
            blocks.push(block);
        }
    }
    blocks
}

/// Right-hand sides and side of the blocks.
#[divan::bench(args = [(1, ELEMENTS), (3, ELEMENTS), (3, 64), (3, 16)], sample_count = 20)]
fn f32_entries(bencher: Bencher<'_, '_>, (sides, side): (usize, usize)) {
    let blocks = blocks(side);
    let values = vec![0.25f32; blocks.iter().map(|b| b.stored() as usize).sum()];
    let product = Product::from_parts(ELEMENTS, &blocks, Values::F32(&values));
    let x = vec![vec![1.0; ELEMENTS]; sides];
    let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    bencher.counter(BytesCount::of_slice(&values)).bench(|| product.apply(divan::black_box(&x)));
}

#[divan::bench(args = [(3, ELEMENTS), (3, 64)], sample_count = 20)]
fn f64_entries(bencher: Bencher<'_, '_>, (sides, side): (usize, usize)) {
    let blocks = blocks(side);
    let values = vec![0.25f64; blocks.iter().map(|b| b.stored() as usize).sum()];
    let product = Product::from_parts(ELEMENTS, &blocks, Values::F64(&values));
    let x = vec![vec![1.0; ELEMENTS]; sides];
    let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    bencher.counter(BytesCount::of_slice(&values)).bench(|| product.apply(divan::black_box(&x)));
}
