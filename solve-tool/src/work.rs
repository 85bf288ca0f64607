//! What every method works on: the channels' equations, the products, the measure that says when to stop, and the guards
//! that stop a channel which cannot be brought further.

use crate::equation::{Equation, apply};
use crate::product::Product;
use interchange::tool::{ProgressBar, STEPS_OF_FALL, progress, show_fall};

/// Fall of the measure that counts as progress.
const PROGRESS: f64 = 0.01;

/// How one channel's iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The measure fell below the target.
    Converged,
    /// It stopped falling.
    Stagnated,
    /// The steps allowed were used up.
    StepLimit,
    /// A quantity that must be positive and finite was not.
    BrokeDown,
}

impl End {
    /// In the user's words.
    pub fn describe(self) -> &'static str {
        match self {
            End::Converged => "reached its target",
            End::Stagnated => "stopped falling",
            End::StepLimit => "was still falling when the steps were used up",
            End::BrokeDown => "broke down in rounding",
        }
    }
}

/// A channel's state as a picture of the work in progress shows it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shown {
    /// Irradiance received so far, ambient term included.
    pub irradiance: Vec<f64>,
    /// Radiosity that was not yet passed on.
    pub unshot: Vec<f64>,
    /// Estimate of what the unshot radiosity will add to every irradiance: for display, fed back nowhere.
    pub ambient: f64,
}

/// Sees every step: its number, and a way to ask for a channel's state.
pub(crate) type Observer<'a> = dyn FnMut(usize, &dyn Fn(usize) -> Shown) + 'a;

/// What has to fall below the target, of a channel and its equation.
pub(crate) type Measure<'a> = Box<dyn Fn(usize, &Equation<'a>) -> f64 + 'a>;

/// Channels on their way.
pub(crate) struct Work<'a> {
    /// S, as far as the iteration needs it.
    pub product: &'a Product<'a>,
    pub equations: Vec<Equation<'a>>,
    /// What has to fall below the target, of an equation.
    pub measure: Measure<'a>,
    /// The measure of a radiosity of which this power, W, is unshot: the error of what it has reached is at most that.
    pub measure_unshot: Box<dyn Fn(usize, f64) -> f64 + 'a>,
    pub target: f64,
    /// Steps still allowed; a step is a product with the matrix, a sweep, or one shot of every element.
    pub steps_left: usize,
    /// Steps without progress after which a channel gives up.
    pub patience: usize,
    /// Measures of all channels after each step.
    pub history: Vec<Vec<f64>>,
    pub observer: Option<&'a mut Observer<'a>>,
    tracks: Vec<Track>,
    steps: usize,
    bar: ProgressBar,
    /// Largest measure at the start.
    first: Option<f64>,
}

/// A channel's progress.
struct Track {
    measure: f64,
    best: f64,
    best_irradiance: Vec<f64>,
    /// Step and measure of the last progress.
    progress: (usize, f64),
    end: Option<End>,
}

impl<'a> Work<'a> {
    /// Work on `equations` until `measure` is at most `target`.
    pub fn new(
        product: &'a Product<'a>,
        equations: Vec<Equation<'a>>,
        measure: impl Fn(usize, &Equation<'a>) -> f64 + 'a,
        target: f64,
        most_steps: usize,
    ) -> Self {
        Self {
            product,
            equations,
            measure: Box::new(measure),
            measure_unshot: Box::new(|_, power| power),
            target,
            steps_left: most_steps,
            patience: 3,
            history: Vec::new(),
            observer: None,
            tracks: Vec::new(),
            steps: 0,
            bar: progress("solve", STEPS_OF_FALL),
            first: None,
        }
    }

    /// Begins a round of improvement from the equations' residuals; channels that are not `open` stay as they are.
    pub fn begin(&mut self, open: &[bool]) {
        let (step, target) = (self.steps, self.target);
        let track = |(c, equation): (usize, &Equation<'a>)| {
            let measure = (self.measure)(c, equation);
            let end = (!open[c] || measure <= target).then_some(End::Converged);
            let best_irradiance = equation.irradiance.clone();
            Track { measure, best: measure, best_irradiance, progress: (step, measure), end }
        };
        self.tracks = self.equations.iter().enumerate().map(track).collect();
        self.first = self.first.or(Some(self.largest()));
    }

    /// Channels that are not at their end.
    pub fn active(&mut self) -> Vec<usize> {
        if self.steps_left == 0 {
            self.tracks.iter_mut().for_each(|track| track.end = track.end.or(Some(End::StepLimit)));
        }
        (0..self.tracks.len()).filter(|&c| self.tracks[c].end.is_none()).collect()
    }

    /// S x for each vector, in one pass; one step.
    pub fn multiply(&mut self, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.count_step();
        apply(self.product, vectors)
    }

    /// Counts work as long as a pass over the matrix.
    pub fn count_step(&mut self) {
        self.steps += 1;
        self.steps_left = self.steps_left.saturating_sub(1);
    }

    /// Takes note of a channel's residual after a step. `moving` says that the step did something although the measure
    /// may not show it.
    pub fn judge(&mut self, c: usize, moving: bool) {
        let measure = (self.measure)(c, &self.equations[c]);
        self.judge_measure(c, measure, moving);
    }

    /// Takes note of a channel's measure where the method knows it otherwise.
    pub fn judge_measure(&mut self, c: usize, measure: f64, moving: bool) {
        let track = &mut self.tracks[c];
        track.measure = measure;
        if measure < track.best {
            track.best = measure;
            track.best_irradiance.clone_from(&self.equations[c].irradiance);
        }
        if moving || measure <= (1.0 - PROGRESS) * track.progress.1 {
            track.progress = (self.steps, measure.min(track.progress.1));
        }
        track.end = if measure <= self.target {
            Some(End::Converged)
        } else if measure.is_nan() {
            Some(End::BrokeDown)
        } else {
            (self.steps - track.progress.0 >= self.patience).then_some(End::Stagnated)
        };
    }

    /// Ends a channel.
    pub fn finish(&mut self, c: usize, end: End) {
        self.tracks[c].end = Some(end);
    }

    /// Ends a step: history, and a look for the observer.
    pub fn end_step(&mut self) {
        self.note();
        let (step, equations) = (self.steps, &self.equations);
        if let Some(observer) = &mut self.observer {
            observer(step, &|c: usize| Shown {
                irradiance: equations[c].irradiance.clone(),
                unshot: equations[c].unshot(),
                ambient: 0.0,
            });
        }
    }

    /// The measure of the channel that is farthest from its end.
    fn largest(&self) -> f64 {
        self.tracks.iter().map(|track| track.best).fold(0.0, f64::max)
    }

    /// Adds the measures to the history.
    pub fn note(&mut self) {
        show_fall(&self.bar, self.first.unwrap_or(0.0), self.largest(), self.target);
        self.history.push(self.tracks.iter().map(|track| track.measure).collect());
    }

    /// How the channels ended; one that did not converge is left with its best iterate and a residual that has to be
    /// computed anew.
    pub fn ends(&mut self) -> Vec<End> {
        let tracks = std::mem::take(&mut self.tracks).into_iter();
        tracks
            .zip(&mut self.equations)
            .map(|(track, equation)| {
                let end = track.end.unwrap_or(End::StepLimit);
                if end != End::Converged {
                    equation.irradiance = track.best_irradiance;
                }
                end
            })
            .collect()
    }
}
