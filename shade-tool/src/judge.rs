//! Whether interpolation is good enough at a place: what is gathered there against what is interpolated, as a part of the
//! radiosity that both parts of the light make together.

use crate::light::{Irradiance, Part};
use crate::nodes::NodeRadiosity;
use crate::piece::Piece;
use crate::receiver::Receiver;
use glam::DVec2;
use interchange::ids::ElementId;
use interchange::tool::ProgressBar;

/// How irradiance is interpolated over a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Between the corners.
    Linear,
    /// Between the corners and the middles of the edges.
    Quadratic,
    /// Quadratic where that is good, gathered at the sample where not.
    Gather,
}

/// What shows that an edge is served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// Its middle lies close to the line between its ends.
    Middle,
    /// Its quarters lie close to the parabola through its middle.
    Quarters,
}

/// What is asked of the facets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Light that is interpolated.
    pub part: Part,
    /// Interpolation.
    pub scheme: Scheme,
    /// What is asked of edges that are interpolated by parabolas; lines are judged by their middle.
    pub proof: Proof,
    /// Largest deviation as part of the radiosity.
    pub tolerance: f64,
    /// Triangles that are not longer than so many pixels are not asked.
    pub pixels: f64,
}

/// The other part of the irradiance, at a place of a facet.
pub type Other<'a> = &'a (dyn Fn(ElementId, DVec2) -> Irradiance + Sync);

/// Gathers at points of pieces, and judges what is found.
pub(crate) struct Judge<'a> {
    /// Light and materials.
    pub nodes: &'a NodeRadiosity<'a>,
    /// What is asked.
    pub goal: Goal,
    /// What makes up the whole.
    pub other: Other<'a>,
    /// Deviations of what is darker count relative to this.
    pub dark: f64,
    /// Grows by the points that are asked, and moves on with each.
    pub bar: &'a ProgressBar,
}

impl Judge<'_> {
    /// At places of pieces that reflect.
    pub fn gathered<'p>(&self, places: impl Iterator<Item = (&'p Piece, [f64; 3])>) -> Vec<Irradiance> {
        let receivers: Vec<Receiver> = places.map(|(piece, weights)| piece.receiver(&weights)).collect();
        self.bar.inc_length(receivers.len() as u64);
        self.nodes.light().part_at(self.goal.part, &receivers, || self.bar.inc(1))
    }

    /// Deviation of radiosity, largest channel, and whether it is above the tolerance.
    pub fn deviation(
        &self,
        piece: &Piece,
        weights: &[f64; 3],
        found: &Irradiance,
        interpolated: &Irradiance,
    ) -> (f64, bool) {
        let other = (self.other)(piece.element, piece.place(weights));
        let all = std::array::from_fn(|c| found[c] + other[c]);
        let radiosity = self.nodes.radiosity(piece.element, &all);
        let rho = self.nodes.reflectance(piece.element);
        let deviations: Irradiance = std::array::from_fn(|c| rho[c] * (found[c] - interpolated[c]).abs());
        let flagged = (0..3).any(|c| deviations[c] > self.goal.tolerance * radiosity[c].max(self.dark));
        (deviations.into_iter().fold(0.0, f64::max), flagged)
    }

    /// Whether edges are asked at their quarters.
    pub fn asks_quarters(&self) -> bool {
        self.goal.scheme != Scheme::Linear && self.goal.proof == Proof::Quarters
    }
}
