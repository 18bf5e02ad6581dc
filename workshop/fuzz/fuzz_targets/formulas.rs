//! The target `formulas` under libFuzzer: `cargo +nightly fuzz run formulas --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::formulas::run(bytes));
