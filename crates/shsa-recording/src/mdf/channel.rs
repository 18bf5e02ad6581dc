//! Channels of an MDF 4 file: the place of a number, or of several, in a record.

use super::super::record::half;
use super::block::{Block, Blocks, Unread};
use super::conversion::Conversion;

/// The most elements of an array.
const ELEMENTS_MAX: u64 = 1 << 16;

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
    /// The channel is no field: it holds texts, bytes, values of variable length, or what is not read here.
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
    /// Whether it is the time of its group, read here or not.
    pub(super) is_time: bool,
    pub(super) bits: Bits,
    is_big: bool,
    /// The first byte in the record, and the lowest bit in that byte.
    pub(super) byte: usize,
    bit: usize,
    /// The number of bits.
    pub(super) length: usize,
    conversion: Conversion,
    validity: Validity,
    /// Where the values of variable length are, to which the number in the record is the way; `None` for all others.
    pub(super) variable: Option<u64>,
    pub(super) array: Option<Array>,
    /// What the channel holds that is not read here; `None` where it is read.
    pub(super) refused: Option<String>,
}

/// Which values are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Validity {
    All,
    None,
    /// Those with this bit after the record.
    Bit(usize),
}

/// The elements of an array within a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Array {
    pub(super) count: usize,
    /// The bytes from one element to the next.
    pub(super) step: usize,
    /// The validity bits from one element to the next.
    validity_step: usize,
}

impl Channel {
    /// Reads a channel.
    pub(super) fn of(block: &Block, blocks: &mut Blocks<'_>) -> Result<Channel, Unread> {
        let (kind, sync, data) = (block.u8(0), block.u8(1), block.u8(2));
        let bits = match data {
            0 | 1 => Bits::Unsigned,
            2 | 3 => Bits::Signed,
            4 | 5 => Bits::Float,
            _ => Bits::Bytes,
        };
        let (conversion, unit) = match block.link(4) {
            0 => (Conversion::None, String::new()),
            at => {
                let found = blocks.of_name(at, b"CC")?;
                (Conversion::of(&found, blocks, bits == Bits::Float), blocks.text(found.link(1)))
            }
        };
        let own = blocks.text(block.link(6));
        let role = match (kind, sync) {
            (2, 1) => Role::Time,
            (3, 1) => Role::VirtualTime,
            (0 | 2 | 5, _) if bits != Bits::Bytes => Role::Value,
            (3 | 6, _) => Role::Virtual,
            _ => Role::Other,
        };
        let flags = block.u32(12);
        let validity = match (flags & 1, flags & 2) {
            (1, _) => Validity::None,
            (_, 2) => Validity::Bit(block.u32(16) as usize),
            _ => Validity::All,
        };
        let channel = Channel {
            name: blocks.text(block.link(2)),
            unit: if own.is_empty() { unit } else { own },
            role,
            is_time: matches!(role, Role::Time | Role::VirtualTime),
            bits,
            is_big: matches!(data, 1 | 3 | 5),
            bit: usize::from(block.u8(3)),
            byte: block.u32(4) as usize,
            length: block.u32(8) as usize,
            conversion,
            validity,
            variable: matches!(kind, 1 | 7).then_some(block.link(5)),
            array: None,
            refused: None,
        };
        let refused = channel.problem(kind, data);
        Ok(channel.refuse(refused))
    }

    /// What of a channel of these kinds is not read here.
    fn problem(&self, kind: u8, data: u8) -> Option<String> {
        let is_record = matches!(self.role, Role::Value | Role::Time);
        let is_float = self.bits == Bits::Float && !matches!(self.length, 16 | 32 | 64);
        let what = match (kind, data) {
            (4, _) => "references to a stream".to_owned(),
            (8.., _) => format!("a channel of kind {kind}"),
            (_, 6..=9) => "texts".to_owned(),
            (_, 10..=12) => "bytes".to_owned(),
            (1 | 7, _) => "numbers of variable length".to_owned(),
            (_, 13 | 14) => "times of CANopen".to_owned(),
            (_, 15 | 16) => "complex numbers".to_owned(),
            (_, 17..) => format!("a data type of number {data}"),
            _ if is_record && (is_float || !(1..=64).contains(&self.length)) => {
                format!("numbers of {} bits", self.length)
            }
            _ => return self.conversion.refused().map(str::to_owned),
        };
        Some(what)
    }

    /// The channel, which is not read for this reason.
    pub(super) fn refuse(self, refused: Option<String>) -> Channel {
        let role = if refused.is_some() { Role::Other } else { self.role };
        Channel { role, refused, ..self }
    }

    /// The channel, whose values are arrays as this block says.
    pub(super) fn of_arrays(self, block: &Block) -> Channel {
        let (storage, dimensions, flags) = (block.u8(1), usize::from(block.u16(2)), block.u32(4));
        let sizes: Option<Vec<usize>> = (0..dimensions).map(|at| size(block.u64(16 + 8 * at))).collect();
        let count = sizes.and_then(|sizes| sizes.into_iter().try_fold(1_usize, usize::checked_mul));
        let count = count.filter(|count| (1..=ELEMENTS_MAX as usize).contains(count));
        let step = usize::try_from(block.u32(8).cast_signed()).ok();
        let problem = match (block.link(0), storage, step, count) {
            (1.., ..) => "arrays of arrays or of structures",
            (_, 1.., ..) => "arrays with a group for each element",
            (.., None, _) | (.., None) => "arrays of these sizes",
            // Bit 6: columns are stored one after the other.
            (0, 0, Some(step), Some(count)) if dimensions < 2 || flags & 0x40 == 0 => {
                let array = Array { count, step, validity_step: block.u32(12) as usize };
                return Channel { array: Some(array), ..self };
            }
            _ => "arrays by columns",
        };
        self.refuse(Some(problem.to_owned()))
    }

    /// The number of its values in a record.
    pub(super) fn count(&self) -> usize {
        self.array.map_or(1, |array| array.count)
    }

    /// The value in a record of this number; the validity bits follow after `data_length` bytes. `None` where there is none.
    pub(super) fn value(&self, record: &[u8], number: u64, data_length: usize) -> Option<f64> {
        self.element(record, number, data_length, (self.byte, 0))
    }

    /// The elements of the array in a record; those without a value are no numbers.
    pub(super) fn elements(&self, record: &[u8], number: u64, data_length: usize) -> Vec<f64> {
        let Some(Array { count, step, validity_step }) = self.array else { return Vec::new() };
        let place = |at: usize| (self.byte.saturating_add(at * step), at * validity_step);
        let element = |at| self.element(record, number, data_length, place(at)).unwrap_or(f64::NAN);
        (0..count).map(element).collect()
    }

    /// The value at a byte, whose validity bit is so many after the channel's.
    fn element(&self, record: &[u8], number: u64, data_length: usize, place: (usize, usize)) -> Option<f64> {
        let (byte, validity) = place;
        let is_missing = match self.validity {
            Validity::All => false,
            Validity::None => true,
            Validity::Bit(bit) => {
                let bit = bit.saturating_add(validity);
                record.get(data_length + bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
            }
        };
        if is_missing {
            return None;
        }
        let raw = match self.role {
            Role::Virtual | Role::VirtualTime => number as f64,
            Role::Value | Role::Time => self.raw(record.get(..data_length).unwrap_or(record), byte)?,
            Role::Other => return None,
        };
        self.conversion.apply(raw)
    }

    /// The number in the record that says where a value of variable length begins.
    pub(super) fn offset(&self, record: &[u8]) -> Option<u64> {
        self.bits_at(record, self.byte)
    }

    /// The bits of a number that begins at this byte.
    fn bits_at(&self, record: &[u8], byte: usize) -> Option<u64> {
        let count = (self.bit + self.length).div_ceil(8);
        let bytes = record.get(byte..byte.checked_add(count)?).filter(|_| (1..=64).contains(&self.length))?;
        let all = match self.is_big {
            true => bytes.iter().fold(0_u128, |all, byte| all << 8 | u128::from(*byte)),
            false => bytes.iter().rev().fold(0_u128, |all, byte| all << 8 | u128::from(*byte)),
        };
        u64::try_from(all >> self.bit & (u128::MAX >> (128 - self.length))).ok()
    }

    /// The number without conversion.
    fn raw(&self, record: &[u8], byte: usize) -> Option<f64> {
        let bits = self.bits_at(record, byte)?;
        Some(match (self.bits, self.length) {
            (Bits::Unsigned, _) => bits as f64,
            (Bits::Signed, length) => ((bits << (64 - length)).cast_signed() >> (64 - length)) as f64,
            (Bits::Float, 16) => half(u16::try_from(bits).ok()?),
            (Bits::Float, 32) => f32::from_bits(u32::try_from(bits).ok()?).into(),
            (Bits::Float, 64) => f64::from_bits(bits),
            (Bits::Float | Bits::Bytes, _) => return None,
        })
    }
}

/// The size of an array in one dimension; `None` where that is too much.
fn size(size: u64) -> Option<usize> {
    usize::try_from(size).ok().filter(|_| size <= ELEMENTS_MAX)
}
