//! Y = S X for up to four vectors in one pass over the mapped matrix, on all cores, with the same bits for any
//! number of threads. The only place that knows how blocks are stored: everything that solves asks for products, for
//! [`rows::RowIndex`] or for all entries.
//!
//! The stored entries are cut into at most [`MAX_TASKS`] tasks of consecutive rows; the cut depends on the file
//! alone. Each task sums into its own copy of the rows it touches, and the copies are added in the order of the
//! tasks.

mod one_way;
pub(crate) mod rows;
mod scratch;

use crate::kernel::{self, Entry, LANES, ROWS, Rows};
use interchange::matrix::{Block, BlockKind, BlockView, Matrix, Values, views};
use rayon::prelude::*;
use scratch::{Buffer, Scratch};
use std::ops::Range;

/// Fewest entries worth a task: 2^16 are about 20 microseconds of work.
const MIN_TASK_ENTRIES: u64 = 1 << 16;
/// Most tasks: enough for even loads on a dozen cores, few enough that the copies of y stay small beside S.
const MAX_TASKS: u64 = 32;
/// Rows of y added up at a time.
const REDUCTION_ROWS: usize = 1024;

/// The exchange matrix as an operator.
#[derive(Debug, Clone)]
pub struct Product<'a> {
    elements: usize,
    symmetric: bool,
    views: Vec<BlockView<'a>>,
    tasks: Vec<Task>,
    scratch: Scratch,
}

/// Consecutive rows of consecutive blocks.
#[derive(Debug, Clone, Default)]
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
        let symmetric = matrix.record().symmetric;
        Ok(Self::with_symmetry(matrix.element_count(), symmetric, matrix.views()?))
    }

    /// The product with full blocks in memory that stand for their mirror images too; they must lie within `elements`
    /// rows, and `values` must hold their entries.
    pub fn from_parts(elements: usize, blocks: &'a [Block], values: Values<'a>) -> Self {
        Self::from_blocks(elements, true, blocks, values)
    }

    /// The product with full blocks in memory; without symmetry all must be dense and give every entry there is.
    pub fn from_blocks(elements: usize, symmetric: bool, blocks: &'a [Block], values: Values<'a>) -> Self {
        Self::with_symmetry(elements, symmetric, views(blocks, values, &[]).collect())
    }

    /// The product with blocks that lie within `elements` rows and stand for their mirror images too.
    pub fn from_views(elements: usize, views: Vec<BlockView<'a>>) -> Self {
        Self::with_symmetry(elements, true, views)
    }

    fn with_symmetry(elements: usize, symmetric: bool, views: Vec<BlockView<'a>>) -> Self {
        let stored: u64 = views.iter().map(|view| view.block.stored()).sum();
        let quota = MIN_TASK_ENTRIES.max(stored.div_ceil(MAX_TASKS));
        let tasks = partition(&views, quota);
        Self { elements, symmetric, views, tasks, scratch: Scratch::default() }
    }

    /// The same product for vectors that are 0 outside `sources`, of which only the `wanted` rows are asked for; the
    /// others hold anything. Rows that cannot matter are left out. What is computed keeps its bits: only products with
    /// 0 are missing.
    pub fn restricted(&self, wanted: &[bool], sources: &[bool]) -> Self {
        let (wanted, sources) = (Counted::new(wanted), Counted::new(sources));
        let matters = |rows: Range<usize>, columns: Range<usize>| {
            (wanted.any(&rows) && sources.any(&columns))
                || (self.symmetric && wanted.any(&columns) && sources.any(&rows))
        };
        let keep = |task: &Task| {
            let mut kept = Task::default();
            for piece in &task.pieces {
                let view = &self.views[piece.block as usize];
                let block = &view.block;
                let columns = block.column_start as usize..(block.column_start + block.columns) as usize;
                // Runs of strips of the kernel's height, so that their sums keep their order.
                let mut run: Option<(u32, u32)> = None;
                for first in (piece.first..piece.end).step_by(ROWS) {
                    let end = (first + ROWS as u32).min(piece.end);
                    let rows = (block.row_start + first) as usize..(block.row_start + end) as usize;
                    run = match (run, matters(rows, columns.clone())) {
                        (Some((start, _)), true) => Some((start, end)),
                        (None, true) => Some((first, end)),
                        (Some((start, stop)), false) => {
                            kept.add(piece.block as usize, view, start, stop);
                            None
                        }
                        (None, false) => None,
                    };
                }
                if let Some((start, stop)) = run {
                    kept.add(piece.block as usize, view, start, stop);
                }
            }
            kept
        };
        let tasks = self.tasks.iter().map(keep).filter(|task| !task.pieces.is_empty()).collect();
        Self { tasks, ..self.clone() }
    }

    /// Entries that a pass reads.
    pub fn entries_read(&self) -> u64 {
        let read = |piece: &Piece| {
            let view = &self.views[piece.block as usize];
            (piece.first..piece.end).map(|row| row_entries(view, row)).sum::<u64>()
        };
        self.tasks.iter().flat_map(|task| &task.pieces).map(read).sum()
    }

    /// Whether every entry stands for its mirror image too.
    pub fn is_symmetric(&self) -> bool {
        self.symmetric
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

    /// The transpose of S times each of the vectors; S x where S is symmetric.
    pub fn apply_transposed(&self, x: &[&[f64]]) -> Vec<Vec<f64>> {
        if self.symmetric {
            return self.apply(x);
        }
        x.iter().flat_map(|x| self.sum_tasks([*x], |task| self.run_transposed(task, x))).collect()
    }

    fn apply_some<const K: usize>(&self, x: [&[f64]; K]) -> [Vec<f64>; K] {
        if !self.symmetric {
            return self.sum_tasks(x, |task| self.run_one_way(task, x));
        }
        let aligned = x.map(|x| self.scratch.copy(x));
        let y = self.sum_tasks(x, |task| self.run(task, aligned.each_ref().map(|x| &**x)));
        self.scratch.give_back(aligned.into_iter());
        y
    }

    /// Runs the tasks on all cores and adds what each found on its span, in the order of the tasks.
    fn sum_tasks<const K: usize>(
        &self,
        x: [&[f64]; K],
        run: impl Fn(&Task) -> [Buffer; K] + Sync + Send,
    ) -> [Vec<f64>; K] {
        debug_assert!(x.iter().all(|x| x.len() == self.elements), "vectors of another length");
        let partial: Vec<[Buffer; K]> = self.tasks.par_iter().map(run).collect();
        let y = std::array::from_fn(|k| {
            let mut y = vec![0.0; self.elements];
            y.par_chunks_mut(REDUCTION_ROWS).enumerate().for_each(|(chunk, y)| {
                let rows = chunk * REDUCTION_ROWS..chunk * REDUCTION_ROWS + y.len();
                for (task, sums) in self.tasks.iter().zip(&partial) {
                    let (first, end) = (rows.start.max(task.span.start), rows.end.min(task.span.end));
                    for i in first..end {
                        y[i - rows.start] += sums[k][i - task.base()];
                    }
                }
            });
            y
        });
        self.scratch.give_back(partial.into_iter().flatten());
        y
    }

    /// What a task adds to S x, on its span. `x` holds whole chunks.
    fn run<const K: usize>(&self, task: &Task, x: [&[f64]; K]) -> [Buffer; K] {
        let mut buffers: [Buffer; K] = std::array::from_fn(|_| self.scratch.zeros(task.length()));
        let mut y = buffers.each_mut().map(|y| &mut **y);
        for piece in &task.pieces {
            let view = &self.views[piece.block as usize];
            match view.values {
                Values::F32(values) => run_piece(piece, view, values, x, &mut y, task.base()),
                Values::F64(values) => run_piece(piece, view, values, x, &mut y, task.base()),
            }
        }
        buffers
    }
}

fn run_piece<const K: usize, T: Entry>(
    piece: &Piece,
    view: &BlockView<'_>,
    values: &[T],
    x: [&[f64]; K],
    y: &mut [&mut [f64]; K],
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

/// Entries that row `row` of the block stores.
fn row_entries(view: &BlockView<'_>, row: u32) -> u64 {
    match view.block.kind() {
        Ok(BlockKind::Sparse) => view.row_entries(row as usize).len() as u64,
        Ok(BlockKind::Triangle) => u64::from(view.block.columns - row),
        _ => u64::from(view.block.columns),
    }
}

/// How many of a run of elements are marked, in constant time.
struct Counted(Vec<u32>);

impl Counted {
    fn new(marks: &[bool]) -> Self {
        let mut before = 0;
        let counts = marks.iter().map(|&mark| {
            before += u32::from(mark);
            before
        });
        Self(std::iter::once(0).chain(counts).collect())
    }

    fn any(&self, run: &Range<usize>) -> bool {
        self.0[run.end] > self.0[run.start]
    }
}

/// Cuts the blocks into tasks of about `quota` entries, at multiples of the kernel's rows.
fn partition(views: &[BlockView<'_>], quota: u64) -> Vec<Task> {
    let mut tasks = Vec::new();
    let mut task = Task::default();
    let mut filled = 0;
    for (index, view) in views.iter().enumerate() {
        let block = &view.block;
        let mut first = 0;
        while first < block.rows {
            // Take rows until the quota is met.
            let mut end = first;
            while end < block.rows && filled < quota {
                let next = (end + ROWS as u32).min(block.rows);
                filled += (end..next).map(|row| row_entries(view, row)).sum::<u64>();
                end = next;
            }
            task.add(index, view, first, end);
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
    /// Row of y where its copy begins: the chunk of the first it touches.
    fn base(&self) -> usize {
        self.span.start / LANES * LANES
    }

    /// Length of its copy of y.
    fn length(&self) -> usize {
        self.span.end - self.base()
    }

    fn add(&mut self, index: usize, view: &BlockView<'_>, first: u32, end: u32) {
        let block = &view.block;
        let rows = block.row_start + first..block.row_start + end;
        // A triangle's rows hold nothing to the left of the diagonal.
        let triangle = block.kind() == Ok(BlockKind::Triangle);
        let start = if triangle { rows.start } else { rows.start.min(block.column_start) } as usize;
        let stop = rows.end.max(block.column_start + block.columns) as usize;
        self.span = match self.pieces.is_empty() {
            true => start..stop,
            false => self.span.start.min(start)..self.span.end.max(stop),
        };
        self.pieces.push(Piece { block: index as u32, first, end });
    }
}
