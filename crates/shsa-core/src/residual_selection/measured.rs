//! A number with one independent signal that relations compute, too: computing it may isolate faults.

use crate::knowledge::{KnowledgeBase, Shape, SignalId, SignalSet, VariableId};

/// A number with one independent signal that relations compute, too.
pub(super) struct Measured {
    pub(super) variable: VariableId,
    /// The signal, or the first of those that carry the same measurement or rest on it.
    pub(super) signal: SignalId,
    /// All signals that depend on the signal.
    pub(super) followers: SignalSet,
}

impl Measured {
    /// Complexity: O(signals times their origins).
    pub(super) fn new(knowledge: &KnowledgeBase, variable: VariableId, signal: SignalId) -> Measured {
        let follows = |other: &SignalId| rests(knowledge, *other, signal);
        Measured { variable, signal, followers: knowledge.signals().ids().filter(follows).collect() }
    }
}

/// Whether a signal is the same measurement as another one, or derived from it.
fn rests(knowledge: &KnowledgeBase, signal: SignalId, other: SignalId) -> bool {
    knowledge.as_witnesses(knowledge.origins(signal)).contains(other)
}

/// The signal that all signals of a number rest on, if relations compute the number, too.
pub(super) fn only_signal(knowledge: &KnowledgeBase, variable: VariableId) -> Option<SignalId> {
    let described = &knowledge.variables()[variable];
    let is_number = described.constant.is_none() && described.shape == Shape::Scalar;
    if !is_number || knowledge.producers(variable).is_empty() {
        return None;
    }
    let mut carriers = knowledge.carriers(variable).iter().filter(|&&it| knowledge.is_available(it));
    let signal = knowledge.witness(*carriers.next()?);
    carriers.all(|&other| rests(knowledge, other, signal)).then_some(signal)
}
