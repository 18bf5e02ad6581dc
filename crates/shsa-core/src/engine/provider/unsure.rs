//! All that could serve a need is suspect: one of the candidates lies, and nothing tells which.
//!
//! Of n candidates of which f lie, the truth lies in the intervals of n - f at least. What lies between the smallest and the
//! largest of such values is the fault-tolerant interval (K. Marzullo, "Tolerating failures of continuous-valued sensors",
//! 1990, doi:10.1145/128733.128735); of two candidates it is the hull of both. f is the size of the smallest explanation: so many
//! have to be left out that the others have a value in common, and at least one.

use super::super::message::{Event, EventKind, Output, PublishedValue};
use super::super::reason;
use super::super::ways::Source;
use super::{Provider, Server, Situation};
use crate::alignment::{Port, Sample};
use crate::circle;
use crate::computation::Computed;
use crate::interval::Interval;
use crate::knowledge::{
    CauseId, IdVec, KnowledgeBase, RelationId, SignalId, SignalSet, Variable, WhenUnsure,
};
use crate::monitor::{Monitor, rests_on};
use crate::observation::Observation;
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::collections::{BTreeSet, VecDeque};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// What serves a need that nothing trusted can serve.
#[derive(Debug)]
pub(super) struct Unsure {
    kind: WhenUnsure,
    candidates: Vec<Candidate>,
    /// The most that had to be left out at a moment, for the others to agree.
    faults: usize,
    /// The last value that was trusted, for [`WhenUnsure::Last`].
    trusted: Option<Sample>,
    /// A candidate has said something since the last value.
    is_heard: bool,
    /// Why nothing trusted is left; until it is told how it goes on.
    reason: Option<String>,
    /// Since when; nobody is suspect yet while there still is a source.
    since: Time,
    /// Whether it was told that values go out as uncertain.
    is_told: bool,
    /// The width of what would have gone out last, had it been narrow enough.
    too_wide: Option<f64>,
    /// Room for the intervals of a moment.
    present: Vec<Interval>,
}

/// One way that may be right.
#[derive(Debug)]
struct Candidate {
    service: Service,
    rests_on: SignalSet,
    latest: Option<Sample>,
}

impl Unsure {
    pub(super) fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        for candidate in &mut self.candidates {
            candidate.service.observe(knowledge, observation);
            self.is_heard |= candidate.rests_on.contains(observation.signal);
        }
    }

    /// When the last trusted value is too old.
    pub(super) fn ends(&self, max_age: Span) -> Option<Time> {
        self.trusted.filter(|_| self.kind == WhenUnsure::Last).map(|last| last.validity.to + max_age)
    }

    /// What goes out, in words.
    fn describe(&self, knowledge: &KnowledgeBase) -> String {
        let names = self.candidates.iter().map(|it| it.service.way().describe(knowledge));
        let names = names.collect::<Vec<_>>().join("; ");
        match (self.kind, self.candidates.len(), self.faults) {
            (WhenUnsure::Last, ..) => String::from("the last trusted value"),
            (_, 2, _) => format!("hull of {names}"),
            (_, count, faults) => {
                format!("what {} of {count} hold possible: {names}", count.saturating_sub(faults))
            }
        }
    }

    /// What the candidates say together at the newest moment of any; `None` where too few speak.
    ///
    /// Complexity: O(n^2) for n candidates, no allocation.
    fn together(
        &mut self,
        (max_rate, wraps): (f64, Option<f64>),
        max_age: Span,
        now: Time,
    ) -> Option<Sample> {
        let fresh = |sample: &Sample| now - sample.validity.to <= max_age;
        let known = || self.candidates.iter().filter_map(|it| it.latest).filter(fresh);
        let moment = known().map(|sample| sample.validity).max_by_key(|validity| validity.to)?;
        let brought = |sample: Sample| {
            let gap = (moment.to - sample.validity.to).seconds();
            if gap > 0.0 { sample.value.widened(gap * max_rate) } else { sample.value }
        };
        self.present.clear();
        self.present.extend(known().map(brought));
        // What wraps is put together in one turn.
        if let (Some(turn), Some(&first)) = (wraps, self.present.first()) {
            self.present.iter_mut().for_each(|it| *it = circle::nearest(*it, first, turn));
        }
        let at_least = |count: usize| tolerant(&self.present, self.present.len().saturating_sub(count));
        let agreeing = self.present.iter().map(|it| holding(&self.present, it.lo())).max()?;
        let faults = self.faults.max(self.present.len() - agreeing).max(1);
        let value = at_least(faults)?;
        self.faults = faults;
        Some(Sample { validity: moment, value })
    }
}

/// How many intervals hold a value.
fn holding(all: &[Interval], value: f64) -> usize {
    all.iter().filter(|it| it.lo() <= value && value <= it.hi()).count()
}

/// From the smallest to the largest value that lies in so many of the intervals; `None` where none does, or none is asked.
fn tolerant(all: &[Interval], count: usize) -> Option<Interval> {
    if count == 0 {
        return None;
    }
    // Where the number of intervals about a value grows, one begins there; where it falls, one ends there.
    let is_held = |value: &f64| holding(all, *value) >= count;
    let lo = all.iter().map(|it| it.lo()).filter(is_held).reduce(f64::min)?;
    let hi = all.iter().map(|it| it.hi()).filter(is_held).reduce(f64::max)?;
    let value = Interval::new(lo, hi);
    value.is_bounded().then_some(value)
}

impl Provider {
    /// What may be right, where nothing is trusted; else it may have to be told that the need is not served.
    pub(super) fn provide_uncertain(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) {
        if let Some((sample, server)) = self.uncertain(knowledge, monitor.ports(), now) {
            self.server = Some(server);
            self.blend = None;
            super::tell(outputs, self.tell_uncertain(knowledge, now));
            let Sample { value, validity } = sample;
            return self.publish(knowledge, PublishedValue::Scalar(value), validity, now, outputs);
        }
        super::tell(outputs, self.tell_nothing_certain(knowledge, now));
        super::tell(outputs, self.check_age(knowledge, now));
    }

    /// Nothing trusted can serve the need: goes on with what may be right, or tells that it is not served.
    pub(super) fn do_without(&mut self, situation: &Situation<'_>, because: Option<String>) -> Option<Event> {
        let Situation { knowledge, now, .. } = *situation;
        if !self.begin_unsure(situation, because.clone()) {
            self.unsure = None;
            return self.tell_unserved(knowledge, because, now);
        }
        None
    }

    fn begin_unsure(&mut self, situation: &Situation<'_>, because: Option<String>) -> bool {
        let Situation { knowledge, graph, ready_sources, monitor, now, .. } = *situation;
        if self.when_unsure == WhenUnsure::Withhold || self.is_vector {
            return false;
        }
        let sources = ready_sources.sources(knowledge, graph, self.need, &situation.doubted);
        let ways = independent(knowledge, &sources);
        let is_enough = match self.when_unsure {
            WhenUnsure::Last => !ways.is_empty(),
            _ => ways.len() > 1,
        };
        if !is_enough {
            return false;
        }
        let before = self.unsure.take();
        let is_same = |unsure: &Unsure| unsure.candidates.iter().map(|it| it.service.way()).eq(ways.iter());
        if let Some(before) = before {
            let reason = because.or_else(|| before.reason.clone());
            if is_same(&before) {
                self.unsure = Some(Unsure { reason, ..before });
                return true;
            }
            self.unsure = Some(Unsure {
                candidates: candidates(knowledge, monitor.ports(), ways),
                faults: 1,
                ..before
            });
            self.make_room();
            return true;
        }
        self.unsure = Some(self.unsure_from(candidates(knowledge, monitor.ports(), ways), because, now));
        self.make_room();
        true
    }

    /// The source is contradicted, and nothing can stand in for it: before anybody is suspect, what may be right goes on when the
    /// need is about to be overdue.
    pub(super) fn doubt(&mut self, knowledge: &KnowledgeBase, ports: &IdVec<SignalId, Port>, now: Time) {
        let is_due = self.last_served().is_none_or(|last| now - last > Span(self.max_age.0 / 2));
        let is_hull = self.when_unsure == WhenUnsure::Hull && !self.is_vector;
        if self.unsure.is_some() || self.is_alone || !is_due || !is_hull {
            return;
        }
        let ways = independent(knowledge, &self.sources);
        self.is_alone = ways.len() < 2;
        if !self.is_alone {
            let because = self.active_words(knowledge).map(|source| format!("{source} is contradicted"));
            self.unsure = Some(self.unsure_from(candidates(knowledge, ports, ways), because, now));
            self.make_room();
        }
    }

    fn unsure_from(&self, candidates: Vec<Candidate>, reason: Option<String>, since: Time) -> Unsure {
        Unsure {
            kind: self.when_unsure,
            candidates,
            faults: 1,
            trusted: self.last.map(|(_, sample)| sample).filter(|sample| !sample.value.is_empty()),
            is_heard: true,
            reason,
            since,
            // So it was before a change of the model, too.
            is_told: self.is_uncertain,
            too_wide: None,
            present: Vec::new(),
        }
    }

    fn make_room(&mut self) {
        if let Some(unsure) = &mut self.unsure {
            unsure.present.reserve(unsure.candidates.len());
        }
    }

    /// What serves the need while nothing trusted does, in words.
    pub(super) fn unsure_words(&self, knowledge: &KnowledgeBase) -> Option<String> {
        self.unsure.as_ref().filter(|unsure| unsure.is_told).map(|unsure| unsure.describe(knowledge))
    }

    /// The uncertain value of this moment, where there is news and it is fit.
    pub(super) fn uncertain(
        &mut self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        now: Time,
    ) -> Option<(Sample, Server)> {
        let Variable { max_rate, wraps, .. } = knowledge.variables()[self.variable];
        let max_rate = max_rate.unwrap_or(0.0);
        let unsure = self.unsure.as_mut()?;
        let mut is_news = core::mem::take(&mut unsure.is_heard) && unsure.kind == WhenUnsure::Last;
        for candidate in &mut unsure.candidates {
            let given = candidate.service.compute(ports, None);
            if let Some((Computed::Scalar(value), validity)) = given
                && value.is_bounded()
                && !value.is_empty()
            {
                candidate.latest = Some(Sample { validity, value });
                is_news = true;
            }
        }
        if !is_news {
            return None;
        }
        let sample = match unsure.kind {
            WhenUnsure::Last => unsure.trusted.map(|last| {
                let age = (now - last.validity.to).seconds().max(0.0);
                Sample { value: last.value.widened(age * max_rate), ..last }
            }),
            _ => unsure.together((max_rate, wraps), self.max_age, now),
        }?;
        let is_fit = self.is_fit(&sample, now);
        if let Some(unsure) = &mut self.unsure {
            unsure.too_wide = (!is_fit).then(|| sample.value.width());
        }
        is_fit.then_some((sample, Server::Unsure))
    }

    /// Tells that values go out as uncertain from now on, once.
    pub(super) fn tell_uncertain(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        let is_decided = self.active.is_none();
        let unsure = self.unsure.as_mut().filter(|unsure| !unsure.is_told)?;
        if !is_decided && now - unsure.since <= self.max_age {
            return None;
        }
        unsure.is_told = true;
        self.is_uncertain = true;
        let words = unsure.describe(knowledge);
        let reason = unsure.reason.take();
        if self.unserved {
            // The event that it is served again tells it.
            return None;
        }
        let reason = reason.map_or_else(String::new, |reason| format!("{reason}; "));
        let because = format!("{reason}it cannot be told which is right: {words} goes out as uncertain");
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    /// Tells at once where from the beginning nothing can go out, and when the last trusted value has become too old.
    pub(super) fn tell_nothing_certain(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        // While there still is a source, time tells.
        let unsure = self.unsure.as_mut().filter(|_| self.active.is_none())?;
        let is_over = unsure.ends(self.max_age).is_some_and(|ends| now > ends);
        let is_too_wide = unsure.too_wide.is_some() && !unsure.is_told;
        if !is_over && !is_too_wide {
            return None;
        }
        unsure.is_told &= !is_over;
        let reason = unsure.reason.take().map_or_else(String::new, |reason| format!("{reason}, and "));
        let because = format!("{reason}{}", self.why_not_uncertain(knowledge)?);
        self.tell_unserved(knowledge, Some(because), now)
    }

    /// Why no uncertain value goes out, in numbers.
    pub(super) fn why_not_uncertain(&self, knowledge: &KnowledgeBase) -> Option<String> {
        let unsure = self.unsure.as_ref()?;
        let words = unsure.describe(knowledge);
        let amount = |amount: f64| reason::difference(knowledge, self.variable, amount);
        Some(match (unsure.kind, unsure.too_wide) {
            (_, Some(width)) if width > self.max_width => {
                format!("{words} is {} wide, more than {}", amount(width), amount(self.max_width))
            }
            (WhenUnsure::Last, _) => format!("{words} is more than {} old", reason::span(self.max_age)),
            _ => format!("too few candidates give values: {words}"),
        })
    }
}

fn candidates(knowledge: &KnowledgeBase, ports: &IdVec<SignalId, Port>, ways: Vec<Way>) -> Vec<Candidate> {
    let candidate = |way: Way| {
        let rests_on = rests_on(knowledge, &way);
        // What it has said already counts.
        let service = Service::start(knowledge, way, ports, Some(Time::MIN))?;
        Some(Candidate { service, rests_on, latest: None })
    };
    ways.into_iter().filter_map(candidate).collect()
}

/// The best ways that have neither signals nor relations nor causes of faults in common.
fn independent(knowledge: &KnowledgeBase, sources: &[Source]) -> Vec<Way> {
    let mut taken = (SignalSet::new(), BTreeSet::<RelationId>::new(), BTreeSet::<CauseId>::new());
    let mut chosen = Vec::new();
    for Source { way, .. } in sources {
        let signals = knowledge.as_witnesses(rests_on(knowledge, way));
        let relations = way.substitution.relations();
        let causes: Vec<CauseId> = knowledge
            .causes()
            .enumerate()
            .filter(|(_, cause)| cause.signals.iter().any(|signal| signals.contains(*signal)))
            .map(|(id, _)| id)
            .collect();
        let is_new = !signals.meets(&taken.0)
            && !relations.iter().any(|relation| taken.1.contains(relation))
            && !causes.iter().any(|cause| taken.2.contains(cause))
            && !signals.is_empty()
            && !way.substitution.continues_itself(knowledge);
        if is_new {
            taken.0.extend(&signals);
            taken.1.extend(relations);
            taken.2.extend(causes);
            chosen.push(way.clone());
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(all: &[(f64, f64)], count: usize, expected: Option<(f64, f64)>) {
        let all: Vec<Interval> = all.iter().map(|(lo, hi)| Interval::new(*lo, *hi)).collect();
        assert_eq!(tolerant(&all, count).map(|value| (value.lo(), value.hi())), expected);
    }

    #[test]
    fn the_published_examples() {
        check(&[(8.0, 12.0), (11.0, 13.0), (14.0, 15.0)], 2, Some((11.0, 12.0)));
        check(&[(8.0, 12.0), (11.0, 13.0), (10.0, 12.0)], 2, Some((10.0, 12.0)));
        check(&[(0.0, 1.0), (5.0, 6.0)], 1, Some((0.0, 6.0)));
        check(&[(0.0, 1.0), (5.0, 6.0)], 2, None);
        check(&[(0.0, 1.0)], 0, None);
    }

    proptest! {
        /// As long as so many hold the truth, the interval does; and it is never wider than the hull of all.
        #[test]
        fn it_holds_the_truth_while_so_many_do(
            sound in prop::collection::vec((0.0..2.0_f64, 0.0..2.0_f64), 1..6),
            lies in prop::collection::vec((-9.0..9.0_f64, 0.0..2.0_f64), 0..6),
        ) {
            let sound = sound.iter().map(|(below, above)| Interval::new(-below, *above));
            let lies = lies.iter().map(|(lo, width)| Interval::new(*lo, lo + width));
            let count = sound.len();
            let all: Vec<Interval> = sound.chain(lies).collect();
            let value = tolerant(&all, count);
            prop_assert!(value.is_some_and(|value| value.contains(0.0)), "{value:?}");
            let hull = all.iter().fold(Interval::EMPTY, |hull, it| hull.hull(*it));
            prop_assert!(value.is_some_and(|value| hull.lo() <= value.lo() && value.hi() <= hull.hi()));
        }
    }
}
