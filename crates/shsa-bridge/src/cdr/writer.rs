//! Writes a value as a CDR message: into one field of an otherwise empty message, or of a copy of another message.

use super::compose::{Content, Entry, whole_message};
use super::encoding::{HEADER, encoded, numbers, time_parts};
use super::reader::{header_stamp, plan};
use crate::BridgeError;
use crate::payload::Unreadable;
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::path::{Path, Step, split_each};
use shsa_message::ros::{Body, Count, Plan, Target, Types, full_name};
use std::sync::Arc;

/// Writes one field of messages of one type.
#[derive(Clone, Debug)]
pub(crate) struct Writer {
    types: Arc<Types>,
    message_type: String,
    path: Vec<Step>,
    value: Plan,
    stamp: Option<Plan>,
}

impl Writer {
    /// A writer of the field at a path; an empty path means the field `data`.
    ///
    /// # Errors
    /// When the type is unknown, or the path leads to no field or to no number.
    pub(crate) fn new(message_type: &str, path: &str, types: Arc<Types>) -> Result<Writer, BridgeError> {
        let message_type = full_name(message_type).into_owned();
        let parsed = Path::parse(path)?;
        let value = plan(&parsed.steps, &message_type, &types)?;
        let is_one = split_each(&parsed.steps).is_none() && parsed.conditions.is_empty();
        if value.target == Target::Text || !is_one {
            let problem = format!("`{path}` of {message_type} is no number that could be written");
            return Err(BridgeError::Configuration(problem));
        }
        let stamp = header_stamp(&message_type, &types);
        let path = if parsed.steps.is_empty() { vec![Step::Key("data".into())] } else { parsed.steps };
        Ok(Writer { types, message_type, path, value, stamp })
    }

    /// A message with only this value, and the stamp in its header if it has one: all other numbers are 0 (1 for the `w` of a
    /// quaternion), texts and lists are empty.
    ///
    /// # Errors
    /// A list for a number, a number for a list, or a list of another length than a fixed one.
    pub(crate) fn write(&self, value: &RawValue, stamp: Time) -> Result<Bytes, Unreadable> {
        let entry = Entry { path: &self.path, content: Content::Value(value) };
        whole_message(&self.message_type, &[entry], stamp, &self.types)
    }

    /// A copy of a message with this value, and the stamp in its header if it has one.
    ///
    /// # Errors
    /// When the message lacks the field, or the field has another form.
    pub(crate) fn patch(&self, pattern: &[u8], value: &RawValue, stamp: Time) -> Result<Bytes, Unreadable> {
        let found = Body::cdr(pattern)?;
        let mut copy = pattern.to_vec();
        let absent =
            || Unreadable::Absent { field: format!("the field of {} to be replaced", self.message_type) };
        let place = self.value.locate(found).ok_or_else(absent)?;
        let is_list = self.value.count != Count::One;
        let numbers = numbers(value, is_list, Some(place.count))?;
        put(&mut copy, found, place.at, self.value.target, &numbers)?;
        if let Some(place) = self.stamp.as_ref().and_then(|plan| plan.locate(found)) {
            put_time(&mut copy, found, place.at, stamp);
        }
        Ok(copy.into())
    }
}

/// Overwrites numbers in a copy of a message.
fn put(
    copy: &mut [u8],
    body: Body<'_>,
    at: usize,
    target: Target,
    numbers: &[f64],
) -> Result<(), Unreadable> {
    let Target::Primitive(primitive) = target else {
        numbers.iter().for_each(|seconds| put_time(copy, body, at, Time::from_seconds(*seconds)));
        return Ok(());
    };
    let mut at = at;
    for number in numbers {
        let mut bytes = encoded(primitive, *number)?;
        if body.is_big_endian {
            bytes.reverse();
        }
        overwrite(copy, at, &bytes);
        at += bytes.len();
    }
    Ok(())
}

fn put_time(copy: &mut [u8], body: Body<'_>, at: usize, time: Time) {
    let (mut seconds, mut nanoseconds) = time_parts(time);
    if body.is_big_endian {
        seconds.reverse();
        nanoseconds.reverse();
    }
    overwrite(copy, at, &seconds);
    overwrite(copy, at + 4, &nanoseconds);
}

/// Overwrites bytes at a position of the body.
fn overwrite(copy: &mut [u8], at: usize, bytes: &[u8]) {
    let from = at + HEADER.len();
    if let Some(place) = copy.get_mut(from..from + bytes.len()) {
        place.copy_from_slice(bytes);
    }
}

/// A text as a message of std_msgs/msg/String.
#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
pub(crate) fn text_message(text: &[u8]) -> Bytes {
    let length = u32::try_from(text.len().saturating_add(1)).unwrap_or(u32::MAX);
    [&HEADER, length.to_le_bytes().as_slice(), text, &[0]].concat().into()
}
