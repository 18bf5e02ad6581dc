//! Explanations and lists of decisions as text.

use super::Explanation;
use crate::events::{paint_of, subject};
use crate::style::{Paint, Style};
use shsa_core::engine::Event;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drive::Run;
use shsa_format::words;

pub(super) fn text(explanation: &Explanation<'_>, style: Style) -> String {
    let mut parts = vec![style.paint(Paint::Bold, &explanation.headline())];
    for section in explanation.sections() {
        let mut lines = vec![style.paint(Paint::Bold, section.title)];
        for item in &section.items {
            lines.push(style.wrapped(&item.text, 2));
            lines.extend(item.notes.iter().map(|note| style.wrapped(note, 6)));
        }
        parts.push(lines.join("\n"));
    }
    parts.join("\n\n")
}

/// All decisions of a run, numbered, one line each.
pub(super) fn list(run: &Run, style: Style) -> String {
    if run.events.is_empty() {
        return "No decisions: nothing failed, nothing was substituted.".to_owned();
    }
    let row = |(number, (known, event)): (usize, (&KnowledgeBase, &Event))| {
        let time = (event.time - run.first).seconds();
        let symptom = event.symptom.map_or(String::new(), |symptom| symptom.name().to_owned());
        vec![
            format!("{:>3}", number + 1),
            format!("{time:>9.3} s"),
            style.paint(paint_of(event.kind), event.kind.name()),
            subject(known, event).to_owned(),
            event.substitution.as_ref().map_or(symptom, |source| format!("<- {}", words::served_by(source))),
        ]
    };
    let rows = run.events_with_models().enumerate().map(row).collect();
    let table = style.table(&["  #", "time", "decision", "of", ""], rows);
    format!(
        "{table}\n\nWhy? Ask for a signal, for a signal at a time (SIGNAL@TIME), or with --decision NUMBER."
    )
}
