//! The target `signalk` under libFuzzer: `cargo +nightly fuzz run signalk --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::signalk::run(bytes));
