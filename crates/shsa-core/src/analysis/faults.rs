//! Detectability and isolability of faults.

use super::comparisons::Comparisons;
use crate::knowledge::{Id, KnowledgeBase, RelationId, SignalId, SignalSet};
use crate::residual_selection::{Findings, Isolability};
use crate::trust::Component;
use alloc::vec::Vec;

/// The comparisons' reactions to a fault of each signal and relation.
///
/// Single faults: all comparisons that show a fault disagree, and each single component that explains them is suspect
/// ([`explain`](crate::diagnosis::candidates::explain); structural isolability as in Krysander and Frisk 2008,
/// doi:10.1109/TSMCA.2008.2001048).
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    findings: Findings,
}

impl Faults {
    /// Complexity: O(comparisons times the signals and relations of each).
    pub(super) fn new(knowledge: &KnowledgeBase, comparisons: &Comparisons) -> Faults {
        let mut findings = Findings::new(knowledge);
        comparisons.fault_signature().for_each(|(one, other)| findings.compare(one, other));
        findings.share(knowledge);
        Faults { findings }
    }

    /// The findings about a fault of a component; `None` for a common cause.
    #[must_use]
    pub fn isolability(&self, component: Component) -> Option<&Isolability> {
        match component {
            Component::Signal(signal) => Some(self.findings.signal(signal)),
            Component::Relation(relation) => Some(self.findings.relation(relation)),
            Component::Cause(_) => None,
        }
    }

    /// The findings about a relation that does not hold.
    #[must_use]
    pub fn of_relation(&self, relation: RelationId) -> &Isolability {
        self.findings.relation(relation)
    }

    /// All components that a fault is isolable from, signals and then relations, in file order.
    pub fn isolable_components_from(&self, component: Component) -> impl Iterator<Item = Component> + '_ {
        let shown = self.isolability(component);
        self.components().filter(move |&other| {
            other != component && shown.is_some_and(|shown| shown.is_isolable_from(other))
        })
    }

    /// All signals, then all relations, in file order.
    pub fn components(&self) -> impl Iterator<Item = Component> + '_ {
        let signals = self.findings.signals().map(Component::Signal);
        signals.chain(self.findings.relations().map(Component::Relation))
    }

    /// Whether a fault of the signal makes a comparison disagree.
    #[must_use]
    pub fn is_detectable(&self, signal: SignalId) -> bool {
        self.findings.signal(signal).shown_by > 0
    }

    /// How many comparisons a fault of the signal makes disagree.
    #[must_use]
    pub fn shown_by(&self, signal: SignalId) -> u32 {
        self.findings.signal(signal).shown_by
    }

    /// The signals that explain a fault of this signal as well as itself, and itself; empty when the fault is not detectable.
    #[must_use]
    pub fn suspects(&self, signal: SignalId) -> &SignalSet {
        &self.findings.signal(signal).signals
    }

    /// Whether a fault of `signal` is isolable from one of `other`: a comparison shows it that does not rest on `other`.
    #[must_use]
    pub fn is_isolable_from(&self, signal: SignalId, other: SignalId) -> bool {
        self.is_detectable(signal) && !self.suspects(signal).contains(other)
    }

    /// All signals that a fault of this signal is isolable from, ascending.
    pub fn isolable_from(&self, signal: SignalId) -> impl Iterator<Item = SignalId> + '_ {
        self.findings.signals().filter(move |&other| self.is_isolable_from(signal, other))
    }

    /// How many of the first `among` signals a fault of this signal is isolable from.
    pub(super) fn isolable_among(&self, signal: SignalId, among: SignalId) -> usize {
        let finding = self.findings.signal(signal);
        match finding.shown_by {
            0 => 0,
            _ => {
                let suspects = finding.signals.iter().filter(|&suspect| suspect < among).count();
                among.index().saturating_sub(suspects)
            }
        }
    }

    /// Groups of at least two signals whose faults are detectable but not isolable: each is connected with the next by faults
    /// that are not isolable. By their first signal.
    #[must_use]
    pub fn groups(&self) -> Vec<SignalSet> {
        let mut grouped = SignalSet::new();
        let mut groups = Vec::new();
        for signal in self.findings.signals() {
            if grouped.contains(signal) {
                continue;
            }
            let group = self.group(signal);
            grouped.extend(&group);
            if group.len() > 1 {
                groups.push(group);
            }
        }
        groups
    }

    fn group(&self, first: SignalId) -> SignalSet {
        let mut group = SignalSet::from_iter([first]);
        let mut open = Vec::from([first]);
        while let Some(signal) = open.pop() {
            for other in self.suspects(signal).iter() {
                if !group.contains(other) && self.suspects(other).contains(signal) {
                    group.insert(other);
                    open.push(other);
                }
            }
        }
        group
    }
}
