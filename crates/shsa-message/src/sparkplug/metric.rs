//! Reads payloads and their metrics.

use super::{DataType, QUALITY, quality};
use crate::wire::{Fields, Wire, put_bytes, put_varint};

/// The fields of a payload.
const TIMESTAMP: u64 = 1;
const METRIC: u64 = 2;
const SEQ: u64 = 3;
/// The fields of a metric.
const NAME: u64 = 1;
const DATA_TYPE: u64 = 4;

/// A payload of Sparkplug B.
#[derive(Clone, Copy, Debug)]
pub struct Payload<'a> {
    /// When the message was sent, milliseconds since 1970 (UTC).
    pub timestamp: Option<u64>,
    /// The sequence number.
    pub seq: Option<u64>,
    bytes: &'a [u8],
}

/// The value of a metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// None on the wire.
    Absent,
    /// The bits of a whole number; the [type](DataType) gives its sign.
    Whole(u64),
    /// A number.
    Float(f64),
    /// A truth value.
    Truth(bool),
    /// A text.
    Text(&'a str),
    /// Bytes: a file, or the elements of an array.
    Bytes(&'a [u8]),
    /// A data set, a template, or an extension.
    Structure,
}

/// A metric of a payload.
#[derive(Clone, Copy, Debug)]
pub struct Metric<'a> {
    /// The name; a metric of a birth has one.
    pub name: Option<&'a str>,
    /// The number that stands for the name until the next birth.
    pub alias: Option<u64>,
    /// When the value was captured, milliseconds since 1970 (UTC).
    pub timestamp: Option<u64>,
    /// The type; a metric of a birth has one.
    pub data_type: Option<DataType>,
    /// Whether the value is not the present one.
    pub is_historical: bool,
    /// Whether it has explicitly no value.
    pub is_null: bool,
    /// The value.
    pub value: Value<'a>,
    properties: Option<&'a [u8]>,
}

impl<'a> Payload<'a> {
    /// Reads a payload; `None`: the bytes are none. `O(bytes)`, without an allocation.
    #[must_use]
    pub fn read(bytes: &'a [u8]) -> Option<Payload<'a>> {
        let mut payload = Payload { timestamp: None, seq: None, bytes };
        let mut fields = Fields::of(bytes);
        for (field, value) in fields.by_ref() {
            match (field, value) {
                (TIMESTAMP, Wire::Number(timestamp)) => payload.timestamp = Some(timestamp),
                (SEQ, Wire::Number(seq)) => payload.seq = Some(seq),
                (METRIC, Wire::Bytes(metric)) => _ = Metric::read(metric)?,
                (TIMESTAMP | METRIC | SEQ, _) => return None,
                _ => {}
            }
        }
        (!fields.is_broken()).then_some(payload)
    }

    /// The metrics, in order.
    pub fn metrics(&self) -> impl Iterator<Item = Metric<'a>> + Clone + use<'a> {
        Fields::of(self.bytes).filter_map(|(field, value)| match (field, value) {
            (METRIC, Wire::Bytes(metric)) => Metric::read(metric),
            _ => None,
        })
    }
}

impl<'a> Metric<'a> {
    fn read(bytes: &'a [u8]) -> Option<Metric<'a>> {
        let mut metric = Metric {
            name: None,
            alias: None,
            timestamp: None,
            data_type: None,
            is_historical: false,
            is_null: false,
            value: Value::Absent,
            properties: None,
        };
        let mut fields = Fields::of(bytes);
        for (field, value) in fields.by_ref() {
            metric.take(field, value)?;
        }
        (!fields.is_broken()).then_some(metric)
    }

    /// Takes in a field; `None`: its encoding is not that of the format.
    fn take(&mut self, field: u64, value: Wire<'a>) -> Option<()> {
        match (field, value) {
            (NAME, Wire::Bytes(name)) => self.name = Some(std::str::from_utf8(name).ok()?),
            (2, Wire::Number(alias)) => self.alias = Some(alias),
            (3, Wire::Number(timestamp)) => self.timestamp = Some(timestamp),
            (DATA_TYPE, Wire::Number(number)) => self.data_type = Some(DataType(u32::try_from(number).ok()?)),
            (5, Wire::Number(is)) => self.is_historical = is != 0,
            (7, Wire::Number(is)) => self.is_null = is != 0,
            (9, Wire::Bytes(properties)) => self.properties = Some(properties),
            (10 | 11, Wire::Number(bits)) => self.value = Value::Whole(bits),
            (12, Wire::Number(bits)) => self.value = Value::Float(f32::from_bits(bits as u32).into()),
            (13, Wire::Number(bits)) => self.value = Value::Float(f64::from_bits(bits)),
            (14, Wire::Number(is)) => self.value = Value::Truth(is != 0),
            (15, Wire::Bytes(text)) => self.value = Value::Text(std::str::from_utf8(text).ok()?),
            (16, Wire::Bytes(bytes)) => self.value = Value::Bytes(bytes),
            (17..=19, Wire::Bytes(_)) => self.value = Value::Structure,
            (NAME..=19, _) => return (field == 6 || field == 8).then_some(()),
            _ => {}
        }
        Some(())
    }

    /// The value as a number; `None` for texts, bytes and structures.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self.value {
            Value::Whole(bits) => Some(self.data_type.unwrap_or(DataType::UINT64).whole(bits)),
            Value::Float(number) => Some(number),
            Value::Truth(is) => Some(f64::from(u8::from(is))),
            _ => None,
        }
    }

    /// The elements of an array of numbers; `None` for other values.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let Value::Bytes(bytes) = self.value else { return None };
        self.data_type?.elements(bytes)
    }

    /// Whether the type has to be known for the value, and is not here.
    #[must_use]
    pub fn lacks_type(&self) -> bool {
        self.data_type.is_none() && matches!(self.value, Value::Whole(_) | Value::Bytes(_))
    }

    /// The code of its quality: that of the property `Quality`, else [good](quality::GOOD).
    #[must_use]
    pub fn quality(&self) -> i32 {
        let value = self.property(QUALITY).and_then(|mut value| {
            value.find_map(|(field, value)| match (field, value) {
                (3 | 4, Wire::Number(bits)) => Some(bits as i32),
                _ => None,
            })
        });
        value.unwrap_or(quality::GOOD)
    }

    /// The text of a property.
    #[must_use]
    pub fn text_property(&self, key: &str) -> Option<&'a str> {
        self.property(key)?.find_map(|(field, value)| match (field, value) {
            (8, Wire::Bytes(text)) => std::str::from_utf8(text).ok(),
            _ => None,
        })
    }

    /// The fields of a property's value: keys and values are two lists.
    fn property(&self, key: &str) -> Option<Fields<'a>> {
        let fields = Fields::of(self.properties?);
        let parts = |asked: u64| {
            fields.filter_map(move |(field, value)| match value {
                Wire::Bytes(bytes) if field == asked => Some(bytes),
                _ => None,
            })
        };
        let at = parts(1).position(|found| found == key.as_bytes())?;
        parts(2).nth(at).map(Fields::of)
    }
}

/// What a birth declares of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Known<'k> {
    /// The name.
    pub name: &'k str,
    /// The type.
    pub data_type: DataType,
}

/// The payload with the names and types of its metrics added where `known` gives them; metrics for which it gives none are left
/// out. `payload` must be one that was [read](Payload::read).
#[must_use]
pub fn resolved<'k>(payload: &[u8], known: impl Fn(&Metric<'_>) -> Option<Known<'k>>) -> Vec<u8> {
    let mut whole = Vec::with_capacity(payload.len() + 64);
    let mut added = Vec::new();
    for (field, value) in Fields::of(payload) {
        match (field, value) {
            (METRIC, Wire::Bytes(bytes)) => {
                let Some(metric) = Metric::read(bytes) else { continue };
                let Some(known) = known(&metric) else { continue };
                added.clear();
                added.extend_from_slice(bytes);
                if metric.name.is_none() {
                    put_bytes(NAME, known.name.as_bytes(), &mut added);
                }
                if metric.data_type.is_none() {
                    put_varint(DATA_TYPE, known.data_type.0.into(), &mut added);
                }
                put_bytes(METRIC, &added, &mut whole);
            }
            (TIMESTAMP | SEQ, Wire::Number(number)) => put_varint(field, number, &mut whole),
            _ => {}
        }
    }
    whole
}
