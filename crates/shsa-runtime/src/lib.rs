//! Heals a running system: what is said on a bus goes in, what is needed goes out, from substitutes where a source has failed.
//!
//! ```text
//! bus -> inbox -> session (healers: engine and outlets) -> bus
//!                    | requests          | decisions
//!                 control             event log -> printer, bus, HTTP, subscribers
//! ```
//!
//! A [`Runtime`] is built from [`Model`]s, [`Options`] and a bus: any [`Bridge`](shsa_bridge::Bridge), the caller's own among them.
//! It runs in a thread of the caller's; a [`Handle`] stops it, asks for its state, hears its decisions and gives it orders.
//!
//! One thread at a time does everything that decides: the run's own, or while that sleeps a thread of the bus that brings a
//! message. HTTP has threads of its own that only hand things in, and the printer one that writes what it is handed.

mod error;
pub mod inputs;
mod message_template;
mod undelivered;
mod ownership;
mod outlet;
mod wiring;
mod bindings;
mod figures;
mod connection;
mod execution;
mod held_back;
mod journal;
mod state_file;
mod sandbox;
mod options;
mod healer;
mod federation;
mod view;
mod bands;
mod control;
mod terminal;
mod event_log;
mod metrics;
mod session;
mod shared_session;
mod handle;
mod runtime;
#[cfg(test)]
mod tests;

pub use control::{Order, Token};
pub use error::RuntimeError;
pub use event_log::{Decision, Printer};
pub use handle::{Events, Handle};
pub use options::{JournalOptions, Model, Options};
pub use runtime::{Ending, Runtime};
pub use sandbox::{SandboxOptions, substitute};
