//! Frames of a CAN bus, as `candump` (`.log`), ASC and BLF record them, with what a DBC says they mean.
//!
//! A message is a topic by its name (`gnss_speed`), and in full with its identifier (`0x17:gnss_speed`); its signals are the
//! fields. Without a DBC, and of identifiers that it does not have, a topic is the identifier (`0x17`) and its field the bytes
//! (`data`). What comes over several channels can be asked for by `[channel=can0]`, what several sources of J1939 send by
//! `[source=0x21]`.

mod signal;
mod dbc;
mod bus;
pub(super) mod candump;
pub(super) mod asc;
pub(super) mod blf;

pub(super) use bus::{Bus, Frame};
pub(super) use dbc::EXTENDED;

/// Said where a recording has no date.
const NO_DATE: &str = "no date: times count from the beginning of the recording";

#[cfg(test)]
mod tests;
