//! Channels of an MDF 4 file: the place of a number in a record, and its conversion.

use super::block::{Block, Blocks, Unread};

/// The most values of a conversion table.
const VALUES_MAX: usize = 1 << 16;

/// The role of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The values are in the records.
    Value,
    /// The values are in the records, and are the time.
    Time,
    /// The value is computed from the number of the record.
    Virtual,
    /// The value is computed from the number of the record, and is the time.
    VirtualTime,
    /// The channel has no numbers: texts, bytes, values of variable length.
    Other,
}

/// The type of a channel's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bits {
    Unsigned,
    Signed,
    Float,
    Bytes,
}

/// A channel.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) role: Role,
    pub(super) bits: Bits,
    is_big: bool,
    /// The first byte in the record, and the lowest bit in that byte.
    pub(super) byte: usize,
    bit: usize,
    /// The number of bits.
    pub(super) length: usize,
    conversion: Conversion,
    /// The bit after the record that marks a missing value.
    invalid: Option<usize>,
}

/// The conversion from the number in the record to the value.
#[derive(Clone, Debug, PartialEq)]
enum Conversion {
    None,
    Linear {
        offset: f64,
        factor: f64,
    },
    Rational([f64; 6]),
    /// Pairs of a number and its value; between two pairs, the value is interpolated or that of the nearest pair.
    Table {
        pairs: Vec<(f64, f64)>,
        is_interpolated: bool,
    },
    /// From, to, value; and the value of all other numbers.
    Ranges {
        ranges: Vec<(f64, f64, f64)>,
        other: f64,
    },
    /// An unknown conversion: the number is the value.
    Unknown,
}

impl Channel {
    /// Reads a channel.
    pub(super) fn of(block: &Block, blocks: &mut Blocks<'_>) -> Result<Channel, Unread> {
        let (kind, sync, data) = (block.u8(0), block.u8(1), block.u8(2));
        let flags = block.u32(12);
        let (conversion, unit) = match block.link(4) {
            0 => (Conversion::None, String::new()),
            at => {
                let found = blocks.of_name(at, b"CC")?;
                (Conversion::of(&found), blocks.text(found.link(1)))
            }
        };
        let own = blocks.text(block.link(6));
        let bits = match data {
            0 | 1 => Bits::Unsigned,
            2 | 3 => Bits::Signed,
            4 | 5 => Bits::Float,
            _ => Bits::Bytes,
        };
        let role = match (kind, sync) {
            (2, 1) => Role::Time,
            (3, 1) => Role::VirtualTime,
            (0 | 2 | 5, _) if bits != Bits::Bytes => Role::Value,
            (3 | 6, _) => Role::Virtual,
            _ => Role::Other,
        };
        Ok(Channel {
            name: blocks.text(block.link(2)),
            unit: if own.is_empty() { unit } else { own },
            role,
            bits,
            is_big: matches!(data, 1 | 3 | 5),
            bit: usize::from(block.u8(3)),
            byte: block.u32(4) as usize,
            length: block.u32(8) as usize,
            conversion,
            invalid: (flags & 2 != 0).then_some(block.u32(16) as usize),
        })
    }

    /// The value in a record of this number; the validity bits follow after `data_length` bytes. `None` where there is none.
    pub(super) fn value(&self, record: &[u8], number: u64, data_length: usize) -> Option<f64> {
        if let Some(bit) = self.invalid
            && record.get(data_length + bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
        {
            return None;
        }
        let raw = match self.role {
            Role::Virtual | Role::VirtualTime => number as f64,
            Role::Value | Role::Time => self.raw(record.get(..data_length).unwrap_or(record))?,
            Role::Other => return None,
        };
        self.conversion.apply(raw)
    }

    /// The number without conversion.
    fn raw(&self, record: &[u8]) -> Option<f64> {
        let count = (self.bit + self.length).div_ceil(8);
        let bytes = record
            .get(self.byte..self.byte.checked_add(count)?)
            .filter(|_| (1..=64).contains(&self.length))?;
        let all = match self.is_big {
            true => bytes.iter().fold(0_u128, |all, byte| all << 8 | u128::from(*byte)),
            false => bytes.iter().rev().fold(0_u128, |all, byte| all << 8 | u128::from(*byte)),
        };
        let bits = u64::try_from(all >> self.bit & (u128::MAX >> (128 - self.length))).ok()?;
        Some(match (self.bits, self.length) {
            (Bits::Unsigned, _) => bits as f64,
            (Bits::Signed, length) => ((bits << (64 - length)).cast_signed() >> (64 - length)) as f64,
            (Bits::Float, 32) => f32::from_bits(u32::try_from(bits).ok()?).into(),
            (Bits::Float, 64) => f64::from_bits(bits),
            (Bits::Float | Bits::Bytes, _) => return None,
        })
    }
}

impl Conversion {
    fn of(block: &Block) -> Conversion {
        let count = usize::from(block.u16(6)).min(VALUES_MAX);
        let values: Vec<f64> = (0..count).map(|at| block.f64(24 + 8 * at)).collect();
        match (block.u8(0), values.as_slice()) {
            (0, _) => Conversion::None,
            (1, [offset, factor, ..]) => Conversion::Linear { offset: *offset, factor: *factor },
            (2, [a, b, c, d, e, f, ..]) => Conversion::Rational([*a, *b, *c, *d, *e, *f]),
            (kind @ (4 | 5), values) => {
                let pairs = values.as_chunks::<2>().0.iter().map(|[from, to]| (*from, *to)).collect();
                Conversion::Table { pairs, is_interpolated: kind == 4 }
            }
            (6, values) => {
                let (ranges, other) = values.as_chunks::<3>();
                let ranges = ranges.iter().map(|[from, to, value]| (*from, *to, *value)).collect();
                Conversion::Ranges { ranges, other: other.first().copied().unwrap_or(f64::NAN) }
            }
            // Conversion to texts: only the number can be compared.
            _ => Conversion::Unknown,
        }
    }

    fn apply(&self, raw: f64) -> Option<f64> {
        Some(match self {
            Conversion::None | Conversion::Unknown => raw,
            Conversion::Linear { offset, factor } => offset + factor * raw,
            Conversion::Rational([a, b, c, d, e, f]) => {
                (a * raw * raw + b * raw + c) / (d * raw * raw + e * raw + f)
            }
            Conversion::Table { pairs, is_interpolated } => return looked_up(pairs, raw, *is_interpolated),
            Conversion::Ranges { ranges, other } => {
                let found = ranges.iter().find(|(from, to, _)| (*from..=*to).contains(&raw));
                found.map_or(*other, |(_, _, value)| *value)
            }
        })
    }
}

/// The value in a table of ascending numbers; beyond its ends, the value of the end.
fn looked_up(pairs: &[(f64, f64)], raw: f64, is_interpolated: bool) -> Option<f64> {
    let at = pairs.partition_point(|(from, _)| *from <= raw);
    let (before, behind) = (at.checked_sub(1).and_then(|at| pairs.get(at)), pairs.get(at));
    Some(match (before, behind) {
        (Some((from, low)), Some((to, high))) if is_interpolated => {
            low + (raw - from) / (to - from) * (high - low)
        }
        (Some((from, low)), Some((to, high))) => {
            if raw - from <= to - raw {
                *low
            } else {
                *high
            }
        }
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(conversion: &Conversion, raw: f64, expected: Option<f64>) {
        assert_eq!(conversion.apply(raw), expected);
    }

    #[test]
    fn numbers_are_converted() {
        check(&Conversion::Linear { offset: -40.0, factor: 0.5 }, 100.0, Some(10.0));
        check(&Conversion::Rational([0.0, 1.0, 2.0, 0.0, 0.0, 4.0]), 6.0, Some(2.0));
        let pairs = vec![(0.0, 0.0), (10.0, 1.0), (20.0, 5.0)];
        let table = |is_interpolated| Conversion::Table { pairs: pairs.clone(), is_interpolated };
        for (raw, between, nearest) in
            [(-1.0, 0.0, 0.0), (10.0, 1.0, 1.0), (16.0, 3.4, 5.0), (99.0, 5.0, 5.0)]
        {
            check(&table(true), raw, Some(between));
            check(&table(false), raw, Some(nearest));
        }
        let ranges = Conversion::Ranges { ranges: vec![(0.0, 1.0, 7.0)], other: 9.0 };
        check(&ranges, 0.5, Some(7.0));
        check(&ranges, 2.0, Some(9.0));
        check(&Conversion::Table { pairs: Vec::new(), is_interpolated: true }, 1.0, None);
    }
}
