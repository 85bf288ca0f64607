//! What the stages leave out of a scene, and the time that saves: each stage is run as the pipeline runs it, then once
//! with every single skip switched off.

use super::measure::{End, measure, report};
use super::runner::commands;
use crate::programs::{run, tool};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Runs shorter than this are repeated, and the least is taken: their time is mostly noise.
const SHORT_S: f64 = 1.0;
const REPEATS: usize = 3;

/// Names that `--no-skip` of a command takes, from its help.
pub fn names(program: &str, command: &str) -> Vec<String> {
    let help = run(tool(program).arg(command).arg("--help")).expect_code(0).stdout;
    let lines = help.lines().skip_while(|line| !line.trim_start().starts_with("--no-skip")).skip(1);
    let own = lines.take_while(|line| !line.trim_start().starts_with("--"));
    own.filter_map(|line| Some(line.trim_start().strip_prefix("- ")?.split_once(':')?.0.to_owned())).collect()
}

/// Least CPU seconds of a command; nothing where it fails or exceeds the limit.
fn cpu_s(line: &str, output: &Path, limit: Duration) -> Option<f64> {
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        let mut words = line.split_whitespace();
        let mut command = Command::new(words.next()?);
        match measure(command.args(words).current_dir(crate::root()), output, limit) {
            End::Done(cost) => least = least.min(cost.cpu_s),
            End::OverBudget | End::Failed(_) => return None,
        }
        if least > SHORT_S {
            break;
        }
    }
    Some(least)
}

/// The two tables of a scene: counters, and seconds saved by each skip.
pub fn tables(scene: &Path, work: &Path, error: f64, limit: Duration) -> String {
    let out = work.join("skips");
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out).unwrap_or_else(|e| panic!("{}: {e}", out.display()));
    let lines = commands(scene, &out, error, &[]);
    let name = scene.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let stages = [
        ("mesh-tool", "build", "mesh"),
        ("formfactor-tool", "compute", "ff"),
        ("solve-tool", "solve", "sol"),
        ("shade-tool", "render", "exr"),
    ];
    let mut counters = String::from("| stage | counter | value |\n|---|---|---|\n");
    let mut saved =
        String::from("| stage | skip | CPU s with it | without | saved |\n|---|---|---|---|---|\n");
    for ((program, command, ending), line) in stages.into_iter().zip(&lines[1..]) {
        let output = out.join(&name).with_extension(ending);
        let Some(with) = cpu_s(line, &output, limit) else {
            saved += &format!("| {program} | (all) | over budget or failed: later stages not run | | |\n");
            break;
        };
        for (counter, value) in report(&output)["counters"].as_object().into_iter().flatten() {
            if value.as_f64().is_some_and(|v| v > 0.0) && tells_of_a_skip(counter) {
                counters += &format!("| {program} | {} | {value} |\n", counter.replace('_', " "));
            }
        }
        // Into another file, so that the next stage reads what the pipeline would give it.
        let (aside, from) = (out.join("aside").with_extension(ending), output.display().to_string());
        let elsewhere = line.replace(&format!("-o {from}"), &format!("-o {}", aside.display()));
        for skip in names(program, command) {
            match cpu_s(&format!("{elsewhere} --no-skip {skip}"), &aside, limit) {
                Some(without) => {
                    let part = 100.0 * (1.0 - with / without.max(1e-9));
                    saved += &format!("| {program} | {skip} | {with:.2} | {without:.2} | {part:.0} % |\n");
                }
                None => saved += &format!("| {program} | {skip} | {with:.2} | not run: over budget | |\n"),
            }
        }
    }
    format!("{saved}\n{counters}")
}

/// Whether a counter of a report counts work left out.
fn tells_of_a_skip(counter: &str) -> bool {
    const WORDS: [&str; 7] = [
        "skipped",
        "absent",
        "by whole clusters",
        "distinct channels",
        "left out",
        "apart",
        "no light can reach",
    ];
    WORDS.iter().any(|word| counter.contains(word))
}
