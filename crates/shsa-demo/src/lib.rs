//! Simulated systems that break and heal, for demonstrations, programs and tests without sensors of their own.
//!
//! [`rover`] is a robot on a bus: [`rover::simulate`] runs it in real time beside whatever listens, [`rover::Trial`] in
//! simulated time together with the engine, measured against the truth. [`stories`] are systems under contract, as stories.

mod error;
pub mod rover;
pub mod stories;

pub use error::DemoError;
