//! Reads fields of a message as values: one walk over the payload for all fields of its topic.

use super::Unreadable;
use super::lists::{Foreign, numbers};
use super::metrics::{Metrics, is_metrics};
use super::scalar::{scalar, shown};
use super::typed::{Typed, is_message_type, text_in};
use super::wanted::{Node, ROOT, Wanted};
use crate::{BridgeError, Message, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::json::{self, Broken, Kind, Place};
use shsa_message::path::{Path, Step, is_text, split_each};
use shsa_message::ros::Types;
use shsa_message::source::{Field, StampField};
use shsa_message::stamp::{self, Notation};
use std::sync::Arc;

/// The usual limit of a payload in bytes: a picture of a camera exceeds it, a laser scan as text does not.
pub const SIZE_LIMIT: usize = 4 << 20;

/// A field's value, and the time at which it was true.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// In the signal's unit; NaN and infinities are invalid values.
    pub value: RawValue,
    /// The stamp in the payload, by the source's clock; `None` if none is asked for.
    pub stamp: Option<Time>,
}

/// Reads the same fields of one message after the other.
///
/// | found | read as |
/// |---|---|
/// | a number, also within quotes; `NaN`, `Infinity` | a number |
/// | `true`, `on`, `false`, `off`, in letters of any size, with or without quotes | 1 and 0 |
/// | a list of these; `null` in it | a vector; not-a-number |
/// | an object with `lo` and `hi` | an interval |
/// | another object with `value`, and at the root with `data` | what it holds |
///
/// If no other stamp is asked for, an object with `stamp_ns` beside `value` or `lo` (the envelope of [`Writer`](super::Writer))
/// is stamped by it.
#[derive(Clone, Debug)]
pub struct Reader {
    wanted: Wanted,
    asked: Vec<Asked>,
    typed: Typed,
    metrics: Metrics,
    size_limit: usize,
}

/// One field, with the nodes of its parts.
#[derive(Clone, Debug)]
struct Asked {
    path: String,
    node: Node,
    /// What is read of each element, where the node is a list of which all elements are asked.
    each: Option<Vec<Step>>,
    conditions: Vec<(Node, String)>,
    stamp: Option<(Node, StampField)>,
}

/// The parts of a stamp, seconds and nanoseconds, as named in ROS 2 and in ROS 1.
const PAIRS: [(&str, &str); 2] = [("sec", "nanosec"), ("secs", "nsecs")];

impl Reader {
    /// A reader of these fields, for payloads of at most `size_limit` bytes (usually [`SIZE_LIMIT`]).
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] for a path that does not follow the grammar.
    pub fn new(fields: &[Field], size_limit: usize) -> Result<Reader, BridgeError> {
        let mut wanted = Wanted::new();
        let asked = fields.iter().map(|field| Asked::of(field, &mut wanted)).collect::<Result<_, _>>()?;
        let typed = Typed::new(fields, Types::standard());
        let metrics = Metrics::new(fields);
        Ok(Reader { wanted, asked, typed, metrics, size_limit })
    }

    /// Sets the known types of ROS 2's messages, instead of the standard ones.
    pub fn set_types(&mut self, types: Arc<Types>) {
        self.typed.set_types(types);
    }

    /// Reads a message, and passes on each field with its index; skips a field whose condition the message does not meet.
    ///
    /// `O(bytes)`, once for all fields.
    pub fn read(&mut self, message: &Message, mut each: impl FnMut(usize, Result<Reading, Unreadable>)) {
        match &message.payload {
            Payload::Value(value) => self.asked.iter().enumerate().for_each(|(index, asked)| {
                each(index, asked.of_value(value));
            }),
            Payload::Bytes(bytes) => match &message.message_type {
                Some(message_type) if is_message_type(message_type) => {
                    self.read_typed(message_type, bytes, each);
                }
                Some(message_type) if is_metrics(message_type) => {
                    self.metrics.read(message_type, bytes, each);
                }
                _ => self.read_bytes(bytes, each),
            },
        }
    }

    /// Reads a message of ROS 2; a text in it is read like a payload of its own.
    fn read_typed(
        &mut self,
        message_type: &Arc<str>,
        bytes: &[u8],
        mut each: impl FnMut(usize, Result<Reading, Unreadable>),
    ) {
        let (bytes_all, limit) = (bytes.len(), self.size_limit);
        let text = match text_in(message_type, bytes) {
            _ if bytes_all > limit => Err(Unreadable::TooLarge { bytes: bytes_all, limit }),
            None => return self.typed.read(message_type, bytes, each),
            Some(text) => text,
        };
        match text {
            Ok(text) => self.read_bytes(text, each),
            Err(unreadable) => {
                (0..self.asked.len()).for_each(|index| each(index, Err(unreadable.clone())));
            }
        }
    }

    /// As [`Reader::read`] for a payload alone.
    pub fn read_bytes(&mut self, bytes: &[u8], mut each: impl FnMut(usize, Result<Reading, Unreadable>)) {
        match self.locate(bytes) {
            Ok(text) => {
                for (index, asked) in self.asked.iter().enumerate() {
                    let found = Found { text, wanted: &self.wanted, asked };
                    if let Some(reading) = found.reading() {
                        each(index, reading);
                    }
                }
            }
            Err(unreadable) => {
                (0..self.asked.len()).for_each(|index| each(index, Err(unreadable.clone())));
            }
        }
    }

    /// Finds the places of all wanted values; returns the payload as text.
    pub(super) fn locate<'a>(&mut self, bytes: &'a [u8]) -> Result<&'a str, Unreadable> {
        let text = text_of(bytes, self.size_limit)?;
        if json::is_likely(text) {
            self.wanted.find(text)?;
        } else {
            let trimmed = text.trim_ascii();
            let from = text.len() - text.trim_ascii_start().len();
            let kind = if trimmed == "null" { Kind::Null } else { Kind::Text };
            self.wanted.set_root(kind, from..from + trimmed.len());
        }
        Ok(text)
    }

    /// The place of a field in the text that was located last.
    pub(super) fn found<'a>(&'a self, index: usize, text: &'a str) -> Option<Found<'a>> {
        Some(Found { text, wanted: &self.wanted, asked: self.asked.get(index)? })
    }
}

/// A payload as a nonempty text.
pub(super) fn text_of(bytes: &[u8], size_limit: usize) -> Result<&str, Unreadable> {
    if bytes.len() > size_limit {
        return Err(Unreadable::TooLarge { bytes: bytes.len(), limit: size_limit });
    }
    let text = std::str::from_utf8(bytes).map_err(|error| Unreadable::NoText { at: error.valid_up_to() })?;
    if text.trim_ascii().is_empty() { Err(Unreadable::Empty) } else { Ok(text) }
}

impl From<Broken> for Unreadable {
    fn from(Broken { at, expected }: Broken) -> Unreadable {
        Unreadable::NoJson { at, expected }
    }
}

impl Asked {
    fn of(field: &Field, wanted: &mut Wanted) -> Result<Asked, BridgeError> {
        let path = Path::parse(&field.path)?;
        let (steps, each) = match split_each(&path.steps) {
            Some((list, each)) => (list, Some(each.to_vec())),
            None => (path.steps.as_slice(), None),
        };
        let node = wanted.add(ROOT, steps);
        let names = ["lo", "hi", "value", "stamp_ns"];
        let at_root = (node == ROOT).then_some("data");
        add_members(wanted, node, names.into_iter().chain(at_root));
        if let Some(data) = wanted.member(ROOT, "data").filter(|_| node == ROOT) {
            add_members(wanted, data, names.into_iter());
        }
        let conditions = path.conditions.into_iter().map(|c| (wanted.add(ROOT, &c.steps), c.text)).collect();
        let stamp = field.stamp.as_ref().map(|field| stamp_node(field, wanted)).transpose()?;
        Ok(Asked { path: field.path.clone(), node, each, conditions, stamp })
    }

    /// The reading of a value without encoding.
    fn of_value(&self, value: &RawValue) -> Result<Reading, Unreadable> {
        if self.node == ROOT && self.each.is_none() && self.conditions.is_empty() {
            Ok(Reading { value: value.clone(), stamp: None })
        } else {
            Err(Unreadable::Absent { field: quoted(&self.path) })
        }
    }
}

fn add_members<'a>(wanted: &mut Wanted, of: Node, names: impl Iterator<Item = &'a str>) {
    for name in names {
        wanted.add(of, &[Step::Key(name.to_owned())]);
    }
}

fn stamp_node(field: &StampField, wanted: &mut Wanted) -> Result<(Node, StampField), BridgeError> {
    let path = Path::parse(&field.path)?;
    if !path.conditions.is_empty() {
        return Err(BridgeError::Configuration(format!("the stamp's path `{}` has a condition", field.path)));
    }
    let node = wanted.add(ROOT, &path.steps);
    add_members(wanted, node, PAIRS.iter().flat_map(|(seconds, nanoseconds)| [*seconds, *nanoseconds]));
    Ok((node, field.clone()))
}

fn quoted(path: &str) -> String {
    if path.is_empty() { "the payload".to_owned() } else { format!("`{path}`") }
}

/// A field in the payload that was located last.
pub(super) struct Found<'a> {
    pub(super) text: &'a str,
    wanted: &'a Wanted,
    asked: &'a Asked,
}

/// A field's stamp in its payload.
pub(super) enum StampPlace {
    /// One number or text.
    One(Place, Notation),
    /// Seconds and nanoseconds.
    Pair(Place, Place),
}

impl Found<'_> {
    /// `None`: a condition is not met.
    fn reading(&self) -> Option<Result<Reading, Unreadable>> {
        let at = match self.value_place() {
            Ok(None) => return None,
            Ok(Some(at)) => at,
            Err(unreadable) => return Some(Err(unreadable)),
        };
        let reading = self.value(at.node, at.place).and_then(|value| {
            let stamp = self.stamp(at.node)?.map(|(time, _)| time);
            Ok(Reading { value, stamp })
        });
        Some(reading)
    }

    /// The place of the value; `None` when a condition is not met.
    pub(super) fn value_place(&self) -> Result<Option<ValuePlace>, Unreadable> {
        let Some(element) = self.chosen() else { return Ok(None) };
        let absent = || self.absent();
        let place = self.wanted.place(self.asked.node).ok_or_else(absent)?;
        let Some(index) = element else { return Ok(Some(self.within(self.asked.node, place))) };
        if place.kind != Kind::List {
            return Err(self.wrong(place, "list"));
        }
        let mut found = None;
        json::elements(self.text, place, |at, element| {
            found = (at == index).then_some(element);
            found.is_none()
        });
        let each = self.asked.each.as_deref().unwrap_or_default();
        let place = found.and_then(|place| json::descend(self.text, place, each)).ok_or_else(absent)?;
        Ok(Some(ValuePlace { node: None, place }))
    }

    /// Follows objects to the value: `value` within an object, `data` at the root.
    fn within(&self, mut node: Node, mut place: Place) -> ValuePlace {
        let mut names = ["data", "value", "value"].into_iter();
        while place.kind == Kind::Object && self.interval(node).is_none() {
            let Some(name) = names.next() else { break };
            let member = self.wanted.member(node, name);
            let Some(found) = member.and_then(|member| Some((member, self.wanted.place(member)?))) else {
                continue;
            };
            (node, place) = found;
        }
        ValuePlace { node: Some(node), place }
    }

    /// The index that the conditions choose, if they choose one; `None`: a condition is not met.
    fn chosen(&self) -> Option<Option<usize>> {
        let mut chosen = None;
        for (node, asked) in &self.asked.conditions {
            let place = self.wanted.place(*node)?;
            if place.kind != Kind::List {
                self.is_scalar_text(place, asked).then_some(())?;
                continue;
            }
            let mut at = None;
            json::elements(self.text, place, |index, element| {
                at = self.is_scalar_text(element, asked).then_some(index);
                at.is_none()
            });
            chosen = Some(at?);
        }
        Some(chosen)
    }

    fn is_scalar_text(&self, place: Place, asked: &str) -> bool {
        !matches!(place.kind, Kind::List | Kind::Object)
            && is_text(&json::unescaped(place.of(self.text)), asked)
    }

    fn value(&self, node: Option<Node>, place: Place) -> Result<RawValue, Unreadable> {
        match place.kind {
            Kind::List => self.vector(place),
            _ if self.asked.each.is_some() && node.is_some() => Err(self.wrong(place, "list")),
            Kind::Object => {
                let bounds = node.and_then(|node| self.interval(node));
                let (lo, hi) = bounds.ok_or_else(|| self.wrong(place, "number; name one of its members"))?;
                let number =
                    |place: Place| scalar(place, self.text).ok_or_else(|| self.wrong(place, "number"));
                Ok(RawValue::Interval { lo: number(lo)?, hi: number(hi)? })
            }
            _ => scalar(place, self.text).map(RawValue::Number).ok_or_else(|| self.wrong(place, "number")),
        }
    }

    /// A list of numbers, or the numbers at a path within each element of a list.
    fn vector(&self, list: Place) -> Result<RawValue, Unreadable> {
        let each = self.asked.each.as_deref().unwrap_or_default();
        let numbers = numbers(self.text, list, each);
        numbers.map(RawValue::Vector).map_err(|Foreign { index, place }| Unreadable::Kind {
            field: format!("element {index} of {}", quoted(&self.asked.path)),
            found: shown(place, self.text),
            wanted: "number",
        })
    }

    /// The places of `lo` and `hi` of an object, unless they are null.
    pub(super) fn interval(&self, node: Node) -> Option<(Place, Place)> {
        let bound = |name| {
            let place = self.member(node, name)?;
            (place.kind != Kind::Null).then_some(place)
        };
        Some((bound("lo")?, bound("hi")?))
    }

    /// The place of a member of an object.
    pub(super) fn member(&self, node: Node, name: &str) -> Option<Place> {
        self.wanted.member(node, name).and_then(|member| self.wanted.place(member))
    }

    /// The stamp and its place; `None` if none is asked for.
    pub(super) fn stamp(&self, value: Option<Node>) -> Result<Option<(Time, StampPlace)>, Unreadable> {
        let Some((node, field)) = &self.asked.stamp else { return Ok(self.envelope_stamp(value)) };
        let name = || format!("the stamp {}", quoted(&field.path));
        let place = self.wanted.place(*node).ok_or_else(|| Unreadable::Absent { field: name() })?;
        let stamp = match place.kind {
            Kind::Object => self.pair(*node),
            _ => one_stamp(place, field.step, self.text),
        };
        let wrong = || Unreadable::Kind {
            field: name(),
            found: shown(place, self.text),
            wanted: "time in a known form",
        };
        stamp.map(Some).ok_or_else(wrong)
    }

    /// The `stamp_ns` of the object with the value or the bounds: of the field itself, or of its `data`.
    fn envelope_stamp(&self, value: Option<Node>) -> Option<(Time, StampPlace)> {
        let data = self.wanted.member(ROOT, "data").filter(|_| self.asked.node == ROOT);
        let envelope = [Some(self.asked.node), data].into_iter().flatten();
        let is_envelope = |node: &Node| value == Some(*node) || self.wanted.member(*node, "value") == value;
        let place = envelope.filter(is_envelope).find_map(|node| self.member(node, "stamp_ns"))?;
        one_stamp(place, Some(Span(1)), self.text)
    }

    fn pair(&self, node: Node) -> Option<(Time, StampPlace)> {
        PAIRS.iter().find_map(|(seconds, nanoseconds)| {
            let (seconds, nanoseconds) = (self.member(node, seconds)?, self.member(node, nanoseconds)?);
            let whole = |place: Place| place.of(self.text).parse::<i64>().ok();
            let time = whole(seconds)?.checked_mul(1_000_000_000)?.checked_add(whole(nanoseconds)?)?;
            Some((Time(time), StampPlace::Pair(seconds, nanoseconds)))
        })
    }

    fn absent(&self) -> Unreadable {
        match self.wanted.place(ROOT) {
            Some(place) if !matches!(place.kind, Kind::Object | Kind::List) => Unreadable::Kind {
                field: "the payload".to_owned(),
                found: shown(place, self.text),
                wanted: "object",
            },
            _ => Unreadable::Absent { field: quoted(&self.asked.path) },
        }
    }

    fn wrong(&self, place: Place, wanted: &'static str) -> Unreadable {
        Unreadable::Kind { field: quoted(&self.asked.path), found: shown(place, self.text), wanted }
    }
}

/// The place of a value.
#[derive(Clone, Copy)]
pub(super) struct ValuePlace {
    /// `None`: an element that a condition has chosen.
    pub(super) node: Option<Node>,
    pub(super) place: Place,
}

fn one_stamp(place: Place, step: Option<Span>, text: &str) -> Option<(Time, StampPlace)> {
    let (time, notation) = match place.kind {
        Kind::Number => stamp::number(place.of(text), step),
        Kind::Text => stamp::text(&json::unescaped(place.of(text)), step),
        _ => None,
    }?;
    Some((time, StampPlace::One(place, notation)))
}
