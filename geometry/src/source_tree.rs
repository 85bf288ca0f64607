//! Sources gathered at a point, far ones together.
//!
//! As [`crate::gather`], but where an error is allowed a flat, unblocked cluster seen under a small angle is not opened: its
//! sources count by their moments, Taylor's series of the kernel to second order (as far blocks in hierarchical radiosity, Hanrahan,
//! Salzman & Aupperle 1991, but with the field's variation inside the cluster instead of its mean).
//! What gives too little to matter by itself is seen or not by its middle ([`Opening::faint`]).
//!
//! # Precision
//! An unopened cluster of radius R at distance d is off by a few (R / d)^3 of its own share: see [`SourceTree::gather`].

mod moments;
mod sources;

use self::moments::Moments;
use self::sources::{NodeSource, Source, StandIn};
use crate::element_tree::Element;
use crate::gather::{Gatherer, Look, Part, Scratch, Taker};
use crate::point_factor::above_horizon;
use crate::polygon;
use crate::visible_part::Polygons;
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;

/// A scene with the strengths of its sources, N numbers each.
#[derive(Debug)]
pub struct SourceTree<const N: usize> {
    gatherer: Gatherer,
    /// Strength of each of the gatherer's elements, at its centroid.
    strengths: Vec<[f64; N]>,
    /// Slopes of those elements whose strength changes, and the steepest of each.
    slopes: Vec<Change<N>>,
    /// Of each of the gatherer's elements.
    element_sources: Vec<Source<N>>,
    /// Of each node of the gatherer's tree.
    node_sources: Vec<NodeSource<N>>,
}

/// How strength changes over a source: its gradient in the source's plane, one for each of the N numbers.
pub type Slope<const N: usize> = [DVec3; N];

/// The slope of a source that is not even, and its steepest of the N.
type Change<const N: usize> = Option<(f64, Slope<N>)>;

/// Cuts in a row of what is seen of a source that is not even: each halves the doubt about where its mean is.
const MOST_CUTS: u32 = 24;

/// Doubt that is none, as part of what a source gives.
const LEAST_DOUBT: f64 = 1e-6;

/// How sources were counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Elements by their exact form factor.
    pub exact: u64,
    /// Clusters and elements by their moments.
    pub far: u64,
    /// Clusters by the exact form factor of the polygon they fill, with a strength fitted to theirs.
    pub fitted: u64,
    /// Clusters proved to be wholly behind one blocker.
    pub hidden: u64,
    /// Flat clusters and elements that count by their moments if their middle is seen, and not at all if not.
    pub faint: u64,
}

/// What a fitted strength may miss times the form factor, in units of what a source's share may be off by: misses have both
/// signs over the polygon and cancel.
const STANDING: f64 = 2.0;
/// Radius over distance from which on the series is not to be trusted, however small the share.
const WIDEST: f64 = 0.5;
/// Remainder of the series over the cube of radius over distance and the share.
const REMAINDER: f64 = 10.0;

/// What may be left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Flat unblocked clusters are counted by their moments where radius over distance is below this; 0 for never.
    pub far: f64,
    /// What a source's share may be off by, in the unit of the strengths: sources that change are cut only while the place
    /// of what is seen of them is in doubt by more, and clusters whose share is small count by their moments earlier.
    pub blur: f64,
    /// Whether clusters behind one blocker are recognised as such.
    pub hidden: bool,
    /// Flat clusters whose share without blockers is below so many times `blur` are seen or not by their middle; 0 for never.
    pub faint: f64,
}

impl Opening {
    /// Everything exactly; only what is proved to give nothing is left out.
    pub const EXACT: Opening = Opening { far: 0.0, blur: 0.0, hidden: true, faint: 0.0 };
}

/// Adds up what a walk finds.
struct Sum<'a, const N: usize> {
    tree: &'a SourceTree<N>,
    opening: Opening,
    sum: [f64; N],
    counts: Counts,
}

/// A source whose strength changes.
struct Uneven<'a, const N: usize> {
    to_centre: DVec3,
    strength: &'a [f64; N],
    slope: &'a Slope<N>,
    steepest: f64,
}

impl<const N: usize> Sum<'_, N> {
    /// Adds a piece of a source whose strength changes: what it sends is its form factor times the strength at its mean by
    /// the kernel. That is close to its centroid where the kernel changes little; otherwise it is cut in two.
    fn add_uneven(&mut self, piece: &[DVec3], source: &Uneven<'_, N>, normal: DVec3, cuts: u32) {
        let factor = above_horizon(DVec3::ZERO, normal, piece);
        if piece.len() < 3 || factor <= 0.0 {
            return;
        }
        let centroid = polygon::centroid(piece);
        let farthest = |far: DVec3, &corner: &DVec3| {
            let from_centre = corner - centroid;
            if from_centre.length_squared() > far.length_squared() { from_centre } else { far }
        };
        let far = piece.iter().fold(DVec3::ZERO, farthest);
        let radius = far.length();
        // The kernel's logarithm changes by about 4 / r, and by 1 / height over the horizon; moments are below R^2 / 4.
        let change = 1.0 / centroid.length() + 0.25 / normal.dot(centroid);
        let doubt = (radius * change).min(1.0) * radius * source.steepest * factor;
        let brightest = source.strength.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        if doubt > self.opening.blur.max(LEAST_DOUBT * factor * brightest) && cuts < MOST_CUTS {
            let heights: Vec<f64> = piece.iter().map(|&corner| far.dot(corner - centroid)).collect();
            let (mut front, mut back) = (Vec::new(), Vec::new());
            polygon::cut_in_two(piece, &heights, &mut front, &mut back);
            self.add_uneven(&front, source, normal, cuts + 1);
            self.add_uneven(&back, source, normal, cuts + 1);
            return;
        }
        let aside = centroid - source.to_centre;
        for (n, sum) in self.sum.iter_mut().enumerate() {
            *sum += factor * (source.strength[n] + source.slope[n].dot(aside));
        }
    }

    /// Adds sources by their moments, if they are far enough.
    fn takes(&mut self, source: &Source<N>, look: Look) -> bool {
        let to_centre = source.centre - look.point;
        let height = look.normal.dot(to_centre);
        let squared = to_centre.length_squared();
        let ratio_squared = source.radius * source.radius / squared;
        if height < source.radius || ratio_squared >= WIDEST * WIDEST {
            return false;
        }
        let Opening { far, blur, .. } = self.opening;
        let is_far = ratio_squared < far * far || {
            let share = source.share(to_centre, height);
            REMAINDER * ratio_squared * ratio_squared.sqrt() * share < blur
        };
        if is_far {
            source.moments.add_to(&mut self.sum, to_centre, source.normal, look.normal);
            self.counts.far += 1;
        }
        is_far
    }
}

impl<const N: usize> Taker for Sum<'_, N> {
    fn wants(&mut self, node: usize) -> bool {
        self.tree.node_sources[node].lit
    }

    fn takes_node(&mut self, node: usize, look: Look) -> bool {
        let tree = self.tree;
        tree.node_sources[node].flat.as_ref().is_some_and(|source| self.takes(source, look))
    }

    fn takes_element(&mut self, element: usize, look: Look) -> bool {
        let tree = self.tree;
        self.takes(&tree.element_sources[element], look)
    }

    fn take(&mut self, element: usize, seen: &Polygons, look: Look) {
        self.counts.exact += 1;
        let tree = self.tree;
        let strength = &tree.strengths[element];
        match &tree.slopes[element] {
            None => {
                let normal = look.normal;
                let factor: f64 = seen.iter().map(|piece| above_horizon(DVec3::ZERO, normal, piece)).sum();
                for (sum, strength) in self.sum.iter_mut().zip(strength) {
                    *sum += factor.max(0.0) * strength;
                }
            }
            Some((steepest, slope)) => {
                let to_centre = tree.gatherer.tree.elements[element].centroid - look.point;
                let uneven = Uneven { to_centre, strength, slope, steepest: *steepest };
                seen.iter().for_each(|piece| self.add_uneven(piece, &uneven, look.normal, 0));
            }
        }
    }

    fn stands_in(&mut self, node: usize, look: Look) -> bool {
        let NodeSource { flat: Some(source), stand_in: Some(fitted), .. } = &self.tree.node_sources[node]
        else {
            return false;
        };
        if self.opening.blur <= 0.0 {
            return false;
        }
        // At most the factor of all of it at its least distance, where the point is not too near to say.
        let to_centre = source.centre - look.point;
        let nearest = (to_centre.length() - source.radius).max(0.0);
        let height = (look.normal.dot(to_centre) + source.radius).min(to_centre.length());
        let over_plane = -source.normal.dot(to_centre);
        let kernel = over_plane * height * FRAC_1_PI * fitted.area;
        let factor = (kernel / nearest.powi(4)).min(1.0);
        fitted.miss * factor <= STANDING * self.opening.blur
    }

    fn take_node(&mut self, node: usize, seen: &Polygons, look: Look) {
        let NodeSource { flat: Some(source), stand_in: Some(fitted), .. } = &self.tree.node_sources[node]
        else {
            return;
        };
        self.counts.fitted += 1;
        let to_centre = source.centre - look.point;
        let StandIn { strength, slope, steepest, .. } = fitted;
        let uneven = Uneven { to_centre, strength, slope, steepest: *steepest };
        seen.iter().for_each(|piece| self.add_uneven(piece, &uneven, look.normal, 0));
    }

    fn faint(&mut self, part: Part, look: Look) -> Option<DVec3> {
        let source = self.tree.source(part)?;
        let to_centre = source.centre - look.point;
        let height = look.normal.dot(to_centre);
        let is_apart = source.radius * source.radius < WIDEST * WIDEST * to_centre.length_squared();
        let is_faint = height >= source.radius
            && is_apart
            && source.share(to_centre, height) < self.opening.faint * self.opening.blur;
        self.counts.faint += u64::from(is_faint);
        is_faint.then_some(to_centre)
    }

    fn take_faint(&mut self, part: Part, look: Look) {
        let tree = self.tree;
        let Some(source) = tree.source(part) else { return };
        source.moments.add_to(&mut self.sum, source.centre - look.point, source.normal, look.normal);
    }

    fn hidden(&mut self) {
        self.counts.hidden += 1;
    }
}

impl<const N: usize> SourceTree<N> {
    /// Prepares the elements of `gatherer`, with `strengths` in the order they were given to it.
    pub fn new(gatherer: Gatherer, strengths: &[[f64; N]]) -> SourceTree<N> {
        SourceTree::with_slopes(gatherer, strengths, &[])
    }

    /// As [`SourceTree::new`], with strengths that change over the elements: those given hold at their centroids.
    pub fn with_slopes(
        gatherer: Gatherer,
        strengths: &[[f64; N]],
        slopes: &[Option<Slope<N>>],
    ) -> SourceTree<N> {
        let tree = &gatherer.tree;
        let with_steepest = |slope: Slope<N>| {
            let steepest = slope.iter().fold(0.0, |most: f64, s| most.max(s.length()));
            (steepest > 0.0).then_some((steepest, slope))
        };
        let slope = |element: &Element| slopes.get(element.index).copied().flatten().and_then(with_steepest);
        let slopes: Vec<Change<N>> = tree.elements.iter().map(slope).collect();
        let strength = |element: &Element| strengths.get(element.index).copied().unwrap_or([0.0; N]);
        let strengths: Vec<[f64; N]> = tree.elements.iter().map(strength).collect();
        let element_sources = (0..tree.elements.len()).map(|k| {
            let Element { plane, centroid, radius, .. } = tree.elements[k];
            let mut moments = Moments::none(&plane);
            moments.add(tree.corners(k), &plane, (&strengths[k], centroid), &slopes[k], centroid);
            Source { centre: centroid, radius, normal: plane.normal, moments }
        });
        let element_sources = element_sources.collect();
        let node_sources =
            tree.nodes.iter().map(|node| NodeSource::new(tree, node, &strengths, &slopes)).collect();
        SourceTree { gatherer, strengths, slopes, element_sources, node_sources }
    }

    fn source(&self, part: Part) -> Option<&Source<N>> {
        match part {
            Part::Node(node) => self.node_sources[node].flat.as_ref(),
            Part::Element(element) => Some(&self.element_sources[element]),
        }
    }

    /// Sum over the elements of form factor times strength, at `point` on a plane with unit `normal`; and how it was found.
    ///
    /// With `opening.far` = t clusters of radius below t times their distance are counted by their moments. The remainder of
    /// the series is below 10 t^3 of such a cluster's share for a point that sees it well above its horizon, and
    /// signs differ between clusters: t = 0.2 is measured at 1e-4 of the whole in a room.
    pub fn gather(
        &self,
        point: DVec3,
        normal: DVec3,
        opening: Opening,
        scratch: &mut Scratch,
    ) -> ([f64; N], Counts) {
        let mut sum = Sum { tree: self, opening, sum: [0.0; N], counts: Counts::default() };
        self.gatherer.walk(Look { point, normal, hidden: opening.hidden }, scratch, &mut sum);
        (sum.sum, sum.counts)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::occluder::Occluder;

    /// Quadrilaterals n x n over a parallelogram.
    fn grid(corner: DVec3, u: DVec3, v: DVec3, n: usize) -> Vec<Vec<DVec3>> {
        let at = |i: usize, j: usize| corner + u * (i as f64 / n as f64) + v * (j as f64 / n as f64);
        (0..n * n)
            .map(|k| (k % n, k / n))
            .map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect()
    }

    /// The unit cube from inside, n x n to a wall, with a box standing in it.
    fn room(n: usize, scale: f64) -> (Vec<Occluder>, Vec<Vec<DVec3>>) {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let walls =
            [(DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, x, y), (z, y, x)];
        let (mut faces, mut elements) = (Vec::new(), Vec::new());
        for (low, size, n, inside) in [(0.0, 1.0, n, true), (0.3, 0.25, n / 4, false)] {
            let base = if inside { DVec3::ZERO } else { DVec3::new(low, 0.0, low) };
            for (corner, u, v) in walls {
                let (u, v) = if inside { (u, v) } else { (v, u) };
                let place = scale * (base + size * corner);
                let (u, v) = (scale * size * u, scale * size * v);
                faces.extend(grid(place, u, v, 1));
                elements.extend(grid(place, u, v, n.max(1)));
            }
        }
        (faces.into_iter().filter_map(Occluder::new).collect(), elements)
    }

    fn strengths(elements: &[Vec<DVec3>], scale: f64) -> Vec<[f64; 2]> {
        let field = |p: DVec3| [1.0 + (5.0 * p.x).sin() * p.y, 1.0];
        elements.iter().map(|e| field(crate::polygon::mean_corner(e) / scale)).collect()
    }

    const POINTS: [(f64, f64, f64, DVec3); 5] = [
        (0.12, 0.0, 0.7, DVec3::Y),
        (0.299, 0.0, 0.4, DVec3::Y),
        (0.0, 0.3, 0.31, DVec3::X),
        (0.4, 0.25, 0.5, DVec3::Y),
        (0.61, 1.0, 0.9, DVec3::NEG_Y),
    ];

    #[test]
    fn unopened_clusters_change_the_sum_by_less_than_stated_and_exact_means_exact() {
        for scale in [1e-6, 1.0, 1e6] {
            let (occluders, elements) = room(16, scale);
            let strengths = strengths(&elements, scale);
            let exact = Gatherer::new(occluders.clone(), elements.clone());
            let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
            let scratch = &mut Scratch::default();
            let mut counts = [0; 3];
            for (x, y, z, normal) in POINTS {
                let point = scale * DVec3::new(x, y, z);
                let mut want = [0.0; 2];
                exact.factors(point, normal, scratch, &mut |k, factor| {
                    (0..2).for_each(|c| want[c] += factor * strengths[k][c]);
                });
                for (far, allowed) in [(0.0, 1e-12), (0.1, 2e-5), (0.2, 2e-4), (0.4, 3e-3)] {
                    let opening = Opening { far, ..Opening::EXACT };
                    let (got, count) = tree.gather(point, normal, opening, scratch);
                    for (got, want) in got.iter().zip(want) {
                        let error = (got / want - 1.0).abs();
                        assert!(error < allowed, "{point} {far}: {got} {want} {error:.1e}");
                    }
                    counts = [count.exact, count.far, count.hidden];
                    let (all, count) =
                        tree.gather(point, normal, Opening { far, hidden: false, ..Opening::EXACT }, scratch);
                    assert_eq!(count.hidden, 0);
                    assert!(all.iter().zip(got).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
                }
            }
            assert!(counts[0] < 300 && counts[1] > 10, "{counts:?}");
        }
    }

    #[test]
    fn clusters_behind_the_box_are_proved_hidden() {
        let (occluders, elements) = room(16, 1.0);
        let strengths = vec![[1.0]; elements.len()];
        let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
        let beside = DVec3::new(0.299, 0.0, 0.4);
        let ([sum], counts) = tree.gather(beside, DVec3::Y, Opening::EXACT, &mut Scratch::default());
        assert!((sum - 1.0).abs() < 1e-12 && counts.hidden > 3 && counts.far == 0, "{sum} {counts:?}");
    }

    /// A wall behind a box, with a field that a line describes but for a ripple: few polygons stand in for many elements.
    #[test]
    fn fitted_polygons_keep_the_sum_within_what_they_may_miss() {
        for scale in [1e-6, 1.0] {
            let (occluders, elements) = room(16, scale);
            let field = |p: DVec3| 1.0 + p.x - 0.5 * p.y + 0.3 * p.z + 0.002 * (40.0 * (p.x + p.z)).sin();
            let strengths: Vec<[f64; 1]> =
                elements.iter().map(|e| [field(crate::polygon::mean_corner(e) / scale)]).collect();
            let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
            let scratch = &mut Scratch::default();
            for (x, y, z, normal) in POINTS {
                let point = scale * DVec3::new(x, y, z);
                let ([exact], all) = tree.gather(point, normal, Opening::EXACT, scratch);
                let opening = Opening { blur: 1e-3, ..Opening::EXACT };
                let ([fitted], few) = tree.gather(point, normal, opening, scratch);
                // Steps of the elements' means are off from the line, too: 1/32 of a slope of 1 beside the point.
                assert!((fitted / exact - 1.0).abs() < 5e-3, "{point}: {fitted} {exact}");
                assert!(few.fitted > 0 && few.fitted + few.exact < all.exact / 4, "{few:?} {all:?}");
            }
        }
    }

    /// Each faint cluster is off by its own share at most, whether its middle is seen or not; most of it is not off at all.
    #[test]
    fn faint_clusters_change_the_sum_by_less_than_their_shares() {
        for scale in [1e-6, 1.0] {
            let (occluders, elements) = room(16, scale);
            let strengths = strengths(&elements, scale);
            let tree = SourceTree::new(Gatherer::new(occluders, elements), &strengths);
            let scratch = &mut Scratch::default();
            let (mut worst, mut faint) = (0.0f64, 0);
            for (x, y, z, normal) in POINTS {
                let point = scale * DVec3::new(x, y, z);
                let opening = Opening { blur: 0.02, ..Opening::EXACT };
                let ([want, _], all) = tree.gather(point, normal, opening, scratch);
                let ([got, _], few) = tree.gather(point, normal, Opening { faint: 0.25, ..opening }, scratch);
                let allowed = few.faint as f64 * 0.25 * opening.blur;
                assert!((got - want).abs() <= allowed, "{point}: {got} {want} {allowed}");
                assert!(few.exact <= all.exact && all.faint == 0, "{few:?} {all:?}");
                worst = worst.max((got - want).abs());
                faint += few.faint;
            }
            // Errors of both signs: less than one source may be off by.
            assert!(worst > 0.0 && worst < 0.02 && faint > 10, "{worst} {faint}");
        }
    }
}
