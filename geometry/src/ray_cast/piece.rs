//! Ray against convex polygon, watertight (Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection").
//!
//! Corners are moved to the ray's origin and sheared so that the ray is the z axis; the polygon is met where the origin
//! of the xy plane lies within its projection. The edge function a.x b.y - a.y b.x of an edge is the exact negative of
//! the one that the neighbour computes, and rounding is monotonic, so its sign is right or zero; zero counts as
//! inside for both. So no ray passes between neighbours, whatever the rounding of the corners themselves.

use glam::{DVec2, DVec3};

/// A ray, with the frame in which it is the z axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    origin: DVec3,
    /// Coordinates that serve as x, y and z: z is the direction's largest, x and y keep the frame right-handed.
    axes: [usize; 3],
    /// Shear in x and y per length of z, and scale of z to lengths of the direction.
    shear: DVec3,
}

impl Ray {
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Ray {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            (x, y) = (y, x);
        }
        let shear = DVec3::new(direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]);
        Ray { origin, axes: [x, y, z], shear }
    }

    /// A corner in the ray's frame: its place beside the ray, and along it in lengths of the direction.
    fn frame(&self, corner: DVec3) -> (DVec2, f64) {
        let [x, y, z] = self.axes;
        let v = corner - self.origin;
        (DVec2::new(v[x] - self.shear.x * v[z], v[y] - self.shear.y * v[z]), self.shear.z * v[z])
    }

    /// Place along the ray, in lengths of its direction (of either sign), where it meets the polygon, and whether it meets
    /// the front. The polygon is taken as a fan from its first corner: the diagonals are shared edges too, so
    /// corners on a straight line, or bent inwards by rounding, open no gap.
    pub(super) fn meets(&self, corners: &[DVec3]) -> Option<(f64, bool)> {
        let (&first, rest) = corners.split_first()?;
        let (first, first_along) = self.frame(first);
        let mut rest = rest.iter();
        let (mut a, mut a_along) = self.frame(*rest.next()?);
        let mut opposite_b = first.perp_dot(a);
        for &corner in rest {
            let (b, b_along) = self.frame(corner);
            // Twice the areas of origin and one edge each: the weights of the corners opposite.
            let opposite_first = a.perp_dot(b);
            let diagonal = first.perp_dot(b);
            let opposite_a = -diagonal;
            let lowest = opposite_first.min(opposite_a).min(opposite_b);
            let highest = opposite_first.max(opposite_a).max(opposite_b);
            let sum = opposite_first + opposite_a + opposite_b;
            if (lowest >= 0.0 || highest <= 0.0) && sum != 0.0 {
                let along = opposite_first * first_along + opposite_a * a_along + opposite_b * b_along;
                return Some((along / sum, sum < 0.0));
            }
            (a, a_along, opposite_b) = (b, b_along, diagonal);
        }
        None
    }
}
