//! The files of a healer: its journal, its record and its state. A disk that refuses them is told, and delays nothing.

use super::Healer;
use crate::error::{Context, RuntimeError};
use crate::journal::{Bounds, Journal, Missing};
use crate::recording::{Recording, RunRecorder};
use crate::state_file::{Earlier, StateFile};
use crate::wiring::Patterns;
use shsa_core::engine::Input;
use shsa_core::time::Time;
use std::path::Path;

impl Healer {
    /// Writes every input to a journal from now on. A disk that refuses is told, and the run goes on without.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(in super::super) fn keep_journal(
        &mut self,
        folder: &Path,
        bounds: Bounds,
    ) -> Result<(), RuntimeError> {
        let journal = Journal::begin(folder, &self.name, bounds, self.engine.knowledge());
        let journal = journal.with_context(|| format!("writing a journal in {}", folder.display()))?;
        let Missing { waits, because, .. } = journal.missing();
        if waits {
            let folder = folder.display();
            self.notes.push_back(("degraded", format!("there is no journal in {folder} yet: {because}")));
        }
        self.input_log.journal = Some(journal);
        Ok(())
    }

    /// Has every input recorded from now on.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(in super::super) fn keep_record(
        &mut self,
        recorder: Box<dyn RunRecorder>,
    ) -> Result<(), RuntimeError> {
        let recording = Recording::begin(recorder);
        self.input_log.recording = Some(recording.context("starting a recorder")?);
        Ok(())
    }

    /// Restores the state of an earlier run, if there is one, and saves the state from now on. What cannot be read or saved is told,
    /// and the run goes on without.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(in super::super) fn keep_state(&mut self, folder: &Path, now: Time) -> Result<(), RuntimeError> {
        let (state_file, Earlier { snapshot, degraded }) = StateFile::open(folder, &self.name)
            .with_context(|| format!("keeping a state in {}", folder.display()))?;
        self.notes.extend(degraded.map(|because| ("degraded", because)));
        self.state_file = Some(state_file);
        self.patterns = Some(Patterns::open(folder, &self.name));
        if let Some(snapshot) = snapshot {
            self.give(Input::Restore { time: now, snapshot: Box::new(snapshot) });
        }
        self.remember_all();
        if let Some(Missing { because, .. }) = self.state_file.as_ref().and_then(StateFile::unsaved) {
            let folder = folder.display();
            self.notes.push_back(("degraded", format!("the state is not saved in {folder} yet: {because}")));
        }
        Ok(())
    }

    /// What is missing in its journal while the disk refuses it.
    pub(in super::super) fn waiting(&self) -> Option<Missing> {
        self.input_log.journal.as_ref().map(Journal::missing).filter(|missing| missing.waits)
    }

    /// What this run does without, as the disk refuses it.
    pub(in super::super) fn degraded(&self) -> impl Iterator<Item = String> {
        let journal =
            self.waiting().map(|missing| format!("the journal waits in memory: {}", missing.because));
        let state = self.state_file.as_ref().and_then(StateFile::unsaved);
        let state = state.map(|missing| format!("the state is not saved: {}", missing.because));
        journal.into_iter().chain(state)
    }

    /// What is missing in its journal, its record and its state file.
    pub(in super::super) fn missing(&self) -> impl Iterator<Item = Missing> {
        let state_file = self.state_file.as_ref().map(|state_file| state_file.missing().clone());
        self.input_log.missing().chain(state_file)
    }

    /// Saves the state if a decision has changed it, or if the last attempt has failed.
    pub(in super::super) fn remember(&mut self) {
        if let Some(state_file) =
            self.state_file.as_mut().filter(|state_file| self.has_decided || state_file.is_due())
        {
            state_file.save(&self.engine.snapshot());
            self.has_decided = false;
        }
    }

    /// Saves the state again if its file was removed.
    pub(in super::super) fn look_after_state(&mut self) {
        self.has_decided |= self.state_file.as_ref().is_some_and(StateFile::has_vanished);
    }

    /// Saves the state at the end of the run.
    pub(in super::super) fn remember_all(&mut self) {
        self.has_decided = true;
        self.remember();
    }
}
