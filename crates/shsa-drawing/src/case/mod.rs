//! The assurance case of composed certificates: the claims, their grounds, and the present verdict on each claim.
//!
//! It is made from a system and an evaluation: an [`Argument`] in the Goal Structuring Notation (GSN community standard, version
//! 3), written as the YAML that `gsn2x` reads ([`gsn`]) or drawn as SVG ([`crate::argument`]). [`prolog`] has the certificates as rules.

mod argument;
pub mod gsn;
pub mod prolog;
pub mod words;

pub use argument::{Argument, Kind, MOST_NODES, Node};
