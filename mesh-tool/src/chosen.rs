//! Which lines are drawn: as many of the strongest as the asked number of elements can follow in good shape.
//!
//! What a line costs depends on what it crosses and passes, so it is measured: the layers are meshed as coarsely as without
//! lines, and where that takes too many elements, the weakest lines are left out. More lines than that would either force
//! slivers or use up the elements that light needs elsewhere.

use crate::build::Options;
use crate::clean::Cleaned;
use crate::contact::Pieces;
use crate::discontinuity::DrawnLine;
use crate::meshed::{Drawing, Triangles};
use crate::search::{Floor, Search, area};
use crate::sized::{FLOOR, UNIFORM, graded};
use crate::steps::{Skip, Step};
use crate::strength::{affordable, by_strength, first, nearness};
use crate::triangulation::Trouble;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::{Error, Result};

/// The mesh that follows the lines, and elsewhere is as coarse as allowed, takes at most this part of the elements.
const MOST: f64 = 0.6;
/// Lines are left out in at most so many steps; each aims at what the one before missed.
const TRIALS: usize = 5;
/// No step is less than this part of what is open.
const LEAST_STEP: f64 = 0.1;
/// Lines that take this part of what is allowed are enough.
const ENOUGH: f64 = 0.7;
/// A step aims at this part of what is allowed.
const AIM: f64 = 0.9;
/// Part of the elements that lines may cost by a first guess.
const SHARE: f64 = 0.4;

/// Layers with their lines.
#[derive(Debug)]
pub struct Chosen {
    /// All layers.
    pub drawings: Vec<Drawing>,
    /// They in the coarsest triangles from which elements are then made smaller.
    pub start: Option<Vec<Triangles>>,
}

/// Draws all layers, by `draw`, with as many of the lines as the options' number of elements can follow.
pub fn choose(
    scene: &Scene,
    (cleaned, pieces): (&Cleaned, &Pieces),
    lines: Vec<DrawnLine>,
    draw: impl Fn(&[DrawnLine], f64) -> Result<Vec<Drawing>>,
    options: &Options,
    report: &mut Report,
    name: &(impl Fn(u32, Trouble) -> Error + Sync),
) -> Result<Chosen> {
    let nearness = if options.no_skip.leaves(Skip::Near) { nearness(cleaned, options) } else { 0.0 };
    let budget = options.elements.filter(|_| options.no_skip.leaves(Skip::Budget) && !lines.is_empty());
    let Some(elements) = budget else {
        return Ok(Chosen { drawings: draw(&lines, nearness)?, start: None });
    };
    // As coarse as without lines.
    let bare = draw(&[], 0.0)?;
    let max_edge = options.max_edge.unwrap_or(f64::INFINITY);
    let meets = options.no_clean.leaves(Step::Meet).then_some(&cleaned.places);
    let search = Search {
        scene,
        drawings: &bare,
        max_edge,
        floor: Floor::Part(FLOOR),
        graded: graded(options, area(&bare)),
        meets,
        name,
    };
    let wanted = f64::from(elements);
    let (meshes, spacing) = search.counted(UNIFORM * wanted)?;
    let (least, floor) = (crate::search::count(&meshes) as f64, FLOOR * spacing);

    // The count rises with the number of lines: between the most that fit and the fewest that do not, linearly.
    let order = by_strength(&lines, cleaned, pieces);
    let allowed = (MOST * wanted - least).max(0.0);
    let mut kept = affordable(&lines, &order, cleaned, elements, SHARE);
    let mut fits = (0, 0.0, Chosen { drawings: bare.clone(), start: Some(meshes) });
    let mut fails = None;
    for _ in 0..TRIALS {
        let drawings = draw(&first(&lines, &order, kept), nearness)?;
        let floor = Floor::Length(floor);
        let (meshes, count) = Search { drawings: &drawings, floor, ..search }.mesh(spacing)?;
        let taken = count - least;
        if taken <= allowed {
            fits = (kept, taken, Chosen { drawings, start: Some(meshes) });
        } else {
            fails = Some((kept, taken));
        }
        let Some((above, too_many)) = fails else { break };
        let part = ((AIM * allowed - fits.1) / (too_many - fits.1)).clamp(LEAST_STEP, 1.0 - LEAST_STEP);
        kept = fits.0 + (part * (above - fits.0) as f64).round() as usize;
        if kept == fits.0 || kept == above || fits.1 >= ENOUGH * allowed {
            break;
        }
    }
    report.count("skipped: lines too weak for the number of elements", lines.len() - fits.0);
    Ok(fits.2)
}
