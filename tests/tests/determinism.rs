//! The same inputs and flags give the same bytes: with any number of threads, in any folder, however often.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::Path;
use tests::chain::Chain;
use tests::{run, tool};

/// Runs all stages, exports and a probe with this many threads; the bytes of every file but the reports, which hold times.
fn outputs(scene: &str, threads: u32) -> BTreeMap<String, Vec<u8>> {
    let folder = tests::folder();
    let mut chain = Chain::new(tests::scene(scene), folder.path(), 300);
    chain.common = vec!["--threads".into(), threads.to_string()];
    chain.run_all();

    let points = folder.path().join("points.csv");
    std::fs::write(&points, "x,y,z,nx,ny,nz\n100,200,300,0,1,0\n250,50,250,1,1,1\n").unwrap();
    let mesh = chain.path("mesh");
    for (name, input, output, rest) in [
        ("formfactor-tool", "ff", "f.csv", &["--by", "group"][..]),
        ("formfactor-tool", "ff", "f.npy", &["--by", "element"]),
        ("formfactor-tool", "ff", "f.mtx", &["--by", "face"]),
        ("solve-tool", "sol", "b.csv", &["--by", "group"]),
        ("solve-tool", "sol", "b.npy", &["--by", "element"]),
    ] {
        let mut export = tool(name);
        export.arg("export").arg(chain.path(input)).arg("--mesh").arg(&mesh).args(rest);
        run(export.arg("-o").arg(folder.path().join(output)).args(&chain.common)).expect_code(0);
    }
    let mut probe = tool("shade-tool");
    probe.arg("probe").arg(chain.path("sol")).arg("--mesh").arg(&mesh).arg("--points").arg(&points);
    run(probe.arg("-o").arg(folder.path().join("probed.csv")).args(&chain.common)).expect_code(0);
    // Looks, exports for other programs and pictures of each stage.
    let file = |name: &str| folder.path().join(name);
    let mut jobs = vec![
        ("mesh-tool", vec!["picture".into(), mesh.clone(), "-o".into(), file("mesh.svg")]),
        ("formfactor-tool", vec!["picture".into(), chain.path("ff"), "-o".into(), file("matrix.png")]),
        ("shade-tool", vec!["view".into(), "tone".into(), chain.path("exr"), "-o".into(), file("view.png")]),
    ];
    for ending in ["ply", "vtu", "glb", "rad", "vs3"] {
        let output = file(&format!("mesh.{ending}"));
        jobs.push(("mesh-tool", vec!["export".into(), mesh.clone(), "-o".into(), output]));
    }
    for (name, words) in jobs {
        run(tool(name).args(words).args(&chain.common)).expect_code(0);
    }
    read(folder.path())
}

fn read(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let named = files.map(|file| (file.file_name().into_string().unwrap(), tests::bytes(&file.path())));
    named.filter(|(name, _)| !name.ends_with(".report.json")).collect()
}

#[track_caller]
fn assert_same(scene: &str) {
    let reference = outputs(scene, 1);
    for ending in ["materials", "mesh", "ff", "sol", "exr", "png"] {
        assert!(reference.contains_key(&format!("s.{ending}")), "no s.{ending}");
    }
    for threads in [1, 2, 7] {
        let again = outputs(scene, threads);
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&again), names(&reference));
        for (name, bytes) in &again {
            let differs = bytes.iter().zip(&reference[name]).position(|(a, b)| a != b);
            assert!(*bytes == reference[name], "{name} with {threads} threads differs, first at {differs:?}");
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    assert_same("cornell_blocks.obj");
}
