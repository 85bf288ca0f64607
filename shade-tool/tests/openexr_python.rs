//! Pictures open in another reader, the OpenEXR package of Python, with all layers and attributes; and what the layers of
//! bounces hold. Without that package nothing is tested here, which is said.
#![allow(clippy::unwrap_used)]

mod common;

use common::{furnace, run};
use interchange::digest::Digest;
use interchange::materials::MaterialTable;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::solution::{Origins, Solution, Summary};
use serde_json::Value;
use std::path::Path;

/// Prints attributes, and least and largest value of every channel, as JSON.
const READER: &str = r#"
import json, sys
import OpenEXR
part = OpenEXR.File(sys.argv[1], separate_channels=True)
attributes = {}
for name, value in part.header().items():
    attributes[name] = value.tolist() if hasattr(value, "tolist") else value if isinstance(value, (int, float, str)) else str(value)
channels = {}
for name, channel in part.channels().items():
    pixels = channel.pixels
    channels[name] = [str(pixels.dtype), list(pixels.shape), float(pixels.min()), float(pixels.max())]
print(json.dumps({"attributes": attributes, "channels": channels}))
"#;

/// The picture as Python reads it; `None` without the package.
fn read(file: &Path) -> Option<Value> {
    let there = std::process::Command::new("python3").args(["-c", "import OpenEXR"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        eprintln!("not tested: python3 has no OpenEXR package (pip install OpenEXR)");
        return None;
    }
    let output = std::process::Command::new("python3").arg("-c").arg(READER).arg(file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// Solutions after 0 and 1 bounces beside those of the furnace: only the ceiling, face 1, shines.
fn write_bounces(folder: &Path) {
    let (_, _, mesh) = Mesh::read(&folder.join("s.mesh")).unwrap();
    let (_, _, materials) = MaterialTable::read(&folder.join("s.materials")).unwrap();
    for bounces in 0..2 {
        let mut radiosity = vec![[0.0; 3]; 6];
        radiosity[1] = [1.0, 2.0, 4.0];
        if bounces == 1 {
            radiosity.iter_mut().for_each(|b| *b = [1.0, 2.0, 4.0]);
        }
        let summary = Summary { solver: format!("partial sum of {bounces} bounces"), ..Summary::default() };
        let solution = Solution { irradiance: radiosity.clone(), radiosity, summary, ..Solution::default() };
        let origins = Origins { mesh, matrix: Digest::of(b"matrix"), materials };
        let path = folder.join(format!("b{bounces}.sol"));
        solution.write(&path, Provenance::new("solve-tool", "test"), origins).unwrap();
    }
}

#[test]
fn another_reader_finds_every_layer_and_attribute() {
    let folder = furnace();
    write_bounces(folder.path());
    let line = "render s.sol --mesh s.mesh -o s.exr --eye 0.5,0.5,0.1 --look-at 0.5,0.5,1 --fov-deg 40 --size 8x6 \
                --layers albedo,normal,depth,element,face,irradiance,direct,indirect,error --bounces b0.sol,b1.sol";
    let output = run(folder.path(), line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let Some(told) = read(&folder.path().join("s.exr")) else { return };
    let close = |channel: &str, want: [f64; 2]| {
        let found = &told["channels"][channel];
        assert_eq!(found[1], serde_json::json!([6, 8]), "{channel}");
        for (k, want) in want.into_iter().enumerate() {
            let got = found[k + 2].as_f64().unwrap();
            // Halves round to 5e-4, gathering may use a tenth of 0.02.
            assert!((got - want).abs() <= 3e-3 * want.abs().max(1e-3), "{channel}: {got} {want}");
        }
    };
    let radiance = 4.0 / std::f64::consts::PI;
    for channel in ["B", "bounces.2.B"] {
        close(channel, [radiance; 2]);
    }
    close("bounces.0.B", [0.0; 2]);
    close("albedo.G", [1.0; 2]);
    close("normal.Z", [-1.0; 2]);
    close("depth.Z", [0.9; 2]);
    close("element.id", [5.0; 2]);
    close("face.id", [5.0; 2]);
    close("irradiance.G", [2.0; 2]);
    for channel in ["direct.R", "indirect.R", "error.V", "bounces.1.R"] {
        assert_eq!(told["channels"][channel][1], serde_json::json!([6, 8]), "{channel}");
    }
    // The lamp alone lights a wall with less than the whole furnace, and with more than nothing.
    let once = &told["channels"]["bounces.1.B"];
    assert!(
        once[2].as_f64().unwrap() > 0.05 * radiance && once[3].as_f64().unwrap() < 0.7 * radiance,
        "{once}"
    );
    for (channel, kind) in [("B", "float16"), ("depth.Z", "float32"), ("element.id", "uint32")] {
        assert_eq!(told["channels"][channel][0], kind);
    }
    let attributes = &told["attributes"];
    for name in ["chromaticities", "worldToCamera", "worldToNDC", "comments", "provenance"] {
        assert!(!attributes[name].is_null(), "{name}: {attributes}");
    }
    assert_eq!(attributes["whiteLuminance"].as_f64(), Some(179.0));
    let provenance = attributes["provenance"].as_str().unwrap();
    assert!(provenance.contains("--tolerance 0.02") && provenance.contains("solution"), "{provenance}");
}

#[test]
fn solutions_of_other_bounces_are_refused() {
    let folder = furnace();
    write_bounces(folder.path());
    for (files, told) in
        [("b1.sol", "--bounces 0"), ("b0.sol,s.sol", "--bounces 1"), ("none.sol", "none.sol")]
    {
        let output =
            run(folder.path(), &format!("render s.sol --mesh s.mesh -o s.exr --size 4x4 --bounces {files}"));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(told) && stderr.lines().count() == 1, "{stderr}");
    }
}
