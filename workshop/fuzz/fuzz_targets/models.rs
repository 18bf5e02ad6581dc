//! The target `models` under libFuzzer: `cargo +nightly fuzz run models --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::models::run(bytes));
