//! The payloads of messages: reads fields of plain numbers and JSON by path, and writes values in the form that consumers read.
//!
//! `payload -> places of the wanted fields, in one walk -> Reading or Unreadable, each with its reason`
//!
//! A payload comes from a stranger: invalid bytes do no harm, the size and the depth are bounded, and an unreadable payload gives
//! a short reason. Scalars are read without allocation.

mod unreadable;
mod wanted;
mod typed;
mod scalar;
mod lists;
mod metrics;
mod reader;
mod writer;
mod explore;

pub use explore::{Content, FIELDS_MAX, Leaf, explore};
pub use metrics::{METRICS, STALE};
pub use reader::{Reader, Reading, SIZE_LIMIT};
pub use unreadable::Unreadable;
pub use writer::{Writer, plain};

#[cfg(test)]
mod tests;
