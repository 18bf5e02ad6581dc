//! The verdict on each signal and relation over time: suspect, failed, and trusted again.
//!
//! Something has failed when it belongs to every explanation that is probable enough beside the best one, whatever the
//! comparisons that are still undecided, or only just agree, will say. For the rest of these explanations, the judge first
//! waits for the comparisons that may yet decide, for a bounded time; then it is suspect. Where what signals share explains
//! the conflicts, these signals are blamed together; what shares a cause with something that has failed a moment ago, before
//! others. What has failed explains is no evidence about others. How something is trusted again, says [`recovery`]. Without a
//! comparison there is no verdict: unknown is not healthy.

mod evidence;
mod orders;
mod recovery;

use super::candidates::{Comparison, Component, Part, explain, probabilities};
use crate::interval::Interval;
use crate::knowledge::{CauseId, IdVec, KnowledgeBase, Lineage, RelationId, SignalId, SignalSet};
use crate::monitor::{Inheritance, Monitor, Residual, ResidualState, WatchedWay};
use crate::time::{Span, Time};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::cell::OnceCell;
use evidence::{Beliefs, Dispute, Priors, rests_on_any};
use recovery::{Ground, MOST_GROUNDS};

pub use evidence::rests_on;
pub use orders::Record;

/// What is thought of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// No independent witness speaks about it.
    Unknown,
    /// An independent witness agrees with it.
    Healthy,
    /// It may be faulty, or others are.
    Suspect,
    /// It is faulty.
    Failed,
}

/// Why something is accused.
#[derive(Clone, Debug, PartialEq)]
pub struct Blame {
    /// The signal or relation.
    pub component: Component,
    /// What it shares with others, where that is what explains the conflicts best.
    pub cause: Option<CauseId>,
    /// How probable it is that it, or its cause where that is blamed, is faulty; `None` where there are too many
    /// possibilities for an exact number.
    pub probability: Option<f64>,
    /// What else is most probable, and how much.
    pub next: Option<(Component, f64)>,
    /// How often it was accused before, each time soon after it was trusted again: an intermittent fault.
    pub relapses: u32,
}

/// A change of verdict.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// It is faulty: it belongs to every probable explanation.
    Failed(Blame),
    /// It is one of several that explain the conflicts; the list is the whole choice, ascending.
    Suspected(Blame, Vec<Component>),
    /// It is trusted again.
    Cleared(Component),
    /// A signal whose own readings had shown a fault is trusted again, after this probation.
    Recovered(SignalId, Span, Proof),
    /// Nothing speaks against something accused any more, and nothing for it, for this long: it may serve where nothing else
    /// is left, as uncertain.
    Unproven(Component, Span),
    /// Something speaks against it again.
    Contradicted(Component),
}

/// Why a signal whose own readings had shown a fault is trusted again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Others agree with it.
    Witness,
    /// It says what it could say, from what it said before the fault.
    Return,
}

/// Settings of the judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgeOptions {
    /// How long all evidence must speak for a signal before it is trusted again.
    pub probation: Span,
    /// Prior fault probability of a signal whose properties give no `prior`.
    pub prior: f64,
    /// The same of a relation.
    pub relation_prior: f64,
}

impl Default for JudgeOptions {
    /// Signals fail a thousand times more often than what relates them.
    fn default() -> JudgeOptions {
        JudgeOptions { probation: Span::from_millis(5_000), prior: 0.01, relation_prior: 1e-5 }
    }
}

/// A signal that is accused again within this many of its probations has relapsed.
const RELAPSE_PROBATIONS: i64 = 4;
/// Probation doubles at most so often: with 5 s, to 5 minutes.
const MOST_RELAPSES: u32 = 6;

#[derive(Clone, Copy, Debug, Default)]
struct ComponentState {
    /// Suspect or failed.
    verdict: Option<Verdict>,
    /// Whether it was the only one accused: it explains disagreements as a failed signal does.
    alone: bool,
    /// Since when all evidence speaks for it.
    clean_since: Option<Time>,
    /// When it was last trusted again, and how often it was accused again soon after: each time doubles its probation.
    cleared: Option<Time>,
    relapses: u32,
    /// What it said when it was accused. While it still says the same, it is the plant that came back to it.
    said: Option<Interval>,
    /// When it was accused, and for which common cause.
    accused: Option<Time>,
    cause: Option<CauseId>,
    /// Its own readings have shown the fault: no comparison is needed to accuse it.
    failed_by_detector: bool,
    /// Comparisons have spoken against it while its readings were where they could be: only comparisons clear it.
    contradicted: bool,
    /// Since when nothing speaks against it.
    quiet_since: Option<Time>,
    /// Nothing has spoken against it for its probation, and nothing for it: it may serve where nothing else is left.
    unproven: bool,
    /// The operator vouches for it.
    cleared_by_operator: bool,
}

/// Decides on signals and relations from the pairs of a monitor.
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: Arc<Priors>,
    /// What stands for each signal and all that it is derived from.
    origins: IdVec<SignalId, SignalSet>,
    /// Of everything that was ever accused.
    standings: BTreeMap<Component, ComponentState>,
    /// The comparisons that have spoken against what is accused, by their two ways.
    grounds: BTreeMap<Component, BTreeSet<Ground>>,
    /// What nothing may rest on, by order.
    forbidden: BTreeSet<Component>,
    /// What has failed by its verdict or is forbidden: comparisons with it say nothing about others.
    discounted: BTreeSet<Component>,
    /// Signals whose own readings have shown a fault since the last review, ascending.
    failed_by_detector: BTreeSet<Component>,
    /// When to look again without a change of evidence.
    next_review: Option<Time>,
}

impl Judge {
    /// For the signals and relations of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, options: JudgeOptions) -> Judge {
        Judge {
            options,
            priors: Arc::new(Priors::new(knowledge, &options)),
            origins: IdVec::filled(knowledge.signals().len(), |signal| {
                knowledge.as_witnesses(knowledge.origins(signal))
            }),
            standings: BTreeMap::new(),
            grounds: BTreeMap::new(),
            forbidden: BTreeSet::new(),
            discounted: BTreeSet::new(),
            failed_by_detector: BTreeSet::new(),
            next_review: None,
        }
    }

    /// Goes on with the verdicts before a change of the knowledge base. `inheritance` says which comparisons
    /// go on: a verdict that no such comparison could ever clear is dropped, and so is that on a signal which means
    /// something else now. That on a relation goes on while there are comparisons that rest on it. Gives whose verdicts
    /// were dropped, and whether each is described anew.
    pub fn inherit(
        &mut self,
        old: &Judge,
        monitor: &Monitor,
        lineage: &Lineage,
        inheritance: &Inheritance,
    ) -> Vec<(Component, bool)> {
        self.next_review = old.next_review;
        let mut dropped = Vec::new();
        for (&component, state_of) in &old.standings {
            let id = match component {
                Component::Signal(id) => id,
                Component::Relation(id) => {
                    let Some(same) = lineage.relation(id).map(Component::Relation) else { continue };
                    match monitor.residuals().iter().any(|pair| rests_on(monitor, pair, same)) {
                        true => self.put(same, *state_of),
                        false if state_of.verdict.is_some() => dropped.push((same, false)),
                        false => {}
                    }
                    continue;
                }
                Component::Cause(_) => continue,
            };
            let Some(namesake) = lineage.namesake(id) else { continue };
            match lineage.signal(id) {
                Some(signal)
                    if state_of.verdict.is_none()
                        || state_of.failed_by_detector
                        || inheritance.compared.contains(signal) =>
                {
                    self.put(Component::Signal(signal), *state_of);
                    if state_of.failed_by_detector && !inheritance.is_whole {
                        // What contradicted it may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                }
                same if state_of.verdict.is_some() => {
                    dropped.push((Component::Signal(namesake), same.is_none()));
                }
                _ => {}
            }
        }
        self.inherit_grounds(old, lineage, inheritance);
        dropped
    }

    fn inherit_grounds(&mut self, old: &Judge, lineage: &Lineage, inheritance: &Inheritance) {
        let same = |&(way, other): &Ground| Some((inheritance.way(way)?, inheritance.way(other)?));
        for (component, grounds) in &old.grounds {
            let renamed = match *component {
                Component::Signal(signal) => lineage.signal(signal).map(Component::Signal),
                Component::Relation(relation) => lineage.relation(relation).map(Component::Relation),
                Component::Cause(_) => None,
            };
            if let Some(renamed) = renamed.filter(|it| self.accuses(*it)) {
                self.grounds.insert(renamed, grounds.iter().filter_map(same).collect());
            }
        }
    }

    /// When [`Judge::review`] must be called although no relationship has changed.
    #[must_use]
    pub fn next_review(&self) -> Option<Time> {
        self.next_review
    }

    /// Whether neither a signal nor anything that it is derived from is suspect, failed or forbidden.
    #[must_use]
    pub fn trusts(&self, signal: SignalId) -> bool {
        self.trusts_all() || self.origins[signal].iter().all(|origin| self.may_use(Component::Signal(origin)))
    }

    /// Whether a signal may serve where nothing else is left: it and all that it is derived from are trusted, or at least
    /// nothing speaks against them any more.
    #[must_use]
    pub fn tolerates(&self, signal: SignalId) -> bool {
        let is_tolerable = |origin: SignalId| {
            let component = Component::Signal(origin);
            self.may_use(component)
                || self.state_of(component).unproven && !self.forbidden.contains(&component)
        };
        self.trusts_all() || self.origins[signal].iter().all(is_tolerable)
    }

    /// Whether a way rests on nothing that is suspect, failed or forbidden.
    #[must_use]
    pub fn trusts_way(&self, way: &WatchedWay) -> bool {
        let mut steps = way.computation.way().substitution.steps.iter();
        self.trusts_all()
            || way.rests_on.iter().all(|signal| self.trusts(signal))
                && steps.all(|step| self.may_use(Component::Relation(step.relation)))
    }

    fn trusts_all(&self) -> bool {
        self.standings.is_empty() && self.forbidden.is_empty()
    }

    fn may_use(&self, component: Component) -> bool {
        self.accusation(component).is_none() && !self.forbidden.contains(&component)
    }

    /// Relations that are suspect, failed or forbidden, ascending: nothing may rest on them. When `tolerant`, without those
    /// that nothing speaks against any more.
    #[must_use]
    pub fn distrusted_relations(&self, tolerant: bool) -> Vec<RelationId> {
        let is_accused =
            |state_of: &ComponentState| state_of.verdict.is_some() && !(tolerant && state_of.unproven);
        let accused = self.standings.iter().filter(|(_, state_of)| is_accused(state_of));
        let all: BTreeSet<Component> =
            accused.map(|(component, _)| *component).chain(self.forbidden.iter().copied()).collect();
        let relation = |component| match component {
            Component::Relation(relation) => Some(relation),
            Component::Signal(_) | Component::Cause(_) => None,
        };
        all.into_iter().filter_map(relation).collect()
    }

    /// Whether a signal has failed by its verdict.
    #[must_use]
    pub fn has_failed(&self, signal: SignalId) -> bool {
        self.accusation(Component::Signal(signal)) == Some(Verdict::Failed)
    }

    /// Since when all evidence has spoken for a signal that is suspect or failed.
    #[must_use]
    pub fn clean_since(&self, signal: SignalId) -> Option<Time> {
        self.state_of(Component::Signal(signal)).clean_since
    }

    fn state_of(&self, component: Component) -> ComponentState {
        self.standings.get(&component).copied().unwrap_or_default()
    }

    fn put(&mut self, component: Component, state_of: ComponentState) {
        self.standings.insert(component, state_of);
        if state_of.verdict.is_none() {
            self.grounds.remove(&component);
        }
        match state_of.verdict == Some(Verdict::Failed) || self.forbidden.contains(&component) {
            true => self.discounted.insert(component),
            false => self.discounted.remove(&component),
        };
    }

    /// Suspect or failed.
    fn accusation(&self, component: Component) -> Option<Verdict> {
        self.standings.get(&component).and_then(|state_of| state_of.verdict)
    }

    /// How long all evidence must speak for a signal before it is trusted again; each relapse doubles it.
    #[must_use]
    pub fn probation_of(&self, signal: SignalId) -> Span {
        self.probation(self.state_of(Component::Signal(signal)).relapses)
    }

    /// What is thought of a signal now.
    #[must_use]
    pub fn verdict(&self, signal: SignalId, monitor: &Monitor, now: Time) -> Verdict {
        let witnessed = || {
            monitor.pairs_of(signal).any(|pair| {
                pair.relationship(now) == ResidualState::Agree
                    && self.bears_witness(monitor, pair, Component::Signal(signal))
            })
        };
        match self.accusation(Component::Signal(signal)) {
            Some(_) if self.state_of(Component::Signal(signal)).unproven => Verdict::Unknown,
            Some(verdict) => verdict,
            None if self.state_of(Component::Signal(signal)).cleared_by_operator || witnessed() => {
                Verdict::Healthy
            }
            None => Verdict::Unknown,
        }
    }

    /// A signal's own readings show that it is faulty, so that what it is compared with is not to blame. It is trusted again
    /// after its readings and every comparison with it have spoken for it for the probation time. Whether that is news.
    pub fn fail_by_detector(&mut self, signal: SignalId, now: Time) -> bool {
        let component = Component::Signal(signal);
        let before = self.state_of(component);
        if before.verdict == Some(Verdict::Failed) {
            self.put(
                component,
                ComponentState { clean_since: None, quiet_since: None, unproven: false, ..before },
            );
            return before.unproven;
        }
        let relapses = self.relapses(component, now);
        let verdict = Some(Verdict::Failed);
        let failed_by_detector = ComponentState {
            verdict,
            alone: true,
            relapses,
            cleared: before.cleared,
            accused: Some(now),
            failed_by_detector: true,
            contradicted: before.verdict.is_some(),
            ..ComponentState::default()
        };
        self.put(component, failed_by_detector);
        self.failed_by_detector.insert(component);
        true
    }

    /// Takes all evidence in. Complexity: O(restless pairs) while nothing is in conflict and nobody is accused; else that of
    /// [`explain()`], and of [`probabilities`] for each part in which something is decided.
    pub fn review(&mut self, monitor: &Monitor, now: Time) -> Vec<Decision> {
        let mut decisions = Vec::new();
        self.next_review = None;
        self.accuse(monitor, now, &mut decisions);
        self.clear(monitor, now, &mut decisions);
        decisions
    }

    fn accuse(&mut self, monitor: &Monitor, now: Time, decisions: &mut Vec<Decision>) {
        let conflicts: Vec<&Residual> = self.open_pairs(monitor, now, ResidualState::Conflict).collect();
        if conflicts.is_empty() {
            return;
        }
        let beliefs = self.beliefs(now, &conflicts);
        let comparisons = self.comparisons(monitor, now, &conflicts, &beliefs);
        let parts = explain(&comparisons, |component| beliefs.of(component));
        let mut disputed = conflicts.clone();
        disputed.extend(self.open_pairs(monitor, now, ResidualState::Undecided));
        // Of faults that grow, the witness with the least tolerance tells first: the others only just agree yet.
        let agreements = self.open_pairs(monitor, now, ResidualState::Agree);
        let undecided = disputed.len();
        disputed.extend(agreements.filter(|pair| pair.is_close()));
        let only_just = disputed.len() > undecided;
        let rivals = match disputed.len() == conflicts.len() {
            true => parts.clone(),
            false => {
                let rivals =
                    explain(&self.comparisons(monitor, now, &disputed, &beliefs), |it| beliefs.of(it));
                // Among very many, so much only just agrees that nobody can tell: then what disagrees decides.
                if rivals.iter().any(|part| part.is_cut_off) { parts.clone() } else { rivals }
            }
        };
        let case =
            |part| Case { only_just, ..Case::new(&beliefs, (&comparisons, &conflicts), part, &rivals) };
        let cases: Vec<Case> = parts.iter().map(case).collect();
        for case in &cases {
            for &component in &case.certain {
                if !self.is_spared(monitor, component, case, now) {
                    self.set((monitor, now), component, case, None, decisions);
                }
            }
        }
        for case in &cases {
            self.suspect((monitor, now), case, &conflicts, decisions);
        }
    }

    /// Whether something is blamed for what it shares only, and an independent witness agrees with it.
    fn is_spared(&self, monitor: &Monitor, component: Component, case: &Case<'_>, now: Time) -> bool {
        let Component::Signal(signal) = component else { return false };
        case.cause_of(component).is_some()
            && !case.conflicts.iter().any(|pair| rests_on(monitor, pair, component))
            && self.verdict(signal, monitor, now) == Verdict::Healthy
    }

    /// Remembers which comparisons speak against something.
    fn ground(&mut self, monitor: &Monitor, component: Component, conflicts: &[&Residual]) {
        let against = conflicts.iter().filter(|pair| rests_on(monitor, pair, component));
        let grounds: BTreeSet<Ground> =
            against.map(|pair| (pair.way, pair.other)).take(MOST_GROUNDS).collect();
        self.grounds.insert(component, grounds);
    }

    fn suspect(
        &mut self,
        (monitor, now): (&Monitor, Time),
        case: &Case<'_>,
        conflicts: &[&Residual],
        decisions: &mut Vec<Decision>,
    ) {
        let is_open = |component: &Component| {
            !case.certain.contains(component) && self.disagrees_otherwise(monitor, *component, conflicts)
        };
        let rest: BTreeSet<Component> = case.accused().into_iter().filter(is_open).collect();
        let Some(dispute) = Dispute::about(monitor, conflicts, &rest, now) else { return };
        if !self.is_settled((monitor, now), &rest, &dispute) {
            return;
        }
        // What is still undecided after the wait names nobody, but it speaks for those who do not disagree at all.
        let likely = case.likely();
        let accused: Vec<Component> =
            rest.into_iter().filter(|component| likely.is_empty() || likely.contains(component)).collect();
        for &component in &accused {
            self.set((monitor, now), component, case, Some(&accused), decisions);
        }
    }

    /// Whether all comparisons that speak about the accused have had the time to show a conflict that began with the dispute,
    /// or the wait for them is over. Only one that has come together gradually makes it wait for others that may. What shows
    /// a step for so long only is not waited for until it shows it no more; nor is one that comes and goes waited for anew.
    fn is_settled(
        &mut self,
        (monitor, now): (&Monitor, Time),
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
            may_decide && rests_on_any(monitor, pair, accused) && !self.is_explained(monitor, pair, None)
        };
        let open = || monitor.residuals().iter().filter(is_open);
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

    /// Accuses: as failed, or as one of a choice.
    fn set(
        &mut self,
        (monitor, now): (&Monitor, Time),
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
            alone: choice.is_none_or(|choice| choice.len() == 1),
            clean_since: None,
            said: said(monitor, component).filter(|_| has_moved(monitor, component)),
            relapses,
            cleared: before.cleared,
            accused: Some(now),
            cause: case.cause_of(component),
            ..ComponentState::default()
        };
        self.put(component, state_of);
        self.ground(monitor, component, case.conflicts);
        let blame = Blame { relapses, ..case.blame(component) };
        decisions.push(match choice {
            None => Decision::Failed(blame),
            Some(choice) => Decision::Suspected(blame, choice.to_vec()),
        });
    }

    /// How often in a row something has been accused soon after it was trusted again, when it is accused now.
    fn relapses(&self, component: Component, now: Time) -> u32 {
        let before = self.state_of(component);
        let soon = |cleared: Time| now - cleared <= self.probation(before.relapses).times(RELAPSE_PROBATIONS);
        match (before.verdict, before.cleared) {
            (Some(_), _) => before.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.relapses + 1).min(MOST_RELAPSES),
            _ => 0,
        }
    }

    /// Asks for a review at a moment.
    pub fn look_again(&mut self, at: Time) {
        self.next_review = Some(self.next_review.map_or(at, |earlier| earlier.min(at)));
    }

    /// Whether something disagrees with something else than what was accused alone.
    fn disagrees_otherwise(&self, monitor: &Monitor, component: Component, conflicts: &[&Residual]) -> bool {
        let is_open = |pair: &&Residual| {
            rests_on(monitor, pair, component) && !self.is_claimed(monitor, pair, component)
        };
        conflicts.iter().any(is_open)
    }

    /// Whether something else that was accused alone is in a pair.
    fn is_claimed(&self, monitor: &Monitor, pair: &Residual, component: Component) -> bool {
        let mut alone = self.standings.iter().filter(|(other, it)| it.alone && **other != component);
        alone.any(|(other, _)| rests_on(monitor, pair, *other))
    }
}

/// A part of the conflicts, and what follows from it.
struct Case<'p> {
    beliefs: &'p Beliefs,
    comparisons: &'p [Comparison],
    /// All pairs in conflict, of other parts as well.
    conflicts: &'p [&'p Residual],
    part: &'p Part,
    /// The signals and relations of each candidate, best first.
    candidates: Vec<BTreeSet<Component>>,
    /// The same with all that is undecided taken for conflicts.
    rivals: Vec<BTreeSet<Component>>,
    /// Whether some of that only just agrees.
    only_just: bool,
    /// What is in all of these.
    certain: BTreeSet<Component>,
    /// In the order of the part's components; looked for only where something is decided.
    probabilities: OnceCell<Option<Vec<f64>>>,
}

impl<'p> Case<'p> {
    fn new(
        beliefs: &'p Beliefs,
        (comparisons, conflicts): (&'p [Comparison], &'p [&'p Residual]),
        part: &'p Part,
        rivals: &[Part],
    ) -> Case<'p> {
        let accused = |part: &Part| -> Vec<BTreeSet<Component>> {
            part.candidates.iter().map(|candidate| beliefs.accused(&candidate.components)).collect()
        };
        let first = part.components.first();
        let is_of = |rival: &&Part| first.is_some_and(|first| rival.components.binary_search(first).is_ok());
        let (candidates, rivals) =
            (accused(part), rivals.iter().find(is_of).map(accused).unwrap_or_default());
        let mut certain = candidates.first().cloned().unwrap_or_default();
        certain.retain(|component| candidates.iter().chain(&rivals).all(|set| set.contains(component)));
        let probabilities = OnceCell::new();
        Case {
            beliefs,
            comparisons,
            conflicts,
            part,
            candidates,
            rivals,
            only_just: false,
            certain,
            probabilities,
        }
    }

    /// Everything that is in a candidate.
    fn accused(&self) -> BTreeSet<Component> {
        self.candidates.iter().flatten().copied().collect()
    }

    /// What is in a candidate that may stay one, however the undecided turns out.
    fn likely(&self) -> BTreeSet<Component> {
        if self.only_just {
            // What only just agrees is no evidence against anybody.
            return BTreeSet::new();
        }
        let stays = |set: &&BTreeSet<Component>| self.rivals.iter().any(|rival| rival.is_superset(set));
        self.candidates.iter().filter(stays).flatten().copied().collect()
    }

    fn blame(&self, component: Component) -> Blame {
        let cause = self.cause_of(component);
        let blamed = cause.map_or(component, Component::Cause);
        let find = || probabilities(self.comparisons, self.part, |component| self.beliefs.of(component));
        let known =
            self.probabilities.get_or_init(find).iter().flat_map(|all| self.part.components.iter().zip(all));
        let known: Vec<(Component, f64)> = known.map(|(component, share)| (*component, *share)).collect();
        let probability = known.iter().find(|(known, _)| *known == blamed).map(|(_, share)| *share);
        let is_other = |(other, _): &&(Component, f64)| {
            *other != component && *other != blamed && !self.certain.contains(other)
        };
        let next = known.iter().filter(is_other).copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
        Blame { component, cause, probability, next, relapses: 0 }
    }

    /// The cause by which the best candidate that accuses a signal does so.
    fn cause_of(&self, component: Component) -> Option<CauseId> {
        let Component::Signal(signal) = component else { return None };
        let place = self.candidates.iter().position(|accused| accused.contains(&component))?;
        let candidate = self.part.candidates.get(place)?;
        if candidate.components.contains(&component) {
            return None;
        }
        candidate.components.iter().find_map(|other| match other {
            Component::Cause(cause) if self.beliefs.shares(signal, *cause) => Some(*cause),
            _ => None,
        })
    }
}

/// Whether what a signal says has ever changed: of what never does it means nothing that it stands still.
fn has_moved(monitor: &Monitor, component: Component) -> bool {
    matches!(component, Component::Signal(signal) if monitor.frozen(signal).has_moved())
}

/// What a signal says now, when it is a number.
fn said(monitor: &Monitor, component: Component) -> Option<Interval> {
    let Component::Signal(signal) = component else { return None };
    monitor.ports()[signal].newest().map(|sample| sample.value)
}
