//! One part of the scene, solved by itself: elements that exchange nothing with the others, and the channels that are
//! lit there.

use crate::bound::Amplification;
use crate::equation::{Equation, apply};
use crate::error::{Result, SolveError};
use crate::method::{self, Solver};
use crate::product::Product;
use crate::skips::Skip;
use crate::solve::Options;
use crate::system::System;
use crate::work::{End, Observer, Work};

/// Restarts from the true residual, where rounding has led the recursive one astray. Each has to halve the bound.
const MOST_RESTARTS: usize = 10;
/// Beyond this many steps the time is better spent on looking at the scene.
const MOST_STEPS: usize = 20_000;
/// In exact arithmetic n unknowns take conjugate gradients n steps; rounding can delay the end, so twice that many.
const STEPS_PER_UNKNOWN: usize = 2;
/// Steps without progress before a channel gives up, per amplification: a method that gains a bounce in a step shortens
/// the error by 1 - 1 / amplification, and halves it in so many.
const PATIENCE: f64 = std::f64::consts::LN_2;
const LEAST_PATIENCE: usize = 3;

/// What a method needs to know before it begins.
pub(crate) struct Setup<'a> {
    /// S between all elements of the part.
    pub whole: &'a Product<'a>,
    pub areas: &'a [f64],
    pub members: &'a [bool],
    pub reflectances: &'a [Vec<f64>],
    /// Whether the iteration starts from nothing.
    pub cold: bool,
    pub overshooting: bool,
    pub deflated: bool,
}

/// A channel within a part: 0 outside.
#[derive(Debug)]
pub(crate) struct PartChannel {
    /// For messages.
    pub name: &'static str,
    pub reflectance: Vec<f64>,
    pub exitance: Vec<f64>,
    /// Irradiance to start from.
    pub start: Option<Vec<f64>>,
}

/// What came out for one channel.
#[derive(Debug)]
pub(crate) struct PartSolution {
    /// F B of the last iterate, on the part's elements; at least 0 where that is known of the truth.
    pub irradiance: Vec<f64>,
    pub history: Vec<f64>,
    pub end: End,
    pub amplification: Amplification,
    /// Power emitted in the part, W.
    pub emitted: f64,
    /// Irradiances that came out below 0 and were raised to it.
    pub raised: usize,
}

/// What came out for the part.
#[derive(Debug, Default)]
pub(crate) struct Outcome {
    pub method: String,
    pub channels: Vec<PartSolution>,
    /// Passes over the matrix, or as much work.
    pub products: usize,
    /// Passes for the bounds alone.
    pub bound_products: usize,
    /// Entries that a step reads.
    pub entries_read: u64,
}

/// Solves the part: its elements are the `members`.
pub(crate) fn solve_part(
    system: &System<'_>,
    members: &[bool],
    channels: &[PartChannel],
    options: &Options,
    observer: Option<&mut Observer<'_>>,
) -> Result<Outcome> {
    let areas = system.areas;
    let marked = |is: &dyn Fn(&PartChannel, usize) -> bool| -> Vec<bool> {
        (0..areas.len()).map(|i| channels.iter().any(|channel| is(channel, i))).collect()
    };
    let reflecting = marked(&|channel, i| channel.reflectance[i] > 0.0);
    let emitting = marked(&|channel, i| channel.exitance[i] != 0.0);
    let shining: Vec<bool> = reflecting.iter().zip(&emitting).map(|(a, b)| *a || *b).collect();
    let restricted = |wanted: &[bool], sources: &[bool]| match options.skips.has(Skip::BlackRows) {
        true => system.product.restricted(wanted, sources),
        false => system.product.restricted(members, members),
    };
    let whole = system.product.restricted(members, members);
    let from_emitters = restricted(&reflecting, &emitting);
    let inner = restricted(&reflecting, &reflecting);
    let to_all = restricted(members, &shining);

    // What proves a bound, once per distinct reflectance.
    let reflectances: Vec<Vec<f64>> = channels.iter().map(|channel| channel.reflectance.clone()).collect();
    let borrowed: Vec<&[f64]> = reflectances.iter().map(Vec::as_slice).collect();
    let seen = inner.apply_transposed(&borrowed);
    let mut bound_products = 1;
    let mut amplifications: Vec<Amplification> = Vec::new();
    for (c, rho) in reflectances.iter().enumerate() {
        let known = reflectances[..c].iter().position(|earlier| earlier == rho);
        let amplification = match known {
            Some(earlier) => amplifications[earlier],
            None => {
                let (found, products) = Amplification::find(&inner, areas, rho, &seen[c]);
                bound_products += products;
                found
            }
        };
        amplifications.push(amplification);
    }
    let emitted: Vec<f64> = channels
        .iter()
        .map(|channel| channel.exitance.iter().zip(areas).map(|(e, area)| e.abs() * area).sum())
        .collect();

    // Without a bound the residual itself has to decide when to stop; what is noted stays infinite.
    let scale = |(amplification, &emitted): (&Amplification, &f64)| match emitted > 0.0 {
        true if amplification.factor.is_finite() => amplification.factor / emitted,
        true => 1.0 / emitted,
        // Without light there is nothing to be wrong by.
        false => 0.0,
    };
    let scales: Vec<f64> = amplifications.iter().zip(&emitted).map(scale).collect();
    let norms: Vec<f64> = amplifications.iter().map(|a| a.norm).collect();

    let unknowns = reflectances.iter().map(|rho| rho.iter().filter(|&&r| r > 0.0).count()).max().unwrap_or(0);
    let (solver, described) = method::choose(options.solver, system.product.is_symmetric(), unknowns)?;
    let setup = Setup {
        whole: &whole,
        areas,
        members,
        reflectances: &reflectances,
        cold: channels.iter().all(|channel| channel.start.is_none()),
        overshooting: options.overshooting,
        deflated: options.skips.has(Skip::ConstantMode),
    };
    let indefinite =
        |error: method::Indefinite| SolveError::NotPositiveDefinite { channel: channels[error.0].name };
    let mut method = method::method(solver, &setup).map_err(indefinite)?;

    // The first residual: what the emitters send, and what a start reflects.
    let exitances: Vec<&[f64]> = channels.iter().map(|channel| channel.exitance.as_slice()).collect();
    let direct = from_emitters.apply(&exitances);
    let mut products = 1;
    let mut equations: Vec<Equation<'_>> = Vec::new();
    for (c, direct) in direct.into_iter().enumerate() {
        let equation = Equation::new(areas, &reflectances[c], direct);
        equations.push(Equation { exitance: &channels[c].exitance, seen: Some(&seen[c]), ..equation });
    }
    if !setup.cold {
        for (equation, channel) in equations.iter_mut().zip(channels) {
            if let Some(start) = &channel.start {
                warm_up(equation, start, &inner);
            }
        }
        products += 1;
    }

    let target = if options.skips.has(Skip::EarlyStop) { options.tolerance } else { 0.0 };
    let mut most_steps = options.most_steps.unwrap_or(MOST_STEPS);
    if solver == Solver::Cg {
        most_steps = most_steps.min(STEPS_PER_UNKNOWN * unknowns + 10);
    }
    let measures = scales.clone();
    let measure = move |c: usize, e: &Equation<'_>| measures[c] * e.residual_power();
    let mut work = Work::new(&inner, equations, measure, target, most_steps);
    let unshot_scales: Vec<f64> = scales.iter().zip(&norms).map(|(scale, norm)| scale * norm).collect();
    work.measure_unshot = Box::new(move |c, power| unshot_scales[c] * power);
    let largest = amplifications.iter().map(|a| a.factor).filter(|f| f.is_finite()).fold(1.0, f64::max);
    let patience = ((PATIENCE * largest) as usize).max(LEAST_PATIENCE);
    work.observer = observer.map(|observer| -> &mut Observer<'_> { observer });

    // Each round improves the iterates by the method and then checks them with the true residual, which the product
    // for H gives without further cost.
    let mut bounds = vec![f64::INFINITY; channels.len()];
    let mut irradiances: Vec<Vec<f64>> = Vec::new();
    let mut ends = vec![End::Stagnated; channels.len()];
    for round in 0..=MOST_RESTARTS {
        // A channel that is done stays as it is, so that it does not depend on the others.
        let open: Vec<bool> = bounds.iter().map(|&bound| bound > target).collect();
        work.patience = patience;
        work.begin(&open);
        if round == 0 {
            work.note();
        }
        method.improve(&mut work).map_err(indefinite)?;
        let round_ends = work.ends();
        for c in (0..ends.len()).filter(|&c| open[c]) {
            ends[c] = round_ends[c];
        }
        let radiosities: Vec<Vec<f64>> = work
            .equations
            .iter()
            .map(|e| e.exitance.iter().zip(e.reflected()).map(|(e, reflected)| e + reflected).collect())
            .collect();
        let arriving = apply(&to_all, &radiosities);
        products += 1;
        for (equation, arriving) in work.equations.iter_mut().zip(&arriving) {
            equation.set_residual(arriving);
        }
        // The bound on E + rho F B, one bounce more than the iterate's B, which makes the error smaller by |K|.
        let now: Vec<f64> =
            (0..channels.len()).map(|c| norms[c] * scales[c] * work.equations[c].residual_power()).collect();
        work.history.push(now.clone());
        let improved = now.iter().zip(&bounds).any(|(now, before)| *now > target && *now <= 0.5 * before);
        bounds = now;
        irradiances = arriving
            .into_iter()
            .map(|arriving| arriving.iter().zip(areas).map(|(power, area)| power / area).collect())
            .collect();
        if bounds.iter().all(|&bound| bound <= target) || !improved || work.steps_left == 0 {
            break;
        }
    }

    // With light only given and every bounce of it dying away nothing could have come out below 0.
    let emits_only: Vec<bool> =
        channels.iter().map(|channel| channel.exitance.iter().all(|&e| e >= 0.0)).collect();
    for (c, channel) in channels.iter().enumerate() {
        let proved = amplifications[c].factor.is_finite();
        let reflected: f64 =
            (0..areas.len()).map(|i| areas[i] * reflectances[c][i] * irradiances[c][i]).sum();
        if !proved && emits_only[c] && reflected < 0.0 {
            return Err(SolveError::Gaining { channel: channel.name, norm: norms[c] });
        }
    }

    products += most_steps - work.steps_left;
    let history = std::mem::take(&mut work.history);
    let outcome = (0..channels.len()).map(|c| {
        let known = amplifications[c].factor.is_finite();
        let raised = if known && emits_only[c] { raise_to_zero(&mut irradiances[c]) } else { 0 };
        let noted = |measure: f64| if known { measure } else { f64::INFINITY };
        PartSolution {
            irradiance: std::mem::take(&mut irradiances[c]),
            history: history.iter().map(|measures| noted(measures[c])).collect(),
            end: match ends[c] {
                _ if bounds[c] <= options.tolerance => End::Converged,
                // What the recursion believed is not true: rounding.
                End::Converged => End::Stagnated,
                end => end,
            },
            amplification: amplifications[c],
            emitted: emitted[c],
            raised,
        }
    });
    Ok(Outcome {
        method: described,
        channels: outcome.collect(),
        products,
        bound_products,
        entries_read: inner.entries_read(),
    })
}

/// Raises irradiances below 0 to 0 and counts them: iterates swing about the truth, and in a dark corner farther than
/// what there is.
///
/// Where nothing draws light out and the bounces are proved to die away, the truth is a sum of bounces, each at least 0.
/// So no element gets farther from it, and the bound stands. Another sweep would not do: it passes a negative on.
fn raise_to_zero(irradiance: &mut [f64]) -> usize {
    let below = irradiance.iter_mut().filter(|h| **h < 0.0);
    below.map(|h| *h = 0.0).count()
}

/// Starts from an older irradiance, stretched so that what is left of the residual has no part along it: after a change
/// of a lamp's power alone nothing is left at all.
fn warm_up(equation: &mut Equation<'_>, start: &[f64], product: &Product<'_>) {
    let reflected: Vec<f64> = start.iter().zip(equation.reflectance).map(|(h, rho)| rho * h).collect();
    let arriving = product.apply(&[&reflected]).swap_remove(0);
    let image: Vec<f64> = (0..start.len()).map(|i| equation.areas[i] * start[i] - arriving[i]).collect();
    let along = |values: &[f64]| -> f64 { values.iter().zip(&reflected).map(|(v, r)| v * r).sum() };
    let height = along(&equation.residual) / along(&image);
    if height.is_finite() {
        equation.irradiance = start.iter().map(|h| height * h).collect();
        equation.residual.iter_mut().zip(&image).for_each(|(r, image)| *r -= height * image);
    }
}
