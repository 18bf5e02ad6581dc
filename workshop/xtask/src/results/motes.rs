//! The labelled events of the motes: the reading at which each is detected, and decisions outside of them.

use super::markdown::table;
use super::replay::Event;
use super::{MOTES, notes};
use anyhow::Result;
use std::path::Path;

/// A change made at a mote: its label in the recording.
struct Introduced {
    mote: &'static str,
    neighbour: &'static str,
    first: u64,
    last: u64,
}

const INTRODUCED: [Introduced; 2] = [
    Introduced { mote: "mote_1", neighbour: "mote_2", first: 2344, last: 2460 },
    Introduced { mote: "mote_4", neighbour: "mote_3", first: 2362, last: 2393 },
];

/// The number of readings after an event in which its end may be detected.
const AFTERMATH: u64 = 10;

/// The number of the reading at a time: one every 5 s, from 1.
fn reading(event: &Event) -> u64 {
    (event.time_s / 5.0).round() as u64 + 1
}

impl Introduced {
    /// Whether an event is about a mote of this room.
    fn concerns(&self, event: &Event) -> bool {
        event
            .signal
            .as_deref()
            .is_some_and(|signal| signal.starts_with(self.mote) || signal.starts_with(self.neighbour))
    }

    fn covers(&self, event: &Event) -> bool {
        (self.first..=self.last + AFTERMATH).contains(&reading(event))
    }

    fn row(&self, events: &[Event]) -> Vec<String> {
        let accuses = |event: &&&Event| ["suspected", "failed"].contains(&&*event.kind);
        let own: Vec<&Event> = events.iter().filter(|event| self.concerns(event)).collect();
        let first = own.iter().find(accuses);
        let found = first.map_or("-".to_owned(), |event| reading(event).to_string());
        let sample = first.map_or("-".to_owned(), |event| (reading(event) + 1 - self.first).to_string());
        let together = own.iter().filter(|event| first.is_some_and(|first| first.time_s == event.time_s));
        let accused: Vec<&str> =
            together.filter(accuses).filter_map(|event| event.signal.as_deref()).collect();
        let last = own.iter().map(|event| reading(event)).max();
        let label = format!("{} to {}", self.first, self.last);
        let last = last.map_or("-".to_owned(), |reading| reading.to_string());
        vec![self.mote.to_owned(), label, found, sample, accused.join(", "), last]
    }
}

pub(super) fn section(program: &Path) -> Result<String> {
    let report = MOTES.replay(program, &[], 1)?;
    let rows: Vec<Vec<String>> = INTRODUCED.iter().map(|introduced| introduced.row(&report.events)).collect();
    let header = [
        "mote",
        "labelled readings",
        "found at reading",
        "sample of the event",
        "suspected then",
        "last event at reading",
    ];
    let outside = |event: &&Event| !INTRODUCED.iter().any(|introduced| introduced.covers(event));
    let outside = report.events.iter().filter(outside).count();
    Ok(format!(
        "Command: `{}`\n\n{}\nEvents outside of these readings and the {AFTERMATH} after them: {outside}.\n{}",
        MOTES.command(&[]),
        table(&header, &rows),
        notes::MOTES
    ))
}
