//! What is left of a convex polygon around another that lies in it: View3D's base surfaces around their subsurfaces.

use glam::DVec3;

/// Corners closer to a line than this, in units of the polygon's size, lie on it: subsurfaces share edges with their bases,
/// and coordinates have some ten digits.
const ON_LINE: f64 = 1e-9;
/// How far a subsurface may be off its base's plane, in units of its size; View3D itself takes so much.
const IN_PLANE: f64 = 1e-5;
/// Cosine of the angle between normals that count as parallel, as in View3D.
const PARALLEL: f64 = 0.999;
/// Part of its base's area by which a subsurface may stick out of it: more than rounding leaves of shared edges.
const STICKS_OUT: f64 = 1e-6;

/// A polygon's corners.
pub(super) type Ring = Vec<DVec3>;

/// Normal whose length is the area.
pub(super) fn area_vector(ring: &[DVec3]) -> DVec3 {
    let fan = ring.windows(2).skip(1).map(|pair| (pair[0] - ring[0]).cross(pair[1] - ring[0]));
    0.5 * fan.sum::<DVec3>()
}

/// Largest distance of a corner from the first: the polygon's size.
pub(super) fn size(ring: &[DVec3]) -> f64 {
    ring.iter().map(|corner| corner.distance(ring[0])).fold(0.0, f64::max)
}

/// What is wrong with a subsurface that faces as its base does; nothing where it is one.
pub(super) fn fault(base: &[DVec3], sub: &[DVec3]) -> Option<&'static str> {
    let normal = area_vector(base).normalize_or_zero();
    let off_plane = |corner: &DVec3| (*corner - base[0]).dot(normal).abs() > IN_PLANE * size(sub);
    if sub.iter().any(off_plane) {
        return Some("does not lie in the plane of");
    }
    (area_vector(sub).normalize_or_zero().dot(normal) < PARALLEL)
        .then_some("does not face as it must towards")
}

/// A base in pieces, of which some lie in a subsurface.
#[derive(Debug, Default)]
pub(super) struct Cut {
    /// Pieces around it.
    pub(super) around: Vec<Ring>,
    /// Pieces under it.
    pub(super) under: Vec<Ring>,
}

impl Cut {
    /// Cuts the pieces of a base around a subsurface; nothing where it sticks out of them.
    pub(super) fn new(pieces: &[Ring], sub: &[DVec3]) -> Option<Self> {
        let mut cut = Self::default();
        for piece in pieces {
            cut.piece(piece, sub);
        }
        let area = |rings: &[Ring]| rings.iter().map(|ring| area_vector(ring).length()).sum::<f64>();
        let outside = area_vector(sub).length() - area(&cut.under);
        (outside <= STICKS_OUT * area(pieces)).then_some(cut)
    }

    fn piece(&mut self, piece: &Ring, sub: &[DVec3]) {
        // Each edge of the subsurface cuts off what lies beyond it; what is left in the end lies under it.
        let (mut rest, mut beyond) = (piece.clone(), Vec::new());
        for k in 0..sub.len() {
            let (inside, outside) = split(&rest, sub[k], sub[(k + 1) % sub.len()], area_vector(sub));
            beyond.extend(outside);
            match inside {
                Some(inside) => rest = inside,
                // They do not meet.
                None => return self.around.push(piece.clone()),
            }
        }
        self.around.extend(beyond);
        self.under.push(rest);
    }
}

/// The parts of a convex polygon to the left and to the right of the line from `a` to `b`, seen against `normal`.
fn split(ring: &[DVec3], a: DVec3, b: DVec3, normal: DVec3) -> (Option<Ring>, Option<Ring>) {
    let left = normal.cross(b - a).normalize_or_zero();
    let tolerance = ON_LINE * size(ring);
    let distance = |corner: DVec3| {
        let distance = (corner - a).dot(left);
        if distance.abs() <= tolerance { 0.0 } else { distance }
    };
    let (mut inside, mut outside) = (Ring::new(), Ring::new());
    for (k, &corner) in ring.iter().enumerate() {
        let next = ring[(k + 1) % ring.len()];
        let (here, there) = (distance(corner), distance(next));
        if here >= 0.0 {
            inside.push(corner);
        }
        if here <= 0.0 {
            outside.push(corner);
        }
        if here * there < 0.0 {
            let crossing = corner + (next - corner) * (here / (here - there));
            inside.push(crossing);
            outside.push(crossing);
        }
    }
    let any = |ring: Ring, sign: f64| ring.iter().any(|c| sign * distance(*c) > 0.0).then_some(ring);
    (any(inside, 1.0), any(outside, -1.0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn rectangle(x: [f64; 2], y: [f64; 2]) -> Ring {
        [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])].map(|(x, y)| DVec3::new(x, y, 2.0)).to_vec()
    }

    fn area(rings: &[Ring]) -> f64 {
        rings.iter().map(|ring| area_vector(ring).z).sum()
    }

    #[test]
    fn a_wall_goes_around_its_window_and_its_door() {
        let wall = rectangle([0.0, 6.0], [0.0, 3.0]);
        let cut = Cut::new(&[wall], &rectangle([3.0, 5.0], [1.0, 2.0])).unwrap();
        assert_eq!((cut.around.len(), cut.under.len()), (4, 1));
        assert!((area(&cut.around) - 16.0).abs() < 1e-14 && (area(&cut.under) - 2.0).abs() < 1e-14);
        // The door touches the wall's border, and lies in several of the pieces.
        let again = Cut::new(&cut.around, &rectangle([1.0, 4.0], [0.0, 0.5])).unwrap();
        assert!((area(&again.around) - 14.5).abs() < 1e-14 && (area(&again.under) - 1.5).abs() < 1e-14);
    }

    #[test]
    fn triangles_cut_too_and_the_whole_may_be_covered() {
        let triangle = vec![DVec3::new(1.0, 1.0, 2.0), DVec3::new(3.0, 1.0, 2.0), DVec3::new(2.0, 2.0, 2.0)];
        let cut = Cut::new(&[rectangle([0.0, 6.0], [0.0, 3.0])], &triangle).unwrap();
        assert!((area(&cut.around) - 17.0).abs() < 1e-14 && (area(&cut.under) - 1.0).abs() < 1e-14);
        let whole = Cut::new(std::slice::from_ref(&triangle), &triangle).unwrap();
        assert_eq!((whole.around.len(), whole.under), (0, vec![triangle]));
    }

    #[test]
    fn what_is_no_subsurface_is_found() {
        let wall = rectangle([0.0, 6.0], [0.0, 3.0]);
        assert!(Cut::new(std::slice::from_ref(&wall), &rectangle([5.0, 7.0], [1.0, 2.0])).is_none());
        let window = rectangle([1.0, 2.0], [1.0, 2.0]);
        assert_eq!(fault(&wall, &window), None);
        let turned: Ring = window.iter().rev().copied().collect();
        assert!(fault(&wall, &turned).unwrap().contains("face"));
        let lifted: Ring = window.iter().map(|corner| *corner + DVec3::Z).collect();
        assert!(fault(&wall, &lifted).unwrap().contains("plane"));
    }
}
