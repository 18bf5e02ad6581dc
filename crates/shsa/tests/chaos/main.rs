//! The promises of `shsa run` when its environment fails: with real components, and in figures.
//!
//! Each scenario is a test, and a row of the table that `cargo xtask chaos` writes into workshop/measured/results.md.
#![cfg(test)]

#[path = "../../../shsa-bridge/tests/real/mod.rs"]
mod real;

#[allow(dead_code, reason = "the bridges' tests use all of it")]
#[path = "../../../shsa-bridge/tests/broker/mod.rs"]
mod broker;

#[allow(dead_code, reason = "the tests of live runs use all of it")]
#[path = "../live/running.rs"]
mod running;

mod row;
mod plant;
mod scene;
mod disk;
mod world;

mod broken_broker;
mod killed;
mod cut;
mod clock;
mod garbage;
mod flood;
mod full_disk;
mod one_by_one;
mod twins;
mod newcomer;
mod hung;
mod sequences;

/// The program under test.
fn program() -> &'static str {
    env!("CARGO_BIN_EXE_shsa")
}
