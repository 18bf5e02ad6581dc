//! The target `mdf` under libFuzzer: `cargo +nightly fuzz run mdf --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::mdf::run(bytes));
