//! The kinds of fields, and the numbers of their bytes.

use crate::wire::{BYTES, FIXED32, FIXED64, Fields, VARINT, Wire};

/// The kind of a field, or of its elements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Double,
    Float,
    /// Whole numbers of variable length: signed, unsigned, zigzag, and truth values.
    Signed,
    Unsigned,
    Folded,
    Fixed32,
    Fixed64,
    SignedFixed32,
    SignedFixed64,
    Text,
    Bytes,
    Message(String),
}

impl Kind {
    /// The number of a wire value.
    fn number(&self, wire: u64) -> f64 {
        match self {
            Kind::Double => f64::from_bits(wire),
            Kind::Float => f64::from(f32::from_bits(wire as u32)),
            Kind::Signed | Kind::SignedFixed64 => wire as i64 as f64,
            Kind::SignedFixed32 => f64::from(wire as u32 as i32),
            Kind::Folded => ((wire >> 1) as i64 ^ -((wire & 1) as i64)) as f64,
            _ => wire as f64,
        }
    }

    /// The wire type of one value.
    pub(super) fn wire_type(&self) -> u64 {
        match self {
            Kind::Double | Kind::Fixed64 | Kind::SignedFixed64 => FIXED64,
            Kind::Float | Kind::Fixed32 | Kind::SignedFixed32 => FIXED32,
            Kind::Text | Kind::Bytes | Kind::Message(_) => BYTES,
            Kind::Signed | Kind::Unsigned | Kind::Folded => VARINT,
        }
    }

    /// Passes on each number of these values; `None` where packed ones do not end with the bytes.
    pub(super) fn each<'a>(
        &self,
        values: impl Iterator<Item = Wire<'a>>,
        pass: &mut impl FnMut(f64),
    ) -> Option<()> {
        for value in values {
            match value {
                Wire::Number(number) => pass(self.number(number)),
                Wire::Bytes(packed) => self.unpack(packed, pass)?,
            }
        }
        Some(())
    }

    /// Passes on packed numbers.
    fn unpack(&self, packed: &[u8], pass: &mut impl FnMut(f64)) -> Option<()> {
        let mut rest = Fields::of(packed);
        while !rest.is_at_end() {
            let wire = match self {
                Kind::Double | Kind::Fixed64 | Kind::SignedFixed64 => {
                    u64::from_le_bytes(*rest.bytes(8)?.first_chunk()?)
                }
                Kind::Float | Kind::Fixed32 | Kind::SignedFixed32 => {
                    u32::from_le_bytes(*rest.bytes(4)?.first_chunk()?).into()
                }
                _ => rest.varint()?,
            };
            pass(self.number(wire));
        }
        Some(())
    }
}
