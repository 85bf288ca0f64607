//! The matrix product on a 10,000 x 10,000 matrix against the machine's streaming read bandwidth, in one process, on all
//! cores: `cargo bench -p solve-tool --bench product [-- ELEMENTS]`.
//!
//! Half of S is stored and each stored entry is used twice, so a kernel that reads all of S would have to run at twice
//! the rate to be as fast; rates here count stored bytes only. Streaming and product take turns, best of several rounds
//! each, as other work on the machine only ever takes time away; rates are given per second of wall time and, for
//! machines that are never quiet, per second of processor time (Linux tells it). The last lines are of a matrix that stays
//! in the second-level cache: what arithmetic alone allows. The error is the largest of some rows
//! against compensated sums, relative to the sum of the magnitudes of the row's terms.
#![allow(missing_docs, clippy::unwrap_used)]

use interchange::matrix::{Block, BlockKind, Values};
use rayon::prelude::*;
use solve_tool::product::Product;
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 48;

/// Least wall and processor seconds of a piece of work.
#[derive(Clone, Copy)]
struct Best {
    wall: f64,
    processor: f64,
}

impl Best {
    const NONE: Best = Best { wall: f64::INFINITY, processor: f64::INFINITY };

    fn take(&mut self, mut work: impl FnMut()) {
        // Three in a row: the system counts processor time in steps of some milliseconds. Wall time is that of one: on a
        // busy machine the shorter a piece of work the likelier it had all cores.
        let processor = processor_seconds();
        for _ in 0..3 {
            let wall = Instant::now();
            work();
            self.wall = self.wall.min(wall.elapsed().as_secs_f64());
        }
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

/// Numbers in 0.5..1 without a pattern that could hide an entry taken twice or not at all.
fn scattered(index: usize) -> f64 {
    let mixed = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    0.5 + (mixed >> 40) as f64 / (1u64 << 25) as f64
}

/// Largest error of every `STEP`th row against compensated sums (Ogita, Rump & Oishi 05: Dot2), relative to the sum of
/// magnitudes; `single` is the upper triangle row by row.
fn error(single: &[f32], x: &[&[f64]], y: &[Vec<f64>]) -> f64 {
    const STEP: usize = 97;
    let n = x[0].len();
    let entry = |i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        f64::from(single[i * (2 * n + 1 - i) / 2 + j - i])
    };
    let row_error = |x: &[f64], y: &[f64], i: usize| {
        let (mut sum, mut lost, mut magnitudes) = (0.0f64, 0.0f64, 0.0f64);
        for (j, &x) in x.iter().enumerate() {
            let product = entry(i, j) * x;
            let product_lost = entry(i, j).mul_add(x, -product);
            let next = sum + product;
            let back = next - sum;
            lost += (sum - (next - back)) + (product - back) + product_lost;
            sum = next;
            magnitudes += product.abs();
        }
        ((y[i] - sum) - lost).abs() / magnitudes
    };
    let of_vector =
        |(x, y): (&&[f64], &Vec<f64>)| (0..n).step_by(STEP).map(|i| row_error(x, y, i)).fold(0.0, f64::max);
    x.iter().zip(y).map(of_vector).fold(0.0, f64::max)
}

fn main() {
    let given = std::env::args().skip(1).find_map(|word| word.parse().ok());
    let elements: usize = given.unwrap_or(10_000);
    let stored = elements * (elements + 1) / 2;
    let words = vec![1u64; stored / 2];
    let single: Vec<f32> = (0..stored).map(|index| scattered(index) as f32).collect();
    let double: Vec<f64> = single.iter().copied().map(f64::from).collect();
    let x = [1, 2, 3].map(|k| (0..elements).map(|i| scattered(i * 3 + k) - 0.75).collect::<Vec<f64>>());
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

    // Half a megabyte of entries, often enough to be timed.
    const CACHED: usize = 512;
    const TIMES: usize = 200;
    let cached_stored = CACHED * (CACHED + 1) / 2;
    let cached_blocks = self::blocks(CACHED, 256);
    let cached = Product::from_parts(CACHED, &cached_blocks, Values::F32(&single[..cached_stored]));
    let cached_x: Vec<&[f64]> = x.iter().map(|x| &x[..CACHED]).collect();
    let mut from_cache = [(1, Best::NONE), (3, Best::NONE)];

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

    // Alone, as threads that wait for so little work would count, too.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for _ in 0..ROUNDS {
        for (count, best) in &mut from_cache {
            best.take(|| {
                alone.install(|| {
                    (0..TIMES).for_each(|_| drop(black_box(cached.apply(black_box(&cached_x[..*count])))));
                });
            });
        }
    }

    let rate = |bytes: usize, seconds: f64| bytes as f64 / seconds / 1e9;
    let read = words.len() * 8;
    let (wall, processor) = (rate(read, streaming.wall), rate(read, streaming.processor));
    println!("{elements} elements, {} threads", rayon::current_num_threads());
    println!("streaming read: {wall:.1} GB/s, {processor:.1} GB per processor second");
    println!("error of f32 entries, 3 vectors: {:.1e}", error(&single, &x, &products[1].apply(&x)));
    println!("                           stored GB/s, of streaming");
    println!("entries  vectors  blocks   wall          processor");
    for (&(kind, bytes, side, count), best) in cases.iter().zip(&best) {
        let (by_wall, by_processor) = (rate(stored * bytes, best.wall), rate(stored * bytes, best.processor));
        println!(
            "{kind:7}  {count:7}  {:6}  {by_wall:5.1}  {:3.0} %  {by_processor:5.1}  {:3.0} %",
            sides[side],
            100.0 * by_wall / wall,
            100.0 * by_processor / processor
        );
    }
    for (count, best) in from_cache {
        let by_processor = rate(cached_stored * 4 * TIMES, best.processor);
        println!(
            "f32      {count:7}  cached                {by_processor:5.1}  {:3.0} %",
            100.0 * by_processor / processor
        );
    }
}
