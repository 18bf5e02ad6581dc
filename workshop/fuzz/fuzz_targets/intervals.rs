//! The target `intervals` under libFuzzer: `cargo +nightly fuzz run intervals --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::intervals::run(bytes));
