//! The command from outside: arguments and files in, output and exit status out.
#![cfg(test)]

mod folder;
mod tank;

mod analyze;
mod bench;
mod calibrate;
mod campaign;
mod check;
mod contingency;
mod convert;
mod drivetrain;
mod experiments;
mod explain;
mod help;
mod monitor;
mod parts;
mod plan;
mod reload;
mod replay;
mod scan;
mod service;
mod sessions;
mod streams;
mod structures;
mod thesis;
mod wrong;
