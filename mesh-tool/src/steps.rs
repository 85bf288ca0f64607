//! Names of what `--no-clean` and `--no-skip` switch off.

use clap::ValueEnum;

/// A step of cleaning (Baum, Mann, Smith & Winget 1991). Each counts what it repaired in the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Step {
    /// Corners that lie within 1e-9 of the scene's diagonal of each other become one
    Weld,
    /// Faces without area are dropped; switched off, they are refused
    ZeroArea,
    /// Faces given twice the same way round are dropped
    Duplicates,
    /// Faces that contradict their neighbours are turned over
    Orient,
    /// Where coplanar faces look the same way and overlap, one holds the place: an emitter, else the first given
    Overlap,
    /// Faces are cut along the lines where other faces pass through them
    Cross,
    /// Elements of different faces meet edge to edge: no vertex lies inside an edge of another element
    Meet,
    /// Parts that lie inside or under closed bodies get no element (only where meshed)
    Hidden,
    /// Coplanar neighbours of one material and group are meshed as one region (only where meshed)
    Regions,
}

/// Work on discontinuity lines that is left undone where it cannot matter, or not as much as other work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Skip {
    /// No lines of an emitter on a receiver with nothing between them
    Shaft,
    /// No lines of an emitter that gives a receiver less than a thousandth of its direct light
    Weak,
    /// No wedges through edges and corners that are no silhouette seen from the emitter
    Silhouette,
    /// Lines of one emitter that lie on one line are merged
    Merge,
    /// No lines of a higher order than the elements can use
    Order,
    /// Of more lines than the asked number of elements can follow, only the strongest
    Budget,
    /// Lines that pass each other or a border more closely than elements can follow are led through what is there
    Near,
    /// Neighbours may differ in size by more than a factor two where a number of elements is asked for and that would take more
    Grading,
}

/// A set of names that were switched off.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Off<T>(Vec<T>);

impl<T> Default for Off<T> {
    fn default() -> Self {
        Off(Vec::new())
    }
}

impl<T: ValueEnum + Ord + Copy> Off<T> {
    /// From the values of a flag, in any order, with repeats.
    pub fn new(mut names: Vec<T>) -> Self {
        names.sort_unstable();
        names.dedup();
        Off(names)
    }

    /// Whether `name` is still to be done.
    pub fn leaves(&self, name: T) -> bool {
        !self.0.contains(&name)
    }

    /// As flags for reports and provenance, in fixed order.
    pub fn flags(&self, flag: &'static str) -> impl Iterator<Item = String> + '_ {
        let value = |name: &T| name.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
        self.0.iter().map(move |name| format!("{flag} {}", value(name)))
    }
}
