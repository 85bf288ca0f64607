//! The matrix product on a 10,000 x 10,000 matrix against the machine's streaming read bandwidth, in this process, on
//! all cores: `cargo bench -p solve-tool --bench product [-- ELEMENTS]`.
//!
//! Half of S is stored and each stored entry is used twice, so a kernel that reads all of S would have to run at twice
//! the rate to be as fast: the last column counts all of S. Best of several runs, as other work on the machine only
//! ever takes time away.
#![allow(missing_docs)]

use interchange::matrix::{Block, BlockKind, Values};
use rayon::prelude::*;
use solve_tool::product::Product;
use std::hint::black_box;
use std::time::Instant;

const RUNS: usize = 15;

fn best(mut work: impl FnMut()) -> f64 {
    (0..RUNS).fold(f64::INFINITY, |best, _| {
        let start = Instant::now();
        work();
        best.min(start.elapsed().as_secs_f64())
    })
}

/// Blocks of `side` rows and columns over the upper triangle.
fn blocks(elements: usize, side: usize) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut offset = 0;
    let range = |start: usize| start as u32..(start + side).min(elements) as u32;
    for row in (0..elements).step_by(side) {
        for column in (row..elements).step_by(side) {
            let kind = if row == column { BlockKind::Triangle } else { BlockKind::Dense };
            let block = Block::new(kind, range(row), range(column), offset);
            offset += block.stored();
            blocks.push(block);
        }
    }
    blocks
}

/// Sums 64-bit words as fast as they come: eight running sums in each of 64 runs.
fn stream(words: &[u64]) -> u64 {
    let run = |words: &[u64]| {
        let mut sums = [0u64; 32];
        let (chunks, _) = words.as_chunks::<32>();
        for chunk in chunks {
            for lane in 0..32 {
                sums[lane] = sums[lane].wrapping_add(chunk[lane]);
            }
        }
        sums.iter().fold(0u64, |a, b| a.wrapping_add(*b))
    };
    words.par_chunks(words.len().div_ceil(64)).map(run).reduce(|| 0, u64::wrapping_add)
}

fn main() {
    let given = std::env::args().skip(1).find_map(|word| word.parse().ok());
    let elements: usize = given.unwrap_or(10_000);
    let stored = elements * (elements + 1) / 2;
    let words = vec![1u64; stored / 2];
    let bandwidth = words.len() as f64 * 8.0
        / best(|| {
            black_box(stream(black_box(&words)));
        });
    drop(words);
    println!("{elements} elements, {} threads", rayon::current_num_threads());
    println!("streaming read: {:.1} GB/s", bandwidth / 1e9);
    println!("entries  right-hand sides  block side   stored GB/s  of streaming  all of S GB/s");
    let report = |kind: &str, bytes: usize, sides: usize, side: usize, seconds: f64| {
        let rate = (stored * bytes) as f64 / seconds;
        let all = (elements * elements * bytes) as f64 / seconds;
        let share = 100.0 * rate / bandwidth;
        println!("{kind:7}  {sides:16}  {side:10}  {:11.1}  {share:10.0} %  {:13.1}", rate / 1e9, all / 1e9);
    };
    let x = vec![vec![1.0; elements]; 3];
    let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    let values = vec![0.25f32; stored];
    for side in [elements, 256, 64] {
        let blocks = blocks(elements, side);
        let product = Product::from_parts(elements, &blocks, Values::F32(&values));
        for sides in [1, 3] {
            let seconds = best(|| {
                black_box(product.apply(black_box(&x[..sides])));
            });
            report("f32", 4, sides, side, seconds);
        }
    }
    drop(values);
    let values = vec![0.25f64; stored];
    let blocks = blocks(elements, elements);
    let product = Product::from_parts(elements, &blocks, Values::F64(&values));
    for sides in [1, 3] {
        let seconds = best(|| {
            black_box(product.apply(black_box(&x[..sides])));
        });
        report("f64", 8, sides, elements, seconds);
    }
}
