//! `solve-tool info`: what a solution file holds, for people and as JSON.

use crate::channels::CHANNEL_NAMES;
use interchange::report::Report;
use interchange::solution::Solution;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Describes the solution at `path`; with the report beside it, where there is one.
pub fn describe(path: &Path, as_json: bool) -> interchange::Result<String> {
    let (solution, provenance, origins, digest) = Solution::read(path)?;
    let report = read_report(path);
    let ranges: Vec<Value> = (0..3)
        .map(|c| {
            json!({
                "channel": CHANNEL_NAMES[c],
                "radiosity": range(&solution.radiosity, c),
                "irradiance": range(&solution.irradiance, c),
            })
        })
        .collect();
    let (summary, details) = (&solution.summary, &solution.details);
    let inputs: serde_json::Map<String, Value> =
        provenance.inputs.iter().map(|i| (i.role.clone(), json!(i.digest.to_string()))).collect();
    let data = json!({
        "kind": "solution",
        "digest": digest.to_string(),
        "elements": solution.radiosity.len(),
        "solver": summary.solver,
        "tolerance": summary.tolerance,
        "achieved": summary.achieved,
        "products": solution.history.len(),
        "history": solution.history,
        "channels": ranges,
        "tool": provenance.tool,
        "version": provenance.version,
        "flags": provenance.flags,
        "inputs": inputs,
        "snapshot": details.unshot.is_some(),
        "ambient": details.ambient,
        "bounds": details.bounds.is_some(),
        "worst elements": details.error_ranking.as_ref().map(|ranking| worst(ranking, details.element_errors.as_ref())),
        "worst links": details.error_links.as_ref().map(|links| {
            links.iter().take(SHOWN).map(|l| json!([l.first + 1, l.second + 1, l.error])).collect::<Vec<_>>()
        }),
        "report": report,
    });
    if as_json {
        return Ok(format!("{data:#}\n"));
    }

    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<12} {value}");
    };
    line("solution", format!("{} ({})", path.display(), digest.short()));
    line("elements", solution.radiosity.len().to_string());
    line("solver", summary.solver.clone());
    line("bound", format!("{:.2e} (asked {:e})", summary.achieved, summary.tolerance));
    line("products", solution.history.len().to_string());
    for (c, name) in CHANNEL_NAMES.iter().enumerate() {
        let show = |r: [f64; 3]| format!("{:.6e} .. {:.6e}, mean {:.6e}", r[0], r[2], r[1]);
        line(name, format!("B {}", show(range(&solution.radiosity, c))));
        line("", format!("H {}", show(range(&solution.irradiance, c))));
        let estimate =
            |what: &str| report.as_ref().and_then(|r| r["estimates"][format!("{what} {name}")].as_f64());
        if let (Some(emitted), Some(absorbed), Some(escaped)) =
            (estimate("power emitted"), estimate("power absorbed"), estimate("power escaped"))
        {
            let under_way = estimate("power under way").filter(|&power| power != 0.0);
            let under_way = under_way.map_or(String::new(), |power| format!(" + under way {power:.6e}"));
            let defect = estimate("energy defect").unwrap_or(0.0);
            line(
                "",
                format!(
                    "power {emitted:.6e} = absorbed {absorbed:.6e} + escaped {escaped:.6e}{under_way}, defect {defect:.1e}"
                ),
            );
        }
    }
    if let Some([lower, upper]) = &details.bounds {
        let widths = lower.iter().zip(upper).flat_map(|(l, u)| (0..3).map(move |c| u[c] - l[c]));
        line("bounds", format!("at most {:.3e} from lower to upper", widths.fold(0.0, f64::max)));
    }
    if let (Some(ranking), Some(errors)) = (&details.error_ranking, &details.element_errors) {
        for (rank, &i) in ranking.iter().take(SHOWN).enumerate() {
            let [matrix, solver, elements] = errors[i as usize];
            let title = if rank == 0 { "worst" } else { "" };
            line(
                title,
                format!(
                    "element {}: matrix {matrix:.2e}, solver {solver:.2e}, element {elements:.2e} W",
                    i + 1
                ),
            );
        }
    }
    line("made by", format!("{} {} {}", provenance.tool, provenance.version, provenance.flags.join(" ")));
    let made_from = [("mesh", origins.mesh), ("matrix", origins.matrix), ("materials", origins.materials)];
    made_from.iter().for_each(|(role, digest)| line(role, digest.short()));
    Ok(text)
}

/// Elements and links that are shown.
const SHOWN: usize = 10;

/// Numbers from 1 and contributions of the worst elements.
fn worst(ranking: &[u32], errors: Option<&Vec<[f64; 3]>>) -> Vec<Value> {
    let of = |&i: &u32| json!([i + 1, errors.map(|errors| errors[i as usize])]);
    ranking.iter().take(SHOWN).map(of).collect()
}

/// Least, mean (over elements, not areas) and largest value of a channel.
fn range(values: &[[f64; 3]], channel: usize) -> [f64; 3] {
    let channel = || values.iter().map(|v| v[channel]);
    let least = channel().fold(f64::INFINITY, f64::min);
    let largest = channel().fold(f64::NEG_INFINITY, f64::max);
    [least, channel().sum::<f64>() / values.len().max(1) as f64, largest]
}

/// The report beside the file, if it is there and can be read: the energy balance stands in it.
fn read_report(path: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(Report::path_for(path)).ok()?;
    serde_json::from_str(&text).ok()
}
