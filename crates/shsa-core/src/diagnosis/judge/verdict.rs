//! The decisions that change verdicts on signals and relations, and the settings of the judge.

use crate::knowledge::{CauseId, SignalId};
use crate::numbers::{LASTING, PATIENCE, PRIOR, RELATION_PRIOR};
use crate::time::Span;
use crate::trust::Component;
use alloc::vec::Vec;

/// Why a component is accused.
#[derive(Clone, Debug, PartialEq)]
pub struct Blame {
    /// The signal or relation.
    pub component: Component,
    /// The common cause, where it explains the conflicts best.
    pub cause: Option<CauseId>,
    /// The probability that the component (or its cause, where that is blamed) is faulty; `None` where there are too many
    /// possibilities for an exact number.
    pub probability: Option<f64>,
    /// The most probable other component, with its probability.
    pub next: Option<(Component, f64)>,
    /// How often the component was accused before, each time soon after it was trusted again: an intermittent fault.
    pub relapses: u32,
}

/// A change of verdict.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// The component is faulty: it belongs to every probable explanation.
    Failed(Blame),
    /// The component is one of several that explain the conflicts. The list is the whole choice, ascending. It is empty when the
    /// component belongs to every probable explanation, but so few disagreements of noise may be chance.
    Suspected(Blame, Vec<Component>),
    /// The component is trusted again.
    Cleared(Component),
    /// No probable explanation of the conflicts names a suspect any more, and another one agrees with it.
    RuledOut(Component),
    /// A signal whose own readings had shown a fault is trusted again, after this probation.
    Recovered(SignalId, Span, Proof),
    /// For this long, no evidence has accused or supported an accused component: it may serve, as uncertain, where nothing else
    /// is left.
    Unproven(Component, Span),
    /// Evidence accuses an unproven component again.
    Contradicted(Component),
}

/// Why a signal whose own readings had shown a fault is trusted again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Other ways agree with the signal.
    Witness,
    /// The value can be reached from the last sound reading before the fault.
    Return,
    /// The readings before the fault are no measure of those after it: what counts has started from 0 again, or the first
    /// readings of all were wrong.
    Start,
}

/// Settings of the judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgeOptions {
    /// How long all evidence must support a signal before it is trusted again.
    pub probation: Span,
    /// How long a direct contradiction waits at most for slower comparisons that may decide, before all who may be wrong are
    /// suspect; at least until the contradiction itself has had twice its time.
    pub patience: Span,
    /// The prior probability of a fault of a signal whose properties give no `prior`.
    pub prior: f64,
    /// The prior probability of a fault of a relation whose properties give no `prior`.
    pub relation_prior: f64,
}

impl Default for JudgeOptions {
    /// Signals fail a thousand times more often than the relations between them.
    fn default() -> JudgeOptions {
        JudgeOptions { probation: LASTING, patience: PATIENCE, prior: PRIOR, relation_prior: RELATION_PRIOR }
    }
}
