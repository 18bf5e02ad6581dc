//! What the demonstrations show of a signal: whether it is trusted.

use crate::terminal::Ink;
use shsa_core::engine::EventKind;

/// The displayed state of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// Trusted.
    Trusted,
    /// Suspected.
    Suspect,
    /// Named as faulty.
    Failed,
    /// Without values.
    Silent,
}

impl State {
    /// What a decision about a signal makes of it; `None`: nothing.
    #[must_use]
    pub fn after(kind: EventKind) -> Option<State> {
        match kind {
            EventKind::Suspected => Some(State::Suspect),
            EventKind::Failed => Some(State::Failed),
            EventKind::Silent => Some(State::Silent),
            EventKind::Restored => Some(State::Trusted),
            _ => None,
        }
    }

    /// The state as a word, and its colour.
    #[must_use]
    pub fn words(self) -> (&'static str, Ink) {
        match self {
            State::Trusted => ("ok", Ink::Good),
            State::Suspect => ("suspect", Ink::Warning),
            State::Failed => ("failed", Ink::Bad),
            State::Silent => ("silent", Ink::Bad),
        }
    }
}
