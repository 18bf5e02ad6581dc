//! Decisions as text, and what a decision is about.

use crate::style::{Paint, Style};
use shsa_core::engine::{Event, EventKind, Severity};
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::words;

/// A decision in two lines or more: its kind, what it is about, and the new source after `time`, which is a text of 11 characters or
/// so; below them the reasons. `known` is the model under which it was decided.
#[must_use]
pub fn event_text(style: Style, time: &str, known: &KnowledgeBase, event: &Event) -> String {
    let relation = event.relation.map(|relation| format!("relation {}", known.relations()[relation].name));
    let need = event.need.map(|need| known.need_name(need));
    let subject = match (event.signal, &relation, event.variable) {
        (Some(signal), ..) => known.signals()[signal].name.as_str(),
        (None, Some(relation), _) => relation,
        (None, None, Some(variable)) => need.unwrap_or(&known.variables()[variable].name),
        (None, None, None) => "",
    };
    let kind = style.paint(paint_of(event.kind), &format!("{:<11}", event.kind.name()));
    let source = event
        .substitution
        .as_ref()
        .map_or(String::new(), |source| format!(" <- {}", words::served_by(source)));
    format!("{time}  {kind} {subject}{source}\n{}", style.wrapped(&words::reasons(&event.because), 13))
}

/// The colour of a decision, by its [severity](Severity).
#[must_use]
pub fn paint_of(kind: EventKind) -> Paint {
    match kind.severity() {
        Severity::Error => Paint::Red,
        Severity::Warning => Paint::Yellow,
        Severity::Info => Paint::Green,
    }
}

/// The signal of an event, or the variable of its need.
pub(crate) fn subject<'k>(known: &'k KnowledgeBase, event: &Event) -> &'k str {
    match (event.signal, event.variable) {
        (Some(signal), _) => &known.signals()[signal].name,
        (None, Some(variable)) => &known.variables()[variable].name,
        (None, None) => "",
    }
}

/// Whether an event reports that a signal is not trusted.
pub(crate) fn is_accusation(event: &Event) -> bool {
    event.signal.is_some() && event.kind.accuses()
}
