//! BENCHMARKS.md: each part lies between two marks and is written anew by the run that measured it; the rest is prose.

use super::plan::{OCCLUDED, SCENES};
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

/// Asked error against achieved, of what the pipeline does by default; `own_error` tells how far points, picture and surfaces of a
/// scene's reference may be off themselves. Rows of boxes have no picture and are left out.
pub fn achieved(rows: &[&Row], own_error: impl Fn(&str) -> Option<[f64; 3]>) -> String {
    let mut text = String::from(
        "| scene | asked | surfaces | / asked | picture | / asked | points | / asked | CPU s |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let (mut ratios, mut above) = (Vec::new(), Vec::new());
    let by_default = |row: &&&Row| row.method == "auto" && row.mesh == "discontinuity";
    for scene in SCENES {
        let [own_points, own_picture, own_surfaces] = own_error(scene).unwrap_or([f64::NAN; 3]);
        for row in rows.iter().filter(by_default).filter(|row| row.scene == scene) {
            let [points, _, picture, _, _, surfaces] = row.errors;
            if row.state != "done" || !surfaces.is_finite() {
                let why = if row.state == "done" { "this run is the reference" } else { &row.state };
                text += &format!("| {scene} | {} | {why} | | | | | | |\n", row.asked);
                continue;
            }
            if OCCLUDED.contains(&scene) {
                ratios.push([surfaces / row.asked, picture / row.asked]);
            }
            for (name, error) in [("surfaces", surfaces), ("picture", picture), ("points", points)] {
                if error > row.asked {
                    above.push(format!("{scene} at {} ({name})", row.asked));
                }
            }
            // Ten times the reference's own error is what an error must be to be told from it.
            let cell = |error: f64, own: f64| {
                let sure = if error < 10.0 * own { "~" } else { "" };
                format!("{error:.1e} | {sure}{:.3}", error / row.asked)
            };
            text += &format!(
                "| {scene} | {} | {} | {} | {} | {:.2} |\n",
                row.asked,
                cell(surfaces, own_surfaces),
                cell(picture, own_picture),
                cell(points, own_points),
                row.cpu_s()
            );
        }
    }
    if !ratios.is_empty() {
        let mean = |of: usize| ratios.iter().map(|r: &[f64; 2]| r[of]).sum::<f64>() / ratios.len() as f64;
        text += &format!(
            "\nAchieved over asked, mean of the {} rows of {} (occlusion and several bounces): {:.3} (surfaces), {:.3} (picture); \
             not less than 0.2 is meant.\n",
            ratios.len(),
            OCCLUDED.join(" and "),
            mean(0),
            mean(1)
        );
    }
    let list = if above.is_empty() { "none".to_owned() } else { above.join(", ") };
    text + &format!("\nAbove the asked error: {list}.\n")
}

/// The table of a scene.
pub fn scene(rows: &[&Row], note: &str) -> String {
    let mut text = format!("{note}\n\n");
    text += "| method / mesh | asked | elements | mesh s | factors s | solve s | shade s | all CPU s | wall s | MB | \
             factors MB | points | points, given | picture | rows mean | rows worst | surfaces |\n";
    text += "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
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

    fn row(scene: &str, mesh: &str, asked: f64, surfaces: f64) -> Row {
        Row {
            scene: scene.into(),
            method: "auto".into(),
            mesh: mesh.into(),
            state: "done".into(),
            asked,
            errors: [asked / 2.0, f64::NAN, asked / 4.0, f64::NAN, f64::NAN, surfaces],
            ..Row::default()
        }
    }

    #[test]
    fn asked_and_achieved_has_ratios_of_default_rows_and_their_mean_where_light_bounces() {
        let rows = [
            row("room", "discontinuity", 0.1, 0.04),
            row("room", "discontinuity", 0.02, 0.004),
            row("room", "adaptive", 0.1, 0.9),
            row("goral_cube", "discontinuity", 0.1, 0.2),
            row("room", "discontinuity", 0.005, f64::NAN),
            Row { state: "over".into(), ..row("penumbra", "discontinuity", 0.002, 0.0) },
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let text = achieved(&rows, |scene| (scene == "room").then_some([1e-4, 1e-4, 1e-3]));
        assert!(
            text.contains("| room | 0.1 | 4.0e-2 | 0.400 | 2.5e-2 | 0.250 | 5.0e-2 | 0.500 | 0.00 |"),
            "{text}"
        );
        // Less than ten times the reference's own error.
        assert!(text.contains("| room | 0.02 | 4.0e-3 | ~0.200 | 5.0e-3 | 0.250 |"), "{text}");
        assert!(text.contains("mean of the 2 rows of cornell_blocks and room"), "{text}");
        assert!(text.contains("0.300 (surfaces), 0.250 (picture);"), "{text}");
        assert!(text.contains("Above the asked error: goral_cube at 0.1 (surfaces).\n"), "{text}");
        assert!(text.contains("| room | 0.005 | this run is the reference |"), "{text}");
        assert!(text.contains("| penumbra | 0.002 | over |"), "{text}");
    }

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
