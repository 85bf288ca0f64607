//! No input makes the scene reader panic, and what it accepts keeps its promises.
#![allow(clippy::unwrap_used)]

use interchange::scene::{Scene, Settings};
use proptest::prelude::*;

const OBJ: &str = "# head\nmtllib m.mtl\nv 0 0 0\nv 1.5e-3 0 -0\nv 1 1 0 0.5\nv 0 1 0 1 0 0\nvt 0 0\nvn 0 0 1\n\
                   o box\nusemtl a\nf 1 2 3 4\ng left  wall\nusemtl b\nf 1/1/1 2//1 \\\n -1/1\nusemtl a\nf 1 3 2\n";
const MTL: &str =
    "newmtl a\nKd 0.5 0.25 0.125\nKe 1 2 3\nd 1\nmap_Kd x.png\nnewmtl b\nKd 0.1\nNs 20\nTr 0.5\n";
const TOML: &str = "two_sided = [\"a\"]\nunits = \"m\"\n[[camera]]\nname = \"x\"\neye = [0, 5, -6.5]\n\
                    look_at = [0, 0.3, 0]\nup = [0, 1, 0]\nresolution = [128, 96]\nfov_deg = 40\n";

/// Pieces of text that have tripped readers of these formats.
const PIECES: [&str; 24] = [
    "nan",
    "-inf",
    "1e999",
    "0",
    "-1",
    "-9",
    "4294967297",
    "/",
    "//",
    "\\\n",
    "\\",
    "\r",
    "\n",
    "#",
    "\u{feff}",
    "f ",
    "v ",
    "usemtl ",
    "newmtl ",
    "mtllib",
    "Kd",
    "[camera]",
    "=",
    "\"",
];

/// One change of a text: a range of bytes, by fractions of its length, gives way to others.
type Change = (f64, f64, Vec<u8>);

fn change() -> impl Strategy<Value = Change> {
    let piece = proptest::sample::select(PIECES.to_vec()).prop_map(|piece| piece.as_bytes().to_vec());
    let bytes = proptest::collection::vec(any::<u8>(), 0..4);
    (0.0..1.0, 0.0..0.1, prop_oneof![piece, bytes])
}

fn changed(text: &str, changes: &[Change]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for (start, width, new) in changes {
        let from = (start * bytes.len() as f64) as usize;
        let to = (from + (width * bytes.len() as f64) as usize).min(bytes.len());
        bytes.splice(from..to, new.iter().copied());
    }
    bytes
}

/// Reads a scene of these files; a scene that is accepted must keep what its documentation promises.
fn read(obj: &[u8], mtl: &[u8], toml: &[u8]) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("s.obj"), obj).unwrap();
    std::fs::write(file("m.mtl"), mtl).unwrap();
    std::fs::write(file("s.toml"), toml).unwrap();
    let settings = Settings::read(&file("s.toml"));
    let scene = match Scene::read(&file("s.obj"), &[]) {
        Ok(scene) => scene,
        Err(error) => {
            prop_assert!(error.to_string().starts_with(&*folder.path().to_string_lossy()), "{}", error);
            return Ok(());
        }
    };
    prop_assert_eq!(&scene.settings, &settings.unwrap());
    prop_assert!(!scene.faces.is_empty());
    prop_assert!(scene.vertices.iter().flatten().all(|x| x.is_finite()));
    let lines = 1 + obj.iter().filter(|&&byte| byte == b'\n' || byte == b'\r').count();
    for face in &scene.faces {
        prop_assert!(face.corners.len() >= 3);
        prop_assert!(face.corners.iter().all(|&corner| (corner as usize) < scene.vertices.len()));
        prop_assert!(face.group.index() < scene.groups.len());
        prop_assert!(face.material.index() < scene.materials.names.len());
        prop_assert!((1..=lines).contains(&face.line));
    }
    prop_assert_eq!(scene.materials.names.len(), scene.materials.values.len());
    for material in &scene.materials.values {
        prop_assert!(material.diffuse.iter().all(|x| (0.0..=1.0).contains(x)));
        prop_assert!(material.radiance.iter().all(|x| x.is_finite() && *x >= 0.0));
    }
    Ok(())
}

#[test]
fn the_unchanged_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("s.obj", OBJ), ("m.mtl", MTL), ("s.toml", TOML)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let scene = Scene::read(&folder.path().join("s.obj"), &[]).unwrap();
    assert_eq!(scene.faces.len(), 3);
    assert_eq!(scene.groups, ["box", "left  wall"]);
}

#[test]
fn a_large_scene_keeps_every_face() {
    let (side, folder) = (317u32, tempfile::tempdir().unwrap());
    let at = |row: u32, column: u32| row * (side + 1) + column + 1;
    let mut text = String::from("mtllib m.mtl\n");
    for row in 0..=side {
        (0..=side).for_each(|column| text += &format!("v {} {} 0.125\n", f64::from(column) / 7.0, row));
    }
    for row in 0..side {
        text += &format!("g row {}\nusemtl {}\n", row % 100, ["a", "b"][(row % 2) as usize]);
        for column in 0..side {
            let corners =
                [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
            text += &format!("f {} {} {} {}\n", corners[0], corners[1], corners[2], corners[3]);
        }
    }
    std::fs::write(folder.path().join("s.obj"), text).unwrap();
    std::fs::write(folder.path().join("m.mtl"), MTL).unwrap();
    let scene = Scene::read(&folder.path().join("s.obj"), &[]).unwrap();
    assert_eq!(scene.faces.len(), (side * side) as usize);
    assert_eq!(scene.vertices.len(), ((side + 1) * (side + 1)) as usize);
    assert_eq!((scene.groups.len(), scene.materials.names.len()), (100, 2));
    let last = scene.faces.last().unwrap();
    assert_eq!(scene.vertices[last.corners[2] as usize], [f64::from(side) / 7.0, f64::from(side), 0.125]);
}

#[test]
fn deep_nesting_and_long_lines_are_no_danger() {
    let long = "9".repeat(1 << 20);
    read(format!("v {long}\nv 0 {long}e9 0").as_bytes(), b"", b"").unwrap();
    read(format!("v 0 0 0\nf{}", " 1".repeat(1 << 18)).as_bytes(), b"", b"").unwrap();
    read(format!("v 0 0 0\nf 1 1 1{}", " \\\n 1".repeat(1 << 18)).as_bytes(), b"", b"").unwrap();
    read(OBJ.as_bytes(), MTL.as_bytes(), format!("camera = {}", "[".repeat(1 << 16)).as_bytes()).unwrap();
    read(OBJ.as_bytes(), MTL.as_bytes(), format!("a{} = 1", ".a".repeat(1 << 14)).as_bytes()).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_panic(
        obj in proptest::collection::vec(any::<u8>(), 0..400),
        mtl in proptest::collection::vec(any::<u8>(), 0..200),
        toml in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        read(&obj, &mtl, &toml)?;
    }

    #[test]
    fn random_words_never_panic(words in proptest::collection::vec(proptest::sample::select(PIECES.to_vec()), 0..200)) {
        let text = words.join(" ").into_bytes();
        read(&text, &text, &text)?;
        read(&[OBJ.as_bytes(), &text].concat(), &[MTL.as_bytes(), &text].concat(), TOML.as_bytes())?;
    }

    #[test]
    fn changed_files_never_panic(
        obj in proptest::collection::vec(change(), 0..4),
        mtl in proptest::collection::vec(change(), 0..2),
        toml in proptest::collection::vec(change(), 0..2),
    ) {
        read(&changed(OBJ, &obj), &changed(MTL, &mtl), &changed(TOML, &toml))?;
        read(&changed(OBJ, &obj), MTL.as_bytes(), TOML.as_bytes())?;
    }
}
