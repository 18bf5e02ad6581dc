//! What the pairs of a monitor say, as comparisons of components.

use super::{Component, Judge, JudgeOptions};
use crate::diagnosis::explain::Comparison;
use crate::knowledge::{CauseId, IdVec, KnowledgeBase, RelationId, SignalId, SignalSet};
use crate::monitor::{Monitor, Pair, Relationship, WatchedWay, WayIndex};
use crate::time::{Span, Time};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// What the judge knows of the components beforehand.
#[derive(Debug)]
pub(super) struct Priors {
    signals: IdVec<SignalId, f64>,
    /// Of relations that give one themselves.
    relations: BTreeMap<RelationId, f64>,
    relation: f64,
    causes: IdVec<CauseId, f64>,
    /// Who shares each cause.
    sharing: IdVec<CauseId, Vec<SignalId>>,
    /// What signals share, where they share something.
    shared: BTreeMap<SignalId, Vec<CauseId>>,
}

impl Priors {
    pub(super) fn new(knowledge: &KnowledgeBase, options: &JudgeOptions) -> Priors {
        let of_signal = |signal: SignalId| {
            knowledge.signals()[signal].properties.get("prior").copied().unwrap_or(options.prior)
        };
        let own = knowledge.relations().enumerate();
        let own = own.filter_map(|(id, relation)| Some((id, *relation.properties.get("prior")?)));
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

    /// The signals and relations of some components: of a cause, the signals that share it.
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

    fn rests_on(&self, way: &WatchedWay) -> BTreeSet<Component> {
        let causes = |signal: SignalId| self.shared.get(&signal).into_iter().flatten().copied();
        let causes = way.rests_on.iter().flat_map(causes).map(Component::Cause);
        let signals = way.rests_on.iter().map(Component::Signal);
        let relations = way.computation.way().substitution.relations();
        signals.chain(causes).chain(relations.into_iter().map(Component::Relation)).collect()
    }
}

impl Judge {
    /// Conflicts, with the agreements that speak about what is in them.
    pub(super) fn comparisons(&self, monitor: &Monitor, now: Time, conflicts: &[&Pair]) -> Vec<Comparison> {
        let mut disputed = SignalSet::new();
        conflicts.iter().for_each(|pair| disputed.extend(&pair.signals));
        // How a value changes does not show a constant error.
        let looks_at_changes =
            |index: WayIndex| monitor.way(index).is_some_and(|way| way.computation.is_rate());
        // Who has not yet drifted far enough to disagree does not agree.
        let gradual = conflicts.iter().any(|pair| is_gradual(pair, now));
        // Some of them may agree yet.
        let is_taken = |pair: &Pair| conflicts.iter().any(|it| (it.way, it.other) == (pair.way, pair.other));
        let agreements = self
            .open_pairs(monitor, now, Relationship::Agree)
            .filter(|pair| !is_taken(pair))
            .filter(|pair| !(gradual && pair.is_building()) && pair.signals.meets(&disputed))
            .filter(|pair| !looks_at_changes(pair.way) && !looks_at_changes(pair.other));
        let conflicts = conflicts.iter().map(|pair| (*pair, false));
        let all = conflicts.chain(agreements.map(|pair| (pair, true)));
        all.filter_map(|(pair, agrees)| {
            let (one, other) = (monitor.way(pair.way)?, monitor.way(pair.other)?);
            let (one, other) = (self.priors.rests_on(one), self.priors.rests_on(other));
            Some(Comparison { one, other, agrees })
        })
        .collect()
    }

    /// Pairs in a relationship that nothing that has failed explains. O(restless pairs) for those that do not agree.
    pub(super) fn open_pairs<'s, 'm: 's>(
        &'s self,
        monitor: &'m Monitor,
        now: Time,
        relationship: Relationship,
    ) -> impl Iterator<Item = &'m Pair> + 's {
        let disagree = matches!(relationship, Relationship::Conflict | Relationship::Undecided);
        let restless = disagree.then(|| monitor.restless());
        let all = (!disagree).then(|| monitor.pairs());
        let pairs = restless.into_iter().flatten().chain(all.into_iter().flatten());
        pairs.filter(move |pair| {
            pair.relationship(now) == relationship && !self.is_explained(monitor, pair, None)
        })
    }

    /// Whether something else than `except` that has failed, or is forbidden, is in the pair.
    pub(super) fn is_explained(&self, monitor: &Monitor, pair: &Pair, except: Option<Component>) -> bool {
        self.discounted.iter().any(|&it| Some(it) != except && rests_on(monitor, pair, it))
    }
}

/// Whether one of the ways of a pair rests on a signal or a relation.
#[must_use]
pub fn rests_on(monitor: &Monitor, pair: &Pair, component: Component) -> bool {
    let relies = |index: WayIndex, relation: RelationId| {
        let way = monitor.way(index).map(|way| way.computation.way());
        way.is_some_and(|way| way.substitution.steps.iter().any(|step| step.relation == relation))
    };
    match component {
        Component::Signal(signal) => pair.signals.contains(signal),
        Component::Relation(relation) => relies(pair.way, relation) || relies(pair.other, relation),
        Component::Cause(_) => false,
    }
}

/// What the conflicts about some of the accused have in common.
pub(super) struct Dispute {
    /// When the first of them began.
    pub(super) onset: Time,
    /// The same of those that have come and gone since.
    pub(super) since: Time,
    /// Whether one has come together gradually.
    pub(super) gradual: bool,
    /// How long they show a step of what is faulty.
    pub(super) shows: Span,
}

impl Dispute {
    /// `None` where no conflict is about them.
    pub(super) fn about(
        monitor: &Monitor,
        conflicts: &[&Pair],
        accused: &BTreeSet<Component>,
        now: Time,
    ) -> Option<Dispute> {
        let about = || conflicts.iter().filter(|pair| rests_on_any(monitor, pair, accused));
        Some(Dispute {
            onset: about().map(|pair| pair.onset(now)).min()?,
            since: about().map(|pair| pair.recurs_since(now)).min()?,
            gradual: about().any(|pair| is_gradual(pair, now)),
            shows: about().map(|pair| shows_a_step(monitor, pair)).max()?,
        })
    }
}

/// Whether a conflict has come together from many comparisons that agree one by one.
fn is_gradual(conflict: &Pair, now: Time) -> bool {
    conflict.window.relationship(now) != Relationship::Conflict
}

/// Whether one of the ways of a pair rests on one of these.
pub(super) fn rests_on_any(monitor: &Monitor, pair: &Pair, components: &BTreeSet<Component>) -> bool {
    components.iter().any(|&component| rests_on(monitor, pair, component))
}

/// How long a pair shows a step of a signal: a difference quotient does while it is within its window.
fn shows_a_step(monitor: &Monitor, pair: &Pair) -> Span {
    let rate = |index| monitor.way(index).filter(|way| way.computation.is_rate());
    let window = |index| rate(index).map_or(Span::ZERO, |way| way.computation.timing().window);
    match window(pair.way).max(window(pair.other)) {
        Span::ZERO => Span::MAX,
        window => window,
    }
}
