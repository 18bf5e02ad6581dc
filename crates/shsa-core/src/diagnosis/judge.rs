//! The verdict on each signal and relation over time: suspect, failed, and trusted again.
//!
//! Something has failed when it belongs to every explanation that is probable enough beside the best one, whatever the
//! comparisons that are still undecided, or only just agree, will say. For the rest of these explanations, the judge first
//! waits for the comparisons that may yet decide, for a bounded time; then it is suspect. Where what signals share explains
//! the conflicts, these signals are blamed together. What has failed explains is no evidence about others. A signal is
//! trusted again after it has moved and every comparison that speaks about it has agreed for the probation time; a relation,
//! when these comparisons agree. Without a comparison there is no verdict: unknown is not healthy.

mod evidence;
mod orders;

use super::explain::{Comparison, Component, Part, explain, probabilities};
use crate::interval::Interval;
use crate::knowledge::{CauseId, IdVec, KnowledgeBase, Lineage, RelationId, SignalId, SignalSet};
use crate::monitor::{Inheritance, Monitor, Pair, Relationship, WatchedWay};
use crate::time::{Span, Time};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use core::cell::OnceCell;
use core::ops::Bound;
use evidence::{Dispute, Priors, rests_on_any};

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
    Recovered(SignalId, Span),
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
struct Standing {
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
    /// Its own readings have shown the fault: no comparison is needed to accuse or to clear it.
    convicted: bool,
    /// The operator vouches for it.
    vouched: bool,
}

/// Decides on signals and relations from the pairs of a monitor.
#[derive(Debug)]
pub struct Judge {
    options: JudgeOptions,
    priors: Priors,
    /// What stands for each signal and all that it is derived from.
    origins: IdVec<SignalId, SignalSet>,
    /// Of everything that was ever accused.
    standings: BTreeMap<Component, Standing>,
    /// What nothing may rest on, by order.
    forbidden: BTreeSet<Component>,
    /// What has failed by its verdict or is forbidden: comparisons with it say nothing about others.
    discounted: BTreeSet<Component>,
    /// Signals whose own readings have shown a fault since the last review, ascending.
    convicted: BTreeSet<Component>,
    /// When to look again without a change of evidence.
    next_review: Option<Time>,
}

impl Judge {
    /// For the signals and relations of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, options: JudgeOptions) -> Judge {
        Judge {
            options,
            priors: Priors::new(knowledge, &options),
            origins: IdVec::filled(knowledge.signals().len(), |signal| {
                knowledge.as_witnesses(knowledge.origins(signal))
            }),
            standings: BTreeMap::new(),
            forbidden: BTreeSet::new(),
            discounted: BTreeSet::new(),
            convicted: BTreeSet::new(),
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
        for (&component, standing) in &old.standings {
            let id = match component {
                Component::Signal(id) => id,
                Component::Relation(id) => {
                    let Some(same) = lineage.relation(id).map(Component::Relation) else { continue };
                    match monitor.pairs().iter().any(|pair| rests_on(monitor, pair, same)) {
                        true => self.put(same, *standing),
                        false if standing.verdict.is_some() => dropped.push((same, false)),
                        false => {}
                    }
                    continue;
                }
                Component::Cause(_) => continue,
            };
            let Some(namesake) = lineage.namesake(id) else { continue };
            match lineage.signal(id) {
                Some(signal)
                    if standing.verdict.is_none()
                        || standing.convicted
                        || inheritance.compared.contains(signal) =>
                {
                    self.put(Component::Signal(signal), *standing);
                    if standing.convicted && !inheritance.is_whole {
                        // What contradicted it may be gone.
                        self.next_review = Some(Time::MIN);
                    }
                }
                same if standing.verdict.is_some() => {
                    dropped.push((Component::Signal(namesake), same.is_none()));
                }
                _ => {}
            }
        }
        dropped
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

    /// Relations that are suspect, failed or forbidden, ascending: nothing may rest on them.
    #[must_use]
    pub fn distrusted_relations(&self) -> Vec<RelationId> {
        let accused = self.standings.iter().filter(|(_, standing)| standing.verdict.is_some());
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
        self.standing(Component::Signal(signal)).clean_since
    }

    fn standing(&self, component: Component) -> Standing {
        self.standings.get(&component).copied().unwrap_or_default()
    }

    fn put(&mut self, component: Component, standing: Standing) {
        self.standings.insert(component, standing);
        match standing.verdict == Some(Verdict::Failed) || self.forbidden.contains(&component) {
            true => self.discounted.insert(component),
            false => self.discounted.remove(&component),
        };
    }

    /// Notes since when all evidence speaks for something, without allocation.
    fn note(&mut self, component: Component, clean_since: Option<Time>) {
        if let Some(standing) = self.standings.get_mut(&component) {
            standing.clean_since = clean_since;
        }
    }

    /// Suspect or failed.
    fn accusation(&self, component: Component) -> Option<Verdict> {
        self.standings.get(&component).and_then(|standing| standing.verdict)
    }

    /// How long all evidence must speak for a signal before it is trusted again; each relapse doubles it.
    #[must_use]
    pub fn probation_of(&self, signal: SignalId) -> Span {
        self.probation(self.standing(Component::Signal(signal)).relapses)
    }

    /// Whether a signal that is suspect or failed still says exactly what it said when it was accused.
    #[must_use]
    pub fn stands_still(&self, component: Component, monitor: &Monitor) -> bool {
        let before = self.standing(component).said;
        before.is_some() && before == said(monitor, component)
    }

    /// What is thought of a signal now.
    #[must_use]
    pub fn verdict(&self, signal: SignalId, monitor: &Monitor, now: Time) -> Verdict {
        let witnessed = || {
            monitor.pairs_of(signal).any(|pair| {
                pair.relationship(now) == Relationship::Agree
                    && self.bears_witness(monitor, pair, Component::Signal(signal))
            })
        };
        match self.accusation(Component::Signal(signal)) {
            Some(verdict) => verdict,
            None if self.standing(Component::Signal(signal)).vouched || witnessed() => Verdict::Healthy,
            None => Verdict::Unknown,
        }
    }

    /// Whether one way of a pair rests on the signal, the other on nothing that the signal comes from, and nothing that
    /// has failed is in it. About a relation, each pair that rests on it does.
    fn bears_witness(&self, monitor: &Monitor, pair: &Pair, component: Component) -> bool {
        if self.is_explained(monitor, pair, Some(component)) {
            return false;
        }
        let Component::Signal(signal) = component else { return rests_on(monitor, pair, component) };
        let rests = |index| monitor.way(index).map(|way| &way.rests_on);
        let (Some(one), Some(other)) = (rests(pair.way), rests(pair.other)) else { return false };
        let origins = &self.origins[signal];
        (one.contains(signal) && !other.meets(origins)) || (other.contains(signal) && !one.meets(origins))
    }

    /// A signal's own readings show that it is faulty, so that what it is compared with is not to blame. It is trusted again
    /// after its readings and every comparison with it have spoken for it for the probation time. Whether that is news.
    pub fn convict(&mut self, signal: SignalId, now: Time) -> bool {
        let component = Component::Signal(signal);
        let before = self.standing(component);
        if before.verdict == Some(Verdict::Failed) {
            self.note(component, None);
            return false;
        }
        let relapses = self.relapses(component, now);
        let verdict = Some(Verdict::Failed);
        let convicted = Standing {
            verdict,
            alone: true,
            relapses,
            cleared: before.cleared,
            convicted: true,
            ..Standing::default()
        };
        self.put(component, convicted);
        self.convicted.insert(component);
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
        let conflicts: Vec<&Pair> = self.open_pairs(monitor, now, Relationship::Conflict).collect();
        if conflicts.is_empty() {
            return;
        }
        let comparisons = self.comparisons(monitor, now, &conflicts);
        let parts = explain(&comparisons, |component| self.priors.of(component));
        let mut disputed = conflicts.clone();
        disputed.extend(self.open_pairs(monitor, now, Relationship::Undecided));
        // Of faults that grow, the witness with the least tolerance tells first: the others only just agree yet.
        let agreements = self.open_pairs(monitor, now, Relationship::Agree);
        disputed.extend(agreements.filter(|pair| pair.is_close()));
        let rivals = match disputed.len() == conflicts.len() {
            true => parts.clone(),
            false => explain(&self.comparisons(monitor, now, &disputed), |it| self.priors.of(it)),
        };
        let case = |part| Case::new(&self.priors, &comparisons, part, &rivals);
        let cases: Vec<Case> = parts.iter().map(case).collect();
        for case in &cases {
            for &component in &case.certain {
                self.set((monitor, now), component, case, None, decisions);
            }
        }
        for case in &cases {
            self.suspect((monitor, now), case, &conflicts, decisions);
        }
    }

    fn suspect(
        &mut self,
        (monitor, now): (&Monitor, Time),
        case: &Case<'_>,
        conflicts: &[&Pair],
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
        let latency = |pair: &Pair| if gradual { pair.latency() } else { pair.window.latency() };
        let is_open = |pair: &&Pair| {
            let may_decide = match pair.relationship(now) {
                Relationship::Undecided => true,
                Relationship::Agree => {
                    (gradual && pair.is_building()) || pair.is_close() || !pair.window.confirmed_since(onset)
                }
                Relationship::Conflict | Relationship::Unknown => false,
            };
            may_decide && rests_on_any(monitor, pair, accused) && !self.is_explained(monitor, pair, None)
        };
        let open = || monitor.pairs().iter().filter(is_open);
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
        let before = self.standing(component);
        if before.verdict >= Some(verdict) {
            return;
        }
        let relapses = self.relapses(component, now);
        let standing = Standing {
            verdict: Some(verdict),
            alone: choice.is_none_or(|choice| choice.len() == 1),
            clean_since: None,
            said: said(monitor, component),
            relapses,
            cleared: before.cleared,
            convicted: false,
            vouched: false,
        };
        self.put(component, standing);
        let blame = Blame { relapses, ..case.blame(&self.priors, component) };
        decisions.push(match choice {
            None => Decision::Failed(blame),
            Some(choice) => Decision::Suspected(blame, choice.to_vec()),
        });
    }

    /// How often in a row something has been accused soon after it was trusted again, when it is accused now.
    fn relapses(&self, component: Component, now: Time) -> u32 {
        let before = self.standing(component);
        let soon = |cleared: Time| now - cleared <= self.probation(before.relapses).times(RELAPSE_PROBATIONS);
        match (before.verdict, before.cleared) {
            (Some(_), _) => before.relapses,
            (None, Some(cleared)) if soon(cleared) => (before.relapses + 1).min(MOST_RELAPSES),
            _ => 0,
        }
    }

    fn clear(&mut self, monitor: &Monitor, now: Time, decisions: &mut Vec<Decision>) {
        let culprit = |decision: &Decision| match decision {
            Decision::Failed(blame) => Some(blame.component),
            Decision::Suspected(..) | Decision::Cleared(_) | Decision::Recovered(..) => None,
        };
        let mut culprits = core::mem::take(&mut self.convicted);
        culprits.extend(decisions.iter().filter_map(culprit));
        let mut next = self.standings.keys().next().copied();
        while let Some(component) = next {
            let after = (Bound::Excluded(component), Bound::Unbounded);
            next = self.standings.range(after).next().map(|(component, _)| *component);
            let Some(verdict) = self.accusation(component) else { continue };
            let before = self.standing(component);
            if !self.is_clean(monitor, component, now) {
                self.note(component, None);
                if before.convicted {
                    self.await_staleness(monitor, component, now);
                }
                continue;
            }
            let since = before.clean_since.unwrap_or(now);
            // Only a culprit that it was compared with explains why it was suspected.
            let compared =
                |pair: &Pair| rests_on(monitor, pair, component) && rests_on_any(monitor, pair, &culprits);
            let explained = verdict == Verdict::Suspect && monitor.pairs().iter().any(compared);
            let probation = self.probation(before.relapses);
            let over = since + probation;
            if explained || now >= over {
                let relapses = before.relapses;
                self.put(component, Standing { cleared: Some(now), relapses, ..Standing::default() });
                decisions.push(match component {
                    Component::Signal(signal) if before.convicted => Decision::Recovered(signal, probation),
                    _ => Decision::Cleared(component),
                });
            } else {
                self.note(component, Some(since));
                self.look_again(over);
            }
        }
    }

    fn probation(&self, relapses: u32) -> Span {
        self.options.probation.times(1 << relapses.min(MOST_RELAPSES))
    }

    /// Whether a signal has moved since it was accused, every comparison that speaks about it agrees, there is one (unless
    /// its own readings have accused it), and its readings are sound.
    fn is_clean(&self, monitor: &Monitor, component: Component, now: Time) -> bool {
        if self.stands_still(component, monitor) {
            return false;
        }
        let mut witnessed = self.standing(component).convicted;
        for pair in monitor.pairs() {
            if !rests_on(monitor, pair, component) || self.is_explained(monitor, pair, Some(component)) {
                continue;
            }
            match pair.relationship(now) {
                Relationship::Unknown => {}
                Relationship::Agree => witnessed |= self.bears_witness(monitor, pair, component),
                Relationship::Undecided | Relationship::Conflict => return false,
            }
        }
        let is_sound = match component {
            Component::Signal(signal) => {
                let watch = monitor.watch();
                let is_heard = watch.absence(signal).is_none() && watch.has_spoken(signal);
                is_heard && monitor.detectors().fault(signal).is_none()
            }
            Component::Relation(_) | Component::Cause(_) => true,
        };
        witnessed && is_sound
    }

    /// Looks again when the first comparison with a signal that needs no witness is stale.
    fn await_staleness(&mut self, monitor: &Monitor, component: Component, now: Time) {
        let pairs = monitor.pairs().iter().filter(|pair| rests_on(monitor, pair, component));
        let stale = pairs.filter_map(|pair| pair.window.stale_at()).filter(|at| *at > now).min();
        stale.into_iter().for_each(|at| self.look_again(at));
    }

    /// Asks for a review at a moment.
    pub fn look_again(&mut self, at: Time) {
        self.next_review = Some(self.next_review.map_or(at, |earlier| earlier.min(at)));
    }

    /// Whether something disagrees with something else than what was accused alone.
    fn disagrees_otherwise(&self, monitor: &Monitor, component: Component, conflicts: &[&Pair]) -> bool {
        let alone = || self.standings.iter().filter(|(_, standing)| standing.alone).map(|(alone, _)| *alone);
        let is_claimed =
            |pair: &Pair| alone().any(|other| other != component && rests_on(monitor, pair, other));
        conflicts.iter().any(|pair| rests_on(monitor, pair, component) && !is_claimed(pair))
    }
}

/// A part of the conflicts, and what follows from it.
struct Case<'p> {
    comparisons: &'p [Comparison],
    part: &'p Part,
    /// The signals and relations of each candidate, best first.
    candidates: Vec<BTreeSet<Component>>,
    /// The same with all that is undecided taken for conflicts.
    rivals: Vec<BTreeSet<Component>>,
    /// What is in all of these.
    certain: BTreeSet<Component>,
    /// In the order of the part's components; looked for only where something is decided.
    probabilities: OnceCell<Option<Vec<f64>>>,
}

impl<'p> Case<'p> {
    fn new(priors: &Priors, comparisons: &'p [Comparison], part: &'p Part, rivals: &[Part]) -> Case<'p> {
        let accused = |part: &Part| -> Vec<BTreeSet<Component>> {
            part.candidates.iter().map(|candidate| priors.accused(&candidate.components)).collect()
        };
        let first = part.components.first();
        let is_of = |rival: &&Part| first.is_some_and(|first| rival.components.binary_search(first).is_ok());
        let (candidates, rivals) =
            (accused(part), rivals.iter().find(is_of).map(accused).unwrap_or_default());
        let mut certain = candidates.first().cloned().unwrap_or_default();
        certain.retain(|component| candidates.iter().chain(&rivals).all(|set| set.contains(component)));
        Case { comparisons, part, candidates, rivals, certain, probabilities: OnceCell::new() }
    }

    /// Everything that is in a candidate.
    fn accused(&self) -> BTreeSet<Component> {
        self.candidates.iter().flatten().copied().collect()
    }

    /// What is in a candidate that may stay one, however the undecided turns out.
    fn likely(&self) -> BTreeSet<Component> {
        let stays = |set: &&BTreeSet<Component>| self.rivals.iter().any(|rival| rival.is_superset(set));
        self.candidates.iter().filter(stays).flatten().copied().collect()
    }

    fn blame(&self, priors: &Priors, component: Component) -> Blame {
        let cause = self.cause_of(priors, component);
        let blamed = cause.map_or(component, Component::Cause);
        let find = || probabilities(self.comparisons, self.part, |component| priors.of(component));
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
    fn cause_of(&self, priors: &Priors, component: Component) -> Option<CauseId> {
        let Component::Signal(signal) = component else { return None };
        let place = self.candidates.iter().position(|accused| accused.contains(&component))?;
        let candidate = self.part.candidates.get(place)?;
        if candidate.components.contains(&component) {
            return None;
        }
        candidate.components.iter().find_map(|other| match other {
            Component::Cause(cause) if priors.shares(signal, *cause) => Some(*cause),
            _ => None,
        })
    }
}

/// What a signal says now, when it is a number.
fn said(monitor: &Monitor, component: Component) -> Option<Interval> {
    let Component::Signal(signal) = component else { return None };
    monitor.ports()[signal].newest().map(|sample| sample.value)
}
