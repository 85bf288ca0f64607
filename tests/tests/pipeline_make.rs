//! `pipeline.mk` runs exactly the stages an edit touches: proved with stand-ins for the tools that log their calls, and
//! with make's own words ("Nothing to be done", `make -q`) after every step.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use tests::pipeline::{ALL, Pipeline};

const MATERIALS: &str = ALL[0];
const BUILD: &str = ALL[1];
const COMPUTE: &str = ALL[2];
const SOLVE: &str = ALL[3];
const RENDER: &str = ALL[4];

/// A pipeline that has run once.
fn made() -> Pipeline {
    let pipeline = Pipeline::new();
    pipeline.expect(&[], &ALL);
    pipeline
}

#[test]
fn first_run_makes_all_and_keeps_every_file() {
    let pipeline = made();
    for ending in ["materials", "surfaces", "mesh", "ff", "sol", "exr", "png"] {
        assert!(pipeline.path(&format!("out/room.{ending}")).exists(), "{ending}");
    }
}

#[test]
fn a_colour_or_a_power_reruns_materials_solving_and_shading() {
    let pipeline = made();
    pipeline.edit("paint.mtl", "Kd 0.5 0.5 0.5", "Kd 0.6 0.5 0.5");
    pipeline.expect(&[], &[MATERIALS, SOLVE, RENDER]);
    pipeline.edit("paint.mtl", "Ke 10 10 10", "Ke 20 20 20");
    pipeline.expect(&[], &[MATERIALS, SOLVE, RENDER]);
    pipeline.edit("paint.mtl", "newmtl white", "# a comment\nnewmtl white");
    pipeline.expect(&[], &[MATERIALS]);
}

#[test]
fn what_geometry_depends_on_in_materials_reruns_all() {
    let pipeline = made();
    pipeline.edit("paint.mtl", "Ke 0 0 0", "Ke 1 0 0");
    pipeline.expect(&[], &ALL);
    pipeline.edit("room.toml", "[camera]", "two_sided = [\"white\"]\n[camera]");
    pipeline.expect(&[], &ALL);
}

#[test]
fn a_moved_camera_reruns_shading() {
    let pipeline = made();
    pipeline.edit("room.toml", "[0, 0, 1]", "[0, 0, 2]");
    pipeline.expect(&[], &[MATERIALS, RENDER]);
}

#[test]
fn a_toml_that_comes_or_goes_reruns_shading() {
    let pipeline = made();
    let toml = tests::text(&pipeline.path("room.toml"));
    pipeline.remove("room.toml");
    pipeline.expect(&[], &[MATERIALS, RENDER]);
    pipeline.write("room.toml", &toml);
    pipeline.expect(&[], &[MATERIALS, RENDER]);
    // Without a camera in it, it is not offered as one.
    pipeline.write("room.toml", "units = \"m\"\n");
    let done = pipeline.make(&[]).expect_code(0);
    assert!(!done.stdout.contains("--camera"), "{}", done.stdout);
}

#[test]
fn an_edited_scene_reruns_all_and_a_comment_stops_at_the_mesh() {
    let pipeline = made();
    pipeline.edit("room.obj", "v 1 1 0", "v 1 2 0");
    pipeline.expect(&[], &ALL);
    pipeline.edit("room.obj", "mtllib", "# a comment\nmtllib");
    pipeline.expect(&[], &[MATERIALS, BUILD]);
}

#[test]
fn material_files_of_any_name_are_known() {
    let pipeline = made();
    for name in ["other.mtl", "two words.mtl"] {
        let mtl = tests::text(&pipeline.path("paint.mtl"));
        pipeline.write(name, &mtl);
        let obj = tests::text(&pipeline.path("room.obj"));
        let first = obj.lines().next().unwrap();
        pipeline.edit("room.obj", first, &format!("mtllib {name}"));
        pipeline.expect(&[], &ALL);
        pipeline.edit(name, "Kd 0.5", "Kd 0.25");
        pipeline.expect(&[], &[MATERIALS, SOLVE, RENDER]);
    }
}

#[test]
fn error_and_flags_rerun_their_stage_and_what_follows() {
    let pipeline = made();
    pipeline.expect(&["ERROR=0.01"], &ALL[1..]);
    pipeline.expect(&["ERROR=0.010"], &[]);
    pipeline.expect(&["ERROR=0.01", "MESH_FLAGS=--max-edge 0.1"], &ALL[1..]);
    pipeline.expect(&["ERROR=0.01", "MESH_FLAGS=--max-edge 0.1", "FF_FLAGS=--tolerance 1e-7"], &ALL[2..]);
    pipeline.expect(&[], &ALL[1..]);
    pipeline.expect(&["SOLVE_FLAGS=--verbose"], &ALL[3..]);
    pipeline.expect(&["SOLVE_FLAGS=--verbose", "SHADE_FLAGS=--size 40x30"], &ALL[4..]);
    // A quote and a dollar in a flag reach the stage and compare equal the next time.
    pipeline.expect(&["SHADE_FLAGS=--size '40x30' \"$$HOME\""], &ALL[3..]);
}

#[test]
fn a_flag_of_the_user_replaces_the_derived_one() {
    let pipeline = Pipeline::new();
    let flags = [
        "MESH_FLAGS=--elements=50",
        "FF_FLAGS=--tolerance=1e-7",
        "SOLVE_FLAGS=--tolerance 1e-9",
        "ERROR=0.5",
    ];
    let said = pipeline.make(&flags).expect_code(0).stdout;
    assert_eq!(said.matches("--elements").count(), 1, "{said}");
    // Of matrix, solution and picture one each.
    assert_eq!(said.matches("--tolerance").count(), 3, "{said}");
    assert!(said.contains("--tolerance=1e-7") && said.contains("--tolerance 1e-9"), "{said}");
}

#[test]
fn a_changed_tool_reruns_its_stage() {
    let pipeline = made();
    // The same output from a newer program: what follows stays.
    pipeline.edit("bin/formfactor-tool", "#!/bin/sh", "#!/bin/sh\n# newer");
    pipeline.expect(&[], &[COMPUTE]);
    pipeline.edit("bin/solve-tool", "solve-tool) (cat", "solve-tool) (echo other; cat");
    pipeline.expect(&[], &[SOLVE, RENDER]);
    // A program under another name, and one with an interpreter in front.
    std::fs::create_dir(pipeline.path("mine")).unwrap();
    std::fs::copy(pipeline.path("bin/shade-tool"), pipeline.path("mine/shade-tool")).unwrap();
    std::os::unix::fs::symlink(pipeline.path("bin/log"), pipeline.path("mine/log")).unwrap();
    pipeline.expect(&["SHADE_TOOL=sh mine/shade-tool"], &[RENDER]);
    pipeline.edit("mine/shade-tool", "#!/bin/sh", "#!/bin/sh\n# newer");
    pipeline.expect(&["SHADE_TOOL=sh mine/shade-tool"], &[RENDER]);
}

#[test]
fn another_scene_of_the_same_name_reruns_all() {
    let pipeline = made();
    std::fs::create_dir(pipeline.path("other")).unwrap();
    for name in ["room.obj", "paint.mtl", "room.toml"] {
        std::fs::copy(pipeline.path(name), pipeline.path(&format!("other/{name}"))).unwrap();
    }
    pipeline.edit("other/room.obj", "v 1 1 0", "v 1 3 0");
    pipeline.expect(&["SCENE=other/room.obj"], &ALL);
    pipeline.expect(&["SCENE=./other/room.obj"], &[]);
    pipeline.expect(&["SCENE=room.obj"], &ALL);
}

#[test]
fn a_deleted_file_is_remade() {
    let pipeline = made();
    // Each is remade with the same content, so that only the stages that read it run besides.
    let next: [(&str, &[&str]); 8] = [
        ("materials", &[MATERIALS, SOLVE, RENDER]),
        ("surfaces", &[MATERIALS, BUILD]),
        ("materials.d", &[MATERIALS]),
        ("mesh", &[BUILD, COMPUTE, SOLVE, RENDER]),
        ("ff", &[COMPUTE, SOLVE]),
        ("sol", &[SOLVE, RENDER]),
        ("exr", &[RENDER]),
        ("png", &[RENDER]),
    ];
    for (ending, stages) in next {
        let path = pipeline.path(&format!("out/room.{ending}"));
        let before = tests::bytes(&path);
        std::fs::remove_file(&path).unwrap();
        pipeline.expect(&[], stages);
        assert_eq!(tests::bytes(&path), before, "{ending}");
    }
    // Stamps and flags are bookkeeping: without them the stage runs again, and its output stops what follows.
    for (name, stage) in [("ff.made", COMPUTE), ("sol.flags", SOLVE)] {
        pipeline.remove(&format!("out/room.{name}"));
        pipeline.expect(&[], &[stage]);
    }
}

#[test]
fn a_missed_tolerance_warns_once_and_goes_on_and_strict_stops() {
    let pipeline = Pipeline::new();
    pipeline.exit_with("formfactor-tool", Some(3));
    let done = pipeline.make(&[]).expect_code(0);
    assert_eq!(pipeline.log(), ALL);
    assert_eq!(done.stderr.matches("warning").count(), 1, "{}", done.stderr);
    assert!(done.stderr.contains("out/room.ff: the asked tolerance was not reached"), "{}", done.stderr);
    pipeline.expect_nothing(&[]);

    // STRICT asks again for what once was let through, stops at it each time, and keeps the file.
    for _ in 0..2 {
        pipeline.make(&["STRICT=1"]).expect_code(2).expect_said("STRICT");
        assert_eq!(pipeline.log(), [COMPUTE]);
        assert!(pipeline.path("out/room.ff").exists());
    }
    pipeline.expect_nothing(&["STRICT=0"]);
    pipeline.exit_with("formfactor-tool", None);
    pipeline.expect(&["STRICT=1"], &[COMPUTE]);
}

#[test]
fn strict_stops_a_first_run_and_the_next_one_goes_on() {
    let pipeline = Pipeline::new();
    pipeline.exit_with("solve-tool", Some(3));
    pipeline.make(&["STRICT=1"]).expect_code(2);
    assert_eq!(pipeline.log(), ALL[..4]);
    assert!(pipeline.path("out/room.sol").exists());
    let done = pipeline.make(&[]).expect_code(0);
    assert_eq!(pipeline.log(), [SOLVE, RENDER], "{}", done.stderr);
}

#[test]
fn a_failure_stops_and_the_next_run_tries_again() {
    let pipeline = made();
    let before = tests::bytes(&pipeline.path("out/room.sol"));
    pipeline.exit_with("solve-tool", Some(1));
    pipeline.edit("paint.mtl", "Kd 0.5", "Kd 0.25");
    for stages in [&[MATERIALS, SOLVE][..], &[SOLVE]] {
        pipeline.make(&[]).expect_code(2).expect_said("told to fail");
        assert_eq!(pipeline.log(), stages);
        assert_eq!(tests::bytes(&pipeline.path("out/room.sol")), before);
    }
    pipeline.exit_with("solve-tool", None);
    pipeline.expect(&[], &[SOLVE, RENDER]);
}

#[test]
fn a_failure_after_changed_flags_is_tried_again() {
    let pipeline = made();
    pipeline.exit_with("formfactor-tool", Some(1));
    for _ in 0..2 {
        pipeline.make(&["FF_FLAGS=--tolerance 1e-3"]).expect_code(2);
        assert_eq!(pipeline.log(), [COMPUTE]);
    }
    pipeline.exit_with("formfactor-tool", None);
    pipeline.expect(&[], &[COMPUTE]);
}

#[test]
fn an_edit_while_a_stage_runs_is_not_lost() {
    let pipeline = Pipeline::new();
    let mtl = pipeline.path("paint.mtl");
    pipeline.write("bin/solve-tool.before", &format!("sleep 0.02; echo 'Kd 0.125 0 0' >> {}", mtl.display()));
    pipeline.make(&[]).expect_code(0);
    assert_eq!(pipeline.log(), ALL);
    pipeline.remove("bin/solve-tool.before");
    pipeline.expect(&[], &[MATERIALS, SOLVE, RENDER]);
}

#[test]
fn a_missing_scene_or_material_file_is_the_tools_to_explain() {
    let pipeline = made();
    pipeline.make(&["SCENE=rom.obj"]).expect_code(2).expect_said("did you mean");
    assert_eq!(pipeline.log(), [MATERIALS]);
    pipeline.remove("paint.mtl");
    pipeline.make(&[]);
    assert_eq!(pipeline.log()[0], MATERIALS);
}

#[test]
fn bad_variables_are_refused_before_anything_runs() {
    let pipeline = Pipeline::new();
    for (variable, said) in [
        ("SCENE=my room.obj", "SCENE = \"my room.obj\""),
        ("OUT=a b", "OUT = \"a b\""),
        ("OUT=", "OUT = \"\""),
        ("SCENE=a;b.obj", "make splits names"),
        ("SCENE=room.ply", "an .obj file"),
        ("ERROR=fine", "ERROR = fine"),
        ("ERROR=0", "a number above 0"),
        ("ERROR=-1", "a number above 0"),
        ("ERROR=0.1 0.2", "a number above 0"),
        ("ERROR='", "a number above 0"),
        ("MESH_TOOL=no-such-program", "MESH_TOOL = \"no-such-program\": no such program"),
        ("SHADE_TOOL=", "SHADE_TOOL = \"\""),
    ] {
        let done = pipeline.make(&[variable]).expect_code(2).expect_said(said);
        assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
    }
    assert_eq!(pipeline.log(), [""; 0]);
    assert!(!pipeline.path("out").exists());
}

#[test]
fn parallel_silent_and_from_another_folder() {
    let mut pipeline = Pipeline::new();
    let done = pipeline.make(&["-j2", "-s"]).expect_code(0);
    assert_eq!(done.stdout + &done.stderr, "");
    assert_eq!(pipeline.log(), ALL);
    pipeline.expect_nothing(&["-j2"]);

    // The same outputs by absolute paths: only programs and flags count, not how the paths were written.
    let folder = pipeline.path("");
    pipeline.working_folder = pipeline.path("bin");
    pipeline.variables = vec![
        format!("SCENE={}", folder.join("room.obj").display()),
        format!("OUT={}/", folder.join("out").display()),
    ];
    pipeline.make(&[]).expect_code(0);
    // Material files are listed as they were found from the first folder, so the materials are looked at again.
    assert_eq!(pipeline.log(), [MATERIALS]);
    pipeline.expect_nothing(&[]);
}

#[test]
fn clean_removes_what_was_made_for_this_scene_and_nothing_else() {
    let pipeline = made();
    for name in ["room.txt", "room2.mesh", "notes"] {
        pipeline.write(&format!("out/{name}"), "mine");
    }
    pipeline.write("out/.room.ff.abc123.partial", "left by a killed stage");
    pipeline.make(&["clean", "SHADE_TOOL=no-such-program"]).expect_code(0);
    let mut left: Vec<String> = std::fs::read_dir(pipeline.path("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["notes", "room.txt", "room2.mesh"]);
    pipeline.expect(&[], &ALL);
    pipeline.make(&["clean", "all"]).expect_code(0);
    assert_eq!(pipeline.log(), ALL);
}

const MERGE: &str = "formfactor-tool merge";

#[test]
fn shards_are_made_and_merged_and_an_edit_reruns_what_it_touches() {
    let mut pipeline = Pipeline::new();
    pipeline.variables.push("SHARDS=3".into());
    let shards = [COMPUTE; 3];
    let all = [&[MATERIALS, BUILD], &shards[..], &[MERGE, SOLVE, RENDER]].concat();
    pipeline.expect(&[], &all);
    for part in 1..=3 {
        assert!(pipeline.path(&format!("out/room.{part}of3.ff")).exists(), "part {part}");
    }
    pipeline.edit("paint.mtl", "Kd 0.5 0.5 0.5", "Kd 0.6 0.5 0.5");
    pipeline.expect(&[], &[MATERIALS, SOLVE, RENDER]);
    pipeline.edit("room.obj", "v 1 1 0", "v 1 2 0");
    pipeline.expect(&[], &all);
    // One part taken away is made again, alone, and is the same: merging finds nothing new to read.
    pipeline.remove("out/room.2of3.ff");
    pipeline.expect(&[], &[COMPUTE, MERGE]);
    pipeline.remove("out/room.ff");
    pipeline.expect(&[], &[MERGE, SOLVE]);
    // Side by side, with another flag.
    let done = pipeline.make(&["-j", "3", "FF_FLAGS=--tolerance 0.1"]).expect_code(0);
    assert_eq!(pipeline.log().len(), 3 + 3, "{}", done.stdout);
    assert!(done.stdout.contains("--shard 3/3 --tolerance 0.1"), "{}", done.stdout);
    pipeline.make(&["clean"]).expect_code(0);
    let left = std::fs::read_dir(pipeline.path("out")).unwrap().count();
    assert_eq!(left, 0, "clean leaves nothing");
    for bad in ["0", "-1", "two", "1.5", "10000", ""] {
        let done = pipeline.make(&[&format!("SHARDS={bad}")]);
        assert!(done.code == Some(2) && done.stderr.contains("SHARDS"), "{bad:?}: {}", done.stderr);
    }
}
