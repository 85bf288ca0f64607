//! Direct and indirect light over the facets of a picture, each refined for itself.

use crate::judge::{Goal, Proof, Scheme};
use crate::light::{Irradiance, Part};
use crate::nodes::NodeRadiosity;
use crate::refined::{Found, RefinedFacets};
use crate::visible::VisibleSurface;
use glam::DVec2;
use interchange::ids::ElementId;
use interchange::report::Report;
use interchange::tool::progress;
use std::collections::HashMap;

/// Facets of the size of a pixel are not asked for shadows of lamps.
const DIRECT_PIXELS: f64 = 1.0;
/// Indirect light changes over the size of things and their distances. How long a facet may be in pixels that is not asked
/// for it, over the tolerance: 2 at 0.04. Measured in a furnished room, where 1 instead costs half as many points again for a
/// tenth of the error.
const INDIRECT_PIXELS: f64 = 50.0;
/// The same at any tolerance: what is longer is seen as a surface of its own.
const MOST_PIXELS: f64 = 8.0;
/// How far the middle of an edge may lie from the line between its ends, in tolerances, when a parabola goes through all
/// three. A smooth field's third derivative decides what the parabola is off by; measured in a furnished room at 0.04, 1 and
/// 2 give the same error to 3 %, 3 one that is larger by a quarter.
const TRUST: f64 = 2.0;

/// Both parts.
#[derive(Debug)]
pub struct RefinedParts {
    direct: RefinedFacets,
    indirect: RefinedFacets,
}

impl RefinedParts {
    /// Refines both for facets with the pixels they cover, whose nodes are gathered.
    pub fn new(
        nodes: &NodeRadiosity<'_>,
        surface: &VisibleSurface,
        facets: &[(ElementId, f64)],
        (scheme, tolerance): (Scheme, f64),
        report: &mut Report,
    ) -> RefinedParts {
        // Each is judged as a part of the whole. Direct light comes first, with the mean of the indirect over the facet.
        let mean = |&(element, _): &(ElementId, f64)| {
            let corners = nodes.ends(element)?.corners;
            let both = corners.iter().flat_map(|corner| [corner.before, corner.after]);
            let indirect = both.map(|parts| Part::Indirect.of(&parts));
            let sum = indirect.fold([0.0; 3], |sum, h| std::array::from_fn(|c| sum[c] + h[c] / 6.0));
            Some((element, sum))
        };
        let means: HashMap<ElementId, Irradiance> = facets.iter().filter_map(mean).collect();
        let other = |element, _: DVec2| means.get(&element).copied().unwrap_or_default();
        let goal =
            Goal { part: Part::Direct, scheme, proof: Proof::Quarters, tolerance, pixels: DIRECT_PIXELS };
        let direct = report.phase("direct light in between", || {
            let bar = progress("direct light in between", 0);
            RefinedFacets::new(nodes, surface, facets, goal, &other, &bar)
        });
        let other = |element, place: DVec2| {
            direct.at(element, place, &mut Vec::new()).map_or([0.0; 3], |found| found.irradiance)
        };
        let goal = Goal {
            part: Part::Indirect,
            proof: Proof::Middle,
            tolerance: TRUST * tolerance,
            pixels: (INDIRECT_PIXELS * tolerance).clamp(DIRECT_PIXELS, MOST_PIXELS),
            ..goal
        };
        let indirect = report.phase("indirect light in between", || {
            let bar = progress("indirect light in between", 0);
            RefinedFacets::new(nodes, surface, facets, goal, &other, &bar)
        });
        RefinedParts { direct, indirect }
    }

    /// What a facet gives at a place, direct and indirect; `None` for facets that are no triangles.
    pub fn at(&self, element: ElementId, place: DVec2, weights: &mut Vec<f64>) -> Option<[Found; 2]> {
        Some([self.direct.at(element, place, weights)?, self.indirect.at(element, place, weights)?])
    }

    /// Tells what was done.
    pub fn count(&self, report: &mut Report) {
        for (name, facets) in [("direct", &self.direct), ("indirect", &self.indirect)] {
            report.count(&format!("{name}_points_in_between"), facets.gathered);
            report.count(&format!("{name}_facets_cut"), facets.cut);
            report.count(&format!("{name}_facets_unresolved"), facets.unresolved);
            report.count(&format!("{name}_facets_small_skipped"), facets.small);
        }
    }
}
