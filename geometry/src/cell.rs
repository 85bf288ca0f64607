//! A part of a receiver over which what it sees is integrated, in the order of need for more work.

use std::ops::Range;

/// A convex part of the receiver with its integral.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cell {
    /// Its corners, among those of all cells.
    pub corners: Range<usize>,
    /// The shadows that matter to it.
    pub shadows: Range<usize>,
    /// Its part of the exchange factor.
    pub value: f64,
    /// Estimated error of that.
    pub error: f64,
    /// Where the error must hold by itself: the error without the credit that holds on average only.
    pub doubt: f64,
    /// Rule applied, as a place in the list of rules.
    pub order: usize,
    /// Whether shadow planes may still cross it.
    pub crossed: bool,
    /// Distance of the value from the one by the order before.
    pub distance: f64,
    /// Whether higher orders do not help: there is a bend or a singularity inside or at the border.
    pub is_rough: bool,
    /// Its area.
    pub area: f64,
    /// Its part in what has to fall: the larger of its shares in the sums of errors and of squared doubts.
    pub urgency: f64,
    /// Order of creation: makes the queue's order unique.
    pub serial: usize,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.urgency.total_cmp(&other.urgency).then(other.serial.cmp(&self.serial))
    }
}
