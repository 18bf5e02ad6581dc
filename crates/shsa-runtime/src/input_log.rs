//! What the inputs of a healer are written to: a journal, a recorder, both or none.

use super::files::Store;
use super::journal::{Journal, Missing};
use super::recording::Recording;
use shsa_core::time::Time;
use shsa_format::drive::Given;

/// Where inputs are written. Each writer counts by itself what it cannot write.
#[derive(Default)]
pub(super) struct InputLog {
    pub(super) journal: Option<Journal>,
    pub(super) recording: Option<Recording>,
}

impl InputLog {
    /// Adds an input; call it before the input is given to the engine.
    pub(super) fn record(&mut self, given: Given<'_>) {
        if let Some(journal) = &mut self.journal {
            // The journal itself counts what it cannot write.
            let _ = journal.record(given);
        }
        if let Some(recording) = &mut self.recording {
            recording.record(given);
        }
    }

    /// Adds who has given an order that was carried out, and what was done.
    pub(super) fn ordered(&mut self, time: Time, by: &str, done: &str) {
        if let Some(journal) = &mut self.journal {
            journal.ordered(time, by, done);
        }
    }

    /// Hands the added inputs to the writing threads, without waiting.
    pub(super) fn hand_over(&mut self) {
        self.journal.iter_mut().for_each(Journal::hand_over);
        self.recording.iter_mut().for_each(Recording::hand_over);
    }

    /// What is missing in the journal and in the record.
    pub(super) fn missing(&self) -> impl Iterator<Item = (Store, Missing)> {
        let journal = self.journal.as_ref().map(|journal| (Store::Journal, journal.missing()));
        let record = self.recording.as_ref().map(|recording| (Store::Record, recording.missing()));
        journal.into_iter().chain(record)
    }
}
