//! Published values beside what an independent witness says: a way of knowing that was kept from the model of the run.

use super::recorded::{Recorded, built};
use shsa_core::engine::{self, Input, Publication, PublishedValue, Quality, WatchBudget};
use shsa_core::knowledge::{
    Bounds, Draft, KnowledgeBase, NeedId, SignalDraft, SignalId, SignalSet, Text, VariableId,
};
use shsa_core::monitor::WatchedWay;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time};
use shsa_format::drive::{Given, Run};
use shsa_lab::calibration::{Comparison, Watched};
use std::convert::Infallible;

/// How many values of a need one witness excludes.
#[derive(Clone, Debug)]
pub(super) struct Covered {
    pub(super) recording: &'static str,
    pub(super) need: String,
    pub(super) witness: String,
    pub(super) quality: Quality,
    /// Published values of this quality.
    pub(super) values: usize,
    /// Comparisons with the witness, and those that exclude the value.
    pub(super) compared: usize,
    pub(super) excluded: usize,
    /// The largest distance of a value from what the witness allows, in the unit of the need, which is `unit`.
    pub(super) furthest: f64,
    pub(super) unit: String,
}

/// The name of the signal that carries the published values.
const PUBLISHED: &str = "the published values";

/// Compares all needs with all independent witnesses.
///
/// # Errors
/// A part of a model is none: a defect.
pub(super) fn covered(recorded: &Recorded) -> anyhow::Result<Vec<Covered>> {
    let knowledge = &recorded.knowledge;
    let mut found = Vec::new();
    for need in knowledge.needs().ids() {
        let ways = ways(knowledge, need);
        let mut seen = Vec::new();
        for way in &ways {
            let own = closure(knowledge, way);
            if !seen.contains(&own) {
                found.extend(beside(recorded, need, way, &ways)?);
                seen.push(own);
            }
        }
    }
    Ok(found)
}

/// The ways of knowing a needed variable that read signals.
pub(super) fn ways(knowledge: &KnowledgeBase, need: NeedId) -> Vec<Way> {
    let variable = knowledge.needs()[need].variable;
    let mut ways = engine::to_watch(knowledge, &Graph::new(knowledge), WatchBudget::default());
    ways.retain(|it| it.substitution.sink == variable && it.inputs().next().is_some());
    ways
}

/// The signals of a way with all that they are derived from.
pub(super) fn closure(knowledge: &KnowledgeBase, way: &Way) -> SignalSet {
    way.inputs().fold(SignalSet::new(), |mut all, signal| {
        all.extend(&knowledge.origins(signal));
        all
    })
}

/// The values of a need that is served without a way, beside that way; nothing where no other way shares no signal with it.
fn beside(recorded: &Recorded, need: NeedId, way: &Way, ways: &[Way]) -> anyhow::Result<Vec<Covered>> {
    let knowledge = &recorded.knowledge;
    let own = closure(knowledge, way);
    let keeps = |it: SignalId| !knowledge.origins(it).meets(&own);
    if !ways.iter().any(|it| it.inputs().all(keeps)) {
        return Ok(Vec::new());
    }
    let row = &knowledge.needs()[need];
    let mut draft = recorded.with_signals(keeps);
    let variable = &knowledge.variables()[row.variable];
    draft.needs.retain(|it| match &it.signal {
        Some(signal) => signal.text == row.signal,
        None => it.variable.text == variable.name,
    });
    let without = built(&draft)?;
    let published: Vec<Publication> =
        recorded.observations(&without).iter().flat_map(|it| publications(&without, it)).collect();
    let mut found = Vec::new();
    for quality in [Quality::Good, Quality::Substitute] {
        let values: Vec<&Publication> = published.iter().filter(|it| it.quality == quality).collect();
        if values.len() < 2 {
            continue;
        }
        let judge = built(&judging(recorded, way, row.variable, &values))?;
        let comparisons = judged(recorded, &judge, &values);
        let beyond = comparisons.iter().map(|it| it.beyond().abs());
        let unit = variable.unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).abs());
        found.push(Covered {
            recording: recorded.name,
            need: row.signal.clone(),
            witness: way.describe(knowledge),
            quality,
            values: values.len(),
            compared: comparisons.len(),
            excluded: beyond.clone().filter(|it| *it > 0.0).count(),
            furthest: beyond.fold(0.0, f64::max) / unit,
            unit: variable.unit.as_ref().map_or(String::new(), ToString::to_string),
        });
    }
    Ok(found)
}

/// The publications of a run.
fn publications(knowledge: &KnowledgeBase, observations: &[Observation]) -> Vec<Publication> {
    let first = observations.first().map_or(Time(0), |it| it.received);
    let mut run = Run::new(knowledge, first);
    let mut record = |_: Given<'_>| Ok::<(), Infallible>(());
    for observation in observations {
        let Ok(()) = run.pass_until(observation.received, &mut record);
        let Ok(()) = run.take(&Input::Observation(observation.clone()), &mut record);
    }
    run.publications
}

/// The model of the witness alone, and of the published values as a signal.
fn judging(recorded: &Recorded, way: &Way, variable: VariableId, values: &[&Publication]) -> Draft {
    let reads: Vec<SignalId> = way.inputs().collect();
    let mut draft = recorded.with_signals(|it| reads.contains(&it));
    draft.needs.clear();
    let text = |text: String| Text { text, ..Text::default() };
    let mut steps: Vec<Span> =
        values.windows(2).map(|it| it[1].validity.centre() - it[0].validity.centre()).collect();
    steps.sort_unstable();
    let period = steps[steps.len() / 2].seconds();
    // A value may be that of any moment of its validity.
    let half = values.iter().map(|it| 0.5 * it.validity.length().seconds()).fold(0.0, f64::max);
    draft.signals.push(SignalDraft {
        name: text(PUBLISHED.to_owned()),
        variable: Some(text(recorded.knowledge.variables()[variable].name.clone())),
        rate: (period > 0.0).then(|| text(format!("{} Hz", 1.0 / period))),
        time_error: Some(Bounds::One(text(format!("{half} s")))),
        max_rate: Some(text("none".to_owned())),
        timeout: Some(text("none".to_owned())),
        max_delay: Some(text("none".to_owned())),
        ..SignalDraft::default()
    });
    draft
}

/// Compares published values with the witness, each at the moments of the slower one: in the needed variable where that is
/// possible, else in all others.
fn judged(recorded: &Recorded, judge: &KnowledgeBase, values: &[&Publication]) -> Vec<Comparison> {
    let Some(signal) = judge.signal(PUBLISHED) else { return Vec::new() };
    let variable = judge.signals()[signal].variable;
    let unit = &judge.variables()[variable].unit;
    let told = |it: &&Publication| {
        let PublishedValue::Scalar(value) = it.value else { return None };
        let shown = unit.as_ref().map_or(value, |unit| unit.from_si_interval(value));
        let value = RawValue::Interval { lo: shown.lo(), hi: shown.hi() };
        Some(Observation { signal, stamp: it.validity.centre(), received: it.time, value })
    };
    let ways = engine::to_watch(judge, &Graph::new(judge), WatchBudget::default());
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for mut all in recorded.observations(judge) {
        let (Some(first), Some(last)) = (all.first(), all.last()) else { continue };
        let span = first.received..=last.received;
        all.extend(values.iter().filter(|it| span.contains(&it.time)).filter_map(told));
        all.sort_by_key(|it| it.received);
        let watched = Watched::over(judge, &ways, [all.as_slice()]);
        for (pair, comparisons) in watched.monitor.residuals().iter().zip(&watched.comparisons) {
            let (one, other) = watched.sides(pair);
            if reads(one, signal) != reads(other, signal) {
                (if one.variable() == variable { &mut own } else { &mut others }).extend(comparisons);
            }
        }
    }
    if own.is_empty() { others } else { own }
}

fn reads(way: &WatchedWay, signal: SignalId) -> bool {
    way.computation.way().inputs().any(|it| it == signal)
}
