//! `--bounds`: lower and upper radiosity of every element, the three terms of error apart (Arvo, Torrance & Smits 1994:
//! perturbed operator, inexact solution, discretisation), and who causes most of them, weighted by importance.
//!
//! With z = 1 + F (rho z) a residual r_i of the radiosity of element i changes the radiosity of all by at most
//! sum of A_i z_i |r_i| in the power norm. Contributions of elements and links are the terms of that sum.

use crate::bound::Importance;
use crate::channels::Channel;
use crate::components::Components;
use crate::discretisation::ElementResidual;
use crate::equation::Equation;
use crate::interval::{self, Known, Spread, worst_irradiance};
use crate::method;
use crate::product::Product;
use crate::solve::{ChannelSolution, Solved};
use crate::system::System;
use crate::weighted::{Weighted, pair_bound};
use crate::work::Work;
use interchange::solution::ErrorLink;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

/// Residual of the importance at which its search stops: the contributions are 1 % too large at most.
const IMPORTANCE_ACCURACY: f64 = 0.01;
/// Links kept.
const MOST_LINKS: usize = 1000;
/// Products for the amplification in the sup norm.
const MOST_STEPS: usize = 200;

/// An error in two norms.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Term {
    /// Sum of A |error of B| relative to the sum of A B.
    pub power: f64,
    /// Largest |error of B|, W m^-2.
    pub sup: f64,
}

/// The three terms of one channel's error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Terms {
    /// By errors of the matrix: a bound, as far as the row errors are one.
    pub matrix: Term,
    /// By what the solver left: a bound.
    pub solver: Term,
    /// By radiosity being constant over elements: an estimate.
    pub discretisation: Term,
}

/// What `--bounds` finds.
#[derive(Debug, Clone, Default)]
pub struct Bounded {
    /// Lower bound of each channel's radiosities.
    pub lower: [Vec<f64>; 3],
    /// Upper bound; infinite where nothing could be proved.
    pub upper: [Vec<f64>; 3],
    /// The terms of each channel.
    pub terms: [Terms; 3],
    /// Contribution of each element by matrix, solver and discretisation, W, over all channels.
    pub element_errors: Vec<[f64; 3]>,
    /// Elements by the sum of the three, the worst first.
    pub ranking: Vec<u32>,
    /// The links with the largest contributions, the worst first.
    pub links: Vec<ErrorLink>,
    /// Passes over the matrix.
    pub products: usize,
}

/// Reflectances of a channel, 0 where none of its light can come.
pub(crate) fn reached(components: &Components, channel: &Channel) -> Vec<f64> {
    let lit = components.any(|i| channel.exitance[i] != 0.0);
    let rho = channel.reflectance.iter().zip(&components.of_element);
    rho.map(|(&rho, &component)| if lit[component as usize] { rho } else { 0.0 }).collect()
}

/// What the solver left of A (F B - H), W. One product.
pub(crate) fn residual_of(
    product: &Product<'_>,
    areas: &[f64],
    radiosity: &[f64],
    irradiance: &[f64],
) -> Vec<f64> {
    let arriving = product.apply(&[radiosity]).swap_remove(0);
    (0..areas.len()).map(|i| arriving[i] - areas[i] * irradiance[i]).collect()
}

/// Bounds, terms and contributions. `residuals` are those of [`crate::discretisation`].
pub fn find(
    system: &System<'_>,
    channels: &[Channel; 3],
    solved: &Solved,
    residuals: &[ElementResidual],
    spread: Spread,
) -> Bounded {
    let n = system.areas.len();
    let components = Components::of(&system.product);
    let mut found = Bounded { element_errors: vec![[0.0; 3]; n], ..Bounded::default() };
    let mut weights: Vec<(Vec<f64>, &[f64])> = Vec::new();
    for (c, channel) in channels.iter().enumerate() {
        let solution = &solved.channels[c];
        if let Some(earlier) = (0..c).find(|&earlier| channels[earlier] == channels[c]) {
            found.lower[c] = found.lower[earlier].clone();
            found.upper[c] = found.upper[earlier].clone();
            found.terms[c] = found.terms[earlier];
            continue;
        }
        let reflectance = reached(&components, channel);
        let residual = residual_of(&system.product, system.areas, &solution.radiosity, &solution.irradiance);
        let known = Known {
            product: &system.product,
            areas: system.areas,
            reflectance: &reflectance,
            exitance: &channel.exitance,
            row_errors: &system.row_errors,
            row_sums: &system.row_sums,
            radiosity: &solution.radiosity,
            residual: &residual,
        };
        let bounds = interval::bounds(&known, spread);
        found.products += bounds.products + 1;
        found.lower[c] = bounds.lower;
        found.upper[c] = bounds.upper;

        let importance =
            Importance::find(&system.product, system.areas, &reflectance, None, IMPORTANCE_ACCURACY);
        let (z, products) = match importance {
            Some(Importance { values, least, products, .. }) => {
                (values.iter().map(|z| z / least).collect(), products)
            }
            None => (vec![f64::INFINITY; n], 0),
        };
        let (sup_factor, more) = sup_amplification(&known);
        found.products += products + more;
        let shares = contributions(&known, &z, residuals, c);
        found.terms[c] = terms(&known, &z, &shares, sup_factor, residuals, c);
        // Equal channels were left out above, and count as often as they occur.
        let times = channels.iter().filter(|other| *other == channel).count() as f64;
        for (sum, share) in found.element_errors.iter_mut().zip(&shares) {
            (0..3).for_each(|term| sum[term] += times * share[term]);
        }
        let weight = (0..n).map(|i| if reflectance[i] > 0.0 { times * z[i] * reflectance[i] } else { 0.0 });
        weights.push((weight.collect(), &solution.radiosity));
    }
    let total = |i: u32| found.element_errors[i as usize].iter().sum::<f64>();
    found.ranking = (0..n as u32).collect();
    found.ranking.sort_by(|&a, &b| total(b).total_cmp(&total(a)).then(a.cmp(&b)));
    found.links = links(system, &weights);
    found
}

/// The matrix's errors, weighted by importance and filled in row by row, where that proves more than the norms do.
///
/// The norms take the brightest reflectance and the largest amplification for all; here each row has its own. Called
/// only where the norms' answer is not good enough, as the importance costs about ten products.
pub fn sharpen(system: &System<'_>, channel: &Channel, solution: &mut ChannelSolution) -> usize {
    let components = Components::of(&system.product);
    let reflectance = reached(&components, channel);
    let residual = vec![0.0; reflectance.len()];
    let known = Known {
        product: &system.product,
        areas: system.areas,
        reflectance: &reflectance,
        exitance: &channel.exitance,
        row_errors: &system.row_errors,
        row_sums: &system.row_sums,
        radiosity: &solution.radiosity,
        residual: &residual,
    };
    let accuracy = IMPORTANCE_ACCURACY;
    let Some(importance) = Importance::find(&system.product, system.areas, &reflectance, None, accuracy)
    else {
        return MOST_STEPS;
    };
    let z: Vec<f64> = importance.values.iter().map(|z| z / importance.least).collect();
    let relative = matrix_power(&known, &z) / power_of(&known);
    let error = &mut solution.matrix_error;
    if relative < error.relative && error.row_error > 0.0 {
        error.relative = relative;
        error.amplification = relative / error.row_error;
    }
    importance.products
}

/// A_i z_i times the three residuals of each element, W.
fn contributions(known: &Known<'_>, z: &[f64], residuals: &[ElementResidual], c: usize) -> Vec<[f64; 3]> {
    let sizes: Vec<f64> = known.radiosity.iter().map(|b| b.abs()).collect();
    let worst = worst_irradiance(known, &sizes);
    (0..z.len())
        .map(|i| {
            let rho = known.reflectance[i];
            if rho == 0.0 {
                return [0.0; 3];
            }
            let matrix = rho * known.areas[i] * worst[i];
            let sampled = residuals.get(i).map_or(0.0, |residual| residual.power[c]);
            [matrix, rho * known.residual[i].abs(), sampled].map(|power| z[i] * power)
        })
        .collect()
}

/// Sum of A |B|, W.
fn power_of(known: &Known<'_>) -> f64 {
    known.radiosity.iter().zip(known.areas).map(|(b, area)| b.abs() * area).sum()
}

/// The most that the row errors change the sum of A |B|, W: each row filled by itself, or all pairs together.
fn matrix_power(known: &Known<'_>, z: &[f64]) -> f64 {
    let sizes: Vec<f64> = known.radiosity.iter().map(|b| b.abs()).collect();
    let worst = worst_irradiance(known, &sizes);
    let importance = |i: usize| if known.reflectance[i] > 0.0 { known.reflectance[i] * z[i] } else { 0.0 };
    let by_rows = (0..sizes.len()).map(|i| importance(i) * known.areas[i] * worst[i]).sum();
    if !known.product.is_symmetric() {
        return by_rows;
    }
    let element = |i: usize| Weighted {
        importance: importance(i),
        size: sizes[i],
        budget: known.areas[i] * known.row_errors[i],
    };
    pair_bound(&(0..sizes.len()).map(element).collect::<Vec<_>>()).min(by_rows)
}

fn terms(
    known: &Known<'_>,
    z: &[f64],
    shares: &[[f64; 3]],
    sup_factor: f64,
    residuals: &[ElementResidual],
    c: usize,
) -> Terms {
    let power = power_of(known);
    let relative = |term: usize| -> f64 {
        let sum: f64 = shares.iter().map(|share| share[term]).sum();
        if power > 0.0 { sum / power } else { 0.0 }
    };
    let sizes: Vec<f64> = known.radiosity.iter().map(|b| b.abs()).collect();
    let worst = worst_irradiance(known, &sizes);
    let rows = || (0..sizes.len()).filter(|&i| known.reflectance[i] > 0.0);
    let largest = |of: &dyn Fn(usize) -> f64| rows().map(of).fold(0.0, f64::max);
    let amplified = |residual: f64| if residual > 0.0 { sup_factor * residual } else { 0.0 };
    let by_matrix = largest(&|i| known.reflectance[i] * worst[i]);
    let by_solver = largest(&|i| known.reflectance[i] * known.residual[i].abs() / known.areas[i]);
    let by_elements = largest(&|i| residuals.get(i).map_or(0.0, |residual| residual.largest[c]));
    let by_matrix_power = if power > 0.0 { matrix_power(known, z) / power } else { 0.0 };
    Terms {
        matrix: Term { power: by_matrix_power, sup: amplified(by_matrix) },
        solver: Term { power: relative(1), sup: amplified(by_solver) },
        discretisation: Term { power: relative(2), sup: amplified(by_elements) },
    }
}

/// |(I - K)^-1| in the sup norm: the largest y with y = 1 + K y, or what is proved of it; and the products that took.
fn sup_amplification(known: &Known<'_>) -> (f64, usize) {
    let n = known.areas.len();
    // y = 1 + rho h with A h - S (rho h) = S 1.
    let right: Vec<f64> = (0..n).map(|i| known.areas[i] * known.row_sums[i]).collect();
    let equation = Equation::new(known.areas, known.reflectance, right);
    let measure = |_: usize, e: &Equation<'_>| sup_residual(e);
    let mut work = Work::new(known.product, vec![equation], measure, IMPORTANCE_ACCURACY, MOST_STEPS);
    work.begin(&[true]);
    let mut method = method::of_any(known.product.is_symmetric());
    let indefinite = method.improve(&mut work).is_err();
    work.ends();
    let products = work.history.len() + 1;
    let mut equation = work.equations.swap_remove(0);
    if indefinite {
        return (f64::INFINITY, products);
    }
    let radiosity: Vec<f64> = equation.reflected().iter().map(|b| 1.0 + b).collect();
    let arriving = known.product.apply(&[&radiosity]).swap_remove(0);
    equation.set_residual(&arriving);
    let least = 1.0 - sup_residual(&equation);
    let lowest = radiosity.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = radiosity.iter().copied().fold(0.0, f64::max);
    (if least > 0.0 && lowest > 0.0 { largest / least } else { f64::INFINITY }, products)
}

fn sup_residual(equation: &Equation<'_>) -> f64 {
    let rows = equation.residual.iter().zip(equation.areas).zip(equation.reflectance);
    rows.map(|((r, area), rho)| rho * (r / area).abs()).fold(0.0, f64::max)
}

/// Bits of an error, and the two elements: of equal errors the one with lower numbers is worse.
type Ranked = (u64, Reverse<u32>, Reverse<u32>);

/// The links of which errors of the matrix cost most, if each row's error is spread evenly over its factors.
fn links(system: &System<'_>, weights: &[(Vec<f64>, &[f64])]) -> Vec<ErrorLink> {
    let share = |i: usize| match system.row_sums[i] > 0.0 {
        true => system.row_errors[i] / system.row_sums[i],
        false => 0.0,
    };
    let shares: Vec<f64> = (0..system.areas.len()).map(share).collect();
    // The least of those kept is on top. Bits of numbers of at least 0 sort like the numbers.
    let mut kept: BinaryHeap<Reverse<Ranked>> = BinaryHeap::new();
    system.product.for_each_until(|i, j, s| {
        let off = s * shares[i].min(shares[j]);
        let change: f64 =
            weights.iter().map(|(weight, b)| weight[i] * b[j].abs() + weight[j] * b[i].abs()).sum();
        let error = off * change;
        if error > 0.0
            && (kept.len() < MOST_LINKS || kept.peek().is_some_and(|least| error.to_bits() > least.0.0))
        {
            let (first, second) = (i.min(j) as u32, i.max(j) as u32);
            kept.push(Reverse((error.to_bits(), Reverse(first), Reverse(second))));
            if kept.len() > MOST_LINKS {
                kept.pop();
            }
        }
        ControlFlow::Continue(())
    });
    let sorted = kept.into_sorted_vec().into_iter();
    sorted
        .map(|Reverse((bits, Reverse(first), Reverse(second)))| ErrorLink {
            first,
            second,
            error: f64::from_bits(bits),
        })
        .collect()
}
