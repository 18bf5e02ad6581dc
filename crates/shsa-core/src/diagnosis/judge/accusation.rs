//! How something is accused: as failed where every probable explanation names it and what speaks against it is no chance; as
//! suspect where it may be; else as one of a choice, once all that may yet decide has had its time.

use super::case::Case;
use super::evidence::{Dispute, rests_on, rests_on_any, tells_apart};
use super::recovery::{Ground, MOST_GROUNDS};
use super::testimony::Testimony;
use super::verdict::{Blame, Decision, Verdict};
use super::{ComponentState, Judge, MOST_RELAPSES, said};
use crate::diagnosis::candidates::{Component, explain};
use crate::monitor::{Residual, ResidualState};
use crate::time::{Span, Time};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// A signal that is accused again within this many of its probations has relapsed.
const RELAPSE_PROBATIONS: i64 = 4;

impl Judge {
    /// Looks whether the conflicts accuse anything.
    pub(super) fn accuse(&mut self, evidence: &impl Testimony, now: Time, decisions: &mut Vec<Decision>) {
        let conflicts: Vec<&Residual> = self.open_pairs(evidence, now, ResidualState::Conflict).collect();
        if conflicts.is_empty() {
            return;
        }
        let beliefs = self.beliefs(now, &conflicts);
        let comparisons = self.comparisons(evidence, now, &conflicts, &beliefs);
        let parts = explain(&comparisons, |component| beliefs.of(component));
        let mut disputed = conflicts.clone();
        disputed.extend(self.open_pairs(evidence, now, ResidualState::Undecided));
        // Of faults that grow, the witness with the least tolerance tells first: the others only just agree yet.
        let agreements = self.open_pairs(evidence, now, ResidualState::Agree);
        let undecided = disputed.len();
        disputed.extend(agreements.filter(|pair| pair.is_close()));
        let only_just = disputed.len() > undecided;
        let rivals = match disputed.len() == conflicts.len() {
            true => parts.clone(),
            false => {
                let rivals =
                    explain(&self.comparisons(evidence, now, &disputed, &beliefs), |it| beliefs.of(it));
                // Among very many, so much only just agrees that nobody can tell: then what disagrees decides.
                if rivals.iter().any(|part| part.is_cut_off) { parts.clone() } else { rivals }
            }
        };
        let case = |part| Case::new(&beliefs, (&comparisons, &conflicts), part, (&rivals, only_just));
        let cases: Vec<Case> = parts.iter().map(case).collect();
        for case in &cases {
            for &component in &case.certain {
                if !self.is_spared(evidence, component, case, now) {
                    let choice = (!is_sure(evidence, component, case)).then_some(&[][..]);
                    self.set((evidence, now), component, case, choice, decisions);
                }
            }
        }
        for case in &cases {
            self.suspect((evidence, now), case, &conflicts, decisions);
        }
    }

    /// Whether something is blamed for what it shares only, and an independent witness agrees with it.
    fn is_spared(&self, evidence: &impl Testimony, component: Component, case: &Case<'_>, now: Time) -> bool {
        let Component::Signal(signal) = component else { return false };
        case.cause_of(component).is_some()
            && !case.conflicts.iter().any(|pair| rests_on(evidence, pair, component))
            && self.verdict(signal, evidence, now) == Verdict::Healthy
    }

    /// Remembers which comparisons speak against something.
    fn ground(&mut self, evidence: &impl Testimony, component: Component, conflicts: &[&Residual]) {
        let against = conflicts.iter().filter(|pair| rests_on(evidence, pair, component));
        let grounds: BTreeSet<Ground> =
            against.map(|pair| (pair.way, pair.other)).take(MOST_GROUNDS).collect();
        self.grounds.insert(component, grounds);
    }

    fn suspect(
        &mut self,
        (evidence, now): (&impl Testimony, Time),
        case: &Case<'_>,
        conflicts: &[&Residual],
        decisions: &mut Vec<Decision>,
    ) {
        let is_open = |component: &Component| {
            !case.certain.contains(component) && self.disagrees_otherwise(evidence, *component, conflicts)
        };
        let rest: BTreeSet<Component> = case.accused().into_iter().filter(is_open).collect();
        let Some(dispute) = Dispute::about(evidence, conflicts, &rest, now) else { return };
        if !self.is_settled((evidence, now), &rest, &dispute) {
            return;
        }
        // What is still undecided after the wait names nobody, but it speaks for those who do not disagree at all.
        let likely = case.likely();
        let accused: Vec<Component> =
            rest.into_iter().filter(|component| likely.is_empty() || likely.contains(component)).collect();
        for &component in &accused {
            self.set((evidence, now), component, case, Some(&accused), decisions);
        }
    }

    /// Whether all comparisons that speak about the accused have had the time to show a conflict that began with the dispute,
    /// or the wait for them is over. Only one that has come together gradually makes it wait for others that may. What shows
    /// a step for so long only is not waited for until it shows it no more; nor is one that comes and goes waited for anew.
    fn is_settled(
        &mut self,
        (evidence, now): (&impl Testimony, Time),
        accused: &BTreeSet<Component>,
        dispute: &Dispute,
    ) -> bool {
        let &Dispute { onset, since, gradual, shows } = dispute;
        let latency = |pair: &Residual| if gradual { pair.latency() } else { pair.window.latency() };
        let is_open = |pair: &&Residual| {
            let may_decide = match pair.relationship(now) {
                ResidualState::Undecided => true,
                ResidualState::Agree => {
                    (gradual && pair.is_building()) || pair.is_close() || !pair.window.confirmed_since(onset)
                }
                ResidualState::Conflict | ResidualState::Unknown => false,
            };
            may_decide
                && rests_on_any(evidence, pair, accused)
                && tells_apart((evidence, now), pair, accused)
                && !self.is_explained(evidence, pair, None)
        };
        let open = || evidence.pairs().iter().filter(is_open);
        let Some(latency) = open().map(latency).max() else { return true };
        let deadline = since + latency.times(2).min(Span(shows.0 - shows.0 / 4));
        if now >= deadline {
            return true;
        }
        // By then those that only had too little time will have spoken.
        let spoken = open().map(|pair| pair.window.confirms_by(onset)).filter(|at| *at > now).max();
        self.look_again(spoken.map_or(deadline, |at| at.min(deadline)));
        false
    }

    /// Accuses: as failed, or as one of a choice; an empty one, where it may be chance.
    fn set(
        &mut self,
        (evidence, now): (&impl Testimony, Time),
        component: Component,
        case: &Case<'_>,
        choice: Option<&[Component]>,
        decisions: &mut Vec<Decision>,
    ) {
        let verdict = if choice.is_none() { Verdict::Failed } else { Verdict::Suspect };
        let before = self.state_of(component);
        if before.verdict >= Some(verdict) {
            return;
        }
        let relapses = self.relapses(component, now);
        let state_of = ComponentState {
            verdict: Some(verdict),
            alone: choice.is_none_or(|choice| choice.len() <= 1),
            clean_since: None,
            said: said(evidence, component).filter(|_| has_moved(evidence, component)),
            relapses,
            cleared: before.cleared,
            accused: Some(now),
            cause: case.cause_of(component),
            ..ComponentState::default()
        };
        self.put(component, state_of);
        self.ground(evidence, component, case.conflicts);
        let blame = Blame { relapses, ..case.blame(component) };
        decisions.push(match choice {
            None => Decision::Failed(blame),
            Some(choice) => Decision::Suspected(blame, choice.to_vec()),
        });
    }

    /// How often in a row something has been accused soon after it was trusted again, when it is accused now.
    pub(super) fn relapses(&self, component: Component, now: Time) -> u32 {
        let before = self.state_of(component);
        let soon = |cleared: Time| now - cleared <= self.probation(before.relapses).times(RELAPSE_PROBATIONS);
        match (before.verdict, before.cleared) {
            (Some(_), _) => before.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.relapses + 1).min(MOST_RELAPSES),
            _ => 0,
        }
    }

    /// Whether something disagrees with something else than what was accused alone.
    fn disagrees_otherwise(
        &self,
        evidence: &impl Testimony,
        component: Component,
        conflicts: &[&Residual],
    ) -> bool {
        let is_open = |pair: &&Residual| {
            rests_on(evidence, pair, component) && !self.is_claimed(evidence, pair, component)
        };
        conflicts.iter().any(is_open)
    }

    /// Whether something else that was accused alone is in a pair.
    pub(super) fn is_claimed(
        &self,
        evidence: &impl Testimony,
        pair: &Residual,
        component: Component,
    ) -> bool {
        let mut alone = self.standings.iter().filter(|(other, it)| it.alone && **other != component);
        alone.any(|(other, _)| rests_on(evidence, pair, *other))
    }
}

/// Whether what speaks against something is no chance. What is blamed for what it shares only, others speak against.
fn is_sure(evidence: &impl Testimony, component: Component, case: &Case<'_>) -> bool {
    let mut against = case.conflicts.iter().filter(|pair| rests_on(evidence, pair, component)).peekable();
    match against.peek() {
        Some(_) => against.any(|pair| pair.is_sure()),
        None => case.conflicts.iter().any(|pair| pair.is_sure()),
    }
}

/// Whether what a signal says has ever changed: of what never does it means nothing that it stands still.
fn has_moved(evidence: &impl Testimony, component: Component) -> bool {
    matches!(component, Component::Signal(signal) if evidence.frozen(signal).has_moved())
}
