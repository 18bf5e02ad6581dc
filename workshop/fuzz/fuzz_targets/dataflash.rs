//! The target `dataflash` under libFuzzer: `cargo +nightly fuzz run dataflash --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::dataflash::run(bytes));
