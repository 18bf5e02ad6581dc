//! Checks fusions, and adds the signals that they compute.

mod scope;
mod settings;
mod order;
mod parts;

use super::problems::Problems;
use super::scope::Names;
use crate::knowledge::draft::{FusionDraft, Source, Text};
use crate::knowledge::fusion::measured_states;
use crate::knowledge::{
    Fusion, FusionInput, FusionMethod, FusionPlaces, FusionPrediction, FusionState, IdVec, PRIOR, Properties,
    ReadingLimits, Signal, SignalId, VariableId,
};
use crate::unit::nearest;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use parts::Parts;

/// The largest number of states, inputs or outputs of a fusion: a step of a Kalman filter with this many states takes a second.
const MOST: usize = 64;

/// Up to this many inputs, each is also predicted without each other one, so that of two inputs the wrong one can be isolated.
const MOST_PAIRED: usize = 6;

/// Reads fusions; an invalid fusion is left out.
pub(super) fn build(
    problems: &mut Problems,
    source: &mut dyn Source,
    names: &Names,
    signals: &mut IdVec<SignalId, Signal>,
) -> Vec<Fusion> {
    let mut drafts: Vec<FusionDraft> = Vec::new();
    source.fusions(&mut |draft| {
        if drafts.iter().any(|known| known.name.text == draft.name.text) {
            problems.error(&draft.name, format!("fusion `{}` is given twice", draft.name.text), "keep one");
            return;
        }
        drafts.push(draft.clone());
    });
    let outputs = order::outputs(&drafts, signals);
    let mut readable = Readable { declared: signals.len(), outputs: Vec::new(), promised: &outputs };
    let mut fusions = Vec::new();
    for draft in order::ordered(problems, &drafts, &outputs).into_iter().filter_map(|place| drafts.get(place))
    {
        if let Some(fusion) = fusion(problems, draft, names, signals, &readable) {
            let pace = fusion.settings.period.map_or_else(
                || fusion.inputs.iter().map(|it| readable.pace(it.signal, signals)).sum(),
                |period| 1.0 / period.seconds(),
            );
            readable.outputs.extend(fusion.outputs.iter().map(|it| (it.signal, pace)));
            fusions.push(fusion);
        }
    }
    fusions
}

/// How many values a second are expected of a signal without a rate.
const USUAL_PACE: f64 = 10.0;

/// The signals that a fusion may read: those that the model declares, and the outputs of the fusions before it.
pub(super) struct Readable<'a> {
    /// How many of the signals the model declares: they come first.
    declared: usize,
    /// The outputs, with the number of their values a second.
    outputs: Vec<(SignalId, f64)>,
    /// The names of all outputs in the model, of wrong fusions too.
    promised: &'a BTreeMap<&'a str, usize>,
}

impl Readable<'_> {
    /// Finds a signal by its name.
    fn find(
        &self,
        problems: &mut Problems,
        name: &Text,
        signals: &IdVec<SignalId, Signal>,
    ) -> Option<SignalId> {
        let all = || signals.ids().take(self.declared).chain(self.outputs.iter().map(|(id, _)| *id));
        let found = all().find(|id| signals[*id].name == name.text);
        // What is wrong with the fusion that computes it is reported there.
        if found.is_none() && !self.promised.contains_key(name.text.as_str()) {
            let names = || all().map(|id| signals[id].name.as_str()).collect();
            let count = self.declared + self.outputs.len();
            problems.unknown(name, "signal", count, names, "declare it under `signals`");
        }
        found
    }

    /// Whether a signal is an output of a fusion.
    fn is_output(&self, signal: SignalId) -> bool {
        self.outputs.iter().any(|(id, _)| *id == signal)
    }

    /// The number of values of a signal in a second: a fusion without a period gives one with each of its inputs.
    fn pace(&self, signal: SignalId, signals: &IdVec<SignalId, Signal>) -> f64 {
        let computed = self.outputs.iter().find(|(id, _)| *id == signal).map(|(_, pace)| *pace);
        computed.or(signals[signal].rate_hz).unwrap_or(USUAL_PACE)
    }
}

fn fusion(
    problems: &mut Problems,
    draft: &FusionDraft,
    names: &Names,
    signals: &mut IdVec<SignalId, Signal>,
    readable: &Readable<'_>,
) -> Option<Fusion> {
    let lengths = [draft.states.len(), draft.inputs.len(), draft.outputs.len()];
    if lengths.iter().any(|length| !(1..=MOST).contains(length)) {
        let message = format!("a fusion has 1 to {MOST} states, inputs and outputs");
        let help = "write `states`, `inputs` and `outputs`: `inputs: { /gps: position }`";
        problems.error(&draft.name, message, help);
        return None;
    }
    let method = method(problems, draft);
    let (controls, local) = parts::local(problems, draft, names, signals, readable);
    let parts = Parts { signals, readable, local: &local };
    let states = parts.states(problems, draft);
    let inputs = parts.inputs(problems, draft);
    let outputs = parts.outputs(problems, draft);
    let mut settings = settings::settings(problems, draft)?;
    let (method, controls, states, (inputs, places)) = (method?, controls?, states?, inputs?);
    let pace = inputs.iter().map(|it| readable.pace(it.signal, signals)).sum();
    settings.moments = settings::moments(settings.horizon, pace);
    let mut origins: Vec<SignalId> =
        inputs.iter().map(|it| it.signal).chain(controls.iter().copied()).collect();
    origins.sort_unstable();
    origins.dedup();
    let (inputs_rate, unknown_after) = (fastest(signals, &inputs), settings.unknown_after);
    let outputs = outputs?.into_iter().map(|(mut output, written)| {
        let rate_hz = settings.period.map(|period| 1.0 / period.seconds()).or(inputs_rate);
        let timeout = settings.period.map_or(unknown_after, |period| period.times(5).max(unknown_after));
        let made = Signal {
            rate_hz,
            timeout: Some(timeout),
            properties: sound(written.properties),
            ..computed(names, written.name, written.variable, origins.clone())
        };
        output.signal = signals.push(made);
        output
    });
    let outputs = outputs.collect();
    let predictions = match settings::has_witnesses(problems, draft) && !method.is_direct() {
        true => predictions(draft, &states, &inputs, &controls, names, signals),
        false => Vec::new(),
    };
    let places = FusionPlaces {
        name: draft.name.place,
        states: draft.states.iter().map(|state| state.name.place).collect(),
        inputs: places,
    };
    let name = draft.name.text.clone();
    Some(Fusion { name, places, method, states, controls, inputs, outputs, predictions, settings })
}

fn method(problems: &mut Problems, draft: &FusionDraft) -> Option<FusionMethod> {
    let all = FusionMethod::NAMES.map(|(name, _)| name);
    let help = format!("known: {}", all.join(", "));
    let Some(word) = &draft.method else {
        problems.error(&draft.name, format!("fusion `{}` has no method", draft.name.text), help);
        return None;
    };
    let found = FusionMethod::NAMES.into_iter().find(|(name, _)| *name == word.text);
    if found.is_none() {
        let near = nearest(&word.text, all).map_or(help, |near| format!("did you mean `{near}`?"));
        problems.error(word, format!("`{}` is no method of fusion", word.text), near);
    }
    found.map(|(_, method)| method)
}

/// The rate of the fastest input.
fn fastest(signals: &IdVec<SignalId, Signal>, inputs: &[FusionInput]) -> Option<f64> {
    inputs.iter().filter_map(|input| signals[input.signal].rate_hz).max_by(f64::total_cmp)
}

/// A computed signal does not fail by itself, but with its inputs.
const SOUND: f64 = 1e-9;

fn sound(mut properties: Properties) -> Properties {
    if properties.prior().is_none() {
        properties.insert(PRIOR, SOUND);
    }
    properties
}

/// A computed signal: its observations bring their intervals and times.
fn computed(names: &Names, name: String, variable: VariableId, derived_from: Vec<SignalId>) -> Signal {
    let known = &names.variables.list[variable];
    let properties = sound(Properties::new());
    Signal {
        source: name.clone(),
        unit: known.unit.clone(),
        limits: ReadingLimits { turn: known.wraps, ..ReadingLimits::default() },
        derived_from,
        properties,
        ..Signal::new(name, variable)
    }
}

/// The predictions of each input by the others; and, to isolate the wrong one of two, by the inputs without either.
fn predictions(
    draft: &FusionDraft,
    states: &[FusionState],
    inputs: &[FusionInput],
    controls: &[SignalId],
    names: &Names,
    signals: &mut IdVec<SignalId, Signal>,
) -> Vec<FusionPrediction> {
    let mut predictions = Vec::new();
    for (input, without) in left_out(inputs.len()) {
        let Some(own) = inputs.get(input).map(|it| it.signal) else { continue };
        let others =
            || inputs.iter().enumerate().filter(|(place, _)| !without.contains(place)).map(|(_, it)| it);
        let is_anchored = !is_seen(states, others(), inputs, input);
        let measured = others().map(|it| it.signal).chain(is_anchored.then_some(own));
        let mut origins: Vec<SignalId> = measured.chain(controls.iter().copied()).collect();
        origins.sort_unstable();
        origins.dedup();
        let name = |place: &usize| inputs.get(*place).map(|it| signals[it.signal].name.as_str());
        let gone: Vec<&str> = without.iter().filter_map(name).collect();
        let about = if gone.len() > 1 { format!(", about {}", signals[own].name) } else { String::new() };
        let name = format!("{} without {}{about}", draft.name.text, gone.join(" and "));
        let rate_hz = signals[own].rate_hz;
        let made = Signal { rate_hz, ..computed(names, name, signals[own].variable, origins) };
        predictions.push(FusionPrediction { signal: signals.push(made), input, without, is_anchored });
    }
    predictions
}

/// The inputs to predict, each with the inputs that its prediction leaves out.
fn left_out(count: usize) -> impl Iterator<Item = (usize, Vec<usize>)> {
    let alone = (0..count).map(|input| (input, Vec::from([input])));
    let pairs = (0..count).flat_map(move |input| (0..count).map(move |other| (input, other)));
    let pairs = pairs.filter(move |(input, other)| input != other && (3..=MOST_PAIRED).contains(&count));
    let pairs = pairs.map(|(input, other)| (input, Vec::from([input.min(other), input.max(other)])));
    alone.chain(pairs).filter(move |(_, without)| without.len() < count)
}

/// Whether the other inputs observe all that an input measures, now or later; decided by the states that each formula names.
fn is_seen<'i>(
    states: &[FusionState],
    others: impl Iterator<Item = &'i FusionInput>,
    inputs: &[FusionInput],
    input: usize,
) -> bool {
    let seen = measured_states(states, others.map(|it| &it.measures));
    let measured = inputs.get(input).map(|it| it.measures.symbols()).unwrap_or_default();
    let mut places = measured.iter().map(|symbol| symbol.0 as usize).filter(|place| *place < states.len());
    places.all(|place| seen.contains(&place))
}

/// A text that must be given.
fn required<'d>(
    problems: &mut Problems,
    text: Option<&'d Text>,
    at: &Text,
    what: &str,
    help: &str,
) -> Option<&'d Text> {
    if text.is_none() {
        problems.error(at, format!("`{}` has no {what}", at.text), help);
    }
    text
}
