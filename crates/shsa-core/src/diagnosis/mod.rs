//! Who lies: disagreements as conflicts, minimal hitting sets as explanations, ranked; verdicts over time.

pub mod explain;
mod judge;

pub use judge::{Decision, Judge, JudgeOptions, Verdict};
