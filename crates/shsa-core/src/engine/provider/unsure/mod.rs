//! Serves a need while all its sources are suspect: one candidate is faulty, and the faulty one is unknown.
//!
//! The published value is the [fault-tolerant interval](crate::interval::tolerant) of all candidates. The number of faulty
//! candidates is the size of the smallest explanation: the fewest candidates to leave out so that the others overlap, and at
//! least one.

use super::super::ways::Source;
use super::settings::Settings;
use super::turn::period_of;
use crate::alignment::{Port, Sample};
use crate::assurance::{Admitted, Assessments};
use crate::circle;
use crate::computation::Computed;
use crate::interval::{Interval, holding, tolerant};
use crate::knowledge::{
    CauseId, IdVec, KnowledgeBase, RelationId, SignalId, SignalSet, Variable, WhenUnsure,
};
use crate::monitor::rests_on;
use crate::observation::Observation;
use crate::reason::{Amount, Joint, Reason, Reasons, ServedBy};
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::collections::BTreeSet;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

/// The service of a need without a trusted source.
#[derive(Debug)]
pub(super) struct Unsure {
    kind: WhenUnsure,
    candidates: Vec<Candidate>,
    /// The largest number of candidates that had to be left out at a moment so that the others overlap.
    faults: usize,
    /// The last value that was trusted, for [`WhenUnsure::Last`].
    trusted: Option<Sample>,
    /// Whether a candidate has given a value since the last published one.
    has_new_input: bool,
    /// Why no trusted source is left; taken when an event reports it.
    reason: Option<Reasons>,
    /// Since when the candidates serve; without a suspect while there still is a source.
    since: Time,
    /// Whether an event has reported that values are uncertain.
    is_reported: bool,
    /// The width of the last value, if that was not fit to publish.
    too_wide: Option<f64>,
    /// What the values are called, once that was asked.
    name: Option<Arc<ServedBy>>,
    /// Buffer for the intervals of a moment.
    present: Vec<Interval>,
}

/// A way that may be right.
#[derive(Debug)]
struct Candidate {
    service: Service,
    rests_on: SignalSet,
    latest: Option<Sample>,
}

impl Unsure {
    /// The service by these ways, where they are enough for what the need demands.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        contracts: &Assessments,
        kind: WhenUnsure,
        ways: Vec<Way>,
        because: Option<Reasons>,
        since: Time,
    ) -> Unsure {
        let candidates = candidates(knowledge, ports, contracts, ways);
        Unsure {
            kind,
            faults: 1,
            trusted: None,
            has_new_input: true,
            reason: because,
            since,
            is_reported: false,
            too_wide: None,
            name: None,
            present: Vec::with_capacity(candidates.len()),
            candidates,
        }
    }

    /// Goes on from the last published value; `is_reported` shows whether an event reported this value as uncertain.
    pub(super) fn following(self, last: Option<Sample>, is_reported: bool) -> Unsure {
        let trusted = last.filter(|sample| !sample.value.is_empty());
        Unsure { trusted, is_reported, ..self }
    }

    /// Goes on with these ways, which may have changed.
    pub(super) fn goes_on(
        self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        contracts: &Assessments,
        ways: Vec<Way>,
        because: Option<Reasons>,
    ) -> Unsure {
        if self.candidates.iter().map(|it| it.service.way()).eq(ways.iter()) {
            let reason = because.or_else(|| self.reason.clone());
            return Unsure { reason, ..self };
        }
        let candidates = candidates(knowledge, ports, contracts, ways);
        let mut present = self.present;
        present.reserve(candidates.len());
        Unsure { candidates, faults: 1, present, name: None, ..self }
    }

    pub(super) fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        for candidate in &mut self.candidates {
            candidate.service.observe(knowledge, observation);
            self.has_new_input |= candidate.rests_on.contains(observation.signal);
        }
    }

    pub(super) fn begin_anew(&mut self, signal: SignalId) {
        self.candidates.iter_mut().for_each(|candidate| candidate.service.begin_anew(signal));
    }

    /// The candidates.
    pub(super) fn ways(&self) -> impl Iterator<Item = &Way> {
        self.candidates.iter().map(|it| it.service.way())
    }

    /// When the last trusted value is too old.
    pub(super) fn ends(&self, max_age: Span) -> Option<Time> {
        self.trusted.filter(|_| self.kind == WhenUnsure::Last).map(|last| last.validity.to + max_age)
    }

    /// Whether an event has reported that values are uncertain.
    pub(super) fn is_reported(&self) -> bool {
        self.is_reported
    }

    /// The admission of a value that rests on all candidates: the weakest ground, at the lowest level.
    pub(super) fn admitted(&self, contracts: &Assessments) -> Option<Admitted> {
        let of = |it: &Candidate| contracts.admit(it.service.way()).map(|assured| assured.admitted());
        let mut all = self.candidates.iter().map(of);
        let first = all.next().unwrap_or(Some(Admitted::default()))?;
        all.try_fold(first, |weakest, next| next.map(|next| weakest.weaker(next)))
    }

    /// The candidates, as events report them.
    pub(super) fn served_by(&self, knowledge: &KnowledgeBase) -> ServedBy {
        let name = |it: &Candidate| it.service.way().describe(knowledge);
        let ways = || -> Vec<String> { self.candidates.iter().map(name).collect() };
        match (self.kind, self.candidates.len(), self.faults) {
            (WhenUnsure::Last, ..) => ServedBy::LastTrusted,
            (_, 2, _) => ServedBy::Hull(ways()),
            (_, count, faults) => {
                ServedBy::Agreeing { count: count.saturating_sub(faults) as u64, ways: ways() }
            }
        }
    }

    /// The candidates, as their values share them.
    pub(super) fn name(&mut self, knowledge: &KnowledgeBase) -> Arc<ServedBy> {
        match &self.name {
            Some(name) => name.clone(),
            None => {
                let name = Arc::new(self.served_by(knowledge));
                self.name.insert(name).clone()
            }
        }
    }

    /// The shortest declared time between two values of a candidate; zero for the last trusted value, which is repeated.
    pub(super) fn period(&self, knowledge: &KnowledgeBase) -> Span {
        let period = |it: &Candidate| period_of(knowledge, it.service.computation());
        let all = self.candidates.iter().filter(|_| self.kind == WhenUnsure::Hull).map(period);
        all.min().unwrap_or(Span::ZERO)
    }

    /// The uncertain value of this moment, where a candidate has given a value and the value is fit.
    pub(super) fn value(
        &mut self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        settings: &Settings,
        now: Time,
    ) -> Option<Sample> {
        let variable = &knowledge.variables()[settings.variable];
        let mut is_news = core::mem::take(&mut self.has_new_input) && self.kind == WhenUnsure::Last;
        for candidate in &mut self.candidates {
            let given = candidate.service.compute(ports, None);
            if let Some((Computed::Scalar(value), validity)) = given
                && value.is_bounded()
                && !value.is_empty()
            {
                let stated = settings.stated(Sample { validity, value }, candidate.service.timing());
                candidate.latest = Some(stated).filter(|stated| !stated.value.is_empty());
                is_news = true;
            }
        }
        if !is_news {
            return None;
        }
        let sample = match self.kind {
            WhenUnsure::Last => self.trusted.map(|last| {
                let age = (now - last.validity.from).seconds().max(0.0);
                Sample { value: last.value.widened(age * variable.max_rate.unwrap_or(0.0)), ..last }
            }),
            _ => self.together(variable, settings.max_age, now),
        }?;
        let sample = Sample { value: settings.possible(sample.value), ..sample };
        let is_fit = settings.is_fit(&sample, now);
        self.too_wide = (!is_fit).then(|| sample.value.width());
        is_fit.then_some(sample)
    }

    /// What serves and why, when the uncertainty is to be reported: once; at once where nothing is trusted (`is_decided`), else
    /// after `max_age`.
    pub(super) fn report(
        &mut self,
        knowledge: &KnowledgeBase,
        is_decided: bool,
        max_age: Span,
        now: Time,
    ) -> Option<(ServedBy, Option<Reasons>)> {
        if self.is_reported || (!is_decided && now - self.since <= max_age) {
            return None;
        }
        self.is_reported = true;
        Some((self.served_by(knowledge), self.reason.take()))
    }

    /// Why nothing can be published, when that is to be reported: no value has been fit yet, or the last trusted value has become
    /// too old.
    pub(super) fn report_nothing(
        &mut self,
        knowledge: &KnowledgeBase,
        settings: &Settings,
        now: Time,
    ) -> Option<Reasons> {
        let is_over = self.ends(settings.max_age).is_some_and(|ends| now > ends);
        let is_too_wide = self.too_wide.is_some() && !self.is_reported;
        if !is_over && !is_too_wide {
            return None;
        }
        self.is_reported &= !is_over;
        let reason = self.reason.take().unwrap_or_default();
        Some(reason.then(Joint::And, self.why_not(knowledge, settings)))
    }

    /// Why no uncertain value is published, in numbers.
    pub(super) fn why_not(&self, knowledge: &KnowledgeBase, settings: &Settings) -> Reason {
        let &Settings { variable, max_width, max_age, .. } = settings;
        let served_by = self.served_by(knowledge);
        let amount = |amount: f64| Amount::of(knowledge, variable, amount);
        match (self.kind, self.too_wide) {
            (_, Some(width)) if width > max_width => {
                Reason::UncertainTooWide { served_by, width: amount(width), most: amount(max_width) }
            }
            (WhenUnsure::Last, _) => Reason::UncertainTooOld { served_by, most: max_age },
            _ => Reason::TooFewSpeak { served_by },
        }
    }

    /// The joint value of the candidates at their newest moment; `None` where too few have a value.
    ///
    /// Complexity: O(n^2) for n candidates, no allocation.
    fn together(&mut self, variable: &Variable, max_age: Span, now: Time) -> Option<Sample> {
        let max_rate = variable.max_rate.unwrap_or(0.0);
        let fresh = |sample: &Sample| now - sample.validity.to <= max_age;
        let known = || self.candidates.iter().filter_map(|it| it.latest).filter(fresh);
        let moment = known().map(|sample| sample.validity).max_by_key(|validity| validity.to)?;
        let brought = |sample: Sample| {
            let gap = (moment.centre() - sample.validity.centre()).seconds();
            if gap > 0.0 { sample.value.widened(gap * max_rate) } else { sample.value }
        };
        self.present.clear();
        self.present.extend(known().map(brought));
        // Values that wrap are combined within one turn.
        if let (Some(turn), Some(&first)) = (variable.wraps, self.present.first()) {
            self.present.iter_mut().for_each(|it| *it = circle::nearest(*it, first, turn));
        }
        let at_least = |count: usize| tolerant(&self.present, self.present.len().saturating_sub(count));
        let agreeing = self.present.iter().map(|it| holding(&self.present, it.lo())).max()?;
        let faults = self.faults.max(self.present.len() - agreeing).max(1);
        let value = at_least(faults)?;
        if self.faults != faults {
            (self.faults, self.name) = (faults, None);
        }
        Some(Sample { validity: moment, value })
    }
}

fn candidates(
    knowledge: &KnowledgeBase,
    ports: &IdVec<SignalId, Port>,
    contracts: &Assessments,
    ways: Vec<Way>,
) -> Vec<Candidate> {
    let candidate = |way: Way| {
        let rests_on = rests_on(knowledge, &way);
        // Values from before the start count, too.
        let service = Service::start(knowledge, contracts.admit(way)?, ports, Some(Time::MIN))?;
        Some(Candidate { service, rests_on, latest: None })
    };
    ways.into_iter().filter_map(candidate).collect()
}

/// The best ways without common signals, relations or causes of faults.
pub(super) fn independent(knowledge: &KnowledgeBase, sources: &[Source]) -> Vec<Way> {
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

/// That these ways would serve a need that states nothing of how it is served when unsure.
pub(super) fn hull_would_serve(knowledge: &KnowledgeBase, ways: &[Way]) -> Reason {
    Reason::HullWouldServe { ways: ways.iter().map(|way| way.describe(knowledge)).collect() }
}
