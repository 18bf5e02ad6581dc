//! From frames to topics: a frame that a DBC describes becomes a message with its signals, any other an identifier with its
//! bytes.

use super::super::topic::{Body, Field, Fields, Listener, Times, Topic, TopicId, Value};
use super::super::{Files, Place, ReadOptions, RecordingError};
use super::dbc::{Database, EXTENDED, Message, TEXT_MAX};
use super::signal::{Number, Signal};
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// The most identifiers, counted for each channel; frames of further ones are only counted.
const TOPICS_MAX: usize = 1 << 13;

/// The type of the messages of frames that no database describes.
pub const FRAME: &str = "CAN frame";

/// The longest chain of signals that select others.
const SELECTORS_MAX: usize = 8;

/// How many problems of a DBC are reported.
const PROBLEMS_TOLD: usize = 3;

/// A frame on the bus.
pub(in super::super) struct Frame<'a> {
    pub(in super::super) time: Time,
    /// The name or the number of the channel.
    pub(in super::super) channel: &'a str,
    /// The identifier; with [`EXTENDED`] where it has 29 bits.
    pub(in super::super) id: u32,
    pub(in super::super) data: &'a [u8],
}

/// The topics of a recording, by channel and identifier.
pub(in super::super) struct Bus {
    database: Database,
    channels: Vec<String>,
    topics: BTreeMap<(u32, usize), Known>,
    /// Error frames, requests without data, and frames of too many identifiers.
    passed: u64,
    /// The values of the message under construction.
    bytes: Vec<f64>,
}

/// The topic of an identifier on a channel.
struct Known {
    topic: TopicId,
    /// The identifier in the database.
    message: Option<u32>,
}

impl Bus {
    /// The bus with the DBC files of the options.
    ///
    /// # Errors
    /// When a DBC file cannot be read.
    pub(in super::super) fn new(
        options: &ReadOptions,
        listener: &mut dyn Listener,
    ) -> Result<Bus, RecordingError> {
        let mut database = Database::default();
        for file in &options.dbc {
            let text = text_of(file, &options.files)?;
            for (line, problem) in database.add(&text).into_iter().take(PROBLEMS_TOLD) {
                listener.note(Place::Whole, format!("{}:{line}: {problem}", file.display()));
            }
        }
        if options.dbc.is_empty() {
            let what = "without a DBC file (--dbc FILE) frames are bytes: 0x17#data[0]";
            listener.note(Place::Whole, what.to_owned());
        }
        Ok(Bus { database, channels: Vec::new(), topics: BTreeMap::new(), passed: 0, bytes: Vec::new() })
    }

    /// Counts a frame without data: an error on the bus, a remote frame.
    pub(in super::super) fn pass(&mut self) {
        self.passed += 1;
    }

    /// Reports a frame.
    pub(in super::super) fn report(&mut self, frame: &Frame<'_>, listener: &mut dyn Listener) {
        let Some((topic, message)) = self.known(frame, listener) else { return self.pass() };
        if !listener.is_wanted(topic) {
            return;
        }
        let times = Times::at(frame.time);
        match message.and_then(|id| self.database.messages.get(&id)) {
            Some(message) => {
                let values: Vec<Value<'_>> =
                    message.signals.iter().map(|signal| value(signal, message, frame.data)).collect();
                listener.message(topic, times, Body::Values(&values));
            }
            None => {
                self.bytes.clear();
                self.bytes.extend(frame.data.iter().copied().map(f64::from));
                listener.message(topic, times, Body::Values(&[Value::List(&self.bytes)]));
            }
        }
    }

    /// Reports what was left out.
    pub(in super::super) fn finish(&self, listener: &mut dyn Listener) {
        if self.passed > 0 {
            let what =
                format!("{} frames without data were passed over: errors of the bus, requests", self.passed);
            listener.note(Place::Whole, what);
        }
    }

    fn known(&mut self, frame: &Frame<'_>, listener: &mut dyn Listener) -> Option<(TopicId, Option<u32>)> {
        let channel = match self.channels.iter().position(|name| name == frame.channel) {
            Some(channel) => channel,
            None if self.channels.len() == 256 => return None,
            None => {
                self.channels.push(frame.channel.to_owned());
                self.channels.len() - 1
            }
        };
        if let Some(known) = self.topics.get(&(frame.id, channel)) {
            return Some((known.topic, known.message));
        }
        if self.topics.len() == TOPICS_MAX {
            return None;
        }
        let found = self.database.message(frame.id);
        let topic = report_topic(frame, found, listener);
        let message = found.map(|(id, _)| id);
        self.topics.insert((frame.id, channel), Known { topic, message });
        Some((topic, message))
    }
}

fn report_topic(frame: &Frame<'_>, found: Option<(u32, &Message)>, listener: &mut dyn Listener) -> TopicId {
    let id = frame.id & !EXTENDED;
    let Some((of_database, message)) = found else {
        let name = format!("0x{id:X}");
        let tags = [("channel", frame.channel)];
        let fields = Fields::named([Field::new("data")]);
        return listener.topic(Topic { tags: &tags, ..Topic::new(&name, FRAME, fields) });
    };
    let field = |signal: &Signal| {
        let unit = (!signal.unit.is_empty()).then(|| signal.unit.clone());
        Field { name: signal.name.clone(), unit }
    };
    let fields = Fields::named(message.signals.iter().map(field));
    let full = format!("0x{id:X}:{}", message.name);
    let source = format!("0x{:X}", id & 0xff);
    let tags = [("channel", frame.channel), ("source", &source)];
    // Several sources may send a group of J1939, each its own values.
    let tags = if of_database == frame.id { &tags[..1] } else { &tags };
    listener.topic(Topic { full: &full, tags, ..Topic::new(&message.name, &message.name, fields) })
}

fn value<'a>(signal: &Signal, message: &Message, data: &[u8]) -> Value<'a> {
    let number = is_there(signal, message, data, SELECTORS_MAX).then(|| signal.value(data)).flatten();
    match number {
        Some(Number::Whole(whole)) => Value::Whole(whole),
        Some(Number::Real(real)) => Value::Number(real),
        None => Value::Missing,
    }
}

/// Whether a signal is in this frame, by the values of its selectors.
fn is_there(signal: &Signal, message: &Message, data: &[u8], selectors: usize) -> bool {
    let Some(choice) = &signal.choice else { return true };
    let Some(selector) = message.signals.get(choice.selector).filter(|_| selectors > 0) else { return false };
    let raw = selector.raw(data);
    let is_chosen =
        raw.is_some_and(|raw| choice.ranges.iter().any(|(from, to)| (*from..=*to).contains(&raw)));
    is_chosen && is_there(selector, message, data, selectors - 1)
}

/// The text of a DBC: UTF-8, else Latin-1, which most tools write.
fn text_of(file: &Path, files: &Files) -> Result<String, RecordingError> {
    let mut bytes = Vec::new();
    let read = files.open(file).and_then(|input| input.take(TEXT_MAX).read_to_end(&mut bytes));
    read.map_err(|reason| RecordingError::Unreadable { file: file.into(), reason })?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|wrong| wrong.as_bytes().iter().copied().map(char::from).collect()))
}
