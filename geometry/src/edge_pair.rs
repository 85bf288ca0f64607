//! The double line integral of ln r over two straight edges, the building block of Stokes' form of the exchange
//! factor (Sparrow 63; Goral, Torrance, Greenberg & Battaile 84, eq. 9).
//!
//! Collinear and parallel edges have elementary closed forms, shared edges among them: int int ln|s - t| over the same
//! length L is L^2 (ln L - 3/2). For edges at an angle one integral is closed and the other is Gauss on panels graded
//! towards the places where the edges come close; the number of points follows from the distance of the integrand's
//! complex singularities (Bernstein's ellipse), so touching edges need no special case.

use crate::quadrature::gauss;
use glam::DVec3;

/// A directed edge with its unit direction and length.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// First end.
    pub start: DVec3,
    /// Second end.
    pub end: DVec3,
    /// Unit vector from `start` to `end`.
    pub direction: DVec3,
    /// Length.
    pub length: f64,
}

impl Edge {
    /// Edge from `start` to `end`; a zero length has a zero direction and contributes nothing.
    pub fn new(start: DVec3, end: DVec3) -> Self {
        let length = (end - start).length();
        let direction = if length > 0.0 { (end - start) / length } else { DVec3::ZERO };
        Self { start, end, direction, length }
    }
}

/// Sines below this make two edges parallel: over the edges' length the lines then part by less than the roundings of
/// a few coordinate differences.
const PARALLEL_SINE: f64 = 16.0 * f64::EPSILON;
/// Most Gauss points on one panel; more are worth less than another split.
const PANEL_POINTS: f64 = 16.0;
/// Panels are not halved more often: 2^-50 of an edge is below the rounding of its ends.
const DEEPEST_PANEL: u32 = 50;
/// Bernstein's bound for analytic functions has the constant 4 max|g| / (1 - rho^-2) on the ellipse; for the panels
/// accepted here (rho above 1.5, |g| at most the inner length times a small logarithm) 16 covers both.
const BERNSTEIN_CONSTANT: f64 = 16.0;

/// (e_p . e_q) int int ln r ds dt, to an absolute error of about `tolerance`.
///
/// Coordinates should be centred on the pair and of size about 1: ln r is taken as it stands.
pub fn edge_pair(p: &Edge, q: &Edge, tolerance: f64) -> f64 {
    let cosine = p.direction.dot(q.direction);
    if cosine == 0.0 || p.length == 0.0 || q.length == 0.0 {
        return 0.0;
    }
    let sine = p.direction.cross(q.direction).length();
    let integral = if sine <= PARALLEL_SINE {
        parallel(p, q, cosine)
    } else {
        // The shorter edge is integrated numerically: it is farther from the other one in units of its length.
        let (outer, inner) = if p.length <= q.length { (p, q) } else { (q, p) };
        skew(outer, inner, sine, tolerance / cosine.abs())
    };
    cosine * integral
}

/// G(x) with G'' = ln sqrt(x^2 + h^2).
fn second_antiderivative(x: f64, h: f64) -> f64 {
    let r2 = x * x + h * h;
    if r2 == 0.0 {
        return 0.0;
    }
    0.25 * (x * x - h * h) * r2.ln() + h * x * x.atan2(h) - 0.75 * x * x
}

fn parallel(p: &Edge, q: &Edge, cosine: f64) -> f64 {
    // Along q's line, from its start: p covers [s0, s1], q covers [0, L]. An antiparallel p runs backwards, which the
    // double integral over lengths does not see.
    let between = p.start - q.start;
    let h = (between - between.dot(q.direction) * q.direction).length();
    let s0 = between.dot(q.direction);
    let s1 = s0 + p.length.copysign(cosine);
    let (low, high) = (s0.min(s1), s0.max(s1));
    let g = |x: f64| second_antiderivative(x, h);
    g(high) - g(low) - g(high - q.length) + g(low - q.length)
}

/// int ln|x - y| dy along the edge, in closed form.
fn inner_integral(point: DVec3, edge: &Edge) -> f64 {
    let to_start = edge.start - point;
    let u0 = to_start.dot(edge.direction);
    let u1 = u0 + edge.length;
    let h = to_start.cross(edge.direction).length();
    let term = |u: f64| {
        let r2 = u * u + h * h;
        if r2 > 0.0 { 0.5 * u * r2.ln() } else { 0.0 }
    };
    // The angle the edge subtends, as one atan2.
    let angle = (h * edge.length).atan2(h * h + u0 * u1);
    term(u1) - term(u0) - edge.length + h * angle
}

/// A complex place s +- i w on the outer edge's line where the inner integral is not analytic.
#[derive(Debug, Clone, Copy)]
struct Singularity {
    real: f64,
    imaginary: f64,
}

impl Singularity {
    /// Parameter of the largest Bernstein ellipse around the panel that leaves the singularity outside; at least 1.
    fn ellipse(&self, centre: f64, half: f64) -> f64 {
        let (x, y) = ((self.real - centre) / half, self.imaginary / half);
        // Sum of the distances to the foci +-1 is the major axis rho + 1/rho.
        let axis = 0.5 * ((x - 1.0).hypot(y) + (x + 1.0).hypot(y)).max(2.0);
        axis + (axis * axis - 1.0).sqrt()
    }
}

fn skew(outer: &Edge, inner: &Edge, sine: f64, tolerance: f64) -> f64 {
    let near_end = |end: DVec3| {
        let to_end = end - outer.start;
        let real = to_end.dot(outer.direction);
        Singularity { real, imaginary: (to_end - real * outer.direction).length() }
    };
    let mut singularities = vec![near_end(inner.start), near_end(inner.end)];

    // Where the lines come closest the distance to the inner line has a square root, felt only above the inner edge.
    let between = inner.start - outer.start;
    let common = outer.direction.cross(inner.direction) / sine;
    let outer_at = between.cross(inner.direction).dot(common) / sine;
    let inner_at = between.cross(outer.direction).dot(common) / sine;
    if inner_at > 0.0 && inner_at < inner.length {
        let gap = between.dot(common).abs();
        singularities.push(Singularity { real: outer_at, imaginary: gap / sine });
    }
    let panel = Panel { start: 0.0, end: outer.length, depth: 0 };
    integrate_panels(outer, inner, &singularities, panel, tolerance)
}

#[derive(Debug, Clone, Copy)]
struct Panel {
    start: f64,
    end: f64,
    depth: u32,
}

fn integrate_panels(
    outer: &Edge,
    inner: &Edge,
    singularities: &[Singularity],
    panel: Panel,
    tolerance: f64,
) -> f64 {
    let (centre, half) = (0.5 * (panel.start + panel.end), 0.5 * (panel.end - panel.start));
    let nearest =
        singularities.iter().map(|s| (s.ellipse(centre, half), s)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((rho, nearest)) = nearest else { return 0.0 };

    // Points for the tolerance by Bernstein's bound; next to a singularity of the kind x ln x the remainder of a panel
    // falls with the square of its width whatever the rule.
    let scale = BERNSTEIN_CONSTANT * half * inner.length.max(half);
    let wanted = (0.5 * (scale / tolerance).ln() / rho.ln()).max(2.0);
    let negligible = half * half < tolerance;
    if wanted <= PANEL_POINTS || negligible || panel.depth >= DEEPEST_PANEL {
        let rule = gauss(wanted.min(PANEL_POINTS).ceil() as usize);
        let value = |x: &f64| inner_integral(outer.start + (centre + half * x) * outer.direction, inner);
        return half * rule.points.iter().zip(&rule.weights).map(|(x, w)| w * value(x)).sum::<f64>();
    }

    // A singularity inside becomes the end of two panels; one outside is approached by halving.
    let inside = (nearest.real - centre).abs() < 0.95 * half && nearest.imaginary < 0.25 * half;
    let cut = if inside { nearest.real } else { centre };
    let depth = panel.depth + 1;
    integrate_panels(outer, inner, singularities, Panel { end: cut, depth, ..panel }, tolerance)
        + integrate_panels(outer, inner, singularities, Panel { start: cut, depth, ..panel }, tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(a: [f64; 3], b: [f64; 3]) -> Edge {
        Edge::new(DVec3::from_array(a), DVec3::from_array(b))
    }

    /// Plain Gauss over both, panels halved n times towards s = t = 0.
    fn reference(p: &Edge, q: &Edge) -> f64 {
        let cuts: Vec<f64> = std::iter::once(0.0).chain((0..=40).rev().map(|k| 0.5f64.powi(k))).collect();
        let rule = gauss(24);
        let mut sum = 0.0;
        for a in cuts.windows(2) {
            for b in cuts.windows(2) {
                for (x, wx) in rule.points.iter().zip(&rule.weights) {
                    for (y, wy) in rule.points.iter().zip(&rule.weights) {
                        let s = p.length * (0.5 * (a[0] + a[1]) + 0.5 * (a[1] - a[0]) * x);
                        let t = q.length * (0.5 * (b[0] + b[1]) + 0.5 * (b[1] - b[0]) * y);
                        let r = (p.start + s * p.direction - q.start - t * q.direction).length();
                        sum += 0.25 * (a[1] - a[0]) * (b[1] - b[0]) * wx * wy * r.ln();
                    }
                }
            }
        }
        sum * p.length * q.length * p.direction.dot(q.direction)
    }

    #[test]
    fn shared_edge_has_the_textbook_value() {
        let p = edge([0.0; 3], [2.0, 0.0, 0.0]);
        let want = 4.0 * (2.0f64.ln() - 1.5);
        assert!((edge_pair(&p, &p, 1e-14) - want).abs() < 1e-15);
        let back = edge([2.0, 0.0, 0.0], [0.0; 3]);
        assert!((edge_pair(&p, &back, 1e-14) + want).abs() < 1e-15);
    }

    #[test]
    fn touching_skew_and_parallel_edges_agree_with_plain_quadrature() {
        let p = edge([0.0; 3], [1.0, 0.0, 0.0]);
        for q in [
            edge([0.0; 3], [0.6, 0.8, 0.0]),
            edge([0.0; 3], [0.1, 0.05, 0.0]),
            edge([0.0, 0.3, 0.0], [0.5, 0.7, 0.9]),
            edge([0.0, 0.3, 0.4], [1.7, 0.3, 0.4]),
            edge([0.0, 0.2, 0.0], [1.0, 0.2, 3e-3]),
            edge([2.0, 3.0, 1.0], [-2.0, 2.0, 5.0]),
        ] {
            let (got, want) = (edge_pair(&p, &q, 1e-14), reference(&p, &q));
            assert!((got - want).abs() < 2e-12, "{q:?}: {got} {want} {}", got - want);
        }
    }

    #[test]
    fn crossing_edges_are_integrated_through_the_crossing() {
        // Each half against each half, by the touching case.
        let (p, q) = (edge([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), edge([-0.6, -0.8, 0.0], [0.6, 0.8, 0.0]));
        let half = |x: f64, c: [f64; 3]| (edge([0.0; 3], [x, 0.0, 0.0]), edge([0.0; 3], c));
        let same = half(1.0, [0.6, 0.8, 0.0]);
        let opposite = half(-1.0, [0.6, 0.8, 0.0]);
        // Directions in the halves are both outward: the sign of the cosine changes for opposite ones.
        let want = 2.0 * reference(&same.0, &same.1) - 2.0 * reference(&opposite.0, &opposite.1);
        let got = edge_pair(&p, &q, 1e-14);
        assert!((got - want).abs() < 2e-12, "{got} {want}");
    }

    #[test]
    fn tolerance_is_kept_for_loose_tolerances_too() {
        let (p, q) = (edge([0.0; 3], [1.0, 0.0, 0.0]), edge([0.0, 0.05, 0.0], [0.7, 0.5, 0.5]));
        let want = edge_pair(&p, &q, 1e-15);
        for tolerance in [1e-3, 1e-5, 1e-7, 1e-9, 1e-11] {
            let error = (edge_pair(&p, &q, tolerance) - want).abs();
            assert!(error <= tolerance, "{tolerance}: {error}");
        }
    }
}
