//! Code that runs for every observation allocates nothing: a program of its own, as it counts all allocations.
#![cfg(test)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

#[path = "../models/cell.rs"]
mod cell;
#[path = "../models/mod.rs"]
mod models;
#[path = "../plan_support/mod.rs"]
mod plan_support;
#[path = "../models/plant.rs"]
mod plant;

mod assurance;
mod engine;
mod formulas;
mod plan;
