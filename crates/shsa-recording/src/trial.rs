//! Which of several formats of lines a file has, where only its ending speaks for them: the first one of which a line can be read.

use super::format::Row;
use super::topic::{Body, Input, Listener, Times, Topic, TopicId};
use super::{Place, ReadOptions, RecordingError, read_with};
use std::path::{Path, PathBuf};

/// The format of a file among these.
///
/// # Errors
/// When no line of the file is of any of them, and what the file cannot be opened for.
pub(super) fn one_of<I: Input>(
    file: &Path,
    formats: &[&'static Row],
    open: impl Fn() -> Result<I, RecordingError>,
) -> Result<&'static Row, RecordingError> {
    for row in formats {
        let mut trial = Trial { file: file.to_owned(), topics: 0 };
        read_with(row.format, &mut open()?, &ReadOptions::default(), &mut trial)?;
        if trial.topics > 0 {
            return Ok(row);
        }
    }
    let tried = formats.iter().map(|row| row.name).collect();
    Err(RecordingError::NoLine { file: file.to_owned(), tried })
}

/// Counts the topics of a file.
struct Trial {
    file: PathBuf,
    topics: usize,
}

impl Listener for Trial {
    fn file(&self) -> &Path {
        &self.file
    }

    fn topic(&mut self, _topic: Topic<'_>) -> TopicId {
        self.topics += 1;
        TopicId(self.topics)
    }

    fn is_wanted(&self, _topic: TopicId) -> bool {
        false
    }

    fn message(&mut self, _topic: TopicId, _times: Times, _body: Body<'_>) {}

    fn damaged(&mut self, _place: Place, _problem: String) {}

    fn note(&mut self, _place: Place, _what: String) {}
}
