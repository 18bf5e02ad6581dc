//! A guard before the decoders of messages: a message that does not fit its definition gives no values, and is counted.
//!
//! A field is read where the definition says it is. In a message that is longer or shorter than that, or of another encoding, there
//! are other bytes.

use super::topic::{Body, Fields, Listener, Rows, Times, Topic, TopicId};
use super::{Place, RecordingError};
use shsa_core::time::Time;
use shsa_message::json::{Place as JsonPlace, Shapes, Visitor};
use shsa_message::protobuf;
use shsa_message::ros::{Body as RosBody, Extent, Layout, Types, is_version_2, recode};
use std::path::Path;
use std::sync::Arc;

/// Reports the messages of a file that fit their definitions, and how many others there are.
///
/// # Errors
/// Those of the reader.
pub(super) fn guarded(
    listener: &mut dyn Listener,
    read: impl FnOnce(&mut dyn Listener) -> Result<(), RecordingError>,
) -> Result<(), RecordingError> {
    let mut guard = Guard { listener, watched: Vec::new() };
    read(&mut guard)?;
    guard.finish();
    Ok(())
}

/// A listener behind the guard.
struct Guard<'a> {
    listener: &'a mut dyn Listener,
    watched: Vec<Watched>,
}

/// A topic.
struct Watched {
    topic: TopicId,
    name: String,
    kind: String,
    definition: Definition,
    /// How many messages do not fit.
    misfits: u64,
    /// Why the first message of another encoding cannot be read, and how many there are.
    foreign: Option<(String, u64)>,
}

/// What the messages of a topic are checked against.
enum Definition {
    /// Nothing is known.
    Unknown,
    Json(Box<Shapes<()>>),
    Ros1(Extent),
    Ros2(Box<Ros2>),
    Protobuf(Arc<protobuf::Types>, String),
}

/// The definition of messages of ROS 2.
struct Ros2 {
    /// `None` where the end of a message cannot be found.
    extent: Option<Extent>,
    types: Arc<Types>,
    kind: String,
    /// A message of version 2 of the encoding, as one of version 1.
    recoded: Vec<u8>,
}

/// How a message fits its definition.
enum Fit<'a> {
    /// It does, with these bytes.
    Whole(&'a [u8]),
    Not,
    /// It is of another encoding, by this error.
    Foreign(String),
}

impl Definition {
    fn of(fields: &Fields) -> Definition {
        match fields {
            Fields::Json => Definition::Json(Box::default()),
            Fields::Ros { types, kind, layout } => match (layout, Extent::new(types, *layout, kind).ok()) {
                (Layout::Packed, extent) => extent.map_or(Definition::Unknown, Definition::Ros1),
                (Layout::Cdr, extent) => {
                    let (types, kind) = (types.clone(), kind.clone());
                    Definition::Ros2(Box::new(Ros2 { extent, types, kind, recoded: Vec::new() }))
                }
            },
            Fields::Protobuf(types, kind) => Definition::Protobuf(types.clone(), kind.clone()),
            Fields::Named(_) | Fields::Unknown(_) => Definition::Unknown,
        }
    }

    fn fit<'a>(&'a mut self, bytes: &'a [u8]) -> Fit<'a> {
        let is_whole = match self {
            Definition::Unknown => true,
            Definition::Json(shapes) => {
                std::str::from_utf8(bytes).is_ok_and(|text| shapes.walk(text, (), &mut Nothing).is_ok())
            }
            Definition::Ros1(extent) => extent.fits(RosBody::packed(bytes)),
            Definition::Ros2(definition) => return definition.fit(bytes),
            Definition::Protobuf(types, kind) => types.fits(kind, bytes),
        };
        if is_whole { Fit::Whole(bytes) } else { Fit::Not }
    }
}

impl Ros2 {
    fn fit<'a>(&'a mut self, message: &'a [u8]) -> Fit<'a> {
        let bytes = match self.extent.is_some() && is_version_2(message) {
            true if recode(&self.types, &self.kind, message, &mut self.recoded) => &self.recoded,
            true => return Fit::Not,
            false => message,
        };
        match RosBody::cdr(bytes) {
            Ok(body) if self.extent.as_ref().is_none_or(|extent| extent.fits(body)) => Fit::Whole(bytes),
            Ok(_) => Fit::Not,
            Err(problem) => Fit::Foreign(problem.to_string()),
        }
    }
}

impl Watched {
    /// The bytes of a message that fits; counts one that does not.
    fn checked<'a>(&'a mut self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        match self.definition.fit(bytes) {
            Fit::Whole(bytes) => return Some(bytes),
            Fit::Not => self.misfits += 1,
            Fit::Foreign(problem) => self.foreign.get_or_insert((problem, 0)).1 += 1,
        }
        None
    }

    fn report(self, listener: &mut dyn Listener) {
        let Watched { name, kind, misfits, foreign, .. } = self;
        let of_kind = if kind.is_empty() { String::new() } else { format!(" {kind}") };
        if misfits > 0 {
            let problem =
                format!("topic {name}: {misfits} messages do not fit their definition{of_kind}; left out");
            listener.damaged(Place::Whole, problem);
        }
        if let Some((problem, count)) = foreign {
            let problem = format!("topic {name}: {count} messages are not read here; the first: {problem}");
            listener.damaged(Place::Whole, problem);
        }
    }
}

impl Guard<'_> {
    /// Reports how many messages do not fit.
    fn finish(self) {
        for watched in self.watched {
            watched.report(self.listener);
        }
    }

    fn behind(&self, topic: TopicId) -> TopicId {
        self.watched.get(topic.0).map_or(topic, |watched| watched.topic)
    }
}

impl Listener for Guard<'_> {
    fn file(&self) -> &Path {
        self.listener.file()
    }

    fn topic(&mut self, topic: Topic<'_>) -> TopicId {
        let (name, kind) = (topic.full.to_owned(), topic.kind.to_owned());
        let definition = Definition::of(&topic.fields);
        let topic = self.listener.topic(topic);
        self.watched.push(Watched { topic, name, kind, definition, misfits: 0, foreign: None });
        TopicId(self.watched.len() - 1)
    }

    fn is_wanted(&self, topic: TopicId) -> bool {
        self.listener.is_wanted(self.behind(topic))
    }

    fn is_field_wanted(&self, topic: TopicId, field: usize) -> bool {
        self.listener.is_field_wanted(self.behind(topic), field)
    }

    fn needs_time(&self, topic: TopicId) -> bool {
        self.listener.needs_time(self.behind(topic))
    }

    fn untimed(&mut self, topic: TopicId, problem: String) {
        self.listener.untimed(self.behind(topic), problem);
    }

    fn clock(&mut self, topic: TopicId, columns: &[usize]) {
        self.listener.clock(self.behind(topic), columns);
    }

    fn undated(&mut self, topic: TopicId) {
        self.listener.undated(self.behind(topic));
    }

    fn has_undated(&mut self, place: Place, problem: String) {
        self.listener.has_undated(place, problem);
    }

    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>) {
        let Some(watched) = self.watched.get_mut(topic.0) else { return };
        let behind = watched.topic;
        let body = match body {
            Body::Bytes(bytes) => watched.checked(bytes).map(Body::Bytes),
            body => Some(body),
        };
        if let Some(body) = body {
            self.listener.message(behind, times, body);
        }
    }

    fn rows(&mut self, topic: TopicId, times: &[Time], rows: &dyn Rows) {
        self.listener.rows(self.behind(topic), times, rows);
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.listener.damaged(place, problem);
    }

    fn note(&mut self, place: Place, what: String) {
        self.listener.note(place, what);
    }
}

/// Looks for nothing in a JSON text.
struct Nothing;

impl Visitor for Nothing {
    type Node = ();

    fn member(&mut self, _of: (), _name: &str) -> Option<()> {
        None
    }

    fn element(&mut self, _of: (), _index: usize) -> Option<()> {
        None
    }

    fn enter(&mut self, _node: ()) {}

    fn leave(&mut self, _node: (), _place: JsonPlace) {}
}
