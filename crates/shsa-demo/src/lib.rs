//! Simulated systems that break and heal, for demonstrations, programs and tests without sensors of their own.
//!
//! [`rover`] is a robot on a bus: [`rover::simulate`] runs it in real time beside whatever listens, [`rover::Trial`] in
//! simulated time together with the engine, measured against the truth. So are [`pack`], a battery of 96 cells in a car, and
//! [`radars`] over the traffic of a road. [`platoon`] is two trucks for two instances. [`stories`] are systems as stories, some of
//! them under contract.

mod error;
mod healer;
mod trial;
pub mod pack;
pub mod platoon;
pub mod radars;
pub mod rover;
pub mod stories;

pub use error::DemoError;
pub use healer::Decision;
pub use trial::{Happening, Provision};
