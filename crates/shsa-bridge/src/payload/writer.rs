//! Writes a need's value for its consumers: as a number, in an envelope, or in the form of the replaced signal.

use super::Unreadable;
use super::metrics::is_metrics;
use super::reader::{Found, Reader, StampPlace, ValuePlace};
use super::typed::{TypedPattern, is_message_type};
use crate::{BridgeError, Message, Payload, Provenance};
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::json::{self, Kind, Place};
use shsa_message::ros::Types;
use shsa_message::source::Field;
use shsa_message::stamp;
use std::fmt::Write as _;
use std::ops::Range;

/// The form of the payload.
#[derive(Clone, Debug)]
enum Shape {
    Number,
    Envelope,
    /// Copies of a payload with this field replaced.
    Copy(Field),
}

/// Writes the values of one need.
#[derive(Clone, Debug)]
pub struct Writer {
    shape: Shape,
    /// Finds the places to replace.
    reader: Option<Reader>,
    pattern: Option<Bytes>,
    /// Writes into copies of the pattern, if the pattern is a message of ROS 2.
    typed: Option<TypedPattern>,
    /// Whether the pattern has metrics of Sparkplug, of which there are no copies.
    has_metrics: bool,
}

impl Writer {
    /// Writes the number alone, of an interval the midpoint; a list in JSON.
    #[must_use]
    pub fn plain() -> Writer {
        Writer::without_pattern(Shape::Number)
    }

    /// Writes one JSON object: `{"value":..,"lo":..,"hi":..,"stamp_ns":..,"quality":"Good","status":0,"source":".."}`. `quality`
    /// and `status` are the name and the number of an OPC UA status code; `lo` and `hi` are null where no bounds are known. Where
    /// a safety contract demands something, `"admitted":"met","level":"SIL 2","rank":2` give the ground of the admission, and the
    /// level.
    #[must_use]
    pub fn envelope() -> Writer {
        Writer::without_pattern(Shape::Envelope)
    }

    /// Writes the [last good payload](Writer::learn) of the replaced signal with this field and its stamp replaced. All other
    /// bytes stay, so other members of the object are as old as that payload.
    ///
    /// `size_limit`: the largest payload that is kept as a pattern, bytes.
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] for a path that does not follow the grammar.
    pub fn like(field: Field, size_limit: usize) -> Result<Writer, BridgeError> {
        let reader = Reader::new(std::slice::from_ref(&field), size_limit)?;
        let shape = Shape::Copy(field);
        Ok(Writer { reader: Some(reader), ..Writer::without_pattern(shape) })
    }

    fn without_pattern(shape: Shape) -> Writer {
        Writer { shape, reader: None, pattern: None, typed: None, has_metrics: false }
    }

    /// Keeps a payload of the trusted signal as the pattern of its substitute. Does not copy the bytes. Other forms need no
    /// pattern and keep none.
    pub fn learn(&mut self, payload: &Bytes) {
        if matches!(self.shape, Shape::Copy(_)) {
            self.pattern = Some(payload.clone());
            self.typed = None;
        }
    }

    /// As [`Writer::learn`] for a message whose type may be known: a message of ROS 2 is copied as such.
    pub fn learn_message(&mut self, message: &Message) {
        let (Shape::Copy(field), Payload::Bytes(bytes)) = (&self.shape, &message.payload) else { return };
        self.pattern = Some(bytes.clone());
        self.has_metrics = message.message_type.as_deref().is_some_and(is_metrics);
        match &message.message_type {
            Some(message_type) if is_message_type(message_type) => {
                if !self.typed.as_ref().is_some_and(|typed| typed.is_of(message_type)) {
                    self.typed = Some(TypedPattern::new(message_type, &field.path, Types::standard()));
                }
            }
            _ => self.typed = None,
        }
    }

    /// The last pattern.
    #[must_use]
    pub fn pattern(&self) -> Option<&Bytes> {
        self.pattern.as_ref()
    }

    /// The payload of a value. `Ok(None)`: this form cannot express a missing value, so nothing should be sent.
    ///
    /// # Errors
    /// For the form of a signal: when there is no pattern yet, or the pattern lacks the field, or has a list where the value is a
    /// number.
    pub fn write(
        &mut self,
        value: Option<&RawValue>,
        stamp: Time,
        provenance: &Provenance,
    ) -> Result<Option<Bytes>, Unreadable> {
        match (&self.shape, value) {
            (Shape::Envelope, _) => Ok(Some(envelope(value, stamp, provenance).into())),
            (_, None) => Ok(None),
            (Shape::Number, Some(value)) => Ok(Some(plain(value).into())),
            (Shape::Copy(_), Some(value)) => self.copy(value, stamp).map(Some),
        }
    }

    fn copy(&mut self, value: &RawValue, stamp: Time) -> Result<Bytes, Unreadable> {
        let no_pattern = || Unreadable::Absent { field: "a payload of the signal to be replaced".to_owned() };
        let pattern = self.pattern.clone().ok_or_else(no_pattern)?;
        if self.has_metrics {
            let why = "a metric of Sparkplug is no message of its own: publish the need in the form `plain`";
            return Err(Unreadable::Layout(why.to_owned()));
        }
        if let Some(typed) = &self.typed {
            return typed.write(&pattern, value, stamp);
        }
        let reader = self.reader.as_mut().ok_or_else(no_pattern)?;
        let text = reader.locate(&pattern)?;
        let found = reader.found(0, text).ok_or_else(no_pattern)?;
        let at = found.value_place()?.ok_or_else(no_pattern)?;
        let mut changes = Vec::new();
        change_value(&found, at, value, &mut changes)?;
        change_stamp(&found, at, stamp, &mut changes)?;
        Ok(changed(text, changes).into())
    }
}

type Change = (Range<usize>, String);

fn changed(text: &str, mut changes: Vec<Change>) -> String {
    changes.sort_by_key(|(range, _)| range.start);
    let mut result = String::with_capacity(text.len() + 64);
    let mut at = 0;
    for (range, new) in changes {
        result.push_str(text.get(at..range.start).unwrap_or(""));
        result.push_str(&new);
        at = range.end;
    }
    result.push_str(text.get(at..).unwrap_or(""));
    result
}

fn change_value(
    found: &Found<'_>,
    at: ValuePlace,
    value: &RawValue,
    changes: &mut Vec<Change>,
) -> Result<(), Unreadable> {
    let bounds = at.node.filter(|_| at.place.kind == Kind::Object).and_then(|node| found.interval(node));
    if let (Some((lo, hi)), Some(node)) = (bounds, at.node) {
        let (low, high) = ends(value).ok_or_else(|| mismatch("an interval", "list"))?;
        let member = found.member(node, "value").filter(|place| place.kind != Kind::Object);
        let middle = member.map(|place| (place, middle(low, high)));
        let numbers = [(lo, low), (hi, high)].into_iter().chain(middle);
        changes
            .extend(numbers.map(|(place, number)| (place.range(), scalar_like(place, found.text, number))));
        return Ok(());
    }
    let text = match (value, at.place.kind) {
        (RawValue::Vector(_), Kind::List) => json_value(value),
        (RawValue::Vector(_), _) => return Err(mismatch("no list", "list")),
        (_, Kind::List | Kind::Object) => return Err(mismatch("no number", "number")),
        _ => scalar_like(at.place, found.text, number_of(value)),
    };
    changes.push((at.place.range(), text));
    Ok(())
}

fn mismatch(found: &str, wanted: &'static str) -> Unreadable {
    Unreadable::Kind { field: "the field of the signal to be replaced".into(), found: found.into(), wanted }
}

fn change_stamp(
    found: &Found<'_>,
    at: ValuePlace,
    stamp: Time,
    changes: &mut Vec<Change>,
) -> Result<(), Unreadable> {
    match found.stamp(at.node)? {
        None => {}
        Some((_, StampPlace::One(place, notation))) => {
            changes.push((place.range(), stamp::written(stamp, notation)))
        }
        Some((_, StampPlace::Pair(seconds, nanoseconds))) => {
            let second = 1_000_000_000;
            changes.push((seconds.range(), stamp.0.div_euclid(second).to_string()));
            changes.push((nanoseconds.range(), stamp.0.rem_euclid(second).to_string()));
        }
    }
    Ok(())
}

/// A number in the notation of the present value: a number, or a word for on or off.
fn scalar_like(place: Place, text: &str, value: f64) -> String {
    let old = place.of(text);
    let pairs = [["false", "true"], ["off", "on"]];
    let pair = pairs.iter().find(|pair| pair.iter().any(|word| word.eq_ignore_ascii_case(old)));
    let is_json_number = place.kind != Kind::Text;
    match pair {
        None if is_json_number => json_number(value),
        None => number(value),
        Some([off, on]) => in_letters_of(old, if value >= 0.5 { on } else { off }),
    }
}

/// A word in the letter case of another: `ON` for `OFF`, `Off` for `On`.
fn in_letters_of(old: &str, word: &str) -> String {
    let is_capital = |at: usize| old.as_bytes().get(at).is_some_and(u8::is_ascii_uppercase);
    let capital = |(at, c): (usize, char)| if is_capital(at.min(1)) { c.to_ascii_uppercase() } else { c };
    word.chars().enumerate().map(capital).collect()
}

fn envelope(value: Option<&RawValue>, stamp: Time, provenance: &Provenance) -> String {
    let Provenance { quality, source, admission } = provenance;
    let shown = value.map_or_else(|| "null".to_owned(), json_value);
    let (lo, hi) = match value {
        Some(RawValue::Interval { lo, hi }) => (json_number(*lo), json_number(*hi)),
        _ => ("null".to_owned(), "null".to_owned()),
    };
    let (stamp, name, code) = (stamp.0, quality.name(), quality.code());
    let mut text = format!(
        r#"{{"value":{shown},"lo":{lo},"hi":{hi},"stamp_ns":{stamp},"quality":"{name}","status":{code},"source":"#
    );
    json::push_quoted(source, &mut text);
    if let Some(admission) = admission {
        admission.push_members(&mut text);
    }
    text.push('}');
    text
}

/// The number alone, of an interval the midpoint; a list in JSON.
#[must_use]
pub fn plain(value: &RawValue) -> String {
    if let RawValue::Vector(_) = value { json_value(value) } else { number(number_of(value)) }
}

fn json_value(value: &RawValue) -> String {
    let RawValue::Vector(values) = value else { return json_number(number_of(value)) };
    let mut text = String::with_capacity(values.len() * 8 + 2);
    text.push('[');
    for (index, value) in values.iter().enumerate() {
        let comma = if index > 0 { "," } else { "" };
        let _cannot_fail = write!(text, "{comma}{}", json_number(*value));
    }
    text.push(']');
    text
}

fn ends(value: &RawValue) -> Option<(f64, f64)> {
    match value {
        RawValue::Number(value) => Some((*value, *value)),
        RawValue::Interval { lo, hi } => Some((*lo, *hi)),
        RawValue::Vector(_) => None,
    }
}

fn number_of(value: &RawValue) -> f64 {
    ends(value).map_or(f64::NAN, |(lo, hi)| middle(lo, hi))
}

fn middle(lo: f64, hi: f64) -> f64 {
    if lo == hi { lo } else { lo / 2.0 + hi / 2.0 }
}

/// JSON has only `null` for values that are not finite.
fn json_number(value: f64) -> String {
    if value.is_finite() { number(value) } else { "null".to_owned() }
}

/// The shortest text that is read as the same number.
fn number(value: f64) -> String {
    let size = value.abs();
    if value.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}
