//! What the demonstrations show of a signal: whether it is trusted.

use super::terminal::Ink;
use shsa_core::engine::EventKind;

/// The displayed state of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum State {
    Trusted,
    Suspect,
    Failed,
    Silent,
}

impl State {
    /// What a decision about a signal makes of it; `None`: nothing.
    pub(super) fn after(kind: EventKind) -> Option<State> {
        match kind {
            EventKind::Suspected => Some(State::Suspect),
            EventKind::Failed => Some(State::Failed),
            EventKind::Silent => Some(State::Silent),
            EventKind::Restored => Some(State::Trusted),
            _ => None,
        }
    }

    pub(super) fn words(self) -> (&'static str, Ink) {
        match self {
            State::Trusted => ("ok", Ink::Good),
            State::Suspect => ("suspect", Ink::Warning),
            State::Failed => ("failed", Ink::Bad),
            State::Silent => ("silent", Ink::Bad),
        }
    }
}
