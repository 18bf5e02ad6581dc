//! What comparisons tell of the fault of each signal and relation: whether it shows, and what it is taken for.

use super::fault_signature::FaultSignature;
use crate::diagnosis::Component;
use crate::knowledge::{IdVec, KnowledgeBase, NEGLIGIBLE, RelationId, RelationSet, SignalId, SignalSet};

/// What is found of the fault of one component.
///
/// One fault at a time: all comparisons that show it disagree, and what explains them alone is suspect.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Told {
    /// How many comparisons show it.
    pub shown_by: u32,
    /// The signals that are in each of these.
    pub signals: SignalSet,
    /// The relations that are in each of these.
    pub relations: RelationSet,
}

impl Told {
    /// Whether a fault of another component is no explanation of this one; never while it does not show.
    #[must_use]
    pub fn is_told_from(&self, other: Component) -> bool {
        let explains = match other {
            Component::Signal(signal) => self.signals.contains(signal),
            Component::Relation(relation) => self.relations.contains(relation),
            Component::Cause(_) => true,
        };
        self.shown_by > 0 && !explains
    }

    /// A comparison shows it, which speaks about these.
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

/// What is found of every component of a knowledge base.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    signals: IdVec<SignalId, Told>,
    relations: IdVec<RelationId, Told>,
    /// The relations with a declared prior probability of a fault.
    fallible: RelationSet,
}

impl Findings {
    /// Before the first comparison.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Findings {
        let may_fail = |id: &RelationId| {
            knowledge.relations()[*id].properties.prior().is_some_and(|prior| prior >= NEGLIGIBLE)
        };
        Findings {
            signals: IdVec::filled(knowledge.signals().len(), |_| Told::default()),
            relations: IdVec::filled(knowledge.relations().len(), |_| Told::default()),
            fallible: knowledge.relations().ids().filter(may_fail).collect(),
        }
    }

    /// Takes in a comparison of two ways that is made. Complexity: O(what the ways rest on).
    pub fn compare(&mut self, one: &FaultSignature, other: &FaultSignature) {
        let (signals, relations) = (one.signals(other), one.relations(other));
        one.shows(other).iter().for_each(|shown| self.signals[shown].narrow(&signals, &relations));
        one.shows_relations(other)
            .iter()
            .for_each(|shown| self.relations[shown].narrow(&signals, &relations));
    }

    /// What is found of a measurement is found of each signal that carries it.
    pub fn share(&mut self, knowledge: &KnowledgeBase) {
        for signal in knowledge.signals().ids() {
            let found = &self.signals[knowledge.witness(signal)];
            let Told { shown_by, signals, relations } = found.clone();
            self.signals[signal] = Told { shown_by, signals: knowledge.with_same(signals), relations };
        }
        for finding in self.relations.iter_mut() {
            finding.signals = knowledge.with_same(core::mem::take(&mut finding.signals));
        }
    }

    /// What is found of a signal.
    #[must_use]
    pub fn signal(&self, signal: SignalId) -> &Told {
        &self.signals[signal]
    }

    /// What is found of a relation.
    #[must_use]
    pub fn relation(&self, relation: RelationId) -> &Told {
        &self.relations[relation]
    }

    /// All signals, ascending.
    pub fn signals(&self) -> impl Iterator<Item = SignalId> + '_ {
        self.signals.ids()
    }

    /// All relations, ascending.
    pub fn relations(&self) -> impl Iterator<Item = RelationId> + '_ {
        self.relations.ids()
    }

    /// The relations with a declared prior probability of a fault, which are looked for as signals are.
    #[must_use]
    pub fn fallible(&self) -> &RelationSet {
        &self.fallible
    }
}
