//! From system and channels to radiosity: chooses the method, runs it until the proved bound meets the tolerance,
//! and accounts for what came out.

use crate::bound::{Amplification, Proof};
use crate::cg;
use crate::channels::{Channel, Distinct};
use crate::components::Components;
use crate::direct::{AUTO_UNKNOWNS, Factor, MOST_UNKNOWNS};
use crate::energy::Energy;
use crate::equation::{Equation, apply};
use crate::error::{Result, SolveError};
use crate::error_budget::{MatrixError, matrix_error};
use crate::lossless;
use crate::system::System;

/// A method that solves the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Solver {
    /// Direct for few unknowns, conjugate gradients otherwise
    Auto,
    /// Conjugate gradients
    Cg,
    /// Cholesky factorisation
    Direct,
}

/// Restarts from the true residual, where rounding has led the recursive one astray. Each has to halve the bound.
const MOST_RESTARTS: usize = 10;

/// The solution of one channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChannelSolution {
    /// B = E + rho H, W m^-2.
    pub radiosity: Vec<f64>,
    /// H = F B, W m^-2, of every element, black ones included.
    pub irradiance: Vec<f64>,
    /// Bound on the error relative to the emitted power, in the power norm, after each product.
    pub history: Vec<f64>,
    /// The last of them; 0 for a dark channel.
    pub bound: f64,
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

/// Solves the three channels to `tolerance`: the bound on the power-norm error relative to the emitted power.
///
/// The answer is returned also where the tolerance was not met; the bounds tell.
///
/// # Errors
/// A lossless lit component; a system that is not positive definite; too many unknowns for `Solver::Direct`.
pub fn solve(system: &System<'_>, channels: &[Channel; 3], solver: Solver, tolerance: f64) -> Result<Solved> {
    let distinct = Distinct::of(channels);
    let lit: Vec<usize> = (0..distinct.channels.len()).filter(|&d| distinct.channels[d].emits()).collect();
    let different = distinct.channels.len();
    let mut counters =
        vec![("distinct channels".into(), different), ("dark channels".into(), different - lit.len())];
    let mut warnings = Vec::new();
    let mut solved = vec![None; distinct.channels.len()];
    let mut method = "none (nothing emits)".to_owned();

    if !lit.is_empty() {
        let components = Components::of(&system.product);
        counters.push(("components".into(), components.count));
        for &d in &lit {
            if let Some(found) = lossless::find(system, &components, &distinct.channels[d], distinct.name(d))
            {
                return Err(SolveError::Lossless(found));
            }
        }
        let mut run = Run::new(system, &distinct, &lit, &components);
        method = run.choose(solver)?;
        run.solve(&method, tolerance)?;
        run.account(&mut counters, &mut warnings);
        for (l, &d) in lit.iter().enumerate() {
            solved[d] = Some(run.finish(l));
        }
    }

    let dark = ChannelSolution {
        radiosity: vec![0.0; system.areas.len()],
        irradiance: vec![0.0; system.areas.len()],
        ..ChannelSolution::default()
    };
    let channels = distinct.index.map(|d| solved[d].clone().unwrap_or_else(|| dark.clone()));
    Ok(Solved { channels, method, counters, warnings })
}

/// The distinct lit channels on their way.
struct Run<'a> {
    system: &'a System<'a>,
    names: Vec<&'static str>,
    channels: Vec<&'a Channel>,
    emitted: Vec<f64>,
    /// Reflectances, 0 where no light can come.
    reflectances: Vec<Vec<f64>>,
    amplifications: Vec<Amplification>,
    /// Iterates H, then F B of the last one.
    irradiances: Vec<Vec<f64>>,
    histories: Vec<Vec<f64>>,
    unlit_elements: usize,
    products: usize,
}

impl<'a> Run<'a> {
    fn new(system: &'a System<'a>, distinct: &'a Distinct, lit: &[usize], components: &Components) -> Self {
        let channels: Vec<&Channel> = lit.iter().map(|&d| &distinct.channels[d]).collect();
        let mut unlit_elements = 0;
        let reflectances: Vec<Vec<f64>> = channels
            .iter()
            .map(|channel| {
                let reached = components.any(|i| channel.exitance[i] > 0.0);
                let is_reached = |i: usize| reached[components.of_element[i] as usize];
                unlit_elements += (0..system.areas.len()).filter(|&i| !is_reached(i)).count();
                let rho = channel.reflectance.iter().enumerate();
                rho.map(|(i, &rho)| if is_reached(i) { rho } else { 0.0 }).collect()
            })
            .collect();
        let seen = apply(&system.product, &reflectances);
        let amplifications = reflectances
            .iter()
            .zip(&seen)
            .map(|(rho, seen)| Amplification::find(system, rho, seen))
            .collect();
        Self {
            system,
            names: lit.iter().map(|&d| distinct.name(d)).collect(),
            emitted: channels.iter().map(|c| c.emitted(system.areas)).collect(),
            histories: vec![Vec::new(); channels.len()],
            irradiances: Vec::new(),
            channels,
            reflectances,
            amplifications,
            unlit_elements,
            products: 0,
        }
    }

    fn unknowns(&self, l: usize) -> usize {
        self.reflectances[l].iter().filter(|&&rho| rho > 0.0).count()
    }

    /// The method, with the reason where it was left to the program.
    fn choose(&self, solver: Solver) -> Result<String> {
        let unknowns = (0..self.channels.len()).map(|l| self.unknowns(l)).max().unwrap_or(0);
        match solver {
            Solver::Cg => Ok("cg".into()),
            Solver::Direct if unknowns > MOST_UNKNOWNS => {
                Err(SolveError::TooManyUnknowns { unknowns, most: MOST_UNKNOWNS })
            }
            Solver::Direct => Ok("direct".into()),
            Solver::Auto if unknowns <= AUTO_UNKNOWNS => {
                Ok(format!("direct (auto: {unknowns} unknowns, at most {AUTO_UNKNOWNS})"))
            }
            Solver::Auto => Ok(format!("cg (auto: {unknowns} unknowns, more than {AUTO_UNKNOWNS})")),
        }
    }

    /// Iterates until every channel's bound meets the tolerance or can be brought no lower.
    fn solve(&mut self, method: &str, tolerance: f64) -> Result<()> {
        let system = self.system;
        let reflectances = std::mem::take(&mut self.reflectances);
        let exitances: Vec<&[f64]> = self.channels.iter().map(|c| c.exitance.as_slice()).collect();
        let mut equations: Vec<Equation<'_>> = system
            .product
            .apply(&exitances)
            .into_iter()
            .zip(&reflectances)
            .map(|(direct, rho)| Equation::new(system.areas, rho, direct))
            .collect();
        self.products += 1;
        let first: Vec<f64> = equations.iter().enumerate().map(|(l, e)| self.bound(l, e)).collect();
        self.note(&first);

        // Each round improves the iterates by the method and then checks them with the true residual, which the
        // product for H gives without further cost.
        let factors = match method.starts_with("direct") {
            true => Some(self.factors(&reflectances)?),
            false => None,
        };
        let mut bounds = vec![f64::INFINITY; equations.len()];
        for _ in 0..=MOST_RESTARTS {
            // A channel that is done stays as it is, so that it does not depend on the others.
            let open: Vec<bool> = bounds.iter().map(|&bound| bound > tolerance).collect();
            match &factors {
                Some((factors, index)) => {
                    let open = equations.iter_mut().zip(index).zip(&open).filter(|(_, open)| **open);
                    open.for_each(|((equation, &f), _)| factors[f].improve(equation));
                }
                None => self.conjugate_gradients(&mut equations, &open, tolerance)?,
            }
            let radiosities: Vec<Vec<f64>> =
                equations.iter().zip(&self.channels).map(|(e, c)| radiosity(c, &e.reflected())).collect();
            let arriving = apply(&system.product, &radiosities);
            self.products += 1;
            for (equation, arriving) in equations.iter_mut().zip(&arriving) {
                equation.set_residual(arriving);
            }
            let now: Vec<f64> =
                equations.iter().enumerate().map(|(l, e)| self.gathered_bound(l, e)).collect();
            self.note(&now);
            let improved =
                now.iter().zip(&bounds).any(|(now, before)| *now > tolerance && *now <= 0.5 * before);
            bounds = now;
            let met = bounds.iter().all(|&bound| bound <= tolerance);
            self.irradiances = arriving
                .into_iter()
                .map(|arriving| arriving.iter().zip(system.areas).map(|(p, a)| p / a).collect())
                .collect();
            if met || !improved {
                break;
            }
        }
        drop(equations);
        self.reflectances = reflectances;
        Ok(())
    }

    /// One factor per distinct reflectance vector, and which of them each channel has.
    fn factors(&self, reflectances: &[Vec<f64>]) -> Result<(Vec<Factor>, Vec<usize>)> {
        let (mut factors, mut index, mut owners): (Vec<Factor>, Vec<usize>, Vec<usize>) = Default::default();
        for (l, rho) in reflectances.iter().enumerate() {
            let known = owners.iter().position(|&owner| reflectances[owner] == *rho);
            index.push(known.unwrap_or(factors.len()));
            if known.is_none() {
                let factor = Factor::new(&self.system.product, self.system.areas, rho);
                factors.push(factor.ok_or(SolveError::NotPositiveDefinite { channel: self.names[l] })?);
                owners.push(l);
            }
        }
        Ok((factors, index))
    }

    fn conjugate_gradients(
        &mut self,
        equations: &mut [Equation<'_>],
        open: &[bool],
        tolerance: f64,
    ) -> Result<()> {
        let mut histories = Vec::new();
        let outcome = cg::improve(
            &self.system.product,
            equations,
            |l, e| if open[l] { self.bound(l, e) } else { 0.0 },
            tolerance,
            None,
            |measures| histories.push(measures.to_vec()),
        );
        self.products += histories.len();
        histories.iter().for_each(|measures| self.note(measures));
        match outcome {
            Ok(_) => Ok(()),
            Err(cg::Indefinite(l)) => Err(SolveError::NotPositiveDefinite { channel: self.names[l] }),
        }
    }

    /// Bound on the error of the iterate's B relative to the emitted power.
    fn bound(&self, l: usize, equation: &Equation<'_>) -> f64 {
        let factor = self.amplifications[l].factor;
        // Without a bound the residual itself has to decide when to stop; what is noted stays infinite.
        let factor = if factor.is_finite() { factor } else { 1.0 };
        factor * equation.residual_power() / self.emitted[l]
    }

    /// Bound on the error of E + rho F B: one bounce more than the iterate's B, which makes the error smaller by |K|.
    fn gathered_bound(&self, l: usize, equation: &Equation<'_>) -> f64 {
        self.amplifications[l].norm * self.bound(l, equation)
    }

    fn note(&mut self, measures: &[f64]) {
        for (l, &measure) in measures.iter().enumerate() {
            let known = self.amplifications[l].factor.is_finite();
            self.histories[l].push(if known { measure } else { f64::INFINITY });
        }
    }

    fn account(&self, counters: &mut Vec<(String, usize)>, warnings: &mut Vec<String>) {
        for (l, name) in self.names.iter().enumerate() {
            let black = self.channels[l].reflectance.iter().filter(|&&rho| rho == 0.0).count();
            counters.push((format!("unknowns {name}"), self.unknowns(l)));
            counters.push((format!("rows without reflectance {name}"), black));
            let amplification = &self.amplifications[l];
            if amplification.proof == Proof::None {
                warnings.push(format!(
                    "{name} channel: no bound on the error could be proved (an element sees a mean reflectance of {}); \
                     the iteration stopped by its residual alone",
                    amplification.norm
                ));
            }
        }
        counters.push(("elements no light can reach".into(), self.unlit_elements));
        counters.push(("products".into(), self.products));
    }

    /// The finished channel: B = E + rho H with the H of the last product.
    fn finish(&self, l: usize) -> ChannelSolution {
        let (system, channel, rho) = (self.system, self.channels[l], &self.reflectances[l]);
        let irradiance = self.irradiances[l].clone();
        let reflected: Vec<f64> = rho.iter().zip(&irradiance).map(|(rho, h)| rho * h).collect();
        let radiosity = radiosity(channel, &reflected);
        let energy = Energy::of(system, channel, &radiosity, &irradiance);
        let matrix_error = matrix_error(system, rho, &radiosity, &self.amplifications[l]);
        let history = self.histories[l].clone();
        let bound = history.last().copied().unwrap_or(f64::INFINITY);
        ChannelSolution { radiosity, irradiance, history, bound, matrix_error, energy }
    }
}

fn radiosity(channel: &Channel, reflected: &[f64]) -> Vec<f64> {
    channel.exitance.iter().zip(reflected).map(|(e, reflected)| e + reflected).collect()
}
