//! Exchange factor of two patches with nothing between them: the cheapest rule that keeps the tolerance.
//!
//! Far pairs take Gauss points on both sides, near and touching ones the contour, far ones at a tight tolerance the
//! product rules with many points, because the contour's terms cancel there (theory 4.2). Patches that reach behind
//! each other's planes are cut there first.

use crate::area_rule::{Separation, kernel_sum};
use crate::contour::{self, Exchange};
use crate::patch::{Patch, RulePoints};
use crate::plane::PLANARITY;
use crate::polygon;
use crate::quadrature::Strength;
use glam::DVec3;

/// Which rule served a pair: for the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    /// The patches do not face each other.
    Invisible,
    /// One point on each.
    Centre,
    /// Three or four points on each.
    Low,
    /// Six or nine points on each.
    Middle,
    /// Many points on each.
    Product,
    /// Closed form over the contours.
    Contour,
}

/// Product rules beyond this many points a side cost more than any contour and gain nothing in f64.
const LARGEST_PRODUCT: usize = 12;
/// Patches are halved at most this often to get their parts far enough apart for a product rule.
const DEEPEST_HALVING: usize = 8;
/// Patches nearer than this (sizes over distance of the centres) may touch: their contour does not cancel.
const NEAR: f64 = 1.5;
/// A corner this little below a plane (in units of the pair's size) is on it: a few roundings of its height.
pub const HEIGHT_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// How two patches face each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facing {
    /// Neither sees the other's front: the factor is zero.
    Away,
    /// Each lies wholly at or in front of the other's plane.
    Full,
    /// A part of one lies behind the other.
    Cut,
}

/// Facing of two patches. Parts at most `PLANARITY` of the patches' size in front of a plane do not count as in front.
pub fn facing(p: &Patch, q: &Patch) -> Facing {
    let size = p.radius.max(q.radius);
    let (low_p, high_p) = p.heights_over(&q.plane);
    if high_p <= PLANARITY * size {
        return Facing::Away;
    }
    let (low_q, high_q) = q.heights_over(&p.plane);
    if high_q <= PLANARITY * size {
        return Facing::Away;
    }
    let reach = size + (p.centroid - q.centroid).length();
    let cut = low_p < -HEIGHT_ROUNDING * reach || low_q < -HEIGHT_ROUNDING * reach;
    if cut { Facing::Cut } else { Facing::Full }
}

/// The parts of two patches that can see each other: each cut at the other's plane. `None` where nothing is left.
pub fn mutual_parts(p: &Patch, q: &Patch) -> Option<(Patch, Patch)> {
    let (mut part_p, mut part_q) = (Vec::new(), Vec::new());
    polygon::clip_to_front(&p.corners, &q.plane, &mut part_p);
    polygon::clip_to_front(&q.corners, &p.plane, &mut part_q);
    // A sliver keeps its patch's plane: its own would be rounding.
    let keep =
        |part: Vec<DVec3>, whole: &Patch| Patch::new(part).map(|part| Patch { plane: whole.plane, ..part });
    Some((keep(part_p, p)?, keep(part_q, q)?))
}

/// Exchange factor of two patches with nothing between them, within `relative` of its value (never asked below
/// 1e-12), and the rule that served.
pub fn exchange(p: &Patch, q: &Patch, relative: f64) -> (Exchange, Rule) {
    match facing(p, q) {
        Facing::Away => (Exchange::NONE, Rule::Invisible),
        Facing::Full => exchange_in_front(p, q, relative),
        Facing::Cut => match mutual_parts(p, q) {
            Some((p, q)) => exchange_in_front(&p, &q, relative),
            None => (Exchange::NONE, Rule::Invisible),
        },
    }
}

/// As [`exchange`] for patches known to lie wholly in front of each other.
pub fn exchange_in_front(p: &Patch, q: &Patch, relative: f64) -> (Exchange, Rule) {
    let (found, rule) = in_front(p, q, relative, DEEPEST_HALVING);
    // Seen edge-on within rounding, a point may lie behind the other's plane: the product of cosines is then below zero.
    let (value, error) = (found.value.max(0.0), found.error.max(-found.value));
    (Exchange { value, error }, rule)
}

/// Halves of the larger patch, cut across its longest extent.
fn halves(patch: &Patch) -> Option<[Patch; 2]> {
    let extent = |&c: &DVec3| (c - patch.centroid).length_squared();
    let farthest = *patch.corners.iter().max_by(|a, b| extent(a).total_cmp(&extent(b)))?;
    let along = farthest - patch.centroid;
    let (mut front, mut back) = (Vec::new(), Vec::new());
    polygon::clip_by(&patch.corners, |c| along.dot(c - patch.centroid), &mut front);
    polygon::clip_by(&patch.corners, |c| -along.dot(c - patch.centroid), &mut back);
    let keep = |part| Patch::new(part).map(|part| Patch { plane: patch.plane, ..part });
    Some([keep(front)?, keep(back)?])
}

fn in_front(p: &Patch, q: &Patch, relative: f64, halvings: usize) -> (Exchange, Rule) {
    let separation = Separation::new(p, q);
    let relative = relative.max(1e-12);
    let allowed = relative * separation.value;
    for (strength, rule) in
        [(Strength::Centroid, Rule::Centre), (Strength::Low, Rule::Low), (Strength::Middle, Rule::Middle)]
    {
        let error = separation.error(strength);
        if error <= allowed {
            let value =
                kernel_sum(rule_points(p, rule), p.plane.normal, rule_points(q, rule), q.plane.normal);
            return (Exchange { value, error }, rule);
        }
    }

    // The contour, unless its rounding is above the tolerance and a product rule keeps it.
    let size = 0.5 * (p.centroid - q.centroid).length() + p.radius.max(q.radius);
    let rounding = contour::rounding(p.corners.len(), q.corners.len(), size);
    if rounding > allowed {
        let product = (4..=LARGEST_PRODUCT).find(|&n| separation.error(Strength::Product(n)) <= allowed);
        let fallback = (separation.theta < 0.5).then_some(LARGEST_PRODUCT);
        if let Some(n) = product.or(fallback) {
            let (points_p, points_q) = (
                RulePoints::new(&p.corners, Strength::Product(n)),
                RulePoints::new(&q.corners, Strength::Product(n)),
            );
            let value = kernel_sum(&points_p, p.plane.normal, &points_q, q.plane.normal);
            return (Exchange { value, error: separation.error(Strength::Product(n)) }, Rule::Product);
        }
        // Long and thin, or large and not quite touching: the contour's terms cancel, the halves are far enough in time.
        if halvings > 0 && separation.theta < NEAR {
            let (small, large) = if p.radius < q.radius { (p, q) } else { (q, p) };
            if let Some(parts) = halves(large) {
                let mut sum = Exchange::NONE;
                for part in &parts {
                    let (found, _) = in_front(part, small, relative, halvings - 1);
                    sum = Exchange { value: sum.value + found.value, error: sum.error + found.error };
                }
                return (sum, Rule::Product);
            }
        }
    }
    // Near pairs: the centres say little about the value, so the contour refines until its own value is met.
    let mut tolerance = relative * separation.value.max(1e-3 * separation.kernel.min(p.area.min(q.area)));
    loop {
        let found = contour::contour(&p.corners, &q.corners, tolerance);
        if tolerance <= relative * found.value || tolerance <= rounding {
            return (found, Rule::Contour);
        }
        tolerance = (0.5 * relative * found.value).max(0.5 * rounding).min(0.5 * tolerance);
    }
}

fn rule_points(patch: &Patch, rule: Rule) -> &RulePoints {
    match rule {
        Rule::Centre => &patch.centre,
        Rule::Low => &patch.low,
        _ => &patch.middle,
    }
}
