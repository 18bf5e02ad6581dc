//! How far a takeover is, what it has to know, and what it tells.

use crate::wiring::action::Job;
use shsa_core::time::Time;

/// Something to be told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super::super) struct Note {
    /// `silenced`, `refused`, `returning`, `returned`.
    pub(in super::super::super) kind: &'static str,
    /// Why, in words.
    pub(in super::super::super) because: String,
}

/// The state of the need, as far as its takeover has to know.
#[derive(Clone, Copy, Debug)]
pub(in super::super::super) struct Situation<'a> {
    pub(in super::super::super) now: Time,
    /// Whether the source is not trusted.
    pub(in super::super::super) is_bad: bool,
    /// Whether something else serves the need.
    pub(in super::super::super) is_served: bool,
    /// Whether the need is ours to serve.
    pub(in super::super::super) is_ours: bool,
    /// What serves the need.
    pub(in super::super::super) source: &'a str,
}

/// How often each of these has happened since the beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super::super) struct Counts {
    pub(in super::super::super) silenced: u64,
    pub(in super::super::super) refused: u64,
    pub(in super::super::super) returned: u64,
}

/// How far a takeover is.
#[derive(Debug)]
pub(super) enum Stage {
    /// The source publishes itself.
    Watching,
    Silencing(Job),
    /// When the name was last heard, and how often.
    Checking {
        heard: Option<Time>,
        count: u64,
    },
    /// The name is ours.
    Taken,
    /// The name is ours until the source is heard again.
    Restoring(Job),
    /// The attempt has failed, or the source is back: the source is looked at again at `until`.
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
