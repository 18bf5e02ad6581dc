//! Observes a run and records the data for its drawings. Their size does not grow with the length of the run, except for a
//! bounded number of changes of the needs' sources.

use super::case::{Admissions, Cases};
use super::thinned::{Stretches, Thinned};
use crate::bands::{BandSource, Watched};
use crate::events::is_accusation;
use crate::explanation::{Section, evidence_sections};
use core::ops::Bound;
use shsa_core::circle;
use shsa_core::engine::{Event, Publication, PublishedValue, Quality};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{WatchedWay, WayIndex};
use shsa_core::time::{Span, Time, Validity};
use shsa_format::drive::Run;
use shsa_format::words;

/// The most ways of a variable that are recorded.
const MOST_WAYS: usize = 32;
/// The most changes of a need's source, and the most explained accusations, that are recorded.
const MOST_CHANGES: usize = 2_000;
const MOST_EXPLAINED: usize = 200;

/// The record of a need.
pub(in crate::replay) struct NeedRecord {
    /// The published name.
    pub(in crate::replay) signal: String,
    pub(in crate::replay) variable: String,
    max_age: Span,
    last: Option<(Time, Quality)>,
    /// The total time with a fresh value.
    served: Span,
    pub(in crate::replay) values: Thinned,
    pub(in crate::replay) good: Stretches,
    pub(in crate::replay) substitute: Stretches,
    pub(in crate::replay) uncertain: Stretches,
    pub(in crate::replay) outages: Stretches,
    /// The sources with the times of their beginning.
    pub(in crate::replay) sources: Vec<(Time, Option<String>)>,
    pub(in crate::replay) more_sources: usize,
    pub(in crate::replay) admissions: Admissions,
}

impl NeedRecord {
    fn of(known: &KnowledgeBase, need: &shsa_core::knowledge::Need) -> NeedRecord {
        NeedRecord {
            signal: need.signal.clone(),
            variable: known.variables()[need.variable].name.clone(),
            max_age: need.max_age,
            last: None,
            served: Span::ZERO,
            values: Thinned::new(),
            good: Stretches::new(),
            substitute: Stretches::new(),
            uncertain: Stretches::new(),
            outages: Stretches::new(),
            sources: Vec::new(),
            more_sources: 0,
            admissions: Admissions::new(need.max_age),
        }
    }

    fn take(&mut self, publication: &Publication) {
        self.pass(publication.time, publication.time);
        self.last = Some((publication.time, publication.quality));
        self.admissions.take(publication);
        if let PublishedValue::Scalar(value) = &publication.value {
            self.values.push(publication.validity.centre(), *value);
        }
    }

    /// Accounts for the time until `now` without a publication; before the first value, there has been no value since `began`.
    fn pass(&mut self, now: Time, began: Time) {
        let Some((last, quality)) = self.last else {
            if began < now {
                self.outages.push(Validity { from: began, to: now });
            }
            return;
        };
        let until = now.min(last + self.max_age);
        self.served = self.served + (until - last);
        let stretches = match quality {
            Quality::Good => &mut self.good,
            Quality::Substitute => &mut self.substitute,
            Quality::Uncertain => &mut self.uncertain,
        };
        stretches.push(Validity { from: last, to: until });
        if until < now {
            self.outages.push(Validity { from: until, to: now });
        }
    }

    fn source(&mut self, at: Time, source: Option<String>) {
        if self.sources.last().is_some_and(|(_, before)| *before == source) {
            return;
        }
        match self.sources.len() < MOST_CHANGES {
            true => self.sources.push((at, source)),
            false => self.more_sources += 1,
        }
    }

    /// The share of a run with a fresh value.
    pub(in crate::replay) fn availability(&self, duration: Span) -> f64 {
        if duration > Span::ZERO { self.served.seconds() / duration.seconds() } else { 1.0 }
    }
}

/// The values of one way.
pub(in crate::replay) struct WayRecord {
    pub(in crate::replay) name: String,
    /// The signals that it rests on.
    pub(in crate::replay) rests_on: Vec<String>,
    /// `None` while the present model lacks the way.
    source: Option<BandSource>,
    last: Option<Time>,
    pub(in crate::replay) values: Thinned,
}

/// The record of a variable: its monitored ways.
pub(in crate::replay) struct VariableRecord {
    pub(in crate::replay) name: String,
    pub(in crate::replay) ways: Vec<WayRecord>,
    /// The number of further ways.
    pub(in crate::replay) more_ways: usize,
    pub(in crate::replay) conflicts: Stretches,
    watched: Vec<Watched>,
    /// For a variable that wraps: the last drawn value.
    beside: Option<Interval>,
}

/// The data of a run for the drawings on its page. Its size does not grow with the length of the run, except for a bounded number
/// of changes.
pub struct Recorder {
    pub(in crate::replay) needs: Vec<NeedRecord>,
    pub(in crate::replay) variables: Vec<VariableRecord>,
    /// The explained events, with their explanations.
    pub(in crate::replay) explained: Vec<(usize, Vec<Section>)>,
    pub(in crate::replay) cases: Cases,
    eras: Option<usize>,
    events: usize,
    first: Time,
}

impl Default for Recorder {
    fn default() -> Recorder {
        Recorder::new()
    }
}

impl Recorder {
    /// A recorder of one run.
    #[must_use]
    pub fn new() -> Recorder {
        Recorder {
            needs: Vec::new(),
            variables: Vec::new(),
            explained: Vec::new(),
            cases: Cases::default(),
            eras: None,
            events: 0,
            first: Time::MAX,
        }
    }

    /// Takes in what is new; call it after each input, with the number of publications already taken in.
    pub fn look(&mut self, run: &Run, publications: usize) {
        if self.eras.replace(run.past.len()) != Some(run.past.len()) {
            self.first = self.first.min(run.first);
            self.follow(run.engine.knowledge(), run);
        }
        self.cases.look(&run.engine, run.last);
        for (known, publication) in run.publications_with_models(publications) {
            let signal = &known.needs()[publication.need].signal;
            let first = self.first;
            let Some(need) = self.needs.iter_mut().find(|need| need.signal == *signal) else { continue };
            if need.last.is_none() {
                need.pass(publication.time, first);
                let source = run.engine.need_status(publication.need).source;
                source.iter().for_each(|source| self.cases.served(publication.need, source));
                need.source(publication.time, source.as_ref().map(words::served_by));
            }
            need.take(publication);
        }
        for number in self.events..run.events.len() {
            self.events = number + 1;
            self.observe(run, number);
        }
        for record in &mut self.variables {
            record.look(run);
        }
    }

    /// Ends the record, after the last input.
    pub fn end(&mut self, run: &Run) {
        let first = self.first.min(run.first);
        self.needs.iter_mut().for_each(|need| need.pass(run.last, first));
        self.cases.end(run.last);
    }

    /// Follows another model, whose needs and ways have other numbers; records with the same name continue.
    fn follow(&mut self, known: &KnowledgeBase, run: &Run) {
        self.cases.follow(known, &run.engine, run.last);
        for need in known.needs().iter() {
            if !self.needs.iter().any(|it| it.signal == need.signal) {
                self.needs.push(NeedRecord::of(known, need));
            }
            let name = &known.variables()[need.variable].name;
            if !self.variables.iter().any(|it| it.name == *name) {
                self.variables.push(VariableRecord::new(name.clone()));
            }
        }
        for record in &mut self.variables {
            record.follow(known.variable(&record.name), known, run);
        }
    }

    fn observe(&mut self, run: &Run, number: usize) {
        let Some((known, event)) = run.events_with_models().nth(number) else { return };
        if let Some(need) = event.need {
            let signal = &known.needs()[need].signal;
            if let Some(record) = self.needs.iter_mut().find(|it| it.signal == *signal) {
                let present = run.engine.need_status(need).source;
                let source = event.substitution.as_ref().or(present.as_ref());
                source.into_iter().for_each(|source| self.cases.served(need, source));
                record.source(event.time, source.map(words::served_by));
            }
        }
        if self.explained.len() < MOST_EXPLAINED && is_accusation(event) {
            let sections = explanation(run, known, event);
            self.explained.extend(sections.map(|sections| (number, sections)));
        }
    }
}

/// The evidence for and against the signal of an event, if the present model still has the signal.
fn explanation(run: &Run, known: &KnowledgeBase, event: &Event) -> Option<Vec<Section>> {
    let signal = run.engine.knowledge().signal(&known.signals()[event.signal?].name)?;
    let evidence = run.engine.evidence(signal, event.time);
    Some(evidence_sections(run.engine.knowledge(), run.first, &evidence, event))
}

impl VariableRecord {
    fn new(name: String) -> VariableRecord {
        let (ways, watched) = (Vec::new(), Vec::new());
        VariableRecord { name, ways, more_ways: 0, conflicts: Stretches::new(), watched, beside: None }
    }

    fn follow(&mut self, variable: Option<VariableId>, known: &KnowledgeBase, run: &Run) {
        self.ways.iter_mut().for_each(|way| way.source = None);
        self.watched.clear();
        let Some(variable) = variable else { return };
        let monitor = run.engine.monitor();
        let is_of = |way: &WatchedWay| way.variable() == variable && !way.is_range();
        let mut ways: Vec<_> =
            (0..).map(WayIndex).zip(monitor.ways()).filter(|(_, way)| is_of(way)).collect();
        // Direct signals come before computed ways.
        ways.sort_by_key(|(_, way)| way.computation.way().direct().is_none());
        let is_of_it = |index: WayIndex| ways.iter().any(|(it, _)| *it == index);
        let pairs = monitor.residuals().iter().enumerate().filter(|(_, pair)| is_of_it(pair.way));
        self.watched = pairs
            .map(|(pair, residual)| Watched { pair, last: residual.disagreement.map(|it| it.time) })
            .collect();
        for (index, watched) in ways {
            let (way, rests_on) = (watched.computation.way(), &watched.rests_on);
            let (name, source) = (way.describe(known), BandSource::Way(index, way.clone()));
            let has_room = self.ways.len() < MOST_WAYS;
            match self.ways.iter_mut().find(|it| it.name == name) {
                Some(record) => record.source = Some(source),
                None if has_room => {
                    let rests_on = rests_on.iter().map(|it| known.signals()[it].name.clone()).collect();
                    let values = Thinned::new();
                    self.ways.push(WayRecord { name, rests_on, source: Some(source), last: None, values });
                }
                None => self.more_ways += 1,
            }
        }
    }

    fn look(&mut self, run: &Run) {
        let known = run.engine.knowledge();
        let VariableRecord { name, ways, conflicts, watched, beside, .. } = self;
        let wraps = known.variable(name).map(|id| &known.variables()[id]);
        for way in ways {
            let Some(source) = &way.source else { continue };
            let from = way.last.map_or(Bound::Included(run.first), Bound::Excluded);
            source.news(&run.engine, from, Time::MAX, |sample| {
                way.last = Some(sample.validity.to);
                let value = match wraps.and_then(|variable| Some((variable, variable.wraps?))) {
                    Some((variable, turn)) => {
                        let near = beside.map(|it| circle::nearest(sample.value, it, turn));
                        near.unwrap_or_else(|| variable.brought_back(sample.value))
                    }
                    None => sample.value,
                };
                *beside = Some(value);
                let middle = sample.validity.from + Span(sample.validity.length().0 / 2);
                way.values.push(middle, value);
            });
        }
        for pair in watched {
            pair.look(&run.engine).into_iter().for_each(|stretch| conflicts.push(stretch));
        }
    }
}
