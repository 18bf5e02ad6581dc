//! Files about models and runs: faults to inject, orders, journals, states and stories; the outputs of a run as JSON, and its reasons in
//! words.
//!
//! The engine works with ids and numbers; this crate gives them the forms that people and other programs read. [`words`] makes sentences
//! of the reasons of an [`event`]; [`journal`] and [`state`] keep inputs and verdicts in files; [`parquet`] and [`arrow`] write results as
//! columns. A [`story`] combines a model, observations and the expected decisions in one file, and [`fault`] is what experiments inject.
//!
//! # Example
//!
//! ```
//! use shsa_format::story;
//!
//! let text = "
//! story: The wheel reads too much
//! why: A speed that is wrong is worse than none.
//! model:
//!   shsa: 1
//!   variables: { speed: { unit: m/s } }
//!   signals:
//!     wheel: { variable: speed, rate: 10 Hz, value_error: 0.1 }
//!     radar: { variable: speed, rate: 10 Hz, value_error: 0.1 }
//!     gnss: { variable: speed, rate: 10 Hz, value_error: 0.1 }
//! trace:
//!   duration: 10 s
//!   signals: { wheel: { value: 5 }, radar: { value: 5 }, gnss: { value: 5 } }
//!   faults: ['bias=2:wheel@5s..']
//! expect:
//!   - { event: failed, signal: wheel, between: [5 s, 6 s] }
//! ";
//! let story = story::load(text, "wheel.yaml", ".".as_ref()).story.unwrap();
//! assert!(story.run().is_met());
//! ```

pub mod words;
pub mod comparisons;
pub mod learned;
pub mod measurements;
pub mod event;
pub mod drive;
pub mod moment;
pub mod fault;
pub mod journal;
pub mod order;
pub mod table;
pub mod arrow;
pub mod association;
pub mod parquet;
pub mod state;
pub mod story;
pub mod text;
pub mod wiring;
