//! Frames of a CAN bus, from `candump` (`.log`), ASC and BLF files, with their meaning from a DBC.
//!
//! A message is a topic under its name (`gnss_speed`), and in full with its identifier (`0x17:gnss_speed`); its signals are the
//! fields. Without a DBC, and for identifiers that the DBC lacks, the topic is the identifier (`0x17`), and its field the bytes
//! (`data`). The filter `[channel=can0]` chooses among several channels, and `[source=0x21]` among several sources of J1939.

mod signal;
mod dbc;
mod bus;
pub(super) mod candump;
pub(super) mod asc;
pub(super) mod blf;

pub use bus::FRAME as CAN_FRAME;
pub(super) use bus::{Bus, Frame};
pub(super) use dbc::EXTENDED;

/// The note about a recording without a date.
const NO_DATE: &str = "no date: times count from the beginning of the recording";

#[cfg(test)]
mod tests;
