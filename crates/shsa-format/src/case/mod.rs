//! The assurance case of composed certificates: what is claimed, on which ground, and how each claim stands now.
//!
//! Made of a system and an evaluation of it: an [`Argument`] in the manner of the Goal Structuring Notation (GSN community
//! standard, version 3), written as the YAML that `gsn2x` reads ([`gsn`]) or drawn as SVG ([`crate::drawing::argument`]).

mod argument;
pub mod gsn;
mod moment;
pub mod words;

pub use argument::{Argument, Kind, MOST_NODES, Node};
pub use moment::{Measured, Moment};
