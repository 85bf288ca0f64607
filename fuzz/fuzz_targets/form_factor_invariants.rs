//! The body is `tests::fuzz::form_factor_invariants`, which stable tests run over seeded inputs as well.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tests::fuzz::form_factor_invariants(bytes));
