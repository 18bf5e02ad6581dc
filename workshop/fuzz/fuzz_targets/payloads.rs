//! The target `payloads` under libFuzzer: `cargo +nightly fuzz run payloads --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::payloads::run(bytes));
