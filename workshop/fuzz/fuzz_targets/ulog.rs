//! The target `ulog` under libFuzzer: `cargo +nightly fuzz run ulog --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::ulog::run(bytes));
