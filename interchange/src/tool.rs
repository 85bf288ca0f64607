//! Command-line habits the four tools share: flags, talk on stderr, progress on a terminal, exit codes.
//!
//! Exit codes: 0 done; 1 failed; 2 bad usage (clap's); 3 finished and written, but the asked tolerance was not reached.

pub mod pages;

pub use indicatif::ProgressBar;
use indicatif::{ProgressDrawTarget, ProgressFinish, ProgressStyle};
use std::fmt::Display;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

/// Steps of a bar that [`show_fall`] moves.
pub const STEPS_OF_FALL: usize = 1000;

/// A program that takes less time shows no bar.
const BEFORE_BARS: Duration = Duration::from_secs(1);
/// Nor does a step of a longer one that takes less: a bar that comes and goes at once tells nothing. Many such steps in a
/// row leave a program without a bar for a while, hence not a second, too.
const BEFORE_BAR: Duration = Duration::from_millis(200);

/// When the program started, where bars are drawn: not before [`Common::start`], so that nothing but a program draws any.
static SHOWS_PROGRESS_SINCE: OnceLock<Instant> = OnceLock::new();

/// Line at the end of each tool's `--help`.
pub const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 failed, 2 bad usage, 3 written, but the asked tolerance was not reached.";

/// What `--help` says at its end: lines to try, and the exit codes.
pub fn examples(lines: &[&str]) -> String {
    let lines: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    format!("Examples:\n{lines}\n{EXIT_CODES}")
}

/// Value of a flag that is a finite number above 0.
///
/// # Errors
/// What was expected, for clap, which names the flag and what was given.
pub fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|&number: &f64| number.is_finite() && number > 0.0);
    number.ok_or_else(|| "expected a number above 0".into())
}

/// Value of a flag that is a finite number of at least 0, such as `--max`.
///
/// # Errors
/// What was expected, for clap, which names the flag and what was given.
pub fn not_negative(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|&number: &f64| number.is_finite() && number >= 0.0);
    number.ok_or_else(|| "expected a number of at least 0".into())
}

/// Flags every subcommand takes. None of them changes an output.
#[derive(Debug, Clone, clap::Args)]
pub struct Common {
    /// Threads to use (default: one per core); the output does not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Say only errors
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Say what is being done
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
}

impl Common {
    /// Sets up talk on stderr, the thread pool and what happens on Ctrl-C; to be called once, first.
    pub fn start(&self) {
        crate::interrupt::clear_up_when_interrupted();
        if !self.quiet && std::io::stderr().is_terminal() {
            let _ = SHOWS_PROGRESS_SINCE.set(Instant::now());
        }
        let level = match (self.quiet, self.verbose) {
            (true, _) => tracing::Level::ERROR,
            (_, true) => tracing::Level::DEBUG,
            _ => tracing::Level::WARN,
        };
        let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        let talk = tracing_subscriber::fmt().with_writer(std::io::stderr).with_max_level(level);
        // A second start in one process keeps the first one's settings.
        let _ = talk.without_time().with_target(false).with_ansi(colours).try_init();
        let threads = self.threads.unwrap_or(0) as usize;
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    }

    /// As [`progress`]; nothing with `--quiet`.
    pub fn progress(&self, title: &'static str, steps: usize) -> ProgressBar {
        if self.quiet { ProgressBar::hidden() } else { progress(title, steps) }
    }
}

/// A bar for `steps` of work with the time left, on a terminal, from the first step on after the program has run for a
/// second; nothing elsewhere or with `--quiet`. It goes when dropped.
pub fn progress(title: &'static str, steps: usize) -> ProgressBar {
    let Some(since) = SHOWS_PROGRESS_SINCE.get() else {
        return ProgressBar::hidden();
    };
    let wait = BEFORE_BARS.saturating_sub(since.elapsed()).max(BEFORE_BAR);
    let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::hidden());
    let style = ProgressStyle::with_template("{prefix} [{wide_bar}] {percent} % {eta} left");
    let bar = bar.with_prefix(title).with_finish(ProgressFinish::AndClear);
    let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    // Hidden, it counts and estimates all the same. Without a thread to be had the work is done unseen.
    let later = bar.downgrade();
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(wait);
        if let Some(bar) = later.upgrade().filter(|bar| !bar.is_finished()) {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    });
    bar
}

/// Shows how far an iteration is that lowers `measure` from `first` to `last` by about the same factor in each step. The bar
/// has [`STEPS_OF_FALL`] steps.
pub fn show_fall(bar: &ProgressBar, first: f64, measure: f64, last: f64) {
    let part = (first / measure).ln() / (first / last).ln();
    if part.is_finite() {
        bar.set_position((part.clamp(0.0, 1.0) * STEPS_OF_FALL as f64) as u64);
    }
}

/// How a run that wrote its output ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Finish {
    /// As asked.
    Done,
    /// Written, but the asked tolerance was not reached: what was asked, what was reached, what would help.
    ToleranceMissed(String),
}

/// Says how the run ended and turns it into the exit code.
pub fn exit_code<E: Display>(tool: &str, result: Result<Finish, E>) -> ExitCode {
    match result {
        Ok(Finish::Done) => ExitCode::SUCCESS,
        Ok(Finish::ToleranceMissed(message)) => {
            eprintln!("{tool}: warning: {message}");
            ExitCode::from(3)
        }
        Err(error) => {
            eprintln!("{tool}: error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Prints data on stdout; a reader that has gone away (`| head`) is no failure.
pub fn print_data(text: &str) -> std::io::Result<()> {
    print_bytes(text.as_bytes())
}

/// The same for data that need not be text.
pub fn print_bytes(bytes: &[u8]) -> std::io::Result<()> {
    use std::io::Write;
    match std::io::stdout().lock().write_all(bytes) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
