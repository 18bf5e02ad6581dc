//! The files of a healer: its journal, its record and its state. A disk that refuses them is told, and delays nothing.

use super::input_log::InputLog;
use super::journal::{Journal, Missing};
use super::state_file::{Earlier, StateFile};
use crate::error::{Context, RuntimeError};
use crate::options::JournalOptions;
use shsa_core::engine::Engine;
use shsa_core::knowledge::KnowledgeBase;
use std::path::Path;

/// The files of a healer.
#[derive(Default)]
pub(super) struct Files {
    pub(super) input_log: InputLog,
    state: Option<StateFile>,
    /// Whether a decision has not been saved yet.
    has_decided: bool,
}

impl Files {
    /// Writes every input to a journal from now on; returns why it cannot be written yet.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn keep_journal(
        &mut self,
        options: &JournalOptions,
        model: &str,
        knowledge: &KnowledgeBase,
    ) -> Result<Option<String>, RuntimeError> {
        let (journal, folder) = (Journal::begin(options, model, knowledge), &options.folder);
        self.input_log.journal =
            Some(journal.with_context(|| format!("writing a journal in {}", folder.display()))?);
        let words = |it: Missing| format!("there is no journal in {} yet: {}", folder.display(), it.because);
        Ok(self.waiting().map(words))
    }

    /// Saves the state in a folder from now on; returns the state of an earlier run.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn keep_state(&mut self, folder: &Path, model: &str) -> Result<Earlier, RuntimeError> {
        let (state, earlier) = StateFile::open(folder, model)
            .with_context(|| format!("keeping a state in {}", folder.display()))?;
        self.state = Some(state);
        Ok(earlier)
    }

    /// What is missing in the journal while the disk refuses it.
    pub(super) fn waiting(&self) -> Option<Missing> {
        self.input_log.journal.as_ref().map(Journal::missing).filter(|missing| missing.waits)
    }

    /// Why the present state is not saved.
    pub(super) fn unsaved(&self) -> Option<&Missing> {
        self.state.as_ref().and_then(StateFile::unsaved)
    }

    /// What the run does without, as the disk refuses it.
    pub(super) fn degraded(&self) -> impl Iterator<Item = String> {
        let journal = self.waiting().map(|it| format!("the journal waits in memory: {}", it.because));
        let state = self.unsaved().map(|it| format!("the state is not saved: {}", it.because));
        journal.into_iter().chain(state)
    }

    /// What is missing in the journal, the record and the state file.
    pub(super) fn missing(&self) -> impl Iterator<Item = Missing> {
        let state = self.state.as_ref().map(|state| state.missing().clone());
        self.input_log.missing().chain(state)
    }

    /// A decision has changed the state.
    pub(super) fn decided(&mut self) {
        self.has_decided = true;
    }

    /// Saves the state again if its file was removed.
    pub(super) fn look_after_state(&mut self) {
        self.has_decided |= self.state.as_ref().is_some_and(StateFile::has_vanished);
    }

    /// Saves the state if a decision has changed it, or if the last attempt has failed.
    pub(super) fn remember(&mut self, engine: &Engine) {
        if let Some(state) = self.state.as_mut().filter(|state| self.has_decided || state.is_due()) {
            state.save(&engine.snapshot());
            self.has_decided = false;
        }
    }
}
