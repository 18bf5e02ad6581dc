//! Keeps one need served: chooses its source, gates every value, and reports when the source changes.
//!
//! A lost source is replaced at once; a better one is taken after the hold time only. A value that more ways contradict than
//! support is held back even before there is a verdict, and a trusted way that is not contradicted fills in.

mod settings;
mod reported;
mod statistics;
mod pace;
mod turn;
mod blend;
mod situation;
mod proven;
mod sources;
mod refusal;
mod contract;
mod delegate;
mod episode;
mod unsure;
mod state;
mod choose;
mod unserved;
mod quality;
mod provide;
mod without;

pub use contract::NeedAssurance;
pub use delegate::Delegation;
pub(super) use situation::{Resumption, Situation, Succession};

use super::message::{Event, EventKind};
use super::ready_sources::ReadySources;
use super::ways::Lost;
use crate::alignment::Sample;
use crate::assurance::{Assessments, Assurance};
use crate::knowledge::{KnowledgeBase, NeedId};
use crate::monitor::{Monitor, WayIndex};
use crate::observation::Observation;
use crate::plan::Graph;
use crate::reason::{Joint, Reason, Reasons, ServedBy};
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::string::String;
use blend::Blend;
use delegate::Delegate;
use refusal::Refusals;
use reported::Reported;
use settings::{Given, Settings};
use sources::Sources;
use state::State;
use statistics::Statistics;
use turn::Names;

/// How a need is served.
#[derive(Clone, Debug, PartialEq)]
pub struct NeedStatus {
    /// The source or the uncertain service; `None` while the need is not served.
    pub source: Option<ServedBy>,
    /// The only source that may serve the need, where an operator has ordered one.
    pub forced: Option<String>,
    /// The number of published values.
    pub published: u64,
    /// The longest time between two published values.
    pub longest_gap: Span,
    /// The width of the widest published value, SI.
    pub widest: f64,
    /// When the last value was published.
    pub last: Option<Time>,
    /// The state of the need's contract; `None` where the need demands nothing.
    pub assurance: Option<NeedAssurance>,
}

/// The origin of a value of a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Server {
    /// The chosen source, since the last switch.
    Active { since: Option<Time> },
    /// Another trusted way, for the moment.
    StandIn(WayIndex),
    /// The candidates, while nothing is trusted.
    Unsure,
}

/// Why a better source than the one in use exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Better {
    /// The signals of the better source are trusted again.
    Trusted,
    /// The changed model has brought a preferred source.
    Changed,
    /// The operator has ended an order.
    Ordered,
    /// Contracts admit the better source again.
    Admitted,
}

/// The only source that may serve a need, by order.
#[derive(Debug)]
struct Forced {
    way: Way,
    /// Whether the source would not be chosen without the order.
    is_doubted: bool,
}

/// Serves one need.
#[derive(Debug)]
pub(super) struct Provider {
    settings: Settings,
    /// The sources that may serve the need.
    sources: Sources,
    /// The assessments of the sources by contracts.
    contracts: Assessments,
    /// Refused sources, and sources whose values fell short.
    refusals: Refusals,
    /// The present service.
    state: State,
    forced: Option<Forced>,
    /// The process that computes the source instead of the engine.
    delegate: Delegate,
    /// When the last switch was.
    switched: Option<Time>,
    started: Option<Time>,
    /// The last value, and when it was published.
    last: Option<(Time, Sample)>,
    /// The last value that was trusted.
    trusted: Option<Sample>,
    /// The usual time between the values of its server.
    last_period: Span,
    /// A value of the source that waits for its turn.
    waiting: Option<Given>,
    names: Names,
    /// The server of the last value, and the rest of the offset from the server before.
    blend: Blend,
    reported: Reported,
    statistics: Statistics,
}

impl Provider {
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        assurance: Option<&Assurance>,
        graph: &Graph,
        ready_sources: &ReadySources,
        monitor: &Monitor,
        id: NeedId,
        prefers_proven: bool,
    ) -> Provider {
        let mut provider = Provider {
            settings: Settings::new(knowledge, id),
            sources: Sources::new(knowledge, graph, ready_sources, id, prefers_proven),
            contracts: Assessments::new(knowledge, assurance, id),
            refusals: Refusals::default(),
            state: State::Unserved,
            forced: None,
            delegate: Delegate::default(),
            switched: None,
            started: None,
            last: None,
            trusted: None,
            last_period: Span::ZERO,
            waiting: None,
            names: Names::default(),
            blend: Blend::default(),
            reported: Reported::NOTHING,
            statistics: Statistics::default(),
        };
        provider.refusals.note(knowledge, graph, ready_sources, id, &Lost::default());
        provider.sources.rank(knowledge, monitor, None);
        if provider.contracts.is_demanding() {
            provider.begin_under_contract(knowledge, assurance);
        }
        provider.start_best(knowledge, monitor.ports());
        if !provider.contracts.is_demanding() {
            provider.sources.preferred = provider.state.way().cloned();
        }
        provider
    }

    pub(super) fn status(&self, knowledge: &KnowledgeBase) -> NeedStatus {
        let Statistics { published, longest_gap, widest } = self.statistics;
        NeedStatus {
            source: self.served_by(knowledge),
            forced: self.forced().map(|way| way.describe(knowledge)),
            published,
            longest_gap,
            widest,
            last: self.last.map(|(time, _)| time),
            assurance: self.assurance(),
        }
    }

    /// What may serve it now, best first.
    pub(super) fn ways(&self) -> impl Iterator<Item = &Way> {
        self.sources.ways()
    }

    /// When the source becomes late or the need overdue, or the hold time of a better source is over; after that, only
    /// what comes can change something.
    pub(super) fn next_deadline(&self, now: Time) -> Option<Time> {
        let served = self.last_served();
        let overdue = served.filter(|_| !self.reported.is_unserved());
        let overdue = overdue.map(|last| last + self.settings.max_age + Span(1));
        let held = || self.held_until().filter(|until| *until > now && self.better().is_some());
        let own = self.state.deadline(&self.settings, &self.reported, served, held, now);
        let turn = self.next_turn().filter(|turn| *turn > now);
        earlier(earlier(overdue, own), earlier(turn, self.contracts.deadline()))
    }

    pub(super) fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        self.state.observe(knowledge, observation);
    }

    /// When it was last served, or began to wait for that; `None` where what was given stands.
    fn last_served(&self) -> Option<Time> {
        if self.state.stands() {
            return None;
        }
        self.last.map(|(time, _)| time).or(self.started)
    }

    /// What serves the need now.
    fn served_by(&self, knowledge: &KnowledgeBase) -> Option<ServedBy> {
        let unsure = self.state.unsure().filter(|unsure| unsure.is_reported());
        let unsure = unsure.map(|unsure| unsure.served_by(knowledge));
        unsure.or_else(|| self.source_name(knowledge).map(ServedBy::Way))
    }

    /// The name of the source.
    fn source_name(&self, knowledge: &KnowledgeBase) -> Option<String> {
        self.state.way().map(|way| way.describe(knowledge))
    }

    fn event(
        &self,
        knowledge: &KnowledgeBase,
        kind: EventKind,
        because: impl Into<Reasons>,
        time: Time,
    ) -> Event {
        let substitution = if kind == EventKind::Unhealable { None } else { self.served_by(knowledge) };
        let about = Event::new(time, kind, Some(self.settings.variable), because.into());
        Event { substitution, need: Some(self.settings.need), ..about }
    }

    /// Reports that the need is not served, once.
    fn report_unserved(
        &mut self,
        knowledge: &KnowledgeBase,
        because: Option<Reasons>,
        now: Time,
    ) -> Option<Event> {
        let because = because.filter(|_| !self.reported.is_unserved())?;
        self.reported.lose(self.settings.switching.probation, now);
        Some(self.event(knowledge, EventKind::Unhealable, because, now))
    }

    /// The only source that may serve the need, where one is ordered.
    pub(super) fn forced(&self) -> Option<&Way> {
        self.forced.as_ref().map(|forced| &forced.way)
    }

    /// When the last switch happened.
    pub(super) fn switched(&self) -> Option<Time> {
        self.switched
    }

    /// Whether an event has reported that nothing serves the need.
    pub(super) fn is_unserved(&self) -> bool {
        self.reported.is_unserved()
    }

    /// The last published value, and when it was published.
    pub(super) fn last(&self) -> Option<(Time, Sample)> {
        self.last
    }

    /// The source of the need.
    pub(super) fn active(&self) -> Option<&Service> {
        self.state.serving().map(|serving| &serving.service)
    }

    /// Goes on from the provider of the same need before a change of the model. Reports when the source had to be left.
    pub(super) fn inherit(&mut self, old: Provider, change: &Succession<'_>) -> Option<Event> {
        self.started = old.started;
        self.last = old.last;
        self.trusted = old.trusted;
        self.last_period = old.last_period;
        self.statistics = old.statistics;
        self.reported = old.reported;
        self.switched = old.switched;
        self.refusals.inherit(&old.refusals, change);
        self.blend = old.blend.renamed(|server| match server {
            Server::Active { .. } | Server::Unsure => Some(server),
            Server::StandIn(way) => change.inheritance.way(way).map(Server::StandIn),
        });
        self.sources.inherit(&old.sources);
        self.inherit_contract(&old, change);
        self.find_sources(&change.situation);
        let preferred = old.sources.preferred.as_ref().and_then(|way| way.succeeded(change.lineage));
        let way = old.state.way().and_then(|way| way.succeeded(change.lineage));
        let way = way.filter(|way| self.may_go_on(way, change));
        match (way, old.state) {
            (Some(way), State::Serving(mut before)) => {
                self.go_on(way, &mut before.service, change);
                if let (Some(forced), Some(old)) = (&mut self.forced, &old.forced) {
                    forced.is_doubted = old.is_doubted;
                }
                let is_same = self.sources.preferred == preferred;
                if let Some(serving) = self.state.serving_mut() {
                    serving.pace = before.pace;
                    serving.unfit_since = before.unfit_since;
                    serving.is_confirmed = before.is_confirmed;
                    serving.episode = before.episode.and_then(|it| it.inherit(change.inheritance));
                    serving.better_by = if is_same { before.better_by } else { Better::Changed };
                }
                None
            }
            _ if self.forced.is_some() => self.stay_forced(&change.situation),
            (_, left) => self.start_anew(left.way(), change),
        }
    }

    /// Whether the source in use before the change may go on.
    fn may_go_on(&self, way: &Way, change: &Succession<'_>) -> bool {
        let Situation { knowledge, ledger, .. } = change.situation;
        match self.forced() {
            Some(forced) => forced == way && ledger.forbidden_in(knowledge, way).is_empty(),
            None => self.sources.contain(way),
        }
    }

    /// Goes on with the same source; its program keeps its memory where it still computes the same.
    fn go_on(&mut self, way: Way, old: &mut Service, change: &Succession<'_>) {
        let Situation { knowledge, monitor, .. } = change.situation;
        let assured = self.contracts.admit(way);
        let service = assured.and_then(|way| Service::start(knowledge, way, monitor.ports(), None));
        let Some(mut service) = service else { return };
        if !service.inherit(old, change.lineage) {
            // The source's values may differ from now on: for the blending, that is a switch.
            self.blend.leave();
        }
        self.take_over(knowledge, Some(service));
    }

    /// Starts a new or redefined need with a source that is trusted.
    pub(super) fn begin(&mut self, change: &Succession<'_>) {
        self.find_sources(&change.situation);
        self.start_with_inputs(&change.situation);
    }

    /// Goes on from before a restart: from the source that served the need, where that source may still be used. Reports when the
    /// source had to be left.
    pub(super) fn resume(&mut self, before: &Resumption<'_>, situation: &Situation<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = *situation;
        self.started = Some(now);
        self.switched = before.switched;
        self.reported.recall(before.unserved);
        // An older value is no evidence about now: it makes no jump, and no computation continues from it.
        self.last = before.last.filter(|(at, _)| now - *at <= self.settings.max_age);
        self.trusted = self.last.map(|(_, sample)| sample);
        self.blend.pass_to(Server::Active { since: self.switched });
        self.refusals.take_as_reported();
        self.find_sources(situation);
        let described = |way: &Way| Some(way.describe(knowledge)) == before.source.map(Into::into);
        if let Some(forced) = self.forced().cloned() {
            if described(&forced) {
                self.start(knowledge, Some(forced), monitor.ports());
            }
            return self.stay_forced(situation);
        }
        let same = self.sources.ways().find(|way| described(way)).cloned();
        if same.is_some() && self.start(knowledge, same, monitor.ports()) {
            return None;
        }
        let is_served = self.start_best(knowledge, monitor.ports());
        if !is_served && self.may_be_admitted_yet() {
            // After a restart no evidence is known yet, so a refusal is no news.
            return None;
        }
        let left = Reasons::from(Reason::ServedBefore { source: before.source?.into() });
        if !is_served {
            return self.do_without(situation, Some(left.then(Joint::And, Reason::NothingElseTrusted)));
        }
        self.switched = Some(now);
        let because = left.then(Joint::Next, self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }
}

/// The earlier one of two times, of which one or both may not come.
#[inline]
fn earlier(one: Option<Time>, other: Option<Time>) -> Option<Time> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}
