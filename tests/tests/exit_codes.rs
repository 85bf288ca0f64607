//! Exit codes: 2 for bad usage, flags of later versions included; 1 for what cannot be done; 0 for help.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::{TOOLS, run, tool};

/// Runs `line`, split at spaces, in an empty folder.
fn exit(line: &str) -> tests::Run {
    let folder = tests::folder();
    let mut words = line.split_whitespace();
    let name = words.next().expect("a tool");
    run(tool(name).args(words).current_dir(folder.path()))
}

#[track_caller]
fn assert_usage(line: &str) {
    let done = exit(line);
    assert!(done.code == Some(2), "{line}: exit {:?}: {}", done.code, done.stderr);
    assert!(done.stderr.starts_with("error: "), "{line}: {}", done.stderr);
    assert_eq!(done.stdout, "", "{line}");
}

#[test]
fn help_and_version_are_data() {
    for name in TOOLS {
        for flag in ["--help", "--version"] {
            let done = exit(&format!("{name} {flag}")).expect_code(0);
            assert!(done.stdout.contains(name), "{name} {flag}: {}", done.stdout);
            assert_eq!(done.stderr, "");
        }
    }
}

#[test]
fn bad_usage_is_2() {
    for name in TOOLS {
        assert_eq!(exit(name).code, Some(2), "{name} without a subcommand");
        assert_usage(&format!("{name} no-such-command"));
        assert_usage(&format!("{name} info"));
        assert_usage(&format!("{name} info a --no-such-flag"));
        assert_usage(&format!("{name} info a --threads 0"));
        assert_usage(&format!("{name} info a --threads many"));
        assert_usage(&format!("{name} info a --quiet --verbose"));
    }
    for line in [
        "mesh-tool build a.obj",
        "mesh-tool materials a.obj",
        "mesh-tool build a.obj -o a.mesh --elements 0",
        "mesh-tool build a.obj -o a.mesh --elements -5",
        "mesh-tool build a.obj -o a.mesh --max-edge 0",
        "mesh-tool build a.obj -o a.mesh --max-edge nan",
        "mesh-tool build a.obj -o a.mesh --max-edge inf",
        "formfactor-tool compute a.mesh",
        "formfactor-tool compute a.mesh -o a.ff --tolerance 0",
        "formfactor-tool compute a.mesh -o a.ff --tolerance -1",
        "formfactor-tool compute a.mesh -o a.ff --tolerance nan",
        "formfactor-tool compute a.mesh -o a.ff --tolerance inf",
        "formfactor-tool compute a.mesh -o a.ff --tolerance small",
        "formfactor-tool compute a.mesh -o a.ff --precision f16",
        "formfactor-tool compute a.mesh -o a.ff --closure on",
        "formfactor-tool merge -o a.ff",
        "formfactor-tool merge a.1.ff",
        "formfactor-tool compute a.mesh -o a.ff --shard 0/2",
        "formfactor-tool compute a.mesh -o a.ff --shard 3/2",
        "formfactor-tool compute a.mesh -o a.ff --shard 2",
        "formfactor-tool compute a.mesh -o a.ff --method monte-carlo",
        "formfactor-tool compute a.mesh -o a.ff --resolution 64",
        "formfactor-tool compute a.mesh -o a.ff --method contour --resolution 64",
        "formfactor-tool compute a.mesh -o a.ff --method hemicube --resolution 0",
        "formfactor-tool compute a.mesh -o a.ff --rays 100",
        "formfactor-tool compute a.mesh -o a.ff --method hemicube --rays 100",
        "formfactor-tool compare a.ff",
        "formfactor-tool compare a.ff b.ff --max -1",
        "formfactor-tool export a.ff --mesh a.mesh -o a.csv",
        "formfactor-tool export a.ff --mesh a.mesh -o a.csv --by node",
        "solve-tool solve a.ff -o a.sol",
        "solve-tool solve a.ff --mesh a.mesh",
        "solve-tool solve a.ff --mesh a.mesh -o a.sol --tolerance 0",
        "solve-tool solve a.ff --mesh a.mesh -o a.sol --tolerance nan",
        "solve-tool export a.sol --mesh a.mesh -o a.csv --by node",
        "solve-tool export a.sol --mesh a.mesh -o a.csv",
        "solve-tool export a.sol --mesh a.mesh -o a.vtu --by face",
        "solve-tool compare a.sol b.sol",
        "mesh-tool compare a.mesh",
        "mesh-tool compare a.mesh b.mesh --max -1",
        "formfactor-tool import f.npy -o a.ff",
        "formfactor-tool import f.npy --mesh a.mesh -o a.ff --tolerance 0",
        "formfactor-tool picture a.ff -o a.png --row 1",
        "formfactor-tool info a.ff --row 1 --pair 1 2",
        "shade-tool compare a.exr",
        "shade-tool render a.sol -o a.exr",
        "shade-tool render a.sol --mesh a.mesh",
        "shade-tool render a.sol --mesh a.mesh -o a.exr --size 0x10",
        "shade-tool render a.sol --mesh a.mesh -o a.exr --size 10",
        "shade-tool probe a.sol --mesh a.mesh -o a.csv",
    ] {
        assert_usage(line);
    }
}

/// Flags and subcommands of later versions: unknown until they do something.
const LATER: &[&str] = &[
    "shade-tool render a.sol --mesh a.mesh -o a.exr --shading whitted",
    "solve-tool solve a.ff --mesh a.mesh -o a.sol --medium fog.toml",
];

#[test]
fn what_belongs_to_later_versions_is_2_and_not_in_the_help() {
    for line in LATER {
        assert_usage(line);
        let words: Vec<&str> = line.split_whitespace().collect();
        let later = words[words.len() - 2];
        if !later.starts_with("--") || matches!(later, "--method" | "--solver" | "--shading") {
            continue;
        }
        let help = exit(&format!("{} {} --help", words[0], words[1])).expect_code(0).stdout;
        assert!(!help.contains(later), "{later} is in the help: {help}");
    }
}

#[test]
fn what_is_usable_now_is_taken() {
    // Good usage on files that are not there: 1, not 2.
    for (line, file) in [
        ("mesh-tool build a.obj -o a.mesh --elements 50", "a.obj"),
        ("mesh-tool build a.obj -o a.mesh --max-edge 0.5 --threads 2 --quiet", "a.obj"),
        ("mesh-tool materials a.obj -o a.materials --depfile a.d", "a.obj"),
        ("formfactor-tool compute a.mesh -o a.ff --method auto --tolerance 1e-6", "a.mesh"),
        ("formfactor-tool compute a.mesh -o a.ff --precision f64 --shard 2/3", "a.mesh"),
        ("formfactor-tool compute a.mesh -o a.ff --closure least-squares", "a.mesh"),
        ("formfactor-tool merge a.1.ff a.2.ff -o a.ff --closure off", "a.1.ff"),
        ("formfactor-tool compute a.mesh -o a.ff --method area", "a.mesh"),
        ("formfactor-tool compute a.mesh -o a.ff --method contour --tolerance 1e-3", "a.mesh"),
        ("formfactor-tool compute a.mesh -o a.ff --method hemicube --resolution 64", "a.mesh"),
        ("formfactor-tool compute a.mesh -o a.ff --method rays --rays 100", "a.mesh"),
        ("formfactor-tool compare a.ff b.ff --mesh a.mesh --json --max 0.1", "a.ff"),
        ("formfactor-tool export a.ff --mesh a.mesh --by group -o a.csv", "a."),
        ("mesh-tool compare a.mesh b.mesh --max 0", "a.mesh"),
        ("mesh-tool export a.mesh -o a.ply", "a.mesh"),
        ("mesh-tool import a.vs3 -o a.obj", "a.vs3"),
        ("formfactor-tool import f.npy --mesh a.mesh -o a.ff", "a.mesh"),
        ("formfactor-tool picture a.ff -o a.png", "a.ff"),
        ("solve-tool compare a.sol b.sol --mesh a.mesh", "a."),
        ("shade-tool compare a.exr b.exr --max 0.1", "a.exr"),
        ("solve-tool solve a.ff --mesh a.mesh --solver cg -o a.sol --verbose", "a."),
        ("solve-tool solve a.ff --mesh a.mesh --solver direct -o a.sol", "a."),
        ("solve-tool export a.sol --mesh a.mesh --by element -o a.npy", "a."),
        ("shade-tool render a.sol --mesh a.mesh -o a.exr --png a.png --size 40x30", "a."),
        ("shade-tool probe a.sol --mesh a.mesh --points p.csv -o a.csv", "p.csv"),
    ] {
        let done = exit(line).expect_code(1);
        assert!(done.stderr.contains(": error: ") && done.stderr.contains(file), "{line}: {}", done.stderr);
        assert_eq!(done.stdout, "", "{line}");
    }
}

#[test]
fn an_output_that_is_an_input_is_refused() {
    for (line, output) in [
        ("mesh-tool build a.obj -o a.obj", "a.obj"),
        ("mesh-tool materials a.obj -o ./a.obj", "a.obj"),
        ("formfactor-tool compute a.mesh -o ./a.mesh", "a.mesh"),
        ("formfactor-tool export a.csv --mesh a.mesh --by group -o a.csv", "a.csv"),
        ("formfactor-tool merge a.csv a.ff -o a.ff", "a.ff"),
        ("formfactor-tool import a.csv --mesh a.mesh -o a.csv", "a.csv"),
        ("solve-tool solve a.ff --mesh a.mesh -o a.ff", "a.ff"),
        ("solve-tool solve a.ff --mesh a.mesh -o a.mesh", "a.mesh"),
        ("solve-tool solve a.ff --mesh a.mesh --materials a.mtl -o a.mtl", "a.mtl"),
        ("solve-tool export a.csv --mesh a.mesh --by group -o a.csv", "a.csv"),
        ("shade-tool probe a.sol --mesh a.mesh --points a.csv -o a.csv", "a.csv"),
    ] {
        let folder = tests::folder();
        let scene = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        for name in ["a.obj", "a.mtl", "a.mesh", "a.ff", "a.sol", "a.csv"] {
            std::fs::write(folder.path().join(name), scene).unwrap();
        }
        let mut words = line.split_whitespace();
        let done = run(tool(words.next().unwrap()).args(words).current_dir(folder.path()));
        assert_eq!(done.code, Some(1), "{line}: {}", done.stderr);
        assert!(done.stderr.contains("is an input"), "{line}: {}", done.stderr);
        assert_eq!(tests::text(&folder.path().join(output)), scene, "{line}");
    }
}
