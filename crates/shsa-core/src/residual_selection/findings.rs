//! The reactions of comparisons to a fault of each signal and relation: detectability and isolability.

use super::fault_signature::FaultSignature;
use crate::knowledge::{IdVec, KnowledgeBase, NEGLIGIBLE, RelationId, RelationSet, SignalId, SignalSet};
use crate::trust::Component;

/// The findings about a fault of one component.
///
/// Single faults: all comparisons that show the fault disagree, and each component that alone explains them is suspect.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Isolability {
    /// The number of comparisons that show the fault.
    pub shown_by: u32,
    /// The signals that are part of each of these comparisons.
    pub signals: SignalSet,
    /// The relations that are part of each of these comparisons.
    pub relations: RelationSet,
}

impl Isolability {
    /// Whether the fault is isolable from a fault of another component; false for an undetectable fault.
    #[must_use]
    pub fn is_isolable_from(&self, other: Component) -> bool {
        let explains = match other {
            Component::Signal(signal) => self.signals.contains(signal),
            Component::Relation(relation) => self.relations.contains(relation),
            Component::Cause(_) => true,
        };
        self.shown_by > 0 && !explains
    }

    /// Takes in a comparison with these signals and relations that shows the fault.
    fn narrow(&mut self, signals: &SignalSet, relations: &RelationSet) {
        match self.shown_by {
            0 => (self.signals, self.relations) = (signals.clone(), relations.clone()),
            _ => {
                self.signals.intersect(signals);
                self.relations.intersect(relations);
            }
        }
        self.shown_by += 1;
    }
}

/// The findings about every component of a knowledge base.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    signals: IdVec<SignalId, Isolability>,
    relations: IdVec<RelationId, Isolability>,
    /// The relations with a declared prior probability of a fault.
    fallible: RelationSet,
    /// The relations that are taken for granted: the declared probability is negligible.
    granted: RelationSet,
}

impl Findings {
    /// The findings before the first comparison.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Findings {
        let prior = |id: &RelationId| knowledge.relations()[*id].properties.prior();
        let may_fail = |id: &RelationId| prior(id).is_some_and(|prior| prior >= NEGLIGIBLE);
        let never_fails = |id: &RelationId| prior(id).is_some_and(|prior| prior < NEGLIGIBLE);
        Findings {
            signals: IdVec::filled(knowledge.signals().len(), |_| Isolability::default()),
            relations: IdVec::filled(knowledge.relations().len(), |_| Isolability::default()),
            fallible: knowledge.relations().ids().filter(may_fail).collect(),
            granted: knowledge.relations().ids().filter(never_fails).collect(),
        }
    }

    /// Takes in a comparison of two ways. Complexity: O(signals and relations of the ways).
    pub fn compare(&mut self, one: &FaultSignature, other: &FaultSignature) {
        self.compare_where(one, other, |_| true);
    }

    /// Takes in a comparison of two ways for those of the components that it shows which are `counted`.
    pub fn compare_where(
        &mut self,
        one: &FaultSignature,
        other: &FaultSignature,
        counted: impl Fn(Component) -> bool,
    ) {
        let (signals, relations) = (one.signals(other), one.relations(other));
        for shown in one.shows(other).iter().filter(|&shown| counted(Component::Signal(shown))) {
            self.signals[shown].narrow(&signals, &relations);
        }
        for shown in one.shows_relations(other).iter().filter(|&shown| counted(Component::Relation(shown))) {
            self.relations[shown].narrow(&signals, &relations);
        }
    }

    /// Copies the findings about a measurement to each signal that carries it.
    pub fn share(&mut self, knowledge: &KnowledgeBase) {
        for signal in knowledge.signals().ids() {
            let found = &self.signals[knowledge.witness(signal)];
            let Isolability { shown_by, signals, relations } = found.clone();
            self.signals[signal] = Isolability { shown_by, signals: knowledge.with_same(signals), relations };
        }
        for finding in self.relations.iter_mut() {
            finding.signals = knowledge.with_same(core::mem::take(&mut finding.signals));
        }
    }

    /// The findings about a signal.
    #[must_use]
    pub fn signal(&self, signal: SignalId) -> &Isolability {
        &self.signals[signal]
    }

    /// The findings about a relation.
    #[must_use]
    pub fn relation(&self, relation: RelationId) -> &Isolability {
        &self.relations[relation]
    }

    /// All signals, ascending.
    pub fn signals(&self) -> impl Iterator<Item = SignalId> + '_ {
        self.signals.ids()
    }

    /// All relations that may be wrong, ascending: without those whose declared prior is negligible.
    pub fn relations(&self) -> impl Iterator<Item = RelationId> + '_ {
        self.relations.ids().filter(|id| !self.granted.contains(*id))
    }

    /// The relations with a declared prior probability of a fault, whose faults are considered like those of signals.
    #[must_use]
    pub fn fallible(&self) -> &RelationSet {
        &self.fallible
    }
}
