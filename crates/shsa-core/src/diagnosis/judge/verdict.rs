//! What is thought of signals and relations, why, and what changes it.

use crate::diagnosis::candidates::Component;
use crate::knowledge::{CauseId, SignalId};
use crate::time::Span;
use alloc::vec::Vec;

/// What is thought of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// No independent witness speaks about it.
    Unknown,
    /// An independent witness agrees with it.
    Healthy,
    /// It may be faulty, or others are.
    Suspect,
    /// It is faulty.
    Failed,
}

/// Why something is accused.
#[derive(Clone, Debug, PartialEq)]
pub struct Blame {
    /// The signal or relation.
    pub component: Component,
    /// What it shares with others, where that is what explains the conflicts best.
    pub cause: Option<CauseId>,
    /// How probable it is that it, or its cause where that is blamed, is faulty; `None` where there are too many
    /// possibilities for an exact number.
    pub probability: Option<f64>,
    /// What else is most probable, and how much.
    pub next: Option<(Component, f64)>,
    /// How often it was accused before, each time soon after it was trusted again: an intermittent fault.
    pub relapses: u32,
}

/// A change of verdict.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// It is faulty: it belongs to every probable explanation.
    Failed(Blame),
    /// It is one of several that explain the conflicts; the list is the whole choice, ascending. An empty one: it belongs to every
    /// probable explanation, but so few disagreements of noise may be chance.
    Suspected(Blame, Vec<Component>),
    /// It is trusted again.
    Cleared(Component),
    /// A signal whose own readings had shown a fault is trusted again, after this probation.
    Recovered(SignalId, Span, Proof),
    /// Nothing speaks against something accused any more, and nothing for it, for this long: it may serve where nothing else
    /// is left, as uncertain.
    Unproven(Component, Span),
    /// Something speaks against it again.
    Contradicted(Component),
}

/// Why a signal whose own readings had shown a fault is trusted again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Others agree with it.
    Witness,
    /// It says what it could say, from what it said before the fault.
    Return,
}

/// Settings of the judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgeOptions {
    /// How long all evidence must speak for a signal before it is trusted again.
    pub probation: Span,
    /// Prior fault probability of a signal whose properties give no `prior`.
    pub prior: f64,
    /// The same of a relation.
    pub relation_prior: f64,
}

impl Default for JudgeOptions {
    /// Signals fail a thousand times more often than what relates them.
    fn default() -> JudgeOptions {
        JudgeOptions { probation: Span::from_millis(5_000), prior: 0.01, relation_prior: 1e-5 }
    }
}
