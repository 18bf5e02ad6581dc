//! Files about models and runs: faults to inject, orders, journals, states and stories; the outputs of a run as JSON, and its reasons in
//! words.

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
