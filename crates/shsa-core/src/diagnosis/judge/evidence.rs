//! The residuals of a monitor as comparisons of components, with prior probabilities of their faults.

use super::power::{common_ancestors, has_power, reach, shows_a_step};
use super::{Component, EvidenceView, Judge, JudgeOptions, latest_value};
use crate::diagnosis::candidates::Comparison;
use crate::knowledge::{CauseId, IdVec, KnowledgeBase, PRIOR, RelationId, SignalId, SignalSet};
use crate::monitor::{Residual, ResidualState, WatchedWay, WayIndex};
use crate::numbers::{COINCIDES, HIGHEST_RAISED, RECENT};
use crate::time::{Span, Time};
use crate::trust::Ledger;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::sync::Arc;
use alloc::vec::Vec;

/// The prior probabilities of faults, and which signals share which causes.
#[derive(Debug)]
pub(super) struct Priors {
    signals: IdVec<SignalId, f64>,
    /// The relations whose properties give a prior.
    relations: BTreeMap<RelationId, f64>,
    relation: f64,
    causes: IdVec<CauseId, f64>,
    /// The signals that share each cause, ascending.
    sharing: IdVec<CauseId, Vec<SignalId>>,
    /// The causes of each signal that shares one.
    shared: BTreeMap<SignalId, Vec<CauseId>>,
}

impl Priors {
    pub(super) fn new(knowledge: &KnowledgeBase, options: &JudgeOptions) -> Priors {
        let of_signal = |signal: SignalId| {
            knowledge.signals()[signal].properties.get(PRIOR).copied().unwrap_or(options.prior)
        };
        let own = knowledge.relations().enumerate();
        let own = own.filter_map(|(id, relation)| Some((id, *relation.properties.get(PRIOR)?)));
        let mut shared: BTreeMap<SignalId, Vec<CauseId>> = BTreeMap::new();
        for (id, cause) in knowledge.causes().enumerate() {
            cause.signals.iter().for_each(|&signal| shared.entry(signal).or_default().push(id));
        }
        Priors {
            signals: IdVec::filled(knowledge.signals().len(), of_signal),
            relations: own.collect(),
            relation: options.relation_prior,
            causes: IdVec::filled(knowledge.causes().len(), |id| knowledge.causes()[id].prior),
            sharing: IdVec::filled(knowledge.causes().len(), |id| knowledge.causes()[id].signals.clone()),
            shared,
        }
    }

    pub(super) fn of(&self, component: Component) -> f64 {
        match component {
            Component::Signal(signal) => self.signals[signal],
            Component::Cause(cause) => self.causes[cause],
            Component::Relation(relation) => self.relations.get(&relation).copied().unwrap_or(self.relation),
        }
    }

    /// The signals and relations of some components: for a cause, the signals that share it.
    pub(super) fn accused(&self, components: &[Component]) -> BTreeSet<Component> {
        let mut all = BTreeSet::new();
        for &component in components {
            match component {
                Component::Cause(cause) => {
                    all.extend(self.sharing[cause].iter().copied().map(Component::Signal));
                }
                _ => _ = all.insert(component),
            }
        }
        all
    }

    /// Whether a signal shares a cause.
    pub(super) fn shares(&self, signal: SignalId, cause: CauseId) -> bool {
        self.sharing[cause].binary_search(&signal).is_ok()
    }

    /// The signals that share a cause, ascending.
    pub(super) fn sharing(&self, cause: CauseId) -> &[SignalId] {
        &self.sharing[cause]
    }

    /// A signal with its causes.
    fn with_causes(&self, signal: SignalId) -> impl Iterator<Item = Component> + '_ {
        let causes = self.shared.get(&signal).into_iter().flatten().copied().map(Component::Cause);
        core::iter::once(Component::Signal(signal)).chain(causes)
    }

    /// The components from which the value of a way is computed, without the signals that do not count.
    fn sized_by(&self, way: &WatchedWay, without: &SignalSet) -> BTreeSet<Component> {
        let signals = way.rests_on.iter();
        let signals =
            signals.filter(|signal| !way.conditions.contains(*signal) && !without.contains(*signal));
        let relations = way.computation.way().substitution.relations();
        let signals = signals.flat_map(|signal| self.with_causes(signal));
        signals.chain(relations.into_iter().map(Component::Relation)).collect()
    }

    /// A comparison is about no signal from which both ways only descend: its fault would move both alike.
    fn comparison(&self, one: &WatchedWay, other: &WatchedWay, agrees: bool) -> Comparison {
        let ancestors = common_ancestors(one, other);
        let read = one.conditions.iter().chain(other.conditions.iter());
        let mut conditions: BTreeSet<Component> = read.flat_map(|signal| self.with_causes(signal)).collect();
        let (one, other) = (self.sized_by(one, &ancestors), self.sized_by(other, &ancestors));
        conditions.retain(|component| !one.contains(component) && !other.contains(component));
        Comparison { one, other, conditions, agrees }
    }
}

/// The priors of the components before the comparisons are weighed, adapted by the faults found so far.
#[derive(Debug)]
pub(super) struct Beliefs {
    priors: Arc<Priors>,
    /// The causes of which a signal has failed already, with the factor of their priors.
    shown: BTreeMap<CauseId, f64>,
    /// The failed signals among those that share these causes.
    failed: Vec<SignalId>,
}

impl Beliefs {
    pub(super) fn of(&self, component: Component) -> f64 {
        let prior = self.priors.of(component);
        match component {
            Component::Cause(cause) => match self.shown.get(&cause) {
                Some(factor) => (prior * factor).min(HIGHEST_RAISED.max(prior)),
                None => prior,
            },
            Component::Signal(_) | Component::Relation(_) => prior,
        }
    }
}

impl core::ops::Deref for Beliefs {
    type Target = Priors;

    fn deref(&self) -> &Priors {
        &self.priors
    }
}

impl Judge {
    /// The beliefs about the components of some conflicts. A failed signal makes its common causes more probable, less so the
    /// longer ago it failed: the other signals of the cause would have failed since.
    pub(super) fn beliefs(&self, ledger: &Ledger, now: Time, conflicts: &[&Residual]) -> Beliefs {
        let mut beliefs = Beliefs { priors: self.priors.clone(), shown: BTreeMap::new(), failed: Vec::new() };
        let has_failed = |signal: &&SignalId| ledger.has_failed(**signal);
        let mut onsets: BTreeMap<CauseId, Time> = BTreeMap::new();
        for pair in conflicts {
            let onset = pair.onset(now);
            let causes = pair.signals.iter().filter_map(|signal| self.priors.shared.get(&signal)).flatten();
            for cause in causes {
                onsets.entry(*cause).and_modify(|first| *first = onset.min(*first)).or_insert(onset);
            }
        }
        for (cause, onset) in onsets {
            let failed = self.priors.sharing(cause).iter().filter(has_failed);
            beliefs.failed.extend(failed.clone());
            let since =
                |signal: &SignalId| ledger.accused(Component::Signal(*signal)).and_then(|it| it.since);
            let accused = failed.map(since);
            let Some(last) = accused.max() else { continue };
            let ago = last.map_or(Span::MAX, |last| (onset - last).max(RECENT));
            beliefs.shown.insert(cause, COINCIDES * (RECENT.seconds() / ago.seconds()));
        }
        beliefs.failed.sort_unstable();
        beliefs.failed.dedup();
        beliefs
    }

    /// The conflicts, with the agreements about the components in them.
    pub(super) fn comparisons(
        &self,
        ledger: &Ledger,
        evidence: &impl EvidenceView,
        now: Time,
        conflicts: &[&Residual],
        beliefs: &Beliefs,
    ) -> Vec<Comparison> {
        let mut disputed = SignalSet::new();
        conflicts.iter().for_each(|pair| disputed.extend(&pair.signals));
        // A change of a value shows no constant error of it.
        let looks_at_changes =
            |index: WayIndex| evidence.way(index).is_some_and(|way| way.computation.is_rate());
        // A way that has not yet drifted far enough to disagree is no agreement.
        let gradual = conflicts.iter().any(|pair| is_gradual(pair, now));
        // Some of the conflicts may still agree: they are not taken twice.
        let is_taken =
            |pair: &Residual| conflicts.iter().any(|it| (it.way, it.other) == (pair.way, pair.other));
        let agreements = open_pairs(ledger, evidence, now, ResidualState::Agree)
            .filter(|pair| !is_taken(pair))
            .filter(|pair| !(gradual && pair.is_building()) && pair.signals.meets(&disputed))
            .filter(|pair| !looks_at_changes(pair.way) && !looks_at_changes(pair.other));
        let agreements = agreements.filter(|pair| has_power(evidence, pair));
        let conflicts = conflicts.iter().map(|pair| (*pair, false));
        let all = conflicts.chain(agreements.map(|pair| (pair, true)));
        let compared = all.filter_map(|(pair, agrees)| {
            let (one, other) = (evidence.way(pair.way)?, evidence.way(pair.other)?);
            Some(self.priors.comparison(one, other, agrees))
        });
        // A failed signal is faulty by itself or by one of its causes.
        let failed = beliefs.failed.iter().map(|&signal| Comparison {
            one: self.priors.with_causes(signal).collect(),
            other: BTreeSet::new(),
            conditions: BTreeSet::new(),
            agrees: false,
        });
        compared.chain(failed).collect()
    }

    /// Whether one way of a pair is computed from the signal, the other way rests on none of its origins, and no failed component
    /// is in the pair. For a relation: whether the pair rests on it.
    pub(super) fn bears_witness(
        &self,
        ledger: &Ledger,
        evidence: &impl EvidenceView,
        pair: &Residual,
        component: Component,
    ) -> bool {
        if is_explained(ledger, evidence, pair, Some(component)) {
            return false;
        }
        let Component::Signal(signal) = component else { return rests_on(evidence, pair, component) };
        let (Some(one), Some(other)) = (evidence.way(pair.way), evidence.way(pair.other)) else {
            return false;
        };
        if other.is_range() {
            return false;
        }
        let origins = &self.origins[signal];
        let beside =
            |own: &WatchedWay, other: &WatchedWay| own.is_sized_by(signal) && !other.rests_on.meets(origins);
        beside(one, other) || beside(other, one)
    }
}

/// Whether a pair in conflict accuses a component: no other failed component, and none suspected alone, explains the conflict.
#[must_use]
pub fn speaks_against(
    ledger: &Ledger,
    evidence: &impl EvidenceView,
    pair: &Residual,
    component: Component,
) -> bool {
    !is_explained(ledger, evidence, pair, Some(component)) && !is_claimed(ledger, evidence, pair, component)
}

/// The pairs in a state that no failed component explains. O(restless pairs) for pairs that do not agree.
pub(super) fn open_pairs<'s, 'm: 's>(
    ledger: &'s Ledger,
    evidence: &'m impl EvidenceView,
    now: Time,
    residual_state: ResidualState,
) -> impl Iterator<Item = &'m Residual> + 's {
    let disagree = matches!(residual_state, ResidualState::Conflict | ResidualState::Undecided);
    let restless = disagree.then(|| evidence.restless());
    let all = (!disagree).then(|| evidence.pairs());
    let pairs = restless.into_iter().flatten().chain(all.into_iter().flatten());
    pairs.filter(move |pair| {
        pair.residual_state(now) == residual_state
            && !is_explained(ledger, evidence, pair, None)
            && !(disagree && is_of_the_past(ledger, evidence, pair, now))
    })
}

/// Whether another component that was accused alone is in a pair.
pub(super) fn is_claimed(
    ledger: &Ledger,
    evidence: &impl EvidenceView,
    pair: &Residual,
    component: Component,
) -> bool {
    let mut alone = ledger.all_accused().filter(|(other, it)| it.is_alone && *other != component);
    alone.any(|(other, _)| rests_on(evidence, pair, other))
}

/// Whether a signal that is suspect or failed, and usually moves, has repeated its value since it was accused.
#[must_use]
pub fn stands_still(ledger: &Ledger, component: Component, evidence: &impl EvidenceView, now: Time) -> bool {
    let (Some(accused), Component::Signal(signal)) = (ledger.accused(component), component) else {
        return false;
    };
    accused.latest_value.is_some()
        && accused.latest_value == latest_value(evidence, component)
        && evidence.frozen(signal).is_still_since(accused.since.unwrap_or(Time::MAX), now)
}

/// Whether a pair still holds values of a component from before it was sound again: these are no evidence about others.
fn is_of_the_past(ledger: &Ledger, evidence: &impl EvidenceView, pair: &Residual, now: Time) -> bool {
    let mut recovered = ledger.recovered().peekable();
    if recovered.peek().is_none() {
        return false;
    }
    let reach = reach(evidence, pair);
    recovered.any(|(component, since)| now - since < reach && rests_on(evidence, pair, component))
}

/// Whether a component other than `except` that has failed, or is forbidden, is in the pair.
pub(super) fn is_explained(
    ledger: &Ledger,
    evidence: &impl EvidenceView,
    pair: &Residual,
    except: Option<Component>,
) -> bool {
    ledger.discounted().iter().any(|&it| Some(it) != except && rests_on(evidence, pair, it))
}

/// Whether one of the ways of a pair rests on a signal or a relation.
#[must_use]
pub fn rests_on(evidence: &impl EvidenceView, pair: &Residual, component: Component) -> bool {
    match component {
        Component::Signal(signal) => pair.signals.contains(signal),
        _ => relies(evidence, pair.way, component) || relies(evidence, pair.other, component),
    }
}

/// Whether a way rests on a signal or a relation.
fn relies(evidence: &impl EvidenceView, way: WayIndex, component: Component) -> bool {
    let Some(way) = evidence.way(way) else { return false };
    match component {
        Component::Signal(signal) => way.rests_on.contains(signal),
        Component::Relation(relation) => {
            way.computation.way().substitution.steps.iter().any(|step| step.relation == relation)
        }
        Component::Cause(_) => false,
    }
}

/// Whether the outcome of a pair can tell several of the accused apart: the pair is evidence about some of them, and not about
/// all. An agreement is no evidence about a component on which both ways rest, as its fault may change both alike.
pub(super) fn tells_apart(
    evidence: &impl EvidenceView,
    now: Time,
    pair: &Residual,
    accused: &BTreeSet<Component>,
) -> bool {
    let agrees = pair.residual_state(now) == ResidualState::Agree;
    let is_about = |component: &&Component| {
        let (one, other) =
            (relies(evidence, pair.way, **component), relies(evidence, pair.other, **component));
        if agrees { one != other } else { one || other }
    };
    let about = accused.iter().filter(is_about).count();
    accused.len() < 2 || (about > 0 && about < accused.len())
}

/// What the conflicts about some of the accused have in common.
pub(super) struct Dispute {
    /// When the first of these conflicts began.
    pub(super) onset: Time,
    /// When the first of these conflicts began, counting the conflicts that have come and gone since.
    pub(super) since: Time,
    /// Whether one of these conflicts has built up gradually.
    pub(super) gradual: bool,
    /// How long these conflicts show a step of the faulty component.
    pub(super) shows: Span,
    /// How long the slowest of these conflicts takes to show.
    pub(super) own_latency: Span,
}

impl Dispute {
    /// The dispute about the accused; `None` where no conflict involves them.
    pub(super) fn about(
        evidence: &impl EvidenceView,
        conflicts: &[&Residual],
        accused: &BTreeSet<Component>,
        now: Time,
    ) -> Option<Dispute> {
        let about = || conflicts.iter().filter(|pair| rests_on_any(evidence, pair, accused));
        Some(Dispute {
            onset: about().map(|pair| pair.onset(now)).min()?,
            since: about().map(|pair| pair.recurs_since(now)).min()?,
            gradual: about().any(|pair| is_gradual(pair, now)),
            shows: about().map(|pair| shows_a_step(evidence, pair)).max()?,
            own_latency: about().map(|pair| pair.latency()).max()?,
        })
    }
}

/// Whether a conflict has built up from many comparisons of which each agrees.
fn is_gradual(conflict: &Residual, now: Time) -> bool {
    conflict.window.residual_state(now) != ResidualState::Conflict
}

/// Whether one of the ways of a pair rests on one of the components.
pub(super) fn rests_on_any(
    evidence: &impl EvidenceView,
    pair: &Residual,
    components: &BTreeSet<Component>,
) -> bool {
    components.iter().any(|&component| rests_on(evidence, pair, component))
}
