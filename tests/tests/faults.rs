//! What goes wrong from outside: a stage killed, a full disk, files cut short, damaged, swapped or of another run. The
//! next run works from the old file, or says what is wrong; nobody meets a panic or half a file.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tests::chain::{Chain, Stage, assert_refused};
use tests::damage::{Dice, cuts, flips, full};
use tests::{bytes, run, tool};

/// The Cornell box in a folder of its own, all stages run.
fn made(elements: u32) -> (TempDir, Chain) {
    let folder = tests::folder();
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder.path(), elements);
    chain.run_all();
    (folder, chain)
}

/// Every command that reads the file with this ending, with outputs named `old.*`.
fn readers(chain: &Chain, ending: &str) -> Vec<(Command, Option<PathBuf>)> {
    let mut found = Vec::new();
    for stage in Stage::ALL {
        if stage.inputs().contains(&ending) {
            let output = chain.path(stage.output()).with_file_name(format!("old.{}", stage.output()));
            found.push((chain.command_to(stage, &output), Some(output)));
        }
    }
    let export = |name: &str, output: &str| {
        let output = chain.path(ending).with_file_name(output);
        let mut command = tool(name);
        command.arg("export").arg(chain.path(ending)).arg("--mesh").arg(chain.path("mesh"));
        command.args(["--by", "group", "-o"]).arg(&output);
        (command, Some(output))
    };
    let maker = match ending {
        "ff" => "formfactor-tool",
        "sol" => "solve-tool",
        _ => "mesh-tool",
    };
    match ending {
        "ff" => found.push(export("formfactor-tool", "old.f.csv")),
        "sol" => found.push(export("solve-tool", "old.b.csv")),
        _ => {}
    }
    let mut info = tool(maker);
    info.arg("info").arg(chain.path(ending));
    // The page of a matrix leaves its entries unread unless asked.
    if ending == "ff" {
        info.arg("--verify");
    }
    found.push((info, None));
    found
}

/// Runs every reader of the file while it holds `content`; all must refuse it by name and leave their output alone.
fn assert_all_refuse(chain: &Chain, ending: &str, content: &[u8]) {
    let path = chain.path(ending);
    std::fs::write(&path, content).unwrap();
    for (mut command, output) in readers(chain, ending) {
        if let Some(output) = &output {
            std::fs::write(output, "old").unwrap();
        }
        let done = run(&mut command);
        assert_refused(&done, &path);
        if let Some(output) = output {
            assert_eq!(bytes(&output), b"old", "{command:?}");
        }
    }
}

#[test]
fn cut_files_are_refused_by_name() {
    let (_folder, chain) = made(60);
    for (seed, ending) in ["materials", "mesh", "ff", "sol"].into_iter().enumerate() {
        let good = bytes(&chain.path(ending));
        let more = Dice::new(300 + seed as u64);
        let more = (0..if full() { 250 } else { 0 }).scan(more, |dice, _| Some(dice.below(good.len())));
        for cut in cuts(good.len(), seed as u64).into_iter().chain(more) {
            assert_all_refuse(&chain, ending, &good[..cut]);
        }
        std::fs::write(chain.path(ending), good).unwrap();
    }
}

#[test]
fn flipped_bits_are_refused_by_name() {
    let (_folder, chain) = made(60);
    for (seed, ending) in ["materials", "mesh", "ff", "sol"].into_iter().enumerate() {
        let good = bytes(&chain.path(ending));
        for (_, bad) in flips(&good, if full() { 250 } else { 24 }, 100 + seed as u64) {
            assert_all_refuse(&chain, ending, &bad);
        }
        std::fs::write(chain.path(ending), good).unwrap();
    }
}

#[test]
fn a_file_of_another_kind_is_named_for_what_it_is() {
    let (_folder, chain) = made(60);
    let kinds = [
        ("materials", "a material table"),
        ("mesh", "a mesh"),
        ("ff", "an exchange matrix"),
        ("sol", "a solution"),
    ];
    for (ending, _) in kinds {
        let good = bytes(&chain.path(ending));
        for (foreign, name) in kinds {
            if foreign == ending {
                continue;
            }
            std::fs::copy(chain.path(foreign), chain.path(ending)).unwrap();
            // `info` may describe whatever it is given; the stages may not use it.
            let stages = readers(&chain, ending).into_iter().filter(|(_, output)| output.is_some());
            for (mut command, _) in stages {
                let done = run(&mut command);
                assert_refused(&done, &chain.path(ending));
                assert!(done.stderr.contains(&format!("found {name}")), "{}", done.stderr);
            }
            std::fs::write(chain.path(ending), &good).unwrap();
        }
    }
}

#[test]
fn files_of_another_run_do_not_mix() {
    let (_folder, chain) = made(60);
    let (_other_folder, other) = made(90);
    for (stage, ending) in
        [(Stage::Solve, "ff"), (Stage::Solve, "mesh"), (Stage::Render, "sol"), (Stage::Render, "mesh")]
    {
        let good = bytes(&chain.path(ending));
        std::fs::copy(other.path(ending), chain.path(ending)).unwrap();
        let output = chain.path("old");
        std::fs::write(&output, "old").unwrap();
        let output = output.with_extension(stage.output());
        let done = run(&mut chain.command_to(stage, &output));
        assert_refused(&done, &chain.path(ending));
        assert!(done.stderr.contains("do not belong together"), "{stage:?}: {}", done.stderr);
        std::fs::write(chain.path(ending), &good).unwrap();
    }
}

#[test]
fn missing_empty_and_misplaced_files_are_named() {
    let (folder, chain) = made(60);
    for ending in ["materials", "mesh", "ff", "sol"] {
        let path = chain.path(ending);
        let aside = folder.path().join("aside");
        std::fs::rename(&path, &aside).unwrap();
        // Beside it lies a file whose name is nearly the same.
        let near = folder.path().join(format!("s2.{ending}"));
        std::fs::copy(&aside, &near).unwrap();
        for (mut command, _) in readers(&chain, ending) {
            let done = run(&mut command);
            assert_refused(&done, &path);
            let remedy = if ending == "materials" { "mesh-tool" } else { "did you mean" };
            assert!(done.stderr.contains(remedy), "{command:?}: {}", done.stderr);
        }
        std::fs::create_dir(&path).unwrap();
        for (mut command, _) in readers(&chain, ending) {
            assert_refused(&run(&mut command), &path);
        }
        std::fs::remove_dir(&path).unwrap();
        std::fs::remove_file(near).unwrap();
        std::fs::rename(&aside, &path).unwrap();
    }
    for stage in Stage::ALL {
        let nowhere = folder.path().join("no-such-folder");
        let output = nowhere.join("s").with_extension(stage.output());
        assert_refused(&run(&mut chain.command_to(stage, &output)), &nowhere);
        let taken = folder.path().join("folder").with_extension(stage.output());
        std::fs::create_dir(&taken).unwrap();
        assert_refused(&run(&mut chain.command_to(stage, &taken)), &taken);
        std::fs::remove_dir(&taken).unwrap();
    }
}

#[test]
fn damaged_scenes_are_read_or_refused_by_name() {
    let folder = tests::folder();
    let scene = folder.path().join("cornell_blocks.obj");
    let endings = ["obj", "mtl", "toml"];
    for ending in endings {
        std::fs::copy(tests::scene(&format!("cornell_blocks.{ending}")), scene.with_extension(ending))
            .unwrap();
    }
    let chain = Chain::new(scene.clone(), folder.path(), 60);
    for (seed, ending) in endings.into_iter().enumerate() {
        let path = scene.with_extension(ending);
        let good = bytes(&path);
        let cuts = cuts(good.len(), seed as u64).into_iter().map(|cut| (cut, good[..cut].to_vec()));
        for (place, bad) in cuts.chain(flips(&good, 30, seed as u64)) {
            std::fs::write(&path, bad).unwrap();
            for stage in [Stage::Materials, Stage::Build] {
                let done = run(&mut chain.command(stage));
                // A cut or a changed digit may leave a good scene; a file may name another that is then missing.
                if done.code != Some(0) {
                    assert!(!done.stderr.contains("panicked"), "{ending} at {place}: {}", done.stderr);
                    assert_eq!(done.code, Some(1), "{ending} at {place}: {}", done.stderr);
                    assert!(done.stderr.contains(": error: "), "{ending} at {place}: {}", done.stderr);
                    assert!(done.stderr.contains(&*folder.path().to_string_lossy()), "{}", done.stderr);
                }
            }
        }
        std::fs::write(&path, good).unwrap();
    }
}

/// A stage with several outputs names the one it could not write; all are called `s.*`.
const ANY_OUTPUT: &str = "s.";

/// Another output of the stage than the one it would write now: made from a coarser mesh, or with another size.
fn put_old_outputs(chain: &Chain) -> Vec<(Stage, Vec<u8>, Vec<u8>)> {
    let folder = tests::folder();
    let older = Chain::new(tests::scene("goral_cube.obj"), folder.path(), 40);
    older.run_all();
    Stage::ALL
        .into_iter()
        .map(|stage| (stage, bytes(&older.path(stage.output())), bytes(&chain.path(stage.output()))))
        .collect()
}

#[test]
fn a_killed_stage_leaves_the_old_file_or_the_new_one() {
    let (_folder, chain) = made(150);
    let mut dice = Dice::new(20);
    for (stage, old, new) in put_old_outputs(&chain) {
        let path = chain.path(stage.output());
        assert_ne!(old, new, "{stage:?}");
        std::fs::write(&path, &old).unwrap();
        let start = Instant::now();
        run(&mut chain.command(stage));
        let whole = start.elapsed();
        assert_eq!(bytes(&path), new, "{stage:?}");
        for _ in 0..8 {
            std::fs::write(&path, &old).unwrap();
            let mut child = chain.command(stage).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(Duration::from_micros(dice.below(whole.as_micros() as usize) as u64));
            // SIGKILL: nothing in the program can tidy up.
            child.kill().unwrap();
            child.wait().unwrap();
            let left = bytes(&path);
            assert!(left == old || left == new, "{stage:?} left {} bytes of neither", left.len());
        }
        let done = run(&mut chain.command(stage));
        assert!(matches!(done.code, Some(0 | 3)), "{stage:?}: {}", done.stderr);
        assert_eq!(bytes(&path), new, "{stage:?} after being killed");
    }
}

#[test]
fn a_file_size_limit_leaves_the_old_file() {
    let (_folder, chain) = made(60);
    for (stage, old, new) in put_old_outputs(&chain) {
        let path = chain.path(stage.output());
        std::fs::write(&path, &old).unwrap();
        // With the signal ignored the write itself fails and can be explained; otherwise the program dies of it.
        for (ignored, refused) in [("trap '' XFSZ;", true), ("", false)] {
            let done =
                run(&mut in_shell(&format!("{ignored} ulimit -c 0; ulimit -f 0"), &chain.command(stage)));
            assert_ne!(done.code, Some(0), "{stage:?}");
            if refused {
                assert_refused(&done, ANY_OUTPUT.as_ref());
                assert!(done.stderr.contains("raise the file-size limit"), "{stage:?}: {}", done.stderr);
            }
            assert_eq!(bytes(&path), old, "{stage:?}");
        }
        run(&mut chain.command(stage));
        assert_eq!(bytes(&path), new, "{stage:?}");
    }
}

/// `command`, run by a shell after `setup`.
fn in_shell(setup: &str, command: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("{setup}; exec \"$0\" \"$@\"")).arg(command.get_program());
    shell.args(command.get_args());
    shell
}

/// A small file system in memory; unmounted when dropped.
struct SmallDisk {
    folder: TempDir,
}

impl SmallDisk {
    /// Needs the right to mount, which a container or a user may not have.
    fn mount(kibibytes: usize) -> Option<Self> {
        let folder = tests::folder();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={kibibytes}k"), "tmpfs"]).arg(folder.path());
        let done = mount.output().ok()?;
        done.status.success().then_some(Self { folder })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Fills all that is left but `spare` bytes.
    fn fill(&self, spare: usize) {
        let filler = self.path("filler");
        let mut content = vec![0u8; 1 << 20];
        while std::fs::write(&filler, &content).is_err() {
            let shorter = content.len().saturating_sub(4096);
            content.truncate(shorter);
        }
        content.truncate(content.len().saturating_sub(spare));
        std::fs::write(&filler, &content).unwrap();
    }
}

impl SmallDisk {
    /// Lets nobody write any more, root included; whether the system did.
    fn protect(&self) -> bool {
        let done = Command::new("mount").args(["-o", "remount,ro"]).arg(self.folder.path()).output();
        done.is_ok_and(|done| done.status.success())
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.folder.path()).output();
    }
}

#[test]
fn a_full_disk_leaves_the_old_file_and_says_so() {
    let (_folder, chain) = made(400);
    for stage in Stage::ALL {
        let Some(disk) = SmallDisk::mount(256) else {
            // The file-size limit above stands in where mounting is not allowed.
            eprintln!("no right to mount a small disk: only the file-size limit was tested");
            return;
        };
        let output = disk.path("s").with_extension(stage.output());
        std::fs::write(&output, "old").unwrap();
        disk.fill(0);
        let done = run(&mut chain.command_to(stage, &output));
        assert_refused(&done, ANY_OUTPUT.as_ref());
        assert!(done.stderr.contains("free some space"), "{stage:?}: {}", done.stderr);
        assert_eq!(bytes(&output), b"old", "{stage:?}");
        let left: Vec<String> = names(disk.folder.path());
        assert!(!left.iter().any(|name| name.ends_with(".partial")), "{left:?}");
    }
}

/// A folder that may only be read: by its permissions where they bind, by the file system where we may mount one.
#[cfg(unix)]
#[test]
fn a_read_only_folder_keeps_the_old_file_and_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let (_folder, chain) = made(60);
    let assert_kept = |stage: Stage, output: &Path, said: &str| {
        let done = run(&mut chain.command_to(stage, output));
        assert_refused(&done, ANY_OUTPUT.as_ref());
        assert!(done.stderr.contains(said), "{stage:?}: {}", done.stderr);
        assert_eq!(bytes(output), b"old", "{stage:?}");
        assert_eq!(names(output.parent().unwrap()), [output.file_name().unwrap().to_str().unwrap()]);
    };
    let mut tested = 0;
    for stage in Stage::ALL {
        let closed = tests::folder();
        let output = closed.path().join("s").with_extension(stage.output());
        std::fs::write(&output, "old").unwrap();
        let allow = |mode| {
            std::fs::set_permissions(closed.path(), std::fs::Permissions::from_mode(mode)).unwrap();
        };
        allow(0o555);
        // Root writes all the same.
        if std::fs::write(closed.path().join("try"), "").is_err() {
            assert_kept(stage, &output, "check the permissions");
            tested += 1;
        }
        allow(0o755);

        let Some(disk) = SmallDisk::mount(256) else { continue };
        let output = disk.path("s").with_extension(stage.output());
        std::fs::write(&output, "old").unwrap();
        if disk.protect() {
            assert_kept(stage, &output, "mount this one for writing");
            tested += 1;
        }
    }
    if tested == 0 {
        eprintln!("permissions do not bind and no right to mount: only a path below a file was tested");
    }
}

/// A path below a file can be written by nobody, root included.
#[test]
fn an_output_below_a_file_is_refused_and_the_file_kept() {
    let (folder, chain) = made(60);
    let file = folder.path().join("file");
    std::fs::write(&file, "old").unwrap();
    for stage in Stage::ALL {
        let done = run(&mut chain.command_to(stage, &file.join("s").with_extension(stage.output())));
        assert_refused(&done, &file);
        assert_eq!(bytes(&file), b"old", "{stage:?}");
    }
}

fn names(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}
