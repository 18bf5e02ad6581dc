//! What the reader of a format tells of a file: topics, their messages, what is lost. A reader goes through a file once, in its
//! order, and knows nothing of signals; who listens decides what becomes of the messages.

use super::Place;
use shsa_core::time::Time;
use shsa_message::protobuf;
use shsa_message::ros::{Layout, Types};
use std::io::{BufRead, Seek};
use std::path::Path;
use std::sync::Arc;

/// The bytes of a recording.
pub(super) trait Input: BufRead + Seek {}

impl<T: BufRead + Seek> Input for T {}

/// The number of a topic that was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TopicId(pub(super) usize);

/// One topic, as it is told before its first message.
pub(super) struct Topic<'a> {
    /// What a source may say as long as only one topic has this name: `sensor_accel`, `RMC`.
    pub(super) name: &'a str,
    /// The name that only this one has: `sensor_accel[1]`, `GPRMC`; else the name again.
    pub(super) full: &'a str,
    /// What a filter may ask of the topic as a whole: `[sensor=T1]`.
    pub(super) tags: &'a [(&'a str, &'a str)],
    /// The type of its messages.
    pub(super) kind: &'a str,
    /// How values are found in its messages.
    pub(super) fields: Fields,
}

impl<'a> Topic<'a> {
    /// A topic that has its name alone.
    pub(super) fn new(name: &'a str, kind: &'a str, fields: Fields) -> Topic<'a> {
        Topic { name, full: name, tags: &[], kind, fields }
    }

    /// The source text that means this one and no other: `room[sensor=T1]`.
    pub(super) fn choice(&self) -> String {
        let tags = self.tags.iter().map(|(name, value)| format!("[{name}={value}]"));
        self.full.to_owned() + &tags.collect::<String>()
    }
}

/// How values are found in the messages of a topic.
#[derive(Clone)]
pub(super) enum Fields {
    /// One value for each, in this order: [`Body::Values`].
    Named(Arc<[Field]>),
    /// A JSON value: [`Body::Bytes`].
    Json,
    /// A message of ROS: [`Body::Bytes`].
    Ros {
        /// The types that are known.
        types: Arc<Types>,
        /// The name of the type among them.
        kind: String,
        /// How messages stand in the bytes.
        layout: Layout,
    },
    /// A message of Protocol Buffers, of the type of this name: [`Body::Bytes`].
    Protobuf(Arc<protobuf::Types>, String),
    /// Nobody knows how, for this reason; the messages can only be counted.
    Unknown(String),
}

impl Fields {
    /// Of these names and units.
    pub(super) fn named(fields: impl IntoIterator<Item = Field>) -> Fields {
        Fields::Named(fields.into_iter().collect())
    }
}

/// A field with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    /// Its name, which may have dots and brackets: `esc[0].rpm`.
    pub(super) name: String,
    /// Its unit, where the format tells.
    pub(super) unit: Option<String>,
}

impl Field {
    /// A field whose unit nobody tells.
    pub(super) fn new(name: impl Into<String>) -> Field {
        Field { name: name.into(), unit: None }
    }
}

/// The value of a named field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'a> {
    /// There is none in this message.
    Missing,
    /// A number.
    Number(f64),
    /// A whole number, exact where a float is not.
    #[allow(dead_code, reason = "binary formats have them")]
    Whole(i64),
    /// A text; where a number is asked for, the number that it says.
    Text(&'a str),
    /// Numbers.
    List(&'a [f64]),
    /// Something between two numbers.
    Interval(f64, f64),
}

/// What a message holds.
#[derive(Clone, Copy)]
pub(super) enum Body<'a> {
    /// The values of [`Fields::Named`]; those behind the last are missing.
    Values(&'a [Value<'a>]),
    /// The bytes of every other kind.
    Bytes(&'a [u8]),
}

/// When a message was true, sent and received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Times {
    /// Its reception, the time of its line, its log time; the only time where there is no other.
    pub(super) received: Time,
    /// The time of sending, where the format has one.
    pub(super) published: Option<Time>,
    /// The sender's own stamp, where the format has one beside the message.
    pub(super) stamp: Option<Time>,
}

impl Times {
    /// Of a format that has one time only.
    pub(super) fn at(received: Time) -> Times {
        Times { received, published: None, stamp: None }
    }
}

/// Who is told what a file holds.
pub(super) trait Listener {
    /// The file.
    fn file(&self) -> &Path;
    /// A topic, told when its first message comes: only what is recorded can be ambiguous. One that several publish may be told
    /// several times.
    fn topic(&mut self, topic: Topic<'_>) -> TopicId;
    /// Whether messages of this topic are looked at; if not, they need not be told.
    fn is_wanted(&self, topic: TopicId) -> bool;
    /// Whether the value of this field of [`Fields::Named`] is looked at; if not, it may be told as missing.
    fn is_field_wanted(&self, _topic: TopicId, _field: usize) -> bool {
        true
    }
    /// Whether it matters when messages of this topic were received.
    fn needs_time(&self, _topic: TopicId) -> bool {
        true
    }
    /// Nothing tells when the messages of this topic were received, for this reason; their times count them.
    fn untimed(&mut self, _topic: TopicId, _problem: String) {}
    /// One message.
    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>);
    /// A part of the file is lost.
    fn damaged(&mut self, place: Place, problem: String);
    /// Something to know that is no damage.
    fn note(&mut self, place: Place, what: String);
}
