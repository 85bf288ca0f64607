//! The body is `tests::fuzz::visible_parts`, which stable tests run over seeded inputs as well.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = tests::fuzz::visible_parts(bytes);
});
