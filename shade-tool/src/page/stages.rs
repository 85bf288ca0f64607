//! What the stages told in their reports: times, errors, skips, counters, warnings; and where their files come from.

use super::input::{Input, Stage};
use super::markup::{Table, count, escape, folded, number, seconds};
use interchange::report::Report;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Suffixes that make three estimates one row.
const CHANNELS: [&str; 3] = [" red", " green", " blue"];
/// Words that name an estimate of an error.
const ERROR_WORDS: [&str; 6] = ["error", "bound", "tolerance", "defect", "deviation", "row sum"];
/// What a stage is called that makes the file of this role.
fn title(stage: &Stage) -> &'static str {
    match stage.role {
        "mesh" => "mesh",
        "matrix" => "form factors",
        "solution" => "solution",
        _ => "picture",
    }
}

fn reports(input: &Input) -> impl Iterator<Item = (&'static str, &Report)> {
    input.stages.iter().filter_map(|stage| Some((title(stage), stage.report.as_ref()?)))
}

/// Wall time of a stage.
fn total(report: &Report) -> f64 {
    report.phases.iter().map(|phase| phase.seconds).sum()
}

/// Wall time of all stages that left a report.
pub fn total_time(input: &Input) -> f64 {
    reports(input).map(|(_, report)| total(report)).sum()
}

/// Times: one bar for each stage, and its phases.
pub fn times(input: &Input) -> String {
    let most = reports(input).map(|(_, report)| total(report)).fold(0.0, f64::max);
    let mut stages = Table::new(&["stage", "wall time", "", "peak memory"]);
    let mut phases = Table::new(&["phase", "wall time"]);
    for (name, report) in reports(input) {
        let own = total(report);
        let part = if most > 0.0 { 100.0 * own / most } else { 0.0 };
        let bar = format!("<span class=\"bar\"><span style=\"width:{part:.1}%\"></span></span>");
        let memory = format!("{} MiB", number(report.peak_memory_bytes as f64 / f64::from(1 << 20)));
        stages.row(&format!("{name} ({})", report.tool), [seconds(own), bar, memory]);
        for phase in &report.phases {
            phases.row(&format!("{name}: {}", phase.name), [seconds(phase.seconds)]);
        }
    }
    stages.html() + &folded("Phases of the stages", &phases.html())
}

/// Errors and other estimates, those of three channels in one row.
pub fn estimates(input: &Input) -> String {
    let titles = ["estimate", "red, or all", "green", "blue"];
    let (mut errors, mut others) = (Table::new(&titles), Table::new(&titles));
    for (name, report) in reports(input) {
        let mut rows: BTreeMap<&str, [Option<f64>; 3]> = BTreeMap::new();
        for (key, &value) in &report.estimates {
            match CHANNELS.iter().position(|suffix| key.ends_with(suffix)) {
                Some(c) => rows.entry(key.trim_end_matches(CHANNELS[c])).or_default()[c] = Some(value),
                // One number for all channels stands in the first column, unless channels of this name have it already.
                None if CHANNELS.iter().any(|c| report.estimates.contains_key(&format!("{key}{c}"))) => {}
                None => rows.entry(key).or_default()[0] = Some(value),
            }
        }
        for (key, values) in rows {
            let of_error = ERROR_WORDS.iter().any(|word| key.contains(word));
            let table = if of_error { &mut errors } else { &mut others };
            table.row(
                &format!("{name}: {}", key.replace('_', " ")),
                values.map(|v| v.map_or(String::new(), number)),
            );
        }
    }
    errors.html() + &folded("Other estimates, such as powers and lengths", &others.html())
}

/// Work that was left out because it was proved or estimated to be needless.
pub fn skips(input: &Input) -> String {
    let mut skipped = Table::new(&["left out", "times"]);
    let mut others = Table::new(&["counted", "number"]);
    for (name, report) in reports(input) {
        for (key, &value) in &report.counters {
            let table = if value > 0 && key.contains("skip") { &mut skipped } else { &mut others };
            table.row(&format!("{name}: {}", key.replace('_', " ")), [count(value)]);
        }
    }
    skipped.html() + &folded("Everything else that was counted", &others.html())
}

/// Warnings of all stages; nothing where there are none.
pub fn warnings(input: &Input) -> Option<String> {
    let mut items = String::new();
    for (name, report) in reports(input) {
        for warning in &report.warnings {
            let _ = writeln!(items, "<li><b>{name}</b> {}</li>", escape(warning));
        }
    }
    (!items.is_empty()).then(|| format!("<ul class=\"warnings\">{items}</ul>"))
}

/// Digests, flags and inputs of every file.
pub fn provenance(input: &Input) -> String {
    let mut table = Table::new(&["file", "made by", "with", "identity (SHA-256)", "from"]);
    for stage in &input.stages {
        let flags = |flags: &[String]| {
            flags.iter().map(|f| format!("<code>{}</code>", escape(f))).collect::<Vec<_>>().join("<br>")
        };
        let (tool, with, from) = match (&stage.provenance, &stage.report) {
            (Some(p), _) => {
                let from =
                    p.inputs.iter().map(|i| format!("{} <code>{}</code>", escape(&i.role), i.digest.short()));
                (format!("{} {}", p.tool, p.version), flags(&p.flags), from.collect::<Vec<_>>().join("<br>"))
            }
            (None, Some(r)) => (format!("{} {}", r.tool, r.version), flags(&r.flags), String::new()),
            (None, None) => Default::default(),
        };
        let digest =
            stage.digest.map_or(String::new(), |d| format!("<code title=\"{d}\">{}</code>", d.short()));
        table.row(stage.role, [escape(&tool), with, digest, from]);
    }
    table.html()
}
