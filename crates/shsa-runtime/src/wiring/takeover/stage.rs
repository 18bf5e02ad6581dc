//! The stages of a takeover, its inputs and its notes.

use crate::wiring::action::Job;
use shsa_core::time::Time;

/// A note to report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super::super) struct Note {
    /// `silenced`, `refused`, `returning`, `returned`.
    pub(in super::super::super) kind: &'static str,
    /// The reason.
    pub(in super::super::super) because: String,
}

/// The state of the need, as an input of its takeover.
#[derive(Clone, Copy, Debug)]
pub(in super::super::super) struct Situation<'a> {
    pub(in super::super::super) now: Time,
    /// Whether the source is not trusted.
    pub(in super::super::super) is_bad: bool,
    /// Whether something other than the source serves the need.
    pub(in super::super::super) is_served: bool,
    /// Whether this instance serves the need.
    pub(in super::super::super) is_ours: bool,
    /// The source that serves the need.
    pub(in super::super::super) source: &'a str,
}

/// How often each event has happened since the beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super::super) struct Counts {
    pub(in super::super::super) silenced: u64,
    pub(in super::super::super) refused: u64,
    pub(in super::super::super) returned: u64,
}

/// The stage of a takeover.
#[derive(Debug)]
pub(super) enum Stage {
    /// The source publishes itself.
    Watching,
    Silencing(Job),
    /// When the last message under the name came, and how many have come.
    Checking {
        last_message: Option<Time>,
        count: u64,
    },
    /// This instance publishes under the name.
    Taken,
    /// The source may publish again; its name is served until its first message.
    Restoring(Job),
    /// The attempt has failed, or the source is back: nothing is done before `until`.
    Waiting {
        until: Time,
    },
}

impl Stage {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Stage::Watching => "watching",
            Stage::Silencing(_) => "silencing",
            Stage::Checking { .. } => "checking",
            Stage::Taken => "taken",
            Stage::Restoring(_) => "restoring",
            Stage::Waiting { .. } => "waiting",
        }
    }
}
