//! Checks signals.

mod change;
mod saturation;
mod sign;
mod standing;
mod times;

use super::problems::Problems;
use super::quantity;
use super::variables::{Variables, max_rate, possible};
use crate::interval::Interval;
use crate::knowledge::draft::{Place, SignalDraft, Source, Text};
use crate::knowledge::index::Index;
use crate::knowledge::properties::SharedNames;
use crate::knowledge::rows::Rows;
use crate::knowledge::sources::{self, Found};
use crate::knowledge::{
    Access, IdVec, Properties, ReadingLimits, Scaling, Shape, Signal, SignalId, Variable, VariableId,
};
use crate::time::Span;
use crate::unit::Unit;
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use change::change_error;
use saturation::saturation;
use standing::{counts, frozen_after, holds, rests_at, rests_for};
use times::{max_delay, mean_over, timeout};

/// Reads signals and their common causes; a signal without a known variable is left out.
pub(super) fn build(
    problems: &mut Problems,
    source: &mut dyn Source,
    variables: &Variables,
) -> (IdVec<SignalId, Signal>, IdVec<SignalId, Shares>) {
    let mut signals = IdVec::new();
    let mut names_of_properties = SharedNames::default();
    let mut declared = IdVec::new();
    let mut left_out = BTreeSet::new();
    let mut explained = sign::Explained::default();
    source.signals(&mut |draft| match signal(problems, draft, variables) {
        Some(mut signal) => {
            explained.note(problems, draft, &signal);
            signal.properties = quantity::properties(problems, &mut names_of_properties, &draft.properties);
            signals.push(signal);
            let (derived_from, shares) = (draft.derived_from.clone(), draft.shares.clone());
            declared.push(Declared { name: draft.name.place, derived_from, shares });
        }
        None => {
            left_out.insert(draft.name.text.clone());
        }
    });
    drop_repeated(problems, &mut signals, &mut declared);
    let found = derivations(problems, &signals, &declared, &left_out);
    for (id, origins) in found {
        signals[id].derived_from = origins;
    }
    report_cycles(problems, &signals, &declared);
    report_sources(problems, &mut signals, &declared);
    let mut shares = IdVec::new();
    for declared in declared.iter_mut() {
        shares.push(core::mem::take(&mut declared.shares));
    }
    (signals, shares)
}

/// Notes which signals are derived from others because of their sources.
fn report_sources(
    problems: &mut Problems,
    signals: &mut IdVec<SignalId, Signal>,
    declared: &IdVec<SignalId, Declared>,
) {
    let (_, found) = sources::derive(signals);
    for Found { signal, origin, is_same } in found {
        let (name, origin) = (&signals[signal].name, &signals[origin].name);
        let (what, help) = match is_same {
            true => ("has the same source as", "if they are two measurements, give each its own `source`"),
            false => ("is an element of the source of", "the list and its element count as one measurement"),
        };
        let message = format!("`{name}` {what} `{origin}`: it bears no witness for it");
        problems.note(declared[signal].name, message, help);
    }
}

/// The parts of a draft that later checks read.
struct Declared {
    name: Place,
    derived_from: Vec<Text>,
    shares: Shares,
}

/// The common causes of a signal, each with its prior probability.
pub(super) type Shares = Vec<(Text, Option<Text>)>;

/// Drops and reports the signals that have the name of an earlier one.
fn drop_repeated(
    problems: &mut Problems,
    signals: &mut IdVec<SignalId, Signal>,
    declared: &mut IdVec<SignalId, Declared>,
) {
    let name = |id: SignalId| signals[id].name.as_str();
    let repeated = Index::new(signals.len(), name).repeated(name);
    for &(_, id) in &repeated {
        problems.error(declared[id].name, format!("signal `{}` is given twice", name(id)), "keep one");
    }
    if !repeated.is_empty() {
        let keep = |id| repeated.binary_search_by_key(&id, |&(_, later)| later).is_err();
        signals.retain(keep);
        declared.retain(keep);
    }
}

fn signal(problems: &mut Problems, draft: &SignalDraft, variables: &Variables) -> Option<Signal> {
    problems.printable(&draft.name);
    let shared = draft.shares.iter().map(|(name, _)| name);
    draft.source.iter().chain(shared).for_each(|name| problems.printable(name));
    let variable = carried(problems, draft, variables);
    let (unit, multiple) = unit(problems, draft, variable, variables);
    let scaling = scaling(problems, draft, unit.as_ref(), multiple);
    let rate_hz = draft.rate.as_ref().and_then(|text| quantity::frequency(problems, text));
    let error = draft.value_error.as_ref();
    let time_error = draft.time_error.as_ref();
    let delay = draft.delay.as_ref().and_then(|text| quantity::signed_span(problems, text));
    let mean_over = mean_over(problems, draft, variable.map(|id| &variables.list[id]));
    let dead_band = holds(problems, draft, unit.as_ref(), variable.map(|id| &variables.list[id]));
    let holds = dead_band.is_some();
    // What is stamped at the begin of a measurement comes after its end.
    let longest = delay.map(|delay| delay.max(Span(mean_over.unwrap_or(Span::ZERO).0 / 2) - delay));
    // Who is asked only now and then has not fallen silent between two answers.
    let timeout = timeout(problems, draft.timeout.as_ref(), rate_hz.filter(|_| !holds));
    let max_delay = max_delay(problems, draft.max_delay.as_ref(), longest.zip(timeout));
    let frozen_after = frozen_after(problems, draft.frozen_after.as_ref());
    let rests_at = rests_at(problems, draft, unit.as_ref(), variable.map(|id| &variables.list[id]));
    let rests_for = rests_for(problems, draft);
    let counts = counts(problems, draft, variable.map(|id| &variables.list[id]));
    let possible = limits(problems, draft, unit.as_ref(), variable.map(|id| &variables.list[id]));
    let saturation = saturation(problems, draft, unit.as_ref(), variable.map(|id| &variables.list[id]));
    let signal = Signal {
        name: draft.name.text.clone(),
        variable: variable.unwrap_or_else(|| crate::knowledge::Id::from_index(0)),
        source: draft.source.as_ref().unwrap_or(&draft.name).text.clone(),
        source_parts: draft.source_parts.clone(),
        scaling,
        rate_hz,
        value_error: error
            .and_then(|bounds| quantity::value_error(problems, bounds, unit.as_ref()))
            .unwrap_or_default()
            .widened(dead_band.unwrap_or(0.0)),
        change_error: change_error(problems, draft, unit.as_ref()),
        noise: draft.noise.as_ref().and_then(|text| noise(problems, draft, text, unit.as_ref())),
        time_error: time_error
            .and_then(|bounds| quantity::time_error(problems, bounds))
            .unwrap_or((Span::ZERO, Span::ZERO)),
        delay: delay.unwrap_or(Span::ZERO),
        mean_over: mean_over.unwrap_or(Span::ZERO),
        timeout,
        holds,
        dead_band: dead_band.unwrap_or(0.0),
        access: access(problems, draft.access.as_ref(), variable.map(|id| &variables.list[id])),
        limits: ReadingLimits {
            max_delay,
            saturation,
            frozen_after,
            rests_at,
            rests_for,
            counts,
            ..possible
        },
        derived_from: Vec::new(),
        properties: Properties::new(),
        unit,
    };
    variable.is_some().then_some(signal)
}

fn carried(problems: &mut Problems, draft: &SignalDraft, variables: &Variables) -> Option<VariableId> {
    match &draft.variable {
        Some(name) => variables.look_up(problems, name),
        None => {
            let message = format!("signal `{}` carries no variable", draft.name.text);
            problems.error(&draft.name, message, "say which: `variable: speed`");
            None
        }
    }
}

/// The signal's own unit, else its variable's; and the number before the unit.
fn unit(
    problems: &mut Problems,
    draft: &SignalDraft,
    variable: Option<VariableId>,
    variables: &Variables,
) -> (Option<Unit>, Option<f64>) {
    let of_variable = variable.and_then(|id| variables.list[id].unit.as_ref());
    let Some(text) = &draft.unit else { return (of_variable.cloned(), None) };
    let Some((own, multiple)) = quantity::multiple(problems, text) else { return (None, None) };
    let name = variable.map_or("", |id| variables.list[id].name.as_str());
    match of_variable {
        Some(unit) if unit.dimension != own.dimension => {
            let message = format!("`{own}` cannot be converted to `{unit}`, the unit of `{name}`");
            problems.error(text, message, "give the unit in which the values come");
            return (of_variable.cloned(), None);
        }
        None if variable.is_some() => {
            let help = format!("write `{name}: {{ unit: {own} }}` under `variables`");
            problems.warn(text, format!("`{name}` has no unit, so `{own}` cannot be checked"), help);
        }
        _ => {}
    }
    (Some(own), multiple)
}

/// The scaling of readings: a scale, or the number before the unit, and an offset; `None` where readings are values.
fn scaling(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
    multiple: Option<f64>,
) -> Option<Scaling> {
    let declared = draft.scale.as_ref().and_then(|text| quantity::number(problems, text));
    if let (Some(text), Some(_)) = (&draft.scale, multiple) {
        let message = "the unit of this signal holds a number already";
        problems.error(text, message, "write the number once: before the unit, or as `scale`");
    }
    let scale = multiple.or(declared).unwrap_or(1.0);
    if scale == 0.0
        && let Some(text) = draft.scale.as_ref().or(draft.unit.as_ref())
    {
        problems.error(
            text,
            "a scale of 0 makes all readings the same",
            "write what one of the reading counts",
        );
        return None;
    }
    let offset =
        draft.offset.as_ref().and_then(|text| quantity::in_unit(problems, text, unit)).unwrap_or(0.0);
    (scale != 1.0 || offset != 0.0).then_some(Scaling { scale, offset })
}

fn noise(problems: &mut Problems, draft: &SignalDraft, text: &Text, unit: Option<&Unit>) -> Option<f64> {
    let deviation = quantity::difference(problems, text, unit)?;
    if draft.value_error.is_none() {
        let name = &draft.name.text;
        let message = format!(
            "`{name}` has noise, but no `value_error`: its values count as exact, and every difference as a contradiction"
        );
        let help = "give the bound that a sound value keeps, several times its noise; \
                    where the relations carry the error, `value_error: 0`";
        problems.warn(text, message, help);
    }
    if deviation > 0.0 {
        return Some(deviation);
    }
    let help = "write how much values scatter, or leave `noise` away when it is not known";
    problems.error(text, "a standard deviation is above 0", help);
    None
}

fn access(problems: &mut Problems, text: Option<&Text>, variable: Option<&Variable>) -> Access {
    let Some(text) = text else { return Access::Port };
    let Some((_, access)) = Access::NAMES.into_iter().find(|(name, _)| *name == text.text) else {
        let message = format!("`{}` does not say what is taken for a value between two of them", text.text);
        problems.error(text, message, "write `access: port`, `access: estimate` or `access: both`");
        return Access::Port;
    };
    if let Some(variable) = variable.filter(|variable| variable.shape == Shape::Vector) {
        vectors_have_none(problems, "access", text, variable);
        return Access::Port;
    }
    access
}

fn vectors_have_none(problems: &mut Problems, key: &str, text: &Text, variable: &Variable) {
    let message = format!("`{key}` has no meaning for `{}`, which is a vector", variable.name);
    problems.error(text, message, "leave it away");
}

/// The limits of a signal's readings, without the delay.
fn limits(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
    variable: Option<&Variable>,
) -> ReadingLimits {
    let range = draft.range.as_ref().and_then(|range| possible(problems, range, unit));
    let is_unlimited = draft.max_rate.as_ref().is_some_and(|text| text.text == "none");
    let declared = draft.max_rate.as_ref().filter(|_| !is_unlimited);
    let rate = declared.and_then(|text| max_rate(problems, text, unit));
    let Some(variable) = variable else { return ReadingLimits::default() };
    if variable.shape == Shape::Vector {
        let limits =
            [("range", draft.range.as_ref().map(|(lo, _)| lo)), ("max_rate", draft.max_rate.as_ref())];
        for (key, text) in limits.into_iter().filter_map(|(key, text)| Some((key, text?))) {
            vectors_have_none(problems, key, text, variable);
        }
        return ReadingLimits::default();
    }
    let all = variable.readable();
    let both = range.zip(all).map(|(own, all)| own.intersection(all));
    if let (Some((text, _)), true) = (&draft.range, both.is_some_and(Interval::is_empty)) {
        let message = format!("nothing in this range is possible for `{}`", variable.name);
        problems.error(text, message, "give readings within the `range` of the variable");
    }
    let max_rate = rate.or(variable.max_rate).filter(|_| !is_unlimited);
    let range = both.or(range).or(all);
    ReadingLimits { range, max_rate, turn: variable.wraps, ..ReadingLimits::default() }
}

/// The origins of each derived signal, ascending; `left_out`: names of invalid signals.
fn derivations(
    problems: &mut Problems,
    signals: &IdVec<SignalId, Signal>,
    declared: &IdVec<SignalId, Declared>,
    left_out: &BTreeSet<String>,
) -> Vec<(SignalId, Vec<SignalId>)> {
    if declared.iter().all(|declared| declared.derived_from.is_empty()) {
        return Vec::new();
    }
    let name = |id: SignalId| signals[id].name.as_str();
    let index = Index::new(signals.len(), name);
    let known = || {
        let all = signals.ids().map(name).chain(left_out.iter().map(String::as_str));
        all.collect::<BTreeSet<_>>().into_iter().collect()
    };
    let derived = declared.enumerate().filter(|(_, declared)| !declared.derived_from.is_empty());
    let mut origins = |drafts: &[Text]| {
        let mut found = Vec::new();
        for text in drafts {
            match index.find(&text.text, name) {
                Some(id) => found.push(id),
                None if left_out.contains(&text.text) => {}
                None => {
                    let help = "declare it under `signals`";
                    problems.unknown(text, "signal", signals.len() + left_out.len(), known, help);
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    };
    derived.map(|(id, declared)| (id, origins(&declared.derived_from))).collect()
}

/// Reports the first signal of a cycle, or behind one: removes signals without remaining origins until none is left.
fn report_cycles(
    problems: &mut Problems,
    signals: &IdVec<SignalId, Signal>,
    declared: &IdVec<SignalId, Declared>,
) {
    let mut waiting = IdVec::filled(signals.len(), |id| signals[id].derived_from.len());
    let origins = signals.enumerate().map(|(id, signal)| (id, signal.derived_from.as_slice()));
    let origins = origins.flat_map(|(id, origins)| origins.iter().map(move |&origin| (origin, id)));
    let derived = Rows::grouped(signals.len(), origins);
    let mut free: Vec<SignalId> =
        signals.enumerate().filter(|(_, signal)| signal.derived_from.is_empty()).map(|(id, _)| id).collect();
    while let Some(origin) = free.pop() {
        for &id in derived.row(origin) {
            waiting[id] -= 1;
            if waiting[id] == 0 {
                free.push(id);
            }
        }
    }
    if let Some((id, _)) = waiting.enumerate().find(|(_, count)| **count > 0) {
        let message = format!("signal `{}` is derived from itself", signals[id].name);
        let at = declared[id].derived_from.first().map_or(declared[id].name, Place::from);
        problems.error(at, message, "name only the signals that it is computed from");
    }
}
