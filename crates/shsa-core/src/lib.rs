//! Self-healing by structural adaptation: observations in, verdicts and substitutes out.
//!
//! A model names the variables of a system, the relations between them, and the signals that measure them. From it, the engine computes
//! each variable in every possible way, compares the results, names the fewest faulty signals that explain all contradictions, and
//! provides each needed variable from the best source that it still trusts.
//!
//! The flow of data: `Observation -> alignment -> monitor -> diagnosis -> plan -> service -> Output`. The modules are listed in
//! reading order; each uses only those above it. Begin with [`interval`], which makes a comparison a proof, and with
//! [`knowledge`], which is the model; [`engine`] drives everything else.
//!
//! The core reads no clock, no file and no socket, and starts no thread. Time is an argument. The same inputs give the same
//! outputs, byte for byte. It cannot fail: loading gives a knowledge base or diagnostics, interval operations are total, searches
//! end with a reason.
//!
//! # Example
//!
//! Three sensors measure a speed, and one of them begins to read 3 m/s too much:
//!
//! ```
//! use shsa_core::engine::{Engine, EventKind, Input, Options, Output, Ticks};
//! use shsa_core::knowledge::{Bounds, Draft, NeedDraft, SignalDraft, Text, VariableDraft, build};
//! use shsa_core::observation::{Observation, RawValue};
//! use shsa_core::time::Time;
//!
//! // The model. The crate `shsa-model` reads such drafts from YAML.
//! let text = |text: &str| Text { text: text.to_owned(), ..Text::default() };
//! let signal = |name: &str| SignalDraft {
//!     name: text(name),
//!     variable: Some(text("speed")),
//!     rate: Some(text("10 Hz")),
//!     value_error: Some(Bounds::One(text("0.3"))),
//!     ..SignalDraft::default()
//! };
//! let (knowledge, problems) = build(&Draft {
//!     variables: vec![VariableDraft { name: text("speed"), unit: Some(text("m/s")), ..VariableDraft::default() }],
//!     signals: ["gnss", "wheel", "radar"].map(signal).to_vec(),
//!     needs: vec![NeedDraft { variable: text("speed"), ..NeedDraft::default() }],
//!     ..Draft::default()
//! });
//! assert!(problems.is_empty());
//!
//! let mut engine = Engine::new(knowledge, Options::default());
//! let signals = ["gnss", "wheel", "radar"].map(|name| engine.knowledge().signal(name).unwrap());
//! let mut decisions = Vec::new();
//! for step in 1..30 {
//!     let now = Time::from_seconds(f64::from(step) / 10.0);
//!     engine.pass(Ticks::before(now));
//!     for signal in signals {
//!         let is_wrong = signal == signals[0] && step > 10;
//!         let value = RawValue::Number(if is_wrong { 16.6 } else { 13.6 });
//!         engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
//!     }
//!     engine.pass(Ticks::up_to(now));
//!     while let Some(output) = engine.poll() {
//!         match output {
//!             Output::Event(event) => decisions.push(event.kind),
//!             Output::Publication(_) => {} // the needed speed, at every step
//!             _ => {}
//!         }
//!     }
//! }
//! // One wrong reading is an outlier; with the second one the receiver has failed.
//! assert_eq!(decisions, [EventKind::Outlier, EventKind::Failed, EventKind::Substituted]);
//! ```
#![no_std]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod time;
pub mod numbers;
pub mod interval;
pub mod circle;
pub mod unit;
pub mod expression;
pub mod statement;
pub mod knowledge;
pub mod observation;
pub mod substitution;
pub mod order;
pub mod reason;
pub mod alignment;
pub mod parameter;
pub mod computation;
pub mod monitor;
pub mod trust;
pub mod diagnosis;
pub mod plan;
pub mod residual_selection;
pub mod assurance;
pub mod service;
pub mod engine;
pub mod analysis;
