//! A simulated robot that breaks and heals, for the demonstration of the README, and for programs and tests without sensors of their own.
//!
//! [`rover`] is a robot on a bus: [`rover::simulate`] runs it in real time beside whatever listens, [`rover::Trial`] in
//! simulated time together with the engine, measured against the truth. The engine over a compiled-in model is a [`Healer`]; a
//! [`terminal`], the picture of a [`scan`] and the [`verdict`] on a signal show what happens.

mod error;
mod healer;
mod trial;
pub mod rover;
pub mod terminal;
pub mod verdict;
pub mod scan;

pub use error::DemoError;
pub use healer::{Decision, Healed, Healer, middle, scalar};
pub use trial::{Happening, Provision};
