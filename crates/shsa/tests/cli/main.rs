//! The command from outside: checks output and exit status for arguments and files.
#![cfg(test)]

#[path = "../../../shsa-bridge/tests/real/mod.rs"]
mod real;

mod folder;
mod fusion;
mod tank;

mod analyze;
mod assure;
mod calibrate;
mod doctor;
mod draft;
mod learn;
mod campaign;
mod case_over_time;
mod check;
mod compare;
mod conformance;
mod contingency;
mod convert;
mod drivetrain;
mod explain;
mod gsn;
mod help;
mod journal;
mod logs;
mod maintenance;
mod old;
mod parts;
mod plan;
mod questions;
mod record;
mod reference;
mod reload;
mod replay;
mod report;
mod ros_package;
mod scan;
mod service;
mod association;
mod sessions;
mod streams;
mod structures;
mod studio;
mod tables;
mod thesis;
mod wrong;

/// The program under test.
const PROGRAM: &str = env!("CARGO_BIN_EXE_shsa");
