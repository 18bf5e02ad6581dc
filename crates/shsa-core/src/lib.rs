//! Self-healing by structural adaptation: observations in, verdicts and substitutes out.
//!
//! The flow of data: `Observation -> alignment -> monitor -> diagnosis -> plan -> service -> Output`. The modules are listed in
//! reading order; each uses only those above it.
//!
//! The core reads no clock, no file and no socket, and starts no thread. Time is an argument. The same inputs give the same
//! outputs, byte for byte. It cannot fail: loading gives a knowledge base or diagnostics, interval operations are total, searches
//! end with a reason.
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod time;
pub mod numbers;
pub mod interval;
pub mod circle;
pub mod unit;
pub mod expression;
pub mod statement;
pub mod knowledge;
pub mod observation;
pub mod substitution;
pub mod order;
pub mod reason;
pub mod alignment;
pub mod parameter;
pub mod computation;
pub mod monitor;
pub mod trust;
pub mod diagnosis;
pub mod plan;
pub mod residual_selection;
pub mod assurance;
pub mod service;
pub mod engine;
pub mod analysis;
