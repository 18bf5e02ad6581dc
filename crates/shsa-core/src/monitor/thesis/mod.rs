//! The monitor as published: periodic steps, every combination of buffered inputs, all pairs of outputs.
//!
//! Kept because it is the published method. The monitor of the parent module is the one to use.

mod score;
mod run;

pub use run::ThesisRun;
pub use score::{ThesisMonitor, ThesisOptions, ThesisOutput, ThesisStep};
