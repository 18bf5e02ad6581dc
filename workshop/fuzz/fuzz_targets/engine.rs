//! The target `engine` under libFuzzer: `cargo +nightly fuzz run engine --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::engine::run(bytes));
