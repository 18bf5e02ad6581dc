//! Keeps one need served: chooses its source, gates every value, and tells when the source changes.
//!
//! A lost source is replaced at once; a better one is taken after the hold time only. A value that more of the
//! other ways contradict than support is held back even before there is a verdict, and a trusted way that is
//! not contradicted fills in.

mod delegate;
mod inherit;
mod proven;
mod forced;
mod resume;
mod stand_in;
mod episode;
mod refusal;
mod unsure;

pub use delegate::Delegation;
pub(super) use inherit::Succession;
pub(super) use resume::Resumption;

use super::message::{Event, EventKind, Output, Publication, PublishedValue, Quality};
use super::ready_sources::ReadySources;
use super::reason;
use super::ways::{Lost, Source};
use crate::alignment::{Port, Sample};
use crate::circle;
use crate::diagnosis::Judge;
use crate::interval::Interval;
use crate::knowledge::{
    IdVec, KnowledgeBase, NeedId, Shape, SignalId, SignalSet, Switching, VariableId, WhenUnsure,
};
use crate::monitor::{Monitor, WatchedWay, WayIndex, rests_on};
use crate::observation::Observation;
use crate::plan::Graph;
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;
use delegate::Delegate;
use episode::{Episode, Fault};
use proven::Ranked;
use refusal::{Refusals, Short};
use stand_in::Pace;
use unsure::Unsure;

/// How many alternatives an event names.
const MOST_NAMED: usize = 3;

/// How a need is served.
#[derive(Clone, Debug, PartialEq)]
pub struct NeedStatus {
    /// Signals and relations that serve it; `None` while nothing can.
    pub source: Option<String>,
    /// The only source that may serve it, where an operator has ordered that.
    pub forced: Option<String>,
    /// Values published.
    pub published: u64,
    /// The longest time between two of them.
    pub longest_gap: Span,
    /// The widest of them, SI.
    pub widest: f64,
    /// When the last one was.
    pub last: Option<Time>,
}

/// A value of a source, with the time in which it was true.
type Given = (PublishedValue, Validity);

/// Who gives a value of a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Server {
    /// The chosen source, since the last switch.
    Active { since: Option<Time> },
    /// Another trusted way, for the moment.
    StandIn(WayIndex),
    /// What may be right, while nothing is trusted.
    Unsure,
}

/// Why there is a better source than the one in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Better {
    /// Its signals are trusted again.
    Trusted,
    /// The changed model has brought another one that is preferred.
    Changed,
    /// The operator has given it back.
    Ordered,
}

/// What a need's sources are chosen by.
pub(super) struct Situation<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) graph: &'a Graph,
    pub(super) ready_sources: &'a ReadySources,
    pub(super) monitor: &'a Monitor,
    pub(super) judge: &'a Judge,
    /// What may not be used: the first of these losses that lets a need be served counts. What only the last one lets serve
    /// is uncertain.
    pub(super) lost: [Lost; 3],
    /// What may not be used even where it is not known what is right: what has failed, is forbidden or absent.
    pub(super) doubted: Lost,
    pub(super) now: Time,
    /// The order that has brought it about, in words; `None` when the trust in something has changed.
    pub(super) order: Option<String>,
}

/// Serves one need.
#[derive(Debug)]
pub(super) struct Provider {
    need: NeedId,
    variable: VariableId,
    switching: Switching,
    max_age: Span,
    max_width: f64,
    when_unsure: WhenUnsure,
    is_vector: bool,
    /// What may serve the need now, best first.
    sources: Arc<[Source]>,
    /// The same as they were ranked when the trust in a signal last changed.
    ranked: Vec<Ranked>,
    /// Whether of equally good sources the best proven one is taken.
    prefers_proven: bool,
    /// What serves it when nothing is wrong.
    preferred: Option<Way>,
    active: Option<Service>,
    /// Who computes that instead of us.
    delegate: Delegate,
    active_rests_on: SignalSet,
    /// How regularly it gives values.
    pace: Pace,
    /// Since when the source has given nothing but values that are too old or too wide.
    unfit_since: Option<Time>,
    /// When the last switch was.
    switched: Option<Time>,
    started: Option<Time>,
    last: Option<(Time, Sample)>,
    /// Who gave the last value.
    server: Option<Server>,
    /// How far the output was from its new source when that took over, and when.
    blend: Option<(f64, Time)>,
    /// Whether it has been told that the need is not served.
    unserved: bool,
    /// When it was told last that it is served again, and since when it is without a break.
    served_again: Option<Time>,
    steady_since: Option<Time>,
    /// It was not served again for long: that it is is told when it lasts.
    is_wary: bool,
    /// Another way stands in for the source.
    episode: Option<Episode>,
    /// What was refused, and what was left because its values fell short.
    refusals: Refusals,
    short: Vec<Short>,
    /// What serves it while nothing is trusted.
    unsure: Option<Unsure>,
    /// Whether it was told that values go out as uncertain.
    is_uncertain: bool,
    /// No two of its sources are independent.
    is_alone: bool,
    /// Why a better source than the one in use is there, when there is one.
    better_by: Better,
    /// The only source that may serve it, by order; and whether nobody would choose it.
    forced: Option<Way>,
    is_doubted: bool,
    /// Whether what serves it is trusted only for want of better.
    is_unproven: bool,
    published: u64,
    longest_gap: Span,
    widest: f64,
}

/// Tells an event where there is one. Most often there is none, and a list that is extended by nothing costs more.
#[inline]
fn tell(outputs: &mut VecDeque<Output>, event: Option<Event>) {
    if let Some(event) = event {
        outputs.push_back(Output::Event(event));
    }
}

/// That of the widest element.
fn width(value: &PublishedValue) -> f64 {
    match value {
        PublishedValue::Scalar(value) => value.width(),
        PublishedValue::Vector(elements) => elements.iter().map(|it| it.width()).fold(0.0, f64::max),
    }
}

impl Provider {
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        ready_sources: &ReadySources,
        monitor: &Monitor,
        id: NeedId,
        prefers_proven: bool,
    ) -> Provider {
        let need = &knowledge.needs()[id];
        let mut provider = Provider {
            need: id,
            variable: need.variable,
            switching: need.switching,
            max_age: need.max_age,
            max_width: need.max_width.unwrap_or(f64::INFINITY),
            when_unsure: need.when_unsure,
            is_vector: knowledge.variables()[need.variable].shape == Shape::Vector,
            sources: ready_sources.sources(knowledge, graph, id, &Lost::default()),
            ranked: Vec::new(),
            prefers_proven,
            preferred: None,
            active: None,
            delegate: Delegate::default(),
            active_rests_on: SignalSet::new(),
            pace: Pace::default(),
            unfit_since: None,
            switched: None,
            started: None,
            last: None,
            server: None,
            blend: None,
            unserved: false,
            served_again: None,
            steady_since: None,
            is_wary: false,
            episode: None,
            refusals: Refusals::default(),
            short: Vec::new(),
            unsure: None,
            is_uncertain: false,
            is_alone: false,
            better_by: Better::Trusted,
            forced: None,
            is_doubted: false,
            is_unproven: false,
            published: 0,
            longest_gap: Span::ZERO,
            widest: 0.0,
        };
        provider.note_refused(knowledge, graph, ready_sources, &Lost::default());
        provider.rank(knowledge, monitor, None);
        provider.start_best(knowledge, monitor.ports());
        provider.preferred = provider.active.as_ref().map(|service| service.way().clone());
        provider
    }

    pub(super) fn status(&self, knowledge: &KnowledgeBase) -> NeedStatus {
        NeedStatus {
            source: self.unsure_words(knowledge).or_else(|| self.active_words(knowledge)),
            forced: self.forced.as_ref().map(|way| way.describe(knowledge)),
            published: self.published,
            longest_gap: self.longest_gap,
            widest: self.widest,
            last: self.last.map(|(time, _)| time),
        }
    }

    /// When the source becomes late or the need overdue, or the hold time of a better source is over; after that, only
    /// what comes can change something.
    pub(super) fn next_deadline(&self, now: Time) -> Option<Time> {
        let overdue =
            (!self.unserved).then(|| self.last_served().map(|last| last + self.max_age + Span(1))).flatten();
        let late = self.late_after().map(|late| late + Span(1)).filter(|late| *late > now);
        let held = self.switched.map(|at| at + self.switching.hold).filter(|until| *until > now);
        let ends = self.unsure.as_ref().filter(|_| !self.unserved).and_then(|it| it.ends(self.max_age));
        let ends = ends.map(|ends| ends + Span(1)).filter(|ends| *ends > now);
        overdue.into_iter().chain(ends).chain(late).chain(held.filter(|_| self.better().is_some())).min()
    }

    pub(super) fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        if let Some(service) = &mut self.active {
            service.observe(knowledge, observation);
        }
        if let Some(unsure) = &mut self.unsure {
            unsure.observe(knowledge, observation);
        }
    }

    fn last_served(&self) -> Option<Time> {
        self.last.map(|(time, _)| time).or(self.started)
    }

    /// Looks again for what may serve the need.
    fn find_sources(&mut self, situation: &Situation<'_>) {
        let Situation { knowledge, graph, ready_sources, monitor, now, .. } = situation;
        let [proven, returning, unproven] = &situation.lost;
        let find = |lost| ready_sources.sources(knowledge, graph, self.need, lost);
        let mut tried = [proven, returning, unproven].into_iter().map(|lost| (lost, find(lost)));
        let found = tried.find(|(_, sources)| !sources.is_empty());
        let (lost, sources) = found.unwrap_or_else(|| (returning, Arc::default()));
        // What serves only for want of anything that is trusted.
        self.is_unproven = !sources.is_empty() && core::ptr::eq(lost, unproven);
        self.sources = sources;
        self.is_alone = false;
        let active = self.active.as_ref().map(Service::way);
        if self.forced.is_none() && !self.sources.iter().any(|source| Some(&source.way) == active) {
            self.note_refused(knowledge, graph, ready_sources, lost);
        }
        self.rank(knowledge, monitor, Some(*now));
    }

    /// Starts the best source; whether there is one.
    fn start_best(&mut self, knowledge: &KnowledgeBase, ports: &IdVec<SignalId, Port>) -> bool {
        let best = self.ranked().next().map(|(source, _)| source.way.clone());
        self.start(knowledge, best, ports)
    }

    /// Starts the best source in the place of one that was lost, of those whose newest value is fit where there are any; whether
    /// there is one. What it knows already that is newer
    /// than what was published last goes out at once.
    fn replace_by_best(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Time) -> bool {
        let first = || self.ranked().next().map(|(source, _)| source.way.clone());
        let best = self.fittest(monitor, now, false).or_else(first);
        let since = self.last.map(|(_, sample)| sample.validity.to);
        let service = best.and_then(|way| Service::start(knowledge, way, monitor.ports(), since));
        self.take_over(knowledge, service);
        self.active.is_some()
    }

    fn start(&mut self, knowledge: &KnowledgeBase, way: Option<Way>, ports: &IdVec<SignalId, Port>) -> bool {
        let service = way.and_then(|way| Service::start(knowledge, way, ports, None));
        self.take_over(knowledge, service);
        self.active.is_some()
    }

    fn take_over(&mut self, knowledge: &KnowledgeBase, service: Option<Service>) {
        self.unfit_since = None;
        self.episode = None;
        if service.is_some() {
            self.unsure = None;
        }
        self.better_by = Better::Trusted;
        let rests_on = service.as_ref().map(|service| rests_on(knowledge, service.way()));
        self.active_rests_on = rests_on.unwrap_or_default();
        self.pace = Pace::default();
        self.active = service;
        self.delegate.retire();
    }

    /// Chooses again after the trust in a signal has changed, or an order.
    pub(super) fn replan(&mut self, situation: &Situation<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = *situation;
        let was_outdone = self.better().is_some();
        self.find_sources(situation);
        if self.forced.is_some() {
            return self.stay_forced(situation);
        }
        if !was_outdone {
            self.better_by = if situation.order.is_some() { Better::Ordered } else { Better::Trusted };
        }
        let current = self.active.as_ref().map(|service| service.way().clone());
        if current.as_ref().is_some_and(|way| self.sources.iter().any(|source| source.way == *way)) {
            return None;
        }
        let lost = current.map(|way| way.describe(knowledge));
        let order = situation.order.as_deref();
        if !self.replace_by_best(knowledge, monitor, now) {
            let because = lost.map(|lost| match order {
                Some(order) => format!("{order}: {lost} is left, and nothing else is trusted"),
                None => format!("{lost} was lost and nothing else is trusted"),
            });
            return self.do_without(situation, because);
        }
        self.switched = Some(now);
        // Where nothing was lost, the need was not served: the first value tells that it is again.
        let why = match order {
            Some(order) => format!("{order}: {} is left", lost?),
            None => format!("{} is not trusted any more", lost?),
        };
        let because = format!("{why}; {}", self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    fn tell_unserved(
        &mut self,
        knowledge: &KnowledgeBase,
        because: Option<String>,
        now: Time,
    ) -> Option<Event> {
        let because = because.filter(|_| !self.unserved)?;
        self.unserved = true;
        // Who is served again and again for a moment only is told so when it lasts.
        self.is_wary = self.served_again.is_some_and(|at| now - at < self.switching.probation);
        self.is_uncertain = false;
        Some(self.event(knowledge, EventKind::Unhealable, because, now))
    }

    fn event(&self, knowledge: &KnowledgeBase, kind: EventKind, because: String, time: Time) -> Event {
        let serving = || self.unsure_words(knowledge).or_else(|| self.active_words(knowledge));
        let substitution = if kind == EventKind::Unhealable { None } else { serving() };
        let about = Event::new(time, kind, Some(self.variable), because);
        Event { substitution, need: Some(self.need), ..about }
    }

    /// The chosen source and the next ones, with their utilities.
    fn alternatives(&self, knowledge: &KnowledgeBase) -> String {
        let named = |(source, ranked): (&Source, &Ranked)| {
            let proof = self.proof(knowledge, ranked);
            format!("{} (utility {:.3}{proof})", source.way.describe(knowledge), ranked.utility)
        };
        let active = self.active.as_ref().map(Service::way);
        let is_chosen = |(source, _): &(&Source, &Ranked)| active == Some(&source.way);
        let chosen = self.ranked().find(is_chosen).map(named);
        let others: Vec<String> =
            self.ranked().filter(|source| !is_chosen(source)).take(MOST_NAMED).map(named).collect();
        let others = match others.is_empty() {
            true => "nothing else is left".to_string(),
            false => format!("next would be {}", others.join(", then ")),
        };
        format!("{} takes over; {others}", chosen.unwrap_or_default())
    }

    /// Whether the newest value of a way is fit, as far as the way is watched.
    fn delivers(&self, monitor: &Monitor, way: &Way, now: Time) -> bool {
        let watched = monitor.find(way).and_then(|index| monitor.way(index));
        let fit = |sample: &Sample| self.is_fit(sample, now);
        watched.is_none_or(|watched| watched.outputs.newest(0).is_some_and(fit))
    }

    /// The source that is preferred, or else better than the one in use by more than the hysteresis, with and without
    /// how the two have run: a record alone makes nobody leave a source that is sound.
    fn better(&self) -> Option<&Way> {
        let (best, active) = (self.sources.first()?, self.active.as_ref()?.way());
        if best.way == *active || self.forced.is_some() {
            return None;
        }
        if self.preferred.as_ref() == Some(&best.way) {
            return Some(&best.way);
        }
        let (current, ranked) = self.ranked().find(|(source, _)| source.way == *active)?;
        let is_above = |one: f64, other: f64| one > other + self.switching.hysteresis * other.abs();
        let is_better = |other: &(&Source, &Ranked)| {
            is_above(other.0.utility, current.utility) && is_above(other.1.utility, ranked.utility)
        };
        self.ranked().find(is_better).map(|(source, _)| &source.way)
    }

    /// Goes back to a better source when the hold time is over.
    fn go_back(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, now: Time) -> Option<Event> {
        let held = self.switched.is_some_and(|at| now < at + self.switching.hold);
        let better = self.better().filter(|_| !held)?;
        if !self.delivers(monitor, better, now) || self.is_short(better, now) {
            return None;
        }
        let better = Some(better.clone());
        let left = self.active.as_ref().map(|service| service.way().describe(knowledge)).unwrap_or_default();
        let better_by = self.better_by;
        self.start(knowledge, better, monitor.ports());
        self.switched = Some(now);
        let why = match better_by {
            Better::Changed => "the changed model has a better source",
            Better::Ordered => "its better source may serve it again by order of the operator",
            Better::Trusted => "its better source is trusted again",
        };
        Some(self.event(knowledge, EventKind::Restored, format!("{why}; before: {left}"), now))
    }

    /// Publishes what this moment brings.
    pub(super) fn provide(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        judge: &Judge,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        self.started.get_or_insert(now);
        if self.has_refused() {
            tell(outputs, self.tell_refused(knowledge, now));
        }
        if !self.short.is_empty() {
            self.follow_short(monitor, now);
        }
        if self.better().is_some() {
            tell(outputs, self.go_back(knowledge, monitor, now));
        }
        let trusts = |way: &WatchedWay| judge.trusts_way(way);
        // What is only doubted is better than nothing.
        let mut doubted = None;
        let fault = match self.given(knowledge, monitor, now, outputs) {
            Some((PublishedValue::Scalar(value), validity)) => {
                let sample = Sample { validity, value };
                let votes = monitor.votes(self.variable, &self.active_rests_on, sample, trusts);
                let fault = match self.unfit_since {
                    Some(_) => Some(Fault::Unfit),
                    None if self.forced.is_some() => None,
                    None => votes.is_doubted().then_some(Fault::Contradicted),
                };
                let is_usable = self.unfit_since.is_none() && !votes.is_contradicted();
                doubted = is_usable.then_some(sample);
                if fault.is_none() {
                    return self.publish_own(knowledge, monitor, sample, now, outputs);
                }
                fault
            }
            Some((vector, validity)) if self.unfit_since.is_none() => {
                return self.publish(knowledge, vector, validity, now, outputs);
            }
            Some(_) => None,
            None => self.is_late(now).then_some(Fault::Late),
        };
        if let Some(fault) = fault
            && let Some((sample, server)) =
                self.stand_in(knowledge, monitor, trusts, (now, fault == Fault::Late))
        {
            self.unsure = None;
            if let Server::StandIn(way) = server {
                let event = self.note_stand_in(knowledge, monitor, way, fault, now);
                tell(outputs, event);
            }
            return self.publish_sample(knowledge, (sample, server), now, outputs);
        }
        if let Some(sample) = doubted {
            return self.publish_own(knowledge, monitor, sample, now, outputs);
        }
        if fault == Some(Fault::Contradicted) {
            self.doubt(knowledge, monitor.ports(), now);
        }
        self.provide_uncertain(knowledge, monitor, now, outputs);
    }

    /// Whether a value is as new and as narrow as the need asks.
    fn is_fit(&self, sample: &Sample, now: Time) -> bool {
        now - sample.validity.to <= self.max_age && sample.value.width() <= self.max_width
    }

    /// The source gives the value of this moment itself.
    fn publish_own(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        sample: Sample,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        self.unsure = None;
        if self.episode.is_some() {
            tell(outputs, self.note_own(knowledge, monitor, now));
        }
        let server = Server::Active { since: self.switched };
        self.publish_sample(knowledge, (sample, server), now, outputs);
    }

    fn publish_sample(
        &mut self,
        knowledge: &KnowledgeBase,
        (sample, server): (Sample, Server),
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        let wraps = knowledge.variables()[self.variable].wraps;
        let Sample { value, validity } = self.blended(sample, (server, wraps), now);
        self.publish(knowledge, PublishedValue::Scalar(value), validity, now, outputs);
    }

    /// The value to publish: while a blend lasts, moved towards the last value and grown so that it still holds
    /// the new one, unless it were too wide then.
    fn blended(&mut self, sample: Sample, (server, wraps): (Server, Option<f64>), now: Time) -> Sample {
        if self.server.replace(server) != Some(server) {
            let beside =
                |value: Interval| wraps.map_or(value, |turn| circle::nearest(value, sample.value, turn));
            let from = self.last.map(|(_, last)| beside(last.value).midpoint() - sample.value.midpoint());
            self.blend = from.filter(|_| self.switching.blend > Span::ZERO).map(|amount| (amount, now));
        }
        let Some((amount, began)) = self.blend else { return sample };
        let left = 1.0 - (now - began).seconds() / self.switching.blend.seconds();
        if left <= 0.0 {
            self.blend = None;
            return sample;
        }
        let shift = amount * left;
        let moved = Interval::new(sample.value.lo() + shift, sample.value.hi() + shift);
        let value = moved.widened(shift.abs());
        let is_fit = value.is_bounded() && value.width() <= self.max_width;
        if is_fit { Sample { value, ..sample } } else { sample }
    }

    fn publish(
        &mut self,
        knowledge: &KnowledgeBase,
        value: PublishedValue,
        validity: Validity,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        if let Some((time, _)) = self.last {
            self.longest_gap = self.longest_gap.max(now - time);
        }
        let scalar = match value {
            PublishedValue::Scalar(value) => value,
            PublishedValue::Vector(_) => Interval::EMPTY,
        };
        self.widest = self.widest.max(scalar.width());
        tell(outputs, self.tell_served(knowledge, now));
        self.last = Some((now, Sample { validity, value: scalar }));
        self.published += 1;
        let value = match value {
            PublishedValue::Scalar(value) => {
                PublishedValue::Scalar(knowledge.variables()[self.variable].brought_back(value))
            }
            vector @ PublishedValue::Vector(_) => vector,
        };
        let is_preferred = self.active.as_ref().map(Service::way) == self.preferred.as_ref();
        let stands_in = matches!(self.server, Some(Server::StandIn(_)));
        let is_own = is_preferred && !stands_in && !self.is_doubted;
        let delegated = self.delegate.has_given() && !stands_in;
        let quality = match self.server {
            Some(Server::Unsure) => Quality::Uncertain,
            _ if self.is_unproven && !stands_in => Quality::Uncertain,
            _ if is_own => Quality::Good,
            _ => Quality::Substitute,
        };
        outputs.push_back(Output::Publication(Publication {
            need: self.need,
            time: now,
            validity,
            value,
            quality,
            delegated,
        }));
    }

    /// Tells that the need is served again, and that it is by what is trusted.
    fn tell_served(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let is_certain = self.server != Some(Server::Unsure) && !self.is_unproven;
        let was_uncertain = is_certain && core::mem::take(&mut self.is_uncertain);
        let is_break = self.last.is_none_or(|(last, _)| now - last > self.max_age);
        if is_break || self.steady_since.is_none() {
            self.steady_since = Some(now);
        }
        if !self.unserved {
            let because = || "what serves it is trusted again".to_string();
            return was_uncertain.then(|| self.event(knowledge, EventKind::Restored, because(), now));
        }
        let lasts = self.steady_since.is_some_and(|since| now - since >= self.switching.probation);
        if self.is_wary && !lasts {
            return None;
        }
        self.unserved = false;
        self.served_again = Some(now);
        let because = match is_certain {
            true => "it is served again".to_string(),
            false => "it is served again, as uncertain".to_string(),
        };
        Some(self.event(knowledge, EventKind::Restored, because, now))
    }

    /// Tells when the need has not been served for longer than a value may be old.
    fn check_age(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let age = now - self.last_served()?;
        if age <= self.max_age || self.unserved {
            return None;
        }
        let limits = format!("limits: age {}, width {}", reason::span(self.max_age), self.max_width);
        let age = reason::span(age);
        let because = match &self.forced {
            Some(way) => format!(
                "no value for {age} from {}, which alone may serve it by order of the operator: what it gives is too \
                 wide or too old ({limits})",
                way.describe(knowledge)
            ),
            None => match self.why_not_uncertain(knowledge) {
                Some(why) => format!("no value for {age}: {why}"),
                None => {
                    format!(
                        "no value for {age}: what is there is contradicted, too wide or too old ({limits})"
                    )
                }
            },
        };
        self.tell_unserved(knowledge, Some(because), now)
    }
}
