//! Convex polygons that block light from both sides, and the two proofs that spare visibility work: a blocker that
//! cannot reach into a shaft, and one that covers it.

use crate::plane::Plane;
use crate::polygon;
use glam::DVec3;

/// A convex blocking polygon.
#[derive(Debug, Clone)]
pub struct Occluder {
    /// Corners, in order.
    pub corners: Vec<DVec3>,
    /// Plane.
    pub plane: Plane,
    /// Mean of the corners.
    pub centre: DVec3,
    /// Largest distance of a corner from the centre.
    pub radius: f64,
}

impl Occluder {
    /// Prepares a convex polygon; `None` where its area is zero to rounding, for then it blocks nothing.
    pub fn new(corners: Vec<DVec3>) -> Option<Occluder> {
        let plane = Plane::of_polygon(&corners)?;
        let centre = polygon::mean_corner(&corners);
        let radius = corners.iter().map(|&c| (c - centre).length()).fold(0.0, f64::max);
        Some(Occluder { corners, plane, centre, radius })
    }

    /// Whether every segment from `p` to `q` (convex point sets) crosses this polygon: then nothing is seen.
    ///
    /// Where `p` lies strictly on one side and `q` on the other, the crossing of any segment is a convex combination
    /// of the crossings of the segments between corners; all of those inside a convex polygon prove all the others.
    pub fn covers(&self, p: &[DVec3], q: &[DVec3]) -> bool {
        let heights = |points: &[DVec3]| {
            let range = (f64::INFINITY, f64::NEG_INFINITY);
            points
                .iter()
                .map(|&x| self.plane.distance(x))
                .fold(range, |(low, high), h| (low.min(h), high.max(h)))
        };
        let ((low_p, high_p), (low_q, high_q)) = (heights(p), heights(q));
        let apart = (low_p > 0.0 && high_q < 0.0) || (high_p < 0.0 && low_q > 0.0);
        apart
            && p.iter().all(|&a| {
                let height_a = self.plane.distance(a);
                q.iter().all(|&b| {
                    let height_b = self.plane.distance(b);
                    self.contains(a + (b - a) * (height_a / (height_a - height_b)))
                })
            })
    }

    /// Whether a point of the plane lies inside or on the border.
    fn contains(&self, point: DVec3) -> bool {
        polygon::edges(&self.corners).all(|(a, b)| (b - a).cross(point - a).dot(self.plane.normal) >= 0.0)
    }
}

/// Directions tried before a pair of bodies counts as not separable; most pairs need two to six.
const SEPARATION_STEPS: usize = 32;
/// Overlap up to this part of the bodies' size is touching: far above rounding, far below what moves a factor.
const TOUCHING: f64 = 1e-12;

/// Whether a plane separates the convex hulls of `body` and `other`, touching allowed. `true` is a proof, `false` is not.
///
/// The algorithm of Gilbert, Johnson & Keerthi (88): a simplex of extreme points of the Minkowski difference closes in
/// on the origin; a direction in which all points of the difference lie on one side is the proof.
pub fn separated(body: &[DVec3], other: &[DVec3]) -> bool {
    let (Some(&first), Some(&second)) = (body.first(), other.first()) else { return true };
    let extreme = |direction: DVec3| {
        let least = |points: &[DVec3], direction: DVec3| {
            let (mut best, mut height) = (points[0], direction.dot(points[0]));
            for &point in &points[1..] {
                let h = direction.dot(point);
                if h < height {
                    (best, height) = (point, h);
                }
            }
            best
        };
        least(body, direction) - least(other, -direction)
    };
    let mut nearest = polygon::mean_corner(body) - polygon::mean_corner(other);
    let size = (first - second).length() + nearest.length();
    if nearest == DVec3::ZERO {
        nearest = first - second;
    }
    let mut simplex: Vec<DVec3> = Vec::with_capacity(4);
    for _ in 0..SEPARATION_STEPS {
        let point = extreme(nearest);
        if nearest.dot(point) >= -TOUCHING * size * nearest.length() {
            return true;
        }
        if simplex.contains(&point) {
            return false;
        }
        simplex.push(point);
        nearest = reduce_to_nearest(&mut simplex);
        if nearest.length() <= TOUCHING * size {
            return false;
        }
    }
    false
}

/// The point of a simplex nearest to the origin; the simplex is reduced to the corners that hold it.
fn reduce_to_nearest(simplex: &mut Vec<DVec3>) -> DVec3 {
    match simplex[..] {
        [a] => a,
        [a, b] => {
            let (nearest, keep) = nearest_on_triangle(a, b, b);
            *simplex = if keep.len() == 2 { vec![a, b] } else { vec![nearest] };
            nearest
        }
        [a, b, c] => {
            let (nearest, keep) = nearest_on_triangle(a, b, c);
            *simplex = keep.iter().map(|&k| [a, b, c][k]).collect();
            nearest
        }
        [a, b, c, d] => {
            // The origin is outside a side's plane (or the tetrahedron is flat): the nearest side decides.
            let mut best: Option<(DVec3, Vec<DVec3>)> = None;
            for (side, opposite) in [([a, b, c], d), ([a, b, d], c), ([a, c, d], b), ([b, c, d], a)] {
                let normal = (side[1] - side[0]).cross(side[2] - side[0]);
                if normal.dot(side[0]) * normal.dot(side[0] - opposite) > 0.0 {
                    continue;
                }
                let (nearest, keep) = nearest_on_triangle(side[0], side[1], side[2]);
                if best.as_ref().is_none_or(|(n, _)| nearest.length_squared() < n.length_squared()) {
                    best = Some((nearest, keep.iter().map(|&k| side[k]).collect()));
                }
            }
            let (nearest, kept) = best.unwrap_or((DVec3::ZERO, simplex.clone()));
            *simplex = kept;
            nearest
        }
        _ => DVec3::ZERO,
    }
}

/// The point of triangle abc nearest to the origin and the corners that hold it, by the regions of its corners and edges.
fn nearest_on_triangle(a: DVec3, b: DVec3, c: DVec3) -> (DVec3, Vec<usize>) {
    let on_edge = |p: DVec3, q: DVec3, i: usize, j: usize| {
        let along = q - p;
        let share = -p.dot(along) / along.length_squared();
        if share <= 0.0 || along == DVec3::ZERO {
            (p, vec![i])
        } else if share >= 1.0 {
            (q, vec![j])
        } else {
            (p + share * along, vec![i, j])
        }
    };
    let normal = (b - a).cross(c - a);
    let inside = normal != DVec3::ZERO
        && [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| (q - p).cross(-p).dot(normal) >= 0.0);
    if inside {
        return (normal * (normal.dot(a) / normal.length_squared()), vec![0, 1, 2]);
    }
    let edges = [on_edge(a, b, 0, 1), on_edge(b, c, 1, 2), on_edge(c, a, 2, 0)];
    let nearest = edges.into_iter().min_by(|x, y| x.0.length_squared().total_cmp(&y.0.length_squared()));
    nearest.unwrap_or((a, vec![0]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn square(half: f64, z: f64) -> Vec<DVec3> {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| DVec3::new(x, y, z))
            .to_vec()
    }

    #[test]
    fn a_larger_plate_between_covers_and_a_smaller_does_not() {
        let (p, q) = (square(1.0, 0.0), square(1.0, 2.0));
        assert!(Occluder::new(square(1.0, 1.0)).unwrap().covers(&p, &q));
        assert!(!Occluder::new(square(0.9, 1.0)).unwrap().covers(&p, &q));
        assert!(!Occluder::new(square(3.0, 3.0)).unwrap().covers(&p, &q));
        assert!(!Occluder::new(square(3.0, 0.0)).unwrap().covers(&p, &q));
    }

    #[test]
    fn bodies_apart_are_separated_and_overlapping_ones_never() {
        let shaft: Vec<DVec3> = square(1.0, 0.0).into_iter().chain(square(1.0, 2.0)).collect();
        for scale in [1e-6, 1.0, 1e6] {
            let scaled = |points: &[DVec3]| points.iter().map(|&p| p * scale).collect::<Vec<_>>();
            let at = |x: f64| {
                scaled(&square(0.5, 1.0).iter().map(|&p| p + DVec3::new(x, 0.3, 0.0)).collect::<Vec<_>>())
            };
            assert!(separated(&scaled(&shaft), &at(1.6)));
            assert!(separated(&scaled(&shaft), &at(-1.51)));
            assert!(!separated(&scaled(&shaft), &at(1.4)));
            assert!(!separated(&scaled(&shaft), &at(0.0)));
        }
    }
}
