//! `shsa run` from outside: real time, real processes, requests over HTTP.
#![cfg(test)]

#[path = "../../../shsa-bridge/tests/real/mod.rs"]
mod real;

#[allow(dead_code, reason = "the bridges' tests use all of it")]
#[path = "../../../shsa-bridge/tests/broker/mod.rs"]
mod broker;

mod running;

mod car;
mod connections;
mod control;
mod embedded;
mod endurance;
mod foxglove;
mod home_assistant;
mod isolation;
mod joining;
mod levels;
mod outage;
mod package;
mod page;
mod platoon;
mod prometheus;
mod record;
mod reference;
mod roles;
mod service_manager;
mod sparkplug;
mod takeover;
mod top;
mod upgrade;

/// The program under test.
fn program() -> &'static str {
    env!("CARGO_BIN_EXE_shsa")
}
