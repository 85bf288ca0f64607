//! How many elements, and of which size: what `--max-edge` and `--elements` ask for.

use crate::adaptive;
use crate::build::Options;
use crate::conform;
use crate::light::Light;
use crate::lit;
use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use crate::steps::Step;
use crate::triangulation::Trouble;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::tool::progress;
use interchange::{Error, Result};
use rayon::prelude::*;

/// Area of an equilateral triangle of edge 1.
pub const EQUILATERAL: f64 = 0.433_012_701_892_219_3;
/// Spacing wished where no edge may be longer than 1: smoothed lattices stretch single edges by about a fifth.
const SPACING_PER_MAX_EDGE: f64 = 0.8;
/// The search for the spacing that gives the asked number of elements ends within this part of it, ...
const COUNT_TOLERANCE: f64 = 0.04;
/// ... or after this many trials: the count falls with the square of the spacing, so that two or three are usual.
const COUNT_TRIALS: usize = 8;
/// The same for meshes refined for light.
const REFINED_TOLERANCE: f64 = 0.1;
/// More elements than this are refused: their matrix could not be stored.
const MOST_ELEMENTS: f64 = 20e6;

/// No edge is halved for the sake of shape below this part of the spacing, where the number of elements is given, ...
const FLOOR: f64 = 0.05;
/// ... and where only a length is.
const FINE_FLOOR: f64 = 1e-3;

/// Adaptive meshes start with about this many elements.
const COARSE: f64 = 80.0;

/// This part of the elements makes a uniform mesh; the others go where light changes.
const UNIFORM: f64 = 0.35;

/// Meshes all layers as the options ask: with `light`, smaller where it changes.
pub fn sized(
    scene: &Scene,
    drawings: &[Drawing],
    light: Option<&Light>,
    options: &Options,
    places: &Places,
    report: &mut Report,
    name: &(impl Fn(u32, Trouble) -> Error + Sync),
) -> Result<Vec<Triangles>> {
    let max_edge = options.max_edge.unwrap_or(f64::INFINITY);
    // A number of elements is a budget: shape yields to it. A length alone is none.
    let floor = if options.elements.is_some() { FLOOR } else { FINE_FLOOR };
    let meets = options.no_clean.leaves(Step::Meet).then_some(places);
    let search = Search { scene, drawings, max_edge, floor, meets, name };
    if let (Some(light), Some(asked)) = (light, options.tolerance) {
        let most = options.elements.map_or(MOST_ELEMENTS, f64::from);
        // Start coarse: what is evenly lit stays so.
        let coarse = (search.area() / (EQUILATERAL * COARSE)).sqrt().min(SPACING_PER_MAX_EDGE * max_edge);
        let mut meshes = search.mesh(coarse)?.0;
        let diagonal = search.diagonal();
        let wish = adaptive::Wish { tolerance: asked, most, linear: options.linear, diagonal };
        adaptive::refine(light, drawings, &mut meshes, wish, report)
            .map_err(|(layer, trouble)| name(drawings[layer].layer().sheets[0].face, trouble))?;
        report.count("planes that do not meet others everywhere", search.meet(&mut meshes));
        return Ok(meshes);
    }
    let Some(wanted) = options.elements.map(f64::from) else {
        return Ok(search.mesh(SPACING_PER_MAX_EDGE * max_edge)?.0);
    };
    if let Some(light) = light {
        let spacing = (search.area() / (EQUILATERAL * wanted)).sqrt();
        let mut meshes = search.counted(UNIFORM * wanted)?;
        if (count(&meshes) as f64) < (1.0 - COUNT_TOLERANCE) * wanted {
            lit::refine(light, drawings, &mut meshes, wanted, spacing, report)
                .map_err(|(layer, trouble)| name(drawings[layer].layer().sheets[0].face, trouble))?;
            report.count("planes that do not meet others everywhere", search.meet(&mut meshes));
            let found = count(&meshes) as f64;
            // Where light changes nowhere, only a uniform mesh can use up the rest.
            if (found / wanted - 1.0).abs() <= REFINED_TOLERANCE {
                return Ok(meshes);
            }
        }
    }
    let meshes = search.counted(wanted)?;
    let found = count(&meshes);
    if found as f64 > 1.15 * wanted {
        report.warn(format!(
            "the faces and lines need at least about {found} elements, more than the {wanted} asked for"
        ));
    }
    Ok(meshes)
}

fn count(meshes: &[Triangles]) -> usize {
    meshes.iter().map(Triangles::count).sum()
}

/// The search for the spacing of a uniform mesh.
struct Search<'a, Name> {
    scene: &'a Scene,
    drawings: &'a [Drawing],
    max_edge: f64,
    floor: f64,
    /// The scene's corners, where planes are to meet.
    meets: Option<&'a Places>,
    name: &'a Name,
}

impl<Name: Fn(u32, Trouble) -> Error + Sync> Search<'_, Name> {
    /// All layers with this spacing, and the number of triangles.
    fn mesh(&self, spacing: f64) -> Result<(Vec<Triangles>, f64)> {
        let expected = self.area() / (EQUILATERAL * spacing * spacing);
        if expected > MOST_ELEMENTS {
            return Err(Error::whole(
                &self.scene.path,
                format!(
                    "about {expected:.1e} elements would be needed, more than {MOST_ELEMENTS:.0e}; raise --max-edge"
                ),
            ));
        }
        let bar = progress("planes", self.drawings.len());
        let mut meshes: Vec<Triangles> = self
            .drawings
            .par_iter()
            .map(|drawing| {
                let mesh = drawing.mesh(spacing, self.max_edge, self.floor);
                bar.inc(1);
                mesh.map_err(|trouble| (self.name)(drawing.layer().sheets[0].face, trouble))
            })
            .collect::<Result<_>>()?;
        self.meet(&mut meshes);
        let count = count(&meshes) as f64;
        Ok((meshes, count))
    }

    /// Makes planes meet; returns how many could not.
    fn meet(&self, meshes: &mut [Triangles]) -> usize {
        self.meets.map_or(0, |places| conform::meet(self.drawings, meshes, places))
    }

    fn diagonal(&self) -> f64 {
        self.drawings.iter().map(|drawing| drawing.layer().frame.size).fold(0.0, f64::max)
    }

    fn area(&self) -> f64 {
        self.drawings.iter().map(|drawing| drawing.area).sum()
    }

    /// Triangles of one spacing, about `wanted`.
    fn counted(&self, wanted: f64) -> Result<Vec<Triangles>> {
        let widest = SPACING_PER_MAX_EDGE * self.max_edge;
        // The count goes with the inverse square of the spacing, apart from what the faces need at least.
        let mut spacing = (self.area() / (EQUILATERAL * wanted)).sqrt().min(widest);
        let (mut meshes, mut count) = self.mesh(spacing)?;
        let mut bracket = (0.0, f64::INFINITY);
        for _ in 0..COUNT_TRIALS {
            let too_many = count > wanted;
            if (count / wanted - 1.0).abs() <= COUNT_TOLERANCE || (!too_many && spacing >= widest) {
                break;
            }
            if too_many {
                bracket.0 = spacing
            } else {
                bracket.1 = spacing
            }
            // Within the bracket where there is one: the count has steps.
            let guess = spacing * (count / wanted).sqrt().clamp(0.25, 4.0);
            let inside = guess > bracket.0 && guess < bracket.1;
            let next = if inside || bracket.1.is_infinite() || bracket.0 == 0.0 {
                guess
            } else {
                (bracket.0 * bracket.1).sqrt()
            };
            let next = next.min(widest);
            let (other, other_count) = self.mesh(next)?;
            let closer = (other_count / wanted).ln().abs() < (count / wanted).ln().abs();
            let stuck = other_count == count && next > spacing;
            spacing = next;
            if closer {
                meshes = other;
            }
            if stuck {
                break;
            }
            count = other_count;
        }
        Ok(meshes)
    }
}
