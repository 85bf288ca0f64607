//! How many elements, and of which size: what `--max-edge`, `--elements` and `--tolerance` ask for.

use crate::adaptive;
use crate::build::Options;
use crate::chosen::Chosen;
use crate::light::Light;
use crate::lit;
use crate::meshed::Triangles;
use crate::places::Places;
use crate::search::{
    COUNT_TOLERANCE, Floor, MOST_ELEMENTS, SPACING_PER_MAX_EDGE, Search, area, count, spacing,
};
use crate::steps::{Skip, Step};
use crate::triangulation::Trouble;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::{Error, Result};

/// The number of elements may miss what was asked for by this part, where they are refined for light.
pub const REFINED_TOLERANCE: f64 = 0.1;

/// The number may be above what was asked for by this factor without a warning.
const MANY_MORE: f64 = 1.15;

/// The number to refine to is chosen at most so often.
const AIMS: usize = 3;

/// No edge is halved for the sake of shape below this part of the spacing, where the number of elements is given, ...
pub const FLOOR: f64 = 0.05;
/// ... and where only a length is.
const FINE_FLOOR: f64 = 1e-3;

/// Adaptive meshes start with about this many elements.
const COARSE: f64 = 80.0;

/// Where faces alone need about as many elements as are asked for or more, there are this many times what they need: with none to
/// spare, a furnished room's walls were left in a dozen elements each, and its picture off by 4.0 % where it now is by 2.9 %.
const SPARE: f64 = 1.25;

/// This part of the elements makes a uniform mesh; the others go where light changes.
pub const UNIFORM: f64 = 0.35;

/// The length below which no edge is halved for the sake of even sizes, where the elements cover this area: light or shape
/// would not either. `None` where a number of elements is asked for: even sizes may take several times that number in strips
/// between lines or borders (BENCHMARKING.md), and are made in the end, where the number allows it.
pub fn graded(options: &Options, area: f64) -> Option<f64> {
    match (options.elements, options.max_edge) {
        (Some(_), _) if options.no_skip.leaves(Skip::Grading) => None,
        (Some(wanted), _) => Some(shortest(area, f64::from(wanted))),
        (None, Some(length)) => Some(FINE_FLOOR * SPACING_PER_MAX_EDGE * length),
        (None, None) => Some(adaptive::SHORTEST * area.sqrt()),
    }
}

/// The same for so many elements.
pub fn shortest(area: f64, wanted: f64) -> f64 {
    FINE_FLOOR * spacing(area, wanted)
}

/// Meshes all layers as the options ask: with `light`, smaller where it changes.
pub fn sized(
    scene: &Scene,
    chosen: &mut Chosen,
    light: Option<&Light>,
    options: &Options,
    places: &Places,
    report: &mut Report,
    name: &(impl Fn(u32, Trouble) -> Error + Sync),
) -> Result<Vec<Triangles>> {
    let max_edge = options.max_edge.unwrap_or(f64::INFINITY);
    let start = chosen.start.take();
    let drawings = &chosen.drawings;
    // A number of elements is a budget: shape yields to it. A length alone is none.
    let floor = Floor::Part(if options.elements.is_some() { FLOOR } else { FINE_FLOOR });
    let meets = options.no_clean.leaves(Step::Meet).then_some(places);
    let graded = graded(options, area(drawings));
    let search = Search { scene, drawings, max_edge, floor, graded, meets, name };
    if let (Some(light), Some(asked)) = (light, options.tolerance) {
        let most = options.elements.map_or(MOST_ELEMENTS, f64::from);
        // Start coarse: what is evenly lit stays so.
        let coarse = spacing(search.area(), COARSE).min(SPACING_PER_MAX_EDGE * max_edge);
        let mut meshes = search.mesh(coarse)?.0;
        let diagonal = search.diagonal();
        let wish = adaptive::Wish { tolerance: asked, most, linear: options.linear, diagonal };
        adaptive::refine(light, drawings, &mut meshes, wish, report)
            .map_err(|(layer, trouble)| name(drawings[layer].layer().sheets[0].face, trouble))?;
        report.count("planes that do not meet others everywhere", search.settle(&mut meshes)?);
        return Ok(meshes);
    }
    let Some(wanted) = options.elements.map(f64::from) else {
        return Ok(search.mesh(SPACING_PER_MAX_EDGE * max_edge)?.0);
    };
    if let Some(light) = light {
        let spacing = spacing(search.area(), wanted);
        let start = match start {
            Some(meshes) => meshes,
            None => search.counted(UNIFORM * wanted)?.0,
        };
        let needed = count(&start) as f64;
        let asked = wanted;
        // What a length takes is not the faces' need.
        let wanted = if options.max_edge.is_some() { asked } else { asked.max(SPARE * needed) };
        let mut aim = wanted;
        for _ in 0..AIMS {
            if needed >= (1.0 - COUNT_TOLERANCE) * aim {
                break;
            }
            let mut meshes = start.clone();
            lit::refine(light, drawings, &mut meshes, aim, spacing, report)
                .map_err(|(layer, trouble)| name(drawings[layer].layer().sheets[0].face, trouble))?;
            report.count("planes that do not meet others everywhere", search.settle(&mut meshes)?);
            let found = count(&meshes) as f64;
            // Where light changes nowhere, only a uniform mesh can use up the rest.
            if found < (1.0 - REFINED_TOLERANCE) * wanted {
                break;
            }
            let most = (1.0 + REFINED_TOLERANCE) * wanted;
            if found <= most {
                even_out(&search, &mut meshes, wanted, most, options, report)?;
                warn_of_more(count(&meshes) as f64, asked, report);
                return Ok(meshes);
            }
            // Edges that meet those of other planes took more than there was: leave room for them.
            aim *= wanted / found;
        }
    }
    let mut meshes = search.counted(wanted)?.0;
    even_out(&search, &mut meshes, wanted, (1.0 + REFINED_TOLERANCE) * wanted, options, report)?;
    warn_of_more(count(&meshes) as f64, wanted, report);
    Ok(meshes)
}

/// Grades sizes where that takes no more than `most` elements.
fn even_out<Name: Fn(u32, Trouble) -> Error + Sync>(
    search: &Search<'_, Name>,
    meshes: &mut Vec<Triangles>,
    wanted: f64,
    most: f64,
    options: &Options,
    report: &mut Report,
) -> Result<()> {
    if options.no_skip.leaves(Skip::Grading) {
        let done = search.even_out(meshes, shortest(search.area(), wanted), most)?;
        report.count("skipped: even sizes, which take more than the number of elements", usize::from(!done));
    }
    Ok(())
}

/// Says that there are more elements than asked for, where there are many more.
fn warn_of_more(found: f64, asked: f64, report: &mut Report) {
    if found > MANY_MORE * asked {
        report.warn(format!(
            "faces, lines and their light take {found} elements, more than the {asked} asked for"
        ));
    }
}
