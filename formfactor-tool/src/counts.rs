//! How many pairs each class had and what they cost: for the report.

use geometry::occluded::Effort;
use geometry::unoccluded::Rule;
use interchange::report::Report;
use serde::{Deserialize, Serialize};

/// Pairs of elements by class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Of one plane.
    pub same_plane: usize,
    /// Facing away from each other.
    pub behind: usize,
    /// Behind one convex blocker.
    pub covered: usize,
    /// With nothing reaching into the shaft between them.
    pub empty_shaft: usize,
    /// Unoccluded, by rule: one point, few, several, many, contour.
    pub unoccluded: [usize; 5],
    /// Unoccluded, together with all pairs of their clusters.
    pub by_clusters: usize,
    /// Partly occluded.
    pub occluded: usize,
    /// Behind blockers at a loose tolerance: by the views of single points.
    #[serde(default)]
    pub by_points: usize,
    /// Visible parts computed for them.
    pub visible_parts: usize,
    /// Occluded pairs whose evaluations ran out.
    pub exhausted: usize,
    /// Pairs computed from both sides.
    pub computed_twice: usize,
    /// Taken from an older matrix.
    #[serde(default)]
    pub reused: usize,
}

impl Counts {
    /// Adds an unoccluded pair served by this rule.
    pub fn add_unoccluded(&mut self, rule: Rule) {
        match rule {
            Rule::Invisible => self.behind += 1,
            Rule::Centre => self.unoccluded[0] += 1,
            Rule::Low => self.unoccluded[1] += 1,
            Rule::Middle => self.unoccluded[2] += 1,
            Rule::Product => self.unoccluded[3] += 1,
            Rule::Contour => self.unoccluded[4] += 1,
        }
    }

    /// Adds a partly occluded pair.
    pub fn add_occluded(&mut self, effort: Effort) {
        self.occluded += 1;
        self.visible_parts += effort.evaluations;
        self.exhausted += usize::from(effort.exhausted);
    }

    /// Adds what another part counted.
    pub fn add(&mut self, other: &Counts) {
        self.same_plane += other.same_plane;
        self.behind += other.behind;
        self.covered += other.covered;
        self.empty_shaft += other.empty_shaft;
        for (sum, n) in self.unoccluded.iter_mut().zip(other.unoccluded) {
            *sum += n;
        }
        self.by_clusters += other.by_clusters;
        self.occluded += other.occluded;
        self.by_points += other.by_points;
        self.visible_parts += other.visible_parts;
        self.exhausted += other.exhausted;
        self.computed_twice += other.computed_twice;
        self.reused += other.reused;
    }

    /// Writes the counters into a report.
    pub fn note(&self, report: &mut Report) {
        report.count("pairs of one plane (skipped)", self.same_plane);
        report.count("pairs facing away (skipped)", self.behind);
        report.count("pairs fully blocked (skipped)", self.covered);
        report.count("pairs with an empty shaft (visibility skipped)", self.empty_shaft);
        let rules = ["one point", "few points", "several points", "many points", "contour"];
        for (name, number) in rules.iter().zip(self.unoccluded) {
            report.count(&format!("pairs unoccluded, {name}"), number);
        }
        report.count("pairs unoccluded, by whole clusters", self.by_clusters);
        report.count("pairs partly occluded", self.occluded);
        report.count("pairs past blockers, by points of both sides", self.by_points);
        report.count("pairs partly occluded, out of evaluations", self.exhausted);
        report.count("pairs reused", self.reused);
        report.count("pairs computed from both sides", self.computed_twice);
        report.count("visible parts computed", self.visible_parts);
    }
}
