//! What a run says about the next maintenance: which sensors were accused, how long redundancy was down, what to replace first, and
//! what drifts towards the end of its errors.
//!
//! # Example
//! ```
//! use shsa_core::engine::Options;
//! use shsa_format::drive::Run;
//! use shsa_report::maintenance::Maintenance;
//! use shsa_report::{Source, Style};
//!
//! let text = std::fs::read_to_string("../../stories/02-fallback-by-value.yaml")?;
//! let story = shsa_format::story::load(&text, "02.yaml", std::path::Path::new(".")).story.expect("a story");
//! let source = Source::of_story(&story);
//! let run = Run::of(&source.eras, source.span, Options::default(), |run, given| {
//!     run.give(given);
//!     Ok::<(), std::convert::Infallible>(())
//! })?;
//! let maintenance = Maintenance::of(&[run]).expect("there is a run");
//! assert!(maintenance.is_due());
//! assert!(maintenance.text(Style::PLAIN).contains("/gnss/speed: failed"));
//! assert_eq!(maintenance.json()["signals"][0]["name"], "/gnss/speed");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod history;
mod redundancy;
mod text;
mod json;
mod page;
#[cfg(test)]
mod tests;

use history::{Episode, of_relations, of_signals, unserved};
use redundancy::{Redundancy, redundancy};
use serde_json::Value;
use shsa_core::analysis::Options;
use shsa_core::engine::EventKind;
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{Noted, notes};
use shsa_format::drive::Run;
use shsa_format::words;
use std::cmp::Reverse;

/// How a signal did, or a relation.
struct SignalRecord {
    name: String,
    /// Longest untrusted first.
    episodes: Vec<Episode>,
    /// How long it was not trusted in all.
    away: Span,
    /// By how much a replacement shortens the times in which needs have no spare or no source.
    restores: Span,
}

impl SignalRecord {
    fn new(name: String, mut episodes: Vec<Episode>) -> SignalRecord {
        episodes.sort_by_key(|it| Reverse(it.length));
        let away = episodes.iter().fold(Span::ZERO, |sum, it| sum + it.length);
        SignalRecord { name, episodes, away, restores: Span::ZERO }
    }

    fn count(&self, kind: EventKind) -> usize {
        self.episodes.iter().filter(|it| it.worst == kind).count()
    }

    /// What it is at the end.
    fn now(&self) -> &'static str {
        self.episodes.iter().find(|it| it.is_open).map_or("trusted", |it| it.worst.name())
    }
}

/// How a need did.
struct NeedRecord {
    name: String,
    /// How long nothing served it.
    unserved: Span,
    redundancy: Redundancy,
}

/// What runs of one system say about its maintenance.
pub struct Maintenance {
    first: Time,
    /// The time that was watched.
    watched: Span,
    /// Signals and relations that were accused, the one first whose replacement restores most.
    signals: Vec<SignalRecord>,
    needs: Vec<NeedRecord>,
    /// Learned variables that have drifted: the latest event of each relation, in words.
    ageing: Vec<(String, String)>,
    /// Lasting deviations at the end that accuse nobody yet.
    notes: Vec<Noted>,
    /// How many combinations of lost signals were left out of the redundancy.
    left_out: usize,
}

impl Maintenance {
    /// The report of runs that follow each other; `None` without a run. Signals and needs are those of the last model.
    ///
    /// Complexity: a few dozen searches for each need and for each of at most 256 combinations of lost signals, the longest first.
    #[must_use]
    pub fn of(runs: &[Run]) -> Option<Maintenance> {
        let last = runs.last()?;
        let knowledge = last.engine.knowledge();
        let watched = runs.iter().map(|run| run.last - run.first).fold(Span::ZERO, |sum, span| sum + span);
        let signals = of_signals(knowledge, runs).into_iter();
        let mut signals: Vec<SignalRecord> = signals
            .map(|(id, episodes)| SignalRecord::new(knowledge.signals()[id].name.clone(), episodes))
            .collect();
        let found = redundancy(knowledge, runs, Options::default());
        for record in &mut signals {
            record.restores = knowledge.signal(&record.name).map_or(Span::ZERO, |id| found.restored_by(id));
        }
        signals.extend(of_relations(runs).into_iter().map(|(name, it)| SignalRecord::new(name, it)));
        signals.sort_by_key(|it| Reverse((it.restores, it.away)));
        let needs = knowledge
            .needs()
            .enumerate()
            .map(|(id, _)| NeedRecord {
                name: knowledge.need_name(id).to_owned(),
                unserved: unserved(knowledge, runs, id),
                redundancy: found.needs[id],
            })
            .collect();
        Some(Maintenance {
            first: runs.first().map_or(Time(0), |run| run.first),
            watched,
            signals,
            needs,
            ageing: ageing(runs),
            notes: notes(&last.engine).collect(),
            left_out: found.left_out,
        })
    }

    /// The report as a JSON object; times are in seconds.
    #[must_use]
    pub fn json(&self) -> Value {
        json::object(self)
    }

    /// Whether anything is to be done: a signal was accused, something drifts, or a need had no spare.
    #[must_use]
    pub fn is_due(&self) -> bool {
        let is_bare = |it: &NeedRecord| it.unserved > Span::ZERO || it.redundancy.bare > Span::ZERO;
        !self.signals.is_empty()
            || !self.ageing.is_empty()
            || !self.notes.is_empty()
            || self.needs.iter().any(is_bare)
    }
}

/// The latest event of each relation whose learned variable drifts.
fn ageing(runs: &[Run]) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    let events = runs.iter().flat_map(Run::events_with_models);
    for (known, event) in events.filter(|(_, event)| event.kind == EventKind::Ageing) {
        let Some(relation) = event.relation else { continue };
        let (name, words) = (known.relations()[relation].name.clone(), words::reasons(&event.because));
        match found.iter_mut().find(|(of, _)| *of == name) {
            Some(entry) => entry.1 = words,
            None => found.push((name, words)),
        }
    }
    found
}
