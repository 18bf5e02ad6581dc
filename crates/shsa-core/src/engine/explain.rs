//! Decisions in words: which values disagreed, which alternatives there were, which limit was reached.

use super::message::{Event, EventKind};
use crate::diagnosis::Decision;
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, SignalId, SignalSet, VariableId};
use crate::monitor::{Absence, Change, Monitor, Pair, Relationship, Symptom, Tendency};
use crate::time::{Span, Time};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// How many disagreements a reason names.
const MOST_NAMED: usize = 3;

fn event(knowledge: &KnowledgeBase, kind: EventKind, signal: SignalId, because: String, time: Time) -> Event {
    let variable = Some(knowledge.signals()[signal].variable);
    Event { time, kind, signal: Some(signal), variable, symptom: None, because, substitution: None }
}

/// A signal that says nothing usable any more.
pub(super) fn absence(knowledge: &KnowledgeBase, change: &Change, absence: Absence, now: Time) -> Event {
    let timeout = knowledge.signals()[change.signal].timeout.unwrap_or(Span::ZERO);
    let last = match change.last_valid {
        Some(last) => format!("the last one {} ago", span(now - last)),
        None => "none ever".to_string(),
    };
    let (kind, symptom, what) = match absence {
        Absence::Silent => (EventKind::Silent, Symptom::Silent, "nothing received"),
        Absence::Invalid => (
            EventKind::Failed,
            Symptom::Invalid,
            "no possible value (not a number, out of range or of a wrong shape)",
        ),
    };
    let because = format!("{what} within {}: {last}", span(timeout));
    Event { symptom: Some(symptom), ..event(knowledge, kind, change.signal, because, now) }
}

/// A signal that speaks again and has done so for its probation.
pub(super) fn returned(knowledge: &KnowledgeBase, signal: SignalId, probation: Span, now: Time) -> Event {
    let because = format!("it has spoken again for {}", span(probation));
    event(knowledge, EventKind::Restored, signal, because, now)
}

/// A change of verdict.
pub(super) fn decision(
    knowledge: &KnowledgeBase,
    monitor: &Monitor,
    decision: &Decision,
    now: Time,
) -> Event {
    let accusation = |kind, signal, conclusion: &str| {
        let symptom = monitor.symptom(signal, now);
        let because = match traits(monitor, signal, symptom, now) {
            Some(traits) => {
                format!("{}; {traits}; {conclusion}", disagreements(knowledge, monitor, signal, now))
            }
            None => format!("{}; {conclusion}", disagreements(knowledge, monitor, signal, now)),
        };
        Event { symptom: Some(symptom), ..event(knowledge, kind, signal, because, now) }
    };
    match decision {
        Decision::Failed(signal) => {
            accusation(EventKind::Failed, *signal, "no other explanation is as small")
        }
        Decision::Suspected(signal, choice) if choice.len() == 1 => {
            let conclusion = "it explains most, but some comparisons are undecided";
            accusation(EventKind::Suspected, *signal, conclusion)
        }
        Decision::Suspected(signal, choice) => {
            let conclusion = format!("it may be any of {}", names(knowledge, choice));
            accusation(EventKind::Suspected, *signal, &conclusion)
        }
        Decision::Cleared(signal) => {
            let because = "every comparison with it agrees again".to_string();
            event(knowledge, EventKind::Restored, *signal, because, now)
        }
    }
}

/// What makes a symptom, where the disagreements do not tell.
fn traits(monitor: &Monitor, signal: SignalId, symptom: Symptom, now: Time) -> Option<String> {
    match symptom {
        Symptom::Frozen => {
            Some(format!("it has said the same for {}", span(now - monitor.stillness(signal).since())))
        }
        Symptom::Skewed => {
            let late = monitor.skew(signal, now)?;
            let side = if late.0 < 0 { "early" } else { "late" };
            Some(format!("it seems to tell things {} {side}", span(Span(late.0.abs()))))
        }
        Symptom::Noisy => Some("its values scatter around what others say".to_string()),
        Symptom::Drifting => Some("the difference has built up slowly".to_string()),
        _ => None,
    }
}

/// A signal that was accused before the knowledge base changed, and is not any more.
pub(super) fn judged_anew(
    knowledge: &KnowledgeBase,
    signal: SignalId,
    is_described_anew: bool,
    now: Time,
) -> Event {
    let because = match is_described_anew {
        true => "the changed model describes it anew",
        false => "the comparisons that spoke about it are gone with the changed model",
    };
    event(knowledge, EventKind::Restored, signal, because.to_string(), now)
}

/// The disagreements that a signal is part of.
fn disagreements(knowledge: &KnowledgeBase, monitor: &Monitor, signal: SignalId, now: Time) -> String {
    let against =
        |pair: &&Pair| pair.signals.contains(signal) && pair.relationship(now) == Relationship::Conflict;
    let count = monitor.pairs().iter().filter(against).count();
    let mut named: Vec<String> = monitor
        .pairs()
        .iter()
        .filter(against)
        .take(MOST_NAMED)
        .filter_map(|pair| disagreement(knowledge, monitor, pair, now))
        .collect();
    if count > MOST_NAMED {
        named.push(format!("and {} more disagreements", count - MOST_NAMED));
    }
    named.join("; ")
}

fn disagreement(knowledge: &KnowledgeBase, monitor: &Monitor, pair: &Pair, now: Time) -> Option<String> {
    let (way, other) = (monitor.way(pair.way)?, monitor.way(pair.other)?);
    let (one, two) = (way.computation.way().describe(knowledge), other.computation.way().describe(knowledge));
    let variable = way.variable();
    if pair.window.relationship(now) != Relationship::Conflict {
        return Some(together(knowledge, variable, pair, (&one, &two)));
    }
    let last = pair.disagreement?;
    let (k, n) = pair.window.counts();
    Some(format!(
        "{one} says {} where {two} says {} ({k} of {n} comparisons)",
        interval(knowledge, variable, last.value),
        interval(knowledge, variable, last.other),
    ))
}

/// What comparisons that agree one by one say together.
fn together(
    knowledge: &KnowledgeBase,
    variable: VariableId,
    pair: &Pair,
    (one, two): (&str, &str),
) -> String {
    match pair.trend.tendency() {
        Tendency::Drift => {
            let mean = pair.trend.mean();
            let (more, less) = if mean < 0.0 { (two, one) } else { (one, two) };
            format!(
                "{more} has said {} more than {less} on average",
                difference(knowledge, variable, mean.abs())
            )
        }
        Tendency::Noise => format!("{one} and {two} scatter against each other"),
        Tendency::Skew => format!("{one} and {two} tell the same at different times"),
        Tendency::Calm | Tendency::Building => format!("{one} and {two} disagreed"),
    }
}

/// A difference of values in the unit of a variable.
pub(super) fn difference(knowledge: &KnowledgeBase, variable: VariableId, value: f64) -> String {
    match &knowledge.variables()[variable].unit {
        Some(unit) => format!("{} {unit}", number(unit.from_si(value) - unit.from_si(0.0))),
        None => number(value),
    }
}

/// An interval in the unit of a variable.
pub(super) fn interval(knowledge: &KnowledgeBase, variable: VariableId, value: Interval) -> String {
    let shown = |number: f64| match &knowledge.variables()[variable].unit {
        Some(unit) => unit.from_si(number),
        None => number,
    };
    let unit = knowledge.variables()[variable].unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
    format!("{}..{}{unit}", number(shown(value.lo())), number(shown(value.hi())))
}

/// With four significant digits, without an exponent where that is short.
fn number(value: f64) -> String {
    let magnitude = libm::floor(libm::log10(value.abs()));
    match magnitude {
        m if !m.is_finite() => "0".to_string(),
        m if (-4.0..0.0).contains(&m) => format!("{value:.*}", (3.0 - m) as usize),
        m if (0.0..4.0).contains(&m) => format!("{value:.*}", (3.0 - m) as usize),
        m if (4.0..9.0).contains(&m) => format!("{value:.0}"),
        _ => format!("{value:.3e}"),
    }
}

/// A span with the unit that suits it.
pub(super) fn span(length: Span) -> String {
    match length.seconds() {
        seconds if seconds.abs() < 1.0 => format!("{:.0} ms", seconds * 1e3),
        seconds if seconds.abs() < 100.0 => format!("{seconds:.1} s"),
        seconds => format!("{seconds:.0} s"),
    }
}

/// The first of some names, and how many there are beside.
pub(super) fn listed(names: &[&str]) -> String {
    let named = names.get(..MOST_NAMED.min(names.len())).unwrap_or_default().join(", ");
    match names.len().saturating_sub(MOST_NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// Names of signals, in file order.
pub(super) fn names(knowledge: &KnowledgeBase, signals: &SignalSet) -> String {
    let names: Vec<&str> = signals.iter().map(|signal| knowledge.signals()[signal].name.as_str()).collect();
    names.join(", ")
}
