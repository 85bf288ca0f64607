//! How many pairs each class had and what they cost: for the report.

use geometry::pair::Class;
use geometry::unoccluded::Rule;
use interchange::report::Report;

/// Pairs of elements by class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Of one plane.
    pub same_plane: usize,
    /// Facing away from each other.
    pub behind: usize,
    /// Behind one convex blocker.
    pub covered: usize,
    /// Unoccluded, by rule: one point, few, several, many, contour.
    pub unoccluded: [usize; 5],
    /// Partly occluded.
    pub occluded: usize,
    /// Visible parts computed for them.
    pub visible_parts: usize,
    /// Occluded pairs whose evaluations ran out.
    pub exhausted: usize,
}

impl Counts {
    /// Adds a pair of this class.
    pub fn add_class(&mut self, class: Class) {
        match class {
            Class::Invisible => self.behind += 1,
            Class::FullyBlocked => self.covered += 1,
            Class::Unoccluded(rule) => match rule {
                Rule::Invisible => self.behind += 1,
                Rule::Centre => self.unoccluded[0] += 1,
                Rule::Low => self.unoccluded[1] += 1,
                Rule::Middle => self.unoccluded[2] += 1,
                Rule::Product => self.unoccluded[3] += 1,
                Rule::Contour => self.unoccluded[4] += 1,
            },
            Class::Occluded(effort) => {
                self.occluded += 1;
                self.visible_parts += effort.evaluations;
                self.exhausted += usize::from(effort.exhausted);
            }
        }
    }

    /// Adds what another part counted.
    pub fn add(&mut self, other: &Counts) {
        self.same_plane += other.same_plane;
        self.behind += other.behind;
        self.covered += other.covered;
        for (sum, n) in self.unoccluded.iter_mut().zip(other.unoccluded) {
            *sum += n;
        }
        self.occluded += other.occluded;
        self.visible_parts += other.visible_parts;
        self.exhausted += other.exhausted;
    }

    /// Writes the counters into a report.
    pub fn note(&self, report: &mut Report) {
        report.count("pairs of one plane (skipped)", self.same_plane);
        report.count("pairs facing away (skipped)", self.behind);
        report.count("pairs fully blocked (skipped)", self.covered);
        let rules = ["one point", "few points", "several points", "many points", "contour"];
        for (name, number) in rules.iter().zip(self.unoccluded) {
            report.count(&format!("pairs unoccluded, {name}"), number);
        }
        report.count("pairs partly occluded", self.occluded);
        report.count("pairs partly occluded, out of evaluations", self.exhausted);
        report.count("visible parts computed", self.visible_parts);
    }
}
