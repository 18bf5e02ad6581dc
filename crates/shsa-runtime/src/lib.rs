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
//!
//! # Example
//!
//! A program with its own messages, which are numbers by topic; `examples/` has a longer one.
//!
//! ```
//! use shsa_bridge::{Clock, Inbox, Message, Outgoing, OwnBus, Payload};
//! use shsa_core::observation::RawValue;
//! use shsa_model::live::{Live, Written};
//! use shsa_runtime::{Model, Options, Runtime};
//!
//! let text = "{ shsa: 1, variables: { v: {} }, signals: { wheel: { variable: v } }, needs: { v: { signal: healed, max_age: 1 min } } }";
//! let (live, _) = Live::load(Written { name: "car", text }).expect("the model is right");
//! let inbox = Inbox::new(64, Clock::running());
//! let (sender, sent) = std::sync::mpsc::channel();
//! let bus = OwnBus::new(inbox.clone(), move |message: Outgoing<'_>| {
//!     let _ = sender.send(message.topic.to_owned());
//!     Ok(())
//! });
//! let model = Model { name: "car".to_owned(), path: None, live };
//! let runtime = Runtime::new(vec![model], Options::default(), Box::new(bus))?;
//! let handle = runtime.handle();
//! let thread = std::thread::spawn(move || runtime.run());
//!
//! inbox.push(Message::new("wheel".into(), inbox.clock().now(), Payload::Value(RawValue::Number(5.0))));
//! assert!(sent.iter().any(|topic| topic == "healed"));
//! handle.stop();
//! thread.join().expect("the run does not panic")?;
//! # Ok::<(), shsa_runtime::RuntimeError>(())
//! ```

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
mod discovery;
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
