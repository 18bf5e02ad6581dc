//! The values of a model's variables over recordings: measured, or computed from what is measured.

use crate::calibration::{Watched, observations};
use crate::learning::Signal;
use shsa_core::knowledge::{KnowledgeBase, SignalId, VariableId};
use shsa_core::observation::RawValue;
use shsa_core::plan::{Graph, Limits, Options, best};
use shsa_core::substitution::Way;
use shsa_core::time::{Time, Validity};
use shsa_recording::{Recording, Sample};
use std::collections::BTreeSet;

/// A variable that no signal measures, as its best substitution gives it.
pub(super) struct Computed {
    pub(super) signal: Signal,
    /// The variables from which it is computed.
    pub(super) rests_on: BTreeSet<String>,
}

/// Each variable by its fastest recorded signal that is derived from no other.
pub(super) fn measured(knowledge: &KnowledgeBase, recording: &Recording) -> Vec<Signal> {
    let measured: Vec<SignalId> =
        knowledge.signals().ids().filter(|it| !knowledge.is_computed(*it)).collect();
    let mut series = series(knowledge, &measured, recording);
    let of_variable = |variable: VariableId| {
        let of = |at: &usize| {
            let signal = &knowledge.signals()[measured[*at]];
            signal.variable == variable && signal.derived_from.is_empty()
        };
        let fastest = (0..measured.len()).filter(of).max_by_key(|at| series[*at].len())?;
        Some(signal(knowledge, variable, std::mem::take(&mut series[fastest])))
    };
    knowledge.variables().ids().filter_map(of_variable).collect()
}

/// The variables that no signal measures and that can be computed.
pub(super) fn computed(knowledge: &KnowledgeBase, recording: &Recording) -> Vec<Computed> {
    let ways = ways(knowledge);
    let mut points = vec![Vec::new(); ways.len()];
    for (samples, from) in sessions(recording) {
        let outputs = Watched::over(knowledge, &ways, [observations(samples).as_slice()]).outputs;
        for ((points, outputs), way) in points.iter_mut().zip(outputs).zip(&ways) {
            let variable = way.substitution.sink;
            let at = |(validity, value): (Validity, f64)| {
                (from.seconds_to(validity.to), in_unit(knowledge, variable, value))
            };
            points.extend(outputs.into_iter().map(at));
        }
    }
    let of_way = |(way, points): (&Way, Vec<(f64, f64)>)| {
        let name = |id: SignalId| knowledge.variables()[knowledge.signals()[id].variable].name.clone();
        let rests_on = way.inputs().map(name).collect();
        (!points.is_empty())
            .then(|| Computed { signal: signal(knowledge, way.substitution.sink, points), rests_on })
    };
    ways.iter().zip(points).filter_map(of_way).collect()
}

/// The best way of computing each variable that no signal measures.
fn ways(knowledge: &KnowledgeBase) -> Vec<Way> {
    let is_unmeasured = |id: &VariableId| {
        let is_constant = knowledge.variables()[*id].constant.is_some();
        !is_constant && knowledge.signals().iter().all(|signal| signal.variable != *id)
    };
    let graph = Graph::new(knowledge);
    let way = |variable: VariableId| {
        let plan = best(&graph, variable, &Options::default(), 1, Limits::default());
        let (substitution, _) = plan.substitutions.into_iter().next()?;
        let is_measured = |signal: SignalId| !knowledge.is_computed(signal);
        Way::choices(knowledge, &substitution, is_measured, 1).pop()
    };
    knowledge.variables().ids().filter(is_unmeasured).filter_map(way).collect()
}

fn signal(knowledge: &KnowledgeBase, variable: VariableId, points: Vec<(f64, f64)>) -> Signal {
    let variable = &knowledge.variables()[variable];
    Signal { name: variable.name.clone(), unit: variable.unit.clone(), points }
}

/// The time between two sessions in seconds: longer than any delay, so that none reaches from one into the other.
const BETWEEN_S: f64 = 10.0;

/// The beginning of a session: its first moment, and how much later than the first session it is put, in seconds.
#[derive(Clone, Copy)]
struct Beginning {
    first: Time,
    shift_s: f64,
}

impl Beginning {
    fn seconds_to(self, time: Time) -> f64 {
        (time - self.first).seconds() + self.shift_s
    }
}

/// A time between each two sessions, in seconds of the series.
pub(super) fn joints(recording: &Recording) -> Vec<f64> {
    let begins = sessions(recording).into_iter().map(|(_, beginning)| beginning.shift_s);
    begins.skip(1).map(|begin| begin - 0.5 * BETWEEN_S).collect()
}

/// The samples of each session with its beginning. Sessions follow each other in the order of time, and those that begin at one time in
/// the order of their values, however the files were named.
fn sessions(recording: &Recording) -> Vec<(&[Sample], Beginning)> {
    let mut shift_s = 0.0;
    let mut sessions = Vec::new();
    let mut in_order: Vec<&[Sample]> = recording.by_session().map(|(_, samples)| samples).collect();
    in_order.sort_by(|one, other| one.iter().map(key).cmp(other.iter().map(key)));
    for samples in in_order {
        let Some(first) = samples.first().map(|it| it.time) else { continue };
        let from = Beginning { first, shift_s };
        shift_s = samples.iter().map(|it| from.seconds_to(it.time)).fold(shift_s, f64::max) + BETWEEN_S;
        sessions.push((samples, from));
    }
    sessions
}

/// What gives a sample its place among others.
fn key(sample: &Sample) -> (Time, usize, u64) {
    let number = if let RawValue::Number(number) = sample.value { number.to_bits() } else { 0 };
    (sample.time, sample.wanted, number)
}

/// The values of each signal in the unit of its variable, at the moments at which they were measured.
fn series(knowledge: &KnowledgeBase, measured: &[SignalId], recording: &Recording) -> Vec<Vec<(f64, f64)>> {
    let mut series = vec![Vec::new(); measured.len()];
    for (samples, from) in sessions(recording) {
        for sample in samples {
            let (RawValue::Number(reading), Some(id)) = (&sample.value, measured.get(sample.wanted)) else {
                continue;
            };
            let signal = &knowledge.signals()[*id];
            let value = signal.scaling.map_or(*reading, |scaling| scaling.value(*reading));
            let si = signal.unit.as_ref().map_or(value, |unit| unit.to_si(value));
            let time_s = from.seconds_to(sample.time - signal.delay);
            series[sample.wanted].push((time_s, in_unit(knowledge, signal.variable, si)));
        }
    }
    series
}

/// A value in SI units in the unit of a variable.
fn in_unit(knowledge: &KnowledgeBase, variable: VariableId, si: f64) -> f64 {
    let unit = knowledge.variables()[variable].unit.as_ref();
    unit.map_or(si, |unit| (si - unit.offset) / unit.scale)
}
