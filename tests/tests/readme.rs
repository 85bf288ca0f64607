//! The walk through the files in README.md works as written, command by command.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::process::Command;
use tests::table::Table;
use tests::{program, run};

/// The indented lines of a page that begin with a tool's name, or prepare a file for one.
fn commands(page: &str) -> Vec<String> {
    let text = tests::text(&tests::root().join(page));
    let lines = text.lines().filter_map(|line| line.strip_prefix("    ")).map(str::to_owned);
    let starts = |line: &String| {
        tests::TOOLS.iter().chain(&["printf"]).any(|word| line.starts_with(&format!("{word} ")))
    };
    lines.filter(starts).collect()
}

/// Runs the commands of a page, one after another in one folder; data comes from those alone that tell something.
fn walk(page: &str) -> (Vec<String>, tempfile::TempDir) {
    let folder = tests::folder();
    std::os::unix::fs::symlink(tests::root().join("tests"), folder.path().join("tests")).unwrap();
    let bin = program("mesh-tool").parent().unwrap().to_owned();
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let commands = commands(page);
    for line in &commands {
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).current_dir(folder.path()).env("PATH", &path);
        let done = run(&mut shell);
        assert!(done.code == Some(0), "{line}: exit {:?}: {}", done.code, done.stderr);
        let told = [" info ", " compare ", " --dry-run", " --grid "].iter().any(|word| line.contains(word));
        assert_eq!(done.stdout.is_empty(), !told, "{line}: {}", done.stdout);
    }
    (commands, folder)
}

#[test]
fn every_line_of_inspecting_works() {
    let (commands, folder) = walk("docs/inspecting.md");
    assert!(commands.len() > 25, "{commands:?}");
    assert!(folder.path().join("box.vtu").exists());
}

#[test]
fn the_walk_through_the_files_works() {
    let (commands, folder) = walk("README.md");
    for name in tests::TOOLS {
        assert!(
            commands.iter().any(|line| line.starts_with(&format!("{name} info "))),
            "no {name} info in README.md"
        );
    }

    // What the text says of the tables.
    let factors = Table::read(&folder.path().join("factors.csv"));
    assert_eq!(factors.header[..2], ["group", "floor"]);
    let probed = Table::read(&folder.path().join("lit.csv"));
    assert_eq!(probed.header[6..], ["H_r", "H_g", "H_b"]);
    assert!(probed.number(0, "H_r") > 0.0);
}

#[test]
fn a_swapped_solver_is_called_as_written() {
    let text = tests::text(&tests::root().join("README.md"));
    let quoted = text.split('`').find(|part| part.starts_with("python3 my_solver.py solve ")).unwrap();
    let folder = tests::folder();
    std::fs::write(folder.path().join("my_solver.py"), "").unwrap();
    let mut make = tests::pipeline::make_command(folder.path());
    // The other programs need only be there: nothing runs.
    for (variable, tool) in
        [("MESH_TOOL", "mesh-tool"), ("FORMFACTOR_TOOL", "formfactor-tool"), ("SHADE_TOOL", "shade-tool")]
    {
        make.arg(format!("{variable}={}", program(tool).display()));
    }
    make.args(["-n", "SOLVE_TOOL=python3 my_solver.py"]);
    let done = run(&mut make).expect_code(0);
    assert!(done.stdout.contains(&format!("\n{quoted};")), "{quoted} is not in: {}", done.stdout);
}
