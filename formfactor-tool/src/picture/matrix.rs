//! The matrix F as a picture in the order of the clusters: row i at the top, a pixel for one or several elements, the
//! borders and kinds of the blocks, and a legend.

use super::canvas::{Canvas, INK};
use super::scale::Scale;
use interchange::error::Result;
use interchange::font;
use interchange::matrix::{BlockKind, Matrix};
use interchange::tool::progress;
use std::path::Path;

/// Side of the square, pixels, at most.
const SIDE: usize = 1024;
/// Space around the square and between it and the legend.
const MARGIN: usize = 16;
/// Width of the legend.
const LEGEND: usize = 190;
/// Blocks with a shorter side than this many pixels get no border: borders would cover them.
const SMALLEST_BORDERED: usize = 8;
/// What no block stores: zero by proof.
const ABSENT: [u8; 3] = [226; 3];
/// What a block stores as zero.
const ZERO: [u8; 3] = [0; 3];
/// Kinds of blocks with the colours of their borders.
const KINDS: [(BlockKind, &str, [u8; 3]); 3] = [
    (BlockKind::Dense, "dense", [255, 255, 255]),
    (BlockKind::Triangle, "triangle", [255, 90, 90]),
    (BlockKind::Sparse, "sparse", [80, 200, 255]),
];

/// Draws the matrix in one file or in all its parts.
///
/// # Errors
/// The files cannot be read or the picture cannot be written.
pub fn draw(paths: &[impl AsRef<Path>], output: &Path) -> Result<()> {
    interchange::atomic_write::refuse_input(output, paths.iter().map(AsRef::as_ref))?;
    let matrix = Matrix::open_all(paths)?;
    picture(&matrix)?.write(output).map(|_| ())
}

/// The picture.
///
/// # Errors
/// The file is damaged.
pub fn picture(matrix: &Matrix) -> Result<Canvas> {
    let count = matrix.element_count();
    let (areas, symmetric, views) = (matrix.areas()?, matrix.record().symmetric, matrix.views()?);
    // Either several pixels for an element or several elements for a pixel.
    let (zoom, bin) = ((SIDE / count).max(1), count.div_ceil(SIDE));
    let cells = count.div_ceil(bin);

    let (mut sums, mut stored) = (vec![0.0f64; cells * cells], vec![false; cells * cells]);
    for view in progress("picture", views.len()).wrap_iter(views.iter()) {
        view.for_each(|i, j, s| {
            let (row, column) = (i / bin, j / bin);
            sums[row * cells + column] += s / areas[i];
            stored[row * cells + column] = true;
            if symmetric && i != j {
                sums[column * cells + row] += s / areas[j];
                stored[column * cells + row] = true;
            }
        });
        if view.block.kind() == Ok(BlockKind::Sparse) {
            // What a sparse block does not list is stored as zero, too.
            let cells_of =
                |start: u32, length: u32| start as usize / bin..((start + length) as usize).div_ceil(bin);
            for row in cells_of(view.block.row_start, view.block.rows) {
                for column in cells_of(view.block.column_start, view.block.columns) {
                    stored[row * cells + column] = true;
                    stored[column * cells + row] |= symmetric;
                }
            }
        }
    }
    // Means over the elements of a pixel; the last one may have fewer.
    let elements = |cell: usize| bin.min(count - cell * bin) as f64;
    let mean = |k: usize| sums[k] / (elements(k / cells) * elements(k % cells));
    let scale = Scale::of((0..sums.len()).map(mean));

    let side = cells * zoom;
    let height = side.max(320) + 3 * MARGIN + font::LINE;
    let mut canvas = Canvas::new(side + LEGEND + 3 * MARGIN, height);
    let top = 2 * MARGIN;
    for (k, &is_stored) in stored.iter().enumerate() {
        let colour = match (mean(k), is_stored) {
            (f, _) if f > 0.0 => scale.colour(f),
            (_, true) => ZERO,
            (_, false) => ABSENT,
        };
        canvas.fill(MARGIN + zoom * (k % cells), top + zoom * (k / cells), zoom, zoom, colour);
    }
    let pixel = |element: u32| element as usize * zoom / bin;
    for view in &views {
        let block = &view.block;
        let (y, x) = (pixel(block.row_start), pixel(block.column_start));
        let (rows, columns) =
            (pixel(block.row_start + block.rows) - y, pixel(block.column_start + block.columns) - x);
        let Some((_, _, colour)) = KINDS.iter().find(|(kind, _, _)| block.kind() == Ok(*kind)) else {
            continue;
        };
        if rows.min(columns) >= SMALLEST_BORDERED {
            canvas.frame(MARGIN + x, top + y, columns, rows, *colour);
        }
    }
    canvas.frame(MARGIN - 1, top - 1, side + 2, side + 2, INK);

    let title = match bin {
        1 => format!("F(row -> column), {count} elements in cluster order"),
        _ => format!("F(row -> column), {count} elements in cluster order, mean of {bin} x {bin} a pixel"),
    };
    canvas.text(MARGIN, MARGIN / 2, 1, &title);
    let x = side + 2 * MARGIN;
    scale.draw(&mut canvas, x, top + 4, 160);
    let mut y = top + 160 + 2 * MARGIN;
    let mut entry = |canvas: &mut Canvas, border: [u8; 3], inside: [u8; 3], text: &str| {
        canvas.fill(x, y, 12, 12, inside);
        canvas.frame(x, y, 12, 12, INK);
        canvas.frame(x + 1, y + 1, 10, 10, border);
        canvas.text(x + 20, y + 2, 1, text);
        y += 18;
    };
    for (kind, name, colour) in KINDS {
        let number = views.iter().filter(|view| view.block.kind() == Ok(kind)).count();
        entry(
            &mut canvas,
            colour,
            [110; 3],
            &format!("{number} {name} {}", if number == 1 { "block" } else { "blocks" }),
        );
    }
    entry(&mut canvas, ZERO, ZERO, "stored as zero");
    entry(&mut canvas, ABSENT, ABSENT, "in no block: zero");
    Ok(canvas)
}
