//! Which signals are lost with others, since they are derived from them.

use crate::knowledge::{KnowledgeBase, SignalId};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// What each signal is derived from and what is derived from it, transitively; signals without are not in it.
#[derive(Clone, Debug, Default)]
pub(super) struct Derivations {
    origins: BTreeMap<SignalId, Vec<SignalId>>,
    derived: BTreeMap<SignalId, Vec<SignalId>>,
}

impl Derivations {
    pub(super) fn new(knowledge: &KnowledgeBase) -> Derivations {
        let mut all = Derivations::default();
        for (signal, facts) in knowledge.signals().enumerate() {
            if !facts.derived_from.is_empty() {
                let origins = origins(knowledge, signal);
                origins.iter().for_each(|&origin| all.derived.entry(origin).or_default().push(signal));
                all.origins.insert(signal, origins);
            }
        }
        all
    }

    /// The same signals, and those whose loss takes them along, ascending.
    pub(super) fn with_origins(&self, signals: &[SignalId]) -> Vec<SignalId> {
        extended(signals, &self.origins)
    }

    /// The same signals, and those that are lost with them, ascending.
    pub(super) fn with_derived(&self, lost: &[SignalId]) -> Vec<SignalId> {
        extended(lost, &self.derived)
    }
}

fn origins(knowledge: &KnowledgeBase, signal: SignalId) -> Vec<SignalId> {
    let mut all = BTreeSet::from([signal]);
    let mut open = Vec::from([signal]);
    while let Some(next) = open.pop() {
        open.extend(
            knowledge.signals()[next].derived_from.iter().copied().filter(|&origin| all.insert(origin)),
        );
    }
    all.remove(&signal);
    all.into_iter().collect()
}

fn extended(signals: &[SignalId], by: &BTreeMap<SignalId, Vec<SignalId>>) -> Vec<SignalId> {
    let more = signals.iter().filter_map(|signal| by.get(signal)).flatten();
    let mut all: Vec<SignalId> = signals.iter().chain(more).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
