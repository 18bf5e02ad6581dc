//! Heals a running system: reads signals from a bus, and publishes the needs, from substitutes where a source has failed.
//!
//! ```text
//! bus -> inbox -> session (healers: engine and outlets) -> bus
//!                    | requests          | decisions
//!                 control             event log -> printer, bus, HTTP, subscribers
//! ```
//!
//! A [`Runtime`] is built from [`Model`]s, [`Options`] and a bus, which is any [`Bridge`](shsa_bridge::Bridge), including the
//! caller's own. It runs in a thread of the caller. A [`Handle`] stops it, asks for its state, subscribes to its decisions and
//! gives it orders.
//!
//! One thread at a time makes decisions: the run's own, or while that sleeps, the thread of the bus that delivers a message.
//! Threads of the HTTP server only hand in requests. The printer's thread only writes lines.

mod error;
pub mod inputs;
mod message_template;
mod undelivered;
mod ownership;
mod strangers;
mod shared_verdicts;
mod neighbours;
mod outlet;
mod wiring;
mod bindings;
mod execution_bound;
mod figures;
mod connection;
mod execution;
mod held_back;
mod journal;
mod recording;
mod input_log;
mod state_file;
mod files;
mod sandbox;
mod options;
mod healer;
mod federation;
mod explained;
mod profile;
mod view;
mod bands;
mod diagnostics;
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
pub use execution_bound::{FEWEST_EXECUTIONS, execution_bound};
pub use explained::Explainer;
pub use handle::{Events, Handle};
pub use journal::{JournalSeal, PublicKey, SigningKey};
pub use options::{JournalOptions, Model, Options};
pub use recording::RunRecorder;
pub use runtime::{Ending, Runtime};
pub use sandbox::{SandboxOptions, substitute};
