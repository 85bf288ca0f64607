//! Sources as they look from afar: elements and flat clusters by their moments, polygons that clusters fill by a strength fitted to theirs.

use super::moments::Moments;
use super::{Change, Slope};
use crate::element_tree::{ElementTree, Node};
use crate::plane::Plane;
use glam::DVec3;

/// Sources in one plane, as they look from afar.
#[derive(Debug, Clone)]
pub(super) struct Source<const N: usize> {
    /// Centre of gravity of the area, and the largest distance from it.
    pub(super) centre: DVec3,
    pub(super) radius: f64,
    pub(super) normal: DVec3,
    pub(super) moments: Moments<N>,
}

impl<const N: usize> Source<N> {
    /// About what it gives unblocked, its largest number, where it is seen small at `to_centre`, so high above the horizon.
    pub(super) fn share(&self, to_centre: DVec3, height: f64) -> f64 {
        let squared = to_centre.length_squared();
        -self.normal.dot(to_centre) * height / (squared * squared) * self.moments.size
    }
}

#[derive(Debug)]
pub(super) struct NodeSource<const N: usize> {
    /// Whether anything here has a strength.
    pub(super) lit: bool,
    pub(super) flat: Option<Source<N>>,
    pub(super) stand_in: Option<StandIn<N>>,
}

/// Strength that changes linearly over the polygon that a node's elements fill, fitted to theirs.
#[derive(Debug)]
pub(super) struct StandIn<const N: usize> {
    /// At the centroid.
    pub(super) strength: [f64; N],
    pub(super) slope: Slope<N>,
    pub(super) steepest: f64,
    /// Root mean square of what it misses, worst number.
    pub(super) miss: f64,
    pub(super) area: f64,
}

impl<const N: usize> NodeSource<N> {
    pub(super) fn new(
        tree: &ElementTree,
        node: &Node,
        strengths: &[[f64; N]],
        slopes: &[Change<N>],
    ) -> NodeSource<N> {
        let lit = tree.members(node).any(|k| strengths[k].iter().any(|&s| s != 0.0));
        let flat: Option<Source<N>> = node.plane.filter(|_| lit).map(|plane| {
            let area: f64 = tree.members(node).map(|k| tree.elements[k].area).sum();
            let weighted: DVec3 =
                tree.members(node).map(|k| tree.elements[k].area * tree.elements[k].centroid).sum();
            let centre = weighted / area;
            let corners = tree.members(node).flat_map(|k| tree.corners(k));
            let radius = corners.map(|corner| corner.distance(centre)).fold(0.0, f64::max);
            let mut moments = Moments::none(&plane);
            for k in tree.members(node) {
                let strength = (&strengths[k], tree.elements[k].centroid);
                moments.add(tree.corners(k), &plane, strength, &slopes[k], centre);
            }
            Source { centre, radius, normal: plane.normal, moments }
        });
        let stand_in = node
            .plane
            .zip(flat.as_ref())
            .filter(|_| !tree.hull(node).is_empty())
            .and_then(|(plane, source)| StandIn::new(tree, node, &plane, source, (strengths, slopes)));
        NodeSource { lit, flat, stand_in }
    }
}

impl<const N: usize> StandIn<N> {
    /// Least squares over the polygon: with moments about its centroid, mean and slope do not mix.
    pub(super) fn new(
        tree: &ElementTree,
        node: &Node,
        plane: &Plane,
        source: &Source<N>,
        (strengths, slopes): (&[[f64; N]], &[Change<N>]),
    ) -> Option<StandIn<N>> {
        let mut even = Moments::<1>::none(plane);
        even.add(tree.hull(node), plane, (&[1.0], source.centre), &None, source.centre);
        let (area, [[uu], [vv], [uv]]) = (even.zeroth[0], even.second);
        let determinant = uu * vv - uv * uv;
        if determinant <= 0.0 || determinant.is_nan() {
            return None;
        }
        let Moments { axes: [u, v], zeroth, first, .. } = &source.moments;
        let strength: [f64; N] = std::array::from_fn(|n| zeroth[n] / area);
        let solved = |n: usize| {
            let (a, b) = (first[0][n], first[1][n]);
            [(vv * a - uv * b) / determinant, (uu * b - uv * a) / determinant]
        };
        let slope: Slope<N> = std::array::from_fn(|n| {
            let [a, b] = solved(n);
            a * *u + b * *v
        });
        // Mean square of the strengths less that of the fit.
        let mut squares = [0.0; N];
        for k in tree.members(node) {
            let element = &tree.elements[k];
            let mut own = Moments::<1>::none(plane);
            own.add(tree.corners(k), plane, (&[1.0], element.centroid), &None, element.centroid);
            let [[uu], [vv], [uv]] = own.second;
            for (n, square) in squares.iter_mut().enumerate() {
                *square += element.area * strengths[k][n] * strengths[k][n];
                if let Some((_, slope)) = &slopes[k] {
                    let (a, b) = (u.dot(slope[n]), v.dot(slope[n]));
                    *square += uu * a * a + vv * b * b + 2.0 * uv * a * b;
                }
            }
        }
        let missed = |n: usize| {
            let [a, b] = solved(n);
            let explained = strength[n] * strength[n] + (a * first[0][n] + b * first[1][n]) / area;
            (squares[n] / area - explained).max(0.0).sqrt()
        };
        let miss = (0..N).map(missed).fold(0.0, f64::max);
        let steepest = slope.iter().fold(0.0, |most: f64, s| most.max(s.length()));
        Some(StandIn { strength, slope, steepest, miss, area })
    }
}
