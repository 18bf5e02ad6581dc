//! Writes a value as a CDR message: into one field of an otherwise empty message, or of a copy of another message.

use super::reader::{header_stamp, plan};
use crate::BridgeError;
use crate::payload::Unreadable;
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::path::{Path, Step};
use shsa_message::ros::{Body, Count, Kind, Member, Plan, Primitive, Target, Types, full_name};
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

/// The encapsulation: little-endian, no options.
pub(crate) const HEADER: [u8; 4] = [0, 1, 0, 0];

impl Writer {
    /// A writer of the field at a path; an empty path means the field `data`.
    ///
    /// # Errors
    /// When the type is unknown, or the path leads to no field or to no number.
    pub(crate) fn new(message_type: &str, path: &str, types: Arc<Types>) -> Result<Writer, BridgeError> {
        let message_type = full_name(message_type).into_owned();
        let parsed = Path::parse(path)?;
        let value = plan(&parsed.steps, &message_type, &types)?;
        if value.target == Target::Text || !parsed.conditions.is_empty() {
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
        let mut out = Out { bytes: HEADER.to_vec(), types: &self.types, value, stamp };
        out.message(&self.message_type, &self.path)?;
        Ok(out.bytes.into())
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

fn mismatch(found: &str, wanted: &'static str) -> Unreadable {
    Unreadable::Kind { field: "the value".into(), found: found.into(), wanted }
}

/// The numbers of a value for a field; of an interval, the midpoint.
fn numbers(value: &RawValue, is_list: bool, length: Option<usize>) -> Result<Vec<f64>, Unreadable> {
    let numbers = match value {
        RawValue::Vector(values) if is_list => values.clone(),
        RawValue::Vector(_) => return Err(mismatch("a list", "number")),
        _ if is_list => return Err(mismatch("a number", "list")),
        RawValue::Number(number) => vec![*number],
        RawValue::Interval { lo, hi } => vec![lo / 2.0 + hi / 2.0],
    };
    match length {
        Some(length) if length != numbers.len() => {
            Err(mismatch(&format!("a list of {}", numbers.len()), "list of the length of the field"))
        }
        _ => Ok(numbers),
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

/// Seconds and nanoseconds, little-endian.
pub(crate) fn time_parts(time: Time) -> ([u8; 4], [u8; 4]) {
    let second = 1_000_000_000;
    let seconds =
        i32::try_from(time.0.div_euclid(second)).unwrap_or(if time.0 < 0 { i32::MIN } else { i32::MAX });
    let nanoseconds = u32::try_from(time.0.rem_euclid(second)).unwrap_or(0);
    (seconds.to_le_bytes(), nanoseconds.to_le_bytes())
}

/// A number in the encoding of a field, little-endian; a whole number is rounded and clamped to the field's range.
fn encoded(primitive: Primitive, number: f64) -> Result<Vec<u8>, Unreadable> {
    let is_float = matches!(primitive, Primitive::F32 | Primitive::F64);
    if number.is_nan() && !is_float {
        return Err(mismatch("not-a-number", "whole number"));
    }
    let whole = number.round();
    Ok(match primitive {
        Primitive::Bool => vec![u8::from(number >= 0.5)],
        Primitive::Byte | Primitive::U8 => (whole as u8).to_le_bytes().to_vec(),
        Primitive::I8 => (whole as i8).to_le_bytes().to_vec(),
        Primitive::I16 => (whole as i16).to_le_bytes().to_vec(),
        Primitive::U16 => (whole as u16).to_le_bytes().to_vec(),
        Primitive::I32 => (whole as i32).to_le_bytes().to_vec(),
        Primitive::U32 => (whole as u32).to_le_bytes().to_vec(),
        Primitive::I64 => (whole as i64).to_le_bytes().to_vec(),
        Primitive::U64 => (whole as u64).to_le_bytes().to_vec(),
        Primitive::F32 => (number as f32).to_le_bytes().to_vec(),
        Primitive::F64 => number.to_le_bytes().to_vec(),
        Primitive::Time | Primitive::Duration => {
            let (seconds, nanoseconds) = time_parts(Time::from_seconds(number));
            [seconds, nanoseconds].concat()
        }
    })
}

/// A message that is being written.
struct Out<'a> {
    bytes: Vec<u8>,
    types: &'a Types,
    value: &'a RawValue,
    stamp: Time,
}

impl Out<'_> {
    /// Writes a message; `path` leads to the value within it, or is empty.
    fn message(&mut self, message_type: &str, path: &[Step]) -> Result<(), Unreadable> {
        let members = self.types.members(message_type)?;
        if members.is_empty() {
            self.bytes.push(0);
        }
        for member in members {
            let inner = match path.split_first() {
                Some((Step::Key(name), inner)) if *name == member.name => Some(inner),
                _ => None,
            };
            self.member(message_type, member, inner)?;
        }
        Ok(())
    }

    fn member(&mut self, owner: &str, member: &Member, path: Option<&[Step]>) -> Result<(), Unreadable> {
        let chosen = path.and_then(<[Step]>::first).and_then(|step| match step {
            Step::Index(index) => Some(*index),
            Step::Key(key) => key.parse().ok(),
        });
        let is_list = member.count != Count::One;
        if let (Some([]), true, Kind::Primitive(primitive)) = (path, is_list, &member.kind) {
            let length = if let Count::Fixed(count) = member.count { Some(count) } else { None };
            let numbers = numbers(self.value, true, length)?;
            if length.is_none() {
                self.number(Primitive::U32, numbers.len() as f64)?;
            }
            return numbers.iter().try_for_each(|number| self.number(*primitive, *number));
        }
        let count = match member.count {
            Count::One => return self.one(owner, member, path),
            Count::Fixed(count) => count,
            Count::Free(_) => {
                let count = chosen.map_or(0, |index| index.saturating_add(1)).min(LIST_MAX);
                self.number(Primitive::U32, count as f64)?;
                count
            }
        };
        for index in 0..count {
            let inner = path.filter(|_| chosen == Some(index)).and_then(|path| path.get(1..));
            self.one(owner, member, inner)?;
        }
        Ok(())
    }

    /// Writes one element; `path` is `None` if it does not lead through this element.
    fn one(&mut self, owner: &str, member: &Member, path: Option<&[Step]>) -> Result<(), Unreadable> {
        match &member.kind {
            Kind::Primitive(primitive) => {
                let is_upright = owner == "geometry_msgs/msg/Quaternion" && member.name == "w";
                let number = match path {
                    Some(_) => numbers(self.value, false, None)?.first().copied().unwrap_or(f64::NAN),
                    None => f64::from(u8::from(is_upright)),
                };
                self.number(*primitive, number)
            }
            Kind::Text(_) => {
                self.number(Primitive::U32, 1.0)?;
                self.bytes.push(0);
                Ok(())
            }
            Kind::WideText => self.number(Primitive::U32, 0.0),
            Kind::Message(name) => match (&**name, path) {
                ("builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration", Some([])) => {
                    let seconds = numbers(self.value, false, None)?.first().copied().unwrap_or(0.0);
                    self.time(Time::from_seconds(seconds))
                }
                ("builtin_interfaces/msg/Time", None) if owner == "std_msgs/msg/Header" => {
                    self.time(self.stamp)
                }
                (_, path) => self.message(name, path.unwrap_or_default()),
            },
        }
    }

    fn time(&mut self, time: Time) -> Result<(), Unreadable> {
        let (seconds, nanoseconds) = time_parts(time);
        self.align(4);
        self.bytes.extend(seconds);
        self.bytes.extend(nanoseconds);
        Ok(())
    }

    fn number(&mut self, primitive: Primitive, number: f64) -> Result<(), Unreadable> {
        self.align(primitive.size());
        self.bytes.extend(encoded(primitive, number)?);
        Ok(())
    }

    fn align(&mut self, to: usize) {
        let behind = (self.bytes.len() - HEADER.len()).next_multiple_of(to);
        self.bytes.resize(behind + HEADER.len(), 0);
    }
}

/// The longest list that is made to reach one of its elements.
const LIST_MAX: usize = 65_536;

/// A text as a message of std_msgs/msg/String.
#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
pub(crate) fn text_message(text: &[u8]) -> Bytes {
    let length = u32::try_from(text.len().saturating_add(1)).unwrap_or(u32::MAX);
    [&HEADER, length.to_le_bytes().as_slice(), text, &[0]].concat().into()
}
