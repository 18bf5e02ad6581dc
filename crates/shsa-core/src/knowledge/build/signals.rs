//! Checks signals.

use super::problems::Problems;
use super::quantity;
use super::variables::Variables;
use crate::knowledge::draft::{Draft, SignalDraft, Text};
use crate::knowledge::{IdVec, Signal, SignalId, VariableId};
use crate::time::Span;
use crate::unit::Unit;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::vec;
use alloc::vec::Vec;

/// A rated signal is silent after this many periods: one or two are lost or late on every real bus.
const SILENT_PERIODS: f64 = 5.0;
/// And not before this: the scheduling of a busy machine alone delays a fast signal by tens of milliseconds.
const SILENT_AT_LEAST: Span = Span::from_millis(100);

/// Reads signals; one without a known variable is left out.
pub(super) fn build(
    problems: &mut Problems,
    draft: &Draft,
    variables: &Variables,
) -> IdVec<SignalId, Signal> {
    let mut signals = IdVec::new();
    let mut names: BTreeMap<&str, SignalId> = BTreeMap::new();
    let mut origins = Vec::new();
    for draft in &draft.signals {
        let signal = signal(problems, draft, variables);
        if names.contains_key(draft.name.text.as_str()) {
            problems.error(&draft.name, format!("signal `{}` is given twice", draft.name.text), "keep one");
        } else if let Some(signal) = signal {
            names.insert(&draft.name.text, signals.push(signal));
            origins.push(draft);
        }
    }
    let declared: BTreeSet<&str> = draft.signals.iter().map(|draft| draft.name.text.as_str()).collect();
    for (signal, draft) in signals.iter_mut().zip(&origins) {
        signal.derived_from = derivation(problems, &draft.derived_from, &names, &declared);
    }
    report_cycles(problems, &signals, &origins);
    signals
}

fn signal(problems: &mut Problems, draft: &SignalDraft, variables: &Variables) -> Option<Signal> {
    let variable = carried(problems, draft, variables);
    let unit = unit(problems, draft, variable, variables);
    let rate_hz = draft.rate.as_ref().and_then(|text| quantity::frequency(problems, text));
    let error = draft.value_error.as_ref();
    let time_error = draft.time_error.as_ref();
    let signal = Signal {
        name: draft.name.text.clone(),
        variable: variable.unwrap_or_else(|| crate::knowledge::Id::from_index(0)),
        source: draft.source.as_ref().unwrap_or(&draft.name).text.clone(),
        rate_hz,
        value_error: error
            .and_then(|bounds| quantity::value_error(problems, bounds, unit.as_ref()))
            .unwrap_or_default(),
        time_error: time_error
            .and_then(|bounds| quantity::time_error(problems, bounds))
            .unwrap_or((Span::ZERO, Span::ZERO)),
        delay: draft.delay.as_ref().and_then(|text| quantity::span(problems, text)).unwrap_or(Span::ZERO),
        timeout: timeout(problems, draft.timeout.as_ref(), rate_hz),
        derived_from: Vec::new(),
        properties: quantity::properties(problems, &draft.properties),
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

/// The signal's own unit, else its variable's.
fn unit(
    problems: &mut Problems,
    draft: &SignalDraft,
    variable: Option<VariableId>,
    variables: &Variables,
) -> Option<Unit> {
    let of_variable = variable.and_then(|id| variables.list[id].unit.as_ref());
    let Some(text) = &draft.unit else { return of_variable.cloned() };
    let own = quantity::unit(problems, text)?;
    let name = variable.map_or("", |id| variables.list[id].name.as_str());
    match of_variable {
        Some(unit) if unit.dimension != own.dimension => {
            let message = format!("`{own}` cannot be converted to `{unit}`, the unit of `{name}`");
            problems.error(text, message, "give the unit in which the values come");
            return of_variable.cloned();
        }
        None if variable.is_some() => {
            let help = format!("write `{name}: {{ unit: {own} }}` under `variables`");
            problems.warn(text, format!("`{name}` has no unit, so `{own}` cannot be checked"), help);
        }
        _ => {}
    }
    Some(own)
}

fn timeout(problems: &mut Problems, text: Option<&Text>, rate_hz: Option<f64>) -> Option<Span> {
    let usual = rate_hz.map(|rate| Span::from_seconds(SILENT_PERIODS / rate).max(SILENT_AT_LEAST));
    match text {
        None => usual,
        Some(text) if text.text == "none" => None,
        Some(text) => match quantity::span(problems, text) {
            Some(Span::ZERO) => {
                problems.error(text, "a signal that may never be silent", "write a time, or `timeout: none`");
                usual
            }
            read => read.or(usual),
        },
    }
}

/// The signals of these names, ascending; `declared` holds also the names of signals that were left out.
fn derivation(
    problems: &mut Problems,
    drafts: &[Text],
    names: &BTreeMap<&str, SignalId>,
    declared: &BTreeSet<&str>,
) -> Vec<SignalId> {
    let mut found = Vec::new();
    for name in drafts {
        match names.get(name.text.as_str()) {
            Some(&id) => found.push(id),
            None if declared.contains(name.text.as_str()) => {}
            None => problems.unknown(name, "signal", declared.iter().copied(), "declare it under `signals`"),
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Takes away, again and again, the signals that are derived from none that is left; what stays is in or behind a
/// cycle, and the first of it is reported.
fn report_cycles(problems: &mut Problems, signals: &IdVec<SignalId, Signal>, origins: &[&SignalDraft]) {
    let mut waiting: Vec<usize> = signals.iter().map(|signal| signal.derived_from.len()).collect();
    let mut derived: IdVec<SignalId, Vec<SignalId>> = IdVec::filled(signals.len(), |_| vec![]);
    for (id, signal) in signals.enumerate() {
        for &origin in &signal.derived_from {
            derived[origin].push(id);
        }
    }
    let mut free: Vec<SignalId> =
        signals.enumerate().filter(|(_, signal)| signal.derived_from.is_empty()).map(|(id, _)| id).collect();
    while let Some(origin) = free.pop() {
        for &id in &derived[origin] {
            if let Some(count) = waiting.get_mut(crate::knowledge::Id::index(id)) {
                *count -= 1;
                if *count == 0 {
                    free.push(id);
                }
            }
        }
    }
    if let Some((_, draft)) = waiting.iter().zip(origins).find(|(count, _)| **count > 0) {
        let message = format!("signal `{}` is derived from itself", draft.name.text);
        let at = draft.derived_from.first().unwrap_or(&draft.name);
        problems.error(at, message, "name only the signals that it is computed from");
    }
}
