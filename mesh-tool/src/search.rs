//! The search for the spacing of triangles that gives the asked number of elements.

use crate::grading::{grade, grade_within};
use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use crate::triangulation::Trouble;
use interchange::scene::Scene;
use interchange::tool::progress;
use interchange::{Error, Result};
use rayon::prelude::*;

/// Area of an equilateral triangle of edge 1.
pub const EQUILATERAL: f64 = 0.433_012_701_892_219_3;
/// Spacing wished where no edge may be longer than 1: smoothed lattices stretch single edges by about a fifth.
pub const SPACING_PER_MAX_EDGE: f64 = 0.8;
/// The search for the spacing that gives the asked number of elements ends within this part of it, ...
pub const COUNT_TOLERANCE: f64 = 0.04;
/// ... or after this many trials: the count falls with the square of the spacing, so that two or three are usual.
const COUNT_TRIALS: usize = 8;
/// More elements than this are refused: their matrix could not be stored.
pub const MOST_ELEMENTS: f64 = 20e6;

/// Length below which shape yields.
#[derive(Debug, Clone, Copy)]
pub enum Floor {
    /// Part of the spacing.
    Part(f64),
    /// In units of length.
    Length(f64),
}

/// Number of all triangles that become elements.
pub fn count(meshes: &[Triangles]) -> usize {
    meshes.iter().map(Triangles::count).sum()
}

/// Area of all elements.
pub fn area(drawings: &[Drawing]) -> f64 {
    drawings.iter().map(|drawing| drawing.area).sum()
}

/// Spacing of so many equal triangles on this area.
pub fn spacing(area: f64, count: f64) -> f64 {
    (area / (EQUILATERAL * count)).sqrt()
}

/// The search for the spacing of a uniform mesh.
#[derive(Debug, Clone, Copy)]
pub struct Search<'a, Name> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its layers.
    pub drawings: &'a [Drawing],
    /// No edge may be longer.
    pub max_edge: f64,
    /// No edge is made shorter for the sake of shape.
    pub floor: Floor,
    /// Sizes are graded, halving no edge to less than this, in units of length; `None`: not at all.
    pub graded: Option<f64>,
    /// The scene's corners, where planes are to meet.
    pub meets: Option<&'a Places>,
    /// Names the face of an error.
    pub name: &'a Name,
}

impl<Name: Fn(u32, Trouble) -> Error + Sync> Search<'_, Name> {
    /// All layers with this spacing, and the number of triangles.
    pub fn mesh(&self, spacing: f64) -> Result<(Vec<Triangles>, f64)> {
        let expected = self.area() / (EQUILATERAL * spacing * spacing);
        if expected > MOST_ELEMENTS {
            return Err(Error::whole(
                &self.scene.path,
                format!(
                    "about {expected:.1e} elements would be needed, more than {MOST_ELEMENTS:.0e}; raise --max-edge"
                ),
            ));
        }
        let floor = match self.floor {
            Floor::Part(part) => part,
            Floor::Length(length) => length / spacing,
        };
        let bar = progress("planes", self.drawings.len());
        let mut meshes: Vec<Triangles> = self
            .drawings
            .par_iter()
            .map(|drawing| {
                let mesh = drawing.mesh(spacing, self.max_edge, floor);
                bar.inc(1);
                mesh.map_err(|trouble| (self.name)(drawing.layer().sheets[0].face, trouble))
            })
            .collect::<Result<_>>()?;
        self.settle(&mut meshes)?;
        let count = count(&meshes) as f64;
        Ok((meshes, count))
    }

    /// Grades sizes and makes planes meet; returns how many could not.
    pub fn settle(&self, meshes: &mut [Triangles]) -> Result<usize> {
        grade(self.drawings, meshes, self.graded, self.meets)
            .map_err(|(layer, trouble)| (self.name)(self.drawings[layer].layer().sheets[0].face, trouble))
    }

    /// Grades sizes, if that leaves no more than `most` triangles; says whether all are graded.
    pub fn even_out(&self, meshes: &mut Vec<Triangles>, shortest: f64, most: f64) -> Result<bool> {
        grade_within(self.drawings, meshes, shortest, self.meets, most)
            .map_err(|(layer, trouble)| (self.name)(self.drawings[layer].layer().sheets[0].face, trouble))
    }

    /// Extent of the largest layer.
    pub fn diagonal(&self) -> f64 {
        self.drawings.iter().map(|drawing| drawing.layer().frame.size).fold(0.0, f64::max)
    }

    /// Area of all elements.
    pub fn area(&self) -> f64 {
        area(self.drawings)
    }

    /// Triangles of one spacing, about `wanted`, and the spacing.
    pub fn counted(&self, wanted: f64) -> Result<(Vec<Triangles>, f64)> {
        let widest = SPACING_PER_MAX_EDGE * self.max_edge;
        // The count goes with the inverse square of the spacing, apart from what the faces need at least.
        let mut spacing = spacing(self.area(), wanted).min(widest);
        let (mut meshes, mut count) = self.mesh(spacing)?;
        let mut best = spacing;
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
                (meshes, best) = (other, next);
            }
            if stuck {
                break;
            }
            count = other_count;
        }
        Ok((meshes, best))
    }
}
