//! The matrix product on a 10,000 x 10,000 matrix against the machine's streaming read bandwidth, in one process, on all
//! cores: `cargo bench -p solve-tool --bench product [-- ELEMENTS]`.
//!
//! Half of S is stored and each stored entry is used twice, so a kernel that reads all of S would have to run at twice
//! the rate to be as fast: `all of S` counts what it would have read. Streaming and product take turns, best of several
//! rounds each, as other work on the machine only ever takes time away; rates are given per second of wall time and, for
//! machines that are never quiet, per second of processor time (Linux tells it).
#![allow(missing_docs)]

use interchange::matrix::{Block, BlockKind, Values};
use rayon::prelude::*;
use solve_tool::product::Product;
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 12;

/// Least wall and processor seconds of a piece of work.
#[derive(Clone, Copy)]
struct Best {
    wall: f64,
    processor: f64,
}

impl Best {
    const NONE: Best = Best { wall: f64::INFINITY, processor: f64::INFINITY };

    fn take(&mut self, mut work: impl FnMut()) {
        // Three in a row: the system counts processor time in steps of some milliseconds.
        let (wall, processor) = (Instant::now(), processor_seconds());
        (0..3).for_each(|_| work());
        self.wall = self.wall.min(wall.elapsed().as_secs_f64() / 3.0);
        self.processor = self.processor.min((processor_seconds() - processor) / 3.0);
    }
}

/// Processor time of all threads so far.
fn processor_seconds() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds = |thread: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    threads.filter_map(nanoseconds).sum::<f64>() * 1e-9
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

/// Adds 64-bit words as fast as they come, 32 running sums in each of 64 runs.
fn stream(words: &[u64]) -> u64 {
    let run = |words: &[u64]| {
        let mut sums = [0u64; 32];
        let (chunks, _) = words.as_chunks::<32>();
        for chunk in chunks {
            sums.iter_mut().zip(chunk).for_each(|(sum, word)| *sum = sum.wrapping_add(*word));
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
    let single = vec![0.25f32; stored];
    let double = vec![0.25f64; stored];
    let x = vec![vec![1.0; elements]; 3];
    let x: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    let sides = [elements, 256, 64];
    let blocks = sides.map(|side| blocks(elements, side));
    let cases: Vec<(&str, usize, usize, usize)> = (0..3)
        .flat_map(|side| [("f32", 4, side, 1), ("f32", 4, side, 3)])
        .chain([("f64", 8, 0, 1), ("f64", 8, 0, 3)])
        .collect();
    let products: Vec<Product<'_>> = cases
        .iter()
        .map(|&(_, bytes, side, _)| {
            let values = if bytes == 4 { Values::F32(&single) } else { Values::F64(&double) };
            Product::from_parts(elements, &blocks[side], values)
        })
        .collect();

    let mut streaming = Best::NONE;
    let mut best = vec![Best::NONE; cases.len()];
    for _ in 0..ROUNDS {
        for ((&(.., count), product), best) in cases.iter().zip(&products).zip(&mut best) {
            streaming.take(|| {
                black_box(stream(black_box(&words)));
            });
            best.take(|| {
                black_box(product.apply(black_box(&x[..count])));
            });
        }
    }

    let rate = |bytes: usize, seconds: f64| bytes as f64 / seconds / 1e9;
    let read = words.len() * 8;
    let (wall, processor) = (rate(read, streaming.wall), rate(read, streaming.processor));
    println!("{elements} elements, {} threads", rayon::current_num_threads());
    println!("streaming read: {wall:.1} GB/s, {processor:.1} GB per processor second");
    println!("                            stored GB/s              all of S GB per");
    println!("entries  vectors  blocks    wall       processor     processor second, of streaming");
    for (&(kind, bytes, side, count), best) in cases.iter().zip(&best) {
        let all = rate(elements * elements * bytes, best.processor);
        println!(
            "{kind:7}  {count:7}  {:6}  {:6.1}  {:12.1}  {all:16.1}  {:10.0} %",
            sides[side],
            rate(stored * bytes, best.wall),
            rate(stored * bytes, best.processor),
            100.0 * all / processor
        );
    }
}
