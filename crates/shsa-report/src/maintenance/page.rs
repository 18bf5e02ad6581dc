//! The report as a page for the browser.

use super::text::{NEEDS, SIGNALS};
use super::{Maintenance, NeedRecord, SignalRecord};
use crate::page::{document, paragraphs, section, table};
use shsa_drawing::escaped;
use shsa_format::words;

impl Maintenance {
    /// The report as a page, which needs nothing else; `model` is the name of the model.
    #[must_use]
    pub fn page(&self, model: &str) -> String {
        let signals = table(&SIGNALS, self.signals.iter().map(|it: &SignalRecord| it.cells(None)));
        let needs = table(&NEEDS, self.needs.iter().map(|it: &NeedRecord| it.cells(self.watched)));
        let episodes = self.signals.iter().flat_map(|it| {
            it.episodes.iter().map(|episode| {
                vec![
                    it.name.clone(),
                    episode.worst.name().to_owned(),
                    words::long_span(episode.from - self.first),
                    words::long_span(episode.length),
                    episode.because.clone(),
                ]
            })
        });
        let episodes = table(&["signal", "was", "after", "for", "because"], episodes);
        let drifting = paragraphs(self.drifting());
        let lead = escaped(&self.head());
        let body = [
            section(
                "Signals that were not trusted",
                "The one first whose replacement restores most.",
                &signals,
            ),
            section("Needs", "A need has no spare while one more loss would take it.", &needs),
            section("What drifts within its errors", "", &drifting),
            section("Each time", "", &episodes),
            self.left_out().map_or(String::new(), |line| format!("<p>{line}</p>\n")),
        ];
        document(&escaped(model), "maintenance", &lead, &body.concat())
    }
}
