//! The target `messages` under libFuzzer: `cargo +nightly fuzz run messages --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::messages::run(bytes));
