//! The demonstrations from outside: real time, real processes. They run `shsa`, which `cargo build -p shsa` puts beside them.
#![cfg(test)]

#[path = "../../../../crates/shsa-bridge/tests/real/mod.rs"]
mod real;

#[allow(dead_code, reason = "the bridges' tests use all of it")]
#[path = "../../../../crates/shsa-bridge/tests/broker/mod.rs"]
mod broker;

#[allow(dead_code, reason = "the command's tests use all of it")]
#[path = "../../../../crates/shsa/tests/live/running.rs"]
mod running;

mod platoon;
mod radars;
mod rover;

use std::path::{Path, PathBuf};

/// The command, beside the program of the demonstrations.
fn program() -> PathBuf {
    Path::new(env!("CARGO_BIN_EXE_shsa-demos")).with_file_name("shsa")
}
