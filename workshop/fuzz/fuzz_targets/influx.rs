//! The target `influx` under libFuzzer: `cargo +nightly fuzz run influx --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::influx::run(bytes));
