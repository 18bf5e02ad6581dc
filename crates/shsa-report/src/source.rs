//! The inputs of one session: recordings under one model after the other, a journal, or a story.

use shsa_core::engine::Input;
use shsa_core::time::Time;
use shsa_format::drive::Era;
use shsa_format::story::Story;
use shsa_recording::Session;
use std::collections::BTreeMap;

/// The inputs of one session.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// The models, each with the inputs under it, in the order of time.
    pub eras: Vec<Era>,
    /// The same without injected faults, for comparison.
    pub clean: Option<Vec<Era>>,
    /// Beginning and end of the recording, even if a fault removes its first or last observations.
    pub span: Option<(Time, Time)>,
    /// The origin of times, if it is not the beginning of the run.
    pub origin: Option<Time>,
    /// The session's files, and why it is a session of its own; `None` for a journal or a story.
    pub session: Option<Session>,
    /// Rows without a value in all sessions, by signal.
    pub missing: BTreeMap<String, usize>,
    /// Whether part of the input could not be read.
    pub degraded: bool,
}

impl Source {
    /// The inputs of a story.
    #[must_use]
    pub fn of_story(story: &Story) -> Source {
        let eras = story.journal();
        let last = eras.iter().flat_map(|era| &era.inputs).map(Input::time).max();
        Source { eras, span: Some((Time(0), last.unwrap_or_default())), ..Source::default() }
    }
}
