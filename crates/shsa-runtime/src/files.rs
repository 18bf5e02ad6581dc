//! The files of a healer: its journal, its record and its state. A disk that refuses them is told, and delays nothing.

use super::input_log::InputLog;
use super::journal::{Journal, Missing};
use super::state_file::{Earlier, StateFile};
use crate::error::{Context, RuntimeError};
use crate::options::JournalOptions;
use shsa_core::engine::Engine;
use shsa_core::knowledge::KnowledgeBase;
use std::path::{Path, PathBuf};

/// What a healer keeps on a disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Store {
    Journal,
    Record,
    /// The state, in this file.
    State(PathBuf),
}

impl Store {
    /// What is to be reported when this was missing at the last look and that is now.
    pub(super) fn notes(&self, before: &Missing, now: &Missing) -> Vec<String> {
        let (more, because) = (now.inputs.saturating_sub(before.inputs), &now.because);
        let lost = match self {
            Store::Journal => format!("{more} inputs are missing in the journal: {because}"),
            Store::Record => format!("{more} inputs are missing in the record: {because}"),
            Store::State(file) => format!("the state could not be saved in {}: {because}", file.display()),
        };
        let again = match self {
            Store::State(file) if now.inputs > 0 && !now.waits && (before.waits || more > 0) => {
                Some(format!("the state is saved again in {}", file.display()))
            }
            Store::Journal | Store::Record | Store::State(_) => None,
        };
        (more > 0).then_some(lost).into_iter().chain(again).collect()
    }
}

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
    pub(super) fn missing(&self) -> impl Iterator<Item = (Store, Missing)> {
        let state =
            self.state.as_ref().map(|state| (Store::State(state.path().to_owned()), state.missing().clone()));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(store: &Store, looks: &[(u64, bool)], expected: &[&str]) {
        let missing = |&(inputs, waits)| Missing { inputs, because: "it is full".to_owned(), waits };
        let looks = std::iter::once(Missing::default()).chain(looks.iter().map(missing));
        let looks: Vec<Missing> = looks.collect();
        let notes = looks.windows(2).flat_map(|pair| store.notes(&pair[0], &pair[1]));
        assert_eq!(notes.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_loss_names_the_file_and_a_state_that_is_saved_again_is_reported() {
        let state = Store::State("/state/car.json".into());
        let (lost, again) = (
            "the state could not be saved in /state/car.json: it is full",
            "the state is saved again in /state/car.json",
        );
        check(&state, &[(0, false), (0, false)], &[]);
        check(&state, &[(1, true), (1, true), (1, false), (1, false)], &[lost, again]);
        check(&state, &[(1, true), (1, false), (2, true), (2, false)], &[lost, again, lost, again]);
        // Both happened between two looks.
        check(&state, &[(1, false), (1, false), (2, false)], &[lost, again, lost, again]);
        check(
            &Store::Journal,
            &[(3, true), (3, false), (5, false)],
            &[
                "3 inputs are missing in the journal: it is full",
                "2 inputs are missing in the journal: it is full",
            ],
        );
        check(&Store::Record, &[(7, false)], &["7 inputs are missing in the record: it is full"]);
    }
}
