//! The verdict on each signal and relation over time: suspect, failed, and trusted again.
//!
//! * A component has **failed** when it belongs to every explanation that is probable enough beside the best one. The comparisons
//!   that are undecided or only just agree cannot change that, whatever their outcome.
//! * A component of some of these explanations is **suspect**. The judge first waits, for a bounded time, for the comparisons
//!   that may still decide.
//! * Signals with a common cause are blamed together where the cause explains the conflicts. A component that shares a cause with
//!   one that has just failed is blamed before others.
//! * A conflict that a failed component explains is no evidence about other components.
//! * [`recovery`] describes how a component is trusted again.
//! * Without a comparison there is no verdict: unknown is not healthy.

mod evidence_view;
mod verdict;
mod power;
mod evidence;
mod case;
mod recovery;
mod accusation;

use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId, SignalSet};
use crate::monitor::{Inheritance, ResidualState};
use crate::time::Time;
use crate::trust::{Accused, Component, ConflictPair, Ledger, Support, Verdict};
use alloc::collections::BTreeSet;
use alloc::sync::Arc;
use alloc::vec::Vec;
use evidence::Priors;

pub use evidence::{rests_on, speaks_against, stands_still};
pub use evidence_view::EvidenceView;
pub use verdict::{Blame, Decision, JudgeOptions, Proof};

/// How often the evidence of one moment is reviewed at most. A decision changes what the evidence means for other components.
const MOST_ROUNDS: usize = 4;

/// Decides on signals and relations from a view of the [evidence](EvidenceView).
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: Arc<Priors>,
    /// For each signal, the witnesses of the signals that it is derived from, and its own.
    origins: IdVec<SignalId, SignalSet>,
    /// When the next review is due without a change of evidence.
    next_review: Option<Time>,
    /// The comparisons that a suspicion waits for.
    awaited: Vec<Awaited>,
}

/// A comparison that may still decide, by the index of its pair.
#[derive(Clone, Copy, Debug)]
struct Awaited {
    pair: usize,
    /// How often the pair had been compared when the judge began to wait.
    made: u64,
}

impl Judge {
    /// Makes a judge for the signals and relations of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, options: JudgeOptions) -> Judge {
        Judge {
            options,
            priors: Arc::new(Priors::new(knowledge, &options)),
            origins: IdVec::filled(knowledge.signals().len(), |signal| {
                knowledge.as_witnesses(knowledge.origins(signal))
            }),
            next_review: None,
            awaited: Vec::new(),
        }
    }

    /// Takes over the verdicts from before a change of the knowledge base. `inheritance` says which comparisons go on. The
    /// verdict on a signal is dropped when no comparison that goes on could clear it, or when the signal has another meaning now.
    /// The verdict on a relation goes on while comparisons rest on the relation. Returns the components whose verdicts were
    /// dropped, each with whether its description has changed.
    pub fn inherit(
        &mut self,
        old: &Judge,
        ledgers: (&Ledger, &mut Ledger),
        evidence: &impl EvidenceView,
        lineage: &Lineage,
        inheritance: &Inheritance,
    ) -> Vec<(Component, bool)> {
        self.next_review = old.next_review;
        // The change gives pairs other indices. An index that no pair has makes the next evidence start a review, which finds the
        // awaited pairs again.
        self.awaited.extend(old.awaited.first().map(|it| Awaited { pair: usize::MAX, ..*it }));
        let (before, ledger) = ledgers;
        let renamed = |&(way, other): &ConflictPair| Some((inheritance.way(way)?, inheritance.way(other)?));
        let mut dropped = Vec::new();
        for (component, standing) in before.standings() {
            let is_accused = standing.accused().is_some();
            let kept = match component {
                Component::Signal(id) => {
                    let Some(namesake) = lineage.namesake(id) else { continue };
                    let by_readings = standing.accused().is_some_and(Accused::is_by_readings);
                    let goes_on =
                        |same: &SignalId| !is_accused || by_readings || inheritance.compared.contains(*same);
                    let same = lineage.signal(id);
                    if by_readings && same.is_some() && !inheritance.is_whole {
                        // The comparison that contradicted the signal may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                    let is_anew = same.is_none();
                    same.filter(goes_on).map(Component::Signal).ok_or((Component::Signal(namesake), is_anew))
                }
                Component::Relation(id) => {
                    let Some(same) = lineage.relation(id).map(Component::Relation) else { continue };
                    let is_compared = evidence.pairs().iter().any(|pair| rests_on(evidence, pair, same));
                    if is_compared { Ok(same) } else { Err((same, false)) }
                }
                Component::Cause(_) => continue,
            };
            match kept {
                Ok(same) => ledger.inherit(same, standing, renamed),
                Err(gone) if is_accused => dropped.push(gone),
                Err(_) => {}
            }
        }
        dropped
    }

    /// When [`Judge::review`] must be called although no residual has changed its state.
    #[must_use]
    pub fn next_review(&self) -> Option<Time> {
        self.next_review
    }

    /// Whether a comparison that a suspicion waits for has been made since the last review. If so, [`Judge::review`] must be
    /// called although no residual has changed its state. Complexity: O(awaited comparisons), none in most systems.
    #[must_use]
    pub fn has_awaited_comparison(&self, evidence: &impl EvidenceView) -> bool {
        let pairs = evidence.pairs();
        self.awaited.iter().any(|it| pairs.get(it.pair).is_none_or(|pair| pair.made != it.made))
    }

    /// The verdict on a signal now.
    #[must_use]
    pub fn verdict(
        &self,
        ledger: &Ledger,
        signal: SignalId,
        evidence: &impl EvidenceView,
        now: Time,
    ) -> Verdict {
        let component = Component::Signal(signal);
        let witnessed = || {
            evidence.pairs_of(signal).any(|pair| {
                pair.residual_state(now) == ResidualState::Agree
                    && self.bears_witness(ledger, evidence, pair, component)
            })
        };
        match ledger.accused(component) {
            Some(accused) if matches!(accused.support, Support::Unproven(_)) => Verdict::Unknown,
            Some(accused) => accused.verdict,
            None if ledger.is_vouched_for(component) || witnessed() => Verdict::Healthy,
            None => Verdict::Unknown,
        }
    }

    /// Reviews all evidence. Complexity: O(restless pairs) while no pair is in conflict and no component is accused. Else that of
    /// [`explain`](super::candidates::explain), and that of [`probabilities`](super::candidates::probabilities) for each part
    /// with a decision; both are repeated a few times at most, after a decision.
    pub fn review(&mut self, ledger: &mut Ledger, evidence: &impl EvidenceView, now: Time) -> Vec<Decision> {
        self.next_review = None;
        let ruled_out = BTreeSet::new();
        let mut review = Review { judge: self, ledger, evidence, now, decisions: Vec::new(), ruled_out };
        for _ in 0..MOST_ROUNDS {
            let before = review.decisions.len();
            review.judge.awaited.clear();
            review.hear_again();
            review.accuse();
            review.clear();
            if review.decisions.len() == before {
                return review.decisions;
            }
        }
        review.judge.look_again(now);
        review.decisions
    }

    /// Asks for a review at a moment.
    pub fn look_again(&mut self, at: Time) {
        self.next_review = Some(self.next_review.map_or(at, |earlier| earlier.min(at)));
    }
}

/// A review in progress: all evidence of one moment, and the decisions so far.
struct Review<'e, T> {
    judge: &'e mut Judge,
    ledger: &'e mut Ledger,
    evidence: &'e T,
    now: Time,
    decisions: Vec<Decision>,
    /// The suspects that no probable explanation of the conflicts names any more.
    ruled_out: BTreeSet<Component>,
}

/// The current value of a signal, SI; `None` when it is no number, or the component is no signal.
fn latest_value(evidence: &impl EvidenceView, component: Component) -> Option<Interval> {
    let Component::Signal(signal) = component else { return None };
    evidence.latest_value(signal)
}
