//! Any bytes are a soup of boxes and slivers; its meshes must keep all promises (`mesh-tool/tests/common/soup.rs`, which
//! the tests of mesh-tool also run, over the corpus of this target among others).
#![no_main]

#[path = "../../mesh-tool/tests/common/mod.rs"]
mod common;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let soup = common::soup::Soup::from_bytes(bytes);
    let faults = soup.faults();
    assert!(faults.is_empty(), "{soup:?}: {faults:#?}");
});
