//! Writes payloads.

use super::DataType;
use crate::wire::{put_bytes, put_double, put_varint};

/// A payload under construction.
#[derive(Clone, Debug)]
pub struct Writer {
    bytes: Vec<u8>,
    metric: Vec<u8>,
    part: Vec<u8>,
}

/// A metric to be written.
#[derive(Clone, Copy, Debug)]
pub struct NewMetric<'a> {
    /// The name.
    pub name: &'a str,
    /// When the value was true, milliseconds since 1970 (UTC).
    pub timestamp: u64,
    /// The type: births have it, data has none.
    pub data_type: Option<DataType>,
    /// The value; `None`: it has explicitly none.
    pub value: Option<NewValue<'a>>,
    /// The properties, in order.
    pub properties: &'a [(&'a str, Property<'a>)],
}

/// A value to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NewValue<'a> {
    /// Of [`DataType::UINT64`].
    Whole(u64),
    /// Of [`DataType::DOUBLE`].
    Number(f64),
    /// Of [`DataType::BOOLEAN`].
    Truth(bool),
    /// Of [`DataType::STRING`].
    Text(&'a str),
    /// Of [`DataType::DOUBLE_ARRAY`].
    Numbers(&'a [f64]),
}

/// The value of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Property<'a> {
    /// A signed whole number of 32 bits.
    Whole(i32),
    /// A number.
    Number(f64),
    /// A text.
    Text(&'a str),
}

impl NewValue<'_> {
    /// Its type.
    #[must_use]
    pub fn data_type(&self) -> DataType {
        match self {
            NewValue::Whole(_) => DataType::UINT64,
            NewValue::Number(_) => DataType::DOUBLE,
            NewValue::Truth(_) => DataType::BOOLEAN,
            NewValue::Text(_) => DataType::STRING,
            NewValue::Numbers(_) => DataType::DOUBLE_ARRAY,
        }
    }
}

impl Writer {
    /// A payload that is sent now, milliseconds since 1970 (UTC); deaths of edge nodes and commands have no sequence number.
    #[must_use]
    pub fn new(timestamp: u64, seq: Option<u8>) -> Writer {
        let mut bytes = Vec::new();
        put_varint(1, timestamp, &mut bytes);
        if let Some(seq) = seq {
            put_varint(3, seq.into(), &mut bytes);
        }
        Writer { bytes, metric: Vec::new(), part: Vec::new() }
    }

    /// Appends a metric.
    pub fn push(&mut self, metric: &NewMetric<'_>) {
        let Writer { bytes, metric: own, part } = self;
        own.clear();
        put_bytes(1, metric.name.as_bytes(), own);
        put_varint(3, metric.timestamp, own);
        if let Some(data_type) = metric.data_type {
            put_varint(4, data_type.0.into(), own);
        }
        if metric.value.is_none() {
            put_varint(7, 1, own);
        }
        if !metric.properties.is_empty() {
            part.clear();
            put_properties(metric.properties, part);
            put_bytes(9, part, own);
        }
        match metric.value {
            None => {}
            Some(NewValue::Whole(number)) => put_varint(11, number, own),
            Some(NewValue::Number(number)) => put_double(13, number, own),
            Some(NewValue::Truth(is)) => put_varint(14, is.into(), own),
            Some(NewValue::Text(text)) => put_bytes(15, text.as_bytes(), own),
            Some(NewValue::Numbers(numbers)) => {
                part.clear();
                numbers.iter().for_each(|number| part.extend_from_slice(&number.to_le_bytes()));
                put_bytes(16, part, own);
            }
        }
        put_bytes(2, own, bytes);
    }

    /// The bytes of the payload.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

fn put_properties(properties: &[(&str, Property<'_>)], set: &mut Vec<u8>) {
    for (key, _) in properties {
        put_bytes(1, key.as_bytes(), set);
    }
    let mut own = Vec::new();
    for (_, value) in properties {
        own.clear();
        match value {
            Property::Whole(number) => {
                put_varint(1, DataType::INT32.0.into(), &mut own);
                put_varint(3, (*number as u32).into(), &mut own);
            }
            Property::Number(number) => {
                put_varint(1, DataType::DOUBLE.0.into(), &mut own);
                put_double(6, *number, &mut own);
            }
            Property::Text(text) => {
                put_varint(1, DataType::STRING.0.into(), &mut own);
                put_bytes(8, text.as_bytes(), &mut own);
            }
        }
        put_bytes(2, &own, set);
    }
}
