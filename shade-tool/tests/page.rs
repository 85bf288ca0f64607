//! What a report page holds: all data, nothing that a name could smuggle in, the same bytes from the same files.
#![allow(clippy::unwrap_used)]

mod common;

use assert_cmd::Command;
use common::{cube, furnace_of};
use std::path::Path;
use std::process::Output;

/// A name that would be a program if it were not escaped.
const HOSTILE: &str = "</script><script>alert(1)</script><!--&\"'";

fn shade_tool(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("shade-tool").unwrap().current_dir(folder).args(arguments).output().unwrap()
}

fn page(folder: &Path, more: &[&str]) -> String {
    let flags = ["page", "s.sol", "--mesh", "s.mesh", "-o", "s.html"];
    let run = shade_tool(folder, &[&flags[..], more].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    std::fs::read_to_string(folder.join("s.html")).unwrap()
}

#[test]
fn names_are_escaped_and_nothing_is_loaded() {
    let mut mesh = cube();
    mesh.groups = vec![HOSTILE.into()];
    let folder = furnace_of(mesh);
    let html = page(folder.path(), &["--title", HOSTILE]);
    assert!(!html.contains("<script>alert") && !html.contains("<!--&"));
    // In the title, the heading and the table of powers; in the view's record, where it is JSON.
    assert!(html.matches("&lt;/script&gt;&lt;script&gt;alert(1)").count() >= 3);
    assert!(html.contains(r#"\u003c/script>\u003cscript>alert(1)"#));
    for outside in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!html.contains(outside), "the page asks for {outside}");
    }
    assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
}

#[test]
fn all_arrays_are_there_and_the_same_files_give_the_same_bytes() {
    let folder = furnace_of(cube());
    let html = page(folder.path(), &[]);
    // Six elements: 3 f32 each are 72 bytes, 96 letters of base64.
    for (name, letters) in
        [("radiosity", 96), ("irradiance", 96), ("areas", 32), ("faces", 32), ("starts", 40)]
    {
        let begin = format!("id=\"data-{name}\">");
        let data = html.split(&begin).nth(1).unwrap().split('<').next().unwrap();
        assert_eq!(data.len(), letters, "{name}");
    }
    for id in ["key-figures", "view", "balance", "convergence", "errors", "times", "skips", "provenance"] {
        assert!(html.contains(&format!("<section id=\"{id}\">")), "no section {id}");
    }
    // The balance of the furnace: emitted 1 + 2 + 4 by the lamp, all of it absorbed by the lamp, whose reflectance is 0.
    assert!(html.contains(
        "<tr><th scope=\"row\">whole scene</th><td>6.000</td><td>7.000</td><td>42.00</td><td>7.000</td>"
    ));
    std::fs::remove_file(folder.path().join("s.html")).unwrap();
    assert_eq!(html, page(folder.path(), &["--threads", "1"]));
}

#[test]
fn reports_and_pictures_are_shown_as_they_are() {
    let folder = furnace_of(cube());
    let report = r#"{"tool": "solve-tool", "version": "9.9", "flags": [], "phases": [{"name": "solve", "seconds": 12.5}],
        "counters": {"rows (skipped)": 1234567, "products": 7}, "estimates": {"solver bound red": 1.5e-7},
        "warnings": ["<b>odd</b>"], "peak_memory_bytes": 1048576}"#;
    std::fs::write(folder.path().join("s.sol.report.json"), report).unwrap();
    std::fs::write(folder.path().join("m.png"), b"\x89PNG\r\n\x1a\nrest").unwrap();
    let html = page(folder.path(), &["--figure", "mesh=m.png", "--figure", "My <own>=m.png"]);
    for text in [
        "12.50 s",
        "1\u{202f}234\u{202f}567",
        "1.500 × 10<sup>−7</sup>",
        "&lt;b&gt;odd&lt;/b&gt;",
        "1.000 MiB",
        "src=\"data:image/png;base64,iVBORw0KGgpyZXN0\"",
        "My &lt;own&gt;",
    ] {
        assert!(html.contains(text), "no {text}");
    }
    std::fs::write(folder.path().join("m.png"), b"no picture").unwrap();
    let flags = ["page", "s.sol", "--mesh", "s.mesh", "-o", "s.html", "--figure", "mesh=m.png"];
    let run = shade_tool(folder.path(), &flags);
    assert_eq!(run.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&run.stderr).contains("m.png: not a PNG picture"));
}

#[test]
fn beyond_the_bound_faces_stand_for_their_elements() {
    let folder = furnace_of(cube());
    let html = page(folder.path(), &["--most-elements", "5"]);
    assert!(html.contains("id=\"data-elements\"></script>") && html.contains("faces show their means"));
    assert!(page(folder.path(), &["--most-elements", "6"]).contains("Click an element"));
}
