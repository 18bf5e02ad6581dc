//! Decisions in words: as a JSON object and as lines on a terminal.

use crate::show::{self, Paint};
use serde_json::{Map, Value, json};
use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::monitor::Symptom;

/// What an event says, without its time; `known` is what its ids belong to.
pub(crate) fn event_fields(known: &KnowledgeBase, event: &Event) -> Map<String, Value> {
    let always = [
        ("kind", json!(event.kind.name())),
        ("signal", json!(event.signal.map(|signal| &known.signals()[signal].name))),
        ("variable", json!(event.variable.map(|variable| &known.variables()[variable].name))),
        ("symptom", json!(event.symptom.map(Symptom::name))),
        ("because", json!(event.because)),
        ("substitution", json!(event.substitution)),
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

/// What an event says, under a time that is written already.
pub(crate) fn event_text(time: &str, known: &KnowledgeBase, event: &Event) -> String {
    let relation = event.relation.map(|relation| format!("relation {}", known.relations()[relation].name));
    let need = event.need.map(|need| known.need_name(need));
    let subject = match (event.signal, &relation, event.variable) {
        (Some(signal), ..) => known.signals()[signal].name.as_str(),
        (None, Some(relation), _) => relation,
        (None, None, Some(variable)) => need.unwrap_or(&known.variables()[variable].name),
        (None, None, None) => "",
    };
    let kind = paint_kind(event.kind);
    let source = event.substitution.as_ref().map_or(String::new(), |source| format!(" <- {source}"));
    format!("{time}  {kind} {subject}{source}\n{}", show::wrapped(&event.because, 13))
}

fn paint_kind(kind: EventKind) -> String {
    let name = format!("{:<11}", kind.name());
    match kind {
        EventKind::Failed | EventKind::Unhealable | EventKind::Refused => show::paint(Paint::Red, &name),
        EventKind::Suspected | EventKind::Silent => show::paint(Paint::Yellow, &name),
        EventKind::Substituted | EventKind::Restored => show::paint(Paint::Green, &name),
    }
}
