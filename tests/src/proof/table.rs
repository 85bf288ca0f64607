//! BENCHMARKS.md: each part lies between two marks and is written anew by the run that measured it; the rest is prose.

use super::record::Row;
use std::path::Path;

/// Puts `body` between the marks of `part`, or at the file's end where they are missing.
pub fn put(path: &Path, part: &str, body: &str) {
    let (open, shut) = (format!("<!-- begin {part} -->\n"), format!("<!-- end {part} -->\n"));
    let text = std::fs::read_to_string(path).unwrap_or_else(|_| "# Benchmarks\n".to_owned());
    let (before, after) = match text.split_once(&open) {
        Some((before, rest)) => (before.to_owned(), rest.split_once(&shut).map_or("", |(_, after)| after)),
        None => (format!("{}\n\n", text.trim_end()), ""),
    };
    std::fs::write(path, format!("{before}{open}{body}\n{shut}{after}"))
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// Machine and state of the sources, as one line.
pub fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    format!("{}, {cores} cores, commit {}", model.map_or("unknown processor", |m| m.1), commit())
}

/// Short name of the commit, with a plus sign where files differ from it.
pub fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output =
            std::process::Command::new("git").current_dir(crate::root()).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|s| !s.is_empty());
    let name = git(&["rev-parse", "--short", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    if changed { name + "+" } else { name }
}

/// The table of a scene.
pub fn scene(rows: &[&Row], note: &str) -> String {
    let mut text = format!("{note}\n\n");
    text += "| method / mesh | asked | elements | mesh s | factors s | solve s | shade s | all CPU s | wall s | MB | \
             factors MB | points | points, given | picture | rows mean | rows worst |\n";
    text += "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for row in rows {
        let name = format!("| {} / {} | {} ", row.method, row.mesh, row.asked);
        if row.state != "done" {
            text += &format!("{name}| not run: {} |\n", row.state);
            continue;
        }
        let seconds = row.costs.map(|cost| format!("{:.2}", cost.cpu_s)).join(" | ");
        let wall: f64 = row.costs.iter().map(|cost| cost.wall_s).sum();
        let peak = row.costs.iter().map(|cost| cost.peak_bytes).max().unwrap_or(0) as f64 / 1e6;
        let error = |e: f64| if e.is_finite() { format!("{e:.1e}") } else { String::new() };
        text += &format!(
            "{name}| {} | {seconds} | {:.2} | {wall:.2} | {peak:.0} | {:.1} | {} |\n",
            row.elements,
            row.cpu_s(),
            row.costs[1].file_bytes as f64 / 1e6,
            row.errors.map(error).join(" | ")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_replaced_and_the_rest_stays() {
        let folder = crate::folder();
        let path = folder.path().join("B.md");
        put(&path, "a", "one");
        put(&path, "b", "two");
        put(&path, "a", "three");
        let text = crate::text(&path);
        assert!(
            text.starts_with("# Benchmarks\n") && text.contains("two") && text.contains("three"),
            "{text}"
        );
        assert!(!text.contains("one"), "{text}");
    }
}
