//! Decisions as JSON: the fields of an event, and the word for the verdict on a signal.

use crate::words;
use serde_json::{Map, Value, json};
use shsa_core::engine::Event;
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::monitor::{Absence, Symptom};
use shsa_core::trust::Verdict;

/// The content of an event without its time; its ids belong to `known`.
#[must_use]
pub fn fields(known: &KnowledgeBase, event: &Event) -> Map<String, Value> {
    let always = [
        ("kind", json!(event.kind.name())),
        ("signal", json!(event.signal.map(|signal| &known.signals()[signal].name))),
        ("variable", json!(event.variable.map(|variable| &known.variables()[variable].name))),
        ("symptom", json!(event.symptom.map(Symptom::name))),
        ("because", json!(words::reasons(&event.because))),
        ("substitution", json!(event.substitution.as_ref().map(words::served_by))),
    ];
    let several =
        |id: &NeedId| known.needs_named(&known.variables()[known.needs()[*id].variable].name).len() > 1;
    let need = event.need.filter(several).map(|need| ("need", json!(known.needs()[need].signal)));
    let accused = [
        ("relation", event.relation.map(|relation| json!(known.relations()[relation].name))),
        ("cause", event.cause.map(|cause| json!(known.causes()[cause].name))),
        ("probability", event.probability.map(|probability| json!(probability))),
    ];
    let accused = accused.into_iter().filter_map(|(key, value)| Some((key, value?)));
    always.into_iter().chain(need).chain(accused).map(|(key, value)| (key.to_owned(), value)).collect()
}

/// The verdict on a signal in one word; the absence of a signal comes before its verdict.
#[must_use]
pub fn verdict(absence: Option<Absence>, verdict: Verdict) -> &'static str {
    match (absence, verdict) {
        (Some(Absence::Silent), _) => "silent",
        (Some(Absence::Invalid | Absence::OutOfRange), _) | (None, Verdict::Failed) => "failed",
        (None, Verdict::Unknown) => "unknown",
        (None, Verdict::Healthy) => "healthy",
        (None, Verdict::Suspect) => "suspect",
    }
}
