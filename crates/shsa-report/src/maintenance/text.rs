//! The report as text.

use super::{Maintenance, NeedRecord, SignalRecord};
use crate::style::{Paint, Style};
use shsa_core::engine::EventKind;
use shsa_core::time::Span;
use shsa_format::words;

/// The columns about signals.
pub(super) const SIGNALS: [&str; 7] =
    ["signal or relation", "now", "failed", "suspected", "silent", "not trusted", "a replacement restores"];
/// The columns about needs.
pub(super) const NEEDS: [&str; 4] = ["need", "survives losses", "without a spare", "not served"];

impl Maintenance {
    /// The report in paragraphs, each without an end of line; times are those of all runs together.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        let mut parts = vec![self.head()];
        if !self.signals.is_empty() {
            parts.push(style.table(&SIGNALS, self.signals.iter().map(|it| it.cells(Some(style))).collect()));
            let because = self.signals.iter().filter_map(|it| {
                let worst = it.episodes.first()?;
                Some(format!("{}: {}\n{}", it.name, worst.worst.name(), style.wrapped(&worst.because, 4)))
            });
            parts.push(format!("Why, the longest time of each:\n{}", because.collect::<Vec<_>>().join("\n")));
        }
        parts.push(style.table(&NEEDS, self.needs.iter().map(|it| it.cells(self.watched)).collect()));
        let drifting = self.drifting();
        if !drifting.is_empty() {
            parts.push(format!("Drifts within its errors:\n  {}", drifting.join("\n  ")));
        }
        parts.extend(self.left_out());
        parts.join("\n\n")
    }

    /// The first sentence.
    pub(super) fn head(&self) -> String {
        let watched = words::long_span(self.watched);
        match (self.is_due(), self.signals.first()) {
            (false, _) => format!("Nothing to do: in {watched} every signal was trusted and nothing drifts."),
            (true, Some(first)) if first.restores > Span::ZERO => {
                let restores = words::long_span(first.restores);
                let name = &first.name;
                format!(
                    "Look at {name} first: its loss left needs without a spare or a source for {restores} of {watched}."
                )
            }
            (true, Some(_)) => {
                format!("In {watched}, not all was trusted, and no need was without a spare.")
            }
            (true, None) => format!("In {watched}, every signal was trusted."),
        }
    }

    /// What drifts and accuses nobody, and learned variables.
    pub(super) fn drifting(&self) -> Vec<String> {
        let learned = self.ageing.iter().map(|(relation, words)| format!("relation {relation}: {words}"));
        self.notes.iter().map(shsa_format::comparisons::Noted::text).chain(learned).collect()
    }

    pub(super) fn left_out(&self) -> Option<String> {
        let shortest =
            format!("The {} shortest combinations of lost signals are not counted.", self.left_out);
        (self.left_out > 0).then_some(shortest)
    }
}

impl SignalRecord {
    pub(super) fn cells(&self, style: Option<Style>) -> Vec<String> {
        let now = self.now();
        let paint = match now {
            "trusted" => Paint::Green,
            "suspected" => Paint::Yellow,
            _ => Paint::Red,
        };
        vec![
            self.name.clone(),
            style.map_or(now.to_owned(), |style| style.paint(paint, now)),
            self.count(EventKind::Failed).to_string(),
            self.count(EventKind::Suspected).to_string(),
            self.count(EventKind::Silent).to_string(),
            words::long_span(self.away),
            if self.restores > Span::ZERO { words::long_span(self.restores) } else { "-".to_owned() },
        ]
    }
}

impl NeedRecord {
    pub(super) fn cells(&self, watched: Span) -> Vec<String> {
        let of_watched = |time: Span| match time {
            Span::ZERO => "never".to_owned(),
            time => {
                let share = 100.0 * time.seconds() / watched.seconds();
                format!("{} ({share:.1} %)", words::long_span(time))
            }
        };
        vec![
            self.name.clone(),
            self.redundancy.survives.map_or("-".to_owned(), |losses| losses.to_string()),
            of_watched(self.redundancy.bare),
            of_watched(self.unserved),
        ]
    }
}
