//! Signals that are lost together, because some are derived from others.

use crate::knowledge::{Id, KnowledgeBase, Lineage, SignalId};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// The origins of each signal and the signals derived from it, transitively; signals without either have no entry.
#[derive(Clone, Debug, Default)]
pub(super) struct Derivations {
    origins: BTreeMap<SignalId, Vec<SignalId>>,
    derived: BTreeMap<SignalId, Vec<SignalId>>,
}

impl Derivations {
    pub(super) fn new(knowledge: &KnowledgeBase) -> Derivations {
        let mut all = Derivations::default();
        for (signal, facts) in knowledge.signals().enumerate() {
            // The output of a fusion outlasts the loss of some of its origins.
            if !facts.derived_from.is_empty() && !knowledge.is_fused(signal) {
                let origins = origins(knowledge, signal);
                origins.iter().for_each(|&origin| all.derived.entry(origin).or_default().push(signal));
                all.origins.insert(signal, origins);
            }
        }
        all
    }

    /// The signals with changed derivations, and the signals with such an origin, ascending, out of `signals` many. Complexity:
    /// O(n log d) for d derived signals, O(1) without any.
    pub(super) fn changed(&self, new: &Derivations, lineage: &Lineage, signals: usize) -> Vec<SignalId> {
        if self.origins.is_empty() && new.origins.is_empty() {
            return Vec::new();
        }
        let all = (0..signals).map(SignalId::from_index);
        let changed: Vec<SignalId> = all.filter(|&signal| !self.lasts(new, lineage, signal)).collect();
        let is_among = |signal: &SignalId| changed.binary_search(signal).is_ok();
        let taints = |(_, origins): &(&SignalId, &Vec<SignalId>)| origins.iter().any(is_among);
        let tainted = self.origins.iter().filter(taints).map(|(&signal, _)| signal);
        let mut all: Vec<SignalId> = changed.iter().copied().chain(tainted).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Whether the origins of a signal, and the signals derived from it, are the same as before, in the same order.
    fn lasts(&self, new: &Derivations, lineage: &Lineage, signal: SignalId) -> bool {
        let Some(namesake) = lineage.namesake(signal) else { return false };
        let succeeded = |&signal: &SignalId| lineage.namesake(signal);
        [(&self.origins, &new.origins), (&self.derived, &new.derived)].into_iter().all(|(old, new)| {
            row(old, signal).iter().map(succeeded).eq(row(new, namesake).iter().copied().map(Some))
        })
    }

    /// These signals and all their origins, ascending.
    pub(super) fn with_origins(&self, signals: &[SignalId]) -> Vec<SignalId> {
        extended(signals, &self.origins)
    }

    /// These signals and all signals derived from them, ascending.
    pub(super) fn with_derived(&self, lost: &[SignalId]) -> Vec<SignalId> {
        extended(lost, &self.derived)
    }
}

fn row(of: &BTreeMap<SignalId, Vec<SignalId>>, signal: SignalId) -> &[SignalId] {
    of.get(&signal).map_or(&[], Vec::as_slice)
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
