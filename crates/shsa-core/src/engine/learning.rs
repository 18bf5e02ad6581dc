//! Variables that relations `learn`: fitted while all signals of the relation are trusted, and put in place of the range.
//!
//! A value is learned one settling after it was compared, so that what the comparisons contradict is not learned. A fault of a
//! signal or of the relation freezes the variable, and takes back what was not confirmed before: what is served does not rest on
//! it. The comparisons keep it until all are trusted again: an accusation does not erase its own witness.

use super::Engine;
use super::message::{Event, EventKind, Output};
use super::snapshot::Recollection;
use crate::computation::{Computation, Settled};
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, Learned, Lineage, RelationId, SignalId, SignalSet, VariableId};
use crate::monitor::rests_on;
use crate::parameter::{AHEAD, Drift, News, Parameter};
use crate::plan;
use crate::reason::{Range, Reason};
use crate::residual_selection::{can_be_watched, witnesses};
use crate::time::{Span, Time, Validity};
use crate::trust::{Component, Trust};
use alloc::string::String;
use alloc::vec::Vec;

/// The most ways by which one relation gives a learned variable: one for each choice of signals.
const MOST_WAYS: usize = 8;

/// A learned variable as it is known now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedNow {
    /// The variable.
    pub variable: VariableId,
    /// All that its value can be, SI.
    pub set: Interval,
    /// Whether it is not fitted now, because a signal or a relation that it rests on is not trusted.
    pub is_frozen: bool,
    /// Whether it has left its range: the relations with it hold no more.
    pub has_left: bool,
    /// How long until it reaches the end of its range, if it goes on as when it was last seen to drift; `None` before a drift.
    pub limit_in: Option<Span>,
}

/// A learned variable at work.
#[derive(Debug)]
pub(super) struct Fitted {
    variable: VariableId,
    /// The relations that the variable is fitted to, and the texts of their equations.
    relations: Vec<(RelationId, String)>,
    parameter: Parameter,
    estimates: Vec<Estimate>,
    /// All signals that the estimates rest on.
    rests_on: SignalSet,
    is_frozen: bool,
    /// When the last drift that was seen ends at the end of the range.
    limit_at: Option<Time>,
    /// What was known when the variable was frozen: the comparisons keep it.
    witness: Option<Parameter>,
    /// The values that are served and compared with, and until when they hold all that is possible.
    used: Interval,
    compared: Interval,
    used_until: Time,
}

/// One way of computing a learned variable from signals.
#[derive(Debug)]
struct Estimate {
    computation: Computation,
    trigger: SignalId,
    rests_on: SignalSet,
    /// The newest moment that was noted.
    noted: Option<Validity>,
    /// A moment that has been compared, and is not learned yet.
    open: Option<Validity>,
}

impl Fitted {
    /// All learned variables of a knowledge base. O(model) for each of them.
    pub(super) fn all(knowledge: &KnowledgeBase) -> Vec<Fitted> {
        let mut all: Vec<Fitted> = Vec::new();
        for learned in knowledge.learned() {
            if !all.iter().any(|it| it.variable == learned.variable) {
                all.extend(Fitted::new(knowledge, learned.variable));
            }
            let of_it = all.iter_mut().filter(|it| it.variable == learned.variable);
            of_it.for_each(|it| it.add(knowledge, learned));
        }
        all
    }

    fn new(knowledge: &KnowledgeBase, variable: VariableId) -> Option<Fitted> {
        let described = &knowledge.variables()[variable];
        let (range, used) = (described.range?, described.constant?);
        Some(Fitted {
            variable,
            relations: Vec::new(),
            parameter: Parameter::new(range, described.max_rate?),
            estimates: Vec::new(),
            rests_on: SignalSet::new(),
            is_frozen: false,
            limit_at: None,
            witness: None,
            used,
            compared: used,
            used_until: Time::MIN,
        })
    }

    fn add(&mut self, knowledge: &KnowledgeBase, learned: &Learned) {
        self.relations.push((learned.relation, knowledge.relations()[learned.relation].text.clone()));
        let open = knowledge.with_unknown(learned);
        let graph = plan::Graph::new(&open);
        let runs = |way: &_| can_be_watched(&open, way);
        for way in witnesses(&open, &graph, learned.variable, MOST_WAYS, runs).ways {
            let rests_on = rests_on(&open, &way);
            let computation = Computation::new(&open, way, Computation::slowest_input);
            let Some((computation, trigger)) = computation.and_then(|it| it.trigger().map(|by| (it, by)))
            else {
                continue;
            };
            self.rests_on.extend(&rests_on);
            self.estimates.push(Estimate { computation, trigger, rests_on, noted: None, open: None });
        }
    }

    /// Notes when the limit is reached. One that has left its range has no time left.
    fn follow(&mut self, news: Option<News>, now: Time) {
        match news {
            Some(News::Drifts(drift)) => self.limit_at = Some(now + drift.remaining),
            Some(News::Left) => self.limit_at = None,
            Some(News::Back) | None => {}
        }
    }

    /// Whether another knowledge base describes the same: the range, the rate and the equations.
    fn goes_on(
        &self,
        old: &Fitted,
        lineage: &Lineage,
        before: &KnowledgeBase,
        after: &KnowledgeBase,
    ) -> bool {
        let of = |knowledge: &KnowledgeBase, it: &Fitted| {
            let variable = &knowledge.variables()[it.variable];
            (variable.range, variable.max_rate)
        };
        let relations = old.relations.iter().map(|(id, text)| lineage.relation(*id).map(|id| (id, text)));
        lineage.variable(old.variable) == Some(self.variable)
            && of(before, old) == of(after, self)
            && relations.eq(self.relations.iter().map(|(id, text)| Some((*id, text))))
    }
}

impl Engine {
    /// The learned variables, in file order.
    pub fn learned(&self) -> impl Iterator<Item = LearnedNow> + '_ {
        let now = self.now.unwrap_or_default();
        self.fitted.iter().map(move |it| LearnedNow {
            variable: it.variable,
            set: it.parameter.set(now),
            is_frozen: it.is_frozen,
            has_left: it.parameter.has_left(),
            limit_in: it.limit_at.map(|limit_at| (limit_at - now).max(Span::ZERO)),
        })
    }

    /// Estimates and learns before the comparisons of this moment. Returns whether the trust in a relation has changed by that.
    pub(super) fn prepare(&mut self, now: Time) -> bool {
        if self.fuses() {
            self.fuse(now);
        }
        !self.fitted.is_empty() && self.learn(now)
    }

    /// Learns from what was compared before this moment. Returns whether a relation may not be used any more, or again.
    #[inline(never)]
    fn learn(&mut self, now: Time) -> bool {
        let mut all = core::mem::take(&mut self.fitted);
        let mut has_changed = false;
        for fitted in &mut all {
            has_changed |= self.fit(fitted, now);
            if fitted.used_until < now + AHEAD {
                self.put_in_place(fitted, now);
            }
        }
        self.fitted = all;
        has_changed
    }

    fn fit(&mut self, fitted: &mut Fitted, now: Time) -> bool {
        let trusts =
            |relation: &RelationId| self.ledger.trust(Component::Relation(*relation)) <= Trust::Returning;
        let is_frozen = fitted.rests_on.iter().any(|signal| !self.ledger.trusts(signal))
            || !fitted.relations.iter().all(|(relation, _)| trusts(relation));
        if is_frozen != fitted.is_frozen {
            fitted.witness = is_frozen.then(|| fitted.parameter.clone());
            fitted.parameter.take_back();
            fitted.used_until = now;
        }
        fitted.is_frozen = is_frozen;
        let mut has_changed = false;
        for at in 0..fitted.estimates.len() {
            let Some(estimate) = fitted.estimates.get_mut(at) else { break };
            if let Some((value, moment)) = self.estimated(estimate, is_frozen) {
                let news = fitted.parameter.take(value, moment, now);
                fitted.used_until = now;
                has_changed |= matches!(news, Some(News::Left | News::Back));
                fitted.follow(news, now);
                news.into_iter().for_each(|news| self.report_learned(fitted, news, now));
            }
        }
        has_changed
    }

    /// What an estimate gives for the moment that is open, and the begin of that moment; notes the newest moment.
    fn estimated(&self, estimate: &mut Estimate, is_frozen: bool) -> Option<(Interval, Time)> {
        let is_missing = |signal: SignalId| {
            self.monitor.timeouts().absence(signal).is_some() || self.ledger.is_returning(signal)
        };
        if is_frozen || estimate.rests_on.iter().any(is_missing) {
            estimate.open = None;
        }
        let ports = self.monitor.ports();
        let mut found = None;
        if let Some(moment) = estimate.open {
            match estimate.computation.evaluate_settled(ports, moment) {
                Settled::Value(sample) => found = Some((sample.value, sample.validity.from)),
                Settled::Later(_) => return None,
                Settled::Nothing => {}
            }
            estimate.open = None;
        }
        let newest = ports[estimate.trigger].moment(0).filter(|moment| estimate.noted != Some(*moment));
        if newest.is_some() {
            (estimate.noted, estimate.open) = (newest, newest);
        }
        found
    }

    /// Has everything computed with the present value.
    fn put_in_place(&mut self, fitted: &mut Fitted, now: Time) {
        let value = fitted.parameter.value(now);
        let compared = fitted.witness.as_ref().map_or(value, |witness| witness.value(now));
        fitted.used_until = now + AHEAD + AHEAD;
        if compared != fitted.compared {
            fitted.compared = compared;
            self.monitor.set_constant(fitted.variable, compared);
        }
        if value != fitted.used {
            fitted.used = value;
            self.knowledge.set_constant(fitted.variable, value);
            for provider in self.providers.iter_mut() {
                provider.set_constant(fitted.variable, value);
            }
        }
    }

    fn report_learned(&mut self, fitted: &Fitted, news: News, now: Time) {
        let knowledge = &self.knowledge;
        let variable = &knowledge.variables()[fitted.variable];
        let range = |set: Interval| Range::of(knowledge, fitted.variable, set);
        let (name, is) = (variable.name.clone(), range(fitted.parameter.set(now)));
        let limits = range(variable.range.unwrap_or(Interval::ENTIRE));
        let (kind, reason) = match news {
            News::Drifts(Drift { from, within, to, remaining, .. }) => {
                let (from, to) = (range(from), range(to));
                (
                    EventKind::Ageing,
                    Reason::Drifts { variable: name, from, to, within, range: limits, remaining },
                )
            }
            News::Left => {
                (EventKind::Failed, Reason::LeftItsRange { variable: name, value: is, range: limits })
            }
            News::Back => {
                (EventKind::Restored, Reason::BackInRange { variable: name, value: is, range: limits })
            }
        };
        for (relation, _) in &fitted.relations {
            let event = Event::new(now, kind, Some(fitted.variable), reason.clone().into());
            self.outputs.push_back(Output::Event(Event { relation: Some(*relation), ..event }));
        }
    }

    /// These relations, and those with a variable that has left its range, ascending: nothing may rest on them.
    pub(super) fn with_aged(&self, mut relations: Vec<RelationId>) -> Vec<RelationId> {
        let left = self.fitted.iter().filter(|it| it.parameter.has_left());
        relations.extend(left.flat_map(|it| it.relations.iter().map(|(relation, _)| *relation)));
        relations.sort_unstable();
        relations.dedup();
        relations
    }

    /// Forgets what was learned from a relation; returns whether anything is learned from it.
    pub(super) fn forget_learned(&mut self, component: Component) -> bool {
        let Component::Relation(relation) = component else { return false };
        let mut is_any = false;
        for fitted in &mut self.fitted {
            if fitted.relations.iter().any(|(id, _)| *id == relation) {
                is_any = true;
                fitted.parameter.forget();
                fitted.witness = None;
                (fitted.limit_at, fitted.used_until) = (None, Time::MIN);
            }
        }
        is_any
    }

    /// What outlasts a restart.
    pub(super) fn recollections(&self) -> Vec<Recollection> {
        let name = |it: &Fitted| self.knowledge.variables()[it.variable].name.clone();
        let recollection =
            |it: &Fitted| Some(Recollection { variable: name(it), memory: it.parameter.memory()? });
        self.fitted.iter().filter_map(recollection).collect()
    }

    /// Goes on with what was learned before a restart; what is not learned any more is nothing to anybody.
    pub(super) fn recollect(&mut self, all: &[Recollection], now: Time) {
        let mut fitted = core::mem::take(&mut self.fitted);
        for it in &mut fitted {
            let name = &self.knowledge.variables()[it.variable].name;
            if let Some(known) = all.iter().find(|known| known.variable == *name) {
                it.parameter.recall(known.memory, now);
                self.put_in_place(it, now);
            }
        }
        self.fitted = fitted;
    }

    /// Goes on with what was learned with the knowledge base before, where the new one describes the same.
    pub(super) fn inherit_learned(&mut self, old: &Engine, lineage: &Lineage) {
        let mut fitted = core::mem::take(&mut self.fitted);
        for it in &mut fitted {
            let same = |other: &&Fitted| it.goes_on(other, lineage, &old.knowledge, &self.knowledge);
            if let Some(other) = old.fitted.iter().find(same) {
                it.parameter = other.parameter.clone();
                it.witness = other.witness.clone();
                (it.is_frozen, it.limit_at) = (other.is_frozen, other.limit_at);
                // Exactly what the computations before the change have used, so that they go on.
                (it.used, it.compared, it.used_until) = (other.used, other.compared, Time::MIN);
                self.knowledge.set_constant(it.variable, it.used);
                self.monitor.set_constant(it.variable, it.compared);
            }
        }
        self.fitted = fitted;
    }
}
