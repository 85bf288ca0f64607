#![allow(clippy::unwrap_used)]
use super::*;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A folder with `s.obj` and further files.
fn folder(obj: &str, files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files.iter().copied().chain([("s.obj", obj)]) {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Reads `s.obj`; a refusal is told without the folder.
fn read_in(folder: &tempfile::TempDir, two_sided: &[&str]) -> std::result::Result<Scene, String> {
    let two_sided: Vec<String> = two_sided.iter().map(|name| (*name).to_owned()).collect();
    let scene = Scene::read(&folder.path().join("s.obj"), &two_sided);
    scene.map_err(|e| e.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

/// Refusal of a square with these lines after line 4, beside `m.mtl` with material `white`.
fn refusal(lines: &str) -> String {
    let white = [("m.mtl", "newmtl white\nKd 0.5\n")];
    read_in(&folder(&format!("{SQUARE}{lines}"), &white), &[]).unwrap_err()
}

#[test]
fn unknown_usemtl_is_an_error_with_line_and_nearest_name() {
    let near = refusal("mtllib m.mtl\nusemtl white\nf 1 2 3\nusemtl whit\nf 1 3 4");
    assert_eq!(near, "s.obj:8: usemtl whit, which no material file defines; did you mean white?");
    let strange = refusal("mtllib m.mtl\nusemtl concrete\nf 1 2 3");
    assert_eq!(strange, "s.obj:6: usemtl concrete, which no material file defines; there are white");
    let no_file = refusal("usemtl white\nf 1 2 3");
    assert_eq!(no_file, "s.obj:5: usemtl white, but no mtllib line names a material file; add one");
}

#[test]
fn missing_material_file_is_an_error_with_line_and_nearest_name() {
    let message = refusal("f 1 2 3\nmtllib n.mtl");
    assert_eq!(message, "s.obj:6: material file n.mtl does not exist; did you mean m.mtl?");
}

#[test]
fn missing_scene_is_an_error_with_nearest_name() {
    let folder = folder(SQUARE, &[]);
    let message = Scene::read(&folder.path().join("t.obj"), &[]).unwrap_err().to_string();
    assert!(message.ends_with("s.obj?"), "{message}");
}

#[test]
fn kd_with_one_number_is_grey() {
    let folder = folder(
        &format!("mtllib m.mtl\n{SQUARE}usemtl grey\nf 1 2 3 4"),
        &[("m.mtl", "newmtl grey\nKd 0.1\n")],
    );
    let scene = read_in(&folder, &[]).unwrap();
    assert_eq!(scene.materials.values[0].diffuse, [0.1; 3]);
}

#[test]
fn bad_mtl_line_is_an_error_not_a_loss() {
    let folder = folder(
        &format!("mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3 4"),
        &[("m.mtl", "newmtl a\nKd 0.5\nnewmtl b\nKd 0.5 x 0.5\n")],
    );
    let message = read_in(&folder, &[]).unwrap_err();
    assert_eq!(message, "m.mtl:4: material b: Kd has `x`, which is not a number");
}

#[test]
fn materials_are_those_used_in_order_of_first_use() {
    let mtl = "newmtl a\nKd 0.1\nnewmtl unused\nKd 0.2\nnewmtl b\nKd 0.3\nKe 1 2 3\n";
    let obj = format!(
        "{SQUARE}f 1 2 3 4\nmtllib m.mtl\nusemtl unused\nusemtl b\nf 4 3 2 1\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4"
    );
    let scene = read_in(&folder(&obj, &[("m.mtl", mtl)]), &[]).unwrap();
    assert_eq!(scene.materials.names, [NONE, "b", "a"]);
    assert_eq!(scene.materials.values[0], Material::default());
    assert_eq!(scene.materials.values[1].radiance, [1.0, 2.0, 3.0]);
    assert_eq!(scene.faces.iter().map(|f| f.material.0).collect::<Vec<_>>(), [0, 1, 2, 1]);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("faces before any usemtl (1) are black"), "{:?}", scene.warnings);
}

#[test]
fn two_sided_materials_come_from_toml_and_argument() {
    let mtl = "newmtl leaf\nKd 0.1\nnewmtl wall\nKd 0.2\nnewmtl sail\nKd 0.3\n";
    let obj =
        format!("mtllib m.mtl\n{SQUARE}usemtl leaf\nf 1 2 3 4\nusemtl wall\nf 4 3 2 1\nusemtl sail\nf 1 2 3");
    let folder = folder(&obj, &[("m.mtl", mtl), ("s.toml", "two_sided = [\"leaf\"]")]);
    let scene = read_in(&folder, &["sail"]).unwrap();
    assert_eq!(scene.materials.values.iter().map(|m| m.two_sided).collect::<Vec<_>>(), [1.0, 0.0, 1.0]);
    assert_eq!(scene.settings.two_sided, ["leaf"]);
    assert_eq!(
        read_in(&folder, &["cloth"]).unwrap_err(),
        "s.obj: two-sided material cloth was asked for, which no material file defines; \
         there are leaf, sail, wall"
    );
    let toml = "\ntwo_sided = [\n  \"leaf\",\n  \"waal\",\n]\n";
    std::fs::write(folder.path().join("s.toml"), toml).unwrap();
    assert_eq!(
        read_in(&folder, &[]).unwrap_err(),
        "s.toml:4: two_sided names material waal, which no material file defines; did you mean wall?"
    );
}

#[test]
fn dependencies_are_the_files_that_were_read() {
    let obj = format!("mtllib m.mtl n.mtl\nmtllib m.mtl\n{SQUARE}f 1 2 3");
    let folder = folder(&obj, &[("m.mtl", ""), ("n.mtl", ""), ("s.toml", "")]);
    let names = |scene: &Scene| -> Vec<String> {
        let name = |path: &std::path::PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
        scene.dependencies().iter().map(name).collect()
    };
    let scene = read_in(&folder, &[]).unwrap();
    assert_eq!(names(&scene), ["s.obj", "m.mtl", "n.mtl", "s.toml"]);
    assert_eq!(scene.digest, Digest::of(obj.as_bytes()));
    std::fs::remove_file(folder.path().join("s.toml")).unwrap();
    assert_eq!(names(&read_in(&folder, &[]).unwrap()), ["s.obj", "m.mtl", "n.mtl"]);
}

#[test]
fn kd_and_ks_beyond_one_is_one_warning_about_used_materials() {
    let mtl = "newmtl a\nKd 0.35\nKs 0.65\nnewmtl b\nKd 0.8\nKs 0 0.5 0\nnewmtl c\nKd 0.8\nKs 0.5\n\
               newmtl d\nKd 1\nKs 1\n";
    let obj = format!(
        "mtllib m.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl c\nf 1 2 3\nusemtl d\nusemtl a\nf 1 2 4"
    );
    let scene = read_in(&folder(&obj, &[("m.mtl", mtl)]), &[]).unwrap();
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].contains("m.mtl:4: material b (and 1 other): Kd + Ks exceeds 1"));
}

#[test]
fn huge_and_tiny_coordinates_keep_every_digit() {
    for scale in [1e-300, 1e-6, 1.0, 1e6, 1e75] {
        let text: String = [[0.0, 0.1], [1.0, 0.3], [0.7, 1.0]]
            .iter()
            .map(|[x, y]| format!("v {} {:e} {}\n", x * scale, y * scale, -scale))
            .collect();
        let scene = read_in(&folder(&format!("{text}f 1 2 3"), &[]), &[]).unwrap();
        assert_eq!(scene.vertices[1], [scale, 0.3 * scale, -scale]);
        assert_eq!(scene.vertices[2], [0.7 * scale, scale, -scale]);
    }
}

#[test]
fn byte_order_marks_and_dos_line_ends_change_nothing() {
    let obj = format!("\u{feff}mtllib m.mtl\n{SQUARE}g wall\nusemtl a\nf 1 2 3 4\n");
    let mtl = "\u{feff}newmtl a\nKd 0.1 0.2 0.3\n";
    let plain = read_in(&folder(&obj[3..], &[("m.mtl", &mtl[3..])]), &[]).unwrap();
    let dos = [("m.mtl", mtl.replace('\n', "\r\n"))];
    let other = read_in(&folder(&obj.replace('\n', "\r\n"), &[(dos[0].0, &dos[0].1)]), &[]).unwrap();
    assert_eq!(plain.faces, other.faces);
    assert_eq!(plain.vertices, other.vertices);
    assert_eq!(plain.materials, other.materials);
    assert_eq!(plain.groups, other.groups);
    assert_eq!(plain.materials.values[0].diffuse, [0.1, 0.2, 0.3]);
}
