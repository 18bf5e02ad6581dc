//! How a component is accused. It has failed where every probable explanation names it and chance cannot explain the conflicts;
//! where chance can, it is suspect. A component of some explanations is suspect once the comparisons that may decide have had
//! their time.

use super::case::{Case, Conflicts};
use super::evidence::{Dispute, is_claimed, is_explained, open_pairs, rests_on, rests_on_any, tells_apart};
use super::evidence_view::EvidenceView;
use super::verdict::{Blame, Decision};
use super::{Awaited, Review, latest_value};
use crate::diagnosis::candidates::explain;
use crate::monitor::{Residual, ResidualState};
use crate::time::Span;
use crate::trust::{Accused, By, Component, ConflictPair, MOST_CONFLICTS, Verdict};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

impl<T: EvidenceView> Review<'_, T> {
    /// Accuses the components that the conflicts blame.
    pub(super) fn accuse(&mut self) {
        let Review { evidence, now, .. } = *self;
        let ledger = &*self.ledger;
        self.ruled_out.clear();
        let open = |residual_state| open_pairs(ledger, evidence, now, residual_state);
        let conflicts: Vec<&Residual> = open(ResidualState::Conflict).collect();
        if conflicts.is_empty() {
            return;
        }
        let beliefs = self.judge.beliefs(ledger, now, &conflicts);
        let comparisons = self.judge.comparisons(ledger, evidence, now, &conflicts, &beliefs);
        let parts = explain(&comparisons, |component| beliefs.of(component));
        let mut disputed = conflicts.clone();
        disputed.extend(open(ResidualState::Undecided));
        // While a fault grows, the witness with the least tolerance disagrees first, and the others still just agree.
        let agreements = open(ResidualState::Agree);
        let undecided = disputed.len();
        disputed.extend(agreements.filter(|pair| pair.is_close()));
        let only_just = disputed.len() > undecided;
        let rivals = match disputed.len() == conflicts.len() {
            true => parts.clone(),
            false => {
                let comparisons = self.judge.comparisons(ledger, evidence, now, &disputed, &beliefs);
                let rivals = explain(&comparisons, |it| beliefs.of(it));
                // In a very large part, too many pairs only just agree for a decision. Then the conflicts alone decide.
                if rivals.iter().any(|part| part.is_cut_off) { parts.clone() } else { rivals }
            }
        };
        let conflicts = Conflicts {
            beliefs: &beliefs,
            comparisons: &comparisons,
            pairs: &conflicts,
            rivals: &rivals,
            only_just,
        };
        // A conflict that is only remembered stays evidence against the components that it has accused, and accuses no other
        // component.
        let cases = parts.iter().map(|part| Case::new(conflicts, part));
        let cases: Vec<Case> = cases.collect();
        self.ruled_out = self.suspects_beside(&cases);
        let cases: Vec<&Case> = cases.iter().filter(|case| self.is_fresh(case)).collect();
        for case in cases.iter().copied() {
            for &component in &case.certain {
                if !self.is_spared(component, case) {
                    let choice = (!is_sure(evidence, component, case)).then_some(&[][..]);
                    self.set(component, case, choice);
                }
            }
        }
        for case in cases {
            self.suspect(case);
        }
    }

    /// The suspects that the conflicts are about, and that no explanation names: later evidence has ruled them out.
    fn suspects_beside(&self, cases: &[Case<'_>]) -> BTreeSet<Component> {
        let named: BTreeSet<Component> = cases.iter().flat_map(Case::accused).collect();
        let is_compared = |component: Component| {
            let mut conflicts = cases.first().into_iter().flat_map(|case| case.conflicts.pairs);
            conflicts.any(|pair| rests_on(self.evidence, pair, component))
        };
        let suspects = self.ledger.all_accused().filter(|(_, it)| it.verdict == Verdict::Suspect);
        let others = suspects.map(|(component, _)| component).filter(|it| !named.contains(it));
        others.filter(|component| is_compared(*component)).collect()
    }

    /// Whether one of the conflicts of a part is of the present. If not, the next comparison of one of them decides.
    fn is_fresh(&mut self, case: &Case<'_>) -> bool {
        let accused = case.accused();
        let about = |pair: &&&Residual| rests_on_any(self.evidence, pair, &accused);
        let mut conflicts = case.conflicts.pairs.iter().filter(about);
        if conflicts.any(|pair| pair.is_fresh(self.now)) {
            return true;
        }
        let is_of_it = |pair: &Residual| {
            case.conflicts.pairs.iter().any(|it| (it.way, it.other) == (pair.way, pair.other))
        };
        let pairs = self.evidence.pairs().iter().enumerate().filter(|(_, pair)| is_of_it(pair));
        let awaited = pairs.map(|(number, pair)| Awaited { pair: number, made: pair.made });
        self.judge.awaited.extend(awaited);
        false
    }

    /// Whether a component is blamed for a common cause only, while an independent witness agrees with it.
    fn is_spared(&self, component: Component, case: &Case<'_>) -> bool {
        let Component::Signal(signal) = component else { return false };
        case.cause_of(component).is_some()
            && !case.conflicts.pairs.iter().any(|pair| rests_on(self.evidence, pair, component))
            && self.judge.verdict(self.ledger, signal, self.evidence, self.now) == Verdict::Healthy
    }

    fn suspect(&mut self, case: &Case<'_>) {
        let Review { evidence, now, .. } = *self;
        let conflicts = case.conflicts.pairs;
        let is_open = |component: &Component| {
            !case.certain.contains(component) && self.disagrees_otherwise(*component, conflicts)
        };
        let rest: BTreeSet<Component> = case.accused().into_iter().filter(is_open).collect();
        let Some(dispute) = Dispute::about(evidence, conflicts, &rest, now) else { return };
        if !self.is_settled(&rest, &dispute) {
            return;
        }
        // Pairs that are still undecided after the wait accuse no component, but they clear those that are in no conflict at all.
        let likely = case.likely();
        let accused: Vec<Component> =
            rest.into_iter().filter(|component| likely.is_empty() || likely.contains(component)).collect();
        for &component in &accused {
            self.set(component, case, Some(&accused));
        }
    }

    /// Whether all comparisons with the accused have had the time to show a conflict that began with the dispute, or the wait for
    /// them is over.
    ///
    /// The judge waits for gradual comparisons only where a conflict has built up gradually. The wait is capped at 3/4 of the
    /// time for which a residual shows a step. An intermittent conflict does not restart it.
    fn is_settled(&mut self, accused: &BTreeSet<Component>, dispute: &Dispute) -> bool {
        let Review { evidence, now, .. } = *self;
        let &Dispute { onset, since, gradual, shows, own_latency } = dispute;
        let latency = |pair: &Residual| if gradual { pair.latency() } else { pair.window.latency() };
        let is_open = |pair: &&Residual| {
            let may_decide = match pair.residual_state(now) {
                ResidualState::Undecided => true,
                ResidualState::Agree => {
                    (gradual && pair.is_building()) || pair.is_close() || !pair.window.confirmed_since(onset)
                }
                ResidualState::Conflict | ResidualState::Unknown => false,
            };
            may_decide
                && rests_on_any(evidence, pair, accused)
                && tells_apart(evidence, now, pair, accused)
                && !is_explained(self.ledger, evidence, pair, None)
        };
        let open = || evidence.pairs().iter().enumerate().filter(|(_, pair)| is_open(pair));
        let Some(latency) = open().map(|(_, pair)| latency(pair)).max() else { return true };
        let most = self.judge.options.patience.max(own_latency.times(2));
        let deadline = since + latency.times(2).min(Span(shows.0 - shows.0 / 4)).min(most);
        if now >= deadline {
            return true;
        }
        // Before the deadline, only the open pairs can settle the dispute: by a comparison, or by becoming stale.
        let stale = open().filter_map(|(_, pair)| pair.window.stale_at()).filter(|at| *at > now).min();
        let awaited =
            open().map(|(number, pair)| Awaited { pair: number, made: pair.made }).collect::<Vec<_>>();
        self.judge.awaited.extend(awaited);
        self.judge.look_again(stale.map_or(deadline, |at| at.min(deadline)));
        false
    }

    /// Accuses a component: as failed where `choice` is `None`, else as suspect among the choice, which is empty where the
    /// conflicts may be chance.
    fn set(&mut self, component: Component, case: &Case<'_>, choice: Option<&[Component]>) {
        let verdict = if choice.is_none() { Verdict::Failed } else { Verdict::Suspect };
        if self.ledger.accused(component).is_some_and(|before| before.verdict >= verdict) {
            return;
        }
        let relapses = self.ledger.relapses(component, self.now);
        let against = case.conflicts.pairs.iter().filter(|pair| rests_on(self.evidence, pair, component));
        let conflicts = against.map(|pair| (pair.way, pair.other)).take(MOST_CONFLICTS);
        let latest_value = latest_value(self.evidence, component);
        let accused = Accused {
            is_alone: choice.is_none_or(|choice| choice.len() <= 1),
            cause: case.cause_of(component),
            latest_value: latest_value.filter(|_| has_moved(self.evidence, component)),
            conflicts: conflicts.collect::<BTreeSet<ConflictPair>>(),
            ..Accused::new(verdict, By::Comparisons)
        };
        self.ledger.accuse(component, accused, self.now);
        let blame = Blame { relapses, ..case.blame(component) };
        self.decisions.push(match choice {
            None => Decision::Failed(blame),
            Some(choice) => Decision::Suspected(blame, choice.to_vec()),
        });
    }

    /// Whether a component is in a conflict that no component accused alone explains.
    fn disagrees_otherwise(&self, component: Component, conflicts: &[&Residual]) -> bool {
        let is_open = |pair: &&Residual| {
            rests_on(self.evidence, pair, component)
                && !is_claimed(self.ledger, self.evidence, pair, component)
        };
        conflicts.iter().any(is_open)
    }
}

/// Whether the conflicts against a component cannot be chance. A component that is blamed for a common cause only is in no
/// conflict itself: then all conflicts count.
fn is_sure(evidence: &impl EvidenceView, component: Component, case: &Case<'_>) -> bool {
    let mut against =
        case.conflicts.pairs.iter().filter(|pair| rests_on(evidence, pair, component)).peekable();
    match against.peek() {
        Some(_) => against.any(|pair| pair.is_sure()),
        None => case.conflicts.pairs.iter().any(|pair| pair.is_sure()),
    }
}

/// Whether the value of a signal has ever changed. Of a signal whose value never changes, or that may rest where it is, a constant
/// value is no symptom.
fn has_moved(evidence: &impl EvidenceView, component: Component) -> bool {
    matches!(component, Component::Signal(signal) if evidence.frozen(signal).has_moved() && !evidence.is_at_rest(signal))
}
