//! Counts inputs that are missing in a journal.

use std::sync::{Mutex, PoisonError};

/// What is missing in a journal, a record or a state file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct Missing {
    /// Inputs that were not written.
    pub(in super::super) inputs: u64,
    /// The last reason.
    pub(in super::super) because: String,
    /// Whether inputs wait in memory while the disk refuses.
    pub(in super::super) waits: bool,
}

/// Counts lost inputs.
pub(super) fn lose(missing: &Mutex<Missing>, inputs: u64, because: &str) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.inputs += inputs;
    because.clone_into(&mut missing.because);
}

/// Sets the reason why the disk refuses; `None`: it accepts writes again.
pub(super) fn wait(missing: &Mutex<Missing>, because: Option<&str>) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.waits = because.is_some();
    if let Some(because) = because {
        because.clone_into(&mut missing.because);
    }
}
