//! The target `nmea` under libFuzzer: `cargo +nightly fuzz run nmea --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::nmea::run(bytes));
