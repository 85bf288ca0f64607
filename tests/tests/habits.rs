//! What people expect of any program: help with lines that work, manual pages, completions, tables on standard output.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::chain::Chain;
use tests::{TOOLS, run, tool};

/// Every example in `--help` is a line of a page whose lines are run by a test.
#[test]
fn examples_of_the_help_are_lines_that_are_tested() {
    let pages = ["README.md", "docs/inspecting.md"].map(|page| tests::text(&tests::root().join(page)));
    for name in TOOLS {
        let help = run(tool(name).arg("--help")).expect_code(0).stdout;
        let (_, rest) =
            help.split_once("Examples:\n").unwrap_or_else(|| panic!("{name}: no examples: {help}"));
        let lines: Vec<&str> =
            rest.lines().take_while(|line| line.starts_with("  ")).map(str::trim).collect();
        assert!(lines.len() >= 4, "{name}: {lines:?}");
        for line in lines {
            let written =
                pages.iter().any(|page| page.lines().any(|other| other.strip_prefix("    ") == Some(line)));
            assert!(written, "{name}: no page has the line: {line}");
        }
    }
}

#[test]
fn manual_pages_and_completions_know_every_subcommand() {
    let folder = tests::folder();
    for name in TOOLS {
        run(tool(name).arg("pages").arg(folder.path())).expect_code(0);
        let file = |path: String| tests::text(&folder.path().join("share").join(path));
        let help = run(tool(name).arg("--help")).expect_code(0).stdout;
        assert!(!help.contains("  pages"), "{help}");
        let (_, commands) = help.split_once("Commands:\n").unwrap();
        let commands = commands.lines().take_while(|line| !line.is_empty());
        let commands: Vec<&str> = commands
            .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
            .filter_map(|line| line.split_whitespace().next())
            .filter(|word| *word != "help")
            .collect();
        assert!(commands.len() >= 4, "{commands:?}");
        let page = file(format!("man/man1/{name}.1"));
        assert!(page.contains("Examples:") && page.contains("Exit codes:"), "{page}");
        for command in commands {
            assert!(file(format!("man/man1/{name}-{command}.1")).contains(".TH"), "{name} {command}");
            for completion in [
                format!("bash-completion/completions/{name}"),
                format!("zsh/site-functions/_{name}"),
                format!("fish/vendor_completions.d/{name}.fish"),
            ] {
                assert!(file(completion.clone()).contains(command), "{completion} lacks {command}");
            }
        }
    }
}

#[test]
fn bash_completes_flags_behind_subcommands() {
    let folder = tests::folder();
    let completed = |name: &str, words: &[&str]| {
        run(tool(name).arg("pages").arg(folder.path())).expect_code(0);
        // As bash calls it: the program, the word at the cursor, the word before.
        let script = "source \"$1\"; shift; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); \
                      completer=$(complete -p \"$1\" | sed 's/.*-F \\([^ ]*\\).*/\\1/'); \
                      $completer \"$1\" \"${COMP_WORDS[-1]}\" \"${COMP_WORDS[-2]}\"; echo \"${COMPREPLY[@]}\"";
        let file = folder.path().join("share/bash-completion/completions").join(name);
        let mut bash = std::process::Command::new("bash");
        run(bash.args(["-c", script, "bash"]).arg(file).arg(name).args(words)).expect_code(0).stdout
    };
    assert_eq!(completed("solve-tool", &["solve", "--sol"]), "--solver\n");
    assert_eq!(completed("solve-tool", &["solve", "--solver", "gau"]), "gauss-seidel\n");
    assert_eq!(completed("formfactor-tool", &["import", "--rec"]), "--reciprocity\n");
    assert_eq!(completed("shade-tool", &["view", "false-colour", "--ran"]), "--range\n");
}

#[test]
fn a_dash_is_standard_output() {
    let folder = tests::folder();
    let chain =
        Chain::as_given(tests::scene("goral_cube.obj"), folder.path()).with_tolerances("1e-3", "1e-2");
    chain.solve();
    for (name, input) in [("formfactor-tool", "ff"), ("solve-tool", "sol")] {
        let export = |output: &std::path::Path| {
            let mut export = tool(name);
            export.current_dir(folder.path()).arg("export").arg(chain.path(input)).arg("--mesh");
            run(export.arg(chain.path("mesh")).args(["--by", "group", "-o"]).arg(output))
                .expect_code(0)
                .stdout
        };
        let file = folder.path().join("table.csv");
        assert_eq!(export(&file), "");
        assert_eq!(export("-".as_ref()), tests::text(&file));
    }
    // Geometry, too, where it is one file; what is mapped or renamed must be a file, and is refused before it is computed.
    let obj = tests::scene("goral_cube.obj");
    for name in ["mesh-tool", "solve-tool"] {
        let input = chain.path(if name == "mesh-tool" { "mesh" } else { "sol" });
        let file = folder.path().join("surface.rad");
        let export = |output: &std::path::Path, format: &str| {
            let mut export = tool(name);
            export
                .current_dir(folder.path())
                .arg("export")
                .arg(&input)
                .args(["--format", format, "-o"])
                .arg(output);
            if name == "solve-tool" {
                export.arg("--mesh").arg(chain.path("mesh"));
            }
            run(&mut export)
        };
        export(&file, "rad").expect_code(0);
        assert_eq!(export("-".as_ref(), "rad").expect_code(0).stdout, tests::text(&file));
        assert!(export("-".as_ref(), "obj").expect_code(1).stderr.contains("in a file beside it"));
    }
    let refused = |name: &str, words: &[&std::path::Path]| {
        let mut command = tool(name);
        command.current_dir(folder.path()).args(words).args(["-o", "-"]);
        assert!(
            run(&mut command).expect_code(1).stderr.contains("expected the name of a file"),
            "{name} {words:?}"
        );
    };
    let (mesh, matrix) = (chain.path("mesh"), chain.path("ff"));
    refused("mesh-tool", &["build".as_ref(), &obj]);
    refused("mesh-tool", &["materials".as_ref(), &obj]);
    refused("formfactor-tool", &["compute".as_ref(), &mesh]);
    refused("formfactor-tool", &["merge".as_ref(), &matrix]);
    refused("solve-tool", &["solve".as_ref(), &matrix, "--mesh".as_ref(), &mesh]);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(!names.iter().any(|name| name.to_string_lossy().starts_with('-')), "{names:?}");
}

/// On a terminal what takes over a second says how much time is left, and what does not says nothing.
#[test]
#[cfg(unix)]
fn a_bar_on_a_terminal_tells_the_time_left() {
    // Runs a command on a terminal of its own and prints what it says there, until it ends or a bar is seen.
    let script = "import os, pty, signal, sys
child, terminal = pty.fork()
if child == 0:
    os.execvp(sys.argv[1], sys.argv[1:])
said = b''
while b' left' not in said:
    try:
        more = os.read(terminal, 4096)
    except OSError:
        break
    if not more:
        break
    said += more
else:
    os.kill(child, signal.SIGINT)
os.waitpid(child, 0)
print(said.decode())";
    let folder = tests::folder();
    let scene = tests::root().join("tests/scenes/cornell_blocks.obj");
    let build = ["--elements", "2000", "-o", "s.mesh"];
    run(tool("mesh-tool").current_dir(folder.path()).arg("build").arg(scene).args(build)).expect_code(0);
    let said = |name: &str, words: &str| {
        let mut python = std::process::Command::new("python3");
        python.current_dir(folder.path()).env("TERM", "xterm").args(["-c", script]);
        run(python.arg(tests::program(name)).args(words.split(' '))).expect_code(0).stdout
    };
    let slow = said("formfactor-tool", "compute s.mesh -o s.ff --tolerance 1e-6");
    assert!(slow.contains("form factors [") && slow.contains(" % ") && slow.contains(" left"), "{slow:?}");
    let quick = said("mesh-tool", "info s.mesh");
    assert!(quick.contains("elements") && !quick.contains(" left"), "{quick:?}");
}

/// Interrupted while it computes, a tool ends by the signal and leaves no unfinished file; the old output stays.
#[test]
#[cfg(unix)]
fn an_interrupt_leaves_no_unfinished_file() {
    use std::os::unix::process::ExitStatusExt;
    let folder = tests::folder();
    let path = |name: &str| folder.path().join(name);
    let scene = tests::root().join("tests/scenes/cornell_blocks.obj");
    run(tool("mesh-tool").arg("build").arg(scene).arg("-o").arg(path("s.mesh")).args(["--elements", "2000"]))
        .expect_code(0);
    for (signal, number) in [("-INT", 2), ("-TERM", 15)] {
        std::fs::write(path("s.ff"), "old").unwrap();
        let mut running = tool("formfactor-tool")
            .arg("compute")
            .arg(path("s.mesh"))
            .arg("-o")
            .arg(path("s.ff"))
            .args(["--tolerance", "1e-6", "--quiet"])
            .spawn()
            .unwrap();
        let unfinished = || {
            let names = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
            names.filter(|name| name.to_string_lossy().ends_with(".partial")).count()
        };
        // With that tolerance the matrix takes many seconds: it is on its way as soon as its file is there.
        while unfinished() == 0 {
            assert!(running.try_wait().unwrap().is_none(), "ended before it was interrupted");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(
            std::process::Command::new("kill")
                .args([signal, &running.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(running.wait().unwrap().signal(), Some(number));
        assert_eq!(unfinished(), 0);
        assert_eq!(tests::text(&path("s.ff")), "old");
    }
}
