//! The error of a need while one of three ways of knowing it or more lies, beside the median of these ways.

use super::recorded::{Recorded, built};
use super::witness::{closure, ways};
use crate::voter::{Errors, PERIODS, SHARES, median, moments};
use anyhow::anyhow;
use shsa_core::engine::{Input, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{Id, KnowledgeBase, NeedId, SignalId, SignalSet, Text};
use shsa_core::monitor::WatchedWay;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::ServedBy;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};
use shsa_format::drive::{Given, Run};
use shsa_format::fault::{Fault, FaultKind};
use shsa_recording::Sample;
use std::convert::Infallible;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The forms of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Form {
    Bias,
    Scale,
    Noise,
    Stuck,
    Drop,
}

impl Form {
    pub(super) const ALL: [Form; 5] = [Form::Bias, Form::Scale, Form::Noise, Form::Stuck, Form::Drop];

    pub(super) fn name(self) -> &'static str {
        match self {
            Form::Bias => "bias",
            Form::Scale => "scale",
            Form::Noise => "noise",
            Form::Stuck => "stuck",
            Form::Drop => "drop",
        }
    }

    /// Whether a fault of this form has a size.
    fn is_sized(self) -> bool {
        !matches!(self, Form::Stuck | Form::Drop)
    }

    /// The fault of a size, in the unit of a signal with usual readings of this magnitude.
    fn kind(self, size: f64, usual: f64) -> FaultKind {
        match self {
            Form::Bias => FaultKind::Bias(size),
            Form::Scale => FaultKind::Scale(1.0 + size / usual),
            Form::Noise => FaultKind::Noise(2.0 * size.abs()),
            Form::Stuck => FaultKind::Stuck(None),
            Form::Drop => FaultKind::Drop,
        }
    }
}

/// The errors of a need while one signal lies in one form, by one share of what may be hidden.
#[derive(Clone, Debug)]
pub(super) struct Lied {
    pub(super) recording: &'static str,
    pub(super) need: String,
    pub(super) liar: String,
    pub(super) form: Form,
    /// `None` for a form without a size.
    pub(super) share: Option<f64>,
    /// Whether the need is served from the liar where nothing is wrong.
    pub(super) is_source: bool,
    pub(super) errors: Errors,
    /// Good values that are further off than the need's `max_width`.
    pub(super) far_off: usize,
}

/// When a fault begins and ends, as shares of the second half.
const FAULT: (f64, f64) = (0.4, 0.8);

/// Watches all needs with at least three ways of knowing them.
///
/// # Errors
/// A model with `max_width` is none: a defect.
pub(super) fn lied(recorded: &Recorded, threads: usize) -> anyhow::Result<Vec<Lied>> {
    let knowledge = &recorded.knowledge;
    let mut found = Vec::new();
    for need in knowledge.needs().ids() {
        let voters = voters(knowledge, need);
        if voters.len() >= 3 {
            found.extend(Scene::new(recorded, need, voters)?.watched(threads)?);
        }
    }
    Ok(found)
}

/// Ways of knowing a needed variable that share no signal, those with the fewest signals first.
fn voters(knowledge: &KnowledgeBase, need: NeedId) -> Vec<Way> {
    let mut ways = ways(knowledge, need);
    ways.sort_by_key(|it| closure(knowledge, it).len());
    let mut taken = SignalSet::new();
    ways.retain(|it| {
        let own = closure(knowledge, it);
        let is_apart = !own.meets(&taken);
        taken.extend(&own);
        is_apart
    });
    ways
}

/// A value of a need.
struct Value {
    time: Time,
    validity: Validity,
    middle: f64,
    is_good: bool,
    source: String,
}

/// What was published and what the ways said in a run.
struct Heard {
    values: Vec<Value>,
    /// The outputs of each way: when, and the middle.
    ways: Vec<Vec<(Time, f64)>>,
    /// The median width of each way's outputs.
    widths: Vec<f64>,
}

/// A need of a recorded system beside its voter.
struct Scene<'r> {
    recorded: &'r Recorded,
    knowledge: KnowledgeBase,
    need: NeedId,
    voters: Vec<Way>,
    observations: Vec<Observation>,
    clean: Heard,
    /// What the need is served from where nothing is wrong, when the fault begins.
    source: Option<String>,
    /// What comparisons may hide of each way, SI.
    hidden: Vec<f64>,
    /// From and to.
    fault: (Time, Time),
}

impl<'r> Scene<'r> {
    fn new(recorded: &'r Recorded, need: NeedId, voters: Vec<Way>) -> anyhow::Result<Scene<'r>> {
        let stretches = recorded.observations(&recorded.knowledge).into_iter();
        let observations = stretches.max_by_key(Vec::len).unwrap_or_default();
        let clean = heard(&recorded.knowledge, need, &voters, &observations);
        let hidden: Vec<f64> = (0..voters.len()).map(|it| hidden(&clean.widths, it)).collect();
        let (first, last) = observations
            .first()
            .zip(observations.last())
            .map(|(first, last)| (first.received, last.received))
            .ok_or_else(|| anyhow!("{} has no second half", recorded.name))?;
        let at = |share: f64| first + Span::from_seconds(share * (last - first).seconds());
        let most = hidden.iter().copied().fold(0.0, f64::max);
        let mut scene = Scene {
            recorded,
            knowledge: recorded.knowledge.clone(),
            need,
            voters,
            observations,
            clean,
            source: None,
            hidden,
            fault: (at(FAULT.0), at(FAULT.1)),
        };
        scene.demand(2.0 * most)?;
        scene.clean = heard(&scene.knowledge, need, &scene.voters, &scene.observations);
        let before = scene.clean.values.partition_point(|it| it.time <= scene.fault.0).checked_sub(1);
        scene.source = before.map(|it| scene.clean.values[it].source.clone());
        Ok(scene)
    }

    /// Makes the need state how wide a value may be.
    fn demand(&mut self, width: f64) -> anyhow::Result<()> {
        let row = &self.knowledge.needs()[self.need];
        let unit = &self.knowledge.variables()[row.variable].unit;
        let width = unit.as_ref().map_or(width, |it| width / it.to_si_difference(1.0).abs());
        let mut draft = self.recorded.draft.clone();
        let need = draft.needs.get_mut(self.need.index());
        need.into_iter()
            .for_each(|it| it.max_width = Some(Text { text: width.to_string(), ..Text::default() }));
        self.knowledge = built(&draft)?;
        Ok(())
    }

    fn watched(&self, threads: usize) -> anyhow::Result<Vec<Lied>> {
        let mut trials = Vec::new();
        for (way, voter) in self.voters.iter().enumerate() {
            let Some(liar) = self.liar(voter) else { continue };
            for form in Form::ALL {
                match form.is_sized() {
                    true => trials.extend(SHARES.map(|share| (way, liar, form, Some(share)))),
                    false => trials.push((way, liar, form, None)),
                }
            }
        }
        let next = AtomicUsize::new(0);
        let work = || {
            let mut done = Vec::new();
            while let Some(&(way, liar, form, share)) = trials.get(next.fetch_add(1, Ordering::Relaxed)) {
                done.push(self.lied(way, liar, form, share));
            }
            done
        };
        let mut all = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
            let done = workers.into_iter().map(|it| it.join().map_err(|_| anyhow!("a run broke off")));
            Ok::<_, anyhow::Error>(done.collect::<Result<Vec<_>, _>>()?.concat())
        })?;
        all.sort_by(|one, other| {
            (&one.liar, one.form)
                .cmp(&(&other.liar, other.form))
                .then(one.share.partial_cmp(&other.share).unwrap_or(std::cmp::Ordering::Equal))
        });
        Ok(all)
    }

    /// The signal of a way that rests on one, and that measures the same quantity.
    fn liar(&self, way: &Way) -> Option<SignalId> {
        let mut inputs = way.inputs();
        let (Some(signal), None) = (inputs.next(), inputs.next()) else { return None };
        let unit = |variable| self.knowledge.variables()[variable].unit.as_ref().map(|it| it.dimension);
        let is_same = unit(self.knowledge.signals()[signal].variable) == unit(way.substitution.sink);
        is_same.then_some(signal)
    }

    fn lied(&self, way: usize, liar: SignalId, form: Form, share: Option<f64>) -> Lied {
        let signal = &self.knowledge.signals()[liar];
        let unit = signal.unit.as_ref().map_or(1.0, |it| it.to_si_difference(1.0).abs());
        let mut errors = Errors::default();
        let mut far_off = 0;
        let sides: &[f64] = if matches!(form, Form::Bias | Form::Scale) { &[1.0, -1.0] } else { &[1.0] };
        for side in sides {
            let size = side * share.unwrap_or(1.0) * self.hidden[way] / unit;
            let heard = heard(&self.knowledge, self.need, &self.voters, &self.injected(liar, form, size));
            errors.add(self.errors(&heard, self.hidden[way]));
            far_off += self.far_off(&heard);
        }
        Lied {
            recording: self.recorded.name,
            need: self.knowledge.needs()[self.need].signal.clone(),
            liar: signal.name.clone(),
            form,
            share,
            is_source: self.source.as_ref() == Some(&self.voters[way].describe(&self.knowledge)),
            errors,
            far_off,
        }
    }

    /// The observations with a fault.
    fn injected(&self, liar: SignalId, form: Form, size: f64) -> Vec<Observation> {
        let first = self.observations.first().map_or(Time(0), |it| it.received);
        let (own, mut all): (Vec<Observation>, Vec<Observation>) =
            self.observations.iter().cloned().partition(|it| it.signal == liar);
        let number = |it: &Observation| match it.value {
            RawValue::Number(value) => value.abs(),
            _ => f64::NAN,
        };
        let usual = median(own.iter().map(number).collect()).unwrap_or(1.0);
        let mut samples: Vec<Sample> = own
            .into_iter()
            .map(|it| Sample { wanted: liar.index(), time: it.stamp, received: it.received, value: it.value })
            .collect();
        let (from, to) = (self.fault.0 - first, self.fault.1 - first);
        let fault = Fault { kind: form.kind(size, usual), signal: String::new(), from, to: Some(to) };
        fault.inject(&mut samples, liar.index(), self.knowledge.signals()[liar].scaling, first, 1);
        all.extend(samples.into_iter().map(|it| Observation {
            signal: liar,
            stamp: it.time,
            received: it.received,
            value: it.value,
        }));
        all.sort_by_key(|it| it.received);
        all
    }

    fn errors(&self, heard: &Heard, hidden: f64) -> Errors {
        let mut errors = Errors::default();
        let first = self.observations.first().map_or(Time(0), |it| it.received);
        let after = |at: Time| (at - first).seconds();
        for seconds in moments(after(self.fault.0), after(self.fault.1)) {
            let time = first + Span::from_seconds(seconds);
            let Some((voter, right)) = self.voted(heard, time).zip(self.value(&self.clean, time)) else {
                continue;
            };
            let off = |value: f64| (value - right) / hidden;
            errors.take(self.value(heard, time).map(off), off(voter));
        }
        errors
    }

    /// The latest value of the need, unless it is too old.
    fn value(&self, heard: &Heard, time: Time) -> Option<f64> {
        let latest = heard.values.partition_point(|it| it.time <= time).checked_sub(1)?;
        let latest = &heard.values[latest];
        let age = time - latest.validity.to;
        (age <= self.knowledge.needs()[self.need].max_age).then_some(latest.middle)
    }

    /// The median of the latest outputs of the ways.
    fn voted(&self, heard: &Heard, time: Time) -> Option<f64> {
        let latest = |outputs: &Vec<(Time, f64)>| {
            let latest = outputs.partition_point(|it| it.0 <= time).checked_sub(1)?;
            let (at, value) = outputs[latest];
            let period = (outputs.last()?.0 - outputs.first()?.0).seconds() / outputs.len() as f64;
            ((time - at).seconds() <= PERIODS * period).then_some(value)
        };
        median(heard.ways.iter().filter_map(latest).collect())
    }

    /// How many good values are further off than the need allows.
    fn far_off(&self, heard: &Heard) -> usize {
        let most = self.knowledge.needs()[self.need].max_width.unwrap_or(f64::INFINITY);
        let is_far = |it: &&Value| {
            let centre = it.validity.centre();
            let same = self.clean.values.partition_point(|clean| clean.validity.centre() <= centre);
            let right = same.checked_sub(1).map(|it| self.clean.values[it].middle);
            it.is_good && right.is_some_and(|right| (it.middle - right).abs() > most)
        };
        heard.values.iter().filter(is_far).count()
    }
}

/// What comparisons with the others may hide of a way: the widths of both.
fn hidden(widths: &[f64], way: usize) -> f64 {
    let others = widths.iter().enumerate().filter(|it| it.0 != way).map(|it| *it.1);
    widths[way] + others.fold(0.0, f64::max)
}

/// Runs the engine over observations.
fn heard(knowledge: &KnowledgeBase, need: NeedId, voters: &[Way], observations: &[Observation]) -> Heard {
    let first = observations.first().map_or(Time(0), |it| it.received);
    let mut run = Run::new(knowledge, first);
    let mut record = |_: Given<'_>| Ok::<(), Infallible>(());
    let mut heard = Heard { values: Vec::new(), ways: vec![Vec::new(); voters.len()], widths: Vec::new() };
    let mut last = vec![None; voters.len()];
    let mut widths = vec![Vec::new(); voters.len()];
    let places: Vec<_> = voters.iter().map(|it| run.engine.monitor().find(it)).collect();
    for observation in observations {
        let Ok(()) = run.pass_until(observation.received, &mut record);
        let Ok(()) = run.take(&Input::Observation(observation.clone()), &mut record);
        for (number, place) in places.iter().enumerate() {
            let way: Option<&WatchedWay> = place.and_then(|it| run.engine.monitor().way(it));
            let Some(sample) = way.and_then(|it| it.outputs.newest(0)) else { continue };
            if last[number].replace(sample.validity) != Some(sample.validity) {
                heard.ways[number].push((observation.received, sample.value.midpoint()));
                widths[number].push(sample.value.width());
            }
        }
    }
    let value = |it: &Publication| {
        let PublishedValue::Scalar(value) = it.value else { return None };
        let source = match &*it.source {
            ServedBy::Way(source) => source.clone(),
            _ => String::new(),
        };
        Some(Value {
            time: it.time,
            validity: it.validity,
            middle: value.midpoint(),
            is_good: it.quality == Quality::Good,
            source,
        })
    };
    heard.values = run.publications.iter().filter(|it| it.need == need).filter_map(value).collect();
    heard.widths = widths.into_iter().map(|it| median(it).unwrap_or(0.0)).collect();
    heard
}
