//! Diagnosis: disagreements as conflicts, hitting sets as explanations, their probabilities; verdicts over time.

pub mod candidates;
mod judge;

pub use judge::{
    Blame, Decision, EvidenceView, Judge, JudgeOptions, Proof, rests_on, speaks_against, stands_still,
};
