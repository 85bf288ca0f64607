//! The shadows of a scene's bodies as one point sees them: each is a cone of half-spaces, found once and asked for any
//! number of clusters and elements.
//!
//! A convex body hides from a point what lies inside the planes through the point and its silhouette edges and behind its
//! front faces. A cluster of elements outside one of these half-spaces is untouched, one inside all of them is hidden, and
//! inside some of them its members need not ask those again: what is left to clip are elements across a silhouette.

use crate::body::Body;
use crate::plane::PLANARITY;
use crate::shadow::HalfSpace;
use glam::DVec3;
use std::ops::Range;

/// A point this close to a face's plane (in units of the body's size) is not in front of it: rounding of its height.
/// Far below the distance that nodes are moved inward from a contact line.
const POINT_ROUNDING: f64 = 1e-13;
/// A face whose normal deviates by less than this from the one the point looks along, or its opposite, may be the one that
/// the point lies on: corners within [`PLANARITY`] of a plane turn it by that over their distances' share of the size.
const PARALLEL: f64 = 1e-6;
/// Half-spaces of one shadow that are told apart; those beyond are asked always.
const TOLD_APART: usize = u64::BITS as usize;

/// What the bodies of a scene hide from a point.
#[derive(Debug, Clone, Default)]
pub struct PointShadows {
    spaces: Vec<HalfSpace>,
    shadows: Vec<Shadow>,
    fronts: Vec<bool>,
}

#[derive(Debug, Clone)]
struct Shadow {
    spaces: Range<usize>,
    /// Size of the body.
    radius: f64,
    /// Cone around the body.
    cone: Cone,
}

/// A cone of directions that holds all of a ball: within an angle, given by its cosine and sine, of `direction`; cut off
/// before and behind the ball.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    direction: DVec3,
    cosine: f64,
    sine: f64,
    nearest: f64,
    farthest: f64,
}

impl Cone {
    /// Cone around a ball whose centre is seen at `to_centre`; all directions where the point is inside.
    pub fn around(to_centre: DVec3, radius: f64) -> Cone {
        let distance = to_centre.length();
        let (nearest, farthest) = (distance - radius, distance + radius);
        if radius >= distance {
            return Cone { direction: DVec3::ZERO, cosine: -1.0, sine: 0.0, nearest, farthest };
        }
        let sine = radius / distance;
        Cone { direction: to_centre / distance, cosine: (1.0 - sine * sine).sqrt(), sine, nearest, farthest }
    }

    /// Whether a part of this cone's ball may lie behind one of the other's.
    fn may_be_behind(&self, other: &Cone) -> bool {
        other.nearest <= self.farthest && other.may_meet(self)
    }

    /// Whether two cones may share a direction: cos of the angle between against cos of the sum of the half angles. A cone
    /// of all directions meets any.
    pub(crate) fn may_meet(&self, other: &Cone) -> bool {
        self.cosine < 0.0
            || other.cosine < 0.0
            || self.direction.dot(other.direction) >= self.cosine * other.cosine - self.sine * other.sine
    }
}

/// A box around a cluster, seen from the point: all points `centre` + sum of t_k `axes`_k, -1 <= t_k <= 1.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// From the point to the middle.
    pub centre: DVec3,
    /// Half the box along each of its axes.
    pub axes: [DVec3; 3],
    /// Half the diagonal.
    pub radius: f64,
}

impl Bounds {
    /// Least and largest of `normal` . r over the box.
    pub fn along(&self, normal: DVec3) -> (f64, f64) {
        let middle = normal.dot(self.centre);
        let reach = self.axes.iter().map(|&axis| normal.dot(axis).abs()).sum::<f64>();
        (middle - reach, middle + reach)
    }
}

/// A shadow that may touch a cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Candidate {
    shadow: u32,
    /// Half-spaces whose border may cross the cluster, one bit each.
    across: u64,
}

/// How a shadow meets a cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meets {
    /// It hides nothing of it.
    Nothing,
    /// It hides all of it.
    Everything,
    /// It may hide a part.
    Part(Candidate),
}

impl PointShadows {
    /// Looks at `bodies` from `point` over a plane with this unit normal; bodies beneath it cast no shadow that matters.
    pub fn look<'b>(&mut self, point: DVec3, normal: DVec3, bodies: impl IntoIterator<Item = &'b Body>) {
        self.spaces.clear();
        self.shadows.clear();
        for body in bodies {
            let height = normal.dot(body.centre - point);
            let reaches_up = height > -body.radius
                && (height >= body.radius
                    || body.corners.iter().any(|&c| normal.dot(c - point) > PLANARITY * body.radius));
            if reaches_up {
                self.add(body, point, normal);
            }
        }
    }

    /// Every shadow.
    pub fn all(&self) -> impl Iterator<Item = Candidate> + use<> {
        (0..self.shadows.len() as u32).map(|shadow| Candidate { shadow, across: u64::MAX })
    }

    fn add(&mut self, body: &Body, point: DVec3, normal: DVec3) {
        let rounding = POINT_ROUNDING * body.radius;
        self.fronts.clear();
        self.fronts.extend(body.faces.iter().map(|face| {
            let height = face.distance(point);
            // Corners of a face lie within its planarity of its plane: a point on such a face may be that far behind it.
            let lies_on_it = height.abs() <= PLANARITY * body.radius
                && face.normal.cross(normal).length_squared() < PARALLEL * PARALLEL;
            match (lies_on_it, body.is_skin, body.is_flat()) {
                (false, _, _) => height > rounding,
                // On the skin of a sealed body it lies outside, wherever it looks.
                (true, true, _) => face.normal.dot(body.faces[0].normal) > 0.0,
                // A flat one is seen edge-on.
                (true, false, true) => false,
                (true, false, false) => face.normal.dot(normal) > 0.0,
            }
        }));
        if !self.fronts.contains(&true) {
            // Inside a solid body, or on its surface and looking in: its faces hide one by one.
            body.parts.iter().for_each(|part| self.add(part, point, normal));
            return;
        }
        let start = self.spaces.len();
        // Front faces first: a cluster nearer than the body fails there at once.
        for (face, _) in body.faces.iter().zip(&self.fronts).filter(|(_, front)| **front) {
            self.spaces.push(HalfSpace { normal: -face.normal, offset: -face.distance(point) });
        }
        for edge in &body.edges {
            let left = self.fronts[edge.left];
            if left != self.fronts[edge.right] {
                let across = (edge.from - point).cross(edge.to - point);
                self.spaces.push(HalfSpace { normal: if left { -across } else { across }, offset: 0.0 });
            }
        }
        let cone = Cone::around(body.centre - point, body.radius);
        self.shadows.push(Shadow { spaces: start..self.spaces.len(), radius: body.radius, cone });
    }

    /// Whether the shadow of a candidate may touch a ball whose cone this is, by balls alone: all that is worth asking for
    /// clusters in several planes, which most shadows touch.
    pub fn may_touch(&self, candidate: Candidate, cone: &Cone) -> bool {
        cone.may_be_behind(&self.shadows[candidate.shadow as usize].cone)
    }

    /// How the shadow of a candidate for a larger cluster meets a box inside that cluster; `cone` is one around the box.
    pub fn narrow(&self, candidate: Candidate, bounds: &Bounds, cone: &Cone) -> Meets {
        let shadow = &self.shadows[candidate.shadow as usize];
        if !cone.may_be_behind(&shadow.cone) {
            return Meets::Nothing;
        }
        let tolerance = PLANARITY * (shadow.radius + bounds.radius);
        let mut across = candidate.across;
        let mut all_inside = true;
        for (bit, space) in self.asked(candidate) {
            let (low, high) = bounds.along(space.normal);
            // Normals are not of length 1: the sum of their coordinates is above it, by sqrt(3) at most.
            let rounding = tolerance * space.normal.abs().element_sum();
            if high + space.offset <= rounding {
                return Meets::Nothing;
            }
            // What touches a front face may lie on it, and then it is not behind it.
            let is_front = space.offset < 0.0;
            if low + space.offset > if is_front { rounding } else { -rounding } {
                across &= !bit;
            } else {
                all_inside = false;
            }
        }
        if all_inside { Meets::Everything } else { Meets::Part(Candidate { across, ..candidate }) }
    }

    /// Whether the shadow of a candidate holds a place, given from the point. A place on a front face lies before it.
    pub fn hides(&self, candidate: Candidate, place: DVec3) -> bool {
        let tolerance = PLANARITY * (self.shadows[candidate.shadow as usize].radius + place.length());
        self.asked(candidate).all(|(_, space)| {
            let rounding = if space.offset < 0.0 { tolerance * space.normal.length() } else { 0.0 };
            space.normal.dot(place) + space.offset > rounding
        })
    }

    /// Writes the half-spaces of a candidate whose borders may cross its cluster.
    pub fn half_spaces(&self, candidate: Candidate, out: &mut Vec<HalfSpace>) {
        out.clear();
        out.extend(self.asked(candidate).map(|(_, space)| *space));
    }

    fn asked(&self, candidate: Candidate) -> impl Iterator<Item = (u64, &HalfSpace)> {
        let spaces = &self.spaces[self.shadows[candidate.shadow as usize].spaces.clone()];
        spaces.iter().enumerate().filter_map(move |(k, space)| {
            let bit = if k < TOLD_APART { 1u64 << k } else { 0 };
            (bit == 0 || candidate.across & bit != 0).then_some((bit, space))
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::body::bodies;
    use crate::occluder::Occluder;

    /// A box from `low` to `high`, faces outward.
    fn cuboid(low: DVec3, high: DVec3) -> Vec<Occluder> {
        let at = |k: usize| {
            let pick = |bit: usize| if k >> bit & 1 == 0 { low[bit] } else { high[bit] };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(|face| Occluder::new(face.map(at).to_vec()).unwrap())
            .to_vec()
    }

    fn at(point: DVec3, place: DVec3, half: f64) -> Bounds {
        let axes = [half * DVec3::X, half * DVec3::Y, half * DVec3::Z];
        Bounds { centre: place - point, axes, radius: half * 3f64.sqrt() }
    }

    #[test]
    fn boxes_are_hidden_untouched_or_across_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let block =
                bodies(&cuboid(scale * DVec3::new(-1.0, -1.0, 1.0), scale * DVec3::new(1.0, 1.0, 2.0)));
            let mut shadows = PointShadows::default();
            shadows.look(DVec3::ZERO, DVec3::Z, &block);
            let candidate = shadows.all().next().unwrap();
            let meets = |x: f64, z: f64, half: f64| {
                let place = scale * DVec3::new(x, 0.0, z);
                let bounds = at(DVec3::ZERO, place, scale * half);
                shadows.narrow(candidate, &bounds, &Cone::around(bounds.centre, bounds.radius))
            };
            assert_eq!(meets(0.0, 4.0, 0.5), Meets::Everything);
            assert_eq!(meets(5.0, 4.0, 0.5), Meets::Nothing);
            assert_eq!(meets(0.0, 0.5, 0.4), Meets::Nothing);
            let Meets::Part(across) = meets(4.0, 4.0, 0.5) else { unreachable!() };
            // One silhouette edge is left to ask.
            let mut spaces = Vec::new();
            shadows.half_spaces(across, &mut spaces);
            assert_eq!(spaces.len(), 1);
            assert!(matches!(meets(0.0, 1.0, 0.5), Meets::Part(_)));
        }
    }

    #[test]
    fn a_body_beneath_or_touched_from_outside_casts_no_shadow_and_from_inside_all_its_faces_do() {
        let block = bodies(&cuboid(DVec3::ZERO, DVec3::ONE));
        let mut shadows = PointShadows::default();
        let mut count = |point: DVec3, normal: DVec3| {
            shadows.look(point, normal, &block);
            shadows.all().count()
        };
        assert_eq!(count(DVec3::new(0.5, 0.5, 1.0), DVec3::Z), 0);
        assert_eq!(count(DVec3::new(0.5, 0.5, 2.0), DVec3::Z), 0);
        assert_eq!(count(DVec3::new(0.5, 0.5, -1.0), DVec3::Z), 1);
        // On its bottom, looking in: the bottom is edge-on.
        assert_eq!(count(DVec3::new(0.5, 0.5, 0.0), DVec3::Z), 5);
    }

    /// A face whose corners are given with nine digits has points that far behind the plane of its body.
    #[test]
    fn a_point_on_a_face_of_few_digits_looks_past_its_own_body() {
        let mut faces = cuboid(DVec3::ZERO, DVec3::ONE);
        let block = bodies(&faces);
        let top = faces.remove(1);
        for normal in [DVec3::Z, DVec3::new(1e-9, 0.0, 1.0).normalize()] {
            let mut shadows = PointShadows::default();
            let point = DVec3::new(0.5, 0.5, 1.0 - 4e-10);
            shadows.look(point, normal, &block);
            let bounds = at(point, DVec3::new(0.5, 0.5, 3.0), 0.5);
            let cone = Cone::around(bounds.centre, bounds.radius);
            let meets = |candidate| shadows.narrow(candidate, &bounds, &cone);
            assert!(shadows.all().all(|candidate| meets(candidate) == Meets::Nothing));
            shadows.look(point, normal, &bodies(std::slice::from_ref(&top)));
            assert_eq!(shadows.all().count(), 0);
        }
    }
}
