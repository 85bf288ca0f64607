//! Products with a matrix that is not symmetric: every entry is used once, for its own row, or once for its column
//! where the transpose is asked for. Only imported matrices come here, so it is written plainly.

use super::scratch::Buffer;
use super::{Product, Task};
use crate::kernel::Entry;
use interchange::matrix::Values;

/// Partial sums of a row, an order the compiler can keep in vector registers.
const LANES: usize = 8;

impl Product<'_> {
    /// What a task adds to S x, on its span.
    pub(super) fn run_one_way<const K: usize>(&self, task: &Task, x: [&[f64]; K]) -> [Buffer; K] {
        let mut y = std::array::from_fn(|_| self.scratch.zeros(task.length()));
        self.for_rows(task, |row, column, entries| {
            for k in 0..K {
                let x = &x[k][column..];
                y[k][row - task.base()] += match entries {
                    Values::F32(entries) => dot(entries, x),
                    Values::F64(entries) => dot(entries, x),
                };
            }
        });
        y
    }

    /// What a task adds to the transpose of S times x, on its span.
    pub(super) fn run_transposed(&self, task: &Task, x: &[f64]) -> [Buffer; 1] {
        let mut y = self.scratch.zeros(task.length());
        self.for_rows(task, |row, column, entries| {
            let sums = &mut y[column - task.base()..];
            sums.iter_mut().take(entries.len()).enumerate().for_each(|(j, y)| *y += entries.get(j) * x[row]);
        });
        [y]
    }

    /// Calls `visit(row, first column, entries)` for each row of the task's dense blocks.
    fn for_rows(&self, task: &Task, mut visit: impl FnMut(usize, usize, Values<'_>)) {
        for piece in &task.pieces {
            let view = &self.views[piece.block as usize];
            let (block, columns) = (&view.block, view.block.columns as usize);
            for row in piece.first..piece.end {
                let start = row as usize * columns;
                let entries = view.values.slice(start..start + columns);
                visit((block.row_start + row) as usize, block.column_start as usize, entries);
            }
        }
    }
}

fn dot<T: Entry>(entries: &[T], x: &[f64]) -> f64 {
    let x = &x[..entries.len()];
    let (chunks, rest) = entries.as_chunks::<LANES>();
    let (x_chunks, x_rest) = x.as_chunks::<LANES>();
    let mut partial = [0.0; LANES];
    for (entries, x) in chunks.iter().zip(x_chunks) {
        for lane in 0..LANES {
            let s: f64 = entries[lane].into();
            partial[lane] += s * x[lane];
        }
    }
    let tail: f64 = rest.iter().zip(x_rest).map(|(&s, x)| s.into() * x).sum();
    partial.iter().sum::<f64>() + tail
}
