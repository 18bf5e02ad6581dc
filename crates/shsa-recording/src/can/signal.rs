//! The numbers in the bytes of a CAN frame: the place of their bits, their type, and when they are present.

/// The order in which the bits of a number are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Intel, `@1`: the start is the lowest bit.
    Little,
    /// Motorola, `@0`: the start is the highest bit; bits go down within a byte and then on to the next.
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Unsigned,
    Signed,
    /// A float of 32 or 64 bits, by its length.
    Float,
}

/// When a signal is in a message: when its selector has one of these values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    /// The index of the selecting signal.
    pub(super) selector: usize,
    /// Ranges of values, with both ends.
    pub(super) ranges: Vec<(u64, u64)>,
}

/// A signal of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Signal {
    pub(super) name: String,
    pub(super) start: usize,
    /// In bits, 1 to 64.
    pub(super) length: usize,
    pub(super) order: Order,
    pub(super) kind: Kind,
    pub(super) factor: f64,
    pub(super) offset: f64,
    pub(super) unit: String,
    /// `None`: the signal is always in the message.
    pub(super) choice: Option<Choice>,
}

/// The value of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    Whole(i64),
    Real(f64),
}

impl Signal {
    /// The bits of the number; `None` where the frame is too short.
    pub(super) fn raw(&self, data: &[u8]) -> Option<u64> {
        match self.order {
            Order::Little => little(data, self.start, self.length),
            Order::Big => big(data, self.start, self.length),
        }
    }

    /// The value; `None` where the frame is too short.
    pub(super) fn value(&self, data: &[u8]) -> Option<Number> {
        let raw = self.raw(data)?;
        let signed = (raw << (64 - self.length)).cast_signed() >> (64 - self.length);
        let number = match self.kind {
            Kind::Float if self.length == 32 => f32::from_bits(u32::try_from(raw).ok()?).into(),
            Kind::Float if self.length == 64 => f64::from_bits(raw),
            Kind::Float => return None,
            Kind::Signed if self.is_plain() => return Some(Number::Whole(signed)),
            Kind::Signed => signed as f64,
            Kind::Unsigned => match i64::try_from(raw) {
                Ok(whole) if self.is_plain() => return Some(Number::Whole(whole)),
                _ => raw as f64,
            },
        };
        Some(Number::Real(number * self.factor + self.offset))
    }

    fn is_plain(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }
}

/// Bits from the lowest one on, counted through the bytes. `O(bytes)`.
fn little(data: &[u8], start: usize, length: usize) -> Option<u64> {
    let bytes = data.get(start / 8..(start + length).div_ceil(8))?;
    let all = bytes.iter().rev().fold(0_u128, |all, byte| all << 8 | u128::from(*byte));
    lowest(all >> (start % 8), length)
}

/// Bits from the highest one on. The highest bit is numbered as the bits of a byte are: 7 is the first bit of the first byte.
fn big(data: &[u8], start: usize, length: usize) -> Option<u64> {
    let first = start / 8 * 8 + 7 - start % 8;
    let bytes = data.get(first / 8..(first + length).div_ceil(8))?;
    let all = bytes.iter().fold(0_u128, |all, byte| all << 8 | u128::from(*byte));
    lowest(all >> (bytes.len() * 8 - first % 8 - length), length)
}

fn lowest(bits: u128, length: usize) -> Option<u64> {
    u64::try_from(bits & (u128::MAX >> (128 - length))).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(start: usize, length: usize, order: Order, kind: Kind) -> Signal {
        let (name, unit) = (String::new(), String::new());
        Signal { name, start, length, order, kind, factor: 1.0, offset: 0.0, unit, choice: None }
    }

    #[test]
    fn bits_are_counted_from_either_end() {
        let data = [0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc, 0xde, 0xf0];
        #[track_caller]
        fn check(data: &[u8], order: Order, start: usize, length: usize, expected: Option<u64>) {
            assert_eq!(signal(start, length, order, Kind::Unsigned).raw(data), expected);
        }
        check(&data, Order::Little, 0, 16, Some(0x3412));
        check(&data, Order::Little, 4, 8, Some(0x41));
        check(&data, Order::Little, 0, 64, Some(0xf0de_bc9a_7856_3412));
        check(&data, Order::Little, 60, 5, None);
        check(&data, Order::Big, 7, 16, Some(0x1234));
        check(&data, Order::Big, 3, 8, Some(0x23));
        check(&data, Order::Big, 7, 64, Some(0x1234_5678_9abc_def0));
        check(&data, Order::Big, 56, 2, None);
        check(&[0xff; 9], Order::Little, 3, 64, Some(u64::MAX));
    }

    #[test]
    fn bits_are_numbers() {
        #[track_caller]
        fn check(signal: &Signal, data: &[u8], expected: Option<Number>) {
            assert_eq!(signal.value(data), expected);
        }
        check(&signal(0, 12, Order::Little, Kind::Signed), &[0xff, 0x0f], Some(Number::Whole(-1)));
        check(&signal(0, 64, Order::Little, Kind::Signed), &[0xff; 8], Some(Number::Whole(-1)));
        check(&signal(0, 64, Order::Little, Kind::Unsigned), &[0xff; 8], Some(Number::Real(u64::MAX as f64)));
        check(&signal(0, 32, Order::Little, Kind::Float), &1.5_f32.to_le_bytes(), Some(Number::Real(1.5)));
        check(&signal(7, 64, Order::Big, Kind::Float), &(-2.5_f64).to_be_bytes(), Some(Number::Real(-2.5)));
        check(&signal(0, 16, Order::Little, Kind::Float), &[0; 2], None);
        let scaled = Signal { factor: 0.5, offset: -10.0, ..signal(0, 8, Order::Little, Kind::Signed) };
        check(&scaled, &[0xfe], Some(Number::Real(-11.0)));
    }
}
