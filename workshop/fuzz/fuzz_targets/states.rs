//! The target `states` under libFuzzer: `cargo +nightly fuzz run states --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::states::run(bytes));
