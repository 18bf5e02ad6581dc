//! How an accused component is trusted again: by evidence, never by its absence.
//!
//! * A component that comparisons have accused is trusted again when at least one of these comparisons agrees and none disagrees,
//!   for the probation time. Where other failed components explain all of these comparisons, the component is trusted at once.
//! * A signal that a detector has failed needs a witness that has agreed since, or a value that can be reached from its last sound
//!   reading, or to have started anew. Once comparisons have contradicted the signal, only comparisons can clear it. A comparison of changes is no witness
//!   after a jump.
//! * A component that no evidence accuses or supports any more is unproven. It may serve where nothing else is left, and what it
//!   gives is uncertain. A component that has failed by comparisons does not become unproven: it stays contradicted, though no
//!   comparison repeats that.
//!
//! A signal that usually moves stays suspect while it repeats the value with which it was accused: a frozen value is right now
//! and then.

use super::evidence::{is_explained, rests_on, rests_on_any, stands_still};
use super::power::{has_power, is_of_a_bound};
use super::{Decision, EvidenceView, Proof, Review};
use crate::knowledge::SignalId;
use crate::monitor::{Residual, ResidualState};
use crate::time::Span;
use crate::trust::{Accused, Component, ConflictPair, Support, Verdict};
use alloc::collections::BTreeSet;

/// The outcome of weighing the evidence about an accused component.
enum Weighed {
    /// A comparison accuses the component, or may still do so, or a detector does.
    Against(Option<ConflictPair>),
    /// No evidence accuses the component, and none supports it. `is_appeased`: all comparisons that have accused it agree again,
    /// but of changes only. `is_explained`: those whom it was compared with have had nothing to show since.
    Silent { is_appeased: bool, is_explained: bool },
    /// A comparison that has accused the component agrees again.
    For(Proof),
    /// Other failed components explain all comparisons that have accused the component.
    Explained,
}

/// How many of the comparisons that have accused a component now agree, are silent, or are explained.
#[derive(Default)]
struct Counts {
    agree: usize,
    /// Those that agree, but would agree beside a lasting offset as well.
    appeased: usize,
    silent: usize,
    explained: usize,
    /// Those with a signal that has had nothing to show only since then: it may still have been right.
    outlived: usize,
    /// Whether a comparison that never accused the component bears witness for it.
    witnessed: bool,
}

impl<T: EvidenceView> Review<'_, T> {
    /// Clears the accused components that the evidence supports again.
    pub(super) fn clear(&mut self) {
        let culprit = |decision: &Decision| match decision {
            Decision::Failed(blame) => Some(blame.component),
            _ => None,
        };
        let mut culprits = self.ledger.take_newly_failed();
        culprits.extend(self.decisions.iter().filter_map(culprit));
        let mut next = self.ledger.next_accused(None);
        while let Some(component) = next {
            let decision = match self.weigh(component) {
                Weighed::Against(conflict) => self.take_conflict(component, conflict),
                Weighed::Silent { is_appeased, is_explained } => {
                    self.take_silence(component, is_appeased, is_explained)
                }
                Weighed::For(proof) => self.take_support(component, proof, &culprits),
                Weighed::Explained => Some(self.acquit(component)),
            };
            self.decisions.extend(decision);
            next = self.ledger.next_accused(Some(component));
        }
    }

    /// Hears failed components as witnesses again, before they are trusted: probation bars a component from serving. Two others that
    /// contradict each other would else wait for its word, and it for theirs.
    pub(super) fn hear_again(&mut self) {
        let mut next = self.ledger.next_accused(None);
        while let Some(component) = next {
            let before = self.ledger.accused(component).filter(|it| it.verdict == Verdict::Failed);
            let is_heard = before.is_some() && self.bears_witness_again(component);
            if before.is_some_and(|before| before.bears_witness != is_heard) {
                self.ledger.hear(component, is_heard);
            }
            next = self.ledger.next_accused(Some(component));
        }
    }

    /// Whether a failed component is sound by itself, agrees again with one that has accused it or could have, and contradicts
    /// none that is trusted.
    fn bears_witness_again(&self, component: Component) -> bool {
        let Review { evidence, now, .. } = *self;
        let Some(accused) = self.ledger.accused(component) else { return false };
        if !is_sound(evidence, component) {
            return false;
        }
        let mut agrees = false;
        for pair in pairs_of(evidence, component) {
            let is_other = |it: &SignalId| Component::Signal(*it) != component;
            let others = || pair.signals.iter().filter(is_other);
            if others().any(|it| self.ledger.has_failed(it)) {
                continue;
            }
            match pair.residual_state(now) {
                ResidualState::Agree => {
                    let has_accused = accused.conflicts.contains(&(pair.way, pair.other));
                    let has_seen = || accused.since.is_some_and(|since| pair.window.confirmed_since(since));
                    let could_contradict = has_accused || accused.is_by_readings() && has_seen();
                    let shows = || shows_size(evidence, pair, component) && has_power(evidence, pair);
                    agrees |= could_contradict && shows();
                }
                ResidualState::Unknown => {}
                ResidualState::Undecided | ResidualState::Conflict => {
                    if others().all(|it| !self.ledger.accuses(Component::Signal(it))) {
                        return false;
                    }
                }
            }
        }
        agrees
    }

    fn take_conflict(&mut self, component: Component, conflict: Option<ConflictPair>) -> Option<Decision> {
        self.await_staleness(component);
        let is_back = has_returned(self.evidence, component);
        self.ledger.contradict(component, conflict, is_back).then_some(Decision::Contradicted(component))
    }

    fn take_silence(
        &mut self,
        component: Component,
        is_appeased: bool,
        is_explained: bool,
    ) -> Option<Decision> {
        let since = self.ledger.fall_silent(component, self.now);
        let accused = self.ledger.accused(component)?;
        let is_contradicted = !is_appeased && !accused.conflicts.is_empty();
        let may_serve = accused.verdict != Verdict::Failed || accused.is_by_readings() && !is_contradicted;
        if matches!(accused.support, Support::Unproven(_)) || !may_serve {
            return None;
        }
        let probation = if is_explained { Span::ZERO } else { self.ledger.probation_of(component) };
        if self.now < since + probation {
            self.judge.look_again(since + probation);
            return None;
        }
        self.ledger.leave_unproven(component);
        Some(Decision::Unproven(component, probation))
    }

    fn take_support(
        &mut self,
        component: Component,
        proof: Proof,
        culprits: &BTreeSet<Component>,
    ) -> Option<Decision> {
        let evidence = self.evidence;
        let accused = self.ledger.accused(component)?;
        let (is_suspect, is_by_readings) = (accused.verdict == Verdict::Suspect, accused.is_by_readings());
        let since = accused.support.clean_since().unwrap_or(self.now);
        // A culprit explains the suspicion only where the component was compared with it.
        let compared =
            |pair: &Residual| rests_on(evidence, pair, component) && rests_on_any(evidence, pair, culprits);
        let explained = is_suspect && evidence.pairs().iter().any(compared);
        let probation = self.ledger.probation_of(component);
        if !explained && self.now < since + probation {
            self.ledger.support(component, since);
            self.judge.look_again(since + probation);
            return None;
        }
        let is_ruled_out = self.ruled_out.contains(&component);
        Some(match (component, self.acquit(component)) {
            (Component::Signal(signal), _) if is_by_readings => Decision::Recovered(signal, probation, proof),
            (_, Decision::Cleared(_)) if is_ruled_out => Decision::RuledOut(component),
            (_, cleared) => cleared,
        })
    }

    /// Makes a component trusted again.
    fn acquit(&mut self, component: Component) -> Decision {
        self.ledger.acquit(component, self.now);
        Decision::Cleared(component)
    }

    /// Weighs the evidence about an accused component. O(its comparisons).
    fn weigh(&self, component: Component) -> Weighed {
        let Review { evidence, now, .. } = *self;
        if !is_sound(evidence, component) {
            return Weighed::Against(None);
        }
        let counts = match self.count(component) {
            Ok(counts) => counts,
            Err(against) => return Weighed::Against(against),
        };
        let by_readings = self.ledger.accused(component).filter(|it| it.is_by_readings());
        if by_readings.is_none() && self.is_explained_away(component, &counts) {
            return Weighed::Explained;
        }
        if stands_still(self.ledger, component, evidence, now) {
            return Weighed::Against(None);
        }
        let silent = counts.silent + counts.outlived;
        let is_met = counts.agree > 0 || (counts.witnessed && silent == 0);
        let return_is_proof =
            || by_readings.is_some_and(|it| !it.is_contradicted()) && has_returned(self.evidence, component);
        match () {
            () if is_met => Weighed::For(Proof::Witness),
            () if return_is_proof() => Weighed::For(self.proof_of_return(component)),
            () => Weighed::Silent {
                is_appeased: counts.appeased > 0 && silent == 0,
                is_explained: counts.outlived > 0 && counts.silent == 0,
            },
        }
    }

    /// Why a component whose own readings show that they are possible again is trusted.
    fn proof_of_return(&self, component: Component) -> Proof {
        match component {
            Component::Signal(signal) if self.evidence.has_started_anew(signal) => Proof::Start,
            _ => Proof::Return,
        }
    }

    /// Counts the comparisons with a component; a comparison that disagrees, or may still, is the error.
    fn count(&self, component: Component) -> Result<Counts, Option<ConflictPair>> {
        let Review { evidence, now, .. } = *self;
        let accused = self.ledger.accused(component);
        // A value of a witness from before the fault is no evidence about the fault.
        let since = accused.and_then(|it| it.since);
        let has_seen = |pair: &Residual| since.is_none_or(|since| pair.window.confirmed_since(since));
        // A signal that has jumped stays wrong by the size of the jump, although its changes are right.
        let has_returned = has_returned(evidence, component);
        // Nor does one that has failed come back by changes that are right, unless those that were wrong cancel each other.
        let failed_by_comparisons =
            accused.is_some_and(|it| !it.is_by_readings() && it.verdict == Verdict::Failed);
        let bears_on = |pair: &Residual| match failed_by_comparisons {
            true => pair.has_moved_back() || shows_size(evidence, pair, component),
            false => has_returned || shows_size(evidence, pair, component),
        };
        let mut found = Counts::default();
        let mut undecided = false;
        for pair in pairs_of(evidence, component) {
            let ways = (pair.way, pair.other);
            let has_accused = accused.is_some_and(|it| it.conflicts.contains(&ways));
            if !has_accused && !is_about(evidence, pair, component) {
                continue;
            }
            if is_explained(self.ledger, evidence, pair, Some(component)) {
                let explains = accused.is_none_or(|it| self.explains(pair, component, it));
                let count = if explains { &mut found.explained } else { &mut found.outlived };
                *count += usize::from(has_accused);
                continue;
            }
            match pair.residual_state(now) {
                ResidualState::Unknown => found.silent += usize::from(has_accused),
                // That a value is possible is no word about it.
                ResidualState::Agree if has_accused && is_of_a_bound(evidence, pair) => found.silent += 1,
                ResidualState::Agree if has_accused && bears_on(pair) => found.agree += 1,
                ResidualState::Agree if has_accused => found.appeased += 1,
                ResidualState::Agree => {
                    found.witnessed |= has_seen(pair)
                        && bears_on(pair)
                        && self.judge.bears_witness(self.ledger, evidence, pair, component);
                }
                // Others explain it, and none of them is known for sure.
                ResidualState::Undecided | ResidualState::Conflict if self.ruled_out.contains(&component) => {
                }
                ResidualState::Undecided => undecided = true,
                ResidualState::Conflict => return Err(Some(ways)),
            }
        }
        if undecided { Err(None) } else { Ok(found) }
    }

    /// Whether a failed component of a pair explains why another one was accused.
    fn explains(&self, pair: &Residual, component: Component, accused: &Accused) -> bool {
        let mut failed = self.ledger.discounted().iter();
        failed.any(|&it| {
            let explains = || self.ledger.accused(it).is_none_or(|failed| failed.explains(accused));
            it != component && rests_on(self.evidence, pair, it) && explains()
        })
    }

    /// Whether no evidence accuses a component any more: other failed components explain all conflicts with it, or it was blamed
    /// for a common cause of which no other signal is accused any more.
    fn is_explained_away(&self, component: Component, counts: &Counts) -> bool {
        let Some(accused) = self.ledger.accused(component) else { return false };
        match (accused.conflicts.len(), accused.cause) {
            (0, Some(cause)) => {
                let others = self.judge.priors.sharing(cause).iter().map(|signal| Component::Signal(*signal));
                let known_by =
                    |it: &Accused| it.is_by_readings() || it.since.is_some() || !it.conflicts.is_empty();
                let stands = |other: Component| self.ledger.accused(other).is_some_and(known_by);
                !others.filter(|other| *other != component).any(stands)
            }
            (0, None) => false,
            _ => counts.explained > 0 && counts.agree + counts.silent + counts.outlived == 0,
        }
    }

    /// Asks for a review when the first comparison with an accused component becomes stale.
    fn await_staleness(&mut self, component: Component) {
        let Review { evidence, now, .. } = *self;
        let stale = pairs_of(evidence, component).filter_map(|pair| pair.window.stale_at());
        let stale = stale.filter(|at| *at > now).min();
        stale.into_iter().for_each(|at| self.judge.look_again(at));
    }
}

/// The pairs that may be evidence about a component.
fn pairs_of(evidence: &impl EvidenceView, component: Component) -> impl Iterator<Item = &Residual> {
    let signal = match component {
        Component::Signal(signal) => Some(signal),
        Component::Relation(_) | Component::Cause(_) => None,
    };
    let all = signal.is_none().then(|| evidence.pairs()).into_iter().flatten();
    let all = all.filter(move |pair| rests_on(evidence, pair, component));
    signal.into_iter().flat_map(|signal| evidence.pairs_of(signal)).chain(all)
}

/// Whether a pair shows a lasting offset of a signal: a comparison of changes does not, unless the signal counts. What that has counted
/// wrongly stays counted, and is no error of what it counts now.
fn shows_size(evidence: &impl EvidenceView, pair: &Residual, component: Component) -> bool {
    let Component::Signal(signal) = component else { return true };
    let shows =
        |index| evidence.way(index).is_some_and(|way| way.is_sized_by(signal) && !way.computation.is_rate());
    let counts = evidence.counts(signal);
    counts || shows(pair.way) || shows(pair.other)
}

/// Whether the result of a pair depends on the size of a signal's value, or on a relation.
fn is_about(evidence: &impl EvidenceView, pair: &Residual, component: Component) -> bool {
    let Component::Signal(signal) = component else { return rests_on(evidence, pair, component) };
    let is_sized = |index| evidence.way(index).is_some_and(|way| way.is_sized_by(signal));
    is_sized(pair.way) || is_sized(pair.other)
}

/// Whether a signal gives values, and no detector finds a fault in its readings; true for other components.
fn is_sound(evidence: &impl EvidenceView, component: Component) -> bool {
    let Component::Signal(signal) = component else { return true };
    evidence.is_sound(signal)
}

fn has_returned(evidence: &impl EvidenceView, component: Component) -> bool {
    let home = |signal: SignalId| evidence.has_returned(signal);
    !matches!(component, Component::Signal(signal) if !home(signal))
}
