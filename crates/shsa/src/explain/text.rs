//! Explanations and lists of decisions as text.

use super::explanation::Explanation;
use crate::show::{self, Paint, paint};
use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drive::Run;
use shsa_format::words;

pub(super) fn text(explanation: &Explanation<'_>) -> String {
    let mut parts = vec![paint(Paint::Bold, &explanation.headline())];
    for section in explanation.sections() {
        let mut lines = vec![paint(Paint::Bold, section.title)];
        for item in &section.items {
            lines.push(show::wrapped(&item.text, 2));
            lines.extend(item.notes.iter().map(|note| show::wrapped(note, 6)));
        }
        parts.push(lines.join("\n"));
    }
    parts.join("\n\n")
}

/// All decisions of a run, numbered, one line each.
pub(super) fn list(run: &Run) -> String {
    if run.events.is_empty() {
        return "No decisions: nothing failed, nothing was substituted.".to_owned();
    }
    let row = |(number, (known, event)): (usize, (&KnowledgeBase, &Event))| {
        let time = (event.time - run.first).seconds();
        let symptom = event.symptom.map_or(String::new(), |symptom| symptom.name().to_owned());
        vec![
            format!("{:>3}", number + 1),
            format!("{time:>9.3} s"),
            paint_kind(event.kind),
            subject(known, event).to_owned(),
            event.substitution.as_ref().map_or(symptom, |source| format!("<- {}", words::served_by(source))),
        ]
    };
    let rows = run.told_events().enumerate().map(row).collect();
    let table = show::table(&["  #", "time", "decision", "of", ""], rows);
    format!(
        "{table}\n\nWhy? Ask for a signal, for a signal at a time (SIGNAL@TIME), or with --decision NUMBER."
    )
}

/// The signal of an event, or the variable of its need.
pub(crate) fn subject<'k>(known: &'k KnowledgeBase, event: &Event) -> &'k str {
    match (event.signal, event.variable) {
        (Some(signal), _) => &known.signals()[signal].name,
        (None, Some(variable)) => &known.variables()[variable].name,
        (None, None) => "",
    }
}

fn paint_kind(kind: EventKind) -> String {
    let colour = match kind {
        EventKind::Failed | EventKind::Unhealable | EventKind::Refused => Paint::Red,
        EventKind::Suspected | EventKind::Silent => Paint::Yellow,
        EventKind::Substituted | EventKind::Restored => Paint::Green,
    };
    paint(colour, kind.name())
}
