//! The target `can` under libFuzzer: `cargo +nightly fuzz run can --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::can::run(bytes));
