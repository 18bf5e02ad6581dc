//! Radars along a road: vehicles drive from the field of view of one into that of the next; half-way one radar goes blind, is moved,
//! or stamps its tracks wrongly.
//!
//! The data flow: `traffic -> radars with a fault -> association of tracks -> engine`. Some vehicles also tell where they are.

mod traffic;
mod radar;
mod faults;
mod road;
mod border;
mod score;
mod trial;

pub use faults::Fault;
pub use road::Road;
pub use score::{Errors, Score};
pub use trial::Trial;

/// The model that is compiled in.
pub const MODEL: &str = include_str!("../../models/radars.yaml");
