//! Places: points that lie closer together than the weld tolerance are one place, found through a hash grid.

use geometry::polygon;
use glam::DVec3;
use std::collections::HashMap;

/// Points within this part of the scene's diagonal of each other are one place: far below anything a scene means,
/// far above what modelling programs leave by rounding (1e-16 in f64; files of 7 digits repeat equal corners exactly).
pub const WELD: f64 = 1e-9;

/// The length below which two points of a scene with these vertices are the same place.
pub fn weld_tolerance(vertices: &[DVec3]) -> f64 {
    WELD * polygon::diameter(vertices)
}

/// Points in order of first appearance, each at least the tolerance away from all before it.
#[derive(Debug, Clone)]
pub struct Places {
    positions: Vec<DVec3>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    origin: DVec3,
    tolerance: f64,
    cell: f64,
}

impl Places {
    /// No places yet; cells are counted from `origin`, which should lie near the points. `tolerance` > 0.
    pub fn new(origin: DVec3, tolerance: f64) -> Self {
        debug_assert!(tolerance > 0.0, "tolerance {tolerance}");
        // A cell of four tolerances: the ball around a point touches at most eight cells, mostly one.
        Self { positions: Vec::new(), cells: HashMap::new(), origin, tolerance, cell: 4.0 * tolerance }
    }

    /// Index of the nearest place within the tolerance, or of a new one.
    pub fn insert(&mut self, position: DVec3) -> u32 {
        let [low, high] = [-self.tolerance, self.tolerance].map(|d| self.cell_of(position + DVec3::splat(d)));
        let mut nearest = (self.tolerance, None);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    for &place in self.cells.get(&[x, y, z]).map_or(&[][..], Vec::as_slice) {
                        let distance = self.positions[place as usize].distance(position);
                        if distance <= nearest.0 {
                            nearest = (distance, Some(place));
                        }
                    }
                }
            }
        }
        nearest.1.unwrap_or_else(|| self.append(position))
    }

    /// A place of its own for a point that may lie on others.
    pub fn append(&mut self, position: DVec3) -> u32 {
        let place = self.positions.len() as u32;
        self.positions.push(position);
        self.cells.entry(self.cell_of(position)).or_default().push(place);
        place
    }

    /// Position of a place.
    pub fn position(&self, place: u32) -> DVec3 {
        self.positions[place as usize]
    }

    /// Positions of some places.
    pub fn corners(&self, places: &[u32]) -> Vec<DVec3> {
        places.iter().map(|&place| self.position(place)).collect()
    }

    /// All positions, in order.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The distance up to which points are one place.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    fn cell_of(&self, position: DVec3) -> [i64; 3] {
        ((position - self.origin) / self.cell).to_array().map(|x| x.floor() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_within_the_tolerance_are_one_place_across_cell_borders() {
        let mut places = Places::new(DVec3::ZERO, 1e-3);
        for x in [0.0, 4e-3, 8e-3, -4e-3] {
            let place = places.insert(DVec3::new(x, 0.0, 0.0));
            assert_eq!(places.insert(DVec3::new(x + 0.9e-3, 0.0, 0.0)), place);
            assert_eq!(places.insert(DVec3::new(x - 0.9e-3, 0.0, 0.0)), place);
            assert_eq!(places.insert(DVec3::new(x, 0.9e-3, 0.0)), place);
        }
        assert_eq!(places.positions().len(), 4);
    }
}
