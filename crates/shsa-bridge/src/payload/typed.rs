//! Payloads whose type the transport gives: CDR messages of ROS 2.

use super::Unreadable;
use super::reader::Reading;
use crate::cdr::{Reader, Writer};
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::ros::{Body, Types, full_name};
use shsa_message::source::Field;
use std::sync::Arc;

/// The number of types kept for one topic; a topic has one type, except during a change.
const TYPES_MAX: usize = 4;

/// Reads the same fields in messages of several types, which become known as they arrive.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    fields: Vec<Field>,
    types: Arc<Types>,
    readers: Vec<(Arc<str>, Result<Reader, Unreadable>)>,
}

impl Typed {
    pub(super) fn new(fields: &[Field], types: Arc<Types>) -> Typed {
        Typed { fields: fields.to_vec(), types, readers: Vec::new() }
    }

    pub(super) fn set_types(&mut self, types: Arc<Types>) {
        *self = Typed::new(&self.fields, types);
    }

    /// Reads a message of a type. If the type or a field is unknown, each field gets this error.
    pub(super) fn read(
        &mut self,
        message_type: &Arc<str>,
        bytes: &[u8],
        mut each: impl FnMut(usize, Result<Reading, Unreadable>),
    ) {
        match self.reader(message_type) {
            Ok(reader) => reader.read(bytes, each),
            Err(unreadable) => {
                let unreadable = unreadable.clone();
                (0..self.fields.len()).for_each(|index| each(index, Err(unreadable.clone())));
            }
        }
    }

    fn reader(&mut self, message_type: &Arc<str>) -> Result<&Reader, &Unreadable> {
        let known = self.readers.iter().position(|(known, _)| known == message_type);
        let at = known.unwrap_or_else(|| {
            self.readers.truncate(TYPES_MAX - 1);
            let reader = Reader::new(&self.fields, message_type, &self.types);
            let reader = reader.map_err(|problem| Unreadable::Layout(problem.to_string()));
            self.readers.push((message_type.clone(), reader));
            self.readers.len() - 1
        });
        self.readers[at].1.as_ref()
    }
}

/// Writes copies of messages of one type with one field replaced.
#[derive(Clone, Debug)]
pub(super) struct TypedPattern {
    message_type: Arc<str>,
    writer: Result<Writer, Unreadable>,
}

impl TypedPattern {
    pub(super) fn new(message_type: &Arc<str>, path: &str, types: Arc<Types>) -> TypedPattern {
        let writer = Writer::new(message_type, path, types);
        let writer = writer.map_err(|problem| Unreadable::Layout(problem.to_string()));
        TypedPattern { message_type: message_type.clone(), writer }
    }

    pub(super) fn is_of(&self, message_type: &Arc<str>) -> bool {
        self.message_type == *message_type
    }

    /// A copy of the pattern with this value and this stamp.
    pub(super) fn write(&self, pattern: &[u8], value: &RawValue, stamp: Time) -> Result<Bytes, Unreadable> {
        self.writer.as_ref().map_err(Clone::clone)?.patch(pattern, value, stamp)
    }
}

/// Whether this is the name of a message type of ROS 2.
pub(super) fn is_message_type(name: &str) -> bool {
    name.contains("/msg/") || name.contains("::msg::dds_::")
}

/// The text in a message of type `std_msgs/msg/String`; `None` for other types.
pub(super) fn text_in<'a>(message_type: &str, bytes: &'a [u8]) -> Option<Result<&'a [u8], Unreadable>> {
    (full_name(message_type) == "std_msgs/msg/String").then(|| {
        let found = Body::cdr(bytes)?.text(0).map(|(text, _)| text);
        found.ok_or_else(|| Unreadable::Layout(format!("a text is not within {} bytes", bytes.len())))
    })
}
