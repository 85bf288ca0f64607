//! The program from files to files: exit codes, messages, the same bytes for any number of threads.
#![allow(clippy::unwrap_used)]

mod common;

use common::{cube, furnace, run};
use interchange::materials::{Material, MaterialTable};
use interchange::provenance::Provenance;
use std::path::Path;

/// Exit code and the one line on stderr.
fn failure(folder: &Path, line: &str) -> (Option<i32>, String) {
    let output = run(folder, line);
    assert!(output.stdout.is_empty(), "{line}: data on stdout");
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

const INSIDE: &str = "--eye 0.5,0.5,0.1 --look-at 0.5,0.5,1 --fov-deg 100 --size 24x16";

#[test]
fn render_writes_picture_preview_and_report() {
    let folder = furnace();
    let line = format!(
        "render s.sol --mesh s.mesh -o s.exr --png s.png --samples 2 --float --interpolation linear {INSIDE}"
    );
    let output = run(folder.path(), &line);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");

    let told = run(folder.path(), "info s.exr --json");
    let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(
        (told["layers"][0]["width"].as_u64(), told["layers"][0]["height"].as_u64()),
        (Some(24), Some(16))
    );
    for (k, b) in [(0, 4.0), (1, 2.0), (2, 1.0)] {
        let channel = &told["layers"][0]["channels"][k];
        assert_eq!(channel["precision"], "float");
        for key in ["min", "max", "mean"] {
            let error = channel[key].as_f64().unwrap() * std::f64::consts::PI / b - 1.0;
            // f32 rounds to 6e-8.
            assert!(error.abs() < 1e-7, "{key} of channel {k}: relative error {error}");
        }
    }
    let provenance = told["attributes"]["provenance"].as_str().unwrap();
    let provenance: serde_json::Value = serde_json::from_str(provenance).unwrap();
    assert_eq!(provenance["flags"][0], "--samples 2");
    for role in ["solution", "mesh", "materials"] {
        assert_eq!(provenance["inputs"][role].as_str().unwrap().len(), 64, "{role}");
    }
    assert!(!told["attributes"].to_string().contains("capDate"));

    let report = std::fs::read_to_string(folder.path().join("s.exr.report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    // Four in a pixel, two at each end of a column in a row; 20 x 20 where a border of walls is seen, by the tolerance of 0.02, and
    // 58 x 58 where a lamp is on one side.
    let borders = report["counters"]["border_pixels"].as_u64().unwrap();
    let lamps = report["counters"]["lamp_border_pixels"].as_u64().unwrap();
    assert!(borders > lamps && lamps > 0);
    let more = (borders - lamps) * 20 * 20 + lamps * 58 * 58;
    assert_eq!(report["counters"]["samples"], 24 * 16 * 4 + 25 * 2 * 16 + more);
    // The ceiling is black, and the wall behind the eye is not seen.
    assert_eq!(report["counters"]["nodes_black_skipped"], 4);
    assert_eq!(report["counters"]["nodes_unseen_skipped"], 4);
    assert_eq!(report["counters"]["nodes_gathered"], 0);
    assert_eq!(report["counters"]["nodes_split"], 16);
    assert_eq!(report["counters"]["node_edges_gathered"], 32);
    let preview = std::fs::read(folder.path().join("s.png")).unwrap();
    assert_eq!(&preview[..8], b"\x89PNG\r\n\x1a\n");
}

#[test]
fn same_bytes_for_any_number_of_threads_and_from_any_folder() {
    let folder = furnace();
    for (name, threads) in [("one", 1), ("three", 3)] {
        let line = format!(
            "render s.sol --mesh s.mesh -o {name}.exr --png {name}.png --threads {threads} --size 40x30"
        );
        assert!(run(folder.path(), &line).status.success());
    }
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("one.exr"), bytes("three.exr"));
    assert_eq!(bytes("one.png"), bytes("three.png"));
}

#[test]
fn toml_camera_is_used_and_the_command_line_wins() {
    let folder = furnace();
    let toml = "[camera]\neye = [0.5, 0.5, 0.1]\nlook_at = [0.5, 0.5, 1]\nup = [0, 1, 0]\nfocal_length = 0.02\n\
                film = [0.03, 0.03]\nresolution = [12, 10]\n";
    std::fs::write(folder.path().join("c.toml"), toml).unwrap();
    for (flags, size, film) in
        [("", "12x10", "half_width=0.75 half_height=0.625"), ("--size 9x9", "9x9", "half_height=0.75")]
    {
        assert!(
            run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr --camera c.toml {flags}"))
                .status
                .success()
        );
        let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
        assert!(told.contains(&format!("size={size}")) && told.contains(film), "{told}");
        assert!(!told.contains("framing"));
    }
    assert!(run(folder.path(), "render s.sol --mesh s.mesh -o s.exr --size 8x8").status.success());
    let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
    assert!(told.contains("size=8x8 framing"), "{told}");
}

#[test]
fn probe_adds_irradiance_to_the_points() {
    let folder = furnace();
    let points = "x,y,z,nx,ny,nz\n0.5,1e-7,0.50,0,2,0\n0,0,0,0,1,0\n.5,.5,.5,1,1,1\n";
    std::fs::write(folder.path().join("p.csv"), points).unwrap();
    let output = run(folder.path(), "probe s.sol --mesh s.mesh --points p.csv -o out.csv");
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty(), "{output:?}");
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!((lines[0], lines.len()), ("x,y,z,nx,ny,nz,H_r,H_g,H_b", 4));
    assert!(lines[1].starts_with("0.5,1e-7,0.50,0,2,0,"));
    for line in &lines[1..] {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        for (got, want) in fields[6..].iter().zip([1.0, 2.0, 4.0]) {
            assert!((got / want - 1.0).abs() < 1e-10, "{line}");
        }
    }
    assert!(folder.path().join("out.csv.report.json").exists());
    let shown = run(folder.path(), "probe s.sol --mesh s.mesh --points p.csv -o -");
    assert_eq!((shown.status.code(), String::from_utf8_lossy(&shown.stdout).into_owned()), (Some(0), table));

    std::fs::write(folder.path().join("p.csv"), "x,y,z,nx,ny,nz\n").unwrap();
    assert!(run(folder.path(), "probe s.sol --mesh s.mesh --points p.csv -o out.csv").status.success());
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert_eq!(table, "x,y,z,nx,ny,nz,H_r,H_g,H_b\n");
}

#[test]
fn bad_points_and_files_fail_with_one_line_that_says_where() {
    let folder = furnace();
    let probe = "probe s.sol --mesh s.mesh --points p.csv -o out.csv";
    for (points, words) in [
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n", "p.csv:2: the normal is zero"),
        ("x,y,z,nx,ny,nz\n0,0,0,0,1,0\n0,NaN,0,0,1,0\n", "p.csv:3: y is NaN"),
        ("x,y,z,nx,ny,nz,id\n", "p.csv:1: header"),
    ] {
        std::fs::write(folder.path().join("p.csv"), points).unwrap();
        let (code, stderr) = failure(folder.path(), probe);
        assert!(code == Some(1) && stderr.contains(words), "{code:?} {stderr}");
        assert!(stderr.starts_with("shade-tool: error: ") && stderr.lines().count() == 1, "{stderr}");
    }
    assert!(!folder.path().join("out.csv").exists());

    let (code, stderr) = failure(folder.path(), "render s.sol --mesh t.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("did you mean") && stderr.contains("s.mesh"), "{stderr}");
    let (code, stderr) = failure(folder.path(), "info s.sol");
    assert!(code == Some(1) && stderr.contains("solve-tool info"), "{stderr}");
    let (code, stderr) = failure(folder.path(), "render s.mesh --mesh s.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("a mesh (.mesh)"), "{stderr}");
}

#[test]
fn files_of_different_scenes_are_refused() {
    let folder = furnace();
    let at = |name: &str| folder.path().join(name);
    let mut other = cube();
    other.vertices[0][0] = -0.25;
    other.write(&at("o.mesh"), Provenance::new("mesh-tool", "test")).unwrap();
    let (code, stderr) = failure(folder.path(), "render s.sol --mesh o.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("do not belong together"), "{stderr}");

    let grey = MaterialTable { names: vec!["white".into()], values: vec![Material::default()] };
    grey.write(&at("o.materials"), Provenance::new("mesh-tool", "test")).unwrap();
    let (code, stderr) =
        failure(folder.path(), "render s.sol --mesh s.mesh -o s.exr --materials o.materials");
    assert!(code == Some(1) && stderr.contains("lamp"), "{stderr}");
    std::fs::remove_file(at("s.materials")).unwrap();
    let (code, stderr) = failure(folder.path(), "render s.sol --mesh s.mesh -o s.exr");
    assert!(code == Some(1) && stderr.contains("s.materials"), "{stderr}");
    assert!(!at("s.exr").exists());
}

#[test]
fn bad_usage_ends_with_2() {
    let folder = furnace();
    let render = "render s.sol --mesh s.mesh -o s.exr";
    for flags in [
        // Of later work.
        "--integrator whitted",
        "--layers bounces",
        "--interpolation cubic",
        "--interpolation constant --layers direct",
        "--shading whitted",
        "--shading phong --layers indirect",
        "--shading phong --phong blinn",
        "--shading cook-torrance --phong 1975",
        "--no-shadows",
        "--shading flat --bounces s.sol",
        "--no-skip everything",
        "--orthographic 0",
        "--orthographic 1 --fov-deg 30",
        "--panorama --orthographic 1",
        "--turntable 0",
        "--all-cameras",
        // Values out of range.
        "--size 0x4",
        "--samples 0",
        "--samples 65",
        "--eye 1,2 --look-at 0,0,0",
        "--eye 1,2,nan --look-at 0,0,0",
        "--fov-deg 180",
        "--focal-length -1 --film 1,1",
        "--exposure inf --png s.png",
        "--exposure auto1 --png s.png",
        "--curve gamma --png s.png",
        "--png s.jpg",
        "--threads 0",
        // Flags that need others, or exclude them.
        "--eye 1,2,3",
        "--camera-name front",
        "--focal-length 1",
        "--exposure 1",
        "--curve linear",
        "--interpolation constant --bounces s.sol",
        "--fov-deg 30 --focal-length 1 --film 1,1",
    ] {
        let (code, stderr) = failure(folder.path(), &format!("{render} {flags}"));
        assert_eq!(code, Some(2), "{flags}: {stderr}");
    }
    for line in [
        "",
        "compare a.exr",
        "render s.sol -o s.exr",
        "probe s.sol --mesh s.mesh -o o.csv",
        "render s.sol --mesh s.mesh -o s.png",
        "probe s.sol --mesh s.mesh --points p.csv -o out.txt",
        "view s.exr -o v.png",
        "view tone s.exr -o v.exr",
        "view tone s.exr -o v.png --step 5",
        "view mesh s.exr -o v.png",
        "view false-colour s.exr -o v.png --range 5,1",
        "view false-colour s.exr -o v.png --range 0,1 --log",
        "view isolux s.exr -o v.png --step 0",
        "view tone s.exr -o v.png --layer depth",
        "view isolux s.exr -o v.png --step 1 --levels 1,2",
        "sheet -o v.png",
        "sheet a.exr b.exr -o v.png --labels one",
        "sheet a.exr -o v.png --columns 0",
        "sheet a.exr -o v.png --bounces 0,1 --labels dark,all",
        "probe s.sol --mesh s.mesh --points p.csv --spacing 0.1 -o out.csv",
        "probe s.sol --mesh s.mesh --points p.csv --height 1 -o out.csv",
        "probe s.sol --mesh s.mesh --points p.csv --grid walls --spacing 1 -o out.csv",
    ] {
        assert_eq!(failure(folder.path(), line).0, Some(2), "{line}");
    }
    assert!(!folder.path().join("s.exr").exists());
}

#[test]
fn other_materials_are_used_with_a_warning() {
    let folder = furnace();
    let black =
        MaterialTable { names: vec!["lamp".into(), "white".into()], values: vec![Material::default(); 2] };
    black.write(&folder.path().join("o.materials"), Provenance::new("mesh-tool", "test")).unwrap();
    let output =
        run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr --materials o.materials {INSIDE}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && stderr.contains("not the materials that s.sol was solved with"),
        "{stderr}"
    );
    let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
    assert!(told.contains("R half: 0.000000 to 0.000000"), "{told}");
}

#[test]
fn every_camera_of_a_toml_and_a_turntable_give_files_of_their_own() {
    let folder = furnace();
    let camera = |name: &str, lens: &str| {
        format!(
            "[[camera]]\nname = \"{name}\"\neye = [0.5, 0.5, 0.1]\nlook_at = [0.5, 0.5, 1]\nup = [0, 1, 0]\n\
             resolution = [12, 6]\n{lens}\n"
        )
    };
    let toml = camera("front", "fov_deg = 40")
        + &camera("plan", "projection = \"orthographic\"\nview_height = 0.5")
        + &camera("around", "projection = \"equirectangular\"");
    std::fs::write(folder.path().join("c.toml"), toml).unwrap();
    // The lamp's share and the walls' add up to 1, but each changes from place to place and is interpolated for itself:
    // to less than what is asked here.
    let line = "render s.sol --mesh s.mesh -o s.exr --png s.png --camera c.toml --all-cameras --interpolation gather --tolerance 5e-4";
    let output = run(folder.path(), line);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    for name in ["front", "plan", "around"] {
        let told = run(folder.path(), &format!("info s.{name}.exr --json"));
        let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
        let channel = &told["layers"][0]["channels"][2];
        for key in ["min", "max"] {
            let error = channel[key].as_f64().unwrap() * std::f64::consts::PI - 1.0;
            // Halves round to 5e-4; the lamp's own and all walls' radiosity is 1.
            assert!(error.abs() < 1e-3, "{name} {key}: {error}");
        }
        assert!(folder.path().join(format!("s.{name}.png")).exists());
    }
    let line = "render s.sol --mesh s.mesh -o t.exr --turntable 3 --size 8x8";
    assert!(run(folder.path(), line).status.success());
    assert!((0..3).all(|k| folder.path().join(format!("t.00{k}.exr")).exists()));
    std::fs::write(folder.path().join("none.toml"), "two_sided = []\n").unwrap();
    let output = run(folder.path(), "render s.sol --mesh s.mesh -o s.exr --camera none.toml --size 8x8");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && stderr.contains("none.toml: has no camera"), "{stderr}");
}

#[test]
fn layers_are_stored_by_name_and_skips_do_not_change_the_answer() {
    let folder = furnace();
    let line = format!(
        "render s.sol --mesh s.mesh -o s.exr {INSIDE} --layers albedo,normal,depth,element,face,irradiance,direct,indirect,error"
    );
    assert!(run(folder.path(), &line).status.success());
    let told = String::from_utf8(run(folder.path(), "info s.exr").stdout).unwrap();
    for channel in [
        "albedo.R half",
        "normal.Z half",
        "depth.Z float",
        "element.id uint",
        "face.id uint",
        "irradiance.B half",
        "direct.G half",
        "indirect.G half",
        "error.V half",
    ] {
        assert!(told.contains(channel), "{channel}: {told}");
    }
    for attribute in ["worldToCamera", "worldToNDC", "whiteLuminance: 179", "chromaticities"] {
        assert!(told.contains(attribute), "{attribute}: {told}");
    }
    let values = |flags: &str| {
        let line = format!("render s.sol --mesh s.mesh -o t.exr --float --size 9x9 {flags}");
        assert!(run(folder.path(), &line).status.success(), "{flags}");
        let told = run(folder.path(), "info t.exr --json");
        let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
        told["layers"][0]["channels"][2]["mean"].as_f64().unwrap()
    };
    let want = values("");
    for flags in [
        "--no-skip far",
        "--no-skip hidden",
        "--no-skip far,hidden,joined,faint",
        "--no-skip faint",
        "--no-skip joined",
        "--interpolation gather",
    ] {
        // In a furnace all that is gathered is 1; the lamp's part of the tolerance is a tenth of 0.02.
        assert!((values(flags) / want - 1.0).abs() < 2e-3, "{flags}");
    }
}

fn size_of(folder: &Path, name: &str) -> [u32; 2] {
    let bytes = std::fs::read(folder.join(name)).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{name}");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

/// Every view of one picture, none of which renders again: solution and materials are gone.
#[test]
fn views_are_made_from_the_picture_alone() {
    let folder = furnace();
    let line = format!(
        "render s.sol --mesh s.mesh -o s.exr --layers element,face,irradiance,error --interpolation linear {INSIDE}"
    );
    assert!(run(folder.path(), &line).status.success());
    for name in ["s.sol", "s.materials"] {
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
    for (view, wider, higher) in [
        ("tone --exposure -1 --curve linear", false, false),
        ("tone --layer irradiance --curve filmic", false, false),
        ("false-colour --quantity radiance", true, true),
        ("false-colour --quantity illuminance --log --range 1,1000", true, true),
        ("isolux --step 100", true, true),
        ("mesh --mesh s.mesh", true, true),
        ("error", true, true),
    ] {
        let (kind, flags) = view.split_once(' ').unwrap_or((view, ""));
        let output = run(folder.path(), &format!("view {kind} s.exr -o v.png {flags}"));
        assert!(
            output.status.success() && output.stderr.is_empty() && output.stdout.is_empty(),
            "{output:?}"
        );
        let [width, height] = size_of(folder.path(), "v.png");
        assert_eq!((width > 24, height > 16), (wider, higher), "{view}: {width} x {height}");
    }
    let report = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path().join(name)).unwrap()).unwrap()
    };
    let line = "view false-colour s.exr -o v.png --quantity irradiance --range 0,2";
    assert!(run(folder.path(), line).status.success());
    assert_eq!(report("v.png.report.json")["estimates"]["scale_high"], 2.0);
    assert!(run(folder.path(), "view tone s.exr -o v.png --exposure 3").status.success());
    assert_eq!(report("v.png.report.json")["estimates"]["exposure_stops"], 3.0);
    let pixel = |line: &str| {
        assert!(run(folder.path(), line).status.success());
        let file = std::io::BufReader::new(std::fs::File::open(folder.path().join("v.png")).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        [bytes[0], bytes[1], bytes[2]]
    };
    let bright = pixel("view tone s.exr -o v.png --curve linear --exposure -2");
    let dim = pixel("view tone s.exr -o v.png --curve linear --exposure -3");
    // Radiance 1, 2 and 4 over pi at 2^-2: 0.0796, 0.159 and 0.318 are 79, 112 and 153 in sRGB.
    assert_eq!(bright, [80, 111, 153]);
    assert_eq!(dim[1..], bright[..2]);
    // Irradiance 1, 2 and 4 at 2^-3: 0.125, 0.25 and 0.5 are 99, 137 and 188.
    let layer = pixel("view tone s.exr -o v.png --layer irradiance --curve linear --exposure -3");
    assert_eq!(layer, [99, 137, 188]);
}

#[test]
fn views_say_what_a_picture_lacks() {
    let folder = furnace();
    assert!(run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr {INSIDE}")).status.success());
    let mut other = cube();
    other.vertices[0][0] = -0.25;
    other.write(&folder.path().join("o.mesh"), Provenance::new("mesh-tool", "test")).unwrap();
    for (view, words) in [
        ("view isolux s.exr -o v.png", "--layers irradiance"),
        ("view isolux s.exr -o v.png --quantity luminance", "--layers face"),
        ("view error s.exr -o v.png", "--layers element"),
        ("view mesh s.exr --mesh o.mesh -o v.png", "another mesh"),
        ("view tone s.sol -o v.png", "solve-tool info"),
        ("sheet s.exr t.exr -o v.png", "t.exr"),
    ] {
        let (code, stderr) = failure(folder.path(), view);
        assert!(code == Some(1) && stderr.contains(words) && stderr.lines().count() == 1, "{view}: {stderr}");
    }
    assert!(!folder.path().join("v.png").exists());
}

#[test]
fn a_sheet_shows_all_with_the_exposure_of_the_last() {
    let folder = furnace();
    for (name, flags) in [("0", "--interpolation constant"), ("1", "--interpolation linear")] {
        let line = format!("render s.sol --mesh s.mesh -o {name}.exr --png {name}.png {flags} {INSIDE}");
        assert!(run(folder.path(), &line).status.success());
    }
    let line = "sheet 0.exr 1.exr 1.exr -o sheet.png --columns 2 --labels none,one,all";
    assert!(run(folder.path(), line).status.success());
    let [width, height] = size_of(folder.path(), "sheet.png");
    assert!(width > 2 * 24 && height > 2 * 16, "{width} x {height}");
    let report = std::fs::read_to_string(folder.path().join("sheet.png.report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    // Constant and interpolated furnaces are the same to halves.
    assert!(report["estimates"]["relative_rms_0"].as_f64().unwrap() < 1e-3);
    assert_eq!(report["estimates"]["relative_rms_1"], 0.0);
    assert_eq!(report["counters"]["pictures"], 3);
    let (code, stderr) = failure(folder.path(), "sheet 1.exr -o sheet.png --bounces 0,1");
    assert!(code == Some(1) && stderr.contains("has no layer bounces.0"), "{stderr}");
}

/// A closed room in which only the ceiling emits, B of 1, 2 and 4: direct light on the middle of the floor is the known
/// factor of two facing squares' sides, and the walls' own light is nowhere.
#[test]
fn local_models_know_direct_light_only() {
    let folder = furnace();
    let camera =
        "--eye 0.5,0.5,0.5 --look-at 0.5,0,0.5 --up 0,0,1 --orthographic 0.01 --size 3x3 --samples 2 --float";
    for shading in ["flat", "phong", "phong --phong 1975", "cook-torrance", "cook-torrance --no-shadows"] {
        let line = format!(
            "render s.sol --mesh s.mesh -o s.exr --png s.png --shading {shading} --layers irradiance,element {camera}"
        );
        let output = run(folder.path(), &line);
        assert!(output.status.success(), "{output:?}");
        let told = run(folder.path(), "info s.exr --json");
        let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
        let channels = told["layers"][0]["channels"].as_array().unwrap().clone();
        let mean = |name: &str| {
            channels.iter().find(|c| c["name"] == name).and_then(|c| c["mean"].as_f64()).unwrap()
        };
        // A square of side 1 seen from 1 below its middle: 4 / pi h atan h with h = 0.5 / sqrt(1.25).
        let h = 0.5 / 1.25f64.sqrt();
        let factor = 4.0 / std::f64::consts::PI * h * h.atan();
        for (name, b) in [("irradiance.R", 1.0), ("irradiance.B", 4.0)] {
            let error = mean(name) / (b * factor) - 1.0;
            assert!(error.abs() < 1e-4, "{shading} {name}: {error}");
        }
        // Kd is 1 and nothing has Ks.
        assert!((mean("G") * std::f64::consts::PI / (2.0 * factor) - 1.0).abs() < 1e-4, "{shading}");
        let provenance = told["attributes"]["provenance"].as_str().unwrap().to_owned();
        assert!(provenance.contains("--shading") && !provenance.contains("--interpolation"), "{provenance}");
    }
    let report = std::fs::read_to_string(folder.path().join("s.exr.report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["counters"]["emitting_polygons"], 1);
    assert!(report["warnings"][0].as_str().unwrap().contains("no material has Ks"));
}

#[test]
fn local_models_give_the_same_bytes_for_any_number_of_threads() {
    let folder = furnace();
    for (name, threads) in [("one", 1), ("three", 3)] {
        let line = format!(
            "render s.sol --mesh s.mesh -o {name}.exr --shading cook-torrance --threads {threads} {INSIDE}"
        );
        assert!(run(folder.path(), &line).status.success());
    }
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("one.exr"), bytes("three.exr"));
}
