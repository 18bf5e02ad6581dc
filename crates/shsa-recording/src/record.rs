//! Records of fixed fields, as flight controllers log them: the place and the scaling of each number.

use super::topic::{Body, Field, Value};

/// The type of a field; numbers are little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
    /// A byte of a text.
    Char,
}

impl Scalar {
    /// The length in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 | Scalar::Char => 1,
            Scalar::I16 | Scalar::U16 | Scalar::F16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }

    /// The number at a place; `None` where the bytes end before.
    #[inline]
    pub(super) fn number(self, bytes: &[u8], at: usize) -> Option<f64> {
        Some(match self {
            Scalar::F16 => half(u16::from_le_bytes(array(bytes, at)?)),
            Scalar::F32 => f32::from_le_bytes(array(bytes, at)?).into(),
            Scalar::F64 => f64::from_le_bytes(array(bytes, at)?),
            Scalar::U64 => u64::from_le_bytes(array(bytes, at)?) as f64,
            whole => whole.whole(bytes, at)? as f64,
        })
    }

    /// The whole number at a place; `None` where the bytes end before, the type is no integer, or the number does not fit.
    #[inline]
    pub(super) fn whole(self, bytes: &[u8], at: usize) -> Option<i64> {
        Some(match self {
            Scalar::I8 => i8::from_le_bytes(array(bytes, at)?).into(),
            Scalar::U8 | Scalar::Char => u8::from_le_bytes(array(bytes, at)?).into(),
            Scalar::I16 => i16::from_le_bytes(array(bytes, at)?).into(),
            Scalar::U16 => u16::from_le_bytes(array(bytes, at)?).into(),
            Scalar::I32 => i32::from_le_bytes(array(bytes, at)?).into(),
            Scalar::U32 => u32::from_le_bytes(array(bytes, at)?).into(),
            Scalar::I64 => i64::from_le_bytes(array(bytes, at)?),
            Scalar::U64 => u64::from_le_bytes(array(bytes, at)?).try_into().ok()?,
            Scalar::F16 | Scalar::F32 | Scalar::F64 => return None,
        })
    }
}

/// `N` bytes at a place; `None` where the bytes end before.
#[inline]
pub(super) fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// A number of 16 bits by IEEE 754.
pub(super) fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2_f64.powi(-24),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (1024.0 + fraction) * 2_f64.powi(exponent - 25),
    };
    if bits & 0x8000 == 0 { size } else { -size }
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slot {
    /// The name; `esc[1].rpm` for a field within another one.
    pub(super) name: String,
    /// The type.
    pub(super) scalar: Scalar,
    /// The place of the first byte in the record.
    pub(super) at: usize,
    /// The number of elements; `None`: a single value, no list.
    pub(super) count: Option<usize>,
    /// The divisor of the number in the bytes.
    pub(super) divisor: f64,
    /// The factor after the division.
    pub(super) factor: f64,
    /// The unit of the value; empty where it is unknown.
    pub(super) unit: String,
}

impl Slot {
    /// A field that is not scaled.
    pub(super) fn new(name: impl Into<String>, scalar: Scalar, at: usize, count: Option<usize>) -> Slot {
        Slot { name: name.into(), scalar, at, count, divisor: 1.0, factor: 1.0, unit: String::new() }
    }

    /// The field as a listener receives it.
    pub(super) fn field(&self) -> Field {
        Field { name: self.name.clone(), unit: (!self.unit.is_empty()).then(|| self.unit.clone()) }
    }

    /// Whether the field is a text.
    pub(super) fn is_text(&self) -> bool {
        self.scalar == Scalar::Char && self.count.is_some()
    }

    /// The number of elements, where the field is a list of numbers.
    fn list(&self) -> Option<usize> {
        self.count.filter(|_| !self.is_text())
    }

    /// The scaled number; for a list, the element of this index.
    #[inline]
    pub(super) fn number(&self, record: &[u8], element: usize) -> Option<f64> {
        if element >= self.count.unwrap_or(1) {
            return None;
        }
        let number = self.scalar.number(record, self.at + element * self.scalar.size())?;
        Some(number / self.divisor * self.factor)
    }

    /// The text up to its first zero; `None` also where it is no UTF-8.
    pub(super) fn text<'a>(&self, record: &'a [u8]) -> Option<&'a str> {
        let bytes = record.get(self.at..self.at + self.count.filter(|_| self.is_text())?)?;
        std::str::from_utf8(bytes.split(|byte| *byte == 0).next()?).ok()
    }

    /// The value of the field: a number or a text.
    fn value<'a>(&self, record: &'a [u8]) -> Value<'a> {
        if self.is_text() {
            return self.text(record).map_or(Value::Missing, Value::Text);
        }
        // An unscaled number stays exact: the 53 bits of a float are too few for nanoseconds.
        let whole = self.scalar.whole(record, self.at).filter(|_| self.divisor == 1.0 && self.factor == 1.0);
        whole
            .map(Value::Whole)
            .or_else(|| self.number(record, 0).map(Value::Number))
            .unwrap_or(Value::Missing)
    }
}

/// Converts records to the bodies that listeners take; the memory for lists is reused.
#[derive(Default)]
pub(super) struct Records {
    numbers: Vec<f64>,
}

impl Records {
    /// Passes the values of these fields in a record to `take`, in their order.
    pub(super) fn pass(&mut self, slots: &[Slot], record: &[u8], take: impl FnOnce(Body<'_>)) {
        self.numbers.clear();
        let lists = slots.iter().filter(|slot| slot.list().is_some());
        for slot in lists {
            let elements = (0..slot.list().unwrap_or(0)).map(|element| slot.number(record, element));
            self.numbers.extend(elements.map(|number| number.unwrap_or(f64::NAN)));
        }
        let mut numbers = &*self.numbers;
        let value = |slot: &Slot| match slot.list().and_then(|count| numbers.split_at_checked(count)) {
            Some((list, rest)) => {
                numbers = rest;
                Value::List(list)
            }
            None => slot.value(record),
        };
        let values: Vec<Value<'_>> = slots.iter().map(value).collect();
        take(Body::Values(&values));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_numbers() {
        let cases =
            [(0x0000, 0.0), (0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65_504.0), (0x0001, 2_f64.powi(-24))];
        for (bits, expected) in cases {
            assert_eq!(half(bits), expected, "{bits:x}");
        }
        assert_eq!(half(0xfc00), f64::NEG_INFINITY);
        assert!(half(0x7e00).is_nan());
    }

    #[test]
    fn numbers_are_read_and_scaled_within_the_record_only() {
        let record = [0xff, 0xff, 0x10, 0x27, b'a', b'b', 0, b'c'];
        let slot = Slot { divisor: 100.0, ..Slot::new("x", Scalar::I16, 0, Some(2)) };
        assert_eq!((slot.number(&record, 0), slot.number(&record, 1)), (Some(-0.01), Some(100.0)));
        assert_eq!((slot.number(&record, 2), slot.number(&record[..3], 1)), (None, None));
        let text = Slot::new("name", Scalar::Char, 4, Some(4));
        assert_eq!(text.text(&record), Some("ab"));
        assert_eq!(text.text(&record[..6]), None);
        assert_eq!(Scalar::U64.whole(&[0xff; 8], 0), None);
    }

    #[test]
    fn a_record_becomes_one_value_for_each_field() {
        let slots = [
            Slot::new("a", Scalar::U8, 0, None),
            Slot::new("list", Scalar::U8, 1, Some(2)),
            Slot { factor: 0.5, ..Slot::new("half", Scalar::U8, 2, None) },
            Slot::new("text", Scalar::Char, 3, Some(2)),
            Slot::new("beyond", Scalar::U16, 4, None),
        ];
        let mut shown = String::new();
        let show = |body: Body<'_>| match body {
            Body::Values(values) => format!("{values:?}"),
            Body::Columns(_) | Body::Bytes(_) | Body::Members(_) => String::new(),
        };
        Records::default().pass(&slots, &[1, 2, 3, b'x', 0], |body| shown = show(body));
        assert_eq!(shown, "[Whole(1), List([2.0, 3.0]), Number(1.5), Text(\"x\"), Missing]");
    }
}
