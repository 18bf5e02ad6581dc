//! One run of the loop with a fault, and its measures, which are taken during the run.

use super::grid::Trial;
use shsa_core::engine::{Event, EventKind, Input, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, NeedId, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time, Validity};
use shsa_format::drive::{Given, Run};
use shsa_recording::Sample;
use std::convert::Infallible;
use std::ops::ControlFlow;

/// A decision that accuses a signal, a relation or a common cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alarm {
    /// When it was decided.
    pub time: Time,
    /// Suspected, failed or silent.
    pub kind: EventKind,
    /// The signal, if it is one.
    pub signal: Option<SignalId>,
}

/// The common data of all runs in a session: the recording, and the results without a fault.
pub struct Baseline<'a> {
    /// The model.
    pub knowledge: &'a KnowledgeBase,
    /// The samples in the order of reception; `wanted` is the index of the signal.
    pub samples: &'a [Sample],
    /// The origin of the times of faults.
    pub origin: Time,
    /// When the first sample was received.
    pub first: Time,
    /// When the last sample was received.
    pub last: Time,
    /// The alarms without a fault, in the order of time.
    pub alarms: Vec<Alarm>,
    /// The values of each need, in the order of time.
    values: Vec<Vec<(Time, PublishedValue)>>,
}

/// The effect of a fault on a need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Served {
    /// The largest distance to the values of the clean run, SI; 0 where intervals overlap.
    pub error: f64,
    /// Whether the need lacked a value for longer than permitted, and longer than in the clean run.
    pub unmet: bool,
}

/// The measures of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Alarms before the fault.
    pub early: usize,
    /// Whether the signal was already accused when its fault began; then no further alarm is necessary.
    pub accused: bool,
    /// From the fault's beginning to the first alarm that the clean run lacks.
    pub latency: Option<Span>,
    /// Whether the faulty signal was named: failed or silent.
    pub named: bool,
    /// Whether another signal was named.
    pub blamed_other: bool,
    /// Whether a relation or a common cause failed.
    pub blamed_shared: bool,
    /// The effect on each need, in the order of the needs.
    pub needs: Vec<Served>,
}

impl Measured {
    /// Whether the faulty signal was named, and nothing else.
    pub fn is_isolated(&self) -> bool {
        self.named && !self.blamed_other && !self.blamed_shared
    }
}

impl<'a> Baseline<'a> {
    /// Runs the recording without a fault; `None` if it has no samples.
    pub fn new(knowledge: &'a KnowledgeBase, origin: Time, samples: &'a [Sample]) -> Option<Baseline<'a>> {
        let (first, last) = (samples.first()?.received, samples.last()?.received);
        let mut values = vec![Vec::new(); knowledge.needs().len()];
        let mut alarms = Vec::new();
        drive(knowledge, samples.iter(), first, last, |run| {
            alarms.extend(run.events.drain(..).filter_map(|event| alarm(&event)));
            for publication in run.publications.drain(..) {
                if let Some(values) = values.get_mut(publication.need.index()) {
                    values.push((publication.time, publication.value));
                }
            }
            ControlFlow::Continue(())
        });
        Some(Baseline { knowledge, samples, origin, first, last, alarms, values })
    }

    /// Runs the recording with a fault until the fault ends; `None` if the fault changes no value.
    ///
    /// Memory: that of the engine and the samples of the faulty signal; publications are not kept.
    pub fn measure(&self, trial: &Trial, signal: SignalId) -> Option<Measured> {
        self.run(trial, signal, |_| ControlFlow::Continue(()))
    }

    /// Runs up to the first alarm and returns its latency, `Some(None)` if there was none; `None` as for [`Baseline::measure`].
    pub fn first_alarm(&self, trial: &Trial, signal: SignalId) -> Option<Option<Span>> {
        let until_alarm = |measured: &Measured| match measured.latency {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        };
        self.run(trial, signal, until_alarm).map(|measured| measured.latency)
    }

    /// Runs as long as `goes_on` continues.
    fn run(
        &self,
        trial: &Trial,
        signal: SignalId,
        goes_on: impl Fn(&Measured) -> ControlFlow<()>,
    ) -> Option<Measured> {
        let target = signal.index();
        let clean = self.samples.iter().filter(|sample| sample.wanted == target);
        let mut own: Vec<Sample> = clean.clone().cloned().collect();
        let scaling = self.knowledge.signals()[signal].scaling;
        trial.fault.inject(&mut own, target, scaling, self.origin, trial.seed);
        let is_before_end = |sample: &&Sample| sample.received < trial.end;
        if own.iter().take_while(is_before_end).eq(clean.take_while(is_before_end)) {
            return None;
        }
        let others = self.samples.iter().filter(|sample| sample.wanted != target);
        let samples = merged(others, own.iter()).take_while(is_before_end);
        let onset = self.origin + trial.fault.from;
        let mut watch = Watch::new(self, signal, Validity { from: onset, to: trial.end });
        drive(self.knowledge, samples, self.first, trial.end, |run| {
            watch.listen(run);
            goes_on(&watch.measured)
        });
        Some(watch.finish())
    }

    /// The longest time without a value of a need in the clean run, among gaps that end within a stretch or are cut by its end.
    fn clean_gap(&self, values: &[(Time, PublishedValue)], stretch: Validity) -> Span {
        let begin = values.partition_point(|(time, _)| *time < stretch.from);
        let end = values.partition_point(|(time, _)| *time <= stretch.to);
        let before = begin.checked_sub(1).and_then(|at| values.get(at)).map_or(self.first, |(time, _)| *time);
        let within = values.get(begin..end).unwrap_or_default().iter().map(|(time, _)| *time);
        let mut last = before;
        let gaps = within.chain([stretch.to]).map(|time| time - std::mem::replace(&mut last, time));
        gaps.max().unwrap_or(Span::ZERO)
    }
}

/// Drives a new engine over samples to the end; `observe` takes the outputs after each input, and may stop the run.
fn drive<'s>(
    knowledge: &KnowledgeBase,
    samples: impl Iterator<Item = &'s Sample>,
    first: Time,
    end: Time,
    mut observe: impl FnMut(&mut Run) -> ControlFlow<()>,
) {
    let mut record = |_: Given<'_>| Ok::<(), Infallible>(());
    let mut run = Run::new(knowledge, first);
    for sample in samples {
        let Ok(()) = run.pass_until(sample.received, &mut record);
        let input = Input::Observation(Observation {
            signal: SignalId::from_index(sample.wanted),
            stamp: sample.time,
            received: sample.received,
            value: sample.value.clone(),
        });
        let Ok(()) = run.take(&input, &mut record);
        if observe(&mut run).is_break() {
            return;
        }
    }
    let Ok(()) = run.pass_until(end, &mut record);
    let Ok(()) = run.take(&Input::Tick(end), &mut record);
    let _ = observe(&mut run);
}

/// Merges both in the order of reception.
fn merged<'s>(
    others: impl Iterator<Item = &'s Sample>,
    own: impl Iterator<Item = &'s Sample>,
) -> impl Iterator<Item = &'s Sample> {
    let (mut others, mut own) = (others.peekable(), own.peekable());
    std::iter::from_fn(move || match (others.peek(), own.peek()) {
        (Some(other), Some(one)) if one.received < other.received => own.next(),
        (Some(_), _) => others.next(),
        (None, _) => own.next(),
    })
}

fn alarm(event: &Event) -> Option<Alarm> {
    let Event { time, kind, signal, .. } = *event;
    kind.accuses().then_some(Alarm { time, kind, signal })
}

/// The measures of a run under way.
struct Watch<'a> {
    baseline: &'a Baseline<'a>,
    signal: SignalId,
    /// From the beginning to the end of the fault.
    fault: Validity,
    measured: Measured,
    /// For each need, the time of its latest value, and its longest gap.
    gaps: Vec<(Time, Span)>,
}

impl<'a> Watch<'a> {
    fn new(baseline: &'a Baseline<'a>, signal: SignalId, fault: Validity) -> Watch<'a> {
        let count = baseline.values.len();
        let needs = vec![Served { error: 0.0, unmet: false }; count];
        let measured = Measured {
            early: 0,
            accused: false,
            latency: None,
            named: false,
            blamed_other: false,
            blamed_shared: false,
            needs,
        };
        Watch { baseline, signal, fault, measured, gaps: vec![(baseline.first, Span::ZERO); count] }
    }

    fn listen(&mut self, run: &mut Run) {
        for event in run.events.drain(..) {
            if event.time < self.fault.from && event.signal == Some(self.signal) {
                self.measured.accused = event.kind != EventKind::Restored;
            }
            alarm(&event).into_iter().for_each(|alarm| self.observe(alarm));
        }
        for publication in run.publications.drain(..) {
            self.see(publication.need, publication.time, &publication.value);
        }
    }

    fn observe(&mut self, alarm: Alarm) {
        let Alarm { time, kind, signal } = alarm;
        if time < self.fault.from {
            self.measured.early += 1;
            return;
        }
        if self.is_of_clean_run(&alarm) {
            return;
        }
        self.measured.latency.get_or_insert(time - self.fault.from);
        if kind != EventKind::Suspected {
            match signal {
                Some(signal) if signal == self.signal => self.measured.named = true,
                Some(_) => self.measured.blamed_other = true,
                None => self.measured.blamed_shared = true,
            }
        }
    }

    fn is_of_clean_run(&self, alarm: &Alarm) -> bool {
        let alarms = &self.baseline.alarms;
        let from = alarms.partition_point(|clean| clean.time < alarm.time);
        alarms.iter().skip(from).take_while(|clean| clean.time == alarm.time).any(|clean| clean == alarm)
    }

    fn see(&mut self, need: NeedId, time: Time, value: &PublishedValue) {
        let Some((last, gap)) = self.gaps.get_mut(need.index()) else { return };
        let since = time - std::mem::replace(last, time);
        if time < self.fault.from {
            return;
        }
        *gap = since.max(*gap);
        let clean = self.baseline.values.get(need.index()).map(Vec::as_slice).unwrap_or_default();
        let standing = clean.partition_point(|(at, _)| *at <= time).checked_sub(1);
        let distance = standing.and_then(|at| clean.get(at)).map_or(0.0, |(_, clean)| distance(value, clean));
        if let Some(served) = self.measured.needs.get_mut(need.index()) {
            served.error = served.error.max(distance);
        }
    }

    fn finish(mut self) -> Measured {
        let needs = self.baseline.knowledge.needs().iter().zip(&self.baseline.values);
        for ((need, clean), ((last, gap), served)) in
            needs.zip(self.gaps.iter().zip(&mut self.measured.needs))
        {
            let gap = (self.fault.to - *last).max(*gap);
            served.unmet = gap > need.max_age && gap > self.baseline.clean_gap(clean, self.fault);
        }
        self.measured
    }
}

/// The distance of two values; for lists, the largest distance of the elements that both have.
fn distance(value: &PublishedValue, clean: &PublishedValue) -> f64 {
    match (value, clean) {
        (PublishedValue::Scalar(one), PublishedValue::Scalar(other)) => apart(*one, *other),
        (PublishedValue::Vector(ones), PublishedValue::Vector(others)) => {
            let distances = ones.iter().zip(others).map(|(one, other)| apart(*one, *other));
            distances.filter(|distance| distance.is_finite()).fold(0.0, f64::max)
        }
        _ => f64::INFINITY,
    }
}

/// The distance of two intervals; 0 if they touch within the rounding of their bounds.
fn apart(one: Interval, other: Interval) -> f64 {
    let distance = one.distance(other);
    let rounding = 4.0 * f64::EPSILON * one.magnitude().max(other.magnitude());
    if distance <= rounding { 0.0 } else { distance }
}
