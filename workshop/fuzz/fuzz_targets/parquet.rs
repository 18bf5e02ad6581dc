//! The target `parquet` under libFuzzer: `cargo +nightly fuzz run parquet --features libfuzzer`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| shsa_fuzz::readers::parquet::run(bytes));
