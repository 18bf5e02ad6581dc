//! Decisions as lines of text.

use crate::show::{self, Paint};
use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::words;

/// The text of an event, under a time that is already written.
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
    let source = event
        .substitution
        .as_ref()
        .map_or(String::new(), |source| format!(" <- {}", words::served_by(source)));
    format!("{time}  {kind} {subject}{source}\n{}", show::wrapped(&words::reasons(&event.because), 13))
}

fn paint_kind(kind: EventKind) -> String {
    let name = format!("{:<11}", kind.name());
    match kind {
        EventKind::Failed | EventKind::Unhealable | EventKind::Refused => show::paint(Paint::Red, &name),
        EventKind::Suspected | EventKind::Silent => show::paint(Paint::Yellow, &name),
        EventKind::Substituted | EventKind::Restored => show::paint(Paint::Green, &name),
    }
}
