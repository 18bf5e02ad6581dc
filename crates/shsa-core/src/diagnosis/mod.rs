//! Diagnosis: disagreements as conflicts, hitting sets as explanations, their probabilities; verdicts over time.

pub mod candidates;
mod judge;

pub use candidates::Component;
pub use judge::{Blame, Decision, EvidenceView, Judge, JudgeOptions, Proof, Record, Verdict, rests_on};
