//! `make -f pipeline.mk bench`, `reference` and `skips`; see BENCHMARKS.md.
//!
//! usage: proof [bench|reference|skips] [--work DIR] [--scenes A,B] [--errors E,F] [--budget SECONDS] [--minutes M]
//!              [--reference-error E] [--into FILE.md] [--scene FILE.obj]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tests::proof::plan::{Case, ERRORS};
use tests::proof::record::Row;
use tests::proof::reference::{self, Reference};
use tests::proof::{errors, plan, plot, record, runner, skips, table};

/// How long a bench goes on unless told otherwise: the 40 minutes that a fresh clone may take, less those of building the tools, of
/// the last run and of writing.
const MINUTES: &str = "33";

/// What the command line asks for.
struct Options {
    job: String,
    work: PathBuf,
    scenes: Vec<String>,
    errors: Vec<f64>,
    budget: Duration,
    end: Instant,
    /// In place of each scene's own.
    reference_error: Option<f64>,
    into: PathBuf,
    scene: Option<PathBuf>,
}

impl Options {
    fn read() -> Self {
        let mut given = BTreeMap::new();
        let (mut job, mut arguments) = ("bench".to_owned(), std::env::args().skip(1));
        while let Some(word) = arguments.next() {
            match word.strip_prefix("--") {
                // Cargo's own.
                Some("bench") => {}
                Some(name) => drop(given.insert(name.to_owned(), arguments.next().unwrap_or_default())),
                None => job = word,
            }
        }
        let mut take = |name: &str, default: &str| {
            given.remove(name).filter(|value| !value.is_empty()).unwrap_or_else(|| default.to_owned())
        };
        let number = |text: String| text.parse::<f64>().unwrap_or_else(|e| panic!("{text}: {e}"));
        let list = |text: String| text.split(',').map(str::to_owned).collect::<Vec<_>>();
        let all = ERRORS.map(|e| e.to_string()).join(",");
        let folder = |path: String| tests::root().join(path);
        let options = Self {
            job,
            work: folder(take("work", "target/proof")),
            scenes: list(take("scenes", &plan::scenes().join(","))),
            errors: list(take("errors", &all)).into_iter().map(number).collect(),
            budget: Duration::from_secs_f64(number(take("budget", "15"))),
            end: Instant::now() + Duration::from_secs_f64(60.0 * number(take("minutes", MINUTES))),
            reference_error: Some(take("reference-error", "")).filter(|e| !e.is_empty()).map(number),
            into: folder(take("into", "BENCHMARKS.md")),
            scene: Some(take("scene", "")).filter(|s| !s.is_empty()).map(folder),
        };
        assert!(given.is_empty(), "unknown options: {:?}", given.keys());
        std::fs::create_dir_all(&options.work).unwrap();
        options
    }
}

fn main() {
    let options = Options::read();
    match options.job.as_str() {
        "bench" => bench(&options),
        "reference" => options.scenes.iter().filter(|s| !s.starts_with("box")).for_each(|scene| {
            println!("{}", note(scene, make_reference(&options, scene).as_ref()));
        }),
        "skips" => skip_tables(&options),
        other => panic!("{other}: expected bench, reference or skips"),
    }
}

/// Each of a reference's two runs may take sixty times as long as a case.
fn make_reference(options: &Options, scene: &str) -> Option<Reference> {
    let error = options.reference_error.unwrap_or_else(|| plan::reference_error(scene));
    reference::make(scene, &options.work, error, 60 * options.budget)
}

fn bench(options: &Options) {
    let path = options.work.join("bench.csv");
    let mut rows = record::read(&path);
    let (mut references, mut matrices) = (BTreeMap::new(), BTreeMap::new());
    let mut last: BTreeMap<_, (f64, f64)> = BTreeMap::new();
    let (mut asked, mut late) = (BTreeSet::new(), Vec::new());
    for case in plan::cases(&options.scenes, &options.errors) {
        let (mut prefix, commands) = runner::case_commands(&case, &options.work, "run");
        let key = runner::key(&case, &commands, &options.work);
        let budget = case.budget_s(options.budget.as_secs_f64());
        if let Some(known) = rows.iter().find(|row| row.key == key && is_known(row, budget)) {
            last.insert(case.curve(), seconds(known, case.error, budget));
            asked.insert(key);
            continue;
        }
        let mut row = row_of(&case, &key);
        if Instant::now() > options.end {
            row.state = "the time was over; another call goes on from here".to_owned();
            late.push(row);
            continue;
        }
        asked.insert(key.clone());
        let reference = match case.matrix_only() {
            true => None,
            false => references
                .entry(case.scene.clone())
                .or_insert_with(|| make_reference(options, &case.scene))
                .as_ref(),
        };
        let foretold = last.get(&case.curve()).map_or(0.0, |&(s, e)| plan::foretold_s(s, e, case.error));
        if let Some(done) = reference.filter(|_| case.by_default()).and_then(|r| r.run_at(case.error)) {
            (row.state, row.costs, row.elements) = (done.state.clone(), done.costs, done.elements);
            prefix.clone_from(&done.prefix);
        } else if foretold > budget {
            row.state = format!("{} (foretold {foretold:.0} s)", runner::over(budget));
        } else {
            let done = runner::run_commands(&prefix, &commands, Duration::from_secs_f64(budget));
            (row.state, row.costs, row.elements) = (done.state, done.costs, done.elements);
        }
        if row.state == "done" && case.matrix_only() {
            let least = options.errors.iter().copied().fold(f64::INFINITY, f64::min);
            let reference = matrices
                .entry(case.scene.clone())
                .or_insert_with(|| reference::matrix(&case.scene, &options.work, matrix_tolerance(least)));
            [row.errors[3], row.errors[4]] = errors::rows(&prefix.with_extension("ff"), reference);
        } else if row.state == "done" {
            compare(&mut row, &prefix, reference);
        }
        println!(
            "{} {}/{} {}: {} {:.2} CPU s, error {:.2e}",
            case.scene,
            case.method,
            case.mesh,
            case.error,
            row.state,
            row.cpu_s(),
            row.main_error()
        );
        last.insert(case.curve(), seconds(&row, case.error, budget));
        rows.retain(|old| old.key != row.key);
        rows.push(row);
        record::write(&path, &rows);
    }
    if !late.is_empty() {
        println!("the time is over: another call goes on with the {} cases left", late.len());
    }
    // Rows of older programs or flags stay in the CSV, out of the tables, which are in the order of errors, then methods.
    let mut current: Vec<&Row> =
        rows.iter().filter(|row| asked.contains(&row.key)).chain(late.iter()).collect();
    current.sort_by_key(|row| {
        (plan::METHODS.iter().position(|m| row.method == *m), row.mesh != "uniform", row.mesh != "adaptive")
    });
    current.sort_by(|a, b| b.asked.total_cmp(&a.asked));
    publish(options, &current, &references);
}

/// The mean row error of the pipeline's matrices is some hundredths of the tolerance, which is 25 times the asked error (1.5e-3
/// at 0.002 in boxes): what the reference is asked for in its worst row is less than a hundredth of it.
fn matrix_tolerance(least_error: f64) -> f64 {
    (least_error / 2.0 / 100.0).max(1e-6)
}

/// Whether a row of an earlier call stands: measured, or not run for a reason that still holds. One without an error was
/// made while there was no reference.
fn is_known(row: &Row, budget_s: f64) -> bool {
    match row.state.as_str() {
        "done" => row.main_error().is_finite(),
        state => state.starts_with("failed") || state.starts_with(&runner::over(budget_s)),
    }
}

fn row_of(case: &Case, key: &str) -> Row {
    Row {
        key: key.to_owned(),
        commit: table::commit(),
        scene: case.scene.clone(),
        method: case.method.to_owned(),
        mesh: case.mesh.to_owned(),
        asked: case.error,
        errors: [f64::NAN; 6],
        ..Row::default()
    }
}

/// Seconds and error that the next case of the curve is foretold from.
fn seconds(row: &Row, error: f64, budget_s: f64) -> (f64, f64) {
    let wall: f64 = row.costs.iter().map(|cost| cost.wall_s).sum();
    // What was stopped would have taken longer than the budget.
    (if row.state == "done" { wall } else { 2.0 * budget_s }, error)
}

/// The errors of a finished run. Without a reference only the given answers judge it, and the reference says nothing about itself.
fn compare(row: &mut Row, prefix: &Path, reference: Option<&Reference>) {
    let reference = reference.filter(|r| prefix != r.prefix);
    if let Some(points) = reference::given_points(&row.scene)
        && let Some(got) = errors::probe(prefix, &points)
    {
        row.errors[0] = reference.map_or(f64::NAN, |r| errors::rms(&got, &r.irradiance));
        row.errors[1] = errors::rms(&got, &errors::given(&points));
    }
    let exr = |prefix: &Path| prefix.with_extension("exr");
    row.errors[2] = reference.map_or(f64::NAN, |r| errors::picture(&exr(prefix), &exr(&r.prefix)));
    row.errors[5] = reference
        .map_or(f64::NAN, |r| errors::surfaces(&exr(prefix), &exr(&r.prefix), plan::lamp(&row.scene)));
}

/// What is to be known of a scene's reference.
fn note(scene: &str, reference: Option<&Reference>) -> String {
    match reference {
        None if scene.starts_with("box") => {
            "Quads as given; reference: the contour rule and exact visible parts at a \
            tolerance of a hundredth of the least one here."
                .to_owned()
        }
        None => format!("{scene}: no reference within the budget."),
        Some(r) => {
            let mut text = format!(
                "{scene}: the reference, made at {}, is {:.1e} (points), {:.1e} (picture) and {:.1e} (surfaces) from a run at \
                 twice that. Errors that are less than ten times these are uncertain by them. It is {:.1e} from the given points",
                r.runs[0].0, r.own_error[0], r.own_error[1], r.own_error[2], r.given_error,
            );
            if r.given_noise.is_finite() {
                text += &format!(", whose standard errors alone make {:.1e}", r.given_noise);
            }
            if let Some([error, noise]) = r.given_picture {
                text += &if error > 0.0 {
                    format!(
                        ", and {error:.1e} from the given picture's surfaces, whose noise of {noise:.1e} is taken off in quadrature"
                    )
                } else {
                    format!(
                        ", and no farther from the given picture's surfaces than their noise of {noise:.1e}"
                    )
                };
            }
            text + "."
        }
    }
}

fn publish(options: &Options, rows: &[&Row], references: &BTreeMap<String, Option<Reference>>) {
    let pictures = options.into.with_file_name("docs").join("bench");
    std::fs::create_dir_all(&pictures).unwrap();
    let mut text = format!(
        "Machine: {}. Budget of a run {:.0} s on the clock, more in the room; compare ratios within this table only.\n\n",
        table::machine(),
        options.budget.as_secs_f64()
    );
    let mut own_errors = BTreeMap::new();
    for scene in &options.scenes {
        let own: Vec<&Row> = rows.iter().copied().filter(|row| row.scene == *scene).collect();
        if own.is_empty() {
            continue;
        }
        // Rows may all be known from an earlier call; their reference lies in the work folder then.
        let made = references
            .get(scene)
            .cloned()
            .unwrap_or_else(|| if scene.starts_with("box") { None } else { make_reference(options, scene) });
        if let Some(reference) = &made {
            own_errors.insert(scene.as_str(), reference.own_error);
        }
        let picture = pictures.join(format!("{scene}.svg"));
        plot::draw(&picture, scene, &own).unwrap_or_else(|e| panic!("{}: {e}", picture.display()));
        text += &format!("### {scene}\n\n{}", table::scene(&own, &note(scene, made.as_ref())));
        if picture.exists() {
            text += &format!("\n![time against error](docs/bench/{scene}.svg)\n\n");
        }
    }
    table::put(&options.into, "bench", &text);
    let achieved = table::achieved(rows, |scene| own_errors.get(scene).copied());
    table::put(&options.into, "achieved", &format!("Machine: {}.\n\n{achieved}", table::machine()));
    println!("written: {}", options.into.display());
}

fn skip_tables(options: &Options) {
    let error = options.errors.first().copied().filter(|_| options.errors.len() == 1).unwrap_or(0.02);
    let print = |file: &Path| skips::tables(file, &options.work, error, options.budget);
    if let Some(scene) = &options.scene {
        println!("{}", print(scene));
        return;
    }
    let mut text = format!("Machine: {}. ERROR={error}.\n\n", table::machine());
    for scene in options.scenes.iter().filter(|scene| !scene.starts_with("box")) {
        text += &format!("### {scene}\n\n{}\n", print(&plan::scene_file(scene, &options.work)));
    }
    println!("{text}");
    table::put(&options.into, "skips", &text);
}
