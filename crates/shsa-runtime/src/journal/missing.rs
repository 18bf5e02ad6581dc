//! What is not in a journal although it should be.

use std::sync::{Mutex, PoisonError};

/// What cannot be found in the journal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct Missing {
    /// Inputs that were not written.
    pub(in super::super) inputs: u64,
    /// Why not, as it was last.
    pub(in super::super) because: String,
    /// Whether some waits in memory for a disk that refuses.
    pub(in super::super) waits: bool,
}

/// Counts inputs that are lost.
pub(super) fn lose(missing: &Mutex<Missing>, inputs: u64, because: &str) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.inputs += inputs;
    because.clone_into(&mut missing.because);
}

/// The disk refuses, for this reason; or it does not any more.
pub(super) fn wait(missing: &Mutex<Missing>, because: Option<&str>) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.waits = because.is_some();
    if let Some(because) = because {
        because.clone_into(&mut missing.because);
    }
}
