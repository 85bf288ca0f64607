//! The report page in a real browser: no console errors, a scene in the 3-D view, values after a click. Skipped where there
//! is no Chromium.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::process::Command;
use tests::chain::Chain;
use tests::{run, tool};

/// How to get a browser, for the message of a test that is skipped.
const REMEDY: &str = "apt-get install chromium chromium-driver";

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

#[test]
fn a_browser_shows_the_scene_and_a_click_its_values() {
    if let Some(missing) = ["chromium", "chromedriver", "python3"].into_iter().find(|p| !is_there(p)) {
        eprintln!(
            "a_browser_shows_the_scene_and_a_click_its_values: skipped: no {missing}; get it with: {REMEDY}"
        );
        return;
    }
    let folder = tests::folder();
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder.path(), 300);
    let chain = chain.with_tolerances("1e-2", "1e-2");
    chain.solve();
    let page = chain.path("html");
    let mut write = tool("shade-tool");
    write.arg("page").arg(chain.path("sol")).arg("--mesh").arg(chain.path("mesh"));
    write.arg("--camera").arg(tests::scene("cornell_blocks.toml"));
    run(write.arg("-o").arg(&page)).expect_code(0);
    let mut browser = Command::new("python3");
    browser.arg(tests::root().join("tests/browser/report_page.py"));
    let seen = run(browser.arg(&page)).expect_code(0);
    assert!(seen.stdout.contains("passed"), "{}", seen.stdout);
}
