//! Inputs to outputs: alignment, monitor, diagnosis, plan and service, called in this order.
//!
//! Drive it with [`Engine::handle`], collect with [`Engine::poll`] until nothing is left, and send the
//! [`Ticks`] that have fallen due before each input. Observations of one moment of reception are taken
//! together: what they mean comes out with the first input of a later moment, or with a tick of the same one.

mod options;
mod operator;
mod snapshot;
mod message;
mod unit_slip;
mod events;
mod ways;
mod ready_sources;
mod instruments;
mod provider;
mod contracts;
mod news;
mod orders;
mod outliers;
mod reload;
mod restore;
mod evidence;
mod fusing;
mod learning;
mod ticks;
mod what_if;

pub use evidence::{Comparison, Evidence, NoValue, Rival, Side};
pub use fusing::{Fuse, FusionInput, Measurements};
pub use learning::LearnedNow;
pub use message::{Event, EventKind, Input, Output, Publication, PublishedValue, Quality, Report, Severity};
pub use operator::Refusal;
pub use options::{Options, Ties};
pub use provider::{Delegation, NeedAssurance, NeedStatus};
pub use snapshot::{Compared, Missing, Published, Recollection, Remembered, Served, Snapshot, Trending};
pub use ticks::Ticks;
pub use what_if::WhatIf;

pub use crate::order::{Order, Subject};
pub use crate::residual_selection::{Isolability, WatchBudget, can_be_watched, to_watch, witnesses};

use crate::computation::Task;
use crate::diagnosis::Judge;
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId};
use crate::monitor::{Absence, Change, Monitor, Symptom};
use crate::observation::Observation;
use crate::plan;
use crate::reason::Reason;
use crate::substitution::Way;
use crate::time::{Time, Validity};
use crate::trust::{Accusation, Component, Ledger, Trust, Verdict};
use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use contracts::Contracts;
use learning::Fitted;
use provider::{Provider, Situation};
use ready_sources::ReadySources;
use ways::Lost;

/// The loop of monitor, analyse, plan and execute over one knowledge base.
#[derive(Debug)]
pub struct Engine {
    knowledge: KnowledgeBase,
    graph: plan::Graph,
    ready_sources: ReadySources,
    monitor: Monitor,
    judge: Judge,
    ledger: Ledger,
    /// Where a need demands anything.
    contracts: Option<Box<Contracts>>,
    providers: IdVec<NeedId, Provider>,
    outputs: VecDeque<Output>,
    now: Option<Time>,
    /// Whether observations of `now` wait to be taken together.
    waiting: bool,
    /// Silences and returns since the last settling.
    changes: Vec<Change>,
    options: Options,
    /// Who computes the signals that are fused.
    estimators: Option<Box<dyn Fuse>>,
    has_fusions: bool,
    /// The variables that are learned; and whether there are some, or estimators.
    fitted: Vec<Fitted>,
    prepares: bool,
}

impl Engine {
    /// Sets everything up; what is allocated for observations is allocated here.
    #[must_use]
    pub fn new(knowledge: KnowledgeBase, options: Options) -> Engine {
        Engine::with_standby(knowledge, options, ReadySources::new)
    }

    fn with_standby(
        knowledge: KnowledgeBase,
        options: Options,
        plan_ahead: impl FnOnce(&KnowledgeBase, &plan::Graph) -> ReadySources,
    ) -> Engine {
        let mut judge = options.judge;
        let probations = knowledge.needs().iter().map(|need| need.switching.probation);
        judge.probation = probations.max().unwrap_or(judge.probation);
        let graph = plan::Graph::new(&knowledge);
        let ways = to_watch(&knowledge, &graph, options.watch);
        let monitor = Monitor::new(&knowledge, ways, options.monitor);
        let ledger = Ledger::new(&knowledge, judge.probation);
        let judge = Judge::new(&knowledge, judge);
        let ready_sources = plan_ahead(&knowledge, &graph);
        let contracts = Contracts::of(&knowledge);
        let assurance = contracts.as_ref().map(|contracts| &contracts.assurance);
        let proven = options.ties == Ties::Proven;
        let providers = IdVec::filled(knowledge.needs().len(), |need| {
            Provider::new(&knowledge, assurance, &graph, &ready_sources, &monitor, need, proven)
        });
        let has_fusions = !knowledge.fusions().is_empty();
        let fitted = Fitted::all(&knowledge);
        Engine {
            knowledge,
            graph,
            ready_sources,
            monitor,
            judge,
            ledger,
            contracts,
            providers,
            outputs: VecDeque::with_capacity(64),
            now: None,
            waiting: false,
            changes: Vec::with_capacity(8),
            options,
            estimators: None,
            has_fusions,
            prepares: has_fusions || !fitted.is_empty(),
            fitted,
        }
    }

    /// Takes one input. Time never goes back: an input of an earlier moment counts as one of the present.
    pub fn handle(&mut self, input: Input) {
        match input {
            Input::Observation(observation) => {
                self.advance(observation.received);
                self.observe(&observation);
            }
            Input::Tick(time) => {
                self.advance(time);
                self.settle();
            }
            // A refusal is among the outputs.
            Input::Order { time, order } => _ = self.order(&order, time),
            Input::Restore { time, snapshot } => self.restore(&snapshot, time),
            Input::Report { time, need, report } => self.report(need, report, time),
        }
    }

    /// The next output, oldest first.
    pub fn poll(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When a tick is due: at once when observations wait, else when a timeout may run out. After a tick at that time
    /// the next one is later, so ticking until none is due ends.
    #[must_use]
    pub fn next_deadline(&self) -> Option<Time> {
        let now = self.now?;
        if self.waiting {
            return Some(now);
        }
        self.first_deadline(now)
    }

    /// When a timeout may run out. What was due until now has been done: a driver that obeys never waits in vain.
    fn first_deadline(&self, now: Time) -> Option<Time> {
        let mut first = Time::MAX;
        let mut take = |due: Option<Time>| first = due.filter(|it| *it > now).unwrap_or(first).min(first);
        take(self.monitor.timeouts().next_deadline());
        take(self.judge.next_review());
        take(Some(self.ledger.first_return()));
        self.providers.iter().for_each(|provider| take(provider.next_deadline(now)));
        take(self.estimators.as_ref().filter(|_| self.has_fusions).and_then(|it| it.next_deadline()));
        (first < Time::MAX).then_some(first)
    }

    /// The knowledge base that it works with.
    #[must_use]
    pub fn knowledge(&self) -> &KnowledgeBase {
        &self.knowledge
    }

    /// The comparisons under watch.
    #[must_use]
    pub fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// What is thought of a signal now; signals from the same source share one verdict.
    #[must_use]
    pub fn verdict(&self, signal: SignalId) -> Verdict {
        let witness = self.knowledge.witness(signal);
        self.judge.verdict(&self.ledger, witness, &self.monitor, self.now.unwrap_or_default())
    }

    /// Why a signal gives no usable value now; `None` when it does.
    #[must_use]
    pub fn absence(&self, signal: SignalId) -> Option<Absence> {
        self.monitor.timeouts().absence(signal)
    }

    /// What a signal's own readings show to be wrong with it now.
    #[must_use]
    pub fn fault(&self, signal: SignalId) -> Option<Symptom> {
        self.monitor.detectors().fault(signal)
    }

    /// The accusation of a signal now, as an event has reported it.
    #[must_use]
    pub fn accusation(&self, signal: SignalId) -> Option<&Accusation> {
        let accused = self.ledger.accused(Component::Signal(self.knowledge.witness(signal)));
        accused.and_then(|it| it.reported.as_ref())
    }

    /// How a need is served now.
    #[must_use]
    pub fn need_status(&self, need: NeedId) -> NeedStatus {
        self.providers[need].status(&self.knowledge)
    }

    /// What may serve a need now, best first, what serves it among them.
    pub fn ways_to_serve(&self, need: NeedId) -> impl Iterator<Item = &Way> {
        self.providers.find(need).into_iter().flat_map(Provider::ways)
    }

    /// The computation of a need that another process could do; `None` while nothing serves the need, or a signal serves it
    /// directly.
    #[must_use]
    pub fn delegation(&self, need: NeedId) -> Option<Delegation<'_>> {
        self.providers.find(need)?.delegation()
    }

    /// What the source of a need has seen before a moment, oldest first, for who begins to compute it.
    #[must_use]
    pub fn past(&self, need: NeedId, before: Validity) -> Vec<Task> {
        let service = self.providers.find(need).and_then(Provider::active);
        service.map(|service| service.past(self.monitor.ports(), before)).unwrap_or_default()
    }

    /// Hears from who computes the source of a need.
    fn report(&mut self, need: NeedId, report: Report, time: Time) {
        self.advance(time);
        if self.providers.find(need).is_none() {
            return;
        }
        self.providers[need].take_report(&self.knowledge, self.monitor.ports(), report);
        self.settle();
    }

    #[inline]
    fn advance(&mut self, time: Time) {
        match self.now {
            Some(now) if time <= now => return,
            Some(_) if self.waiting => self.settle(),
            _ => {}
        }
        let is_due = self.now.and_then(|now| self.first_deadline(now)).is_some_and(|due| due <= time);
        self.now = Some(time);
        let changes = &mut self.changes;
        self.monitor.pass(time, |change| changes.push(change));
        if !self.changes.is_empty() || is_due {
            self.settle();
        }
    }

    fn observe(&mut self, observation: &Observation) {
        let Some(now) = self.now else { return };
        if self.knowledge.signals().find(observation.signal).is_none() {
            return;
        }
        let observed = self.monitor.observe(&self.knowledge, observation, now);
        if let Some(change) = observed.change {
            self.changes.push(change);
        }
        if let Some((last, first)) = observed.began {
            self.begin_anew(observation.signal, last, first, now);
        }
        self.waiting = true;
        if self.fuses() {
            self.feed(observation, observed, now);
        }
        if !observed.kept && !observed.repeated {
            return;
        }
        if let Some(contracts) = &mut self.contracts {
            contracts.note_value(observation.signal);
        }
        for provider in self.providers.iter_mut() {
            provider.observe(&self.knowledge, observation);
        }
        if !self.ledger.trusts_all() && self.ledger.note_value(self.knowledge.witness(observation.signal)) {
            self.judge.look_again(now);
        }
    }

    /// Takes together what has come at this moment.
    fn settle(&mut self) {
        self.settle_after(false);
    }

    /// The same after something from outside, which may have changed what the evidence means.
    fn settle_after(&mut self, is_intervention: bool) {
        let Some(now) = self.now else { return };
        let has_learned = self.prepares && self.prepare(now);
        self.waiting = false;
        let evidence_changed = self.monitor.settle(now);
        let review_due = self.judge.next_review().is_some_and(|due| due <= now)
            || self.judge.has_awaited_comparison(&self.monitor);
        let mut trust_changed = self.report_findings(now);
        trust_changed |= self.report_changes(now) | has_learned;
        if evidence_changed || review_due || trust_changed || is_intervention {
            trust_changed |= self.review(now);
        }
        let is_admitted_otherwise = self.contracts.is_some() && self.follow_evidence(now);
        if trust_changed {
            self.replan(now, None);
        } else if is_admitted_otherwise {
            self.replan_under_contract(now);
        }
        self.provide(now);
    }

    /// What may not be used now where nothing below this trust is: relations; signals that are not available or absent.
    fn lost(&self, least: Trust) -> Lost {
        let is_present = |signal: SignalId| self.monitor.timeouts().absence(signal).is_none();
        let usable = |signal: SignalId| {
            self.knowledge.is_available(signal)
                && self.ledger.trust_in(signal) <= least
                && self.knowledge.foundations(signal).iter().all(is_present)
        };
        Lost {
            signals: self.knowledge.signals().ids().filter(|signal| !usable(*signal)).collect(),
            relations: self.with_aged(self.ledger.relations_below(least)),
        }
    }

    /// Chooses the source of every need again; `order` is the reason where an operator's order caused this.
    fn replan(&mut self, now: Time, order: Option<Reason>) {
        let (providers, outputs, situation) = self.situation(now, order);
        for provider in providers.iter_mut() {
            outputs.extend(provider.replan(&situation).map(Output::Event));
        }
    }

    /// The needs, the queue of outputs, and the situation by which needs choose.
    fn situation(
        &mut self,
        now: Time,
        order: Option<Reason>,
    ) -> (&mut IdVec<NeedId, Provider>, &mut VecDeque<Output>, Situation<'_>) {
        let lost = Trust::RUNGS.map(|least| self.lost(least));
        let Engine { knowledge, graph, ready_sources, monitor, judge, ledger, .. } = self;
        let Engine { providers, outputs, contracts, .. } = self;
        let situation = Situation {
            knowledge,
            graph,
            ready_sources,
            monitor,
            judge,
            ledger,
            lost,
            now,
            contracts: contracts.as_ref().map(|contracts| (&contracts.assurance, &contracts.attested)),
            is_about_contracts: false,
            order,
        };
        (providers, outputs, situation)
    }

    fn provide(&mut self, now: Time) {
        for provider in self.providers.iter_mut() {
            provider.provide(&self.knowledge, &self.monitor, &self.ledger, now, &mut self.outputs);
        }
    }
}
