//! From system and channels to radiosity: finds the parts that have to be solved, has each solved until its proved
//! bound meets the tolerance, and accounts for what came out.

use crate::bound::{Amplification, Proof};
use crate::channels::{Channel, Distinct};
use crate::components::Components;
use crate::energy::Energy;
use crate::error::{Result, SolveError};
use crate::error_budget::{MatrixError, PartPower, matrix_error};
use crate::lossless;
pub use crate::method::Solver;
use crate::part::{Outcome, PartChannel, PartSolution, solve_part};
use crate::skips::{Skip, Skips};
use crate::system::System;
use crate::work::{End, Shown};

/// Parts that are solved one by one; where there are more, the smallest are one part.
const MOST_PARTS: usize = 64;

/// How to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Method.
    pub solver: Solver,
    /// Bound on the power-norm error relative to the emitted power, above 0.
    pub tolerance: f64,
    /// Most steps of the iteration in each part.
    pub most_steps: Option<usize>,
    /// Whether Southwell's relaxation overshoots.
    pub overshooting: bool,
    /// Work that is left out.
    pub skips: Skips,
    /// Irradiance of an older solution to start from, per element.
    pub start: Option<Vec<[f64; 3]>>,
}

impl Options {
    /// This method to this tolerance; everything else as it is by default.
    pub fn new(solver: Solver, tolerance: f64) -> Self {
        let skips = Skips::default();
        Self { solver, tolerance, most_steps: None, overshooting: false, skips, start: None }
    }
}

/// The solution of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSolution {
    /// B = E + rho H, W m^-2.
    pub radiosity: Vec<f64>,
    /// H = F B, W m^-2, of every element, black ones included.
    pub irradiance: Vec<f64>,
    /// Bound on the error relative to the emitted power, in the power norm, after each product.
    pub history: Vec<f64>,
    /// The last of them; 0 for a dark channel.
    pub bound: f64,
    /// How the iteration ended, in the part where it went worst.
    pub end: End,
    /// |(I - K)^-1| in the power norm, in the part where it is largest; 1 for a dark channel.
    pub amplification: f64,
    /// What errors of the matrix may have done.
    pub matrix_error: MatrixError,
    /// Where the power went.
    pub energy: Energy,
}

/// The solution of all channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Red, green, blue.
    pub channels: [ChannelSolution; 3],
    /// Method used, and why where it was not asked for by name.
    pub method: String,
    /// Things counted, for the report.
    pub counters: Vec<(String, usize)>,
    /// Bounds that are not what they seem.
    pub warnings: Vec<String>,
}

impl Solved {
    /// A counter, 0 where nothing was counted.
    pub fn counter(&self, name: &str) -> usize {
        self.counters.iter().find(|(known, _)| known == name).map_or(0, |(_, amount)| *amount)
    }
}

/// Receives solutions on their way: the number of steps or shots, and the three channels.
pub type Viewer<'a> = dyn FnMut(usize, &dyn Fn() -> [Shown; 3]) + 'a;

/// Solves the three channels to `tolerance`: the bound on the power-norm error relative to the emitted power.
///
/// The answer is returned also where the tolerance was not met; the bounds tell.
///
/// # Errors
/// A lossless lit component; a system that is not positive definite; a method that cannot take the system.
pub fn solve(system: &System<'_>, channels: &[Channel; 3], solver: Solver, tolerance: f64) -> Result<Solved> {
    solve_with(system, channels, &Options::new(solver, tolerance), None)
}

/// [`solve`] with all options, and with a viewer of the work in progress.
///
/// # Errors
/// As [`solve`].
pub fn solve_with(
    system: &System<'_>,
    channels: &[Channel; 3],
    options: &Options,
    viewer: Option<&mut Viewer<'_>>,
) -> Result<Solved> {
    let distinct = match options.skips.has(Skip::EqualChannels) {
        true => Distinct::of(channels),
        false => Distinct::all(channels),
    };
    let lit: Vec<usize> = (0..distinct.channels.len()).filter(|&d| distinct.channels[d].emits()).collect();
    let different = distinct.channels.len();
    let mut counters =
        vec![("distinct channels".into(), different), ("dark channels".into(), different - lit.len())];
    let mut run = Run::new(system, &distinct, options);

    if !lit.is_empty() {
        let components = Components::of(&system.product);
        counters.push(("components".into(), components.count));
        for &d in &lit {
            if let Some(found) = lossless::find(system, &components, &distinct.channels[d], distinct.name(d))
            {
                return Err(SolveError::Lossless(found));
            }
        }
        run.solve(&lit, &components, viewer)?;
        run.account(&lit, &components, &mut counters);
    }

    let channels = std::array::from_fn(|c| run.finish(distinct.index[c], distinct.scale[c], &channels[c]));
    let method = run.method.unwrap_or_else(|| "none (nothing emits)".to_owned());
    Ok(Solved { channels, method, counters, warnings: run.warnings })
}

/// A distinct channel while its parts are put together.
struct Whole {
    irradiance: Vec<f64>,
    parts: Vec<PartPower>,
    /// Emitted power and history of each part.
    histories: Vec<(f64, Vec<f64>)>,
    end: End,
    amplification: f64,
}

struct Run<'a> {
    system: &'a System<'a>,
    distinct: &'a Distinct,
    options: &'a Options,
    wholes: Vec<Whole>,
    method: Option<String>,
    warnings: Vec<String>,
    parts: usize,
    products: usize,
    bound_products: usize,
    entries_read: u64,
    raised: usize,
}

impl<'a> Run<'a> {
    fn new(system: &'a System<'a>, distinct: &'a Distinct, options: &'a Options) -> Self {
        let empty = || Whole {
            irradiance: vec![0.0; system.areas.len()],
            parts: Vec::new(),
            histories: Vec::new(),
            end: End::Converged,
            amplification: 1.0,
        };
        Self {
            system,
            distinct,
            options,
            wholes: distinct.channels.iter().map(|_| empty()).collect(),
            method: None,
            warnings: Vec::new(),
            parts: 0,
            products: 0,
            bound_products: 0,
            entries_read: 0,
            raised: 0,
        }
    }

    /// Solves part after part.
    fn solve(
        &mut self,
        lit: &[usize],
        components: &Components,
        mut viewer: Option<&mut Viewer<'_>>,
    ) -> Result<()> {
        let (distinct, options) = (self.distinct, self.options);
        let lit_in: Vec<Vec<bool>> =
            lit.iter().map(|&d| components.any(|i| distinct.channels[d].exitance[i] != 0.0)).collect();
        let any_lit = |component: usize| lit_in.iter().any(|lit| lit[component]);
        // A component of one element exchanges nothing.
        let mut sizes = vec![0usize; components.count];
        components.of_element.iter().for_each(|&component| sizes[component as usize] += 1);
        let skip_unlit = options.skips.has(Skip::UnlitComponents);
        let mut wanted: Vec<usize> = (0..components.count)
            .filter(|&component| !skip_unlit || (any_lit(component) && sizes[component] > 1))
            .collect();
        // Snapshots show everything at the same number of steps.
        let apart = options.skips.has(Skip::ComponentsApart) && viewer.is_none();
        wanted.sort_by_key(|&component| (std::cmp::Reverse(sizes[component]), component));
        let groups: Vec<Vec<usize>> = match apart {
            true => {
                let (large, small) = wanted.split_at(wanted.len().min(MOST_PARTS - 1));
                let rest = (!small.is_empty()).then(|| small.to_vec());
                large.iter().map(|&component| vec![component]).chain(rest).collect()
            }
            false => vec![wanted],
        };

        for group in groups.iter().filter(|group| !group.is_empty()) {
            let mut chosen = vec![false; components.count];
            group.iter().for_each(|&component| chosen[component] = true);
            let component = |i: usize| components.of_element[i] as usize;
            let members: Vec<bool> = (0..components.of_element.len()).map(|i| chosen[component(i)]).collect();
            let here: Vec<usize> =
                (0..lit.len()).filter(|&l| !skip_unlit || group.iter().any(|&c| lit_in[l][c])).collect();
            if here.is_empty() {
                continue;
            }
            let channels: Vec<PartChannel> = here
                .iter()
                .map(|&l| {
                    let takes_part = |i: usize| members[i] && (!skip_unlit || lit_in[l][component(i)]);
                    self.part_channel(lit[l], takes_part)
                })
                .collect();
            let (index, scale) = (distinct.index, distinct.scale);
            let place = index.map(|d| here.iter().position(|&l| lit[l] == d));
            let elements = members.len();
            let dark =
                || Shown { irradiance: vec![0.0; elements], unshot: vec![0.0; elements], ambient: 0.0 };
            let mut show = viewer.as_mut().map(|viewer| {
                move |step: usize, look: &dyn Fn(usize) -> Shown| {
                    viewer(step, &|| {
                        std::array::from_fn(|c| {
                            let mut shown = place[c].map_or_else(dark, look);
                            let numbers = shown.irradiance.iter_mut().chain(&mut shown.unshot);
                            numbers.for_each(|x| *x *= scale[c]);
                            shown.ambient *= scale[c];
                            shown
                        })
                    });
                }
            });
            let observer = show.as_mut().map(|show| show as &mut dyn FnMut(usize, &dyn Fn(usize) -> Shown));
            let outcome = solve_part(self.system, &members, &channels, options, observer)?;
            self.merge(&members, &here.iter().map(|&l| lit[l]).collect::<Vec<_>>(), &channels, outcome);
        }
        Ok(())
    }

    fn part_channel(&self, d: usize, takes_part: impl Fn(usize) -> bool) -> PartChannel {
        let channel = &self.distinct.channels[d];
        let masked = |values: &[f64]| -> Vec<f64> {
            values.iter().enumerate().map(|(i, &x)| if takes_part(i) { x } else { 0.0 }).collect()
        };
        // The distinct channel is the first of those it stands for.
        let first = self.distinct.index.iter().position(|&index| index == d).unwrap_or(0);
        let start = self.options.start.as_ref().map(|start| {
            let own: Vec<f64> = start.iter().map(|irradiance| irradiance[first]).collect();
            masked(&own)
        });
        PartChannel {
            name: self.distinct.name(d),
            reflectance: masked(&channel.reflectance),
            exitance: masked(&channel.exitance),
            start,
        }
    }

    fn merge(&mut self, members: &[bool], channels: &[usize], given: &[PartChannel], outcome: Outcome) {
        self.parts += 1;
        self.products += outcome.products;
        self.bound_products += outcome.bound_products;
        self.entries_read += outcome.entries_read;
        for ((&d, given), part) in channels.iter().zip(given).zip(outcome.channels) {
            self.merge_channel(members, d, given, part);
        }
        self.method = Some(match self.method.take() {
            Some(known) if known != outcome.method => format!("{known}; {}", outcome.method),
            _ => outcome.method,
        });
    }

    fn merge_channel(&mut self, members: &[bool], d: usize, given: &PartChannel, part: PartSolution) {
        if part.amplification.proof == Proof::None {
            self.warnings.push(format!(
                "{} channel: no bound on the error could be proved (an element sees a mean reflectance of {}); the \
                 iteration stopped by its residual alone",
                given.name, part.amplification.norm
            ));
        }
        let whole = &mut self.wholes[d];
        for i in (0..members.len()).filter(|&i| members[i]) {
            whole.irradiance[i] = part.irradiance[i];
        }
        self.raised += part.raised;
        if part.end != End::Converged {
            whole.end = part.end;
        }
        whole.amplification = whole.amplification.max(part.amplification.factor);
        let Amplification { factor, .. } = part.amplification;
        let brightest = given.reflectance.iter().copied().fold(0.0, f64::max);
        let wrong = (0..members.len()).filter(|&i| members[i]).map(|i| {
            let radiosity = given.exitance[i] + given.reflectance[i] * part.irradiance[i];
            self.system.areas[i] * radiosity.abs() * self.system.row_errors[i]
        });
        whole.parts.push(PartPower { factor, brightest, wrong: wrong.sum() });
        whole.histories.push((part.emitted, part.history));
    }

    fn account(&self, lit: &[usize], components: &Components, counters: &mut Vec<(String, usize)>) {
        let mut unlit_elements = 0;
        for &d in lit {
            let (name, channel) = (self.distinct.name(d), &self.distinct.channels[d]);
            let reached = components.any(|i| channel.exitance[i] != 0.0);
            let is_reached = |i: usize| reached[components.of_element[i] as usize];
            let elements = 0..channel.reflectance.len();
            let black = channel.reflectance.iter().filter(|&&rho| rho == 0.0).count();
            let unknowns =
                elements.clone().filter(|&i| channel.reflectance[i] > 0.0 && is_reached(i)).count();
            counters.push((format!("unknowns {name}"), unknowns));
            counters.push((format!("rows without reflectance {name}"), black));
            unlit_elements += elements.filter(|&i| !is_reached(i)).count();
        }
        if self.options.start.is_some() {
            counters.push(("channels started from an older solution".into(), lit.len()));
        }
        counters.push(("elements no light can reach".into(), unlit_elements));
        counters.push(("parts solved apart".into(), self.parts));
        counters.push(("products".into(), self.products));
        counters.push(("products for bounds".into(), self.bound_products));
        counters.push(("irradiances raised to 0".into(), self.raised));
        let left_out = self.system.product.entries_read().saturating_sub(self.entries_read);
        counters.push(("entries left out of a step".into(), left_out as usize));
    }

    /// The finished channel: B = E + rho H with the H of the last product.
    fn finish(&self, d: usize, scale: f64, channel: &Channel) -> ChannelSolution {
        let whole = &self.wholes[d];
        let irradiance: Vec<f64> = whole.irradiance.iter().map(|h| scale * h).collect();
        let reflected = irradiance.iter().zip(&channel.reflectance).map(|(h, rho)| rho * h);
        let radiosity: Vec<f64> = channel.exitance.iter().zip(reflected).map(|(e, b)| e + b).collect();
        let power: f64 = radiosity.iter().zip(self.system.areas).map(|(b, area)| b.abs() * area).sum();
        // A channel that is not solved is known exactly: its error is 0 throughout.
        let emitted: f64 = whole.histories.iter().map(|(emitted, _)| emitted).sum();
        let length = whole.histories.iter().map(|(_, history)| history.len()).max().unwrap_or(0);
        let share = |k: usize| -> f64 {
            let parts = whole.histories.iter().filter(|(_, history)| !history.is_empty());
            parts.map(|(part, history)| if *part > 0.0 { part / emitted } else { 0.0 } * history[k.min(history.len() - 1)]).sum()
        };
        let history: Vec<f64> = (0..length).map(share).collect();
        ChannelSolution {
            energy: Energy::of(self.system, channel, &radiosity, &irradiance),
            bound: history.last().copied().unwrap_or(0.0),
            history,
            end: whole.end,
            amplification: whole.amplification,
            matrix_error: matrix_error(&whole.parts, power / scale.abs()),
            radiosity,
            irradiance,
        }
    }
}
