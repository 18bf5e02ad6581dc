//! Numbers and times as the bytes of CDR, little-endian.

use crate::payload::Unreadable;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::ros::Primitive;

/// The encapsulation: little-endian, no options.
pub(crate) const HEADER: [u8; 4] = [0, 1, 0, 0];

pub(super) fn mismatch(found: &str, wanted: &'static str) -> Unreadable {
    Unreadable::Kind { field: "the value".into(), found: found.into(), wanted }
}

/// The numbers of a value for a field; of an interval, the midpoint.
pub(super) fn numbers(
    value: &RawValue,
    is_list: bool,
    length: Option<usize>,
) -> Result<Vec<f64>, Unreadable> {
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

/// Seconds and nanoseconds, little-endian.
pub(crate) fn time_parts(time: Time) -> ([u8; 4], [u8; 4]) {
    let second = 1_000_000_000;
    let seconds =
        i32::try_from(time.0.div_euclid(second)).unwrap_or(if time.0 < 0 { i32::MIN } else { i32::MAX });
    let nanoseconds = u32::try_from(time.0.rem_euclid(second)).unwrap_or(0);
    (seconds.to_le_bytes(), nanoseconds.to_le_bytes())
}

/// A number in the encoding of a field, little-endian; a whole number is rounded and clamped to the field's range.
pub(super) fn encoded(primitive: Primitive, number: f64) -> Result<Vec<u8>, Unreadable> {
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
