//! Y = S X for up to four vectors in one pass over the mapped matrix, on all cores, with the same bits for any
//! number of threads.
//!
//! The stored entries are cut into at most [`MAX_TASKS`] tasks of consecutive rows; the cut depends on the file
//! alone. Each task sums into its own copy of the rows it touches, and the copies are added in the order of the
//! tasks.

use crate::kernel::{self, Entry, ROWS, Rows};
use interchange::matrix::{Block, BlockKind, BlockView, Matrix, Values, views};
use rayon::prelude::*;
use std::ops::Range;

/// Fewest entries worth a task: 2^16 are about 20 microseconds of work.
const MIN_TASK_ENTRIES: u64 = 1 << 16;
/// Most tasks: enough for even loads on some tens of cores, few enough that the copies of y stay small beside S.
const MAX_TASKS: u64 = 64;
/// Rows of y added up at a time.
const REDUCTION_ROWS: usize = 1024;

/// The symmetric exchange matrix as an operator.
#[derive(Debug)]
pub struct Product<'a> {
    elements: usize,
    views: Vec<BlockView<'a>>,
    tasks: Vec<Task>,
}

/// Consecutive rows of consecutive blocks.
#[derive(Debug, Default)]
struct Task {
    pieces: Vec<Piece>,
    /// Rows of y that the pieces touch.
    span: Range<usize>,
}

/// Rows `first..end` of a block.
#[derive(Debug, Clone, Copy)]
struct Piece {
    block: u32,
    first: u32,
    end: u32,
}

impl<'a> Product<'a> {
    /// The product with a mapped matrix.
    pub fn new(matrix: &'a Matrix) -> interchange::Result<Self> {
        Ok(Self::from_views(matrix.element_count(), matrix.views()?))
    }

    /// The product with full blocks in memory; they must lie within `elements` rows, and `values` must hold their entries.
    pub fn from_parts(elements: usize, blocks: &'a [Block], values: Values<'a>) -> Self {
        Self::from_views(elements, views(blocks, values, &[]).collect())
    }

    /// The product with blocks that lie within `elements` rows.
    pub fn from_views(elements: usize, views: Vec<BlockView<'a>>) -> Self {
        let stored: u64 = views.iter().map(|view| view.block.stored()).sum();
        let quota = MIN_TASK_ENTRIES.max(stored.div_ceil(MAX_TASKS));
        let tasks = partition(&views, quota);
        Self { elements, views, tasks }
    }

    /// Number of rows.
    pub fn element_count(&self) -> usize {
        self.elements
    }

    /// Number of stored entries; each pair once.
    pub fn stored_entries(&self) -> usize {
        self.views.iter().map(|view| view.values.len()).sum()
    }

    /// Calls `visit(i, j, S_ij)` for every stored entry, each pair once with i <= j, until it says to stop.
    pub fn for_each_until(&self, mut visit: impl FnMut(usize, usize, f64) -> std::ops::ControlFlow<()>) {
        for view in &self.views {
            if view.try_for_each(&mut visit).is_break() {
                return;
            }
        }
    }

    /// S x for each of the vectors `x` (one value per row each), four per pass.
    pub fn apply(&self, x: &[&[f64]]) -> Vec<Vec<f64>> {
        x.chunks(4)
            .flat_map(|x| match *x {
                [a] => self.apply_some([a]).into(),
                [a, b] => self.apply_some([a, b]).into(),
                [a, b, c] => self.apply_some([a, b, c]).into(),
                [a, b, c, d] => self.apply_some([a, b, c, d]).into(),
                _ => Vec::new(),
            })
            .collect()
    }

    fn apply_some<const K: usize>(&self, x: [&[f64]; K]) -> [Vec<f64>; K] {
        debug_assert!(x.iter().all(|x| x.len() == self.elements), "vectors of another length");
        let partial: Vec<[Vec<f64>; K]> = self.tasks.par_iter().map(|task| self.run(task, x)).collect();
        std::array::from_fn(|k| {
            let mut y = vec![0.0; self.elements];
            y.par_chunks_mut(REDUCTION_ROWS).enumerate().for_each(|(chunk, y)| {
                let rows = chunk * REDUCTION_ROWS..chunk * REDUCTION_ROWS + y.len();
                for (task, sums) in self.tasks.iter().zip(&partial) {
                    let (first, end) = (rows.start.max(task.span.start), rows.end.min(task.span.end));
                    for i in first..end {
                        y[i - rows.start] += sums[k][i - task.span.start];
                    }
                }
            });
            y
        })
    }

    fn run<const K: usize>(&self, task: &Task, x: [&[f64]; K]) -> [Vec<f64>; K] {
        let mut y = std::array::from_fn(|_| vec![0.0; task.span.len()]);
        for piece in &task.pieces {
            let view = &self.views[piece.block as usize];
            match view.values {
                Values::F32(values) => run_piece(piece, view, values, x, &mut y, task.span.start),
                Values::F64(values) => run_piece(piece, view, values, x, &mut y, task.span.start),
            }
        }
        y
    }
}

fn run_piece<const K: usize, T: Entry>(
    piece: &Piece,
    view: &BlockView<'_>,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [Vec<f64>; K],
    base: usize,
) {
    let block = &view.block;
    if block.kind() == Ok(BlockKind::Sparse) {
        kernel::add_sparse_rows(view, piece.first as usize..piece.end as usize, values, x, y, base);
        return;
    }
    let rows = Rows {
        first: piece.first as usize,
        count: (piece.end - piece.first) as usize,
        row_start: block.row_start as usize,
        column_start: block.column_start as usize,
        columns: block.columns as usize,
        triangle: block.kind() == Ok(BlockKind::Triangle),
        offset: 0,
    };
    kernel::add_rows(&rows, values, x, y, base);
}

/// Cuts the blocks into tasks of about `quota` entries, at multiples of the kernel's rows.
fn partition(views: &[BlockView<'_>], quota: u64) -> Vec<Task> {
    let mut tasks = Vec::new();
    let mut task = Task::default();
    let mut filled = 0;
    for (index, view) in views.iter().enumerate() {
        let block = &view.block;
        let kind = block.kind();
        let mut first = 0;
        while first < block.rows {
            // Take rows until the quota is met.
            let mut end = first;
            while end < block.rows && filled < quota {
                let next = (end + ROWS as u32).min(block.rows);
                let entries = |row: u32| match kind {
                    Ok(BlockKind::Sparse) => view.row_entries(row as usize).len() as u64,
                    Ok(BlockKind::Triangle) => u64::from(block.columns - row),
                    _ => u64::from(block.columns),
                };
                filled += (end..next).map(entries).sum::<u64>();
                end = next;
            }
            task.add(index, block, first, end);
            first = end;
            if filled >= quota {
                tasks.push(std::mem::take(&mut task));
                filled = 0;
            }
        }
    }
    if !task.pieces.is_empty() {
        tasks.push(task);
    }
    tasks
}

impl Task {
    fn add(&mut self, index: usize, block: &Block, first: u32, end: u32) {
        let rows = block.row_start + first..block.row_start + end;
        // Stored rows come before their columns.
        let start = rows.start as usize;
        let stop = rows.end.max(block.column_start + block.columns) as usize;
        self.span = match self.pieces.is_empty() {
            true => start..stop,
            false => self.span.start.min(start)..self.span.end.max(stop),
        };
        self.pieces.push(Piece { block: index as u32, first, end });
    }
}
