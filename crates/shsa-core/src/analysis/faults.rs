//! Which faults show at all, and from which other faults they can be told.

use super::comparisons::Comparisons;
use crate::knowledge::{Id, IdVec, KnowledgeBase, SignalId, SignalSet};
use alloc::vec::Vec;

/// What the comparisons say about a fault of each signal.
///
/// One fault at a time: all comparisons that show it disagree, and what explains them by a single signal is suspect
/// ([`explain`](crate::diagnosis::explain::explain); structural isolability as in Krysander and Frisk 2008,
/// doi:10.1109/TSMCA.2008.2001048).
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    findings: IdVec<SignalId, Finding>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Finding {
    /// How many comparisons show it.
    shown_by: u32,
    /// The signals that are in each of these.
    suspects: SignalSet,
}

impl Faults {
    /// Complexity: O(comparisons times their signals).
    pub(super) fn new(knowledge: &KnowledgeBase, comparisons: &Comparisons) -> Faults {
        let mut findings = IdVec::filled(knowledge.signals().len(), |_| Finding::default());
        for &pair in comparisons.pairs() {
            let signals = comparisons.signals(pair);
            for signal in comparisons.shows(pair).iter() {
                let finding: &mut Finding = &mut findings[signal];
                finding.suspects = match finding.shown_by {
                    0 => signals.clone(),
                    _ => finding.suspects.iter().filter(|&suspect| signals.contains(suspect)).collect(),
                };
                finding.shown_by += 1;
            }
        }
        // What is found of a measurement is found of each signal that carries it.
        for signal in knowledge.signals().ids() {
            let found = &findings[knowledge.witness(signal)];
            let Finding { shown_by, suspects } = found.clone();
            findings[signal] = Finding { shown_by, suspects: knowledge.with_same(suspects) };
        }
        Faults { findings }
    }

    /// Whether a fault of the signal makes a comparison disagree.
    #[must_use]
    pub fn is_detectable(&self, signal: SignalId) -> bool {
        self.findings[signal].shown_by > 0
    }

    /// How many comparisons a fault of the signal makes disagree.
    #[must_use]
    pub fn shown_by(&self, signal: SignalId) -> u32 {
        self.findings[signal].shown_by
    }

    /// The signals that explain a fault of this one as well as itself does, and itself; empty when it does not show.
    #[must_use]
    pub fn suspects(&self, signal: SignalId) -> &SignalSet {
        &self.findings[signal].suspects
    }

    /// Whether a fault of `signal` shows and is not taken for one of `other`: a comparison shows it that does not
    /// rest on the other.
    #[must_use]
    pub fn is_isolable_from(&self, signal: SignalId, other: SignalId) -> bool {
        self.is_detectable(signal) && !self.findings[signal].suspects.contains(other)
    }

    /// All signals that a fault of this one is not taken for, ascending.
    pub fn isolable_from(&self, signal: SignalId) -> impl Iterator<Item = SignalId> + '_ {
        self.findings.ids().filter(move |&other| self.is_isolable_from(signal, other))
    }

    /// From how many of the first `among` signals a fault of this one can be told.
    pub(super) fn isolable_among(&self, signal: SignalId, among: SignalId) -> usize {
        let finding = &self.findings[signal];
        match finding.shown_by {
            0 => 0,
            _ => {
                let suspects = finding.suspects.iter().filter(|&suspect| suspect < among).count();
                among.index().saturating_sub(suspects)
            }
        }
    }

    /// Signals of which it shows that one is faulty, but not which: each is connected with the next by faults that are
    /// taken for each other. Sets of at least two, by their first signal.
    #[must_use]
    pub fn groups(&self) -> Vec<SignalSet> {
        let mut grouped = SignalSet::new();
        let mut groups = Vec::new();
        for signal in self.findings.ids() {
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
