//! Tests of the core from outside. One program, as each takes as long to build; the tests that count allocations have their own.
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

mod seeds;
mod driven;

mod interval;

mod alone;
mod batches;
mod devices;
mod liars;

mod analysis;
mod analysis_structure;
mod isolability;

mod plan_admission;
mod plan_carried_over;
mod plan_contingency;
mod plan_engines;
mod plan_limits;
mod plan_parallel;
mod plan_random;
mod plan_reference;
mod plan_requirements;
mod plan_ways;

mod monitor_index;
mod thesis_monitor;
mod detectors;
mod anchors;
mod watch;
mod power;
mod noise;
mod numbers;
mod outliers;
mod trust;
mod second_fault;
mod coverage;
mod ranges;
mod many;

mod assurance;
mod needs;
mod under_contract;
mod switch;
mod turns;
mod reported;
mod delegate;
mod orders;
mod change;
mod hostile_engine;
mod ticks;
mod what_if;
mod learning;
