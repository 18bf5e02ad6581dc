//! Writes a whole message: some of its fields are set, all others are empty.

use super::encoding::{HEADER, encoded, mismatch, numbers, time_parts};
use super::reader::plan;
use crate::BridgeError;
use crate::payload::Unreadable;
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::path::{Path, Step, split_each};
use shsa_message::ros::{Count, Kind, Member, Primitive, Target, Types, full_name};

/// The content of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content<'a> {
    /// A number or a list of numbers; of an interval, the midpoint. A point in time is a number of seconds.
    Value(&'a RawValue),
    /// A text.
    Text(&'a str),
}

/// A field that is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldContent<'a> {
    /// The path of the field (see [`Path`]), as `angle_min` or `pose.pose.position.x`.
    pub path: &'a str,
    /// Its content.
    pub content: Content<'a>,
}

/// A message of this type with these fields, and `stamp` in its header if it begins with one. All other numbers are 0 (1 for the
/// `w` of a quaternion), texts and lists are empty; a list is as long as its last element that is set.
///
/// # Errors
/// An unknown type; a path that leads to no field; a text where the field holds numbers, a list where it holds one, or the other way
/// round.
///
/// # Example
/// ```
/// use shsa_bridge::cdr::{Content, FieldContent, compose};
/// use shsa_core::{observation::RawValue, time::Time};
/// use shsa_message::ros::Types;
///
/// let (speed, turn_rate) = (RawValue::Number(0.5), RawValue::Number(-0.1));
/// let fields = [
///     FieldContent { path: "linear.x", content: Content::Value(&speed) },
///     FieldContent { path: "angular.z", content: Content::Value(&turn_rate) },
/// ];
/// let bytes = compose("geometry_msgs/msg/Twist", &fields, Time(0), &Types::standard())?;
/// assert_eq!(bytes.len(), 4 + 6 * 8);
/// # Ok::<(), shsa_bridge::BridgeError>(())
/// ```
pub fn compose(
    message_type: &str,
    fields: &[FieldContent<'_>],
    stamp: Time,
    types: &Types,
) -> Result<Bytes, BridgeError> {
    let message_type = full_name(message_type);
    let placed = fields.iter().map(|field| Ok((checked_path(field, &message_type, types)?, field.content)));
    let mut placed: Vec<(Vec<Step>, Content<'_>)> = placed.collect::<Result<_, BridgeError>>()?;
    placed.sort_by(|one, other| one.0.iter().map(rank).cmp(other.0.iter().map(rank)));
    let entries: Vec<Entry<'_>> =
        placed.iter().map(|(path, content)| Entry { path, content: *content }).collect();
    whole_message(&message_type, &entries, stamp, types)
        .map_err(|problem| BridgeError::Configuration(format!("{message_type}: {problem}")))
}

/// The place of a step among others: equal steps stand together.
fn rank(step: &Step) -> (&str, usize) {
    match step {
        Step::Key(key) => (key, 0),
        Step::Index(index) => ("", *index),
        Step::Each => ("", usize::MAX),
    }
}

/// The steps to a field, which can hold its content.
fn checked_path(
    field: &FieldContent<'_>,
    message_type: &str,
    types: &Types,
) -> Result<Vec<Step>, BridgeError> {
    let path = Path::parse(field.path)?;
    let plan = plan(&path.steps, message_type, types)?;
    let is_text = plan.target == Target::Text;
    let (what, fits) = match field.content {
        Content::Text(_) => ("text", is_text && plan.count == Count::One),
        Content::Value(_) => ("number", !is_text),
    };
    if !fits || split_each(&path.steps).is_some() || !path.conditions.is_empty() {
        let problem = format!("`{}` of {message_type} is no {what} that could be written", field.path);
        return Err(BridgeError::Configuration(problem));
    }
    Ok(if path.steps.is_empty() { vec![Step::Key("data".into())] } else { path.steps })
}

/// A field by its steps.
pub(super) struct Entry<'a> {
    pub(super) path: &'a [Step],
    pub(super) content: Content<'a>,
}

/// A message with these entries, which are sorted by their paths and fit to the type.
pub(super) fn whole_message(
    message_type: &str,
    entries: &[Entry<'_>],
    stamp: Time,
    types: &Types,
) -> Result<Bytes, Unreadable> {
    let mut out = Out { bytes: HEADER.to_vec(), types, stamp };
    out.message(message_type, Within { entries, depth: 0 })?;
    Ok(out.bytes.into())
}

/// The entries within a field: those whose paths lead through it. The first `depth` steps lead to the field.
#[derive(Clone, Copy)]
struct Within<'a> {
    entries: &'a [Entry<'a>],
    depth: usize,
}

impl<'a> Within<'a> {
    /// The content of the field itself.
    fn content(self) -> Option<Content<'a>> {
        self.entries.first().filter(|entry| entry.path.len() == self.depth).map(|entry| entry.content)
    }

    fn member(self, name: &str) -> Within<'a> {
        self.that(|step| matches!(step, Step::Key(key) if key == name))
    }

    fn element(self, index: usize) -> Within<'a> {
        self.that(|step| index_of(step) == Some(index))
    }

    /// Sorted entries with the same step stand together.
    fn that(self, is_it: impl Fn(&Step) -> bool) -> Within<'a> {
        let is_within = |entry: &Entry<'_>| entry.path.get(self.depth).is_some_and(&is_it);
        let from = self.entries.iter().position(is_within).unwrap_or(self.entries.len());
        let (_, rest) = self.entries.split_at(from);
        let count = rest.iter().take_while(|entry| is_within(entry)).count();
        Within { entries: rest.get(..count).unwrap_or_default(), depth: self.depth + 1 }
    }

    /// The length of a list that has all elements with content.
    fn length(self) -> usize {
        let indices = self.entries.iter().filter_map(|entry| index_of(entry.path.get(self.depth)?));
        indices.max().map_or(0, |last| last.saturating_add(1)).min(LIST_MAX)
    }
}

/// The longest list that is made to reach one of its elements.
const LIST_MAX: usize = 65_536;

fn index_of(step: &Step) -> Option<usize> {
    match step {
        Step::Index(index) => Some(*index),
        Step::Key(key) => key.parse().ok(),
        Step::Each => None,
    }
}

/// A message that is being written.
struct Out<'a> {
    bytes: Vec<u8>,
    types: &'a Types,
    stamp: Time,
}

impl Out<'_> {
    fn message(&mut self, message_type: &str, within: Within<'_>) -> Result<(), Unreadable> {
        let members = self.types.members(message_type)?;
        if members.is_empty() {
            self.bytes.push(0);
        }
        members.iter().try_for_each(|member| self.member(message_type, member, within.member(&member.name)))
    }

    fn member(&mut self, owner: &str, member: &Member, within: Within<'_>) -> Result<(), Unreadable> {
        let count = match (member.count, &member.kind, within.content()) {
            (Count::One, ..) => return self.one(owner, member, within),
            (count, Kind::Primitive(primitive), Some(content)) => {
                return self.list(*primitive, count, content);
            }
            (Count::Fixed(count), ..) => count,
            (Count::Free(_), ..) => {
                self.number(Primitive::U32, within.length() as f64)?;
                within.length()
            }
        };
        (0..count).try_for_each(|index| self.one(owner, member, within.element(index)))
    }

    /// Writes a list of numbers with its count, if that is on the wire.
    fn list(&mut self, primitive: Primitive, count: Count, content: Content<'_>) -> Result<(), Unreadable> {
        let length = if let Count::Fixed(count) = count { Some(count) } else { None };
        let numbers = numbers(value(content)?, true, length)?;
        if length.is_none() {
            self.number(Primitive::U32, numbers.len() as f64)?;
        }
        numbers.iter().try_for_each(|number| self.number(primitive, *number))
    }

    /// Writes one element.
    fn one(&mut self, owner: &str, member: &Member, within: Within<'_>) -> Result<(), Unreadable> {
        match &member.kind {
            Kind::Primitive(primitive) => {
                let is_upright = owner == "geometry_msgs/msg/Quaternion" && member.name == "w";
                let number = match within.content() {
                    Some(content) => single(content)?,
                    None => f64::from(u8::from(is_upright)),
                };
                self.number(*primitive, number)
            }
            Kind::Text(_) => {
                let text = if let Some(Content::Text(text)) = within.content() { text } else { "" };
                self.number(Primitive::U32, text.len() as f64 + 1.0)?;
                self.bytes.extend(text.bytes().chain([0]));
                Ok(())
            }
            Kind::WideText => self.number(Primitive::U32, 0.0),
            Kind::Message(name) => match (&**name, within.content()) {
                ("builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration", Some(content)) => {
                    self.time(Time::from_seconds(single(content)?))
                }
                ("builtin_interfaces/msg/Time", None)
                    if owner == "std_msgs/msg/Header" && within.entries.is_empty() =>
                {
                    self.time(self.stamp)
                }
                _ => self.message(name, within),
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

fn value(content: Content<'_>) -> Result<&RawValue, Unreadable> {
    match content {
        Content::Value(value) => Ok(value),
        Content::Text(_) => Err(mismatch("a text", "number")),
    }
}

fn single(content: Content<'_>) -> Result<f64, Unreadable> {
    Ok(numbers(value(content)?, false, None)?.first().copied().unwrap_or(f64::NAN))
}
