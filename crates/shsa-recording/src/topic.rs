//! The interface of the readers: a reader reports the topics, messages and losses of a file to a listener. A reader goes through
//! a file once, in its order, and knows nothing of signals; the listener decides which messages matter.

use super::Place;
use super::members::Found;
use shsa_core::time::Time;
use shsa_message::protobuf;
use shsa_message::ros::{Layout, Types};
use std::io::{BufRead, Seek};
use std::path::Path;
use std::sync::Arc;

/// The bytes of a recording.
pub(super) trait Input: BufRead + Seek {}

impl<T: BufRead + Seek> Input for T {}

/// The number of a reported topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TopicId(pub(super) usize);

/// A topic, as it is reported before its first message.
pub(super) struct Topic<'a> {
    /// The name in a source while only one topic has it: `sensor_accel`, `RMC`.
    pub(super) name: &'a str,
    /// The unique name: `sensor_accel[1]`, `GPRMC`; the plain name where that is unique.
    pub(super) full: &'a str,
    /// The tags for filters on the topic as a whole: `[sensor=T1]`.
    pub(super) tags: &'a [(&'a str, &'a str)],
    /// The type of its messages.
    pub(super) kind: &'a str,
    /// How values are located in its messages.
    pub(super) fields: Fields,
}

impl<'a> Topic<'a> {
    /// A topic whose plain name is unique.
    pub(super) fn new(name: &'a str, kind: &'a str, fields: Fields) -> Topic<'a> {
        Topic { name, full: name, tags: &[], kind, fields }
    }

    /// The value of a tag; `None` where the topic has none of this name.
    pub(super) fn tag(&self, name: &str) -> Option<&'a str> {
        self.tags.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }

    /// The source text that fits this topic only: `room[sensor=T1]`.
    pub(super) fn choice(&self) -> String {
        let tags = self.tags.iter().map(|(name, value)| format!("[{name}={value}]"));
        self.full.to_owned() + &tags.collect::<String>()
    }
}

/// How values are located in the messages of a topic.
#[derive(Clone)]
pub(super) enum Fields {
    /// One value for each field, in this order: [`Body::Values`].
    Named(Arc<[Field]>),
    /// A JSON value: [`Body::Bytes`].
    Json,
    /// A message of ROS: [`Body::Bytes`].
    Ros {
        /// The known types.
        types: Arc<Types>,
        /// The name of the type among them.
        kind: String,
        /// The layout of the messages in the bytes.
        layout: Layout,
    },
    /// A message of Protocol Buffers, of the type of this name: [`Body::Bytes`].
    Protobuf(Arc<protobuf::Types>, String),
    /// The messages can only be counted, for this reason.
    Unknown(String),
}

impl Fields {
    /// Fields with these names and units.
    pub(super) fn named(fields: impl IntoIterator<Item = Field>) -> Fields {
        Fields::Named(fields.into_iter().collect())
    }
}

/// A field with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    /// Its name, which may have dots and brackets: `esc[0].rpm`.
    pub(super) name: String,
    /// Its unit, where the format has one.
    pub(super) unit: Option<String>,
}

impl Field {
    /// A field without a known unit.
    pub(super) fn new(name: impl Into<String>) -> Field {
        Field { name: name.into(), unit: None }
    }
}

/// The value of a named field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'a> {
    /// The message has no value.
    Missing,
    /// A number.
    Number(f64),
    /// A whole number, kept exact beyond the 53 bits of a float.
    #[allow(dead_code, reason = "binary formats have them")]
    Whole(i64),
    /// A text; where a number is wanted, the number in the text.
    Text(&'a str),
    /// Numbers.
    List(&'a [f64]),
    /// An interval from and to these numbers.
    Interval(f64, f64),
}

/// The columns of a row, whose values are made when they are asked for: most rows have columns that nobody reads.
pub(super) trait Columns {
    /// The number of columns.
    fn count(&self) -> usize;
    /// The value in a column; missing behind the last.
    fn value(&self, column: usize) -> Value<'_>;
}

/// Rows of a table, one after the other.
pub(super) trait Rows {
    /// The number of columns.
    fn count(&self) -> usize;
    /// The value in a column of a row; missing behind the last of either.
    fn value(&self, row: usize, column: usize) -> Value<'_>;
    /// Appends what each row has in a column where that is a number, else `None`.
    fn numbers(&self, column: usize, to: &mut Vec<Option<f64>>);
}

/// One of several rows.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub(super) rows: &'a dyn Rows,
    /// Its index among them.
    pub(super) at: usize,
}

impl Columns for Row<'_> {
    fn count(&self) -> usize {
        self.rows.count()
    }

    fn value(&self, column: usize) -> Value<'_> {
        self.rows.value(self.at, column)
    }
}

/// The content of a message.
#[derive(Clone, Copy)]
pub(super) enum Body<'a> {
    /// The values of [`Fields::Named`]; values after the last are missing.
    Values(&'a [Value<'a>]),
    /// The values of [`Fields::Named`] in a row of a table.
    Columns(&'a dyn Columns),
    /// The bytes of messages of any other kind.
    Bytes(&'a [u8]),
    /// The members of a JSON value that are looked for.
    Members(Found<'a>),
}

impl<'a> Body<'a> {
    /// The value of a named field; missing where the message has no such field.
    pub(super) fn value(self, field: usize) -> Value<'a> {
        match self {
            Body::Values(values) => values.get(field).copied().unwrap_or(Value::Missing),
            Body::Columns(columns) => columns.value(field),
            Body::Bytes(_) | Body::Members(_) => Value::Missing,
        }
    }
}

/// The times of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Times {
    /// The time of reception, of the line, or of the log; the only time where the format has no other.
    pub(super) received: Time,
    /// The time of sending, where the format has one.
    pub(super) published: Option<Time>,
    /// The sender's own stamp, where the format has one beside the message.
    pub(super) stamp: Option<Time>,
}

impl Times {
    /// The times of a format that has only one.
    pub(super) fn at(received: Time) -> Times {
        Times { received, published: None, stamp: None }
    }
}

/// Receives the content of a file from a reader.
pub(super) trait Listener {
    /// The file.
    fn file(&self) -> &Path;
    /// A topic, reported when its first message comes: only recorded topics can be ambiguous. A topic with several publishers may
    /// be reported several times.
    fn topic(&mut self, topic: Topic<'_>) -> TopicId;
    /// Whether messages of this topic are used; if not, they need not be reported.
    fn is_wanted(&self, topic: TopicId) -> bool;
    /// Whether the value of this field of [`Fields::Named`] is used; if not, it may be reported as missing.
    fn is_field_wanted(&self, _topic: TopicId, _field: usize) -> bool {
        true
    }
    /// Whether the time of reception of messages of this topic matters.
    fn needs_time(&self, _topic: TopicId) -> bool {
        true
    }
    /// The reception of this topic's messages is unknown, for this reason; their times count the messages.
    fn untimed(&mut self, _topic: TopicId, _problem: String) {}
    /// The times of this topic are taken from these of its [`Fields::Named`].
    fn clock(&mut self, _topic: TopicId, _columns: &[usize]) {}
    /// The next message of this topic has no readable time, although others of its topic have one.
    fn undated(&mut self, _topic: TopicId) {}
    /// Messages without a readable time are here, and are reported all the same.
    fn has_undated(&mut self, _place: Place, _problem: String) {}
    /// One message.
    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>);
    /// Rows of a table, each with its time. They mean what their messages mean, and need not be taken one by one.
    fn rows(&mut self, topic: TopicId, times: &[Time], rows: &dyn Rows) {
        self.each_row(topic, times, rows);
    }
    /// Takes rows of a table one by one, as messages.
    fn each_row(&mut self, topic: TopicId, times: &[Time], rows: &dyn Rows) {
        for (at, time) in times.iter().enumerate() {
            self.message(topic, Times::at(*time), Body::Columns(&Row { rows, at }));
        }
    }
    /// A part of the file is lost.
    fn damaged(&mut self, place: Place, problem: String);
    /// An observation that is no damage.
    fn note(&mut self, place: Place, what: String);
}
