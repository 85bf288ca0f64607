//! Lower and upper bounds of every element's radiosity (Lischinski, Smits & Greenberg 1994): B_lo <= B <= B_hi for the
//! true factors, which differ from the matrix by what its row errors allow, and for the solver's residual.
//!
//! **Rows**: sum over j of |dF_ij| <= e_i and nothing else is known, but that S is symmetric, so |dS_ij| <= A_j e_j too.
//! The worst that such errors do to row i fills its budget A_i e_i with the brightest elements first, each up to A_j e_j:
//! U_i(B). The true radiosity then differs from B by at most v if v - K v >= rho U(|B| + v) + |residual|: applied again
//! and again to both sides of that, what is assumed of the difference remains true in the limit. v is found by conjugate
//! gradients, enlarged a little, and checked with one product; where the check fails there is no bound.
//!
//! **Proportional**: every factor of row i is off by the same share d_i = e_i / (row sum) at most, the interval matrices
//! F (1 - d) and F (1 + d). Narrower, linear, and no proof where errors sit in single entries.

use crate::equation::{Equation, apply};
use crate::method;
use crate::product::Product;
use crate::work::{End, Work};

/// How row errors are spread over a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Spread {
    /// As badly as can be: the bounds hold if the row errors do
    Rows,
    /// Evenly, each factor by the same share: narrower, no proof
    Proportional,
}

impl Spread {
    /// The name on the command line.
    pub fn name(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self);
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Enlargement of v beyond what solves the inequality, and what the search may leave of it.
const MARGIN: f64 = 1e-7;
/// Right-hand sides are raised to this part of their mean: rows without error would ask for digits nobody sees.
const FLOOR: f64 = 1e-3;
/// Times that U is brought up to date. It contracts like e / (1 - rho); where that is no contraction nothing is bounded.
const MOST_ROUNDS: usize = 60;
/// Products for one v.
const MOST_STEPS: usize = 1000;
/// Growth of v beyond which there is no bound.
const UNBOUNDED: f64 = 1e9;

/// One channel's system and its solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<'a> {
    pub product: &'a Product<'a>,
    pub areas: &'a [f64],
    /// 0 where no light can come.
    pub reflectance: &'a [f64],
    pub exitance: &'a [f64],
    pub row_errors: &'a [f64],
    pub row_sums: &'a [f64],
    /// B = E + rho H.
    pub radiosity: &'a [f64],
    /// A (F B - H): what the solver left, W.
    pub residual: &'a [f64],
}

/// Bounds of a channel and the products they took.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    pub lower: Vec<f64>,
    /// Infinite where nothing could be proved.
    pub upper: Vec<f64>,
    pub products: usize,
}

/// U(B): the worst that the row errors do to the irradiance of each element, for radiosities |B| of these sizes.
pub(crate) fn worst_irradiance(known: &Known<'_>, sizes: &[f64]) -> Vec<f64> {
    let (areas, errors) = (known.areas, known.row_errors);
    if !known.product.is_symmetric() {
        let brightest = sizes.iter().copied().fold(0.0, f64::max);
        return errors.iter().map(|e| e * brightest).collect();
    }
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]).then(a.cmp(&b)));
    // Budget used up and power caused by the brightest k elements.
    let (mut used, mut caused) = (vec![0.0], vec![0.0]);
    let (mut budget, mut power) = (0.0, 0.0);
    for &j in &order {
        budget += areas[j] * errors[j];
        power += areas[j] * errors[j] * sizes[j];
        used.push(budget);
        caused.push(power);
    }
    (0..sizes.len())
        .map(|i| {
            let own = areas[i] * errors[i];
            let whole = used.partition_point(|&used| used <= own) - 1;
            let rest = order.get(whole).map_or(0.0, |&next| (own - used[whole]) * sizes[next]);
            (caused[whole] + rest) / areas[i]
        })
        .collect()
}

/// Bounds of a channel's radiosity.
pub(crate) fn bounds(known: &Known<'_>, spread: Spread) -> Bounds {
    let (upper, lower, products) = match spread {
        Spread::Rows => {
            let (v, products) = worst_case(known);
            (v.clone(), v, products)
        }
        Spread::Proportional => {
            let (upper, some) = proportional(known, 1.0);
            let (lower, more) = proportional(known, -1.0);
            (upper, lower, some + more)
        }
    };
    let n = known.areas.len();
    let signed = known.exitance.iter().any(|&e| e < 0.0);
    let b = known.radiosity;
    Bounds {
        upper: match upper {
            Some(v) => (0..n).map(|i| b[i] + v[i]).collect(),
            None => vec![f64::INFINITY; n],
        },
        lower: (0..n)
            .map(|i| {
                let least = lower.as_ref().map_or(f64::NEG_INFINITY, |v| b[i] - v[i]);
                // Nothing sends less than it emits, unless heat is drawn out somewhere.
                match signed {
                    true => least.max(f64::MIN),
                    false => least.max(known.exitance[i]),
                }
            })
            .collect(),
        products,
    }
}

/// v for errors of rows.
fn worst_case(known: &Known<'_>) -> (Option<Vec<f64>>, usize) {
    let n = known.areas.len();
    let reaches = |h: &[f64]| -> Vec<f64> {
        (0..n).map(|i| known.radiosity[i].abs() + known.reflectance[i] * h[i]).collect()
    };
    let wanted = |worst: &[f64]| -> Vec<f64> {
        (0..n).map(|i| known.areas[i] * worst[i] + known.residual[i].abs()).collect()
    };
    let brightest = known.radiosity.iter().map(|b| b.abs()).fold(0.0, f64::max);
    let mut h = vec![0.0; n];
    let mut products = 0;
    for _ in 0..MOST_ROUNDS {
        let right = wanted(&worst_irradiance(known, &reaches(&h)));
        let (found, some) = solve(known, known.areas, &right, &h);
        products += some;
        let Some((next, left)) = found else { break };
        h = next;
        if h.iter().any(|h| !(h.is_finite() && *h <= UNBOUNDED * brightest)) {
            break;
        }
        let needed = wanted(&worst_irradiance(known, &reaches(&h)));
        if (0..n).all(|i| known.reflectance[i] == 0.0 || left[i] >= needed[i]) {
            return (Some((0..n).map(|i| known.reflectance[i] * h[i]).collect()), products);
        }
    }
    (None, products)
}

/// v for factors off by shares: B + v solves the system of F (1 + d), or B - v that of F (1 - d).
fn proportional(known: &Known<'_>, sign: f64) -> (Option<Vec<f64>>, usize) {
    let n = known.areas.len();
    let mut shrunk = vec![0.0; n];
    let mut right = vec![0.0; n];
    for i in 0..n {
        let sum = known.row_sums[i];
        let share = if sum > 0.0 { known.row_errors[i] / sum } else { 0.0 };
        let factor = 1.0 + sign * share;
        if factor <= 0.0 {
            return (None, 0);
        }
        // (A / (1 + d)) h - S (rho h) = (A d H + |residual|) / (1 + d), v = rho h, with H = F B.
        shrunk[i] = known.areas[i] / factor;
        let arriving = known.areas[i] * irradiance(known, i) + known.residual[i];
        right[i] = (share * arriving.abs() + known.residual[i].abs()) / factor;
    }
    let (found, products) = solve(known, &shrunk, &right, &vec![0.0; n]);
    let v = found.and_then(|(h, left)| {
        let holds = (0..n).all(|i| known.reflectance[i] == 0.0 || (left[i] >= right[i] && h[i] >= 0.0));
        holds.then(|| (0..n).map(|i| known.reflectance[i] * h[i]).collect())
    });
    (v, products)
}

/// H of a reflecting element.
fn irradiance(known: &Known<'_>, i: usize) -> f64 {
    let rho = known.reflectance[i];
    if rho > 0.0 { (known.radiosity[i] - known.exitance[i]) / rho } else { 0.0 }
}

/// h and what it gives, areas h - S (rho h), for at least the right-hand side; from an earlier h.
type Found = Option<(Vec<f64>, Vec<f64>)>;

fn solve(known: &Known<'_>, areas: &[f64], right: &[f64], from: &[f64]) -> (Found, usize) {
    let n = areas.len();
    let rho = known.reflectance;
    let total: f64 = areas.iter().sum();
    let mean = right.iter().sum::<f64>() / total;
    let raised: Vec<f64> = (0..n).map(|i| (1.0 + MARGIN) * right[i].max(FLOOR * mean * areas[i])).collect();
    if mean == 0.0 {
        return (Some((vec![0.0; n], vec![0.0; n])), 0);
    }
    let reflected = |h: &[f64]| -> Vec<f64> { h.iter().zip(rho).map(|(h, rho)| rho * h).collect() };
    let image = |h: &[f64]| -> Vec<f64> {
        let arriving = apply(known.product, &[reflected(h)]).swap_remove(0);
        (0..n).map(|i| areas[i] * h[i] - arriving[i]).collect()
    };
    let mut equation = Equation::new(areas, rho, raised.clone());
    let mut products = 0;
    if from.iter().any(|&h| h != 0.0) {
        let before = image(from);
        equation.irradiance = from.to_vec();
        equation.residual.iter_mut().zip(before).for_each(|(r, image)| *r -= image);
        products += 1;
    }
    let wanted = raised.clone();
    let measure = move |_: usize, e: &Equation<'_>| {
        let rows = (0..n).filter(|&i| e.reflectance[i] > 0.0);
        rows.map(|i| e.residual[i].abs() / wanted[i]).fold(0.0, f64::max)
    };
    let mut work = Work::new(known.product, vec![equation], measure, 0.25 * MARGIN, MOST_STEPS);
    work.begin(&[true]);
    let mut method = method::of_any(known.product.is_symmetric());
    let outcome = method.improve(&mut work);
    products += work.history.len();
    let ends = work.ends();
    if outcome.is_err() || ends[0] == End::BrokeDown {
        return (None, products);
    }
    let h = work.equations.swap_remove(0).irradiance;
    let left = image(&h);
    (Some((h, left)), products + 1)
}
