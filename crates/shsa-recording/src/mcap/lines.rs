//! The messages of one topic as lines: a journal within a file of MCAP.

use super::super::ReadOptions;
use super::super::topic::{Body, Listener, Times, Topic, TopicId};
use super::super::{Place, RecordingError};
use super::MAGIC;
use super::records::Cursor;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// The kind of the first record of every file.
const HEADER: u8 = 1;
/// Longer profiles are none of ours.
const PROFILE_MAX: u64 = 64;

/// Whether a file is one of MCAP with this profile.
pub fn has_profile(path: &Path, profile: &str) -> bool {
    let mut bytes = Vec::new();
    let most = MAGIC.len() as u64 + 1 + 8 + 4 + PROFILE_MAX;
    let read = File::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes));
    let header = read.ok().and_then(|_| bytes.strip_prefix(MAGIC));
    header.is_some_and(|header| {
        let mut at = Cursor(header);
        at.byte() == Some(HEADER) && at.u64().is_some() && at.text() == Some(profile)
    })
}

/// The messages of a topic, each with a line end; and the first damage. They end where something is damaged or missing; a file
/// without its end is read up to there.
///
/// # Errors
/// When the file cannot be read at all.
pub fn lines(path: &Path, topic: &str) -> Result<(Vec<u8>, Option<String>), RecordingError> {
    let unreadable = |reason| RecordingError::Unreadable { file: path.to_owned(), reason };
    let file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let mut gathered = Lines {
        path,
        length,
        topic,
        wanted: None,
        topics: 0,
        lines: Vec::new(),
        damage: None,
        is_over: false,
    };
    super::read(&mut BufReader::new(file), &ReadOptions::default(), &mut gathered)?;
    Ok((gathered.lines, gathered.damage))
}

struct Lines<'a> {
    path: &'a Path,
    length: u64,
    topic: &'a str,
    wanted: Option<TopicId>,
    topics: usize,
    lines: Vec<u8>,
    damage: Option<String>,
    /// Something before the end of the file is damaged: the lines after it are not those that follow.
    is_over: bool,
}

impl Listener for Lines<'_> {
    fn file(&self) -> &Path {
        self.path
    }

    fn topic(&mut self, topic: Topic<'_>) -> TopicId {
        let id = TopicId(self.topics);
        self.topics += 1;
        if topic.name == self.topic {
            self.wanted = Some(id);
        }
        id
    }

    fn is_wanted(&self, topic: TopicId) -> bool {
        self.wanted == Some(topic) && !self.is_over
    }

    fn message(&mut self, _topic: TopicId, _times: Times, body: Body<'_>) {
        if let Body::Bytes(line) = body {
            self.lines.extend_from_slice(line);
            self.lines.push(b'\n');
        }
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.is_over |= place != Place::Offset(self.length);
        self.damage.get_or_insert(problem);
    }

    fn note(&mut self, _place: Place, _what: String) {}
}
