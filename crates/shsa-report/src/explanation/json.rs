//! Explanations and lists of decisions as JSON.

use super::wording::Words;
use super::{Bearing, Explanation};
use crate::events::subject;
use serde_json::{Value, json};
use shsa_core::engine::{Comparison, Event, Rival, Side};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalSet};
use shsa_core::monitor::Symptom;
use shsa_core::reason::Range;
use shsa_core::time::Time;
use shsa_format::drive::Run;
use shsa_format::event;
use shsa_format::words;

/// All decisions of a run.
pub(super) fn list(run: &Run) -> Value {
    let decisions: Vec<Value> = run
        .events_with_models()
        .enumerate()
        .map(|(number, (known, event))| decision(number, known, event, run.first))
        .collect();
    json!({ "decisions": decisions })
}

fn decision(number: usize, known: &KnowledgeBase, event: &Event, first: Time) -> Value {
    json!({
        "number": number + 1,
        "time_s": (event.time - first).seconds(),
        "kind": event.kind.name(),
        "of": subject(known, event),
        "symptom": event.symptom.map(Symptom::name),
        "because": words::reasons(&event.because),
        "substitution": event.substitution.as_ref().map(words::served_by),
    })
}

pub(super) fn object(explanation: &Explanation<'_>) -> Value {
    let (words, evidence, run) =
        (explanation.about.words, explanation.about.evidence, &explanation.inquiry.run);
    let described = |bearing: Bearing| -> Vec<Value> {
        let chosen = evidence.comparisons.iter().filter(|each| Bearing::of(each) == bearing);
        chosen.map(|each| comparison(words, each, evidence.time)).collect()
    };
    let rivals: Vec<Value> = evidence.rivals.iter().map(|each| rival(words, each)).collect();
    let later: Vec<Value> = explanation
        .later_events()
        .map(|(number, event)| decision(number, words.knowledge, event, run.first))
        .collect();
    let needs: Vec<Value> = explanation
        .need_events()
        .into_iter()
        .map(|(number, known, event)| decision(number, known, event, run.first))
        .collect();
    let end = explanation.inquiry.end.as_ref();
    json!({
        "signal": explanation.inquiry.signal,
        "time_s": (explanation.time() - run.first).seconds(),
        "decision": explanation.about.event.map(|event| event.kind.name()),
        "number": explanation.inquiry.focus.event.map(|number| number + 1),
        "symptom": explanation.about.event.and_then(|event| event.symptom).map(Symptom::name),
        "verdict": event::verdict(evidence.absence, evidence.verdict),
        "because": explanation.about.event.map(|event| words::reasons(&event.because)),
        "against": described(Bearing::Against),
        "for": described(Bearing::For),
        "silent": described(Bearing::None),
        "rivals": rivals,
        "would_clear": if explanation.about.is_accused() { explanation.about.would_clear() } else { Vec::new() },
        "probation_s": evidence.probation.seconds(),
        "later": later,
        "verdict_at_end": end.map(|end| event::verdict(end.evidence.absence, end.evidence.verdict)),
        "needs": needs,
    })
}

fn comparison(words: Words<'_>, comparison: &Comparison, at: Time) -> Value {
    let variable = &words.knowledge.variables()[comparison.variable];
    let last = comparison.compared.map(|(own, other, _)| (own, other));
    let (own, other) = comparison.disagreed.or(last).unzip();
    let mut value = json!({
        "variable": variable.name,
        "unit": variable.unit.as_ref().map(ToString::to_string),
        "own": side(words, comparison, &comparison.own, own),
        "other": side(words, comparison, &comparison.other, other),
        "disagree": comparison.counts.0,
        "of": comparison.counts.1,
        "since_s": comparison.onset.map(|onset| (onset - words.first).seconds()),
    });
    if let (Bearing::None, Some(object)) = (Bearing::of(comparison), value.as_object_mut()) {
        object.insert("why".to_owned(), json!(words.why_silent(comparison, at)));
    }
    value
}

/// A way with its value at the last disagreement, else its last value.
fn side(words: Words<'_>, comparison: &Comparison, side: &Side, value: Option<Interval>) -> Value {
    let value = value.map(|value| Range::of(words.knowledge, comparison.variable, value));
    json!({
        "way": words.way(side),
        "rests_on": names(words, &side.rests_on),
        "lo": value.as_ref().map(|value| value.lo),
        "hi": value.as_ref().map(|value| value.hi),
    })
}

fn rival(words: Words<'_>, rival: &Rival) -> Value {
    let with = |each: &Comparison| words.way(&each.other);
    json!({
        "signal": words.signal(rival.signal),
        "verdict": event::verdict(None, rival.verdict),
        "ruled_out": !rival.explains_all(),
        "not_in": rival.not_in.len(),
        "agrees_with": rival.supported.iter().map(with).collect::<Vec<String>>(),
    })
}

fn names(words: Words<'_>, signals: &SignalSet) -> Vec<String> {
    signals.iter().map(|signal| words.signal(signal).to_owned()).collect()
}
