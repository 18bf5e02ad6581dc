//! The target `recordings` under libFuzzer: `cargo +nightly fuzz run recordings --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::recordings::run(bytes));
